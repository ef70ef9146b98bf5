"""2015 section V: gear changes, intention against the kinematic model (figure 3)."""

from __future__ import annotations

import numpy as np

from codriver.estimate import Estimate
from codriver.papers.drawing import (
    BLUE,
    GREEN,
    PURPLE,
    RED,
    curve,
    measured,
    shades,
    true_curve,
    window_between,
)
from codriver.papers.drives import Driven
from codriver.papers.item import Item
from codriver.papers.reproduction import Chapter
from codriver.report.document import BLACK, Chart, Curve, Plot
from codriver.simulate.judge import at
from codriver.vehicles import Vehicle

_BEFORE, _AFTER = 2.0, 4.0  # s shown around a change of gear


def shifts_chapter(driven: Driven, intent: Estimate, kinematic: Estimate, vehicle: Vehicle) -> Chapter:
    """Figure 3: a change down while the car coasts, and a change up, at one ell.

    Args:
        driven: the drive.
        intent: intent-torque.
        kinematic: on the same ticks.
        vehicle: for tau and M.
    """
    found = {"down": _moments(driven, intent, -1.0), "up": _moments(driven, intent, 1.0)}
    words = ("Chosen by rule: the change in which the kinematic jerk is largest while the driver plans next to none.",)
    charts, items = [], []
    for way, times in found.items():
        if not times:
            items.append(
                Item(f"fig. 3: a change {way}", None, "none in this drive", "", None, "no such change of gear")
            )
            continue
        peaks = [(_peak(kinematic, "longitudinal_jerk", t), _peak(intent, "intentional_jerk", t), t) for t in times]
        charts.append(_chart(way, driven, intent, kinematic, max(peaks)[2], vehicle))
        theirs, ours = float(np.mean([p[0] for p in peaks])), float(np.mean([p[1] for p in peaks]))
        why = "while the car coasts" if way == "down" else "at constant intention"
        items.append(Item(
            f"fig. 3: the kinematic jerk misreads a change {way} {why}", "wave of the kinematic jerk, intention almost flat",
            f"{theirs:.2f} against {ours:.2f} m/s³", "", theirs > 2 * ours,
            f"peak of the jerk from the change to 2 s after, kinematic against intention, mean of {len(peaks)} changes in which "
            "the driver plans less than 0.1 m/s³; twice counts",
        ))  # fmt: skip
    return Chapter("Gear changes (V, figure 3)", words, tuple(charts), tuple(items))


def _moments(driven: Driven, estimate: Estimate, direction: float) -> list[float]:
    """Times of the changes up (1) or down (-1) around which the driver plans next to no jerk, s."""
    truth = driven.truth
    shift, time = truth["shift"].values, truth["shift"].time
    starts = time[np.flatnonzero((shift == direction) & (np.roll(shift, 1) != direction))]
    chosen = []
    for start in starts:
        around = np.linspace(start - 0.8, start + 2.0, 60)
        calm = float(np.max(np.abs(at(truth, "planned_jerk", around)))) < 0.1
        k = int(np.searchsorted(estimate.time, start))
        if calm and k + 200 < len(estimate.grid) and estimate.valid[max(k - 100, 0) : k + 200].all():
            chosen.append(float(start))
    return chosen


def _peak(estimate: Estimate, name: str, start: float) -> float:
    part = window_between(estimate, start, start + 2.0)
    return float(np.max(np.abs(part(estimate.columns[name]))))


def _chart(
    way: str, driven: Driven, intent: Estimate, kinematic: Estimate, start: float, vehicle: Vehicle
) -> Chart:  # fmt: skip
    a, b = start - _BEFORE, start + _AFTER
    part, log = window_between(intent, a, b), driven.log
    u = Curve("u = tau/M (T_e − T_r)", part(intent.time), part(intent.columns["known_input"]), RED, right=True)
    return Chart(
        f"Figure 3: a change {way} at {start:.1f} s", "time (s)",
        (
            Plot("torque (N m)", (measured("actual T_e", log, "engine_torque", a, b, GREEN),
                                  measured("requested T_r", log, "engine_torque_request", a, b, PURPLE), u), 150,
                 right_label="m/s²"),
            Plot("speed (km/h)", (measured("measured", log, "longitudinal_speed", a, b, BLACK),
                                  curve("estimate", intent, "longitudinal_speed", part, RED)), 110),
            Plot("acceleration (m/s²)", (measured("accelerometer", log, "longitudinal_acceleration", a, b, faint=True),
                                         curve("intention", intent, "intentional_acceleration", part, RED),
                                         curve("kinematic", kinematic, "longitudinal_acceleration", part, BLUE)), 150, (0.0,)),
            Plot("jerk (m/s³)", (curve("intention", intent, "intentional_jerk", part, RED),
                                 curve("kinematic", kinematic, "longitudinal_jerk", part, BLUE),
                                 true_curve("driver's plan", intent, driven.truth, "planned_jerk", part)), 150, (0.0,)),
        ),
        "", shades(intent, part), half=True,
    )  # fmt: skip
