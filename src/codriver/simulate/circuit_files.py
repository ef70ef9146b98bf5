"""A drive round the circuit as files, and the truth.

drive.csv       what the simulator logs: wheel angle, torque, and what its vehicle model and scene know
names.toml      what the columns mean
truth.parquet   the driver's torque, the wheel's angle and rate, and where the two points were
truth.toml      the driver: his parameters, about which his gains drift if he varies
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from pathlib import Path

import numpy as np

from codriver.logs.write import Column, write_table
from codriver.models.two_point_file import FiledDriver, save_two_point
from codriver.signals import Log
from codriver.signals.signal import Array
from codriver.simulate.circuit import CircuitDrive, CircuitSetting, simulate_circuit
from codriver.simulate.folder import refuse_foreign, write_folder

FILES = ("drive.csv", "names.toml", "truth.parquet", "truth.toml")
_DEGREE = 180 / pi
# Standard name, column, unit in the file, factor from SI, digits.
_COLUMNS = (
    ("steering_wheel_angle", "WheelAngle", "deg", _DEGREE, 1), ("driver_torque", "WheelTorque", "N*m", 1.0, 4),
    ("alignment_torque", "AlignTorque", "N*m", 1.0, 5), ("longitudinal_speed", "Speed", "km/h", 3.6, 3),
    ("sideslip_angle", "Sideslip", "rad", 1.0, 7), ("yaw_rate", "YawRate", "rad/s", 1.0, 7),
    ("road_curvature", "RoadCurvature", "1/m", 1.0, 7), ("lateral_offset", "LaneOffset", "m", 1.0, 5),
    ("heading_error", "HeadingError", "rad", 1.0, 7),
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class CircuitFiles:
    """The files written, in the order of FILES."""

    drive: Path
    names: Path
    truth: Path
    driver: Path


def write_circuit(
    folder: str | Path, setting: CircuitSetting | None = None, seed: int = 0
) -> tuple[CircuitFiles, CircuitDrive]:
    """Simulate a drive and write it into a folder, made if need be, whole or not at all.

    Args:
        folder: to write into.
        setting: driver, car, laps.
        seed: of the driver's variability and the sensors' noise.

    Raises:
        UsageError: the folder holds files, and not those of a circuit; or the car leaves the road.
        LogError: a file cannot be written.
    """
    folder = Path(folder)
    refuse_foreign(folder, "circuit", FILES)
    drive = simulate_circuit(setting, seed=seed)
    write_folder(folder, lambda scratch: _write(drive, scratch), "circuit", FILES)
    return CircuitFiles(*(folder / name for name in FILES)), drive


def _write(drive: CircuitDrive, folder: Path) -> None:
    files, log = CircuitFiles(*(folder / name for name in FILES)), drive.log()
    files.drive.write_text(_table(drive.time, log), encoding="utf-8")
    names = "".join(f'[{name}]\nsource = "{column}"\nunit = "{unit}"\n\n' for name, column, unit, _, _ in _COLUMNS)
    files.names.write_text(f"# The log of a drive round the simulated circuit.\n{names}", encoding="utf-8")
    truth = drive.truth()
    columns = [Column(signal.name, signal.values, signal.unit) for signal in truth.values()]
    filed = FiledDriver.of(drive.setting.driver, "truth", f"drove the circuit, seed {drive.seed}")
    save_two_point(filed, files.driver)
    write_table(files.truth, drive.time, columns, {"source": truth.source, "seed": str(drive.seed)})


def _table(time: Array, log: Log) -> str:
    """A CSV with a column of time first."""
    form = ",".join(["{:.3f}", *(f"{{:.{digits}f}}" for *_, digits in _COLUMNS)])
    values = [(np.round(log[name].values * factor, digits) + 0.0).tolist() for name, _, _, factor, digits in _COLUMNS]
    rows = [form.format(*row) for row in zip(time.tolist(), *values, strict=True)]
    return "\n".join([",".join(["t", *(column for _, column, *_ in _COLUMNS)]), *rows, ""])
