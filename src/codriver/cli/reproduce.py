"""codriver reproduce: a paper's tables, figures and claims made again, beside the paper's own."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def reproduce(
    papers: Annotated[list[str], typer.Argument(metavar="PAPER...", help="jerk2017, jerk2015.", show_default=False)],
    out: Annotated[Path, typer.Option("-o", "--out", metavar="DIR", help="Folder to write into.")] = Path(),
    recordings: Annotated[
        Path, typer.Option("--recordings", metavar="DIR", help="Folder of real recordings, for what is made on them.")
    ] = Path("../shared/data"),
    quick: Annotated[
        bool, typer.Option("--quick", help="Two drivers instead of six, to see that everything runs.")
    ] = False,
) -> None:
    """Make a paper's tables, figures and claims again; DIR/PAPER.html is to be read, DIR/PAPER.json to be processed.

    Example: codriver reproduce jerk2017 jerk2015 -o papers
    """
    from codriver.cli.terminal import command_line, console, working
    from codriver.errors import UsageError
    from codriver.papers import PAPERS
    from codriver.papers import reproduce as make

    for name in papers:
        if name not in PAPERS:
            make(name)  # raises, and says which there are
    if out.exists() and not out.is_dir():
        raise UsageError(f"--out {out} is a file", "a folder, or a name that is free", "choose another --out")
    screen = console()
    for name in dict.fromkeys(papers):
        with working(True, 3) as stage:
            made = make(name, stage, quick=quick, recordings=recordings)
        out.mkdir(parents=True, exist_ok=True)
        page, data = made.write(out, command_line())
        counts = {v: sum(i.holds is v for i in made.items) for v in (True, False, None)}
        screen.print(
            f"{name}: {len(made.items)} items, {counts[True]} hold, {counts[False]} do not, {counts[None]} cannot be judged here",
            markup=False,
        )
        for item in made.items:
            if item.holds is False:
                screen.print(
                    f"  does not hold: {item.item} (paper: {item.paper}, ours: {_said(item.ours)} {item.unit})",
                    markup=False,
                )
        screen.print(f"wrote {page} and {data}", markup=False)


def _said(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.3g}"
