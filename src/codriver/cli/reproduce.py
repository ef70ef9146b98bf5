"""codriver reproduce: a paper's tables, figures and claims made again, beside the paper's own."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def reproduce(
    papers: Annotated[
        list[str],
        typer.Argument(
            metavar="PAPER...",
            help="jerk2017, jerk2015, steering2019, drivers2019, motorcycle2018.",
            show_default=False,
        ),
    ],
    out: Annotated[Path, typer.Option("-o", "--out", metavar="DIR", help="Folder to write into.")] = Path(),
    recordings: Annotated[
        Path, typer.Option("--recordings", metavar="DIR", help="Folder of real recordings, for what is made on them.")
    ] = Path("../shared/data"),
    quick: Annotated[
        bool, typer.Option("--quick", help="Fewer drivers and seeds, to see that everything runs.")
    ] = False,
) -> None:
    """Make a paper's tables, figures and claims again; DIR/PAPER.html is to be read, DIR/PAPER.json to be processed.

    Example: codriver reproduce jerk2017 jerk2015 steering2019 drivers2019 motorcycle2018 -o papers
    """
    from codriver.papers import PAPERS
    from codriver.papers import reproduce as make

    for name in papers:
        if name not in PAPERS:
            make(name)  # raises, and says which there are
    fresh = _folder(out)
    try:
        _make(list(dict.fromkeys(papers)), out, recordings, quick)
    finally:
        if fresh and not any(out.iterdir()):
            out.rmdir()


def _make(papers: list[str], out: Path, recordings: Path, quick: bool) -> None:
    """Each paper in turn, written as soon as it is made."""
    from codriver.cli.terminal import command_line, console, working
    from codriver.papers import reproduce as make
    from codriver.papers.item import counts

    screen = console()
    for name in papers:
        with working(True, None) as stage:
            made = make(name, stage, quick=quick, recordings=recordings)
        page, data = made.write(out, command_line())
        screen.print(f"{name}: {len(made.items)} items", markup=False)
        for where, items in (("of the paper", made.of_paper), ("beside it", made.beside)):
            screen.print(f"  {where}: {counts(items)}", markup=False)
            for item in items:
                if item.holds is False:
                    said = "" if item.own else f"paper: {item.paper}, "
                    ours = f"{_said(item.ours)} {item.unit if item.unit != '1' else ''}".rstrip()
                    screen.print(f"    does not hold: {item.item} ({said}ours: {ours})", markup=False)
        screen.print(f"wrote {page} and {data}", markup=False)


def _folder(out: Path) -> bool:
    """Make the folder before the long work; whether it is new.

    Raises:
        UsageError: it is a file, or cannot be made or written into.
    """
    import os

    from codriver.errors import UsageError

    if out.exists() and not out.is_dir():
        raise UsageError(f"--out {out} is a file", "a folder, or a name that is free", "choose another --out")
    fresh = not out.exists()
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"--out {out} cannot be made: {error.strerror}", "a folder", "choose another --out") from None
    if not os.access(out, os.W_OK):
        raise UsageError(f"--out {out} cannot be written into", "a folder you may write into", "choose another --out")
    return fresh


def _said(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.3g}"
