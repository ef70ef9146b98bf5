"""codriver identify steering-wheel and torque-scale: a steering wheel from a recording, its motor from weights."""

from __future__ import annotations

import json as json_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from codriver.cli.identify import Out, Overwrite, Report, app, check_outputs
from codriver.cli.options import Bus, Dbc, Json, LogPath, Names

if TYPE_CHECKING:
    from codriver.report.document import Document
    from codriver.vehicles import Vehicle

Old = Annotated[
    str | None,
    typer.Option("--vehicle", help="Vehicle to add the result to: built-in name or TOML file; also the source of torque_scale.",
                 show_default=False),
]  # fmt: skip


@app.command("steering-wheel")
def steering_wheel(
    log: LogPath,
    out: Out,
    dbc: Dbc = None,
    names: Names = None,
    bus: Bus = None,
    vehicle: Old = None,
    report: Report = None,
    preset: Annotated[
        str | None, typer.Option("--preset", help="okamoto2019: the paper's plant and settings.", show_default=False)
    ] = None,
    guess: Annotated[
        tuple[float, float] | None,
        typer.Option("--guess", metavar="J B", help="J_s (kg m^2), b_s (N m s/rad) to start from. Default: found.",
                     show_default=False),
    ] = None,
    torque: Annotated[
        list[str] | None,
        typer.Option("--torque", help="Signal that turns the wheel; several are added. Default: the motor's.", show_default=False),
    ] = None,
    friction: Annotated[
        bool | None, typer.Option(help="Coulomb friction in the model. Default: if the recording asks for it.", show_default=False)
    ] = None,
    end_stop: Annotated[
        float | None, typer.Option("--end-stop", help="Leave out angles beyond so many degrees.", show_default=False)
    ] = None,
    delay: Annotated[
        float | None, typer.Option("--delay", help="The torque acts so many seconds late. Default: found.", show_default=False)
    ] = None,
    rate: Annotated[
        float | None, typer.Option("--rate", help="Ticks per second. Default: that of the quicker signal.", show_default=False)
    ] = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:  # fmt: skip
    """J_s, b_s and friction of a steering wheel that its motor alone turns (2019, algorithm 1).

    Example: codriver identify steering-wheel chirp.csv -o wheel.toml --report wheel.html
    """
    from math import radians

    from codriver.cli.options import check_inputs
    from codriver.cli.terminal import command_line, working
    from codriver.identify import identify_steering_wheel
    from codriver.logs import read
    from codriver.report.steering import steering_document, steering_rows
    from codriver.run import check_rate
    from codriver.vehicles import load_vehicle

    check_inputs(log, dbc, names)
    check_rate(rate)
    check_outputs(out, report, [log, *(p for p in (dbc, names) if p is not None)], overwrite)
    old = load_vehicle(vehicle) if vehicle is not None else None
    with working(not json, 2) as stage:
        stage(f"reading {log.name}")
        recorded = read(log, dbc=dbc, names=names, bus=bus)
        stage("identifying")
        fit = identify_steering_wheel(
            recorded, old, preset=preset, guess=guess, torques=torque or (), friction=friction, delay=delay, rate=rate,
            end_stop=None if end_stop is None else radians(end_stop),
        )  # fmt: skip
    new = fit.vehicle(old, out.stem)
    _write(new, steering_document(fit, old, command_line()), out, report, overwrite)
    told: dict[str, Any] = {
        "log": str(log),
        "coefficients": {
            c.name: {"value": c.value, "sd": c.sd, "sd_model": c.sd_model, "sd_robust": c.sd_robust, "low": c.low, "high": c.high,
                     "unit": c.unit}
            for c in fit.coefficients.values()
        },
        "refused": {r.name: r.reason for r in fit.refused},
        "r2_2_s_ahead": fit.r2, "nis": fit.nis, "encoder_sd_rad": fit.encoder_sd, "delay_s": fit.delay,
        "end_stops_rad": list(fit.end_stops), "left_out": fit.left_out, "seconds": fit.seconds, "torque": fit.torque_from,
        "filters": {p.name: _passes(p) for p in fit.filters},
        "findings": [{"severity": f.severity, "text": f.text} for f in fit.findings],
        "result": str(out), "report": str(report) if report is not None else None,
    }  # fmt: skip
    if json:
        typer.echo(json_module.dumps(told, indent=2, ensure_ascii=False, allow_nan=False))
        return
    head = f"{log}: {fit.seconds:.1f} s, torque from {fit.torque_from}, R2 of the angle 2 s ahead {fit.r2:.4f}"
    _say(head, steering_rows(fit, old), told)


@app.command("torque-scale")
def torque_scale(
    weighings: Annotated[
        Path, typer.Argument(metavar="CSV", help="Rows of command,mass (kg); perhaps radius (m).", show_default=False)
    ],
    out: Out,
    radius: Annotated[float, typer.Option("--radius", help="Of the string from the axis, m, where the file has none.")] = 0.14,
    gravity: Annotated[float, typer.Option("--gravity", help="m/s^2.")] = 9.81,
    vehicle: Old = None,
    report: Report = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:  # fmt: skip
    """From the motor's command to torque, by weights hung on the wheel (2019, eq. 89).

    Example: codriver identify torque-scale weights.csv --radius 0.14 -o wheel.toml
    """
    from codriver.cli.options import check_inputs
    from codriver.cli.terminal import command_line
    from codriver.errors import UsageError
    from codriver.identify.torque_scale import identify_torque_scale, read_weighings
    from codriver.report.steering import scale_rows, torque_scale_document
    from codriver.vehicles import load_vehicle

    check_inputs(weighings, None, None)
    if not (radius > 0 and gravity > 0):
        raise UsageError(
            f"a radius of {radius:g} m and a gravity of {gravity:g} m/s^2", "positive numbers", "correct them"
        )
    check_outputs(out, report, [weighings], overwrite)
    old = load_vehicle(vehicle) if vehicle is not None else None
    command, mass, own = read_weighings(weighings)
    fit = identify_torque_scale(
        command, mass, radius=radius if own is None else own, gravity=gravity, source=weighings.name
    )
    new = fit.vehicle(old, out.stem)
    _write(new, torque_scale_document(fit, old, command_line()), out, report, overwrite)
    told: dict[str, Any] = {
        "log": str(weighings),
        "coefficients": {
            "torque_scale": {"value": fit.scale, "sd": fit.sd_scale, "low": fit.low, "high": fit.high, "unit": "N*m"},
            "torque_offset": {"value": fit.offset, "sd": fit.sd_offset, "unit": "N*m"},
        },
        "r2": fit.r2, "residual_Nm": fit.residual, "curvature_Nm": fit.curvature, "findings": [],
        "result": str(out), "report": str(report) if report is not None else None,
    }  # fmt: skip
    if json:
        typer.echo(json_module.dumps(told, indent=2, ensure_ascii=False, allow_nan=False))
        return
    _say(
        f"{weighings}: {command.size} weighings, {fit.residual:.2g} N m off the line, R2 {fit.r2:.5f}",
        scale_rows(fit, old),
        told,
    )


def _passes(p: Any) -> dict[str, Any]:
    """What a filter said, fit for JSON."""
    from math import isfinite

    J, b = (x if isfinite(x) else None for x in p.values)
    return {"J_s": J, "b_s": b, "passes": len(p.passes), "converged": p.converged, "why_not": p.passes[-1].why_not}


def _write(new: Vehicle, document: Document, out: Path, report: Path | None, overwrite: bool) -> None:
    """Vehicle and report, both or neither."""
    from codriver.report.document import write_document
    from codriver.vehicles import save_vehicle

    draft = report.with_name(f".{report.name}.draft") if report is not None else None
    try:
        if draft is not None:
            write_document(document, draft)
        save_vehicle(new, out, overwrite=overwrite)
        if draft is not None and report is not None:
            draft.replace(report)
    finally:
        if draft is not None:
            draft.unlink(missing_ok=True)


def _say(head: str, rows: list[tuple[str, ...]] | Any, told: dict[str, Any], more: Any = None) -> None:
    """What was found, as a table; perhaps one more table before the verdict."""
    from rich.markup import escape
    from rich.table import Table

    from codriver.cli.terminal import console, say_findings

    out = console()
    out.print(escape(head) + "\n")
    table = Table(box=None, pad_edge=False)
    for column in ("coefficient", "unit", "value", "sd", "95 % interval", "before"):
        table.add_column(column, justify="left" if column in ("coefficient", "unit") else "right")
    for row in rows:
        table.add_row(*row)
    out.print(table)
    for name, p in told.get("filters", {}).items():
        numbers = f"J_s {p['J_s']:.4f}, b_s {p['b_s']:.4f}, " if p["J_s"] is not None and p["b_s"] is not None else ""
        out.print(
            f"{name}: {numbers}" + (f"converged in pass {p['passes']}" if p["converged"] else escape(p["why_not"]))
        )
    if more is not None:
        out.print()
        out.print(more)
    if told["findings"]:
        out.print("\n[bold]verdict[/]:")
        say_findings(out, told["findings"])
    out.print(f"\nwrote {escape(told['result'])}" + (f" and {escape(told['report'])}" if told["report"] else ""))
