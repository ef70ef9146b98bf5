"""The batch observer over a million samples: against libraries, a numpy loop, and plain C.

Every alternative gets the same model, noise and rows and is compared with our numbers before it is timed. Two
forms: the Kalman form carries its covariance, the constant-gain form does not. What is slow and steady is
measured on a part and scaled; the notes say so.
"""

from __future__ import annotations

import ctypes
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import others
import plain_c
from measure import Row, Timing, compared, measure, say
from plain_step import plain_observer

import codriver as cd
from codriver.observers import design_scaled_gain
from codriver.program import Program
from codriver.signals import Grid

DT = 0.01
ESTIMATES = ("longitudinal_speed", "longitudinal_acceleration", "acceleration_offset", "longitudinal_jerk")


def drive(count: int, *, half_speed: bool = False) -> Grid:
    """Noisy accelerometer and speed of a car that never stands; with `half_speed`, every second speed is missing."""
    rng = np.random.default_rng(0)
    time = np.arange(count) * DT
    columns = {
        "longitudinal_acceleration": np.sin(0.3 * time) + 0.3 + 0.05 * rng.standard_normal(count),
        "longitudinal_speed": 20 - np.cos(0.3 * time) / 0.3 + 0.02 * rng.standard_normal(count),
        "gear": np.full(count, 3.0),
    }
    there = {name: np.ones(count, bool) for name in columns}
    if half_speed:
        there["longitudinal_speed"] = np.arange(count) % 2 == 0
    return Grid(time, DT, columns, there, there)


class Loop:
    """The compiled loop of a program over a grid into arrays that are there already: what plain C is held against."""

    def __init__(self, program: Program, grid: Grid) -> None:
        channels = program.observer.channels
        self.program, self.count = program, len(grid)
        self.columns, self.flags = [grid.values[c] for c in channels], [grid.fresh[c] for c in channels]
        self.outputs = [np.zeros(len(grid)) for _ in program.recorded.outputs]
        carry = program.observer.carry
        self._start = np.array([carry[name] for name in program.recorded.carry])
        arrays = [*self.columns, *self.flags]
        self._given = (ctypes.c_void_p * len(arrays))(*[array.ctypes.data for array in arrays])
        self._made = (ctypes.c_void_p * len(self.outputs))(*[array.ctypes.data for array in self.outputs])

    def __call__(self) -> None:
        state = self._start.copy()
        where = state.ctypes.data, ctypes.addressof(self._given), ctypes.addressof(self._made)
        self.program._compiled.run(self.count, *where)


def agree(ours: np.ndarray, other: np.ndarray, tolerance: float = 1e-7) -> str:
    """How far apart two results of shape (n, 4) are, for the note.

    Raises:
        ValueError: further than the tolerance.
    """
    error = float(np.max(np.abs(ours[: len(other)] - other) / np.maximum(1.0, np.abs(other))))
    if not error <= tolerance:
        raise ValueError(f"results differ by {error:.2g}")
    return f"results agree to {error:.0e}"


def run(quick: bool = False) -> Iterator[Row]:
    """All rows."""
    count = 50_000 if quick else 1_000_000
    for form in ("kalman", "constant"):
        observer = cd.build("kinematic", dt=DT, form=form)
        program = cd.compile(observer, outputs=list(ESTIMATES))
        grid = drive(count)
        ours = measure(lambda program=program, grid=grid: program.run_grid(grid), 7)
        yield from _libraries(form, program, grid, ours)
        if form == "kalman":
            halved = drive(count, half_speed=True)
            ours = measure(lambda program=program, grid=halved: program.run_grid(grid), 7)
            yield _against_statsmodels(program, halved, ours, ", every second speed missing")
        if plain_c.compiler() is None:
            say("  no gcc: plain C left out")
            continue
        with tempfile.TemporaryDirectory() as folder:
            for chosen in (ESTIMATES, None):
                yield from _against_export(form, cd.compile(observer, chosen), grid, Path(folder) / f"{chosen is None}")
            if form == "constant":
                yield from _by_hand(program, grid, Path(folder))


def _columns(program: Program, grid: Grid) -> np.ndarray:
    result = program.run_grid(grid)
    return np.stack([result[name] for name in ESTIMATES], axis=1)


def _scaled(
    title: str, name: str, program: Program, grid: Grid, ours: Timing, part: int, work: Callable, at_least=None
) -> Row:
    """A row against `work(columns (part, 2))`, which gives (part, 4)."""
    say(f"  {title} against {name}")
    part = min(part, len(grid))
    y = np.stack([grid.values["longitudinal_acceleration"], grid.values["longitudinal_speed"]], axis=1)[:part]
    y[~grid.fresh["longitudinal_speed"][:part], 1] = np.nan
    note = agree(_columns(program, grid), work(y))
    other = measure(lambda: work(y), 3).best * len(grid) / part
    if part < len(grid):
        note += f"; {name} measured on {part} samples and scaled"
    return compared(title, ours.best, name, other, note, at_least, ours.spread)


def _libraries(form: str, program: Program, grid: Grid, ours: Timing) -> Iterator[Row]:
    design = design_scaled_gain("bisoffi2017", DT)
    title = f"batch, {form} form, 4 outputs, {len(grid)} samples"
    if form == "kalman":
        yield _scaled(title, "filterpy", program, grid, ours, 20_000, others.filterpy_filter(design), 500)
        yield _against_statsmodels(program, grid, ours)
        yield _scaled(title, "numpy loop", program, grid, ours, 20_000, others.numpy_kalman(design))
    else:
        yield _scaled(title, "filterpy, steady", program, grid, ours, 20_000, others.filterpy_steady(design))
        yield _scaled(title, "scipy dlsim", program, grid, ours, 100_000, others.scipy_dlsim(design))
        yield _scaled(title, "numpy loop", program, grid, ours, 20_000, others.numpy_constant(design))


def _against_statsmodels(program: Program, grid: Grid, ours: Timing, more: str = "") -> Row:
    work = others.statsmodels_filter(design_scaled_gain("bisoffi2017", DT))
    title = f"batch, kalman form, 4 outputs, {len(grid)} samples{more}"
    return _scaled(title, "statsmodels", program, grid, ours, 100_000, work)


def _against_export(form: str, program: Program, grid: Grid, folder: Path) -> Iterator[Row]:
    """Equal work: the same step, exported and compiled by gcc, into the same arrays."""
    width = len(program.recorded.outputs)
    say(f"  {form} form, {width} outputs, against its exported C")
    loop = Loop(program, grid)
    results = [np.zeros(len(grid)) for _ in loop.outputs]
    loops = [plain_c.exported(program, folder, flags) for flags in (plain_c.FLAGS, plain_c.NATIVE)]
    loop()
    for c_loop in loops:
        c_loop(loop.count, loop.columns, loop.flags, results)
        if any(a.tobytes() != b.tobytes() for a, b in zip(loop.outputs, results, strict=True)):
            raise ValueError("plain C gives other bits")
    ours = measure(loop, 9)
    plain, native = (measure(lambda c=c: c(loop.count, loop.columns, loop.flags, results), 9) for c in loops)
    note = (
        f"same bits; {len(grid) / ours.best / 1e6:.1f} million samples/s; {program.recorded.operations()} operations; "
        f"-march=native: {plain.best / native.best:.2f} times as quick"
    )
    title = f"step of the {form} form, {width} outputs, the loop alone"
    yield compared(title, ours.best, "its exported C, gcc -O3", plain.best, note, 0.5, ours.spread)


def _by_hand(program: Program, grid: Grid, folder: Path) -> Iterator[Row]:
    """The observer written by hand: against the same equations through our kernel, and against the whole estimator."""
    say("  constant form against C by hand")
    design = design_scaled_gain("bisoffi2017", DT)
    bare = cd.compile(plain_observer(design))
    loop, whole = Loop(bare, grid), Loop(program, grid)
    loops = [plain_c.by_hand(design.F, design.K, folder, flags) for flags in (plain_c.FLAGS, plain_c.NATIVE)]
    results = [np.zeros(len(grid)) for _ in range(4)]
    names = ("longitudinal_acceleration", "longitudinal_speed")
    columns, flags = [grid.values[n] for n in names], [grid.fresh[n] for n in names]
    loops[0](len(grid), columns, flags, results)
    loop()
    # The whole estimator goes through the first update with the same rows, the one by hand starts behind it.
    note = agree(np.stack(loop.outputs, axis=1), np.stack(results, axis=1))
    ours, all_of_it = measure(loop, 9), measure(whole, 9)
    plain, native = (measure(lambda c=c: c(len(grid), columns, flags, results), 9) for c in loops)
    rate = f"{len(grid) / plain.best / 1e6:.0f} million samples/s in C"
    rate += f"; -march=native: {plain.best / native.best:.2f} times as quick"
    yield compared(
        "bare constant-gain observer, the loop alone", ours.best, "by hand, gcc -O3", plain.best, f"{note}; {rate}", 0.5,
        ours.spread,
    )  # fmt: skip
    yield compared(
        "the whole estimator, constant form, the loop alone", all_of_it.best, "bare observer by hand, gcc -O3", plain.best,
        "unequal work: ours also handles start, standstill and reverse", None, all_of_it.spread,
    )  # fmt: skip
