"""codriver identify alignment: what a car's road does to its steering column, from drives with a measured torque."""

from __future__ import annotations

import json as json_module
from typing import Annotated, Any

import typer

from codriver.cli.identify import Logs, Out, Overwrite, Report, _finite, check_outputs
from codriver.cli.identify_steering import Old, _say, _write, app
from codriver.cli.options import Bus, Dbc, Json, Names

TORQUE = "steering_wheel_torque"
Torque = Annotated[
    str,
    typer.Option(
        "--torque",
        metavar="NAME",
        help="Standard name of the torque that turns the wheel: of a sensor, or steering_motor_torque of drives without hands.",
    ),
]


@app.command("alignment")
def alignment(
    logs: Logs, out: Out, dbc: Dbc = None, names: Names = None, bus: Bus = None, vehicle: Old = None, torque: Torque = TORQUE,
    report: Report = None,
    overwrite: Overwrite = False, json: Json = False,
) -> None:  # fmt: skip
    """The torque of tyres, road and friction on the column, by angle and speed, from drives with a torque sensor (2019, eq. 92).

    Example: codriver identify alignment mountain.csv motorway.csv --names names.toml -o car.toml --report car.html
    """
    from codriver.cli.options import check_inputs
    from codriver.cli.terminal import command_line, working
    from codriver.identify import identify_alignment
    from codriver.logs import read
    from codriver.report.alignment import alignment_document, alignment_rows
    from codriver.vehicles import load_vehicle

    for path in logs:
        check_inputs(path, dbc, names)
    check_outputs(out, report, [*logs, *(p for p in (dbc, names) if p is not None)], overwrite)
    old = load_vehicle(vehicle) if vehicle is not None else None
    with working(not json, 2) as stage:
        stage("reading " + ", ".join(path.name for path in logs))
        recorded = [read(path, dbc=dbc, names=names, bus=bus) for path in logs]
        stage("identifying")
        fit = identify_alignment(recorded, old, by=torque)
    _write(fit.vehicle(old, out.stem), alignment_document(fit, old, command_line()), out, report, overwrite)
    held = [] if fit.held.whole is None else [*fit.held.parts, fit.held.whole]
    told: dict[str, Any] = {
        "logs": [str(path) for path in logs],
        "coefficients": {
            c.name: {"value": c.value, "sd": c.sd, "low": c.low, "high": c.high, "unit": c.unit}
            for c in fit.coefficients.values()
        },
        "refused": {r.name: r.reason for r in fit.refused},
        "minutes": fit.minutes, "rmse_Nm": fit.rmse, "r2": fit.r2, "lead_s": fit.lead,
        "left_out": "drives" if fit.held.by_drive else "blocks",
        "held_out": {h.name: {"seconds": h.seconds, "rmse_Nm": h.rmse, "r2": h.r2} for h in held},
        "correlation_time_s": fit.held.time,
        "findings": [{"severity": f.severity, "text": f.text} for f in fit.findings],
        "result": str(out), "report": str(report) if report is not None else None,
    }  # fmt: skip
    if json:
        typer.echo(json_module.dumps(_finite(told), indent=2, ensure_ascii=False, allow_nan=False))
        return
    from rich.table import Table

    table = Table(box=None, pad_edge=False)
    for column in (f"left out ({told['left_out']})", "s", "map: RMSE, R2", "regression", "mean"):
        table.add_column(column, justify="left" if column.startswith("left") else "right")
    for h in held:
        table.add_row(h.name, f"{h.seconds:.0f}", *(f"{h.rmse[way]:.3f}, {h.r2[way]:.2f}" for way in h.rmse))
    head = f"{', '.join(path.name for path in logs)}: {fit.minutes:.1f} min, RMSE {fit.rmse:.3f} N m, R2 {fit.r2:.3f}"
    _say(head, alignment_rows(fit, old), told, table if held else None)


@app.command("alignment-stiffness")
def alignment_stiffness(
    logs: Logs, out: Out,
    vehicle: Annotated[str, typer.Option("--vehicle", help="With steering_ratio, front_axle_distance, perhaps a single track.")],
    dbc: Dbc = None, names: Names = None, bus: Bus = None, report: Report = None, overwrite: Overwrite = False, json: Json = False,
) -> None:  # fmt: skip
    """K_aln of eq. 92 (2019), from a simulator's log of the alignment torque or a car's torque sensor.

    Example: codriver identify alignment-stiffness lap.csv --names names.toml --vehicle car.toml -o car2.toml
    """
    from codriver.cli.options import check_inputs
    from codriver.cli.terminal import command_line, working
    from codriver.identify.alignment_stiffness import identify_alignment_stiffness
    from codriver.logs import read
    from codriver.report.alignment_stiffness import stiffness_document, stiffness_rows
    from codriver.vehicles import load_vehicle

    for path in logs:
        check_inputs(path, dbc, names)
    check_outputs(out, report, [*logs, *(p for p in (dbc, names) if p is not None)], overwrite)
    old = load_vehicle(vehicle)
    with working(not json, 2) as stage:
        stage("reading " + ", ".join(path.name for path in logs))
        recorded = [read(path, dbc=dbc, names=names, bus=bus) for path in logs]
        stage("identifying")
        fit = identify_alignment_stiffness(recorded, old)
    _write(fit.vehicle(old), stiffness_document(fit, old, command_line()), out, report, overwrite)
    told: dict[str, Any] = {
        "logs": [str(path) for path in logs],
        "coefficients": {
            "K_aln": {"value": fit.stiffness, "sd": fit.sd, "low": fit.low, "high": fit.high, "unit": "N*m/rad"},
            "T_0": {"value": fit.offset, "unit": "N*m"},
        },
        "seconds": fit.seconds, "rmse_Nm": fit.rmse, "r2": fit.r2, "held_rmse_Nm": fit.held_rmse, "held_r2": fit.held_r2,
        "slip_from": fit.slip_from, "torque_from": fit.torque_from,
        "findings": [{"severity": f.severity, "text": f.text} for f in fit.findings],
        "result": str(out), "report": str(report) if report is not None else None,
    }  # fmt: skip
    if json:
        typer.echo(json_module.dumps(_finite(told), indent=2, ensure_ascii=False, allow_nan=False))
        return
    head = (
        f"{', '.join(path.name for path in logs)}: {fit.seconds:.0f} s, {fit.torque_from}, slip angle of the {fit.slip_from}; RMSE "
        f"{fit.rmse:.3g} N m, R2 {fit.r2:.3f}; on the half left out {fit.held_rmse:.3g}, {fit.held_r2:.3f}"
    )
    _say(head, stiffness_rows(fit, old), told)
