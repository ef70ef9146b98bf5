"""A simulated long drive as files: what a logger would have recorded, how to read it, and the truth beside.

drive.blf       the CAN frames
car.dbc         the database that says what they mean
names.toml      which of its signals are which standard signals
truth.parquet   what was true, 100 Hz
vehicle.toml    for the track: nominal parameters for an estimator, which no built-in vehicle has
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from codriver.simulate.bus import write_trace
from codriver.simulate.can_layout import dbc_text
from codriver.simulate.car_parameters import PRINTED_2015, ROLLING_RADIUS_2015
from codriver.simulate.folder import write_folder
from codriver.simulate.network import MESSAGES, names_text
from codriver.simulate.road_test import RoadTest
from codriver.vehicles import Vehicle, load_vehicle, save_vehicle


@dataclass(frozen=True)
class DriveFiles:
    """Paths of a written drive; `vehicle` is None where none was written."""

    log: Path
    dbc: Path
    names: Path
    truth: Path
    vehicle: Path | None


def nominal_2015() -> Vehicle:
    """The vehicle `bisoffi2015` with the printed tau over the rolling radius: what an estimator needs on the track test.

    From the paper's numbers and the assumed radius alone, rounded to 0.1 1/m; nothing is taken from a simulated car.
    """
    radius = ROLLING_RADIUS_2015
    return load_vehicle("bisoffi2015").with_parameter(
        "transmission",
        tuple(round(tau / radius, 1) for tau in PRINTED_2015),
        source=f"section V, tau_1 to tau_5 as printed, over an assumed rolling radius of {radius} m",
    )


def write_drive(folder: str | Path, test: RoadTest, *, vehicle: Vehicle | None = None) -> DriveFiles:
    """Write a drive into a folder, made if need be: whole or not at all.

    Args:
        folder: new, empty, or of an earlier simulation.
        test: the drive.
        vehicle: to write beside it as vehicle.toml; none if not given.

    Raises:
        UsageError: the folder holds files, and not those of a simulation.
        LogError: a file cannot be written.
    """
    folder = Path(folder)
    write_folder(folder, lambda scratch: _write(_files(scratch, vehicle), test, vehicle), "simulated drive")
    return _files(folder, vehicle)


def _files(folder: Path, vehicle: Vehicle | None) -> DriveFiles:
    """The files of a drive in a folder."""
    return DriveFiles(
        folder / "drive.blf",
        folder / "car.dbc",
        folder / "names.toml",
        folder / "truth.parquet",
        folder / "vehicle.toml" if vehicle else None,
    )


def _write(files: DriveFiles, test: RoadTest, vehicle: Vehicle | None) -> None:
    """All files of a drive."""
    from codriver.logs.write import Column, write_table

    write_trace(files.log, test.frames)
    files.dbc.write_text(dbc_text(MESSAGES, "simulated car"), encoding="utf-8")
    files.names.write_text(names_text(), encoding="utf-8")
    clock = test.truth["longitudinal_speed"].time
    columns = [Column(signal.name, signal.values, signal.unit) for signal in test.truth.values()]
    about = {"source": test.truth.source, "seed": str(test.seed), "driver": test.trace.style.name}
    write_table(files.truth, clock, columns, about)
    if vehicle is not None and files.vehicle is not None:
        save_vehicle(vehicle, files.vehicle)
