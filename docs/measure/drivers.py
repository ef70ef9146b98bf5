"""Figures of docs/drivers.md: models of a driver, each drive held out in turn, on simulated and recorded drives.

Run from a clone: python docs/measure/drivers.py [circuit] [udacity]
"""

# ruff: noqa: T201
from __future__ import annotations

import sys
from pathlib import Path

from codriver.drivers.learned.evaluate import evaluate
from codriver.drivers.learned.kinds import KINDS
from codriver.drivers.learned.protocol import Protocol
from codriver.logs import read
from codriver.signals import Log
from codriver.simulate.circuit import CircuitSetting, simulate_circuit
from codriver.simulate.circuit_drivers import circuit_driver
from codriver.simulate.variability import Variability

DATA = Path(__file__).parents[3] / "shared" / "data" / "udacity-lincoln-mkz"
NAMES = Path(__file__).parents[2] / "tests" / "names" / "udacity.toml"


def circuit() -> dict[str, Log]:
    """Three drives of a varying driver, one lap each way."""
    setting = CircuitSetting(driver=circuit_driver("anna"), variability=Variability(), laps=1)
    return {f"drive {seed}": simulate_circuit(setting, seed=seed).log() for seed in (1, 2, 3)}


def udacity() -> dict[str, Log]:
    """Three drives of a Lincoln MKZ with a torque sensor."""
    files = {"hmb1": "hmb1-20hz.csv", "hmb2": "hmb2-20hz.csv", "hmb6": "hmb6-steering-50hz.csv"}
    return {name: read(DATA / file, names=NAMES) for name, file in files.items()}


def main() -> None:
    """Print a table a source and horizon."""
    wanted = sys.argv[1:] or ["circuit", "udacity"]
    for name in wanted:
        drives = {"circuit": circuit, "udacity": udacity}[name]()
        for horizon in (0.2, 1.0):
            protocol = Protocol().with_features(horizon=horizon)
            found = evaluate(drives, KINDS, protocol=protocol)
            print(f"\n{name}, {horizon:g} s ahead, {len(found.features)} features")
            for kind in found.kinds:
                each = " ".join(f"{score.rmse:.4f}" for score in found.scores[kind])
                figures = " ".join(
                    f"{name} {found.mean(kind, name):.3f}" for name in ("ratio", "inside68", "inside95", "log_density")
                )
                print(
                    f"{kind:9} {found.mean(kind):.4f} {figures} "
                    f"fit {max(s.seconds for s in found.scores[kind]):.1f} s | {each}",
                    flush=True,
                )


if __name__ == "__main__":
    main()
