"""The motorcycle's estimators, 9 and 16 states, at 200 Hz: against filterpy and numpy loops, their exported C, and one live call.

Every alternative gets the same model, noise and rows and is compared with our numbers before it is timed, on a part that is
scaled, since it is slow and steady. Rows are made up: a machine that leans to and fro while its speed goes up and down. Times
are processor time on one thread: the alternatives take so long that other programs would count.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import motorcycle_others as others
import numpy as np
import plain_c
from batch import Loop, agree
from measure import Row, compared, duration, say
from measure import measure as timed

import codriver as cd
from codriver.models import MotorcycleParameters, motorcycle_model
from codriver.models.motorcycle_lean import LeanParameters
from codriver.observers.motorcycle_ekf import motorcycle_ekf
from codriver.observers.motorcycle_ekf_states import ROWS, STATES
from codriver.observers.motorcycle_kalman import SENSED, motorcycle_kalman
from codriver.observers.motorcycle_lmi import design_motorcycle_lmi
from codriver.observers.motorcycle_ts import motorcycle_ts_observer
from codriver.program import Program
from codriver.signals import Grid

DT, SPEED = 0.005, "longitudinal_speed"
PART, CALLS = 2000, 20_000
CLOSE = 1e-6
measure = partial(timed, clock=time.process_time)
# Sizes in which results are compared: roll, steer, lateral velocity, yaw rate, roll rate, steer rate, forces, torque.
SIZES = np.array([0.1, 0.01, 0.5, 0.2, 0.2, 0.2, 300.0, 300.0, 10.0])


@dataclass(frozen=True, eq=False)
class Case:
    """One estimator, and the alternatives to it.

    Attributes:
        program: ours, with its states as outputs.
        states: their names in the order of the alternatives' results.
        channels: of the alternatives' rows.
        slow: by name.
    """

    program: Program
    states: tuple[str, ...]
    channels: tuple[str, ...]
    slow: dict[str, others.Work]


def ride(count: int) -> Grid:
    """A weave of 30 degrees at 12 to 28 m/s, with noise."""
    rng, time = np.random.default_rng(0), np.arange(count) * DT
    phi, v = 0.5 * np.sin(0.8 * time), 20 + 8 * np.sin(0.05 * time)
    turn = -9.81 * np.tan(phi) / v
    columns = {
        "roll_rate": 0.4 * np.cos(0.8 * time), "pitch_rate": turn * np.sin(phi), "yaw_rate": turn * np.cos(phi),
        "lateral_acceleration": 0 * time, "vertical_acceleration": 9.81 / np.cos(phi), "steer_angle": 0.02 * np.sin(phi),
    }  # fmt: skip
    columns = {name: values + 0.01 * rng.standard_normal(count) for name, values in columns.items()}
    columns["steer_rate"] = 0.008 * np.cos(0.8 * time)
    columns[SPEED] = v
    there = dict.fromkeys(columns, np.ones(count, bool))
    return Grid(time, DT, columns, there, there)


def cases() -> dict[str, Case]:
    """By name."""
    vehicle = cd.load_vehicle("sharp1971")
    model = motorcycle_model(MotorcycleParameters.from_vehicle(vehicle)).with_walking_inputs()
    lean = LeanParameters.from_vehicle(vehicle)
    design = design_motorcycle_lmi(model, 8.0, 45.0, DT)
    ts, linear, large = motorcycle_ts_observer(design), motorcycle_kalman(model, DT), motorcycle_ekf(lean, DT)
    known = tuple("heading_rate" if name == "yaw_rate" else name for name in model.states)
    terms = {name: int(o.settings["terms"]) for name, o in (("kalman", linear), ("ekf", large))}
    return {
        "motorcycle-ts": Case(
            cd.compile(ts, list(model.states)), model.states, (*model.outputs, SPEED),
            {"numpy loop": others.numpy_ts(design, int(ts.settings["parts"]), int(ts.settings["terms"]))},
        ),
        "motorcycle-kalman": Case(
            cd.compile(linear, list(known)), known, (*SENSED, SPEED),
            {"filterpy": others.filterpy_kalman(model, DT, terms["kalman"]),
             "numpy loop": others.numpy_kalman(model, DT, terms["kalman"])},
        ),
        "motorcycle-ekf": Case(
            cd.compile(large, list(STATES)), STATES, (*ROWS, SPEED),
            {"numpy loop, model by CasADi": others.numpy_ekf(lean, DT, terms["ekf"])},
        ),
    }  # fmt: skip


def run(quick: bool = False) -> Iterator[Row]:
    """All rows."""
    count = 20_000 if quick else 200_000
    grid = ride(count)
    for name, case in cases().items():
        yield from _slow(name, case, grid, PART // 8 if quick else PART)
        if plain_c.compiler() is None:
            say("  no gcc: exported C left out")
        else:
            yield _exported(name, case, grid)
        yield _live(name, case, grid, CALLS // 10 if quick else CALLS)


def _slow(name: str, case: Case, grid: Grid, part: int) -> Iterator[Row]:
    """Rows against what runs a sample at a time in Python."""
    count = len(grid)
    ours = measure(lambda: case.program.run_grid(grid), 5)
    made = case.program.run_grid(grid)
    sizes = SIZES if len(case.states) == len(SIZES) else np.concatenate([SIZES, np.ones(len(case.states) - len(SIZES))])
    found = np.column_stack([made[n] for n in case.states]) / sizes
    rows = np.column_stack([grid.values[n] for n in case.channels])[:part]
    title = f"{name}, {len(case.states)} states, {count} samples"
    for other, work in case.slow.items():
        say(f"  {title} against {other}")
        note = agree(found, work(rows) / sizes, CLOSE)
        took = measure(lambda work=work: work(rows), 3).best * count / len(rows)
        note += f"; {count / ours.best:,.0f} samples/s, {other} {count / took:,.0f}, measured on {len(rows)} samples and scaled"
        yield compared(title, ours.best, other, took, note, None, ours.spread)


def _exported(name: str, case: Case, grid: Grid) -> Row:
    """Equal work: the same step, exported and compiled by gcc, into the same arrays."""
    say(f"  {name} against its exported C")
    loop = Loop(case.program, grid)
    results = [np.zeros(len(grid)) for _ in loop.outputs]
    with tempfile.TemporaryDirectory() as folder:
        c_loop = plain_c.exported(case.program, Path(folder), plain_c.FLAGS)
        loop()
        c_loop(loop.count, loop.columns, loop.flags, results)
        if any(a.tobytes() != b.tobytes() for a, b in zip(loop.outputs, results, strict=True)):
            raise ValueError("plain C gives other bits")
        ours = measure(loop, 5)
        plain = measure(lambda: c_loop(loop.count, loop.columns, loop.flags, results), 5)
    note = f"same bits; {case.program.recorded.operations()} operations"
    return compared(
        f"step of {name}, the loop alone", ours.best, "its exported C, gcc -O3", plain.best, note, None, ours.spread
    )


def _live(name: str, case: Case, grid: Grid, calls: int) -> Row:
    """One call with a tuple."""
    stepper = case.program.live()
    values = [
        1.0 if n.rsplit("_", 1)[-1] in ("ok", "fresh", "held") else float(grid.values[n][0]) for n in stepper.inputs
    ]

    def work() -> None:
        for _ in range(calls):
            stepper(values)

    took = measure(work, 3)
    return Row(f"one live call, {name}", f"{duration(took.best / calls)} (+{took.spread})", note="Stepper.__call__")
