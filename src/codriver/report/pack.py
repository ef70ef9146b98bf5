"""Columns of numbers made small enough for a page, without losing what one sees.

A column of n ticks is kept whole up to MOST points. Beyond, it is cut into buckets and each bucket keeps its least and
its greatest value, in the order in which they came, so that no extreme is lost; bounds of a band keep the one that
makes the band wider. The page thins out again for what is in view, so zooming in shows the kept points one by one.

The numbers are rounded to a step that is 10^-4 of their usual spread, differences are taken, and the four bytes of each
difference are stored apart from each other: what then remains for gzip are long runs of zeros. `plots.js` undoes this.
"""

from __future__ import annotations

import base64
import gzip
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from codriver.signals.signal import Array

MOST = 120_000  # points kept of a column
_MISSING = -(2**31)  # stands for NaN


@dataclass
class Pack:
    """Columns on one clock, to be stored in a page.

    Attributes:
        start, dt: of the clock, s.
        columns: where each column lies and how it is read; for the page.
    """

    start: float
    dt: float
    columns: list[dict[str, Any]] = field(default_factory=list)
    _coded: list[npt.NDArray[np.uint32]] = field(default_factory=list, repr=False)

    def add(self, values: Array, keep: str = "extremes") -> int:
        """Store a column and give its number.

        Args:
            values: on the clock, NaN where there is nothing.
            keep: "extremes", or for the bounds of a band "low" or "high".
        """
        kept, size = thin_out(values, keep)
        # The two points of a bucket are drawn at a quarter and three quarters of it, a single one in its middle.
        dx = self.dt * (size / 2 if keep == "extremes" and size > 1 else size)
        first = self.start + (dx / 2 - self.dt / 2 if size > 1 else 0.0)
        coded, base, step = _code(kept)
        self._coded.append(coded)
        self.columns.append({"n": kept.size, "x0": first, "dx": dx, "size": size, "base": base, "step": step})
        return len(self.columns) - 1

    @property
    def bucket(self) -> float:
        """Longest time for which a column keeps its extremes only, s; the tick if no column lost points."""
        return max((column["size"] * self.dt for column in self.columns), default=self.dt)

    def text(self) -> str:
        """All columns, as base64 of gzip."""
        coded = np.concatenate(self._coded) if self._coded else np.zeros(0, np.uint32)
        planes = coded.astype("<u4").view(np.uint8).reshape(-1, 4).T
        return packed(planes.tobytes())


def packed(data: bytes) -> str:
    """Bytes as base64 of gzip; the same bytes give the same text."""
    return base64.b64encode(gzip.compress(data, 6, mtime=0)).decode("ascii")


def thin_out(values: Array, keep: str = "extremes") -> tuple[Array, int]:
    """Values thinned out to at most MOST points, and the size of the buckets (1: nothing was done)."""
    if values.size <= MOST:
        return values, 1
    size = -(-2 * values.size // MOST)
    padded = np.full(-(-values.size // size) * size, np.nan)
    padded[: values.size] = values
    table = padded.reshape(-1, size)
    empty = ~np.isfinite(table).any(axis=1)
    low_at = np.argmin(np.where(np.isfinite(table), table, np.inf), axis=1)
    high_at = np.argmax(np.where(np.isfinite(table), table, -np.inf), axis=1)
    rows = np.arange(table.shape[0])
    low = np.where(empty, np.nan, table[rows, low_at])
    high = np.where(empty, np.nan, table[rows, high_at])
    if keep == "low":
        return low, size
    if keep == "high":
        return high, size
    rising = low_at <= high_at
    return np.stack([np.where(rising, low, high), np.where(rising, high, low)], axis=1).ravel(), size


def _code(values: Array) -> tuple[npt.NDArray[np.uint32], float, float]:
    """Differences of the rounded values (0, -1, 1, -2, … as 0, 1, 2, 3, …), the base and the step."""
    finite = values[np.isfinite(values)]
    base, step = 0.0, 1.0
    if finite.size:
        low, high = float(finite.min()), float(finite.max())
        spread = float(np.subtract(*np.percentile(finite, [95, 5])))
        whole = high - low < 2**20 and bool(np.all(finite == np.round(finite)))
        base = low
        if high > low and not whole:
            # Of the usual spread, so that one wild value does not coarsen the rest; of the span, so that 31 bits do.
            step = max(1e-4 * spread if spread > 0 else (high - low) / 3e4, (high - low) / 2**30)
    rounded = np.full(values.size, _MISSING, dtype=np.int64)
    there = np.isfinite(values)
    rounded[there] = np.round((values[there] - base) / step).astype(np.int64)
    change = np.diff(rounded, prepend=0).astype(np.int32)  # wraps around, as the page's sum does
    return ((change.astype(np.int64) << 1) ^ (change.astype(np.int64) >> 31)).astype(np.uint32), base, step
