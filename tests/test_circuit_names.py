"""What a circuit's files and errors say of driver and car."""

from dataclasses import replace
from math import nan
from pathlib import Path

import numpy as np
import pytest

from codriver.cli.simulate_circuit import file_name
from codriver.errors import UsageError
from codriver.models.two_point import TwoPointDriver
from codriver.models.two_point_file import load_two_point
from codriver.simulate.circuit import CircuitSetting
from codriver.simulate.circuit_drivers import CIRCUIT_DRIVERS, circuit_driver, name_of
from codriver.simulate.circuit_files import circuit_vehicle, write_circuit
from codriver.simulate.shared_control import SharedDrive, SharedSetting
from codriver.simulate.shared_files import write_shared


def test_a_driver_is_known_by_his_parameters() -> None:
    assert [name_of(d) for d in CIRCUIT_DRIVERS.values()] == list(CIRCUIT_DRIVERS)
    assert name_of(replace(CIRCUIT_DRIVERS["ben"], delay=0.17)) is None


def test_an_unknown_driver_is_told_of_files() -> None:
    with pytest.raises(UsageError, match=r"NAME\.toml"):
        circuit_driver("laps")


def test_the_car_is_as_simulated() -> None:
    parameters = circuit_vehicle(CircuitSetting()).parameters.values()
    assert {p.source for p in parameters} == {"as simulated"}


@pytest.mark.parametrize(
    ("driver", "name"), [("mine.toml", "mine"), ("laps/mine.toml", "mine"), ("ben.toml", "ben"), ("ben", None)]
)
def test_a_driver_of_a_file_is_called_as_the_file(driver: str, name: str | None) -> None:
    assert file_name(driver) == name


@pytest.mark.parametrize(
    ("driver", "given", "name"),
    [(CIRCUIT_DRIVERS["ben"], None, "ben"), (CIRCUIT_DRIVERS["ben"], "mine", "mine"),
     (replace(CIRCUIT_DRIVERS["ben"], delay=0.17), None, "truth")],
)  # fmt: skip
def test_truth_names_who_drove(tmp_path: Path, driver: TwoPointDriver, given: str | None, name: str) -> None:
    setting = CircuitSetting(driver, laps=1, direction="left")
    files, drive = write_circuit(tmp_path / "a", setting, name=given)
    assert load_two_point(files.driver).name == name
    nothing = np.zeros_like(drive.time)
    alone = SharedDrive(SharedSetting(setting), drive, nothing, nothing, nothing, nan)
    assert load_two_point(write_shared(tmp_path / "b", alone, given).driver).name == name
