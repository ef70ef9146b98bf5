"""codriver driver compare, predict, export: stored drivers put to use."""

from __future__ import annotations

import json as json_module
from pathlib import Path
from typing import Annotated, Any

import typer

from codriver.cli.driver import app, read_drives
from codriver.cli.options import Bus, Dbc, Json, LogPath, Names, VehicleName

DriverPath = Annotated[Path, typer.Argument(metavar="NAME.driver", help="A driver file.", show_default=False)]


@app.command("compare")
def compare(
    drive: LogPath,
    drivers: Annotated[list[Path], typer.Argument(metavar="NAME.driver...", help="Two driver files or more.", show_default=False)],
    dbc: Dbc = None, names: Names = None, bus: Bus = None, vehicle: VehicleName = None, json: Json = False,
) -> None:  # fmt: skip
    """Which of several stored drivers is this? By how likely each finds the torques of a drive, with confidence.

    Example: codriver driver compare friday.csv anna.driver ben.driver --names names.toml
    """
    from codriver.cli.driver_words import say_likeness
    from codriver.cli.terminal import working
    from codriver.drivers.learned.driver_file import load_driver
    from codriver.drivers.learned.recognise import recognise

    known = [load_driver(path) for path in drivers]
    with working(not json, 2) as stage:
        logs, notes = read_drives([drive], dbc, names, bus, vehicle, stage)
        stage("comparing")
        found = recognise(next(iter(logs.values())), known)
    told: dict[str, Any] = {"drive": str(drive), "notes": notes, "drivers": [dict(vars(one)) for one in found]}
    if json:
        typer.echo(json_module.dumps(told, indent=2, ensure_ascii=False, allow_nan=False))
    else:
        say_likeness(told)


@app.command("predict")
def predict(
    driver: DriverPath, drive: LogPath,
    out: Annotated[Path, typer.Option("-o", "--out", metavar="OUT", help="Result: .parquet, .csv or .mf4.", show_default=False)],
    dbc: Dbc = None, names: Names = None, bus: Bus = None, vehicle: VehicleName = None, json: Json = False,
) -> None:  # fmt: skip
    """Foretell a drive's torque, row by row, with a 95 % band; each row knows its past and the road ahead only
    (not under the paper2019 protocol, and it says so).

    Example: codriver driver predict anna.driver friday.csv --names names.toml -o foretold.parquet
    """
    import numpy as np
    from rich.markup import escape

    from codriver.cli.estimate import refuse_recording
    from codriver.cli.terminal import console, say_findings, working
    from codriver.drivers.learned.driver_file import load_driver
    from codriver.drivers.learned.likeness import doubts_of
    from codriver.logs.write import Column, check_output, write_table

    check_output(out)
    refuse_recording(out, drive)
    known = load_driver(driver)
    with working(not json, 2) as stage:
        logs, notes = read_drives([drive], dbc, names, bus, vehicle, stage)
        stage("foretelling")
        made = known.predict(next(iter(logs.values())), with_target=False)
    columns = [
        Column("driver_torque_ahead", made.mean, "N*m"), Column("driver_torque_ahead_sd", made.sd, "N*m"),
        Column("driver_torque_ahead_low", made.low, "N*m"), Column("driver_torque_ahead_high", made.high, "N*m"),
        Column("driver_torque_then", made.measured, "N*m"),
    ]  # fmt: skip
    write_table(out, made.time, columns, {"driver": known.name, "model": known.kind, "horizon_s": f"{made.horizon:g}"})
    there = np.isfinite(made.measured)
    error = made.error[there]
    told: dict[str, Any] = {
        "driver": known.name, "model": known.kind, "drive": str(drive), "horizon_s": made.horizon, "rows": made.time.size,
        "rmse_Nm": float(np.sqrt(np.mean(error**2))) if error.size else None,
        "stays_rmse_Nm": float(np.sqrt(np.mean((made.measured - made.last)[there] ** 2))) if error.size else None,
        "inside95": float(np.mean(((made.measured >= made.low) & (made.measured <= made.high))[there])) if error.size else None,
        "findings": [
            *({"severity": "bad", "text": f"leak: {leak}"} for leak in known.protocol.leaks),
            *({"severity": f.severity, "text": f.text} for f in doubts_of(known, made)),
        ],
        "notes": notes, "result": str(out),
    }  # fmt: skip
    if json:
        typer.echo(json_module.dumps(told, indent=2, ensure_ascii=False, allow_nan=False))
        return
    said = console()
    said.print(
        f"[bold]{escape(known.name)}[/] ({known.kind}) on {escape(drive.name)}: {made.time.size} rows, {made.horizon:g} s ahead",
        markup=True,
    )
    if error.size:
        said.print(
            f"RMSE {told['rmse_Nm']:.3f} N m (the torque stays: {told['stays_rmse_Nm']:.3f}); {told['inside95']:.1%} lie in the "
            "95 % band"
        )
    say_findings(said, told["findings"])
    for note in notes:
        said.print(f"  note {note}", markup=False)
    said.print(f"\nwrote {out}", markup=False)


@app.command("export")
def export(
    driver: DriverPath,
    out: Annotated[Path, typer.Option("-o", "--out", metavar="DIR", help="Folder to write into.", show_default=False)],
    real: Annotated[str, typer.Option("--real", help="double or float.")] = "double",
) -> None:
    """Write a driver as C: header, source without heap, loops or globals, and a check program with golden vectors.

    The road ahead is an input: road_curvature_ahead_1, ..., at the places reached in dt, 2 dt, ... at the present speed.

    Example: codriver driver export anna.driver -o c && make -C c check
    """
    from codriver.cli.terminal import console
    from codriver.drivers.learned.driver_file import load_driver
    from codriver.drivers.learned.driver_observer import observer_of
    from codriver.export import export_c
    from codriver.program import compile as compile_observer

    program = compile_observer(observer_of(load_driver(driver)))
    written = export_c(program, out, real=real)
    console().print(f"wrote {', '.join(str(path) for path in written)}", markup=False)
