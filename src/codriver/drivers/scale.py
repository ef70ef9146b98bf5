"""A score of driving style, and three classes: smooth, intermediate, aggressive.

Three numbers of a driver in each speed band b, all logarithms so that "twice as much" counts alike everywhere:

    x_1   rms of the intentional jerk                      how much
    x_2   geometric mean of the bursts' peaks              how vigorous each burst
    x_3   reversals of the accelerator pedal per minute    how restless the foot (left out where the log has no pedal)

A scale says for each of them what a reference population does: mean m, step d (half the way from its smooth to its
aggressive drivers) and scatter s (of one driver between roads). If the errors are independent, the place on the line from
smooth (-1) to aggressive (+1) that fits x best is the weighted least squares estimate

    score = sum w d (x - m) / sum w d^2,     w = g / s^2,     g = min(1, t / T),

with t the time in the band and T that of the reference. Numbers that say little about a driver and much about the road
(large s) weigh little. Its standard deviation is the larger of 1 / sqrt(sum w d^2), what the reference says of so much
driving on another road, and that of the block bootstrap, what this log says. The probability of a class is that of a normal
law between its thresholds. "cannot tell" is the class where there is too little driving or no class reaches SURE.

The scale that comes with codriver is made of simulated drivers on simulated roads (docs/styles.md). It says where a driver
stands among these. For what is usual in a fleet, make a scale of that fleet (`population.py`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from codriver.drivers.bands import BANDS
from codriver.drivers.resampling import draws, widening
from codriver.drivers.style import (
    BURSTS,
    JERK_SQUARED,
    LOG_PEAKS,
    PEDAL_SECONDS,
    REVERSALS,
    SECONDS,
    SETTINGS,
    DriverStyle,
)
from codriver.errors import UsageError
from codriver.signals.signal import Array

CLASSES = ("smooth", "intermediate", "aggressive")
FEATURES = ("jerk_rms", "burst_peak", "pedal_reversals")
PEDAL = 2  # index of the feature that needs a pedal
SURE = 0.6  # least probability of a class that is named
LEAST_SECONDS, LEAST_KILOMETRES = 180.0, 2.0  # of valid driving
BAND_SECONDS = 20.0  # least in a band, for it to count
FEW_BURSTS = 3
Class = Literal["smooth", "intermediate", "aggressive", "cannot tell"]


@dataclass(frozen=True)
class Scale:
    """What a reference population does.

    Attributes:
        name, source: what it is made of, in words.
        observer, settings: that estimated it; a driver must have been estimated likewise.
        mean, step, scatter: m, d and s of the module, shape (bands, features); NaN where the reference has nothing.
        seconds: T, shape (bands,).
        thresholds: score from which on a driver is intermediate, and aggressive.
        without_pedal: the same for scores without the pedal.
        drivers: how many logs it is made of.
    """

    name: str
    source: str
    observer: str
    settings: Mapping[str, str]
    mean: Array
    step: Array
    scatter: Array
    seconds: Array
    thresholds: tuple[float, float]
    without_pedal: tuple[float, float]
    drivers: int


@dataclass(frozen=True)
class Rating:
    """Where a driver stands on a scale.

    Attributes:
        score: -1 as the scale's smooth drivers, 1 as its aggressive ones; None where nothing of the driver is on the scale.
        sd: standard deviation of the score on any road.
        low, high: 95 % interval of the score, of this drive alone (block bootstrap); None with too few blocks.
        kind: the class, or "cannot tell".
        probability: of each class; empty without a score. In words never 100 %, see `sure`.
        why: reasons for "cannot tell", and what weakens the class.
    """

    score: float | None
    sd: float | None
    low: float | None
    high: float | None
    kind: Class
    probability: Mapping[str, float]
    why: tuple[str, ...]


def features_of(sums: Array) -> tuple[Array, Array]:
    """Features of sums over blocks.

    Args:
        sums: shape (m, bands + 1, 7), as `DriverStyle.sums` with some blocks added together.

    Returns:
        logarithms, shape (m, bands, features), NaN where there is too little; seconds in each band, shape (m, bands).
    """
    known = sums[:, : len(BANDS)]
    t = known[:, :, SECONDS]
    with np.errstate(divide="ignore", invalid="ignore"):
        rms = 0.5 * np.log(known[:, :, JERK_SQUARED] / t)
        peak = known[:, :, LOG_PEAKS] / known[:, :, BURSTS]
        turns = np.log((known[:, :, REVERSALS] + 1.0) / known[:, :, PEDAL_SECONDS] * 60.0)
    peak = np.where(known[:, :, BURSTS] >= FEW_BURSTS, peak, np.nan)
    turns = np.where(known[:, :, PEDAL_SECONDS] > 0, turns, np.nan)
    found = np.stack([rms, peak, turns], axis=2)
    return np.where((t >= BAND_SECONDS)[:, :, None] & np.isfinite(found), found, np.nan), t


def scores(scale: Scale, sums: Array, *, pedal: bool = True) -> tuple[Array, Array]:
    """Scores of sums over blocks, and what the scale says of their standard deviations, shape (m,) each."""
    x, t = features_of(sums)
    if not pedal:
        x[:, :, PEDAL] = np.nan
    share = np.minimum(1.0, t / np.where(scale.seconds > 0, scale.seconds, np.inf))
    weight = np.where(np.isfinite(x), share[:, :, None] / scale.scatter**2, 0.0)
    weight = np.where(np.isfinite(weight), weight, 0.0)
    step = np.nan_to_num(scale.step)
    above = (weight * step * np.nan_to_num(x - scale.mean)).sum(axis=(1, 2))
    below = (weight * step**2).sum(axis=(1, 2))
    there = below > 0
    score = np.divide(above, below, out=np.full(above.shape, np.nan), where=there)
    return score, np.divide(1.0, np.sqrt(below), out=np.full(above.shape, np.nan), where=there)


def rate_style(style: DriverStyle, scale: Scale) -> Rating:
    """Where a driver stands on a scale; see the module.

    Raises:
        UsageError: the style was estimated otherwise than the scale (estimator, ell, noise).
    """
    refuse_other(style, scale)
    pedal = style.reversals is not None
    score, sd = (float(x[0]) for x in scores(scale, style.sums.sum(axis=0, keepdims=True), pedal=pedal))
    if not np.isfinite(score):
        return Rating(None, None, None, None, "cannot tell", {}, ("no speed band holds enough driving",))
    low = high = None
    blocks = style.sums.shape[0]
    if blocks >= 5:
        again = score_draws(style, scale)
        spread = widening(blocks) * float(np.std(again))
        sd = max(sd, spread)
        low, high = score - 1.96 * spread, score + 1.96 * spread
    bounds = scale.thresholds if pedal else scale.without_pedal
    probability = _probabilities(score, sd, bounds)
    why = _doubts(style)
    likely = max(probability, key=lambda kind: probability[kind])
    enough = not why
    if enough and probability[likely] < SURE:
        why.append(f"no class is likely enough: {likely} has {sure(probability[likely])}")
        enough = False
    if not pedal:
        why.append("without the accelerator pedal, restlessness is not seen and classes are less certain")
    kind: Class = next((c for c in ("smooth", "intermediate", "aggressive") if c == likely), "cannot tell")
    return Rating(score, sd, low, high, kind if enough else "cannot tell", probability, tuple(why))


def sure(probability: float) -> str:
    """A probability as people read it; never 100 %, for the tails of the normal law are the least known."""
    return "> 99 %" if probability > 0.99 else f"{100 * probability:.0f} %"


def score_draws(style: DriverStyle, scale: Scale, seed: int = 0) -> Array:
    """Scores of the block bootstrap, shape (replicates,); those that are not defined are the score itself."""
    pedal = style.reversals is not None
    weights = draws(style.sums.shape[0], seed)
    again, _ = scores(scale, np.tensordot(weights, style.sums, axes=1), pedal=pedal)
    score, _ = scores(scale, style.sums.sum(axis=0, keepdims=True), pedal=pedal)
    return np.where(np.isfinite(again), again, score[0])


def refuse_other(style: DriverStyle, scale: Scale) -> None:
    """A scale measures only what was estimated as it was.

    Raises:
        UsageError: estimator, ell or noise differ.
    """
    differ = [
        f"{key} {style.settings.get(key, 'none')} and {scale.settings.get(key, 'none')}"
        for key in SETTINGS
        if style.settings.get(key) != scale.settings.get(key)
    ]
    if style.observer != scale.observer:
        differ.insert(0, f"{style.observer} and {scale.observer}")
    if differ:
        raise UsageError(
            f"driver '{style.name}' and the scale '{scale.name}' were estimated otherwise: {', '.join(differ)}",
            "the same estimator, ell and noise",
            f"estimate with {scale.observer} and ell {scale.settings.get('ell')}, or make a scale of your own (--write-reference)",
        )


def _probabilities(score: float, sd: float, bounds: tuple[float, float]) -> dict[str, float]:
    from scipy.stats import norm

    below = [float(norm.cdf((bound - score) / sd)) for bound in bounds]
    return dict(zip(CLASSES, (below[0], below[1] - below[0], 1.0 - below[1]), strict=True))


def _doubts(style: DriverStyle) -> list[str]:
    """Why a drive does not allow a class."""
    why = []
    if style.seconds < LEAST_SECONDS:
        why.append(f"{style.seconds:.0f} s of valid driving, {LEAST_SECONDS:.0f} s are needed")
    if style.kilometres < LEAST_KILOMETRES:
        why.append(f"{style.kilometres:.1f} km of valid driving, {LEAST_KILOMETRES:.0f} km are needed")
    if style.bursts.count < FEW_BURSTS:
        why.append(f"{style.bursts.count} bursts, {FEW_BURSTS} are needed")
    return why
