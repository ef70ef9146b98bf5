"""The three drivers of 2019 section 5, on this project's circuit in place of CarSim's.

    figure 12    a two-point driver whose anticipation is a predictive plan; he does not vary
    figure 14    a human; in his place a two-point driver who varies: gains drift, eyes and hands are noisy
    figure 16    the driver identified from the human; in his place the same two-point driver without variation

Each drives one lap to the left and one to the right at 50 km/h, some four minutes.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

from codriver.drivers.learned.features import ESTIMATED
from codriver.papers.steering2019.drive import PRESET
from codriver.run import estimate_log
from codriver.signals import Log, Signal
from codriver.simulate.circuit import CircuitDrive, CircuitSetting, simulate_circuit
from codriver.simulate.variability import Variability
from codriver.vehicles import Vehicle

PI = "driver-torque-pi"
_RATE = 100.0  # ticks/s of the PI observer


@cache
def synthetic(seed: int) -> CircuitDrive:
    """Of figure 12."""
    return simulate_circuit(CircuitSetting(anticipation="mpc", laps=1), seed=seed)


@cache
def human(seed: int) -> CircuitDrive:
    """Of figure 14."""
    return simulate_circuit(CircuitSetting(variability=Variability(), laps=1), seed=seed)


@cache
def regenerated(seed: int) -> CircuitDrive:
    """Of figure 16."""
    return simulate_circuit(CircuitSetting(laps=1), seed=seed)


SCENES: dict[str, Callable[[int], CircuitDrive]] = {
    "figure 12": synthetic, "figure 14": human, "figure 16": regenerated,
}  # fmt: skip


def observed(drive: CircuitDrive) -> Log:
    """The log of a drive with the PI observer's torque in place of the sensor's, as the paper's labels are.

    Args:
        drive: its wheel's inertia and damping are taken as known; its friction is not.
    """
    wheel = drive.setting.wheel
    column = (
        Vehicle("wheel", "", "", {})
        .with_parameter("steering_inertia", wheel.inertia)
        .with_parameter("steering_damping", wheel.damping)
    )
    log = drive.log()
    found = estimate_log(PI, log, column, preset=PRESET, rate=_RATE)
    torque = found["driver_torque"]
    values = np.where(found.valid, torque.values, np.nan)
    return log.with_signals(Signal("driver_torque", torque.time, values, torque.unit, f"{ESTIMATED}{found.observer}"))
