"""Beside 2019: chapters on recordings of real vehicles, where they are there; what is not there is said."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from codriver.errors import CodriverError
from codriver.papers.item import Item
from codriver.papers.reproduction import Chapter, Tell
from codriver.papers.steering2019.recorded_bicycle import bicycle_chapters
from codriver.papers.steering2019.recorded_car import FOLDER as LINCOLN
from codriver.papers.steering2019.recorded_car import TITLE as LINCOLN_TITLE
from codriver.papers.steering2019.recorded_car import car_chapter
from codriver.papers.steering2019.recorded_column import (
    HANDS_LEAVE,
    Shaft,
    assisted_column,
    brush,
    correlation_time,
    explained,
    hands_by,
    linear,
    regression,
    shaft,
)
from codriver.report.document import BLACK, Chart, Curve, Plot, Table

SHAFT_TITLE = "Shaft torque by eq. (92): a lap of iRacing"
TOYOTA_TITLE = "Hands on or off: a Toyota of comma2k19 that its assistant steers"
LAP = (38.0, 47.0)  # s: fitted up to the first, before the quick corners; judged up to the second, the slide
SLIDE = (41.0, 49.0)  # s
TOYOTA = ((13.0, 40.0), (40.0, 59.0))  # s, without hands: fitted, judged


def recorded_chapters(recordings: Path | None, tell: Tell) -> tuple[Chapter, ...]:
    """A chapter a recording.

    Args:
        recordings: folder that holds them by name; None for none.
        tell: is told each.
    """
    if recordings is None or not recordings.is_dir():
        return (Chapter("Real recordings beside it", (
            "The recordings are not there; give the folder that holds them with --recordings.",
        ), ()),)  # fmt: skip
    made: list[tuple[str, Path, Callable[[Path], Chapter]]] = [
        (SHAFT_TITLE, recordings / "iracing" / "amg.ibt", shaft_chapter),
        (LINCOLN_TITLE, recordings / LINCOLN, car_chapter),
        (TOYOTA_TITLE, recordings / "comma2k19-rav4", toyota_chapter),
        *bicycle_chapters(recordings),
    ]
    chapters = []
    for title, path, make in made:
        if not path.exists():
            name = path.relative_to(recordings)
            chapters.append(
                Chapter(
                    title, (f"The recording {name} is not there; give the folder that holds it with --recordings.",), ()
                )
            )
            continue
        tell(f"reading {path.parent.name if path.is_file() else path.name}")
        try:
            chapters.append(make(path))
        except CodriverError as error:
            chapters.append(Chapter(title, (f"The recording could not be used: {error}",), ()))
    return tuple(chapters)


def shaft_chapter(path: Path) -> Chapter:
    """The sign of (92) and how far it carries, on the shaft torque of a simulated racing car."""
    s = shaft(path)
    fitted, judged = s.time < LAP[0], (s.time > LAP[0]) & (s.time < LAP[1])
    (K, front, ratio), by_slip = linear(s, fitted)
    (_, _, _, full), by_brush = brush(s, fitted)
    ways = {
        "eq. (92)": by_slip, "eq. (92) for a brush tyre": by_brush, "angle alone": regression(s, fitted, s.angle),
        "lateral acceleration alone": regression(s, fitted, s.lateral), "angle and lateral acceleration": regression(s, fitted,
        s.angle, s.lateral),
    }  # fmt: skip
    rows = tuple(
        (
            name,
            explained(s.torque[fitted], T[fitted]),
            explained(s.torque[judged], T[judged]),
            float(np.sqrt(np.mean((T - s.torque)[judged] ** 2))),
        )
        for name, T in ways.items()
    )
    r2 = explained(s.torque[judged], by_slip[judged])
    before, slide = s.time < SLIDE[0], (s.time > SLIDE[0]) & (s.time < SLIDE[1])
    sliding = [explained(s.torque[slide], way(s, before)[1][slide]) for way in (linear, brush)]
    items = (
        Item("(92): K_aln is negative", "-K_p C_f n_t", float(K), "N m/rad", bool(K < 0),
             f"by least squares, with l_f = {front:.2f} m and g_s = {ratio:.1f} found with it: the tyres turn the wheel back"),
        Item("(92): the alignment torque is proportional to the front slip angle", "K_aln constant", f"R² {r2:.2f} on corners not "
             "fitted", "",
             r2 > 0.8, f"above 0.8 counts. Angle alone: {rows[2][2]:.2f}. Where the tyres slide (fitted up to {SLIDE[0]:g} s, "
             f"judged to {SLIDE[1]:g}): R² {sliding[0]:.2f}, a brush tyre that slides from {np.degrees(full):.1f} degrees on "
             f"{sliding[1]:.2f}"),
    )  # fmt: skip
    return Chapter(SHAFT_TITLE, (
        "The recorded lap of a commercial simulator has shaft torque, sideslip and yaw rate: all of (92). Fitted up to 38 s, "
        "before the quick corners, judged from there to 47 s, before a slide.",
    ), (Table(("way", "R² fitted", "R² judged", "RMSE judged, N m"), rows), _shaft_chart(s, by_slip, by_brush)), items)  # fmt: skip


def _shaft_chart(s: Shaft, by_slip: np.ndarray, by_brush: np.ndarray) -> Chart:
    part = s.time < LAP[1]
    return Chart("Shaft torque", "time (s)", (Plot("torque (N m)", (
        Curve("recorded", s.time[part], s.torque[part], BLACK, width=1.0), Curve("eq. (92)", s.time[part], by_slip[part],
        "#C84C00"),
        Curve("brush tyre", s.time[part], by_brush[part], "#0072B2"),
    ), 220, (0.0,)),), f"Fitted up to {LAP[0]:g} s.")  # fmt: skip


def toyota_chapter(folder: Path) -> Chapter:
    """Whether the driver's hands show in the torque that the steering motor bears."""
    car = assisted_column(folder)
    fitted, judged = (car.span(*ends) for ends in TOYOTA)
    on = car.span(0.0, HANDS_LEAVE - 0.1)
    torque = car.estimate(fitted)
    spread = float(np.sqrt(np.mean(torque[fitted] ** 2)))
    p = hands_by(torque, spread, correlation_time(torque[fitted]))
    other = car.span(13.0, 35.0)
    again = car.estimate(car.span(35.0, 59.0))
    q = hands_by(
        again, float(np.sqrt(np.mean(again[car.span(35.0, 59.0)] ** 2))), correlation_time(again[car.span(35.0, 59.0)])
    )
    follows = float(np.corrcoef(torque[on], car.sensor[on])[0, 1])
    tells, tells_again = p[on].mean() - p[judged].mean(), q[on].mean() - q[other].mean()
    items = (
        Item("the estimate follows the column's own sensor while hands are on", None, follows, "1", follows > 0.5,
             "not in the paper; correlation, the sensor is not used. Above 0.5 counts"),
        Item("hands on is told from hands off", None,
             f"probability {p[on].mean():.2f} with hands, {p[judged].mean():.2f} without", "", bool(min(tells, tells_again) > 0.3),
             f"not in the paper; fitted on the other part of the minute {q[on].mean():.2f} and {q[other].mean():.2f}. 0.3 apart "
             "in both counts: one minute on a nearly straight road is too little to identify a column"),
    )  # fmt: skip
    step = slice(None, None, 5)
    chart = Chart(
        "Hands before 9 s, assistant after", "time (s)",
        (
            Plot("torque (counts)", (
                Curve("estimated, motor's counts", car.time[step], torque[step], "#C84C00"),
                Curve("sensor, its own counts (right)", car.time[step], car.sensor[step], BLACK, width=1.0, right=True),
            ), 200, (0.0,), right_label="sensor (counts)"),
            Plot("probability of hands", (Curve("", car.time[step], p[step], "#0072B2"),), 120, limits=(0.0, 1.0)),
        ), boxes=((0.0, HANDS_LEAVE, "hands on"),),
    )  # fmt: skip
    return Chapter(TOYOTA_TITLE, (
        "The load on the column without hands is fitted on 13 to 40 s; what the motor bears less is the driver's torque.",
    ), (chart,), items)  # fmt: skip
