"""Q and R by maximum likelihood.

    theta = log of (Q_v, Q_a, Q_o, Q_j, R_v), each over its value in the preset begun with;  R_a stays

What rows can tell and what not:

* The common factor of Q and R leaves the gain as it is; its best value is known (`likelihood`), and R_a stays as the unit.
* ell is no parameter beside a free Q and R: T Q T and diag(1, 1/ell) R diag(1, 1/ell) are again diagonal. So the ell of the
  preset begun with stays, and Q, R are found for it.
* A ratio so small that it adds nothing leaves the likelihood flat. It is told only where log L falls by 2 at least for a
  factor of e to either side, the others held, and where its standard error is below that factor.

Standard errors of theta are those of H^-1 J H^-1 with H the curvature and J from the slopes of blocks of 10 s, since a
driver's innovations lean to one side for a while and curvature alone would take each for news (White 1982,
doi:10.2307/1912526). With fewer than LEAST_BLOCKS blocks there are none, and nothing is told.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import exp, log

import numpy as np

from codriver.errors import DesignError
from codriver.observers.scaled_gain import Preset
from codriver.signals.signal import Array
from codriver.tune.likelihood import LEAST_BLOCKS, Evidence, Likelihood

NAMES = ("Q of the speed", "Q of the acceleration", "Q of the offset", "Q of the jerk", "R of the speed")
FARTHEST = log(1e6)  # no ratio moves farther from the preset begun with
TOLD = 1.0  # of theta: a factor of e
FALL = 2.0  # of log L; two standard deviations of a ratio known from white innovations
_STEP = 0.02  # of theta, for slopes and curvature
_MOST_ITERATIONS = 60
_WORST = 1e3  # in place of the likelihood of a noise that gives no filter, a row


@dataclass(frozen=True)
class Ratio:
    """One ratio of the noise.

    Attributes:
        name: for people.
        start, found: its value begun with and found; R of the accelerometer is the unit of both.
        spread: standard error of its logarithm; infinite where the likelihood is flat.
        told: whether the drives tell it.
    """

    name: str
    start: float
    found: float
    spread: float
    told: bool


@dataclass(frozen=True, eq=False)
class NoiseFit:
    """What maximum likelihood found.

    Attributes:
        preset: the noise; as good as the one begun with at least.
        start, found: the evidence for the preset begun with and for the result.
        ratios: what was free.
        converged: whether the search ended by itself.
        evaluations: of the likelihood.
    """

    preset: Preset
    start: Evidence
    found: Evidence
    ratios: tuple[Ratio, ...]
    converged: bool
    evaluations: int


def fit_noise(
    likelihood: Likelihood, start: Preset, name: str, source: str, first_ell: float | None = None
) -> NoiseFit:
    """The most likely Q and R.

    Args:
        likelihood: of the drives.
        start: the preset to begin with; its ell stays.
        name, source: of the preset made.
        first_ell: where the search begins: the noise that `start` is at this ell. By default its own.

    Raises:
        DesignError: there is no filter for the preset begun with.
    """
    from scipy.optimize import minimize

    calls = 0
    begun = likelihood.at(start, start.ell)

    def evidence(theta: Array) -> Evidence | None:
        nonlocal calls
        calls += 1
        try:
            return likelihood.at(moved(start, theta), start.ell)
        except DesignError:
            return None

    def cost(theta: Array) -> float:
        found = evidence(theta)
        return _WORST if found is None else (begun.log_likelihood - found.log_likelihood) / begun.count

    ratio = (first_ell or start.ell) / start.ell
    first = np.clip(log(ratio) * np.array([0.0, 2.0, 2.0, 4.0, -2.0]), -FARTHEST, FARTHEST)
    limits = [(-FARTHEST, FARTHEST)] * len(NAMES)
    search = minimize(
        cost, first, method="L-BFGS-B", bounds=limits,
        options={"eps": 1e-4, "maxiter": _MOST_ITERATIONS, "ftol": 1e-9, "gtol": 1e-6},
    )  # fmt: skip
    theta, last = np.asarray(search.x, float), evidence(search.x)
    better = last is not None and last.log_likelihood > begun.log_likelihood
    theta, found = (theta, last) if better and last is not None else (np.zeros(len(NAMES)), begun)
    enough = likelihood.blocks >= LEAST_BLOCKS
    spreads = _spreads(evidence, theta, found) if enough else np.full(theta.size, np.inf)
    sides = [[evidence(theta + side) for side in (-TOLD * e, TOLD * e)] for e in np.eye(theta.size)]
    peaked = [all(s is None or s.log_likelihood < found.log_likelihood - FALL for s in pair) for pair in sides]
    ratios = tuple(
        Ratio(
            label, begin, begin * exp(t), float(spread) if falls else np.inf, bool(falls and spread < TOLD)
        )
        for label, begin, t, spread, falls in zip(NAMES, _ratios(start), theta, spreads, peaked, strict=True)
    )  # fmt: skip
    preset = replace(moved(start, theta), name=name, source=source)
    return NoiseFit(preset, begun, found, ratios, bool(search.success and better), calls)


def moved(preset: Preset, theta: Array) -> Preset:
    """A preset whose ratios are exp(theta) times as large."""
    factors = [exp(t) for t in theta]
    q = [value * factor for value, factor in zip(preset.Q, factors[:4], strict=True)]
    return replace(preset, Q=(q[0], q[1], q[2], q[3]), R=(preset.R[0], preset.R[1] * factors[4]), name="own")


def _ratios(preset: Preset) -> list[float]:
    """Q and R of the speed over R of the accelerometer."""
    return [value / preset.R[0] for value in (*preset.Q, preset.R[1])]


def _spreads(evidence: Callable[[Array], Evidence | None], theta: Array, found: Evidence) -> Array:
    """Standard errors of theta, shape (5,); infinite where the likelihood is flat, or the filter fails beside it."""
    n, steps = theta.size, _STEP * np.eye(theta.size)
    up, down = ([evidence(theta + sign * step) for step in steps] for sign in (1, -1))
    spreads = np.full(n, np.inf)
    use = [
        k for k in range(n)
        if up[k] is not None and down[k] is not None and _curve(up[k], found, down[k]) > 1e-9 * found.count * _STEP**2
    ]  # fmt: skip
    if not use:
        return spreads
    slopes = np.array([(up[k].blocks - down[k].blocks) / (2 * _STEP) for k in use])  # type: ignore[union-attr]
    H = np.zeros((len(use), len(use)))
    for a, i in enumerate(use):
        H[a, a] = _curve(up[i], found, down[i]) / _STEP**2
        for b, j in enumerate(use[:a]):
            corner = [evidence(theta + s * (steps[i] + steps[j])) for s in (1, -1)]
            if corner[0] is None or corner[1] is None:
                continue
            both = _curve(corner[0], found, corner[1])
            H[a, b] = H[b, a] = (both - _curve(up[i], found, down[i]) - _curve(up[j], found, down[j])) / (2 * _STEP**2)
    values, vectors = np.linalg.eigh(H)
    if values.min() <= 1e-9 * values.max():
        return spreads
    inverse = vectors @ np.diag(1 / values) @ vectors.T
    spreads[use] = np.sqrt(np.diag(inverse @ (slopes @ slopes.T) @ inverse))
    return spreads


def _curve(up: Evidence | None, middle: Evidence, down: Evidence | None) -> float:
    """By how much the likelihood falls on both sides together."""
    assert up is not None
    assert down is not None
    return 2 * middle.log_likelihood - up.log_likelihood - down.log_likelihood
