"""Holes in the signals of a driver's drive: stretches of more than LONGEST_HOLE without a number."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from codriver.signals.signal import Array

LONGEST_HOLE = 0.5  # s


@dataclass(frozen=True)
class Hole:
    """A stretch without a number of one signal.

    Attributes:
        signal: its name.
        start, stop: the numbers before and after it, s.
    """

    signal: str
    start: float
    stop: float


def covered(stamps: Mapping[str, Array]) -> tuple[float, float]:
    """The stretch that all signals cover, s.

    Args:
        stamps: of the samples that are numbers, s, rising, shape (n,), n at least 1.
    """
    return float(max(t[0] for t in stamps.values())), float(min(t[-1] for t in stamps.values()))


def holes_of(stamps: Mapping[str, Array]) -> tuple[Hole, ...]:
    """Holes within what all signals cover, by signal; argument as for `covered`."""
    start, end = covered(stamps)
    found = []
    for name, t in stamps.items():
        wide = np.flatnonzero(np.diff(t) > LONGEST_HOLE)
        found += [Hole(name, float(t[k]), float(t[k + 1])) for k in wide if t[k] < end and t[k + 1] > start]
    return tuple(found)


def between(holes: Sequence[Hole], whole: tuple[float, float]) -> list[tuple[float, float]]:
    """Stretches of a whole in which no signal has a hole, s."""
    found = []
    start, end = whole
    for hole in sorted(holes, key=lambda h: h.start):
        if hole.start > start:
            found.append((start, min(hole.start, end)))
        start = max(start, hole.stop)
    return [*found, (start, end)] if end > start else found


def holes_told(holes: Sequence[Hole]) -> str:
    """Which signals have how many holes, and where the longest is, in words; signals with the same holes together."""
    alike: dict[tuple[tuple[float, float], ...], list[str]] = {}
    for name in dict.fromkeys(h.signal for h in holes):
        spans = tuple((round(h.start, 1), round(h.stop, 1)) for h in holes if h.signal == name)
        alike.setdefault(spans, []).append(name)
    said = []
    for spans, names in alike.items():
        start, stop = max(spans, key=lambda span: span[1] - span[0])
        has = f"{', '.join(names)} {'has' if len(names) == 1 else 'have'}"
        count = f"{has} a hole of" if len(spans) == 1 else f"{has} {len(spans)} holes, the longest"
        said.append(f"{count} {stop - start:.1f} s at {start:.1f} s")
    return "; ".join(said)
