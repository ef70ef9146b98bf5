"""2018 figures 2 to 11: each ride's path and speed, what is measured, and what the observers make of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from codriver.papers.item import Item
from codriver.papers.motorcycle2018.compare import SENSORS, estimate
from codriver.papers.motorcycle2018.methods import FILTERED, METHODS, filtered
from codriver.papers.motorcycle2018.rides import JUDGED, NOISE, SETTLE, WORDS, Scene, errors, sizes
from codriver.papers.reproduction import Chapter
from codriver.report.document import BLACK, GREY, Chart, Curve, Plot
from codriver.signals.signal import Array

FEW = {"track": 10, "slalom": 4, "double-lane-change": 2}  # ticks from point to point
SHOWN = ("paper", "fed", "ts", "ekf")
LABELS = {
    "front_lateral_force": "front force (N)", "rear_lateral_force": "rear force (N)", "roll_angle": "roll (deg)",
    "rider_torque": "torque (N m)",
}  # fmt: skip
DEGREE = 180 / np.pi
CUTOFF = 5.0  # Hz


@dataclass(frozen=True)
class Place:
    """Where a ride stands in the paper.

    Attributes:
        section: of the paper.
        path, measured, estimated: figures.
        sensors: of `compare.SENSORS`, as the paper has them.
    """

    section: str
    path: int
    measured: int
    estimated: int
    sensors: str


PLACES = {
    "track": Place("V.A", 2, 3, 4, "ideal"), "slalom": Place("V.B", 5, 6, 7, "ideal"),
    "double-lane-change": Place("V.C", 8, 9, 10, "noise"),
}  # fmt: skip


def figure_chapters(rides: Sequence[Scene]) -> list[Chapter]:
    """A chapter a ride.

    Args:
        rides: one a scenario.
    """
    made = [_chapter(ride) for ride in rides]
    made[-1] = replace(made[-1], items=(*made[-1].items, _steering(rides)))
    return made


def _chapter(ride: Scene) -> Chapter:
    place, name = PLACES[ride.name], WORDS[ride.name]
    ideal = place.sensors == "ideal"
    words = (
        f"As in the paper, the sensors are {'ideal' if ideal else 'noisy'} here. Signs are ISO 8855: roll is positive to the "
        "right, all else to the left.",
    )
    charts = [_path(ride, place), *_measured(ride, place), _estimated(ride, place)]
    items = _perfectly(ride, place)
    if ride.name == "double-lane-change":
        charts.append(_filtered(ride))
    if ride.name == "slalom":
        items += _slalom(ride)
    return Chapter(f"{name.capitalize()}: figures {place.path} to {place.estimated + (ride.name == 'double-lane-change')} "
                   f"({place.section})", words, tuple(charts), tuple(items))  # fmt: skip


def _path(ride: Scene, place: Place) -> Chart:
    few, d = slice(None, None, FEW[ride.name]), ride.record.ride
    x, y = d.of("x")[few], d.of("y")[few]
    speed = 3.6 * d.speed[few]
    if ride.name == "track":
        return Chart(f"Figure {place.path}: the path", "x (m)", (Plot("y (m)", (Curve("", x, y, BLACK),), 380),),
                     f"Speed {speed.min():.0f} to {speed.max():.0f} km/h.")  # fmt: skip
    return Chart(
        f"Figure {place.path}: path and speed", "x (m)",
        (Plot("y (m)", (Curve("", x, y, BLACK),), 180), Plot("speed (km/h)", (Curve("", x, speed, BLACK),), 150)),
    )  # fmt: skip


def _measured(ride: Scene, place: Place) -> list[Chart]:
    log, few = ride.log(1, **SENSORS[place.sensors]), slice(None, None, FEW[ride.name])
    plots = [
        Plot(label, (Curve("", log[name].time[few], factor * log[name].values[few], BLACK),), 130)
        for name, label, factor in (
            ("steer_angle", "steer (deg)", DEGREE), ("yaw_rate", "body yaw rate (deg/s)", DEGREE),
            ("roll_rate", "roll rate (deg/s)", DEGREE), ("lateral_acceleration", "f_y, body (m/s²)", 1.0),
            ("longitudinal_speed", "speed (km/h)", 3.6),
        )
    ]  # fmt: skip
    return [Chart(f"Figure {place.measured}: what the sensors show", "time (s)", tuple(plots),
                  "The lateral acceleration in the body's frame is near 0 in a turn: gravity and turn cancel.")]  # fmt: skip


def _estimated(ride: Scene, place: Place) -> Chart:
    found = {name: estimate(name, ride, place.sensors) for name in SHOWN}
    few = slice(None, None, FEW[ride.name])
    plots = []
    for name, label in LABELS.items():
        factor = JUDGED[name][1]
        curves = [
            Curve(METHODS[m].short, e.time[few], factor * e.columns[name][few], METHODS[m].color, width=1.2)
            for m, e in found.items()
        ]
        time = found["ts"].time[few]
        true = factor * ride.of(name, time)
        curves.append(Curve("true", time, true, BLACK, dash="dot"))
        plots.append(Plot(label, tuple(curves), 210, limits=_limits(true)))
    return Chart(
        f"Figure {place.estimated}: estimated and true",
        "time (s)",
        tuple(plots),
        "LMI, (17): the observer as the paper has it; it leaves the picture where it must. LMI, fed: the same, given the "
        "measurements of (21) themselves. LMI, a = v W: the same gains.",
    )


def _limits(true: Array) -> tuple[float, float]:
    """Half as much again as the truth."""
    low, high = float(true.min()), float(true.max())
    return low - 0.5 * (high - low), high + 0.5 * (high - low)


def _filtered(ride: Scene) -> Chart:
    raw = estimate("fed", ride, "noise")
    smooth = filtered(CUTOFF).run(ride.measures(1, NOISE))
    few = slice(None, None, FEW[ride.name])
    plots = tuple(
        Plot(LABELS[name], (
            Curve("raw", raw.time[few], raw.columns[name][few], GREY, width=1.0),
            Curve(f"third order, {CUTOFF:g} Hz", smooth.time[few], smooth.columns[name][few], "#C84C00"),
            Curve("true", raw.time[few], ride.of(name, raw.time[few]), BLACK, dash="dot"),
        ), 210)
        for name in FILTERED
    )  # fmt: skip
    return Chart(
        "Figure 11: torque and front force behind a Butterworth filter",
        "time (s)",
        plots,
        "LMI observer given measurements with 7.5 % noise.",
    )


def _perfectly(ride: Scene, place: Place) -> list[Item]:
    """Errors over what is estimated, figures 4, 7, 10."""
    size = sizes(ride)
    found = {m: errors(estimate(m, ride, place.sensors), ride) for m in SHOWN}
    shares = {m: {name: e[name] / size[name] for name in LABELS} for m, e in found.items()}
    told = {
        m: ", ".join(f"{LABELS[n].split(' (')[0]} {x:.0%}" for n, x in share.items()) for m, share in shares.items()
    }
    where = f"fig. {place.estimated}: states and rider's torque are followed, {WORDS[ride.name]}, "
    return [
        Item(f"{where}measurements of (21) as they are", "perfectly estimated", told["fed"], "", max(shares["fed"].values()) <= 0.2,
             "RMSE over rms; a fifth of each counts"),
        Item(f"{where}from what sensors show", "perfectly estimated", told["paper"], "", max(shares["paper"].values()) <= 0.2,
             f"the same behind (17) and (19). With a = v W: {told['ts']}; EKF: {told['ekf']}"),
    ]  # fmt: skip


def _slalom(ride: Scene) -> list[Item]:
    """V.B: whether the speed matters."""
    made = estimate("ts", ride)
    off = np.abs(made.columns["roll_angle"] - ride.of("roll_angle", made.time)) * DEGREE
    lean = ride.of("roll_angle", made.time) * DEGREE
    speed = 3.6 * ride.of("longitudinal_speed", made.time)
    late = made.time >= SETTLE
    middle = float(np.median(speed[late]))
    parts = [late & (speed < middle), late & (speed >= middle)]
    share = [float(np.sqrt(np.mean(off[p] ** 2)) / np.sqrt(np.mean(lean[p] ** 2))) for p in parts]
    return [Item(
        "V.B: the estimate does not depend on the speed", "independently", f"{share[0]:.3f} below, {share[1]:.3f} above "
        f"{middle:.0f} km/h",
        "", 0.5 <= share[0] / share[1] <= 2.0,
        "RMSE of the roll over its rms, LMI with a = v W, ideal sensors; within a factor of two counts",
    )]  # fmt: skip


def _steering(rides: Sequence[Scene]) -> Item:
    """V.C: the slower the ride, the more is steered for the same turn."""
    largest, bent = {}, {}
    for ride in rides:
        steer, t = ride.truth["steer_angle"].values, ride.truth
        bend = t["heading_rate"].values * t["longitudinal_speed"].values  # m/s^2
        largest[ride.name] = DEGREE * float(np.abs(steer).max())
        bent[ride.name] = DEGREE * float(np.sqrt(np.mean(steer**2) / np.mean(bend**2)))
    speed = {r.name: 3.6 * float(r.truth["longitudinal_speed"].values.mean()) for r in rides}
    order = sorted(bent, key=lambda name: speed[name])
    return Item(
        "V.C: the slower, the more is steered", "2 deg on track and slalom, 0.5 in the lane change",
        ", ".join(f"{WORDS[n]} {x:.1f}" for n, x in largest.items()) + " deg", "",
        all(bent[a] > bent[b] for a, b in pairwise(order)),
        "the largest steer angles, on courses of our own; judged by steer over lateral acceleration, rms, which must fall as "
        "the mean speed grows: " + ", ".join(f"{WORDS[n]} {bent[n]:.2f} deg per m/s² at {speed[n]:.0f} km/h" for n in order),
    )  # fmt: skip
