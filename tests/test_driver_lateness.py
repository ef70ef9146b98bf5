"""A torque logged late, on simulated drives."""

import numpy as np
import pytest

from codriver.identify.driver_lateness import late_findings, lateness
from codriver.simulate.circuit import CircuitSetting, simulate_circuit
from codriver.simulate.circuit_drivers import CIRCUIT_DRIVERS


@pytest.mark.parametrize("seed", [1, 3])
def test_late_and_in_time(seed: int) -> None:
    log = simulate_circuit(CircuitSetting(CIRCUIT_DRIVERS["ben"], laps=1), seed=seed).log()
    time, torque = log["driver_torque"].time, log["driver_torque"].values
    angle = np.interp(time, log["steering_wheel_angle"].time, log["steering_wheel_angle"].values)
    dt = float(time[1] - time[0])
    late = np.interp(time - 0.5, time, torque)
    assert late_findings(angle, torque, dt, "drive") == []
    assert "logged late" in late_findings(angle, late, dt, "drive")[0].text
    assert lateness(angle, late, dt) - lateness(angle, torque, dt) == pytest.approx(0.5, abs=0.051)
