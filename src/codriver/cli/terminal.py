"""What the terminal shows: progress on standard error, the summary on standard output."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console

# Of an estimate's settings, those that are told, in this order.
SETTINGS = ("vehicle", "known_torque", "ell", "preset", "order", "balance", "form", "smoother")
MANY = 5  # parameters of a vehicle that are named one by one
_STYLE = {"ok": "green", "warn": "yellow", "bad": "red"}


def command_line() -> str:
    """The command as typed, for provenance; the program by its name and not its path."""
    return "codriver " + shlex.join(sys.argv[1:])


@contextmanager
def working(show: bool, stages: int | None) -> Iterator[Callable[[str], None]]:
    """A bar of so many stages (None: not known) on standard error; call what it gives with a stage's name as that begins."""
    if not show or not sys.stderr.isatty():
        yield lambda text: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = SpinnerColumn(), BarColumn(), MofNCompleteColumn(), TextColumn("{task.description}"), TimeElapsedColumn()
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task("", total=stages, completed=-1, visible=False)
        yield lambda text: progress.update(task, description=text, advance=1, visible=True)


def console() -> Console:
    """Standard output; where it is no terminal, wide enough that tables are not cut, and text is not wrapped."""
    from rich.console import Console

    piped = not sys.stdout.isatty()
    return Console(highlight=False, soft_wrap=piped, width=160 if piped else None)


def say_findings(out: Console, findings: Iterable[Mapping[str, str]]) -> None:
    """Show findings: severity and text each, a line each."""
    from rich.markup import escape

    for finding in findings:
        out.print(f"  [{_STYLE[finding['severity']]}]{finding['severity']:<4}[/] {escape(finding['text'])}")


def say(summary: dict[str, Any]) -> None:
    """Show the summary of an estimate."""
    from rich.markup import escape
    from rich.table import Table

    out = console()
    settings = summary["settings"]
    parts = [f"{key} {_short(settings[key])}" for key in SETTINGS if key in settings]
    out.print(
        f"[bold]{summary['estimator']}[/] on {escape(summary['log'])}" + (f": {', '.join(parts)}" if parts else "")
    )
    if summary["why"]:
        out.print(f"chosen as {escape(summary['why'])}")
    distance = f", {summary['distance_m'] / 1000:.2f} km" if summary["distance_m"] is not None else ""
    extra = f", {summary['gear_shifts']} gear shifts" if summary.get("gear_shifts") else ""
    extra += f", braking {summary['braking_share']:.0%}" if summary.get("braking_share") else ""
    extra += f", hands on {summary['hands_on_share']:.0%}" if "hands_on_share" in summary else ""
    out.print(
        f"{summary['duration_s']:.1f} s{distance} at {summary['rate_hz']:g} Hz, valid {summary['valid_share']:.0%}{extra}\n"
    )
    table = Table(box=None, pad_edge=False)
    for column in ("estimate", "unit", "rms", "5 %", "95 %", "mean sd"):
        table.add_column(column, justify="left" if column in ("estimate", "unit") else "right")
    for name, row in summary["estimates"].items():
        numbers = [f"{row[key]:.3f}" if row[key] is not None else "-" for key in ("rms", "p5", "p95", "mean_sd")]
        table.add_row(name, str(row["unit"]), *numbers)
    out.print(table)
    out.print(f"\n[bold]verdict[/]: {summary['verdict']}")
    say_findings(out, summary["findings"])
    if "mend" in summary:
        out.print(f"\nto take the encoder's zero out:\n{summary['mend']}", markup=False)
    if "vehicle_file" in summary:
        out.print(f"\nfor live and C, in the vehicle file:\n{summary['vehicle_file']}", markup=False)
    out.print(
        f"\nwrote {escape(summary['result'])}" + (f" and {escape(summary['report'])}" if summary["report"] else "")
    )


def _short(text: str) -> str:
    """A setting as one reads it: a number with no more than four digits."""
    try:
        number = float(text)
    except ValueError:
        return text
    return text if len(text) <= 5 else f"{number:.4g}"


def some(parameters: Sequence[str]) -> str:
    """Parameters that a vehicle lacks; those of another kind of vehicle are counted."""
    if len(parameters) <= MANY:
        return ", ".join(parameters)
    return f"{', '.join(parameters[:3])} and {len(parameters) - 3} more: another kind of vehicle?"
