"""codriver plot: what a vehicle is like, from its file alone."""

from __future__ import annotations

import json as json_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from codriver.cli.options import Json

if TYPE_CHECKING:
    from codriver.models.lpv import LPV
    from codriver.vehicles import Vehicle

app = typer.Typer(help="Plot what a vehicle is like.", no_args_is_help=True, rich_markup_mode=None)


Machine = Annotated[
    str,
    typer.Argument(
        metavar="VEHICLE",
        help="A two-wheeler: sharp1971, meijaard2007, pasma2024, moore2012 or a TOML file.",
        show_default=False,
    ),
]
Out = Annotated[
    Path | None, typer.Option("-o", "--out", metavar="OUT.html", help="Report to write.", show_default=False)
]
Speeds = Annotated[
    str,
    typer.Option("--speeds", metavar="FROM:TO", help="m/s. Default: 1:60, a bicycle's 0:10.", show_default=False),
]


@app.callback()
def _group() -> None:
    """Plot what a vehicle is like."""


@app.command("modes")
def modes(vehicle: Machine, out: Out = None, speeds: Speeds = "", json: Json = False) -> None:
    """A two-wheeler's modes against speed: weave, wobble, capsize, caster, and where it is stable without its rider.

    Example: codriver plot modes sharp1971 -o modes.html --speeds 1:60
    """
    from codriver.cli.estimate import check_report
    from codriver.cli.terminal import command_line, console, say_findings
    from codriver.models.modes import follow_modes
    from codriver.vehicles import load_vehicle

    check_report(out)
    machine = load_vehicle(vehicle)
    model, kind, usual = two_wheeler(machine)
    low, high = parse_speeds(speeds) if speeds else usual
    found = follow_modes(model, low, high)
    from codriver.report.document import write_document
    from codriver.report.modes import mode_rows, mode_sentences, modes_document

    if out is not None:
        write_document(modes_document(found, machine, kind, command_line()), out)
    sentences = mode_sentences(found)
    if json:
        told: dict[str, Any] = {
            "vehicle": machine.name, "model": kind, "speeds": [low, high], "stable": found.stable_ranges(),
            "modes": {name: {"stable": found.stable_ranges(name)} for name in found.modes},
            "findings": [{"severity": severity, "text": text} for severity, text in sentences],
            "report": str(out) if out is not None else None,
        }  # fmt: skip
        typer.echo(json_module.dumps(told, indent=2, ensure_ascii=False, allow_nan=False))
        return
    from rich.markup import escape
    from rich.table import Table

    screen = console()
    screen.print(f"[bold]{escape(machine.name)}[/]: {escape(machine.title)}; {kind}\n")
    table = Table(box=None, pad_edge=False)
    for column in ("m/s", "km/h", *(f"{name}, 1/s" for name in found.modes)):
        table.add_column(column, justify="right")
    for row in mode_rows(found):
        table.add_row(*row)
    screen.print(table)
    screen.print()
    say_findings(screen, [{"severity": severity, "text": text} for severity, text in sentences])
    if out is not None:
        screen.print(f"\nwrote {escape(str(out))}")


def two_wheeler(vehicle: Vehicle) -> tuple[LPV, str, tuple[float, float]]:
    """A vehicle's model, what it is in words, and speeds worth looking at, m/s.

    Raises:
        VehicleError: it is no two-wheeler, or lacks some of its parameters.
    """
    from codriver.cli.terminal import some
    from codriver.errors import VehicleError
    from codriver.models.bicycle import LETTERS as BICYCLE
    from codriver.models.bicycle import BicycleParameters, bicycle_lpv, bicycle_matrices
    from codriver.models.motorcycle import LETTERS as MOTORCYCLE
    from codriver.models.motorcycle import MotorcycleParameters, motorcycle_model

    lacking = {
        kind: [name for name in letters.values() if name not in vehicle]
        for kind, letters in (("motorcycle", MOTORCYCLE), ("bicycle", BICYCLE))
    }
    if not lacking["motorcycle"]:
        model = motorcycle_model(MotorcycleParameters.from_vehicle(vehicle))
        return model, "Sharp's two bodies on tyres with relaxation", (1.0, 60.0)
    if not lacking["bicycle"]:
        matrices = bicycle_matrices(BicycleParameters.from_vehicle(vehicle)).to_iso()
        return bicycle_lpv(matrices), "Whipple's four bodies on wheels that roll without slip", (0.0, 10.0)
    nearest = min(lacking, key=lambda kind: len(lacking[kind]))
    raise VehicleError(
        f"vehicle '{vehicle.name}' is no two-wheeler: as a {nearest} it lacks {some(lacking[nearest])}",
        "all parameters of Sharp's motorcycle or Whipple's bicycle",
        "add them to the vehicle file; docs/vehicles.md lists them, sharp1971 and meijaard2007 are examples",
    )


def parse_speeds(text: str) -> tuple[float, float]:
    """Two speeds, m/s.

    Raises:
        UsageError: the text is not FROM:TO with 0 <= FROM < TO <= 200.
    """
    from codriver.errors import UsageError

    low, _, high = text.partition(":")
    try:
        ends = float(low), float(high)
    except ValueError:
        ends = 0.0, 0.0
    if not 0 <= ends[0] < ends[1] <= 200:
        raise UsageError(f"--speeds {text}", "FROM:TO in m/s, from 0 upwards, at most 200", "write --speeds 1:60")
    return ends
