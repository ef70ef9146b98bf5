"""What a circuit's files and errors say of driver and car."""

from dataclasses import replace

import pytest

from codriver.errors import UsageError
from codriver.simulate.circuit import CircuitSetting
from codriver.simulate.circuit_drivers import CIRCUIT_DRIVERS, circuit_driver, name_of
from codriver.simulate.circuit_files import circuit_vehicle


def test_a_driver_is_known_by_his_parameters() -> None:
    assert [name_of(d) for d in CIRCUIT_DRIVERS.values()] == list(CIRCUIT_DRIVERS)
    assert name_of(replace(CIRCUIT_DRIVERS["ben"], delay=0.17)) is None


def test_an_unknown_driver_is_told_of_files() -> None:
    with pytest.raises(UsageError, match=r"NAME\.toml"):
        circuit_driver("laps")


def test_the_car_is_as_simulated() -> None:
    parameters = circuit_vehicle(CircuitSetting()).parameters.values()
    assert {p.source for p in parameters} == {"as simulated"}
