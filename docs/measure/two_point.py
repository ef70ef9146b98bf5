"""Figures of docs/two-point.md: drivers identified with the wrong points, at two speeds, from an estimated torque, from
drives with holes, by dual EKF.

Run from a clone: python docs/measure/two_point.py [points] [speeds] [torque] [holes] [dual]
"""

# ruff: noqa: T201
from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np

from codriver.identify import DriverFit, identify_driver
from codriver.identify.driver_dual_ekf import DualTuning, dual_ekf
from codriver.identify.driver_fit import ASKED
from codriver.identify.driver_record import driver_record
from codriver.identify.regression import rms
from codriver.models.two_point import TwoPointDriver
from codriver.papers.drivers2019.figure_15 import START, TRUTH
from codriver.run import estimate_log
from codriver.signals import Log, Signal
from codriver.simulate.circuit import CircuitSetting, simulate_circuit
from codriver.simulate.circuit_drivers import CIRCUIT_DRIVERS
from codriver.simulate.circuit_files import circuit_vehicle
from codriver.simulate.rig import RigCar
from codriver.simulate.variability import Variability

CARLA = CIRCUIT_DRIVERS["carla"]
DRIFTING = Variability(drift=0.07, near=0.002, far=0.001, motor=0.05)


def say(what: str, fit: DriverFit, truth: TwoPointDriver) -> None:
    """Values with standard errors over the truth."""
    told = ", ".join(
        f"{p.letter} {p.value:.4g} ± {p.sd:.2g} ({p.value / getattr(truth, p.name):.2f})"
        for p in fit.parameters.values()
    )
    print(f"{what}: {fit.explained:.4f} explained; {told}", flush=True)


def points() -> None:
    """Where he looks, given wrong, and sought."""
    log = simulate_circuit(CircuitSetting(CARLA), seed=1).log()
    for near, far in ((6, 1.3), (6, 1.17), (6, 1.43), (5, 1.3), (7.2, 1.3)):
        say(f"near {near:g} m, far {far:g} s", identify_driver(log, TwoPointDriver(near=near, far=far)), CARLA)
    short = simulate_circuit(CircuitSetting(CARLA, laps=1), seed=1).log()
    say("sought from 1.43 s", identify_driver(short, TwoPointDriver(far=1.43), also=("near", "far")), CARLA)


def speeds() -> None:
    """K_r from two speeds."""
    truth = replace(CARLA, column_gain=0.2)
    made = [CircuitSetting(truth, laps=1, car=replace(RigCar(), speed=v / 3.6)) for v in (35, 50)]
    say("35 and 50 km/h", identify_driver([simulate_circuit(s, seed=1).log() for s in made]), truth)


def torque() -> None:
    """A torque that is estimated, by the column as it is and without its friction."""
    drive = simulate_circuit(CircuitSetting(laps=1), seed=0)
    log, car = drive.log(), circuit_vehicle(drive.setting)
    blind = Log.of([log[n] for n in log if n != "driver_torque"], source=log.source)
    for what, vehicle in (("as it is", car), ("without friction", car.with_parameter("steering_friction", 0.0))):
        estimate = estimate_log("driver-torque", blind, vehicle)
        found = estimate["driver_torque"]
        label = Signal(
            "driver_torque", found.time, np.where(estimate.valid, found.values, np.nan), found.unit, "estimate"
        )
        say(f"column {what}", identify_driver(blind.with_signals(label)), TwoPointDriver())


def holes() -> None:
    """Parameters from drives with holes of 20 s, off those from the whole drive, in its standard errors: rms, and the most."""
    for what, variability in (("always the same", None), ("gains that drift by 7 %", DRIFTING)):
        off: dict[int, list[float]] = {1: [], 4: []}
        for driver in CIRCUIT_DRIVERS.values():
            known = TwoPointDriver(near=driver.near, far=driver.far)
            log = simulate_circuit(CircuitSetting(driver, variability, laps=2), seed=1).log()
            whole = identify_driver(log, known)
            for count, found in off.items():
                part = identify_driver(with_holes(log, count), known)
                both = whole.parameters.keys() & part.parameters.keys()
                found += [
                    float(np.log(part.parameters[n].value / whole.parameters[n].value))
                    * whole.parameters[n].value
                    / whole.parameters[n].sd
                    for n in both
                ]
        for count, found in off.items():
            print(
                f"{what}, {count} holes: {len(found)} parameters, {rms(np.array(found)):.2f} off, "
                f"{max(map(abs, found)):.2f} at most"
            )


def with_holes(log: Log, count: int) -> Log:
    """A drive whose torque lacks 20 s, so many times."""
    torque = log["driver_torque"]
    at = np.linspace(torque.time[0], torque.time[-1], count + 2)[1:-1]
    gone = (np.abs(torque.time[:, None] - at) < 10.0).any(axis=1)
    return log.with_signals(replace(torque, values=np.where(gone, np.nan, torque.values)))


def dual() -> None:
    """The dual filter's tuning, on a driver who is always the same, from a driver a fifth to a half off."""
    record = driver_record(simulate_circuit(CircuitSetting(laps=1), seed=1).log(), TRUTH.near, TRUTH.far)
    for doubt in (1.0, 2.0, 4.0, 8.0):
        ends = dual_ekf(record, START, ASKED, DualTuning(doubt=doubt, spread=0.5)).last()
        print(
            f"doubt {doubt:g} N m:",
            ", ".join(f"{n} {v / getattr(TRUTH, n):.2f}" for n, (v, _) in ends.items()),
            flush=True,
        )


def main() -> None:
    """Those asked for, or all."""
    for name in sys.argv[1:] or ["points", "speeds", "torque", "holes", "dual"]:
        {"points": points, "speeds": speeds, "torque": torque, "holes": holes, "dual": dual}[name]()


if __name__ == "__main__":
    main()
