"""A shared drive as files: those of `circuit_files`, with the motor's torque in the log and what commanded it in the truth.

drive.csv       MotorTorque: the assist motor's torque on the column
truth.parquet   authority; with a driver model driver_torque_ahead and its standard deviation, as known at each tick
"""

from __future__ import annotations

from pathlib import Path

from codriver.simulate.circuit_files import FILES, CircuitFiles, write_files
from codriver.simulate.folder import refuse_foreign, write_folder
from codriver.simulate.shared_control import SharedDrive


def write_shared(folder: str | Path, shared: SharedDrive, name: str | None = None) -> CircuitFiles:
    """Write a drive into a folder, made if need be, whole or not at all.

    Args:
        folder: to write into.
        shared: the drive.
        name: of the driver, as for `circuit_files.write_files`.

    Raises:
        UsageError: the folder holds files, and not those of a circuit.
        LogError: a file cannot be written.
    """
    folder = Path(folder)
    refuse_foreign(folder, "circuit", FILES)
    more = {"authority": (shared.authority, "1")}
    if shared.horizon > 0:
        more |= {
            "driver_torque_ahead": (shared.foretold, "N*m"),
            "driver_torque_ahead_sd": (shared.foretold_sd, "N*m"),
        }
    write_folder(folder, lambda scratch: write_files(shared.drive, scratch, more, name), "circuit", FILES)
    return CircuitFiles(*(folder / name for name in FILES))
