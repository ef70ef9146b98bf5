"""Simulated wheels of section 4.1, many seeds at once, and how observers run over all of them.

Identification: the motor alone turns the wheel, u = 2 sin(4 t) (83). Estimation: u = T_dr + T_aln, 3 sin(3 t) + sin(4 t - pi/5)
(87)-(88), the second known. Both torques are either held over each tick, as (77) has them, or run straight between ticks; the
mean of both ends, held, moves the wheel as a straight torque does up to dt^3 of the angle.

Okamoto, Tsiotras 2019 (Robotics and Autonomous Systems).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import pi

import numpy as np

import codriver.program as programs
from codriver.estimate import Estimate
from codriver.observers.observer import Observer
from codriver.program import Program
from codriver.signals import Grid, Log, Signal
from codriver.signals.signal import Array
from codriver.simulate.steering import WheelNoise, WheelRuns, WheelSetting, simulate_wheel

J_S, B_S = 0.0672, 0.3562  # (82)
DT = 0.01  # s
DEGREE = pi / 180
ANGLE, ALIGNMENT, MOTOR = "steering_wheel_angle", "alignment_torque", "steering_motor_torque"
WORDS = {
    "step": "0.01 a step", "continuous": "0.01 dt a step", "derivative": "dt w", "none": "no noise",
}  # fmt: skip
QUIET = WheelNoise(process=0.0, angle=0.0)


def noise_of(reading: str) -> WheelNoise:
    """The noise (84) by a reading of it; "none" for none."""
    return QUIET if reading == "none" else WheelNoise(reading)


def paper_torques(time: Array) -> tuple[Array, Array]:
    """T_aln and T_dr of (87)-(88), N m."""
    return np.sin(4 * time - pi / 5), 3 * np.sin(3 * time)


@dataclass(frozen=True, eq=False)
class DrivenRuns:
    """A wheel that a driver turns, with the torque known that acts beside his hands; one record a seed.

    Attributes:
        time: s, shape (n,).
        alignment, driver: N m, shape (runs, n) each.
        angle, rate: true, rad and rad/s, shape (runs, n).
        measured: by the encoder, rad, shape (runs, n).
    """

    time: Array
    alignment: Array
    driver: Array
    angle: Array
    rate: Array
    measured: Array = field(repr=False)

    def grid(self, run: int) -> Grid:
        """One record on its ticks."""
        return on_grid(self.time, {ANGLE: self.measured[run], ALIGNMENT: self.alignment[run]})

    def log(self, run: int) -> Log:
        """One record as a log."""
        return Log.of(
            [
                Signal(ANGLE, self.time, self.measured[run], "rad", "encoder"),
                Signal(ALIGNMENT, self.time, self.alignment[run], "N*m", "vehicle model"),
            ],
            source=f"simulated record {run}",
        )


def driven_runs(
    reading: str, runs: int, *, seed: int = 0, plant: str = "exact", held: bool = False, true_start: bool = False
) -> DrivenRuns:
    """The record of figure 4, 15 s at 100 Hz.

    Args:
        reading: of the noise.
        runs: how many.
        seed: of the noise.
        plant: "euler" is (77), "exact" the continuous wheel.
        held: the torques are held over each tick; else they run straight.
        true_start: the first angle has no noise.
    """
    time = np.arange(1501, dtype=np.float64) * DT
    alignment, driver = paper_torques(time)
    total = alignment + driver
    made = simulate_wheel(
        total if held else between(total), WheelSetting(noise=noise_of(reading), plant=plant), runs=runs, seed=seed
    )
    measured = made.measured.copy()
    if true_start:
        measured[:, 0] = made.angle[:, 0]
    same = (runs, 1)
    return DrivenRuns(time, np.tile(alignment, same), np.tile(driver, same), made.angle, made.rate, measured)


def between(torque: Array) -> Array:
    """What is held over each tick in place of a torque that runs straight: the mean of both ends."""
    return np.append(0.5 * (torque[1:] + torque[:-1]), torque[-1])


def on_grid(time: Array, columns: Mapping[str, Array]) -> Grid:
    """Columns that are all there, on ticks."""
    there = dict.fromkeys(columns, np.ones(time.size, bool))
    return Grid(time, float(time[1] - time[0]), dict(columns), there, there)


def run_all(program: Program, records: DrivenRuns, carry: Mapping[str, float] | None = None) -> dict[str, Array]:
    """Every output over every record, shape (runs, n).

    Args:
        program: of an observer of the driver's torque.
        records: to run over.
        carry: to start from; the observer's own by default.
    """
    start = dict(program.observer.carry if carry is None else carry)
    made = [program.advance(records.grid(run), start)[1] for run in range(records.measured.shape[0])]
    return {name: np.stack([columns[name] for columns in made]) for name in made[0]}


def identify_all(observer: Observer, runs: WheelRuns) -> dict[str, Array]:
    """Every output of a joint filter over every recording of a wheel that its motor turns, shape (runs, n)."""
    program = programs.compile(observer)
    made = [program.run_grid(on_grid(runs.time, {ANGLE: y, MOTOR: runs.torque})) for y in runs.measured]
    return {name: np.stack([columns[name] for columns in made]) for name in made[0]}


def rmse(found: Array, truth: Array, skip: int = 0) -> Array:
    """Root mean squared error of each record from a tick on, shape (runs,)."""
    return np.asarray(np.sqrt(np.mean((found - truth)[..., skip:] ** 2, axis=-1)))


def valid_rmse(estimate: Estimate, truth: Array) -> float:
    """Root mean squared error of an estimate's driver_torque over its valid ticks, N m."""
    error = (estimate.columns["driver_torque"] - truth)[estimate.valid]
    return float(np.sqrt(np.mean(error**2)))


def spread(values: Sequence[float] | Array) -> str:
    """Mean and standard deviation, in words."""
    return f"{np.mean(values):.3f} ± {np.std(values):.3f}"
