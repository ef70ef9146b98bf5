"""The recordings of a simulator's lab, as files: weights hung on the wheel, a chirp of the motor, a drive, and the truth.

weights.csv     command that holds the wheel straight under a weight (2019, eq. 89)
chirp.csv       the motor alone turns the wheel
drive.csv       a driver turns it
names.toml      what the columns of both mean
truth.parquet   the driver's torque, angle and rate of the drive
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
from codriver.simulate.rig import RigDrive, RigSetting, simulate_rig
from codriver.simulate.steering import WheelNoise, WheelSetting, chirp, simulate_wheel

FILES = ("weights.csv", "chirp.csv", "drive.csv", "names.toml", "truth.parquet")
_NAMES = """# The simulator's log: angle in degrees, the motor's command in the device's own unit, speed in km/h.
[steering_wheel_angle]
source = "WheelAngle"
unit = "deg"

[steering_motor_command]
source = "FFB_Cmd"
unit = "1"

[longitudinal_speed]
source = "Speed"
unit = "km/h"
"""
_MASSES = (-1.5, -1.0, -0.5, 0.5, 1.0, 1.5)  # kg
_RADIUS, _GRAVITY = 0.14, 9.81  # m, m/s^2
_CHIRP = (2.0, 0.3, 4.0, 40.0)  # N m, Hz, Hz, s


@dataclass(frozen=True, eq=False)
class RigFiles:
    """The files written, in the order of FILES."""

    weights: Path
    chirp: Path
    drive: Path
    names: Path
    truth: Path


def write_rig(folder: str | Path, setting: RigSetting | None = None, seed: int = 0) -> tuple[RigFiles, RigDrive]:
    """Simulate the rig and write its recordings into a folder, made if need be, whole or not at all.

    Args:
        folder: to write into.
        setting: wheel, car, driver.
        seed: of the driver and of the scatter of the weighings.

    Raises:
        UsageError: the folder holds files, and not those of a rig.
        LogError: a file cannot be written.
    """
    folder, setting = Path(folder), setting or RigSetting()
    refuse_foreign(folder, "rig", FILES)
    drive = simulate_rig(setting, seed=seed)
    write_folder(folder, lambda scratch: _write(drive, scratch, seed), "rig", FILES)
    return RigFiles(*(folder / name for name in FILES)), drive


def _write(drive: RigDrive, folder: Path, seed: int) -> None:
    """All files."""
    s, files = drive.setting, RigFiles(*(folder / name for name in FILES))
    files.weights.write_text(_weighings(s, np.random.default_rng([seed, 89])), encoding="utf-8")
    torque = chirp(np.arange(round(_CHIRP[3] / s.dt) + 1, dtype=np.float64) * s.dt, *_CHIRP[:3])
    noise = WheelNoise("derivative", 1e-4, (0.2 * s.resolution) ** 2, s.resolution)
    turned = simulate_wheel(torque, WheelSetting(s.wheel, noise, "exact", (0.0, 0.0), dt=s.dt), seed=seed).log()
    columns = (turned["steering_wheel_angle"].values, _command(torque, s))
    files.chirp.write_text(_table(turned["steering_wheel_angle"].time, columns), encoding="utf-8")
    log = drive.log()
    columns = (log["steering_wheel_angle"].values, log["steering_motor_command"].values)
    speed = 3.6 * log["longitudinal_speed"].values
    files.drive.write_text(_table(drive.time, columns, speed), encoding="utf-8")
    files.names.write_text(_NAMES, encoding="utf-8")
    _write_truth(files.truth, drive.truth(), seed)


def _write_truth(path: Path, truth: Log, seed: int) -> None:
    clock = truth["driver_torque"].time
    columns = [Column(signal.name, signal.values, signal.unit) for signal in truth.values()]
    write_table(path, clock, columns, {"source": truth.source, "seed": str(seed)})


def _command(torque: Array, s: RigSetting) -> Array:
    """The motor's command for a torque."""
    return np.asarray((torque - s.torque_offset) / s.torque_scale)


def _weighings(s: RigSetting, rng: np.random.Generator) -> str:
    """Each weight twice, the wheel coming from either side: friction bears part of it."""
    rows = ["command,mass"]
    for mass in _MASSES:
        for side in (-1, 1):
            torque = mass * _GRAVITY * _RADIUS + 0.3 * side * s.wheel.friction + 0.01 * rng.standard_normal()
            rows.append(f"{float(_command(np.array(torque), s)):.4f},{mass:g}")
    return "\n".join([*rows, ""])


def _table(time: Array, columns: tuple[Array, Array], speed: Array | None = None) -> str:
    """A CSV as the simulator writes it: angle (rad in) in degrees, command, speed."""
    head = "t,WheelAngle,FFB_Cmd" + (",Speed" if speed is not None else "")
    shown = [np.round(columns[0] * 180 / pi, 1) + 0.0, columns[1], *([speed] if speed is not None else [])]
    form = ",".join(["{:.3f}", "{:.1f}", "{:.5f}", *(["{:.2f}"] if speed is not None else [])])
    rows = [form.format(t, *values) for t, *values in zip(time.tolist(), *(c.tolist() for c in shown), strict=True)]
    return "\n".join([head, *rows, ""])
