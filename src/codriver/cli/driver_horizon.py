"""codriver driver horizon: how far ahead a driver's torque can be foretold."""

from __future__ import annotations

import json as json_module
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from codriver.cli.driver import Drives, Report, read_drives
from codriver.cli.driver_use import app
from codriver.cli.options import Bus, Dbc, Json, Names, VehicleName

if TYPE_CHECKING:
    from codriver.drivers.learned.horizon_errors import HorizonErrors
    from codriver.signals import Log
    from codriver.vehicles import Vehicle

Horizons = Annotated[str, typer.Option("--horizons", help="How far ahead, s, with commas between.")]


@app.command("horizon")
def horizon(
    drives: Drives, horizons: Horizons = "0.2,0.5,1,1.5,2",
    models: Annotated[
        list[str] | None, typer.Option("--model", help="Of which models; may be repeated.", show_default="ridge and guarded")
    ] = None,
    dbc: Dbc = None, names: Names = None, bus: Bus = None, vehicle: VehicleName = None,
    folds: Annotated[int, typer.Option("--folds", min=2, help="Blocks, where one drive is given.")] = 4,
    report: Report = None, json: Json = False,
) -> None:  # fmt: skip
    """How far ahead can the torque be foretold? Error against horizon, on drives or blocks held out in turn.

    Directly, with a model for each horizon; and with a vehicle that tells column and tyres (steering_inertia, alignment_stiffness,
    ...), by a model of one step iterated through it.

    Example: codriver driver horizon monday.csv tuesday.csv --names names.toml --horizons 0.2,1,2 --report horizon.html
    """
    from codriver.cli.estimate import check_report
    from codriver.cli.terminal import command_line, working
    from codriver.drivers.learned.horizon import error_against_horizon
    from codriver.drivers.learned.horizon_errors import NAIVE
    from codriver.drivers.learned.kinds import DEFAULT, class_of
    from codriver.drivers.learned.protocol import Protocol
    from codriver.logs.write import complete_or_nothing
    from codriver.report.document import write_document
    from codriver.report.horizons import horizon_document

    kinds = tuple(dict.fromkeys(models or ("ridge", DEFAULT)))
    for kind in kinds:
        class_of(kind)
    check_report(report)
    wanted = parse_horizons(horizons)
    parts = max(folds, len(drives)) * len({*NAIVE, *kinds}) * (len(wanted) + 1)
    with working(not json, len(drives) + parts) as stage:
        logs, notes = read_drives(drives, dbc, names, bus, vehicle, stage)
        car, said = iterated_through(logs, vehicle)
        found = error_against_horizon(logs, kinds, wanted, car, protocol=Protocol(folds=folds), progress=stage)
        if report is not None:
            with complete_or_nothing(report) as draft:
                write_document(horizon_document(found, list(logs), [*notes, *said], command_line()), draft)
    told = horizons_told(found, list(logs), [*notes, *said], report)
    if json:
        typer.echo(json_module.dumps(told, indent=2, ensure_ascii=False, allow_nan=False))
    else:
        say_horizons(told)


def parse_horizons(text: str) -> tuple[float, ...]:
    """Numbers with commas between.

    Raises:
        UsageError: one is no positive number.
    """
    from codriver.errors import UsageError

    try:
        found = tuple(float(part) for part in text.split(","))
    except ValueError:
        found = ()
    if not found or not all(isfinite(h) and h > 0 for h in found):
        raise UsageError(f"--horizons {text}", "positive numbers with commas between", "write --horizons 0.2,1,2")
    return found


def iterated_through(logs: dict[str, Log], name: str | None) -> tuple[Vehicle | None, list[str]]:
    """The vehicle to iterate through, or none and why not."""
    from codriver.drivers.learned.rollout import NEEDED, ColumnAndCar
    from codriver.errors import VehicleError
    from codriver.vehicles import load_vehicle

    if name is None:
        return None, []
    car = load_vehicle(name)
    lacking = [signal for signal in NEEDED if any(signal not in log for log in logs.values())]
    if lacking:
        return None, [f"not iterated, since the drives lack {', '.join(lacking)}"]
    try:
        ColumnAndCar.from_vehicle(car)
    except VehicleError as error:
        return None, [f"not iterated: {error.found}"]
    return car, []


def horizons_told(found: HorizonErrors, drives: list[str], notes: list[str], report: Path | None) -> dict[str, Any]:
    """What `driver horizon` tells."""
    rows = []
    for form, kind in found.made:
        spread = found.spread(form, kind)
        rows.append({
            "model": kind, "form": form, "rmse_Nm": found.rmse(form, kind).tolist(),
            "rmse_se_Nm": [s if isfinite(s) else None for s in spread.tolist()],
            "parts": {n: each.tolist() for n, each in zip(found.folds, found.parts(form, kind), strict=True)},
            "inside95": found.coverage[kind].tolist() if form == "direct" else None,
            "diverged": found.diverged[kind].tolist() if form == "iterated" else None,
        })  # fmt: skip
    return {
        "drives": drives, "target": found.target, "horizons_s": found.horizons.round(9).tolist(), "held_out": list(found.folds),
        "moments": found.rows, "road_ahead_s": found.road, "left_out": list(found.left_out), "notes": notes, "models": rows,
        "findings": [{"severity": f.severity, "text": f.text} for f in found.verdict()],
        "report": str(report) if report is not None else None,
    }  # fmt: skip


def say_horizons(told: dict[str, Any]) -> None:
    """Show it."""
    from rich.table import Table

    from codriver.cli.terminal import console, say_findings

    out = console()
    road = f", road known {told['road_ahead_s']:g} s ahead at most" if told["road_ahead_s"] else ", no road"
    out.print(
        f"{', '.join(told['drives'])}: {told['target']} at {told['moments']} moments{road}; "
        f"held out in turn: {', '.join(told['held_out'])}",
        markup=False,
    )
    if told["left_out"]:
        out.print(f"left out, since the drives lack it: {', '.join(told['left_out'])}", markup=False)
    for note in told["notes"]:
        out.print(f"note {note}", markup=False)
    table = Table(box=None, pad_edge=False)
    table.add_column("RMSE, N m, and standard error")
    for h in told["horizons_s"]:
        table.add_column(f"{h:g} s", justify="right")
    for row in told["models"]:
        pairs = zip(row["rmse_Nm"], row["rmse_se_Nm"], strict=True)
        cells = [f"{value:.3f}" + (f" ± {error:.3f}" if error is not None else "") for value, error in pairs]
        table.add_row(row["model"] + (" iterated" if row["form"] == "iterated" else ""), *cells)
    bands = Table(box=None, pad_edge=False)
    bands.add_column("in the 95 % band")
    for h in told["horizons_s"]:
        bands.add_column(f"{h:g} s", justify="right")
    for row in told["models"]:
        if row["inside95"] is not None:
            bands.add_row(row["model"], *(f"{share:.0%}" for share in row["inside95"]))
    out.print()
    out.print(table)
    out.print()
    out.print(bands)
    out.print("\n[bold]verdict[/]:")
    say_findings(out, told["findings"])
    if told["report"]:
        out.print(f"\nwrote {told['report']}", markup=False)
