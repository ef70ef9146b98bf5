"""Whether drivers of one road find the same slope.

The 2017 paper (section IV-D, figure 7) takes it as a sign of reliability that the slopes estimated from six drives coincide
over the curvilinear coordinate. In per cent

    100 tan(o_a / g)                                                          (2017, caption of figure 7)

with o_a the estimated accelerometer offset. Two drivers agree by the root mean square of their difference over s, by the same
with each one's mean taken out (an accelerometer's bias is no slope), and by the correlation. The correlation also tells
roads apart: drives of one hilly road have it near 1, drives of two roads near 0.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from codriver.signals.signal import Array

GRAVITY = 9.80665  # m/s^2
FLAT = 0.4  # standard deviation of a slope, in per cent, below which there is nothing to compare
LEAST = 500.0  # m that two drives must share


@dataclass(frozen=True)
class Pair:
    """Two slopes over s.

    Attributes:
        names: whose.
        metres: of road in both.
        rms: root mean square of the difference, per cent of slope.
        rms_centred: the same, each mean taken out.
        correlation: None where one is flat.
    """

    names: tuple[str, str]
    metres: float
    rms: float
    rms_centred: float
    correlation: float | None


@dataclass(frozen=True)
class Agreement:
    """How far slopes agree.

    Attributes:
        pairs: of drivers.
        against_truth: of each driver and the true slope, where it is given.
        spread: rms over s of the standard deviation between drivers, means taken out, per cent; None for one driver.
    """

    pairs: tuple[Pair, ...]
    against_truth: tuple[Pair, ...]
    spread: float | None


def slope_percent(offset: Array) -> Array:
    """The slope in per cent of an accelerometer offset (m/s^2), shape of `offset`."""
    return np.asarray(100.0 * np.tan(np.clip(offset / GRAVITY, -1.0, 1.0)))


def slope_agreement(slopes: Mapping[str, Array], step: float, truth: Array | None = None) -> Agreement:
    """How far slopes over the same places agree.

    Args:
        slopes: by driver, per cent, shape (n,), NaN where a driver has none.
        step: between places, m.
        truth: the true slope, per cent, shape (n,).
    """
    pairs = [pair(a, b, slopes[a], slopes[b], step) for a, b in combinations(slopes, 2)]
    against = [] if truth is None else [pair(name, "truth", slopes[name], truth, step) for name in slopes]
    return Agreement(
        tuple(p for p in pairs if p is not None), tuple(p for p in against if p is not None), _spread(slopes)
    )


def pair(a: str, b: str, first: Array, second: Array, step: float) -> Pair | None:
    """Two slopes over the same places, per cent, shape (n,); None where they share less than LEAST metres."""
    both = np.isfinite(first) & np.isfinite(second)
    metres = float(both.sum()) * step
    if metres < LEAST:
        return None
    x, y = first[both], second[both]
    difference = x - y
    flat = min(float(x.std()), float(y.std())) < FLAT
    return Pair(
        (a, b), metres, float(np.sqrt(np.mean(difference**2))), float(difference.std()),
        None if flat else float(np.corrcoef(x, y)[0, 1]),
    )  # fmt: skip


def _spread(slopes: Mapping[str, Array]) -> float | None:
    """See `Agreement.spread`, over the places all have."""
    if len(slopes) < 2:
        return None
    table = np.stack(list(slopes.values()))
    table = table[:, np.isfinite(table).all(axis=0)]
    if not table.shape[1]:
        return None
    centred = table - table.mean(axis=1, keepdims=True)
    return float(np.sqrt(np.mean(centred.var(axis=0, ddof=1))))
