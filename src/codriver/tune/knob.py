"""The knob alone: ell for a requested delay, or the most likely one.

delay(ell) = delay(1) / ell          of slow changes of the jerk (`response.delay`): 0.911/ell s for 2017's noise
log L(ell)                            at the preset's Q and R, the common factor at its best (`likelihood`)
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, log

import numpy as np

from codriver.errors import DesignError, UsageError
from codriver.observers.response import delay
from codriver.observers.scaled_gain import ELL_RANGE, Preset, design_scaled_gain
from codriver.signals.signal import Array
from codriver.tune.likelihood import LEAST_BLOCKS, Evidence, Likelihood

GRID = (0.25, 24.0, 27)  # ells of the profile: from, to, number
_STEP = 0.02  # of log ell, for slope and curvature


@dataclass(frozen=True, eq=False)
class KnobProfile:
    """The likelihood along the knob.

    Attributes:
        ell, log_likelihood: the profile, shape (n,); NaN where there is no filter.
        best: the most likely ell.
        spread: standard error of its logarithm, from curvature and blocks (see `noise`); infinite at the grid's end, and
            with too few blocks.
        found: the evidence there.
    """

    ell: Array
    log_likelihood: Array
    best: float
    spread: float
    found: Evidence


def ell_for_delay(preset: Preset, wanted: float) -> float:
    """The knob at which slow changes of the jerk are `wanted` seconds late.

    Raises:
        UsageError: no ell in range has that delay.
    """
    unit = delay(design_scaled_gain(preset, 0.01, 1.0))
    if not unit / ELL_RANGE[1] <= wanted <= unit / ELL_RANGE[0]:
        raise UsageError(
            f"a delay of {wanted:g} s", f"{unit / ELL_RANGE[1]:.2g} to {unit / ELL_RANGE[0]:.2g} s for this noise",
            "0.3 to 1 s is usual",
        )  # fmt: skip
    return unit / wanted


def likely_ell(likelihood: Likelihood, preset: Preset) -> KnobProfile:
    """The likelihood along ell, and its peak.

    Raises:
        DesignError: no ell of the grid gives a filter.
    """
    from scipy.optimize import minimize_scalar

    def height(ell: float) -> float:
        try:
            return likelihood.at(preset, ell).log_likelihood
        except DesignError:
            return float("nan")

    ells = np.geomspace(*GRID)
    heights = np.array([height(float(ell)) for ell in ells])
    if not np.isfinite(heights).any():
        raise DesignError(
            f"Q = {preset.Q}, R = {preset.R} give no filter for any ell", "a noise with a filter", "choose a preset"
        )
    top = int(np.nanargmax(heights))
    low, high = (float(ells[min(max(k, 0), ells.size - 1)]) for k in (top - 1, top + 1))
    search = minimize_scalar(lambda t: -height(exp(t)), bounds=(log(low), log(high)), method="bounded")
    best = exp(float(search.x)) if -float(search.fun) > heights[top] else float(ells[top])
    found = likelihood.at(preset, best)
    return KnobProfile(ells, heights, best, _spread(likelihood, preset, best, found), found)


def _spread(likelihood: Likelihood, preset: Preset, best: float, found: Evidence) -> float:
    """Standard error of log ell."""
    if likelihood.blocks < LEAST_BLOCKS:
        return float("inf")
    try:
        up, down = (likelihood.at(preset, best * exp(sign * _STEP)) for sign in (1, -1))
    except DesignError:
        return float("inf")
    curve = 2 * found.log_likelihood - up.log_likelihood - down.log_likelihood
    if curve <= 0:
        return float("inf")
    slopes = (up.blocks - down.blocks) / (2 * _STEP)
    return float(np.sqrt(np.sum(slopes**2)) / (curve / _STEP**2))
