"""Figures of docs/shared-control.md: five drivers, three drives each, several assists; margins; a detour.

Run from a clone: python docs/measure/shared.py [drives] [margins] [detour]
"""

# ruff: noqa: T201
from __future__ import annotations

import sys
from dataclasses import replace
from itertools import chain

import numpy as np

from codriver.drivers.learned import fit_driver, observer_of
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


def model_of(circuit: CircuitSetting, kind: str = "ridge"):
    """A driver model from drives without assist."""
    return compiled(observer_of(fit_driver([simulate_circuit(circuit, seed=s).log() for s in LEARNT], kind)))


def settings() -> dict[str, CircuitSetting]:
    """A lap each way, varying drivers."""
    return {name: CircuitSetting(driver, Variability(), laps=1) for name, driver in CIRCUIT_DRIVERS.items()}


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
        for circuit in settings().values():
            for name, mine in compare_assists(circuit, assists, model_of(circuit), JUDGED, used).items():
                found[name] += mine
        print(f"\nused to it: {used:g}; 5 drivers x {len(JUDGED)} drives")
        for name, each in found.items():
            mean, spread = mean_outcome(each)
            print(
                f"{name:20}",
                " ".join(f"{f} {k * getattr(mean, f):.3f}±{k * getattr(spread, f):.3f}" for f, _, _, k in FIGURES),
            )
            shakes = sum(a.power > b.power for a, b in zip(each, found["none"], strict=True))
            if name != "none":
                changes = (change_of(each, found["none"], figure) for figure in MAIN)
                said = " ".join(f"{f} {100 * m:+.1f}±{100 * e:.1f}%" for f, (m, e) in zip(MAIN, changes, strict=True))
                print(f"{'':20} {said}; shaking {shakes}", flush=True)


def margins() -> None:
    """Gain at which power steering and path assist shake, in the linear loop."""
    for name, circuit in settings().items():
        row = [
            f"{kind} lag {lag:g}: {largest_gain(SharedSetting(circuit, Assist(kind, lag=lag))):.2f}"
            for kind in ("present", "path") for lag in (0.03, 0.1, 0.4)
        ]  # fmt: skip
        print(f"{name:6}", "; ".join(row))


def detour() -> None:
    """A way round something, 1.5 m to the left and back in 6 s, which neither path assist nor model knows of."""
    for name in ("none", "present", "predicted", "path", "path, no fade"):
        reached, most, against = [], [], []
        for driver, seed in chain.from_iterable(((d, s) for s in JUDGED) for d in settings().items()):
            circuit = replace(driver[1], detours=(Detour(27.0, 6.0, 1.5),))
            kind, _, stubborn = name.partition(",")
            assist = Assist(kind, 1.0) if not stubborn else Assist(kind, 1.0, fade=None)
            if driver[0] not in MODELS:
                MODELS[driver[0]] = model_of(driver[1])
            with_it = simulate_shared(SharedSetting(circuit, assist), MODELS[driver[0]], seed=seed).drive
            without = simulate_shared(SharedSetting(driver[1], assist), MODELS[driver[0]], seed=seed).drive
            rows = (with_it.time > 26) & (with_it.time < 36)
            reached.append(float((with_it.offset - without.offset)[rows].max()))
            most.append(float(np.abs(with_it.driver_torque[rows]).max()))
            T, motor = with_it.driver_torque[rows], with_it.motor_torque[rows]
            against.append(float(np.mean(np.where(T * motor < 0, np.minimum(np.abs(T), np.abs(motor)), 0.0))))
        said = " ".join(f"{np.mean(v):.3f}±{np.std(v, ddof=1):.3f}" for v in (reached, most, against))
        print(f"{name:14} reached, most torque, against: {said}", flush=True)


MODELS: dict[str, object] = {}


def main() -> None:
    """Print what was asked for."""
    for name in sys.argv[1:] or ["drives", "margins", "detour"]:
        {"drives": drives, "margins": margins, "detour": detour}[name]()


if __name__ == "__main__":
    main()
