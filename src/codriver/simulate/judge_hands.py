"""A probability of hands on, held against what was true.

    log loss = -mean(ln p where on, ln(1 - p) where off)          Brier = mean (p - on)^2
    calibration error = mean over ticks of |p - share of hands on|, both as means of the tick's bin of p

A calibrated probability has an error of 0: of the moments with p = 0.7, hands are on in 70 %. That alone is no merit, for the
constant long-run share has it too; log loss and Brier score also ask that p tells the moments apart.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from codriver.signals.grid import Flags
from codriver.signals.signal import Array

EDGES = tuple(k / 10 for k in range(11))
LEAST = 1e-9  # of p and 1 - p within the logarithm
TOLD = 0.5  # above it, hands are said to be on


@dataclass(frozen=True)
class Bin:
    """A row of the reliability table: of the ticks with p from `low` to `high`.

    Attributes:
        low, high: bounds of p.
        share: of all ticks.
        said: mean p; NaN where there are none.
        found: share of hands on; NaN where there are none.
    """

    low: float
    high: float
    share: float
    said: float
    found: float


@dataclass(frozen=True)
class HandsJudged:
    """How good the probability was.

    Attributes:
        log_loss, brier, calibration_error: see the module's docstring.
        bins: the reliability table.
        on_delay, off_delay: median time until p passes 0.5 after hands come on, and go off, s; infinite if most never told.
        on_missed, off_missed: share of the changes that were over before p passed 0.5.
        false_alarms: times p rose above 0.5 with hands off, per hour of hands off.
    """

    log_loss: float
    brier: float
    calibration_error: float
    bins: tuple[Bin, ...]
    on_delay: float
    off_delay: float
    on_missed: float
    off_missed: float
    false_alarms: float


def judge_hands(probability: Array, hands_on: Array, dt: float) -> HandsJudged:
    """Hold probabilities against the truth.

    Args:
        probability: of hands on, shape (drives, n).
        hands_on: 1 or 0, shape (drives, n).
        dt: tick, s.
    """
    p, on = np.atleast_2d(probability), np.atleast_2d(hands_on) > 0
    right = np.where(on, p, 1 - p)
    place = np.minimum((p * 10).astype(int), 9)
    bins = tuple(_bin(k, place == k, p, on) for k in range(10))
    told = p > TOLD
    came, went = _delays(on, told, dt), _delays(~on, ~told, dt)
    risen = told[:, 1:] & ~told[:, :-1] & ~on[:, 1:]
    return HandsJudged(
        log_loss=float(-np.log(np.maximum(right, LEAST)).mean()),
        brier=float(((p - on) ** 2).mean()),
        calibration_error=sum(b.share * abs(b.said - b.found) for b in bins if b.share),
        bins=bins,
        on_delay=_median(came), off_delay=_median(went), on_missed=_missed(came), off_missed=_missed(went),
        false_alarms=float(risen.sum() / max((~on).sum() * dt / 3600, LEAST)),
    )  # fmt: skip


def _bin(k: int, there: Flags, p: Array, on: Flags) -> Bin:
    """The row of the table for these ticks."""
    if not there.any():
        return Bin(EDGES[k], EDGES[k + 1], 0.0, float("nan"), float("nan"))
    return Bin(EDGES[k], EDGES[k + 1], float(there.mean()), float(p[there].mean()), float(on[there].mean()))


def _delays(state: Flags, told: Flags, dt: float) -> Array:
    """From each time the state becomes true until it is told, s; infinite where it ends first."""
    found = []
    for is_so, said in zip(state, told, strict=True):
        change = np.flatnonzero(np.diff(is_so.astype(int))) + 1
        ends = [*change[1:], is_so.size]
        for begin, end in zip(change, ends, strict=True):
            if is_so[begin]:
                heard = np.flatnonzero(said[begin:end])
                found.append(heard[0] * dt if heard.size else np.inf)
    return np.array(found)


def _median(delays: Array) -> float:
    """The median; NaN where nothing changed."""
    return float(np.sort(delays)[delays.size // 2]) if delays.size else float("nan")


def _missed(delays: Array) -> float:
    """Share that is infinite; NaN where nothing changed."""
    return float(np.isinf(delays).mean()) if delays.size else float("nan")
