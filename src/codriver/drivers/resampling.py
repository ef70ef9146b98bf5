"""Intervals that know that neighbouring samples say the same: the block bootstrap.

A jerk estimate at 100 Hz holds some two independent numbers a second, a drive some two manoeuvres a minute. So not samples
are drawn again but blocks of B = 30 s of valid driving, with replacement, as many as there are (Künsch 1989,
doi:10.1214/aos/1176347265; blocks that do not overlap: Carlstein 1986, doi:10.1214/aos/1176350057). Every statistic here is a
function of sums over blocks, so a replicate is a product of weights (how often each block was drawn) with the sums:

    statistic*_r = f(W_r S),      W of shape (replicates, blocks), rows multinomial,      S of shape (blocks, sums).

A quantile is f of a histogram. Intervals are the quantiles of the replicates about the statistic, widened by
t_{0.975, n-1} / 1.96 sqrt(n / (n - 1)) for n blocks, since few blocks vary too little. With fewer than FEWEST blocks there
is no interval.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from codriver.signals.signal import Array

BLOCK = 30.0  # s
FEWEST = 5
REPLICATES = 600
LEVEL = 0.95
_BINS = 3000


@dataclass(frozen=True)
class Interval:
    """A number with its 95 % interval; `low` and `high` are None where there is too little to say."""

    value: float
    low: float | None = None
    high: float | None = None

    @property
    def known(self) -> bool:
        """Whether there is an interval."""
        return self.low is not None and self.high is not None


def draws(blocks: int, seed: int = 0, replicates: int = REPLICATES) -> Array:
    """How often each block is drawn in each replicate, shape (replicates, blocks); the same for the same seed."""
    random = np.random.default_rng([seed, blocks])
    return random.multinomial(blocks, np.full(blocks, 1.0 / blocks), replicates).astype(float)


def interval(statistic: Callable[[Array], Array], sums: Array, weights: Array | None = None) -> Interval:
    """A statistic of sums over blocks, with its interval.

    Args:
        statistic: of total sums, shape (m, k), one number each, not negative, shape (m,); NaN where it is not defined.
        sums: over the blocks, shape (blocks, k).
        weights: from `draws`.
    """
    blocks = sums.shape[0]
    value = float(statistic(sums.sum(axis=0, keepdims=True))[0])
    if blocks < FEWEST or not np.isfinite(value):
        return Interval(value)
    again = statistic((draws(blocks) if weights is None else weights) @ sums)
    if value <= 0:
        return Interval(value, *around(value, again, blocks))
    # A positive number is widened by a factor, so that its interval stays positive.
    low, high = around(0.0, np.log(np.maximum(again, 1e-9 * value) / value), blocks)
    if low is None or high is None:
        return Interval(value)
    return Interval(value, float(value * np.exp(low)), float(value * np.exp(high)))


def around(value: float, again: Array, blocks: int) -> tuple[float | None, float | None]:
    """The interval of the replicates `again`, shape (m,), widened for few blocks about the value."""
    finite = again[np.isfinite(again)]
    if finite.size < 0.5 * again.size:
        return None, None
    low, high = np.quantile(finite, [0.5 - LEVEL / 2, 0.5 + LEVEL / 2])
    wider = widening(blocks)
    return float(value - wider * max(value - low, 0.0)), float(value + wider * max(high - value, 0.0))


def widening(blocks: int) -> float:
    """Factor for the small number of blocks: Student's t over the normal's quantile, and the bias of the variance."""
    from scipy.stats import norm, t

    tail = 0.5 + LEVEL / 2
    return float(t.ppf(tail, blocks - 1) / norm.ppf(tail) * np.sqrt(blocks / (blocks - 1)))


def quantile_intervals(values: Array, block: Array, probabilities: tuple[float, ...]) -> dict[float, Interval]:
    """Quantiles of values with their intervals.

    Args:
        values: shape (n,).
        block: index of the block of each value, from 0 on, shape (n,).
        probabilities: 0 to 1.
    """
    if not values.size:
        return {}
    low, high = float(values.min()), float(values.max())
    if high <= low:
        return {p: Interval(low, low, low) for p in probabilities}
    edges = np.linspace(low, high, _BINS + 1)
    bins = np.minimum(((values - low) / (high - low) * _BINS).astype(int), _BINS - 1)
    blocks = int(block.max()) + 1
    histogram = np.bincount(block * _BINS + bins, minlength=blocks * _BINS).reshape(blocks, _BINS).astype(float)
    exact = np.quantile(values, probabilities)
    if blocks < FEWEST:
        return {p: Interval(float(q)) for p, q in zip(probabilities, exact, strict=True)}
    cumulated = np.cumsum(draws(blocks) @ histogram, axis=1)
    found = {}
    for p, q in zip(probabilities, exact, strict=True):
        at = (cumulated < p * cumulated[:, -1:]).sum(axis=1)
        again = 0.5 * (edges[np.minimum(at, _BINS - 1)] + edges[np.minimum(at + 1, _BINS)])
        found[p] = Interval(float(q), *around(float(q), again, blocks))
    return found


def block_index(ticks: int, dt: float, seconds: float = BLOCK) -> Array:
    """Block of each of so many valid ticks, shape (ticks,): as many whole blocks as fit, all of about the same length."""
    blocks = max(1, int(ticks * dt / seconds + 0.5))
    return np.minimum((np.arange(ticks) * blocks) // max(ticks, 1), blocks - 1)
