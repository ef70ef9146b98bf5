"""The papers that can be made again, by the name used on the command line."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import cast

from codriver.errors import UsageError
from codriver.names import nearest
from codriver.papers.reproduction import Reproduction, Tell

# Name: module with a function `reproduce(tell, quick)`, and the paper.
PAPERS: dict[str, tuple[str, str]] = {
    "jerk2017": (
        "codriver.papers.jerk2017",
        "Bisoffi, Biral, Da Lio, Zaccarian 2017, doi:10.1109/TMECH.2017.2716838",
    ),
    "steering2019": (
        "codriver.papers.steering2019",
        "Okamoto, Tsiotras 2019, Robotics and Autonomous Systems",
    ),
    "drivers2019": ("codriver.papers.drivers2019", "Okamoto, Tsiotras 2019, Robotics and Autonomous Systems"),
    "motorcycle2018": (
        "codriver.papers.motorcycle2018",
        "Damon, Ichalal, Arioui 2018, lateral motorcycle dynamics by a Luenberger-like LPV observer",
    ),
    "jerk2015": ("codriver.papers.jerk2015", "Bisoffi, Biral, Da Lio, Zaccarian 2015, doi:10.1109/ITSC.2015.301"),
}


def reproduce(
    name: str, tell: Tell = lambda text: None, *, quick: bool = False, recordings: Path | None = None
) -> Reproduction:
    """Make a paper again.

    Args:
        name: one of PAPERS.
        tell: is told each stage as it begins.
        quick: fewer drivers, to see that everything runs.
        recordings: folder that holds recordings of real vehicles by their names; what is not there is left out, and said.

    Raises:
        UsageError: there is no such paper.
    """
    if name not in PAPERS:
        close = nearest(name, PAPERS)
        raise UsageError(
            f"no paper is called '{name}'",
            f"one of {', '.join(PAPERS)}",
            f"did you mean {close}?" if close else "choose one",
        )
    make = cast(Callable[[Tell, bool, Path | None], Reproduction], import_module(PAPERS[name][0]).reproduce)
    return make(tell, quick, recordings)
