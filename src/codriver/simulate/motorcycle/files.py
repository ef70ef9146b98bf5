"""A ride as files, and the truth.

ride.csv        what a logger on the machine has: gyroscope and accelerometer in the leaning frame's axes, encoder, wheel speed
names.toml      what the columns mean
vehicle.toml    the machine that the ride was planned for, IMU's place included; another rider, other tyres, encoder's zero are not
truth.parquet   roll, steer, lateral velocity, rates, tyre forces, the rider's torque, place on the course
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from pathlib import Path

import numpy as np

from codriver.logs.write import Column, write_table
from codriver.signals import Log
from codriver.signals.signal import Array
from codriver.simulate.folder import refuse_foreign, write_folder
from codriver.simulate.motorcycle.scenarios import RideRecord, RideSetting, nominal_machine, simulate_ride
from codriver.vehicles import Vehicle, load_vehicle, save_vehicle

FILES = ("ride.csv", "names.toml", "vehicle.toml", "truth.parquet")
_DEGREE = 180 / pi
# Standard name, column, unit in the file, factor from SI, digits.
_COLUMNS = (
    ("roll_rate", "GyroX", "deg/s", _DEGREE, 4), ("pitch_rate", "GyroY", "deg/s", _DEGREE, 4),
    ("yaw_rate", "GyroZ", "deg/s", _DEGREE, 4), ("longitudinal_acceleration", "AccX", "m/s^2", 1.0, 4),
    ("lateral_acceleration", "AccY", "m/s^2", 1.0, 4), ("vertical_acceleration", "AccZ", "m/s^2", 1.0, 4),
    ("steer_angle", "Steer", "deg", _DEGREE, 5), ("longitudinal_speed", "WheelSpeed", "km/h", 3.6, 3),
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class RideFiles:
    """The files written, in the order of FILES."""

    ride: Path
    names: Path
    vehicle: Path
    truth: Path


def nominal_vehicle(imu: tuple[float, float, float] | None = None) -> Vehicle:
    """Sharp's machine with what the simulated one has beyond it and an observer may use.

    Args:
        imu: another place of the IMU than the machine's, m: forward, left, up.
    """
    machine = nominal_machine()
    vehicle, source = load_vehicle("sharp1971"), "codriver.simulate.motorcycle, of usual order"
    forward, left, height = imu or machine.imu
    for name, value in (
        ("front_crown_radius", machine.front.crown), ("rear_crown_radius", machine.rear.crown),
        ("pneumatic_trail", machine.front.pneumatic_trail), ("drag", machine.air_density * machine.drag_area / 2),
        ("imu_forward", forward), ("imu_left", left), ("imu_height", height),
    ):  # fmt: skip
        vehicle = vehicle.with_parameter(name, value, source=source)
    return vehicle


def write_ride(folder: str | Path, setting: RideSetting | None = None, seed: int = 0) -> tuple[RideFiles, RideRecord]:
    """Simulate a ride and write it into a folder, made if need be, whole or not at all.

    Args:
        folder: to write into.
        setting: what ride.
        seed: of rider and sensors.

    Raises:
        UsageError: the folder holds files, and not those of a ride; or the machine falls.
        LogError: a file cannot be written.
    """
    folder = Path(folder)
    refuse_foreign(folder, "ride", FILES)
    record = simulate_ride(setting, seed)
    write_folder(folder, lambda scratch: _write(record, scratch), "ride", FILES)
    return RideFiles(*(folder / name for name in FILES)), record


def _write(record: RideRecord, folder: Path) -> None:
    files, log = RideFiles(*(folder / name for name in FILES)), record.log()
    files.ride.write_text(_table(record.ride.time, log), encoding="utf-8")
    names = "".join(f'[{name}]\nsource = "{column}"\nunit = "{unit}"\n\n' for name, column, unit, _, _ in _COLUMNS)
    files.names.write_text(
        f"# The log of a simulated ride; rates and accelerations in the machine's axes.\n{names}", encoding="utf-8"
    )
    save_vehicle(nominal_vehicle(record.setting.imu), files.vehicle)
    truth = record.truth()
    columns = [Column(signal.name, signal.values, signal.unit) for signal in truth.values()]
    write_table(files.truth, record.ride.time, columns, {"source": truth.source, "seed": str(record.seed)})


def _table(time: Array, log: Log) -> str:
    """A CSV with a column of time first."""
    form = ",".join(["{:.3f}", *(f"{{:.{digits}f}}" for *_, digits in _COLUMNS)])
    values = [(np.round(log[name].values * factor, digits) + 0.0).tolist() for name, _, _, factor, digits in _COLUMNS]
    rows = [form.format(*row) for row in zip(time.tolist(), *values, strict=True)]
    return "\n".join([",".join(["t", *(column for _, column, *_ in _COLUMNS)]), *rows, ""])
