"""What all benchmarks share: the clock, and the rows of the table."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Timing:
    """The shortest and the longest of several runs, s."""

    best: float
    worst: float

    @property
    def spread(self) -> str:
        """How much longer the longest took."""
        return f"{self.worst / self.best - 1:.0%}"


@dataclass(frozen=True)
class Row:
    """One line of the table.

    Attributes:
        what: what was done.
        ours: our figure, with its unit.
        other: the alternative's figure; "" where there is none.
        ratio: how many times quicker ours is; None where nothing is compared.
        target: what was promised; "" where nothing was.
        met: whether it was reached; None without a target.
        note: how it was measured.
    """

    what: str
    ours: str
    other: str = ""
    ratio: float | None = None
    target: str = ""
    met: bool | None = None
    note: str = ""


def measure(work: Callable[[], Any], times: int = 5, clock: Callable[[], float] = time.perf_counter) -> Timing:
    """Time some work several times.

    Args:
        work: to do.
        times: how often.
        clock: s; `time.process_time` for long work beside other programs, since their time does not count then.
    """
    took = []
    for _ in range(times):
        start = clock()
        work()
        took.append(clock() - start)
    return Timing(min(took), max(took))


def compared(
    what: str, ours: float, name: str, other: float, note: str = "", at_least: float | None = None, spread: str = ""
) -> Row:
    """A row of two times.

    Args:
        what: what was done.
        ours: s.
        name: of the alternative.
        other: its time, s.
        note: how it was measured.
        at_least: the ratio that was promised.
        spread: of our runs.
    """
    ratio = other / ours
    return Row(
        what, duration(ours) + (f" (+{spread})" if spread else ""), f"{name}: {duration(other)}", ratio,
        f"at least {at_least:g}" if at_least is not None else "", ratio >= at_least if at_least is not None else None, note,
    )  # fmt: skip


def duration(seconds: float) -> str:
    """A time in the unit that suits it."""
    for unit, factor in (("s", 1.0), ("ms", 1e3), ("us", 1e6)):
        if seconds * factor >= 1:
            return f"{seconds * factor:.3g} {unit}"
    return f"{seconds * 1e9:.3g} ns"


def say(text: str) -> None:
    """Progress, on standard error."""
    print(text, file=sys.stderr, flush=True)
