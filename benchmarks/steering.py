"""The joint filters of the steering wheel over a long recording: against libraries, a numpy loop, and plain C.

Every alternative gets the same settings and rows and is compared with our numbers before it is timed. With the paper's
alpha = 1e-3 the sigma points lie so close that six digits cancel, in every code; therefore the unscented filters are compared with
alpha = 0.1, too, which is the same work. What is slow and steady is measured on a part and scaled.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import plain_c
import steering_c
import steering_others as others
from batch import Loop, agree
from measure import Row, compared, measure, say

import codriver as cd
from codriver.identify.steering_ekf import joint_ekf
from codriver.identify.steering_joint import JointSettings
from codriver.identify.steering_ukf import joint_ukf, ukf_weights
from codriver.program import Program
from codriver.signals import Grid
from codriver.simulate.steering import sine

ESTIMATES = ("steering_wheel_angle", "steering_wheel_rate", "steering_inertia", "steering_damping")
CHANNELS = ("steering_motor_torque", "steering_wheel_angle")
WHEEL = (0.0672, 0.3562)  # J_s, kg m^2, and b_s, N m s/rad
PART = 10_000  # samples, of what is scaled
UNITS = np.array([1.0, 1.0, *WHEEL])  # of what is compared
ALPHAS = (1e-3, 0.1)  # the paper's, and one that cancels little
CANCELLED, EXACT = 1e-5, 1e-9  # by which codes may differ
FILTERPY, C = 300.0, 0.5  # ratios promised


def recording(count: int) -> Grid:
    """The paper's wheel under its sine, eq. (77) and (82)-(83), with noise of 0.01 dt^2 a tick and 0.1 degrees."""
    from scipy.signal import lfilter

    settings, rng = JointSettings(WHEEL), np.random.default_rng(0)
    (J, b), dt = WHEEL, settings.dt
    time = np.arange(count) * dt
    torque = sine(time)
    pushed = dt / J * np.r_[0.0, torque[:-1]] + 0.1 * dt * rng.standard_normal(count)
    rate = lfilter([1.0], [1.0, b * dt / J - 1.0], pushed)
    angle = np.cumsum(dt * np.r_[0.0, rate[:-1]] + 0.1 * dt * rng.standard_normal(count))
    measured = angle + np.sqrt(settings.angle) * rng.standard_normal(count)
    there = dict.fromkeys(CHANNELS, np.ones(count, bool))
    return Grid(time, dt, dict(zip(CHANNELS, (torque, measured), strict=True)), there, there)


@dataclass(frozen=True, eq=False)
class Case:
    """One filter, and the alternatives to it.

    Attributes:
        program: ours.
        slow: what runs a sample at a time in Python, by name.
        plain: (folder, flags) -> the loop in C.
        tolerance: by which they may differ.
    """

    program: Program
    slow: dict[str, others.Work]
    plain: Callable[[Path, Sequence[str]], Callable[..., None]]
    tolerance: float


def run(quick: bool = False) -> Iterator[Row]:
    """All rows."""
    grid = recording(20_000 if quick else 1_000_000)
    settings = JointSettings((WHEEL[0] / 2, WHEEL[1] / 2))
    extended = [_extended(settings)]
    unscented = [_unscented(settings, a, t) for a, t in zip(ALPHAS, (CANCELLED, EXACT), strict=True)]
    for name, cases in (("joint EKF", extended), ("joint UKF", unscented)):
        yield from _slow(name, cases, grid)
        yield from _plain(name, cases, grid)


def _extended(settings: JointSettings) -> Case:
    slow = {"filterpy": others.filterpy_ekf(settings), "numpy loop": others.numpy_ekf(settings)}
    return Case(cd.compile(joint_ekf(settings), list(ESTIMATES)), slow, partial(steering_c.ekf, settings), EXACT)


def _unscented(settings: JointSettings, alpha: float, tolerance: float) -> Case:
    w = ukf_weights(alpha=alpha)
    slow = {"filterpy": others.filterpy_ukf(settings, alpha), "numpy loop": others.numpy_ukf(settings, w)}
    program = cd.compile(joint_ukf(settings, w), list(ESTIMATES))
    return Case(program, slow, partial(steering_c.ukf, settings, w), tolerance)


def _slow(name: str, cases: list[Case], grid: Grid) -> Iterator[Row]:
    """Rows against what runs a sample at a time in Python; all cases are compared, the first one is timed."""
    program, count = cases[0].program, len(grid)
    ours = measure(lambda: program.run_grid(grid), 7)
    rows = np.column_stack([grid.values[name] for name in CHANNELS])[: min(PART, count // 10)]
    title = f"{name}, 4 outputs, {count} samples"
    for other, work in cases[0].slow.items():
        say(f"  {title} against {other}")
        note = _agreement([(case, grid, case.slow[other](rows)) for case in cases])
        took = measure(lambda work=work: work(rows), 3).best * count / len(rows)
        note += f"; {count / ours.best / 1e6:.1f} million samples/s; {other} measured on {len(rows)} samples and scaled"
        yield compared(title, ours.best, other, took, note, FILTERPY if other == "filterpy" else None, ours.spread)


def _plain(name: str, cases: list[Case], grid: Grid) -> Iterator[Row]:
    """The row against C by hand, into arrays that are there already; all cases are compared, the first one is timed."""
    if plain_c.compiler() is None:
        say("  no gcc: plain C left out")
        return
    say(f"  {name} against C by hand")
    count, columns, flags = len(grid), [grid.values[c] for c in CHANNELS], [grid.fresh[c] for c in CHANNELS]
    results = [np.zeros(count) for _ in ESTIMATES]

    def outcome(c_loop: Callable[..., None]) -> np.ndarray:
        c_loop(count, columns, flags, results)
        return np.stack(results, axis=1)

    with tempfile.TemporaryDirectory() as folder:
        by_flags = [
            [case.plain(Path(folder) / str(k), c_flags) for k, case in enumerate(cases)]
            for c_flags in (plain_c.FLAGS, plain_c.NATIVE)
        ]
        notes = [
            _agreement([(case, grid, outcome(c)) for case, c in zip(cases, loops, strict=True)]) for loops in by_flags
        ]
        ours = measure(Loop(cases[0].program, grid), 9)
        plain, native = (measure(lambda c=loops[0]: c(count, columns, flags, results), 9) for loops in by_flags)
    note = (
        f"{notes[0]}; {count / plain.best / 1e6:.1f} million samples/s in C; {cases[0].program.recorded.operations()} operations; "
        f"-march=native: {plain.best / native.best:.2f} times as quick"
    )
    title = f"{name}, 4 outputs, the loop alone"
    yield compared(title, ours.best, "by hand, gcc -O3", plain.best, note, C, ours.spread)


def _agreement(results: list[tuple[Case, Grid, np.ndarray]]) -> str:
    """How far others' results are from ours, J_s and b_s in shares of the true ones; the second case in brackets."""
    said = []
    for case, grid, other in results:
        ours = case.program.run_grid(grid)
        said.append(agree(np.stack([ours[n] for n in ESTIMATES], axis=1) / UNITS, other / UNITS, case.tolerance))
    return said[0] + (f" ({said[1].removeprefix('results agree to ')} with alpha = {ALPHAS[1]})" if said[1:] else "")
