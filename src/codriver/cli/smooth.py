"""codriver smooth: as `codriver estimate`, with hindsight."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from codriver.cli.estimate import estimate_file
from codriver.cli.options import Bus, Dbc, Ell, Json, LogPath, Names, PresetName, VehicleName

if TYPE_CHECKING:
    from codriver.observers import Preset
    from codriver.offline import SmoothedEstimate
    from codriver.signals import Log
    from codriver.vehicles import Vehicle


Smoothed = Annotated[
    str,
    typer.Argument(
        metavar="ESTIMATOR",
        help="intent-pedals, intent-torque, kinematic or intent; driver-torque or one of its Kalman filters. Others have no such "
        "filter.",
        show_default=False,
    ),
]


def smooth(
    estimator: Smoothed,
    log: LogPath,
    out: Annotated[
        Path, typer.Option("-o", "--out", metavar="OUT", help="Result: .parquet, .csv or .mf4.", show_default=False)
    ],
    vehicle: VehicleName = None,
    dbc: Dbc = None,
    names: Names = None,
    ell: Ell = None,
    lag: Annotated[
        float | None,
        typer.Option("--lag", help="Look so many seconds ahead. Default: the whole drive.", show_default=False),
    ] = None,
    rate: Annotated[
        float | None, typer.Option("--rate", help="Ticks per second. Default: from the log.", show_default=False)
    ] = None,
    preset: PresetName = None,
    bus: Bus = None,
    report: Annotated[Path | None, typer.Option("--report", help="Report to write (HTML).", show_default=False)] = None,
    json: Json = False,
) -> None:
    """Estimate what the driver intended or did from a recorded drive, looking ahead: no lag, and not for live use.

    Example: codriver smooth intent drive.blf --dbc car.dbc --names names.toml --vehicle bisoffi2017 -o drive.parquet
    """

    def work(
        name: str, recorded: Log, car: Vehicle | None, *, ell: float | None, rate: float | None,
        preset: str | Preset | None, form: str,
    ) -> SmoothedEstimate:  # fmt: skip
        from codriver.offline import smooth as smoothed

        return smoothed(recorded, name, car, dt=None if rate is None else 1.0 / rate, ell=ell, preset=preset, lag=lag)

    estimate_file(
        estimator, log, out, vehicle, dbc, names, ell, rate, preset, bus=bus, report=report, as_json=json, work=work
    )
