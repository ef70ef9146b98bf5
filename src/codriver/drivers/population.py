"""A scale of a reference population: what its drivers do, and where smooth ends and aggressive begins.

With the class of each drive given (`kinds`), over drives i of drivers k,

    m = mean over k of mean over i of x,        d = (mean of the aggressive - mean of the smooth) / 2,
    s^2 = mean over k of the variance over i of x,

and a threshold lies half-way between the two neighbouring drivers of neighbouring classes. The drives of one driver should be on
different roads, for s is what the road does to x. Nobody knows the classes of a fleet: without `kinds`, d = s = the
standard deviation of all drives, the score is then the mean of the standardised features, and thresholds are its
terciles, so that by definition a third of the reference is smooth and a third aggressive.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from codriver.drivers.scale import BAND_SECONDS, CLASSES, Scale, features_of, scores
from codriver.drivers.style import SETTINGS, DriverStyle
from codriver.errors import UsageError
from codriver.signals.signal import Array

FEWEST = 6


def make_scale(styles: Sequence[DriverStyle], name: str, source: str, *, kinds: Sequence[str] | None = None) -> Scale:
    """A scale of a reference population.

    Args:
        styles: the drivers; with `kinds` several drives of each name.
        name, source: what it is made of.
        kinds: the class of each style, by which steps and thresholds are set; None takes spread and terciles of all.

    Raises:
        UsageError: too few styles (six; two of each name), or styles that do not compare.
    """
    _check_population(styles, kinds)
    rows = [features_of(style.sums.sum(axis=0, keepdims=True)) for style in styles]
    x, t = np.concatenate([row[0] for row in rows]), np.concatenate([row[1] for row in rows])
    counted = t >= BAND_SECONDS
    seconds = np.where(counted.any(axis=0), (t * counted).sum(axis=0) / np.maximum(counted.sum(axis=0), 1), 0.0)
    mean, step, scatter = _spread(x) if kinds is None else _between(x, [s.name for s in styles], list(kinds))
    first = styles[0]
    settings = {k: first.settings[k] for k in SETTINGS if k in first.settings}
    draft = Scale(name, source, first.observer, settings, mean, step, scatter, seconds, (0, 0), (0, 0), len(styles))
    bounds = []
    for pedal in (True, False):
        score = np.array([scores(draft, s.sums.sum(axis=0, keepdims=True), pedal=pedal)[0][0] for s in styles])
        bounds.append(_thresholds(score, [s.name for s in styles], kinds))
    return replace(draft, thresholds=bounds[0], without_pedal=bounds[1])


def _check_population(styles: Sequence[DriverStyle], kinds: Sequence[str] | None) -> None:
    if len(styles) < FEWEST:
        raise UsageError(
            f"a scale of {len(styles)} drivers", f"{FEWEST} at least, better 20", "add logs of more drivers"
        )
    for other in styles[1:]:
        if other.observer != styles[0].observer or other.ell != styles[0].ell:
            raise UsageError(
                f"{styles[0].observer}, ell {styles[0].ell} and {other.observer}, ell {other.ell} in one scale",
                "one estimator and one ell", "estimate all logs alike",
            )  # fmt: skip
    if kinds is not None and (len(kinds) != len(styles) or set(kinds) != set(CLASSES)):
        raise UsageError(
            f"classes {', '.join(sorted(set(kinds)))} for {len(styles)} styles",
            f"one of {', '.join(CLASSES)} for each style, and each of them", "leave kinds out, or correct them",
        )  # fmt: skip


def _spread(x: Array) -> tuple[Array, Array, Array]:
    """Mean and standard deviation (as step and as scatter) of features, shape (bands, features); NaN of fewer than 4."""
    enough = np.isfinite(x).sum(axis=0) >= 4
    padded = np.where(enough[None], x, 0.0)
    mean = np.where(enough, np.nanmean(padded, axis=0), np.nan)
    sd = np.where(enough, np.nanstd(padded, axis=0, ddof=1), np.nan)
    sd = np.where(sd > 1e-6, sd, np.nan)
    return mean, sd, sd


def _between(x: Array, names: list[str], kinds: list[str]) -> tuple[Array, Array, Array]:
    """Mean over names, half the way from smooth to aggressive, and scatter within names, shape (bands, features)."""
    means: dict[str, list[Array]] = {kind: [] for kind in CLASSES}
    variances = []
    for name in dict.fromkeys(names):
        mine = np.array([n == name for n in names])
        drives = x[mine]
        if (np.isfinite(drives).sum(axis=0) < 2).any():
            raise UsageError(
                f"'{name}' has fewer than 2 drives with every band and feature", "2 at least, better 10", "add drives"
            )
        means[kinds[int(np.flatnonzero(mine)[0])]].append(np.nanmean(drives, axis=0))
        variances.append(np.nanvar(drives, axis=0, ddof=1))
    smooth, _, aggressive = (np.mean(means[kind], axis=0) for kind in CLASSES)
    mean = np.mean([m for kind in CLASSES for m in means[kind]], axis=0)
    return mean, 0.5 * (aggressive - smooth), np.sqrt(np.mean(variances, axis=0))


def _thresholds(score: Array, names: list[str], kinds: Sequence[str] | None) -> tuple[float, float]:
    if kinds is None:
        low, high = np.nanquantile(score, [1 / 3, 2 / 3])
        return float(low), float(high)
    of_name = {n: float(np.nanmean([s for s, m in zip(score, names, strict=True) if m == n])) for n in names}
    by_kind = {kind: [of_name[n] for n, k in zip(names, kinds, strict=True) if k == kind] for kind in CLASSES}
    low = 0.5 * (max(by_kind["smooth"]) + min(by_kind["intermediate"]))
    high = 0.5 * (max(by_kind["intermediate"]) + min(by_kind["aggressive"]))
    if low >= high:
        raise UsageError(
            f"smooth ends at a score of {low:.2f} and aggressive begins at {high:.2f}",
            "drivers whose classes are in order", "correct the classes, or leave kinds out",
        )  # fmt: skip
    return low, high
