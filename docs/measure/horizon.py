"""Error against horizon, of docs/drivers.md: simulated drives, also iterated through vehicles that are wrong; recorded drives.

Run from a clone: python docs/measure/horizon.py [circuit] [wrong] [udacity]
"""

# ruff: noqa: T201
from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path

from codriver.drivers.learned import HorizonErrors, error_against_horizon
from codriver.logs import read
from codriver.signals import Log
from codriver.simulate.circuit import CircuitSetting, simulate_circuit
from codriver.simulate.circuit_files import circuit_vehicle
from codriver.simulate.variability import Variability
from codriver.vehicles import Vehicle

DATA = Path(__file__).parents[3] / "shared" / "data" / "udacity-lincoln-mkz"
NAMES = Path(__file__).parents[2] / "tests" / "names" / "udacity.toml"
WRONG: Mapping[str, Mapping[str, float]] = {
    "K_aln + 20 %": {"alignment_stiffness": 1200.0}, "K_aln - 20 %": {"alignment_stiffness": 800.0},
    "no friction": {"steering_friction": 0.0},
    "tyres + 20 %": {"front_cornering_stiffness": 1.08e5, "rear_cornering_stiffness": 1.32e5},
}  # fmt: skip


def drives(variability: Variability | None) -> tuple[dict[str, Log], Vehicle]:
    """Two laps each way, 8.5 minutes, three times, and the vehicle."""
    setting = CircuitSetting(variability=variability, laps=2)
    logs = {str(seed): simulate_circuit(setting, seed=seed).log() for seed in (1, 2, 3)}
    return logs, circuit_vehicle(setting)


def say(title: str, found: HorizonErrors, parts: bool = False) -> None:
    """Print a table."""
    print(f"\n{title}: {found.rows} moments; s", *(f"{h:g}" for h in found.horizons))
    for form, kind in found.made:
        pairs = zip(found.rmse(form, kind), found.spread(form, kind), strict=True)
        print(f"{kind:8} {form:9}", *(f"{value:.3f}±{error:.3f}" for value, error in pairs))
        for name, each in zip(found.folds, found.parts(form, kind), strict=True):
            if parts:
                print(f"    {name:8}", *(f"{value:.3f}" for value in each))
    print({kind: [f"{share:.4f}" for share in shares] for kind, shares in found.diverged.items()}, flush=True)


def main() -> None:
    """Print what was asked for."""
    wanted = sys.argv[1:] or ["circuit", "wrong", "udacity"]
    horizons = (0.2, 0.4, 0.6, 1.0, 1.5, 2.0)
    if "circuit" in wanted:
        for title, sizes in (("varying", Variability()), ("always the same", None)):
            logs, vehicle = drives(sizes)
            say(title, error_against_horizon(logs, horizons=horizons, vehicle=vehicle))
    if "wrong" in wanted:
        logs, right = drives(Variability())
        for title, changes in WRONG.items():
            vehicle = right
            for name, value in changes.items():
                vehicle = vehicle.with_parameter(name, value)
            say(title, error_against_horizon(logs, ("ridge",), (0.4, 1.0, 2.0), vehicle))
    if "udacity" in wanted:
        files = {"hmb1": "hmb1-20hz.csv", "hmb2": "hmb2-20hz.csv", "hmb6": "hmb6-steering-50hz.csv"}
        logs = {name: read(DATA / file, names=NAMES) for name, file in files.items()}
        say("Lincoln MKZ", error_against_horizon(logs, horizons=(0.2, 0.5, 1.0, 1.5, 2.0)), parts=True)


if __name__ == "__main__":
    main()
