"""codriver identify: coefficients of a vehicle from its own drives, as a vehicle file."""

from __future__ import annotations

import json as json_module
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from codriver.cli.options import Bus, Dbc, Json, Names

if TYPE_CHECKING:
    from codriver.report.document import Document
    from codriver.signals import Log
    from codriver.vehicles import Vehicle

app = typer.Typer(
    help="Identify coefficients of a vehicle, or a driver, from drives; the result is a vehicle or driver file.",
    no_args_is_help=True,
    rich_markup_mode=None,
)
Logs = Annotated[list[Path], typer.Argument(metavar="LOG...", help="Recordings, one or several.", show_default=False)]
Old = Annotated[
    str,
    typer.Option("--vehicle", help="What is known already: built-in name or TOML file. Brake: mass and transmission suffice.",
                 show_default=False),
]  # fmt: skip
Out = Annotated[Path, typer.Option("-o", "--out", metavar="V2.toml", help="Vehicle file to write.", show_default=False)]
Report = Annotated[Path | None, typer.Option("--report", help="Report to write (HTML).", show_default=False)]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace a vehicle file that is there.")]
Told = dict[str, Any]


@app.command("brake")
def brake(
    logs: Logs,
    vehicle: Old,
    out: Out,
    dbc: Dbc = None,
    names: Names = None,
    bus: Bus = None,
    report: Report = None,
    bias: Annotated[
        float | None,
        typer.Option("--bias", help="The accelerometer's bias, m/s^2, if known: kappa_1 is then free of it.", show_default=False),
    ] = None,
    pitch: Annotated[bool, typer.Option(help="Fit the accelerometer's gain error (pitch), too.")] = True,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:  # fmt: skip
    """c_b, kappa_1 and kappa_2 from drives that brake (2017, section IV-A).

    Example: codriver identify brake drive.blf --dbc car.dbc --names names.toml --vehicle car.toml -o car2.toml
    """

    from codriver.identify.plausible import check_bias

    check_bias(bias)

    def work(recorded: list[Log], old: Vehicle, command: str) -> tuple[Vehicle, Document, Told]:
        from codriver.identify import identify_brake
        from codriver.identify.brake_verdict import brake_findings
        from codriver.identify.usable import REASONS
        from codriver.report.identification import brake_document, brake_rows

        fit = identify_brake(recorded, old, bias=bias, pitch=pitch)
        told = {
            "coefficients": {
                c.name: {"value": c.value, "sd": c.sd_total, "sd_given_mass_and_tau": c.sd, "sd_newey_west": c.sd_hac,
                         "low": c.low, "high": c.high, "unit": c.unit}
                for c in fit.coefficients.values()
            },
            "refused": {r.name: r.reason for r in fit.refused},
            "offsets_N": list(fit.offsets),
            "minutes": {"fitted": fit.minutes_fit, "braking": fit.minutes_braking, "validated": fit.minutes_validation},
            "rmse": {"new": fit.rmse, "old": fit.rmse_old, "constant": fit.rmse_constant, "unit": "m/s^2"},
            "left_out": {REASONS[reason]: part for reason, part in fit.share.items()},
            "used": fit.used_share,
            "outliers": fit.trimmed,
            "block_s": fit.block,
            "rows": brake_rows(fit, old),
            "findings": _findings((f.severity, f.text) for f in brake_findings(fit)),
        }  # fmt: skip
        return fit.vehicle(old), brake_document(fit, old, command), told

    _run(work, logs, vehicle, out, dbc, names, bus, report, overwrite, json)


@app.command("pedal")
def pedal(
    logs: Logs, vehicle: Old, out: Out, dbc: Dbc = None, names: Names = None, bus: Bus = None, report: Report = None,
    overwrite: Overwrite = False, json: Json = False,
) -> None:  # fmt: skip
    """c_r from the requested torque over the accelerator pedal (2017, eq. 8b and figure 3).

    Example: codriver identify pedal drive.blf --dbc car.dbc --names names.toml --vehicle car.toml -o car2.toml
    """

    def work(recorded: list[Log], old: Vehicle, command: str) -> tuple[Vehicle, Document, Told]:
        from codriver.identify import identify_pedal
        from codriver.identify.pedal import REASONS
        from codriver.report.identification import pedal_document, pedal_row

        fit = identify_pedal(recorded, old)
        told = {
            "coefficients": {"c_r": {"value": fit.c_r, "sd": fit.sd, "sd_newey_west": fit.sd_hac, "low": fit.low, "high": fit.high,
                                     "unit": "N*m"}},
            "r2": fit.r2,
            "offset_Nm": fit.offset,
            "curvature": fit.curvature,
            "minutes": {"fitted": fit.minutes_fit, "validated": fit.minutes_validation},
            "rmse": {"new": fit.rmse, "old": fit.rmse_old, "constant": fit.rmse_constant, "unit": "N*m"},
            "left_out": {REASONS[reason]: part for reason, part in fit.share.items()},
            "used": fit.used_share,
            "outliers": fit.trimmed,
            "block_s": fit.block,
            "rows": [pedal_row(fit, old)],
            "findings": _findings((f.severity, f.text) for f in fit.findings),
        }  # fmt: skip
        return fit.vehicle(old), pedal_document(fit, old, command), told

    _run(work, logs, vehicle, out, dbc, names, bus, report, overwrite, json)


@app.command("ratio")
def ratio(
    logs: Logs, vehicle: Old, out: Out, dbc: Dbc = None, names: Names = None, bus: Bus = None, report: Report = None,
    overwrite: Overwrite = False, json: Json = False,
) -> None:  # fmt: skip
    """tau of each gear from drives with the brake released; the vehicle needs its mass alone.

    Example: codriver identify ratio drive.blf --dbc car.dbc --names names.toml --vehicle car.toml -o car2.toml
    """

    def work(recorded: list[Log], old: Vehicle, command: str) -> tuple[Vehicle, Document, Told]:
        from codriver.identify import identify_ratio
        from codriver.identify.ratio_verdict import ratio_findings
        from codriver.identify.usable import REASONS
        from codriver.report.identification import ratio_document, ratio_rows

        fit = identify_ratio(recorded)
        new = fit.vehicle(old)
        told = {
            "coefficients": {
                f"tau/M gear {g.gear}": {"value": g.ratio, "sd": g.sd, "sd_newey_west": g.sd_hac, "unit": "1/(kg*m)"}
                for g in fit.gears
            },
            "refused": {f"gear {gear}": why for gear, why in fit.refused.items()},
            "gain": None if fit.gain is None else {"value": fit.gain[0], "sd": fit.gain[1]},
            "engine_speed_over_speed": {str(gear): turns for gear, turns in fit.engine_turns.items()},
            "minutes": {"fitted": fit.seconds / 60},
            "rms": {"value": fit.residual, "unit": "m/s^2"},
            "left_out": {REASONS[reason]: part for reason, part in fit.share.items()},
            "block_s": fit.block,
            "rows": ratio_rows(fit, old),
            "findings": _findings((f.severity, f.text) for f in ratio_findings(fit, old)),
        }  # fmt: skip
        return new, ratio_document(fit, old, command), told

    _run(work, logs, vehicle, out, dbc, names, bus, report, overwrite, json)


def _run(
    work: Callable[[list[Log], Vehicle, str], tuple[Vehicle, Document, Told]], paths: Sequence[Path], vehicle: str, out: Path,
    dbc: Path | None, names: Path | None, bus: int | None, report: Path | None, overwrite: bool, as_json: bool,
) -> None:  # fmt: skip
    """Read, identify, write vehicle and report (both or neither), and say what was found."""
    from codriver.cli.options import check_inputs
    from codriver.cli.terminal import command_line, working
    from codriver.logs import read
    from codriver.report.document import write_document
    from codriver.vehicles import load_vehicle, save_vehicle

    for path in paths:
        check_inputs(path, dbc, names)
    check_outputs(out, report, [*paths, *(p for p in (dbc, names) if p is not None)], overwrite)
    old = load_vehicle(vehicle)
    with working(not as_json, 2) as stage:
        stage("reading " + ", ".join(path.name for path in paths))
        recorded = [read(path, dbc=dbc, names=names, bus=bus) for path in paths]
        stage("identifying")
        new, document, told = work(recorded, old, command_line())
    told = {"logs": [str(path) for path in paths], "vehicle": old.name, **told, "result": str(out),
            "report": str(report) if report is not None else None}  # fmt: skip
    # What cannot be said fails before anything is written.
    text = json_module.dumps(
        _finite({key: value for key, value in told.items() if key != "rows"}),
        indent=2,
        ensure_ascii=False,
        allow_nan=False,
    )
    # The report goes first, to a name of its own; it is renamed when the vehicle is there too.
    draft = report.with_name(f".{report.name}.draft") if report is not None else None
    try:
        if draft is not None:
            write_document(document, draft)
        save_vehicle(replace(new, name=out.stem), out, overwrite=overwrite)
        if draft is not None and report is not None:
            draft.replace(report)
    finally:
        if draft is not None:
            draft.unlink(missing_ok=True)
    if as_json:
        typer.echo(text)
    else:
        _say(told)


def check_outputs(
    out: Path, report: Path | None, inputs: Sequence[Path], overwrite: bool, suffix: str = ".toml"
) -> None:
    """Whether vehicle or driver, whose name ends in `suffix`, and report can be written, asked before the long work.

    Raises:
        UsageError: they cannot, or would replace what must not be.
    """
    import os

    from codriver.errors import UsageError

    for option, path, suffixes in (("-o", out, (suffix,)), ("--report", report, (".html", ".htm"))):
        if path is None:
            continue
        if path.suffix.lower() not in suffixes:
            raise UsageError(f"{option} {path}", f"a name ending in {suffixes[0]}", "rename it")
        if not path.parent.is_dir() or path.is_dir() or not os.access(path.parent, os.W_OK):
            raise UsageError(f"{option} {path} cannot be written", "a file in a folder you may write", "choose another")
        if path.exists() and any(path.samefile(other) for other in inputs):
            raise UsageError(f"{option} {path} is an input", "another name", "choose another; inputs are kept")
    if out.exists() and not overwrite:
        raise UsageError(f"-o {out} is there already", "the name of a new file", "choose another, or say --overwrite")


def _finite(told: Any) -> Any:
    """The same with None for numbers that JSON does not have."""
    if isinstance(told, Mapping):
        return {key: _finite(value) for key, value in told.items()}
    if isinstance(told, list | tuple):
        return [_finite(value) for value in told]
    return None if isinstance(told, float) and not isfinite(told) else told


def _findings(said: Any) -> list[dict[str, str]]:
    return [{"severity": severity, "text": text} for severity, text in said]


def _say(told: Mapping[str, Any]) -> None:
    """What was found, as a table."""
    from rich.markup import escape
    from rich.table import Table

    from codriver.cli.terminal import console, say_findings
    from codriver.report.identification import HEAD

    out = console()
    minutes = told["minutes"]
    out.print(
        f"[bold]{escape(told['vehicle'])}[/] from {escape(', '.join(told['logs']))}: "
        f"fitted on {minutes['fitted']:.1f} usable minutes"
        + (f" ({minutes['braking']:.1f} braking)" if "braking" in minutes else "")
        + (f", validated on another {minutes['validated']:.1f}" if "validated" in minutes else "")
    )
    left = [f"{words} {part:.1%}" for words, part in told["left_out"].items() if part >= 0.0005]
    if left:
        out.print(
            f"left out: {'; '.join(left)}" + (f"; outliers {told['outliers']:.2%}" if told.get("outliers") else "")
        )
    out.print()
    table = Table(box=None, pad_edge=False)
    for column in HEAD:
        table.add_column(column, justify="left" if column in ("coefficient", "unit") else "right")
    for row in told["rows"]:
        table.add_row(*row)
    out.print(table)
    if "rmse" in told:
        rmse = told["rmse"]
        before = "-" if rmse["old"] is None else f"{rmse['old']:.4g}"
        out.print(
            f"\nvalidation RMSE {rmse['new']:.4g} {rmse['unit']}; with the old vehicle {before}, "
            f"answering a constant {rmse['constant']:.4g}"
        )
    out.print("\n[bold]verdict[/]:")
    say_findings(out, told["findings"])
    out.print(f"\nwrote {escape(told['result'])}" + (f" and {escape(told['report'])}" if told["report"] else ""))
