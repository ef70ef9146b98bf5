"""2015 section V: gear changes, intention against the kinematic model (figure 3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

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

_BEFORE, _AFTER = 2.0, 4.0  # s shown around a change of gear
# From _EARLY before a change to _LATE after it the driver plans less than _CALM (m/s^3), and his request varies by less than
# _STEADY (N m).
_EARLY, _LATE, _CALM, _STEADY = 0.8, 2.0, 0.1, 60.0
_FLAT = 0.5  # m/s^3: a jerk that stays below it is almost flat
_CLAIMS = {
    "down": "a change down while the driver intends nothing: a wave in the kinematic jerk, almost flat in ours",
    "up": "a change up while the driver intends nothing new: a large wrong jerk in the kinematic model, not in ours",
}


@dataclass(frozen=True, eq=False)
class Run:
    """A drive and its two estimates at one ell, on the same ticks."""

    driven: Driven
    intent: Estimate
    kinematic: Estimate


def shifts_chapter(runs: Sequence[Run]) -> Chapter:
    """Figure 3: changes of gear around which the drivers intend nothing new."""
    words = (
        "Chosen by rule from all drives: changes of gear around which the driver plans next to no jerk and holds the request "
        f"within {_STEADY:g} N m; drawn is the one with the largest kinematic jerk of each kind. The paper's change down came "
        "while the car was coasting; the simulated drivers brake when they slow down for a lower gear on this track.",
    )
    charts, items = [], []
    for way, direction in (("down", -1.0), ("up", 1.0)):
        found = [
            (_peak(run.kinematic, "longitudinal_jerk", t), _peak(run.intent, "intentional_jerk", t), t, run)
            for run in runs
            for t in _moments(run.driven, run.intent, direction)
        ]
        what = f"fig. 3: {_CLAIMS[way]}"
        if not found:
            items.append(
                Item(what, "so", "no such change", "", None, "no change of gear in these drives fits the rule")
            )
            continue
        worst = max(found, key=lambda one: one[0])
        charts.append(_chart(way, worst[3], worst[2]))
        theirs, ours = (float(np.mean([one[k] for one in found])) for k in (0, 1))
        items.append(Item(
            what, "so", f"{theirs:.2f} against {ours:.2f} m/s³", "", theirs > 2 * ours and (way == "up" or ours < _FLAT),
            f"peak of the jerk from the change to 2 s after, kinematic against ours, mean of {len(found)} changes; twice counts"
            + (f", and ours below {_FLAT:g}" if way == "down" else ""),
        ))  # fmt: skip
    return Chapter("Gear changes (V, figure 3)", words, tuple(charts), tuple(items))


def _moments(driven: Driven, estimate: Estimate, direction: float) -> list[float]:
    """Times of the changes up (1) or down (-1) around which the driver intends nothing new, s."""
    truth = driven.truth
    shift, time = truth["shift"].values, truth["shift"].time
    starts = time[np.flatnonzero((shift == direction) & (np.roll(shift, 1) != direction))]
    chosen = []
    for start in starts:
        around = np.linspace(start - _EARLY, start + _LATE, 60)
        calm = float(np.max(np.abs(at(truth, "planned_jerk", around)))) < _CALM
        steady = float(np.ptp(at(truth, "engine_torque_request", around))) < _STEADY
        k = int(np.searchsorted(estimate.time, start))
        if calm and steady and k + 200 < len(estimate.grid) and estimate.valid[max(k - 100, 0) : k + 200].all():
            chosen.append(float(start))
    return chosen


def _peak(estimate: Estimate, name: str, start: float) -> float:
    part = window_between(estimate, start, start + 2.0)
    return float(np.max(np.abs(part(estimate.columns[name]))))


def _chart(way: str, run: Run, start: float) -> Chart:
    driven, intent, kinematic = run.driven, run.intent, run.kinematic
    a, b = start - _BEFORE, start + _AFTER
    part, log = window_between(intent, a, b), driven.log
    u = Curve("u = tau/M (T_e − T_r)", part(intent.time), part(intent.columns["known_input"]), RED, right=True)
    return Chart(
        f"Figure 3: a change {way} at {start:.1f} s ({driven.job.driver} driver)", "time (s)",
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
