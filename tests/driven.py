"""Drives of the two-point driver on the circuit, made once a process."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

from codriver.signals import Log
from codriver.simulate.circuit import CircuitSetting, simulate_circuit
from codriver.simulate.circuit_drivers import circuit_driver
from codriver.simulate.variability import Variability


@cache
def driven(name: str = "anna", seed: int = 1, laps: int = 1, direction: str = "both", varies: bool = True) -> Log:
    """The log of a drive; its source names it."""
    setting = CircuitSetting(
        driver=circuit_driver(name), variability=Variability() if varies else None, laps=laps, direction=direction
    )
    return replace(simulate_circuit(setting, seed=seed).log(), source=f"{name} {seed}")
