"""How far along: the curvilinear coordinate s of an estimate, and its signals over s instead of t.

    s(t) = integral of |v| dt        from the estimated speed, the measured one where the estimator has none; or
    s(t) = distance(t) - distance(0)  where the log has the signal `distance` and it never runs backwards.

An integral drifts. A wheel that is 1 % larger than thought makes 10 m on each kilometre, whatever the filter says, since both its
speed and its s follow the wheel; that part is not known here. The other part is: the speed's standard deviation, taken as fully
correlated in time, gives at most integral of sd(v) dt (`drift`). A log with both speed and distance shows how far they
part (`disagreement`). Positions take the drift out (`position.py`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from codriver.errors import MissingSignal
from codriver.estimate import Estimate
from codriver.signals.signal import Array
from codriver.summary import measured_on_ticks

SPEED, DISTANCE = "longitudinal_speed", "distance"
_BACKWARDS = 5.0  # m: a distance that falls by more has been reset, such as at each lap
_MOVING = 0.3  # m/s: below it the place does not change


@dataclass(frozen=True, eq=False)
class Course:
    """Where an estimate was, tick by tick.

    Attributes:
        s: distance from its start, m, shape (n,), not decreasing.
        source: what it is from: "speed", "distance" or "position".
        drift: bound of the random part of the drift at the end, m; None where it is not known.
        disagreement: of speed and distance at the end, as a share of the way; None where the log has one of them.
    """

    s: Array
    source: str
    drift: float | None = None
    disagreement: float | None = None

    @property
    def length(self) -> float:
        """m."""
        return float(self.s[-1] - self.s[0]) if self.s.size else 0.0

    def within(self, start: float | None, stop: float | None) -> npt.NDArray[np.bool_]:
        """Which ticks lie from `start` to `stop` (m; None for no bound), shape (n,)."""
        inside = np.ones(self.s.size, bool)
        if start is not None:
            inside &= self.s >= start
        if stop is not None:
            inside &= self.s < stop
        return inside


def course_of(estimate: Estimate) -> Course:
    """The course of an estimate from its start on; see the module.

    Raises:
        MissingSignal: there is neither distance nor speed.
    """
    speed = speed_of(estimate)
    if speed is None and DISTANCE not in estimate.log:
        raise MissingSignal(
            f"{estimate.log.source or 'the log'} has neither {SPEED} nor {DISTANCE}",
            "one of them", "map one in the names file, or compare without the curvilinear coordinate",
        )  # fmt: skip
    driven = None if speed is None else _integral(speed, estimate.grid.dt)
    measured = _measured(estimate)
    if measured is not None:
        way = float(measured[-1] - measured[0])
        apart = None if driven is None or way <= 0 else float(driven[-1]) / way - 1.0
        return Course(measured, "distance", None, apart)
    if driven is None:
        raise MissingSignal(
            f"{estimate.log.source or 'the log'}: {DISTANCE} runs backwards and there is no {SPEED}",
            "a distance that grows", "map the speed in the names file",
        )  # fmt: skip
    sd = estimate.sd(SPEED)
    return Course(driven, "speed", None if sd is None else float(np.nansum(sd) * estimate.grid.dt))


def speed_of(estimate: Estimate) -> Array | None:
    """|v| on the ticks, m/s, shape (n,), NaN where it is not known; None where there is no speed at all."""
    if SPEED in estimate:
        speed = np.abs(estimate.columns[SPEED])
        return np.where(estimate.flag("standstill"), 0.0, speed)
    if SPEED in estimate.log and len(estimate.log[SPEED]) and len(estimate.grid):
        return np.abs(measured_on_ticks(estimate, SPEED))
    return None


def over(course: Course, values: Array, places: Array, known: npt.NDArray[np.bool_] | None = None) -> Array:
    """Values on the ticks of a course, looked up at places.

    Args:
        course: of the estimate.
        values: shape (n,).
        places: s, m, rising, shape (m,).
        known: ticks that count, shape (n,); by default all with a finite value.

    Returns:
        shape (m,): straight between ticks; of a halt the first moment; NaN outside the course, and where the ticks that
        count leave a gap of more than 5 m beyond the spacing of the ticks.
    """
    counts = np.isfinite(values) & np.isfinite(course.s)
    if known is not None:
        counts &= known
    s, kept = course.s[counts], values[counts]
    first = np.concatenate([[True], np.diff(s) > 1e-9]) if s.size else np.zeros(0, bool)
    s, kept = s[first], kept[first]
    if s.size < 2:
        return np.full(places.size, np.nan)
    found = np.interp(places, s, kept, left=np.nan, right=np.nan)
    after = np.clip(np.searchsorted(s, places), 1, s.size - 1)
    found[s[after] - s[after - 1] > 5.0] = np.nan
    return found


def _integral(speed: Array, dt: float) -> Array:
    """s of a speed; where it is missing, the last one goes on, and before the first the way is 0."""
    there = np.isfinite(speed)
    newest = np.maximum.accumulate(np.where(there, np.arange(speed.size), -1))
    filled = np.where(newest >= 0, speed[np.maximum(newest, 0)], 0.0)
    filled = np.where(filled < _MOVING, 0.0, filled)
    steps = 0.5 * (filled[1:] + filled[:-1]) * dt
    return np.concatenate([np.zeros(min(1, filled.size)), np.cumsum(steps)])


def _measured(estimate: Estimate) -> Array | None:
    """s of the log's distance on the ticks; None where it has none, or it runs backwards."""
    if DISTANCE not in estimate.log:
        return None
    signal = estimate.log[DISTANCE]
    good = np.isfinite(signal.values)
    if good.sum() < 2:
        return None
    time, values = signal.time[good], signal.values[good]
    if np.diff(values).min() < -_BACKWARDS:
        return None
    placed = np.interp(estimate.time, time, np.maximum.accumulate(values))
    return np.asarray(placed - placed[0])
