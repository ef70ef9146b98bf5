"""Figures of docs/shared-control.md: five drivers, three drives each, several assists; models; other speeds; margins; a detour.

Run from a clone: python docs/measure/shared.py [drives] [models] [speeds] [margins] [detour]
"""

# ruff: noqa: T201
from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np

from codriver.drivers.learned import Protocol, fit_driver, observer_of
from codriver.drivers.learned.feature_setting import HONEST
from codriver.errors import UsageError
from codriver.program import Program
from codriver.program import compile as compiled
from codriver.simulate.assist import Assist
from codriver.simulate.circuit import CircuitSetting, simulate_circuit
from codriver.simulate.circuit_drivers import CIRCUIT_DRIVERS
from codriver.simulate.detour import Detour
from codriver.simulate.shared_control import SharedSetting, simulate_shared
from codriver.simulate.shared_outcomes import FIGURES, Outcome, change_of, compare_assists, mean_outcome
from codriver.simulate.shared_stability import largest_gain
from codriver.simulate.variability import Variability

LEARNT, JUDGED = (101, 102), (1, 2, 3)  # seeds
MAIN = ("offset", "heading", "torque", "squared", "power", "reversals")
NO_SLIP, BARE = ("steering_wheel_angle", "yaw_rate", "road_curvature"), ("steering_wheel_angle", "road_curvature")
SETTINGS = {name: CircuitSetting(driver, Variability(), laps=1) for name, driver in CIRCUIT_DRIVERS.items()}


def model_of(circuit: CircuitSetting, kind: str = "ridge", past: tuple[str, ...] = BARE) -> Program:
    """A driver model from drives without assist."""
    protocol = Protocol().with_features(past=past)
    logs = [simulate_circuit(circuit, seed=seed).log() for seed in LEARNT]
    return compiled(observer_of(fit_driver(logs, kind, protocol=protocol)))


def say(name: str, each: list[Outcome], none: list[Outcome]) -> None:
    """Print mean, standard deviation, and change against no assist."""
    mean, spread = mean_outcome(each)
    figures = (f"{f} {k * getattr(mean, f):.3f}±{k * getattr(spread, f):.3f}" for f, _, _, k in FIGURES)
    print(f"{name:28}", *figures)
    changes = ((figure, change_of(each, none, figure)) for figure in MAIN)
    shakes = sum(a.power > b.power for a, b in zip(each, none, strict=True))
    said = " ".join(f"{figure} {100 * m:+.1f}±{100 * e:.1f}%" for figure, (m, e) in changes)
    print(f"{'':28} {said}; shaking {shakes} of {len(each)}", flush=True)


def drives() -> None:
    """Outcomes over drivers and seeds."""
    assists = {"none": Assist()}
    for gain in (0.5, 1.0, 2.0):
        assists |= {
            f"present {gain:g}": Assist("present", gain), f"present, lag .4 {gain:g}": Assist("present", gain, lag=0.4),
            f"predicted {gain:g}": Assist("predicted", gain), f"path {gain:g}": Assist("path", gain),
        }  # fmt: skip
    for used in (1.0, 0.0):
        found: dict[str, list[Outcome]] = {name: [] for name in assists}
        for circuit in SETTINGS.values():
            for name, mine in compare_assists(circuit, assists, model_of(circuit), JUDGED, used).items():
                found[name] += mine
        print(f"\nused to it: {used:g}; 5 drivers x {len(JUDGED)} drives")
        for name, each in found.items():
            say(name, each, found["none"])


def models() -> None:
    """Which model, and what it sees."""
    tried = {
        "guarded": ("guarded", HONEST.past), "ridge": ("ridge", HONEST.past), "ridge, no sideslip": ("ridge", NO_SLIP),
        "ridge, angle and road": ("ridge", BARE),
    }  # fmt: skip
    gains = {f"{gain:g}": Assist("predicted", gain) for gain in (0.5, 1.0, 2.0)}
    none: list[Outcome] = []
    found: dict[str, list[Outcome]] = {}
    for circuit in SETTINGS.values():
        none += compare_assists(circuit, {"none": Assist()}, seeds=JUDGED)["none"]
        for name, (kind, past) in tried.items():
            for gain, each in compare_assists(circuit, gains, model_of(circuit, kind, past), JUDGED).items():
                found[f"{name} {gain}"] = found.get(f"{name} {gain}", []) + each
    for name, each in found.items():
        say(name, each, none)


def speeds() -> None:
    """Models learnt at 50 km/h that help at other speeds, g = 1."""
    none: dict[int, list[Outcome]] = {}
    found: dict[tuple[str, int], list[Outcome]] = {}
    for circuit in SETTINGS.values():
        tried = {
            "present, lag .4": (Assist("present", 1.0, lag=0.4), None),
            "guarded": (Assist("predicted", 1.0), model_of(circuit, "guarded", HONEST.past)),
            "ridge": (Assist("predicted", 1.0), model_of(circuit, "ridge", HONEST.past)),
            "ridge, angle and road": (Assist("predicted", 1.0), model_of(circuit)),
        }  # fmt: skip
        for speed in (40, 45, 55):
            there = replace(circuit, car=replace(circuit.car, speed=speed / 3.6))
            none[speed] = none.get(speed, []) + compare_assists(there, {"none": Assist()})["none"]
            for name, (assist, model) in tried.items():
                try:
                    each = compare_assists(there, {name: assist}, model)[name]
                except UsageError as error:
                    print(name, speed, error.found)
                    continue
                found[name, speed] = found.get((name, speed), []) + each
    for (name, speed), each in found.items():
        if len(each) == len(none[speed]):
            say(f"{name} {speed} km/h", each, none[speed])


def margins() -> None:
    """Gain at which power steering and path assist shake, in the linear loop."""
    for name, circuit in SETTINGS.items():
        row = [
            f"{kind} lag {lag:g}: {largest_gain(SharedSetting(circuit, Assist(kind, lag=lag))):.2f}"
            for kind in ("present", "path") for lag in (0.03, 0.1, 0.4)
        ]  # fmt: skip
        print(f"{name:6}", "; ".join(row))


def detour() -> None:
    """A way round something, 1.5 m to the left and back in 6 s, which neither path assist nor model knows of."""
    known = {name: model_of(circuit) for name, circuit in SETTINGS.items()}
    assists = {
        "none": Assist(), "present, lag .4": Assist("present", 1.0, lag=0.4), "predicted": Assist("predicted", 1.0),
        "path": Assist("path", 1.0), "path, no fade": Assist("path", 1.0, fade=None),
    }  # fmt: skip
    for title, assist in assists.items():
        reached, most, against = [], [], []
        for seed in JUDGED:
            for name, circuit in SETTINGS.items():
                around = replace(circuit, detours=(Detour(27.0, 6.0, 1.5),))
                one, other = (
                    simulate_shared(SharedSetting(c, assist), known[name], seed=seed).drive for c in (around, circuit)
                )
                rows = (one.time > 26) & (one.time < 36)
                T, motor = one.driver_torque[rows], one.motor_torque[rows]
                reached.append(float((one.offset - other.offset)[rows].max()))
                most.append(float(np.abs(T).max()))
                against.append(float(np.mean(np.where(T * motor < 0, np.minimum(np.abs(T), np.abs(motor)), 0.0))))
        said = " ".join(f"{np.mean(v):.3f}±{np.std(v, ddof=1):.3f}" for v in (reached, most, against))
        print(f"{title:16} reached, most torque, against: {said}", flush=True)


def main() -> None:
    """Print what was asked for."""
    for name in sys.argv[1:] or ["drives", "models", "speeds", "margins", "detour"]:
        {"drives": drives, "models": models, "speeds": speeds, "margins": margins, "detour": detour}[name]()


if __name__ == "__main__":
    main()
