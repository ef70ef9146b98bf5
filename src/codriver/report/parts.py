"""What panels are made of: lines and bands on the ticks, in display units, before anyone draws them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from codriver.signals.signal import Array

BAND = "rgba(0,114,178,0.22)"


@dataclass(frozen=True)
class Line:
    """One curve: its name in the legend, its values on the ticks in display units (NaN: a gap), and its looks."""

    name: str
    values: Array
    color: str
    width: float = 1.4
    dash: str = "solid"
    steps: bool = False
    right: bool = False  # belongs to the right axis
    legend: bool = True
    reference: bool = False  # the axis is not fitted to it: true values may be wild where no estimator can follow


@dataclass(frozen=True)
class Band:
    """A band between two curves."""

    name: str
    low: Array
    high: Array
    color: str = BAND


@dataclass(frozen=True)
class Panel:
    """One plot of the stack.

    Attributes:
        title: above the plot, with the unit.
        unit: at the left axis.
        height: pixels.
        items: what is drawn, the lowest first.
        fit: mask of the ticks to which the axis is fitted.
        right_unit: at the right axis; empty if there is none.
        guides: dotted horizontal lines.
        whole: ticks of the axis at whole numbers only.
    """

    title: str
    unit: str
    height: int
    items: tuple[Line | Band, ...]
    fit: npt.NDArray[np.bool_] = field(repr=False)
    right_unit: str = ""
    guides: tuple[float, ...] = (0.0,)
    whole: bool = False
