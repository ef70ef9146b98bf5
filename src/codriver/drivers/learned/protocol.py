"""How a learned driver is judged: what is held out, what scaling may see, and which leaks a protocol has.

honest      features of the past and the road ahead; scaling from the training part; whole drives held out, or blocks of one
            drive with a gap on either side
paper2019   features that hold the vehicle's states at the very moment, smoothed with hindsight; scaling from the whole record; four
            quarters without a gap

Okamoto, Tsiotras 2019 (Robotics and Autonomous Systems), section 5.2.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from codriver.drivers.learned.feature_setting import HONEST, PAPER2019, FeatureSetting
from codriver.drivers.learned.features import FeatureTable, Index
from codriver.errors import UsageError


class Fold(NamedTuple):
    """A split: its name, and the rows to learn from and to judge on."""

    name: str
    train: Index
    test: Index


@dataclass(frozen=True)
class Protocol:
    """How to judge.

    Attributes:
        name: for people.
        features: which.
        scaling: "training", or "record": from the rows that are judged too.
        hold_out: "drives"; "blocks", contiguous parts of each drive; "auto": drives where there are several.
        folds: blocks.
        gap: rows so near a judged block are not learnt from, s; the features' own reach is added.
    """

    name: str = "honest"
    features: FeatureSetting = HONEST
    scaling: str = "training"
    hold_out: str = "auto"
    folds: int = 4
    gap: float = 5.0

    def __post_init__(self) -> None:
        if self.scaling not in ("training", "record"):
            raise UsageError(f"scaling '{self.scaling}'", "training or record", "choose one")
        if self.hold_out not in ("auto", "drives", "blocks"):
            raise UsageError(f"hold_out '{self.hold_out}'", "auto, drives or blocks", "choose one")
        if self.folds < 2 or not self.gap >= 0:
            raise UsageError(
                f"{self.folds} folds, a gap of {self.gap:g} s", "2 folds or more, a gap of 0 or more", "choose others"
            )

    @property
    def leaks(self) -> tuple[str, ...]:
        """Why figures under this protocol flatter, one sentence each; empty when they do not."""
        found = list(self.features.leaks)
        if self.scaling == "record":
            found.append("the scaling has seen the rows that are judged")
        if self.gap == 0 and self.hold_out != "drives":
            found.append("no gap between training and judged blocks: rows on either side of an edge share their past")
        return tuple(found)

    def leaks_without(self, left_out: Collection[str]) -> tuple[str, ...]:
        """The leaks on drives that lack some signals."""
        return self.with_features(current=tuple(n for n in self.features.current if n not in left_out)).leaks

    def with_features(self, **changes: object) -> Protocol:
        """The same with other features."""
        return replace(self, features=replace(self.features, **changes))  # type: ignore[arg-type]


PROTOCOLS = {
    "honest": Protocol(),
    "paper2019": Protocol("paper2019", PAPER2019, "record", "blocks", 4, 0.0),
}


def folds_of(table: FeatureTable, protocol: Protocol, names: tuple[str, ...]) -> list[Fold]:
    """The splits of a table.

    Args:
        table: rows of all drives.
        protocol: what is held out.
        names: of the drives.

    Raises:
        UsageError: drives are to be held out and there is one only.
    """
    by_drive = protocol.hold_out == "drives" or (protocol.hold_out == "auto" and len(names) > 1)
    if by_drive and len(names) < 2:
        raise UsageError("one drive, and drives are to be held out", "two drives or more", "use blocks, or add a drive")
    if by_drive:
        rows = [np.flatnonzero(table.drive == k) for k in range(len(names))]
        all_rows = np.arange(len(table))
        return [
            Fold(name, np.setdiff1d(all_rows, mine), mine) for name, mine in zip(names, rows, strict=True) if mine.size
        ]
    return time_blocks(table, protocol.folds, protocol.gap, protocol.features)


def time_blocks(table: FeatureTable, folds: int, gap: float, setting: FeatureSetting) -> list[Fold]:
    """Contiguous blocks in time, block k of every drive together; A is the last, as in the paper.

    Args:
        table: rows.
        folds: how many blocks a drive is cut into.
        gap: s; rows nearer to a judged one, or that share a moment with one, are not learnt from. 0 takes the paper's: none.
        setting: of the features, for their reach.
    """
    reach = gap + (setting.history - 1) * setting.dt + setting.horizon if gap > 0 else 0.0
    first, last = _spans(table)
    place = (table.time - first[table.drive]) / np.maximum(last - first, 1e-9)[table.drive]
    block = np.minimum((place * folds).astype(int), folds - 1)
    found = []
    for number, k in enumerate(reversed(range(folds))):
        test = block == k
        length = (last - first) / folds
        start, stop = (first + k * length)[table.drive], (first + (k + 1) * length)[table.drive]
        near = (table.time > start - reach) & (table.time < stop + reach)
        train = np.flatnonzero(~test & ~near) if reach > 0 else np.flatnonzero(~test)
        if test.any() and train.size:
            found.append(Fold(chr(ord("A") + number), train, np.flatnonzero(test)))
    return found


def _spans(table: FeatureTable) -> tuple[np.ndarray, np.ndarray]:
    """First and last time of each drive."""
    first, last = np.zeros(int(table.drive.max()) + 1), np.zeros(int(table.drive.max()) + 1)
    for drive in np.unique(table.drive):
        time = table.time[table.drive == drive]
        first[drive], last[drive] = time.min(), time.max()
    return first, last
