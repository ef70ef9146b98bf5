"""2018 section V: what noise does to which estimate, the low-pass behind them, the start from elsewhere, the lateral velocity."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from codriver.estimate import Estimate
from codriver.papers.item import Item
from codriver.papers.motorcycle2018.compare import Compared
from codriver.papers.motorcycle2018.methods import FILTERED, METHODS, filtered, program
from codriver.papers.motorcycle2018.rides import JUDGED, NOISE, SETTLE, WORDS, Scene, errors, sizes
from codriver.papers.reproduction import Chapter
from codriver.report.document import BLACK, Chart, Curve, Mark, Plot, Table
from codriver.signals.grid import Flags

LEVELS = (0.05, 0.075, 0.1)
CUTOFFS = (2.0, 3.0, 5.0, 10.0, 20.0)  # Hz
CLOSE = 1.0  # deg
LEFT = 8.0  # s of a ride behind a start
DEGREE = 180 / np.pi
STARTED = ("ts", "shipped", "kalman", "ekf")


def claims_chapter(rides: Sequence[Scene], found: Compared) -> Chapter:
    """Noise, filter, start, lateral velocity.

    Args:
        rides: the last is the lane change.
        found: judged.
    """
    hard = rides[-1]
    levels, cutoffs = _levels(hard), _cutoffs(hard)
    started = {name: _start(rides[0], name) for name in STARTED}
    items = (*_affected(levels), _low_pass(hard, cutoffs), _arrives(started), _sideways(found, rides))
    return Chapter(
        "Noise, low-pass, starts (V)", (), (
            _levels_table(levels, hard), _cutoff_table(cutoffs, hard), _start_chart(rides[0]),
        ), items,
    )  # fmt: skip


def _noise_of(noisy: Estimate, quiet: Estimate, late: Flags) -> dict[str, float]:
    """RMS of what the noise alone does to each output."""
    names = [name for name in JUDGED if name in noisy.columns]
    return {n: JUDGED[n][1] * float(np.sqrt(np.mean((noisy.columns[n] - quiet.columns[n])[late] ** 2))) for n in names}


def _levels(ride: Scene) -> dict[float, dict[str, float]]:
    """RMS of what noise on the measurements does, over each output's rms, by level."""
    size, made = sizes(ride), {}
    quiet = program("fed").run(ride.measures())
    for level in LEVELS:
        found = _noise_of(program("fed").run(ride.measures(1, level)), quiet, quiet.time >= SETTLE)
        made[level] = {name: found[name] / size[name] for name in JUDGED}
    return made


def _affected(levels: dict[float, dict[str, float]]) -> tuple[Item, ...]:
    """Which outputs the noise reaches."""
    added = {name: share for name, share in levels[NOISE].items() if name != "lateral_velocity"}
    order = sorted(added, key=lambda name: -added[name])
    told = ", ".join(f"{name.replace('_', ' ')} {added[name]:.1%}" for name in order)
    return (
        Item("V.C: the rider's torque is the most affected by noise, then the front force", "torque, front force", told, "",
             order[:2] == ["rider_torque", "front_lateral_force"],
             "RMS of what noise of 7.5 % on each measurement of (21) adds, over each output's rms"),
        Item("V.C: roll and rear force are practically insensitive to noise", "insensitive",
             f"roll {added['roll_angle']:.1%}, rear force {added['rear_lateral_force']:.1%}", "",
             max(added["roll_angle"], added["rear_lateral_force"]) <= 0.05, "the same; 5 % counts"),
    )  # fmt: skip


def _cutoffs(ride: Scene) -> dict[float, dict[str, tuple[float, float]]]:
    """By cut-off, 0 for none: RMSE of the filtered outputs, and what the noise alone does to them."""
    made = {}
    for cutoff in (0.0, *CUTOFFS):
        whole = filtered(cutoff) if cutoff else program("fed")
        quiet, noisy = whole.run(ride.measures()), whole.run(ride.measures(1, NOISE))
        error, noise = errors(noisy, ride), _noise_of(noisy, quiet, quiet.time >= SETTLE)
        made[cutoff] = {name: (error[name], noise[name]) for name in FILTERED}
    return made


def _low_pass(ride: Scene, found: dict[float, dict[str, tuple[float, float]]]) -> Item:
    whole, noise = found[0.0]["rider_torque"]
    kept = [c for c in CUTOFFS if found[c]["rider_torque"][0] <= 1.05 * whole]
    best = min(kept or CUTOFFS, key=lambda c: found[c]["rider_torque"][1 if kept else 0])
    error, left = found[best]["rider_torque"]
    return Item(
        "V.C: a third-order Butterworth filter denoises without significant delay", "sufficient",
        f"noise in the torque {noise:.2f} to {left:.2f} N m, error {whole:.1f} to {error:.1f} N m, at {best:g} Hz", "",
        bool(kept) and left <= 0.5 * noise,
        f"{WORDS[ride.name]}, given measurements with 7.5 % noise. Half of the noise with an error that grows by no more than 5 "
        f"% counts; {'the lowest such' if kept else 'none does, this is the least error'} of "
        f"{', '.join(f'{c:g}' for c in CUTOFFS)} Hz. It is {1e3 * late_by(best):.0f} ms late, which costs more than the noise "
        "where the torque is quick",
    )  # fmt: skip


def late_by(cutoff: float) -> float:
    """Of a third-order Butterworth filter, s: 2 / w_c."""
    return 2 / (2 * np.pi * cutoff)


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
    """When the machine leans most, with enough of the ride left."""
    roll = ride.truth["roll_angle"]
    early = roll.time <= max(roll.time[-1] - LEFT, roll.time[-1] / 2)
    return float(roll.time[np.argmax(np.abs(roll.values[early]))])


def _arrives(started: dict[str, tuple[float, float]]) -> Item:
    lean = started["ts"][0]
    return Item(
        "V.A: it converges rapidly from another start", "rapidly", started["ts"][1], "s", started["ts"][1] <= 1.0,
        f"begun upright while the machine leans by {lean:.0f} deg; until the roll stays within {CLOSE:g} deg of that of an "
        "observer that ran from the beginning. One second counts. LMI with a = v W; others: "
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
        "RMSE over rms, LMI with a = v W, ideal sensors; 30 % in one ride counts. EKF: "
        f"{', '.join(f'{x:.0%}' for x in best.values())}",
    )


def _levels_table(levels: dict[float, dict[str, float]], ride: Scene) -> Table:
    names = [name for name in JUDGED if name != "lateral_velocity"]
    rows: list[tuple[str | float | Mark | None, ...]] = [
        (f"{level:.1%}", *(found[n] for n in names)) for level, found in levels.items()
    ]
    return Table(
        ("noise", *(n.replace("_", " ") for n in names)), tuple(rows),
        f"What noise on each measurement of (21) does to the LMI observer's outputs: RMS over each one's rms, {WORDS[ride.name]}.",
    )  # fmt: skip


def _cutoff_table(errors_at: dict[float, dict[str, tuple[float, float]]], ride: Scene) -> Table:
    rows: list[tuple[str | float | Mark | None, ...]] = [
        (f"{c:g} Hz" if c else "no filter", 1e3 * late_by(c) if c else 0.0, *(x for n in FILTERED for x in found[n]))
        for c, found in errors_at.items()
    ]
    head = ("cut-off", "late, ms", "torque: error, N m", "of noise", "front force: error, N", "of noise")
    return Table(
        head, tuple(rows),
        f"Behind a Butterworth filter of third order; {WORDS[ride.name]}, LMI observer given measurements with 7.5 % noise.",
    )  # fmt: skip
