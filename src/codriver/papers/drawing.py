"""Pieces of figures that the jerk papers share: windows of a drive, shaded stretches, curves in display units."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from codriver.estimate import Estimate
from codriver.report.document import BLACK, GREY, Curve, Span
from codriver.report.shown import shown
from codriver.signals import Log
from codriver.signals.grid import Flags
from codriver.signals.signal import Array
from codriver.simulate.judge import at

S = TypeVar("S", bound=np.generic)
GREEN, BLUE, RED, TURQUOISE, PURPLE = "#007A5A", "#0072B2", "#C84C00", "#2AA9B8", "#8E2F86"
# The paper's colours of the knob: figure 4 draws 3, 2, 1 in green, blue and red.
ELL_COLORS = {3.0: GREEN, 2.0: BLUE, 1.0: RED}


@dataclass(frozen=True)
class Window:
    """A part of a drive's ticks: indices first to last, last not included."""

    first: int
    last: int

    def __call__(self, values: npt.NDArray[S]) -> npt.NDArray[S]:
        """That part of a column."""
        return values[self.first : self.last]


def window_in(estimate: Estimate, truth: Log, start: float, stop: float) -> Window:
    """The ticks from where a drive passes `start` to where it passes `stop`, m along the road."""
    distance = np.maximum.accumulate(at(truth, "distance", estimate.time))
    return Window(int(np.searchsorted(distance, start)), int(np.searchsorted(distance, stop)))


def window_between(estimate: Estimate, start: float, stop: float) -> Window:
    """The ticks from `start` to `stop`, s."""
    return Window(int(np.searchsorted(estimate.time, start)), int(np.searchsorted(estimate.time, stop)))


def curve(name: str, estimate: Estimate, output: str, part: Window, color: str = "", width: float = 1.6) -> Curve:
    """An output of an estimate, in its display unit, over time; a gap where it is not valid."""
    values = np.where(part(estimate.valid), shown(output, part(estimate.columns[output])), np.nan)
    return Curve(name, part(estimate.time), values, color, width=width)


def measured(name: str, log: Log, signal: str, start: float, stop: float, color: str = GREY, **looks: object) -> Curve:
    """A signal of the log in its display unit, over time."""
    piece = log[signal].between(start, stop)
    return Curve(name, piece.time, shown(signal, piece.values), color, width=1.0, **looks)  # type: ignore[arg-type]


def true_curve(name: str, estimate: Estimate, truth: Log, signal: str, part: Window) -> Curve:
    """A signal of the truth on the estimate's ticks, dotted."""
    time = part(estimate.time)
    return Curve(name, time, shown(signal, at(truth, signal, time)), BLACK, dash="dot", width=1.2)


def stretches(mask: Flags, x: Array, kind: str) -> list[Span]:
    """Where a mask is set, as spans of x (time or distance)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    last = x.size - 1
    return [Span(float(x[a]), float(x[min(b, last)]), kind) for a, b in edges.reshape(-1, 2)]


def shades(estimate: Estimate, part: Window, x: Array | None = None) -> tuple[Span, ...]:
    """Braking in pink and gear shifts in blue, as the papers shade them; over time, or over x (on the window's ticks)."""
    over = part(estimate.time) if x is None else x
    return tuple(
        span
        for kind in ("braking", "gear_shift")
        for span in stretches(part(estimate.flag(kind)).astype(bool), over, kind)
    )
