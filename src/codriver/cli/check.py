"""codriver check: whether a vehicle file or a names file is right."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from codriver.cli.options import Bus, Dbc, Names

if TYPE_CHECKING:
    from codriver.vehicles import Vehicle

app = typer.Typer(help="Check a vehicle file or a names file.", no_args_is_help=True, rich_markup_mode=None)
File = Annotated[
    str, typer.Argument(metavar="FILE", help="A TOML file (for vehicles, a built-in name too).", show_default=False)
]


@app.command("vehicle")
def vehicle(
    file: File,
    log: Annotated[
        Path | None,
        typer.Option("--log", help="A recording of this vehicle: do its signals agree with the parameters?", show_default=False),
    ] = None,
    dbc: Dbc = None,
    names: Names = None,
    bus: Bus = None,
) -> None:  # fmt: skip
    """Check a vehicle file; show its parameters and which estimators it serves; with --log, hold it against a drive."""
    from rich.markup import escape
    from rich.table import Table

    from codriver.cli.terminal import console, say_findings, some
    from codriver.observers import ESTIMATORS
    from codriver.observers.motorcycle_vehicle import motorcycle_vehicle_findings
    from codriver.vehicles import load_vehicle
    from codriver.vehicles.load import KNOWN

    car = load_vehicle(file)
    out = console()
    out.print(f"[bold]{escape(car.name)}[/]: {escape(car.title)}\n{escape(car.source)}\n")
    table = Table(box=None, pad_edge=False)
    for column in ("parameter", "value", "sd", "unit", "meaning", "source"):
        table.add_column(column, justify="right" if column in ("value", "sd") else "left")
    for name, p in car.parameters.items():
        table.add_row(name, _numbers(p.value), _numbers(p.sd), p.unit, KNOWN[name].meaning, escape(p.source))
    out.print(table)
    out.print()
    for estimator in ESTIMATORS.values():
        lacking = [p for p in estimator.parameters if p not in car]
        out.print(
            f"  {'[red]no[/] ' if lacking else '[green]yes[/]'} {estimator.name:<14}"
            + (f" lacks {some(lacking)}" if lacking else "")
        )
    found = motorcycle_vehicle_findings(car, {})
    if found:
        out.print()
        say_findings(out, ({"severity": f.severity, "text": f.text} for f in found))
    if log is not None:
        _against(car, log, dbc, names, bus)


def _against(car: Vehicle, log: Path, dbc: Path | None, names: Path | None, bus: int | None) -> None:
    """Say how the vehicle fits a drive; exit code 1 if it does not."""
    from codriver.cli.options import check_inputs
    from codriver.cli.terminal import console, say_findings
    from codriver.identify import check_vehicle_against_log
    from codriver.logs import read

    check_inputs(log, dbc, names)
    findings = check_vehicle_against_log(read(log, dbc=dbc, names=names, bus=bus), car)
    out = console()
    out.print(f"\n[bold]held against[/] {log}", soft_wrap=True)
    if not findings:
        out.print("  nothing can be judged: the log lacks the signals, or moves too little")
    say_findings(out, ({"severity": f.severity, "text": f.text} for f in findings))
    if any(f.severity == "bad" for f in findings):
        raise typer.Exit(1)


@app.command("names")
def names(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A names file (TOML).", show_default=False)],
) -> None:
    """Check a names file; show what it maps."""
    from rich.markup import escape
    from rich.table import Table

    from codriver.cli.terminal import console
    from codriver.logs.names_file import load_names
    from codriver.names import VOCABULARY

    mapping = load_names(file)
    table = Table(box=None, pad_edge=False)
    for column in ("standard name", "unit inside", "source", "unit there", "scale", "offset", "sign", "valid where"):
        table.add_column(column)
    for entry in mapping.entries.values():
        table.add_row(
            entry.name, VOCABULARY[entry.name].unit, escape(" + ".join(entry.source)), entry.unit or "(as the source says)",
            f"{entry.scale:g}", f"{entry.offset:g}", f"{entry.sign:+d}", escape(entry.valid or "-"),
        )  # fmt: skip
    console().print(table)


def _numbers(value: float | tuple[float, ...] | None) -> str:
    if value is None:
        return "-"
    return ", ".join(f"{v:g}" for v in value) if isinstance(value, tuple) else f"{value:g}"
