"""2018 section V: what noise does to which estimate, the low-pass behind them, the start from elsewhere, the lateral velocity."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from codriver.observers.butterworth import butterworth_filter
from codriver.observers.motorcycle_ts import motorcycle_ts_observer
from codriver.observers.observer import chain
from codriver.papers.item import Item
from codriver.papers.motorcycle2018.compare import Compared
from codriver.papers.motorcycle2018.methods import METHODS, behind, compiled, lmi, program
from codriver.papers.motorcycle2018.rides import DT, JUDGED, NOISE, WORDS, Scene, errors, sizes
from codriver.papers.reproduction import Chapter
from codriver.report.document import BLACK, Chart, Curve, Plot, Table

LEVELS = (0.0, 0.05, 0.075, 0.1)
CUTOFFS = (2.0, 3.0, 5.0, 10.0, 20.0)  # Hz
FILTERED = ("rider_torque", "front_lateral_force")
CLOSE = 1.0  # deg
DEGREE = 180 / np.pi
STARTED = ("ts", "calm", "kalman", "ekf")


def claims_chapter(rides: Sequence[Scene], found: Compared) -> Chapter:
    """Noise, filter, start, lateral velocity.

    Args:
        rides: the last is the lane change.
        found: judged.
    """
    hard = rides[-1]
    levels, filtered = _levels(hard), _cutoffs(hard)
    started = {name: _start(rides[0], name) for name in STARTED}
    items = (*_affected(levels), _low_pass(hard, filtered), _arrives(started), _sideways(found, rides))
    return Chapter(
        "Noise, low-pass, starts (V)", (), (
            _levels_table(levels, hard), _cutoff_table(filtered, hard), _start_chart(rides[0]),
        ), items,
    )  # fmt: skip


def _levels(ride: Scene) -> dict[float, dict[str, float]]:
    """RMSE by output over its rms, LMI with a = v W, by level of noise: both parts of the error."""
    size = sizes(ride)
    made = {}
    for level in LEVELS:
        late = errors(program("ts").run(ride.log(1, noise=level, counts=4096 if level else 0)), ride)
        made[level] = {name: late[name] / size[name] for name in JUDGED}
    return made


def _affected(levels: dict[float, dict[str, float]]) -> tuple[Item, ...]:
    """Which outputs the noise reaches: what is added to the squared error, over the output's rms."""
    quiet, noisy = levels[0.0], levels[NOISE]
    added = {
        name: float(np.sqrt(max(noisy[name] ** 2 - quiet[name] ** 2, 0.0)))
        for name in JUDGED
        if name != "lateral_velocity"
    }
    order = sorted(added, key=lambda name: -added[name])
    told = ", ".join(f"{name.replace('_', ' ')} {added[name]:.1%}" for name in order)
    return (
        Item("V.C: the rider's torque is the most affected by noise, then the front force", "torque, front force", told, "",
             order[:2] == ["rider_torque", "front_lateral_force"],
             "added by 7.5 % noise (root of the difference of squares), over each one's rms; LMI with a = v W"),
        Item("V.C: roll and rear force are practically insensitive to noise", "insensitive",
             f"roll {added['roll_angle']:.1%}, rear force {added['rear_lateral_force']:.1%}", "",
             max(added["roll_angle"], added["rear_lateral_force"]) <= 0.05, "the same; 5 % counts"),
    )  # fmt: skip


def _cutoffs(ride: Scene) -> dict[float, dict[str, float]]:
    """RMSE of the filtered outputs by cut-off; 0 for none."""
    log = ride.log(1, noise=NOISE, counts=4096)
    made = {0.0: errors(program("ts").run(log), ride)}
    for cutoff in CUTOFFS:
        whole = compiled(chain(behind(motorcycle_ts_observer(lmi())), butterworth_filter(DT, FILTERED, cutoff)))
        made[cutoff] = errors(whole.run(log), ride)
    return {cutoff: {name: e[name] for name in FILTERED} for cutoff, e in made.items()}


def _low_pass(ride: Scene, filtered: dict[float, dict[str, float]]) -> Item:
    raw = filtered[0.0]["rider_torque"]
    best = min(CUTOFFS, key=lambda c: filtered[c]["rider_torque"])
    gain, late = filtered[best]["rider_torque"] / raw, 2 / (2 * np.pi * best)
    return Item(
        "V.C: a third-order Butterworth filter denoises without significant delay", "sufficient",
        f"torque {raw:.1f} to {filtered[best]['rider_torque']:.1f} N m at {best:g} Hz, {1e3 * late:.0f} ms late", "", gain <= 0.9,
        f"the best of {', '.join(f'{c:g}' for c in CUTOFFS)} Hz, {WORDS[ride.name]}; an error a tenth smaller counts. It is 2 / w_c "
        "late, which costs more than the noise where the torque is quick",
    )  # fmt: skip


def _start(ride: Scene, name: str) -> tuple[float, float]:
    """Lean at the moment of the start, and seconds until the roll stays within CLOSE of what it would have been."""
    at = _steep(ride)
    log = ride.log(1)
    whole, part = program(name).run(log), program(name).run(log, start=at)
    reference = np.interp(part.time, whole.time, whole.columns["roll_angle"])
    off = np.abs(part.columns["roll_angle"] - reference) * DEGREE
    away = np.flatnonzero(off > CLOSE)
    return DEGREE * float(ride.of("roll_angle", np.array([at]))[0]), float(
        part.time[away[-1]] - at
    ) if away.size else 0.0


def _steep(ride: Scene) -> float:
    """When the machine leans most in the first half."""
    roll = np.abs(ride.truth["roll_angle"].values)
    return float(ride.truth["roll_angle"].time[np.argmax(roll[: roll.size // 2])])


def _arrives(started: dict[str, tuple[float, float]]) -> Item:
    lean = started["ts"][0]
    return Item(
        "V.A: it converges rapidly from another start", "rapidly", started["ts"][1], "s", started["ts"][1] <= 1.0,
        f"begun upright while the machine leans by {lean:.0f} deg; until the roll stays within {CLOSE:g} deg of that of an observer "
        "that ran from the beginning. One second counts. LMI with a = v W; others: "
        + ", ".join(f"{METHODS[m].short} {s:.2f} s" for m, (_, s) in started.items() if m != "ts"),
    )  # fmt: skip


def _start_chart(ride: Scene) -> Chart:
    at, log = _steep(ride), ride.log(1)
    curves = []
    for name in STARTED:
        part = program(name).run(log, start=at, stop=min(at + 6.0, float(ride.truth["roll_angle"].time[-1])))
        curves.append(
            Curve(METHODS[name].short, part.time - at, DEGREE * part.columns["roll_angle"], METHODS[name].color)
        )
    time = part.time
    curves.append(Curve("true", time - at, DEGREE * ride.of("roll_angle", time), BLACK, dash="dot"))
    return Chart(
        f"Begun in the middle of a turn, {WORDS[ride.name]}",
        "time since the start (s)",
        (Plot("roll (deg)", tuple(curves), 260),),
        "LMI observers begin upright and at rest; the Kalman filters take the first samples for a start.",
    )


def _sideways(found: Compared, rides: Sequence[Scene]) -> Item:
    share = {
        r.name: found.errors["ts", r.name, "ideal"]["lateral_velocity"] / found.zero[r.name]["lateral_velocity"]
        for r in rides
    }
    best = {
        r.name: found.errors["ekf", r.name, "ideal"]["lateral_velocity"] / found.zero[r.name]["lateral_velocity"]
        for r in rides
    }
    return Item(
        "V: the lateral velocity errs significantly",
        "significant errors",
        ", ".join(f"{WORDS[n]} {x:.0%}" for n, x in share.items()),
        "",
        max(share.values()) >= 0.3,
        f"RMSE over rms, LMI with a = v W, ideal sensors; 30 % in one ride counts. EKF: {', '.join(f'{x:.0%}' for x in best.values())}",
    )


def _levels_table(levels: dict[float, dict[str, float]], ride: Scene) -> Table:
    names = [name for name in JUDGED if name != "lateral_velocity"]
    rows = tuple((f"{level:.1%}" if level else "none", *(found[n] for n in names)) for level, found in levels.items())
    return Table(("noise", *(n.replace("_", " ") for n in names)), rows,
                 f"RMSE over rms by noise, LMI with a = v W, {WORDS[ride.name]}.")  # fmt: skip


def _cutoff_table(filtered: dict[float, dict[str, float]], ride: Scene) -> Table:
    rows = tuple(
        (f"{c:g} Hz" if c else "no filter", 1e3 * 2 / (2 * np.pi * c) if c else 0.0, *(found[n] for n in FILTERED))
        for c, found in filtered.items()
    )
    return Table(("cut-off", "late, ms", "torque, N m", "front force, N"), rows, f"RMSE behind a Butterworth filter of third order, {WORDS[ride.name]}, noisy "
                 "sensors, LMI with a = v W.")  # fmt: skip
