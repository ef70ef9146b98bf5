"""Several drives on one curvilinear coordinate, and their signals over it.

    start       every drive's own s, 0 where its log begins: right for logs that begin at the same place
    ends        the same, stretched so that all are as long as the first: right if they end at the same place too
    position    along the path of the first drive (`position.py`), from latitude and longitude

"auto" takes positions where all logs have them, else the start.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from codriver.drivers.course import Course, course_of, over, speed_of
from codriver.drivers.position import has_position, path_of, place
from codriver.drivers.slopes import slope_percent
from codriver.errors import UsageError
from codriver.estimate import Estimate
from codriver.signals.signal import Array
from codriver.summary import measured_on_ticks

How = Literal["auto", "start", "ends", "position"]
HOWS = ("auto", "start", "ends", "position")
MOST_PLACES = 30_000
_MEASURED = ("accelerator_pedal", "brake_pressure")
_ESTIMATED = ("intentional_acceleration", "intentional_jerk")


@dataclass(frozen=True, eq=False)
class Along:
    """Signals of several drivers over the same places.

    Attributes:
        places: s, m, shape (n,), evenly spaced.
        step: between them, m.
        signals: by driver, then by name: speed (m/s), accelerator_pedal, brake_pressure (Pa), intentional_acceleration (m/s^2),
            intentional_jerk (m/s^3), slope (per cent), shape (n,) each, NaN where there is none. Estimates are as late
            as they are; where the car stood, the first moment counts.
    """

    places: Array
    step: float
    signals: Mapping[str, Mapping[str, Array]] = field(repr=False)


def align(estimates: Sequence[Estimate], how: How = "auto") -> tuple[list[Course], str]:
    """Courses on one coordinate, and how they were aligned.

    Args:
        estimates: the drives; the first is the reference.
        how: see the module.

    Raises:
        UsageError: `how` is none of HOWS, or positions are asked for and a log has none or is on another road.
        MissingSignal: a log has no distance and no speed.
    """
    if how not in HOWS:
        raise UsageError(f"alignment '{how}'", f"one of {', '.join(HOWS)}", "choose one")
    if how == "position" or (how == "auto" and len(estimates) > 1 and all(has_position(e) for e in estimates)):
        path = path_of(estimates[0])
        return [place(estimate, path) for estimate in estimates], "position"
    courses = [course_of(estimate) for estimate in estimates]
    if how == "ends":
        whole = courses[0].length
        if min(course.length for course in courses) <= 0:
            raise UsageError("a drive without any way", "drives from one place to another", "align by the start")
        courses = [replace(course, s=course.s * (whole / course.length)) for course in courses]
        return courses, "ends"
    return courses, "start"


def along(
    estimates: Mapping[str, Estimate],
    courses: Mapping[str, Course],
    start: float | None = None,
    stop: float | None = None,
) -> Along:
    """The signals of drivers over common places.

    Args:
        estimates, courses: by driver.
        start, stop: m; by default from the first place of any to the last.
    """
    first = min(float(course.s[0]) for course in courses.values()) if start is None else start
    last = max(float(course.s[-1]) for course in courses.values()) if stop is None else stop
    step = max(1.0, (last - first) / MOST_PLACES)
    places = np.asarray(first + step * np.arange(max(int((last - first) / step) + 1, 1)), np.float64)
    found = {}
    for name, estimate in estimates.items():
        course, valid = courses[name], estimate.valid
        speed = speed_of(estimate)
        mine: dict[str, Array] = {}
        if speed is not None:
            mine["speed"] = over(course, speed, places)
        for signal in _MEASURED:
            if signal in estimate.log and len(estimate.log[signal]):
                mine[signal] = over(course, measured_on_ticks(estimate, signal), places)
        for signal in _ESTIMATED:
            if signal in estimate:
                mine[signal] = over(course, estimate.columns[signal], places, valid)
        if "acceleration_offset" in estimate:
            mine["slope"] = over(course, slope_percent(estimate.columns["acceleration_offset"]), places, valid)
        found[name] = mine
    return Along(places, step, found)
