"""The mean of several sources, such as two wheels, on the clock of the first.

At a stamp of the first source, where that has a number, the mean is that of its value and of each other source's newest
finite value, as long as that is no older than the quantity's hold time. A source that is silent for longer counts as
missing, so a dead sensor does not pull the mean for ever. `codriver.live.can_bus` does the same, frame by frame.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from codriver.logs.mend import named
from codriver.names import VOCABULARY
from codriver.signals import Signal


def mean_of(parts: Sequence[Signal]) -> tuple[Signal, list[str]]:
    """The mean of signals of one name, and a sentence for each that is missing for longer than its hold time.

    Args:
        parts: at least one; stamps increasing. A part without a number is missing throughout.
    """
    first = parts[0]
    source = " + ".join(part.source for part in parts)
    hold = VOCABULARY[first.name].hold
    total, count = first.values.copy(), np.ones(first.time.size)
    sentences = []
    for part in parts[1:]:
        finite = np.isfinite(part.values)
        stamps, values = part.time[finite], part.values[finite]
        index = np.searchsorted(stamps, first.time, side="right") - 1
        alive = np.zeros(first.time.size, bool)
        if stamps.size:
            newest = np.maximum(index, 0)
            alive = (index >= 0) & (first.time - stamps[newest] <= hold)
            total[alive] += values[newest[alive]]
            count[alive] += 1
        spans = [(start, stop) for start, stop in _spans(first, stamps, alive, index) if stop - start > hold]
        if spans:
            start, stop = max(spans, key=lambda span: span[1] - span[0])
            times = "" if len(spans) == 1 else f" {len(spans)} times, the longest"
            sentences.append(
                f"{named(first.name, part.source)}: silent{times} from {start:.2f} to {stop:.2f} s; the mean is taken without it"
            )
    return Signal(first.name, first.time, total / count, first.unit, source), sentences


def _spans(first: Signal, stamps: np.ndarray, alive: np.ndarray, index: np.ndarray) -> list[tuple[float, float]]:
    """From the last value to the next one, for each stretch of the first signal's stamps where another is missing."""
    if not first.time.size:
        return []
    edges = np.flatnonzero(np.diff(np.concatenate([[False], ~alive, [False]]).astype(np.int8)))
    begin, end = float(first.time[0]), float(first.time[-1])
    spans = []
    for start in edges[::2]:
        last = int(index[start])
        spans.append(
            (
                float(stamps[last]) if last >= 0 else begin,
                float(stamps[last + 1]) if last + 1 < stamps.size else end,
            )
        )
    return spans
