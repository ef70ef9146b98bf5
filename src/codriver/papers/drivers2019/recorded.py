"""Beside 2019: the models on measured torques of a real car and of a race simulator, each against the simplest.

The default model against "the torque stays", its slope and ridge, by the gain in squared error over blocks of 10 s (two standard
errors). Neither recording has a road ahead; the Lincoln has no yaw rate.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from codriver.drivers.learned import BASELINES, DEFAULT, Evaluation, Protocol, evaluate, evaluate_table, features_of
from codriver.drivers.learned.protocol import Fold
from codriver.errors import CodriverError
from codriver.logs import read
from codriver.papers.item import Item
from codriver.papers.reproduction import Chapter, Tell
from codriver.papers.steering2019.recorded_car import FILES, FOLDER, JUDGED, LEARNT, NAMES
from codriver.report.drivers import FULL, protocol_parts

LINCOLN = "A real car: Udacity's Lincoln MKZ, two drives foretell the third"
RACE = "A lap of iRacing, quarters held out"
LAP = Path("iracing") / "amg.ibt"


def recorded_chapters(recordings: Path | None, tell: Tell) -> tuple[Chapter, ...]:
    """A chapter a recording; what is not there is said.

    Args:
        recordings: folder that holds them by name; None for none.
        tell: is told each.
    """
    if recordings is None or not recordings.is_dir():
        return (
            Chapter(
                "Real recordings beside it",
                ("The recordings are not there; give the folder that holds them with --recordings.",),
                (),
            ),
        )
    made: list[tuple[str, Path, Callable[[Path], Chapter]]] = [
        (LINCOLN, recordings / FOLDER, lincoln_chapter), (RACE, recordings / LAP, race_chapter),
    ]  # fmt: skip
    chapters = []
    for title, path, make in made:
        if not path.exists():
            name = path.relative_to(recordings)
            said = f"The recording {name} is not there; give the folder that holds it with --recordings."
            chapters.append(Chapter(title, (said,), ()))
            continue
        tell(f"learning from {path.name}")
        try:
            chapters.append(make(path))
        except CodriverError as error:
            chapters.append(Chapter(title, (f"The recording could not be used: {error}",), ()))
    return tuple(chapters)


def lincoln_chapter(folder: Path) -> Chapter:
    """Learnt from hmb1 and hmb2, judged on hmb6."""
    drives = [replace(read(folder / FILES[name], names=NAMES), source=name) for name in (*LEARNT, JUDGED)]
    protocol = Protocol(f"{' and '.join(LEARNT)} foretell {JUDGED}", hold_out="drives")
    table = features_of(drives, protocol.features)
    other = table.drive == len(LEARNT)
    fold = Fold(JUDGED, np.flatnonzero(~other), np.flatnonzero(other))
    found = evaluate_table(table, [fold], (DEFAULT,), protocol=protocol, calibrate=False)
    return Chapter(LINCOLN, (
        "The torque is a sensor's, the human is real, and nothing of the third drive was seen. The default model was chosen with "
        "these drives at hand, which flatters it a little.",
    ), protocol_parts(found), against("Lincoln, hmb6", found))  # fmt: skip


def race_chapter(path: Path) -> Chapter:
    """One lap, a minute: each quarter by the others."""
    found = evaluate({"lap": read(path)}, (DEFAULT,), protocol=Protocol("quarters of a lap"), calibrate=False)
    return Chapter(RACE, (
        "A minute of a race simulator, in which the car slides once: too little to learn much from.",
    ), protocol_parts(found), against("iRacing, a lap", found))  # fmt: skip


def against(where: str, found: Evaluation) -> tuple[Item, ...]:
    """The default against each baseline; None where the blocks cannot tell.

    Args:
        where: what was judged on.
        found: with the default and the baselines.
    """
    made = []
    for other in BASELINES:
        mean, error = found.gains[DEFAULT, other]
        holds = True if mean > 2 * error else False if mean < -2 * error else None
        made.append(Item(
            f"{where}: the default beats {FULL[other]}", None, found.mean(DEFAULT) / found.mean(other), "1", holds,
            f"not in the paper; RMSE over the other's, {found.mean(DEFAULT):.3f} against {found.mean(other):.3f} N m. Gain in "
            f"squared error over blocks of 10 s: {mean:.2g} ± {error:.1g} N² m²; two standard errors count",
        ))  # fmt: skip
    return tuple(made)
