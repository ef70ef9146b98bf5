"""codriver demo: a simulated drive, estimated by the very command a user would type, and held against its truth."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from rich.console import Console

    from codriver.estimate import Estimate
    from codriver.signals import Log


def demo(
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder to write into.")] = Path("codriver-demo"),
    seed: Annotated[int, typer.Option("--seed", help="Another seed, another drive of the same kind.")] = 1,
) -> None:
    """Simulate a short drive as CAN frames, estimate what the driver intended, and say how far from the truth it is."""
    import shlex
    import sys

    from codriver.cli.estimate import estimate_file
    from codriver.cli.terminal import console, working
    from codriver.logs import read
    from codriver.simulate import write_demo

    screen = console()
    with working(True, 1) as stage:
        stage("simulating three minutes of driving")
        files = write_demo(out, seed)
    result, report = out / "estimate.parquet", out / "report.html"
    command = [
        "estimate", "intent", str(files.log), "--dbc", str(files.dbc), "--names", str(files.names),
        "--vehicle", "bisoffi2017", "-o", str(result), "--report", str(report),
    ]  # fmt: skip
    screen.print(
        f"wrote {files.log}, {files.dbc}, {files.names}, a logger's {files.logger} and the truth, {files.truth}\n",
        markup=False,
    )
    screen.print(f"$ codriver {shlex.join(command)}\n", markup=False)
    sys.argv = ["codriver", *command]  # provenance names the command that makes this result
    truth = read(files.truth)
    estimate = estimate_file(
        "intent", files.log, result, "bisoffi2017", files.dbc, files.names, report=report, truth=truth
    )
    _compare(estimate, truth, screen)


def _compare(estimate: Estimate, truth: Log, screen: Console) -> None:
    """How far the estimate is from the truth."""
    from rich.table import Table

    from codriver.simulate.judge import judge

    rows = judge(estimate, truth)
    table = Table(box=None, pad_edge=False)
    for column in (
        "against the simulated truth, where valid",
        "rms error",
        "unit",
        "answering 0",
        "kinematic",
        "in the 95 % band",
    ):
        table.add_column(
            column, justify="left" if column in ("against the simulated truth, where valid", "unit") else "right"
        )
    for row in rows:
        numbers = [f"{x:.3f}" if x is not None else "-" for x in (row.error, row.zero, row.kinematic)]
        coverage = f"{row.coverage:.0%}" if row.coverage is not None else "-"
        table.add_row(row.what, numbers[0], row.unit, numbers[1], numbers[2], coverage)
    screen.print()
    screen.print(table)
    screen.print(
        "\n'lag taken out' compares with the same observer fed ideal signals of the truth: what remains is noise, holes in the\n"
        "data and model error. Against the truth of the moment the observer's lag dominates (docs/trust.md)."
    )
