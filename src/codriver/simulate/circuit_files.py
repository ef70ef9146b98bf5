"""A drive round the circuit as files, and the truth.

drive.csv       what the simulator logs: wheel angle, torque, and what its vehicle model and scene know
names.toml      what the columns mean
truth.parquet   the driver's torque, the wheel's angle and rate, and where the two points were
vehicle.toml    column and car
truth.toml      the driver: his parameters, about which his gains drift if he varies
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import pi
from pathlib import Path

import numpy as np

from codriver.logs.write import Column, write_table
from codriver.models.two_point_file import FiledDriver, save_two_point
from codriver.signals import Log
from codriver.signals.signal import Array
from codriver.simulate.circuit import CircuitDrive, CircuitSetting, simulate_circuit
from codriver.simulate.circuit_drivers import name_of
from codriver.simulate.folder import refuse_foreign, write_folder
from codriver.vehicles import Vehicle, save_vehicle

FILES = ("drive.csv", "names.toml", "truth.parquet", "vehicle.toml", "truth.toml")
_DEGREE = 180 / pi
# Standard name, column, unit in the file, factor from SI, digits.
_COLUMNS = (
    ("steering_wheel_angle", "WheelAngle", "deg", _DEGREE, 1), ("driver_torque", "WheelTorque", "N*m", 1.0, 4),
    ("alignment_torque", "AlignTorque", "N*m", 1.0, 5), ("longitudinal_speed", "Speed", "km/h", 3.6, 3),
    ("sideslip_angle", "Sideslip", "rad", 1.0, 7), ("yaw_rate", "YawRate", "rad/s", 1.0, 7),
    ("road_curvature", "RoadCurvature", "1/m", 1.0, 7), ("lateral_offset", "LaneOffset", "m", 1.0, 5),
    ("heading_error", "HeadingError", "rad", 1.0, 7), ("steering_motor_torque", "MotorTorque", "N*m", 1.0, 4),
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class CircuitFiles:
    """The files written, in the order of FILES."""

    drive: Path
    names: Path
    truth: Path
    vehicle: Path
    driver: Path


def write_circuit(
    folder: str | Path, setting: CircuitSetting | None = None, seed: int = 0, name: str | None = None
) -> tuple[CircuitFiles, CircuitDrive]:
    """Simulate a drive and write it into a folder, made if need be, whole or not at all.

    Args:
        folder: to write into.
        setting: driver, car, laps.
        seed: of the driver's variability and the sensors' noise.
        name: as for `write_files`.

    Raises:
        UsageError: the folder holds files, and not those of a circuit; or the car leaves the road.
        LogError: a file cannot be written.
    """
    folder = Path(folder)
    refuse_foreign(folder, "circuit", FILES)
    drive = simulate_circuit(setting, seed=seed)
    write_folder(folder, lambda scratch: write_files(drive, scratch, name=name), "circuit", FILES)
    return CircuitFiles(*(folder / name for name in FILES)), drive


def write_files(
    drive: CircuitDrive, folder: Path, more: Mapping[str, tuple[Array, str]] | None = None, name: str | None = None
) -> None:
    """Write the files of FILES.

    Args:
        drive: what happened.
        folder: that is there.
        more: columns of the truth by name: values of shape (n,) and unit.
        name: of the driver; None for that of CIRCUIT_DRIVERS, or "truth" where he is none of these.
    """
    files, log = CircuitFiles(*(folder / name for name in FILES)), drive.log()
    there = [column for column in _COLUMNS if column[0] in log]
    files.drive.write_text(_table(drive.time, log, there), encoding="utf-8")
    names = "".join(f'[{signal}]\nsource = "{column}"\nunit = "{unit}"\n\n' for signal, column, unit, _, _ in there)
    files.names.write_text(f"# The log of a drive round the simulated circuit.\n{names}", encoding="utf-8")
    truth = drive.truth()
    columns = [Column(signal.name, signal.values, signal.unit) for signal in truth.values()]
    columns += [Column(signal, values, unit) for signal, (values, unit) in (more or {}).items()]
    filed = FiledDriver.of(
        drive.setting.driver, name or name_of(drive.setting.driver) or "truth", f"drove the circuit, seed {drive.seed}"
    )
    save_two_point(filed, files.driver)
    write_table(files.truth, drive.time, columns, {"source": truth.source, "seed": str(drive.seed)})
    save_vehicle(circuit_vehicle(drive.setting), files.vehicle)


def circuit_vehicle(setting: CircuitSetting) -> Vehicle:
    """Column and car of a drive."""
    car, wheel = setting.car, setting.wheel
    made = Vehicle("circuit", "Column and car of the simulated circuit", "codriver simulate circuit", {})
    values = {
        "mass": car.mass, "yaw_inertia": car.inertia, "front_axle_distance": car.front, "wheelbase": car.front + car.rear,
        "front_cornering_stiffness": car.front_stiffness, "rear_cornering_stiffness": car.rear_stiffness,
        "steering_ratio": car.ratio, "alignment_stiffness": car.alignment, "steering_inertia": wheel.inertia,
        "steering_damping": wheel.damping, "steering_friction": wheel.friction,
    }  # fmt: skip
    for name, value in values.items():
        made = made.with_parameter(name, value, source="as simulated")
    return made


def _table(time: Array, log: Log, columns: Sequence[tuple[str, str, str, float, int]]) -> str:
    """A CSV with a column of time first."""
    form = ",".join(["{:.3f}", *(f"{{:.{digits}f}}" for *_, digits in columns)])
    values = [(np.round(log[name].values * factor, digits) + 0.0).tolist() for name, _, _, factor, digits in columns]
    rows = [form.format(*row) for row in zip(time.tolist(), *values, strict=True)]
    return "\n".join([",".join(["t", *(column for _, column, *_ in columns)]), *rows, ""])
