"""The tables of the encoder's zero in motorcycle.md: python docs/measure/steer_zero.py. A quarter of an hour.

Constants (start, creep and bend of the state, `MODEL`) were chosen on rides and noise of other seeds.
"""

# ruff: noqa: T201
from __future__ import annotations

from dataclasses import replace
from functools import cache
from math import hypot

import numpy as np
from motorcycle_observers import FRESH, NAMES

import codriver as cd
from codriver.identify.steer_zero import DEGREE, MODEL, WIDE
from codriver.names import quantity
from codriver.observers.steer_zero import SteerZero
from codriver.signals import Log
from codriver.simulate.motorcycle import SCENARIOS, Ride, RideSetting, relative_noise, sense, simulate_ride
from codriver.simulate.motorcycle.files import nominal_vehicle

SHARE, START, RIDER, NOISE = 0.075, 1.0, 7, (50, 51)
ZEROS, STATE = (0.0, 0.1, 0.3, 1.0, 3.0), 1.0  # degrees
OUTPUTS = ("roll_angle", "roll_angle_sd", "rider_torque", "valid")
FOUND = ("steer_offset", "steer_offset_sd")


@cache
def program(rate: int, sd: float) -> cd.Program:
    """The filter with a zero of so many degrees' standard deviation."""
    vehicle = SteerZero(0.0, sd * DEGREE, "measured").of(nominal_vehicle())
    return cd.compile(cd.build("motorcycle-ekf", vehicle, dt=1 / rate), [*OUTPUTS, *(FOUND if sd else ())])


@cache
def ride(scenario: str, rider: float) -> Ride:
    """Told a rider of 75 kg."""
    return simulate_ride(RideSetting(scenario, rate=1000, rider_mass=rider), seed=RIDER).ride


def measured(done: Ride, seed: int, rate: int, zero: float, bias: bool) -> Log:
    """The log; biases are to sides that the seed draws."""
    sensors = replace(relative_noise(done, SHARE), wheel=True, zero=zero * DEGREE)
    if bias:
        side = np.random.default_rng(1000 + seed).choice([-1.0, 1.0], 6)
        gyro, force = 0.5 * DEGREE * side[:3], 0.2 * side[3:]
        sensors = replace(sensors, gyro_bias=tuple(gyro), accelerometer_bias=tuple(force))
    values, every = sense(done, sensors, seed), 1000 // rate
    return Log.of([cd.Signal(n, done.time[::every], values[k][::every], quantity(n).unit) for k, n in NAMES.items()])


def errors(found: cd.Estimate, done: Ride) -> tuple[float, float]:
    """Mean squares of roll's error, degrees, and of the rider's torque's, N m, from START on."""
    late = found.time >= START
    return tuple(
        float(np.mean(((found[name].values - np.interp(found.time, done.time, done.of(true))) / unit)[late] ** 2))
        for name, true, unit in (("roll_angle", "roll", DEGREE), ("rider_torque", "rider_torque", 1.0))
    )  # type: ignore[return-value]


def auto(log: Log, rate: int) -> tuple[cd.Estimate, float, float]:
    """As --steer-zero auto, the standard error rounded to thousandths of a degree; the zero and its error, degrees."""
    wide = program(rate, WIDE / DEGREE).run(log)
    sds = np.where(wide.valid, wide.columns["steer_offset_sd"], np.inf)
    k = int(np.argmin(sds))
    zero, sd = float(wide.columns["steer_offset"][k]), round(hypot(float(sds[k]), MODEL) / DEGREE, 3)
    d = log["steer_angle"]
    straight = log.with_signals(cd.Signal("steer_angle", d.time, d.values - zero, d.unit))
    return program(rate, sd).run(straight), zero / DEGREE, sd


def row(scenario: str, rate: int, bias: bool, rider: float, zeros: tuple[float, ...] = ZEROS) -> None:
    """A line of the table: known to be 0 (or wrongly so), found while it runs, found from the whole ride."""
    done = ride(scenario, rider)
    for zero in zeros:
        squares, off, said = [], [], []
        for seed in NOISE:
            log = measured(done, seed, rate, zero, bias)
            twice, found, sd = auto(log, rate)
            squares.append(
                [errors(e, done) for e in (program(rate, 0.0).run(log), program(rate, STATE).run(log), twice)]
            )
            off.append(found - zero)
            said.append(sd)
        cells = [f"{r:.2f} / {t:.1f}" for r, t in np.sqrt(np.mean(squares, axis=0))]
        what = f"{scenario} | {rate} Hz{', biases' if bias else ''}{f', rider of {rider:g} kg' if rider != 75 else ''}"
        print(
            f"| {what} | {zero:g} | {' | '.join(cells)} | {np.sqrt(np.mean(np.square(off))):.3f} ({np.mean(said):.3f}) |",
            flush=True,
        )


def main() -> None:
    """Print the tables."""
    SCENARIOS.update(FRESH)
    for scenario in ("track", "slalom", "double-lane-change"):
        for rate in (200, 1000):
            for bias in (False, True):
                row(scenario, rate, bias, 75.0)
        row(scenario, 200, False, 110.0, (0.0, 1.0))
        row(scenario, 200, True, 110.0, (0.0, 1.0))
    for scenario in FRESH:
        for bias in (False, True):
            row(scenario, 200, bias, 75.0, (0.0, 1.0))


if __name__ == "__main__":
    main()
