"""codriver identify driver: the two-point driver who drove, as a file to drive with."""

from __future__ import annotations

import json as json_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from codriver.cli.driver import Overwrite
from codriver.cli.identify import Report, _finite, check_outputs
from codriver.cli.identify_alignment import app
from codriver.cli.options import Bus, Dbc, Json, Names

if TYPE_CHECKING:
    from codriver.identify import DriverFit
    from codriver.models.two_point import TwoPointDriver
    from codriver.models.two_point_file import FiledDriver
    from codriver.report.document import Document

Drives = Annotated[
    list[Path],
    typer.Argument(metavar="DRIVE...", help="Recordings of one driver, each at one speed.", show_default=False),
]
Out = Annotated[
    Path, typer.Option("-o", "--out", metavar="NAME.toml", help="Driver file to write.", show_default=False)
]
Known = Annotated[
    str, typer.Option("--known", metavar="NAME=VALUE,...",
                      help='Parameters that are not sought, SI: "K_r=0.15, far=1.2". Default: K_r, near, far of the usual driver.'),
]  # fmt: skip
Seek = Annotated[
    str, typer.Option("--seek", metavar="NAMES", help='Sought beside: "near, far", where he looks. Default: they are given.'),
]  # fmt: skip
By = Annotated[
    str, typer.Option("--by", help="road; direct (prediction errors, for a driver who is always the same); or dual-ekf (2019).")
]  # fmt: skip
Beside = Annotated[
    Path | None,
    typer.Option("--beside", metavar="OTHER.toml", help="Another driver file to compare with, such as truth.toml of a simulation.",
                 show_default=False),
]  # fmt: skip
VehicleName = Annotated[
    str | None, typer.Option("--vehicle", help="Built-in name or TOML file: its column tells the torque, where no sensor does.",
                             show_default=False),
]  # fmt: skip


@app.command("driver")
def driver(
    drives: Drives, out: Out, known: Known = "", seek: Seek = "", by: By = "road", beside: Beside = None, dbc: Dbc = None,
    names: Names = None, bus: Bus = None, vehicle: VehicleName = None, report: Report = None, overwrite: Overwrite = False,
    json: Json = False,
) -> None:  # fmt: skip
    """Gains, times and arms of a two-point driver, with standard errors, from drives on a known road (2019, section 5.3).

    The file drives again: codriver simulate circuit --driver NAME.toml. Where no sensor measures the torque, give --vehicle.

    Example: codriver identify driver laps/drive.csv --names laps/names.toml -o anna.toml --report anna.html
    """
    from codriver.cli.driver import read_drives
    from codriver.cli.terminal import command_line, working
    from codriver.errors import UsageError
    from codriver.identify import identify_driver
    from codriver.identify.driver_fit import WAYS
    from codriver.identify.driver_verdict import driver_findings
    from codriver.models.two_point_file import load_two_point, named, save_two_point
    from codriver.report.two_point import two_point_document

    base, held = parse_known(known)
    also = [named(word.strip()) for word in seek.split(",") if word.strip()]
    if by not in WAYS:
        raise UsageError(f"--by {by}", f"one of {', '.join(WAYS)}", "choose one")
    other = load_two_point(beside) if beside is not None else None
    inputs = [*drives, *(p for p in (dbc, names, beside) if p is not None)]
    check_outputs(out, report, inputs, overwrite)
    if out.exists():
        load_two_point(out)  # raises: only a driver file may be replaced
    with working(not json, len(drives) + 1) as stage:
        logs, notes = read_drives(drives, dbc, names, bus, vehicle, stage)
        stage("identifying")
        fit = identify_driver(list(logs.values()), base, held=held, also=also, by=by)
    filed = fit.filed(out.stem)
    document = two_point_document(fit, other, command_line())
    _write(document, report, lambda: save_two_point(filed, out))
    told: dict[str, Any] = {
        "drives": [str(path) for path in drives], "by": by, "notes": notes,
        "parameters": {
            p.name: {"letter": p.letter, "value": p.value, "unit": p.unit, "se": p.sd, "se_model": p.sd_model,
                     "se_robust": p.sd_robust, "low": p.low, "high": p.high}
            for p in fit.parameters.values()
        },
        "given": dict(fit.given), "refused": {r.name: r.reason for r in fit.refused},
        "settled": fit.settled, "minutes": fit.seconds / 60, "speeds_m_s": list(fit.speeds), "unexplained_Nm": fit.rms,
        "holes": [{"drive": d.source, **vars(h)} for d in fit.drives for h in d.holes],
        "left_out": [{"drive": d.source, **vars(p)} for d in fit.drives for p in d.left_out],
        "explained": fit.explained, "one_step_Nm": fit.one_step,
        "findings": [{"severity": f.severity, "text": f.text} for f in driver_findings(fit)],
        "result": str(out), "report": str(report) if report is not None else None,
    }  # fmt: skip
    if json:
        typer.echo(json_module.dumps(_finite(told), indent=2, ensure_ascii=False, allow_nan=False))
        return
    _say(fit, other, told)


def parse_known(text: str) -> tuple[TwoPointDriver, tuple[str, ...]]:
    """The usual driver with what is known of this one, and the names of what is.

    Args:
        text: "NAME=VALUE, ...", names or letters.

    Raises:
        UsageError: it is not that, one is told twice, there is no such parameter, or a driver cannot have that value.
    """
    from dataclasses import replace

    from codriver.errors import UsageError
    from codriver.models.two_point import TwoPointDriver
    from codriver.models.two_point_file import named

    values: dict[str, float] = {}
    for part in (p.strip() for p in text.split(",") if p.strip()):
        word, _, value = part.partition("=")
        try:
            number = float(value)
        except ValueError:
            raise UsageError(f"--known {part}", "NAME=VALUE", 'write --known "K_r=0.15, far=1.2"') from None
        if named(word.strip()) in values:
            raise UsageError(f"--known tells {word.strip()} twice", "one value for a parameter", "leave one out")
        values[named(word.strip())] = number
    try:
        return replace(TwoPointDriver(), **values), tuple(values)
    except ValueError as error:
        raise UsageError(f"--known: {error}", "a value that a driver can have", "correct it") from None


def _write(document: Document, report: Path | None, save: Any) -> None:
    """Driver file and report, both or neither."""
    from codriver.logs.write import complete_or_nothing
    from codriver.report.document import write_document

    if report is None:
        save()
        return
    with complete_or_nothing(report) as draft:
        write_document(document, draft)
        save()


def _say(fit: DriverFit, other: FiledDriver | None, told: dict[str, Any]) -> None:
    """What was found, as a table."""
    from rich.markup import escape
    from rich.table import Table

    from codriver.cli.terminal import console, say_findings
    from codriver.identify.driver_result import WORDS
    from codriver.report.two_point import HEAD, two_point_rows

    out = console()
    out.print(
        f"{escape(', '.join(told['drives']))}: {fit.seconds / 60:.1f} min at {fit.speeds_told()}, by {WORDS[fit.by]}; "
        f"{100 * fit.explained:.1f} % of the torque explained, {fit.rms:.2g} N m left\n"
    )
    for note in told["notes"]:
        out.print(escape(note))
    table = Table(box=None, pad_edge=False)
    for k, column in enumerate(HEAD if other is None else (*HEAD, other.name, "off, se")):
        table.add_column(escape(column), justify="right" if k in (3, 4, 5) or k > 6 else "left")
    for row in two_point_rows(fit, other):
        table.add_row(*row)
    out.print(table)
    if fit.refused:
        out.print("\n[bold]not told[/]:")
    for r in fit.refused:
        out.print(f"  {r.name}: {escape(r.reason)}")
    out.print("\n[bold]verdict[/]:")
    say_findings(out, told["findings"])
    out.print(f"\nwrote {escape(told['result'])}" + (f" and {escape(told['report'])}" if told["report"] else ""))
