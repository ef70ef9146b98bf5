"""Gaussian mixtures by expectation and maximisation, in log space.

    p(x) = sum_i pi_i N(x; mu_i, Sigma_i)                                    2019 eq. (20)

    r_ki = pi_i N(x_k; mu_i, Sigma_i) / p(x_k)                               expectation
    pi_i = mean_k r_ki,   mu_i, Sigma_i as `gaussians` says                  maximisation

    AIC = 2 p - 2 log L,      BIC = p log n - 2 log L

Sums of densities are taken of exp(l - max l), so a row far from everything still belongs to the nearest component. Components
that are left with less than `LEAST` rows are dropped. Starts are drawn as k-means++ does, each row far from those before with more
likelihood; every start is followed for some steps, and the best of them to the end.

A. P. Dempster, N. M. Laird, D. B. Rubin 1977, doi 10.1111/j.2517-6161.1977.tb01600.x; seeds: D. Arthur, S. Vassilvitskii 2007
(SODA), https://dl.acm.org/doi/10.5555/1283383.1283494; short runs: C. Biernacki, G. Celeux, G. Govaert 2003,
doi 10.1016/S0167-9473(02)00163-9.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, log

import numpy as np

from codriver.drivers.learned.gaussians import Gaussians, Regularisation, Standard
from codriver.signals.signal import Array

LEAST = 1.0  # rows, in sum of responsibilities
SHORT = 10  # steps that every start is followed


@dataclass(frozen=True)
class EmSettings:
    """How a mixture, or a hidden Markov model, is sought.

    Attributes:
        shrinkage: rows' worth of the prior on the covariances.
        floor: of their eigenvalues, in variances of the data.
        starts: how many.
        most: steps at most.
        enough: stop when a step gains less than this in log-likelihood a row.
    """

    shrinkage: float = 1.0
    floor: float = 1e-6
    starts: int = 3
    most: int = 200
    enough: float = 1e-3

    def __post_init__(self) -> None:
        """Refuse what cannot be.

        Raises:
            ValueError: a setting is out of range.
        """
        if not (self.shrinkage >= 0 and self.floor > 0 and self.enough >= 0):
            raise ValueError(
                f"shrinkage = {self.shrinkage}, floor = {self.floor}, enough = {self.enough}; "
                "shrinkage and enough are at least 0, floor is above 0"
            )
        if self.starts < 1 or self.most < 1:
            raise ValueError(f"starts = {self.starts}, most = {self.most}; both at least 1")


@dataclass(frozen=True, eq=False)
class Mixture:
    """A Gaussian mixture.

    Attributes:
        weights: pi, shape (N,), sum 1.
        gaussians: N of them.
    """

    weights: Array
    gaussians: Gaussians

    @property
    def components(self) -> int:
        """N."""
        return self.weights.size

    def joint(self, X: Array) -> Array:
        """log pi_i N(x; ...), shape (n, N)."""
        return np.log(self.weights) + self.gaussians.log_densities(X)

    def log_densities(self, X: Array) -> Array:
        """log p(x) of rows (n, D), shape (n,)."""
        return log_sum(self.joint(X))[0]

    def log_likelihood(self, X: Array) -> float:
        """Of rows (n, D)."""
        return float(self.log_densities(X).sum())

    def parameters(self) -> int:
        """How many free numbers."""
        return self.gaussians.parameters() + self.components - 1

    def aic(self, X: Array) -> float:
        """Akaike's criterion on rows (n, D)."""
        return criterion("aic", self.log_likelihood(X), self.parameters(), X.shape[0])

    def bic(self, X: Array) -> float:
        """The Bayesian criterion on rows (n, D)."""
        return criterion("bic", self.log_likelihood(X), self.parameters(), X.shape[0])


def criterion(name: str, log_likelihood: float, parameters: int, n: int) -> float:
    """AIC or BIC of n rows; less is better."""
    return (2.0 if name == "aic" else log(n)) * parameters - 2.0 * log_likelihood


def log_sum(joint: Array) -> tuple[Array, Array]:
    """log sum_i exp(joint_ki), shape (n,), and exp(joint) over that sum, shape (n, N)."""
    most = joint.max(axis=1, keepdims=True)
    shares = np.exp(joint - most)
    total = shares.sum(axis=1, keepdims=True)
    return (most + np.log(total))[:, 0], shares / total


@dataclass(frozen=True, eq=False)
class Ascent:
    """Where expectation and maximisation have led.

    Attributes:
        mixture: after the last step.
        objective: log-likelihood and log prior before every step.
        converged: whether the last step gained little.
    """

    mixture: Mixture
    objective: tuple[float, ...]
    converged: bool


def ascend(X: Array, start: Mixture, regularisation: Regularisation, most: int, enough: float) -> Ascent:
    """Expectation and maximisation.

    Args:
        X: rows (n, D), standardised.
        start: where from.
        regularisation: of the covariances.
        most, enough: as in `EmSettings`.
    """
    mixture, trace, before = start, [], -inf
    for _ in range(most):
        log_density, R = log_sum(mixture.joint(X))
        trace.append(float(log_density.sum()) + regularisation.log_prior(mixture.gaussians))
        stepped = maximised(X, R, regularisation)
        converged = trace[-1] - before < enough * X.shape[0] and stepped.components == mixture.components
        # A component dropped costs likelihood: that is no sign that the rest has settled.
        before = trace[-1] if stepped.components == mixture.components else -inf
        mixture = stepped
        if converged:
            return Ascent(mixture, tuple(trace), True)
    return Ascent(mixture, tuple(trace), False)


def maximised(X: Array, R: Array, regularisation: Regularisation) -> Mixture:
    """The maximisation for rows (n, D) and responsibilities (n, N), without dead components."""
    R = R[:, alive(R)]
    return Mixture(R.sum(axis=0) / R.sum(), regularisation.gaussians(X, R))


def alive(R: Array) -> Array:
    """A mask (N,) of the components that have enough rows; the largest always has."""
    counts = R.sum(axis=0)
    return np.asarray(counts >= min(LEAST, counts.max()))


def seeded(X: Array, components: int, regularisation: Regularisation, rng: np.random.Generator) -> Mixture:
    """A mixture to start from: every row belongs to the nearest of some rows drawn far apart.

    There are fewer components where the rows have fewer different values.
    """
    chosen = X[rng.integers(X.shape[0])]
    squares = np.square(X - chosen).sum(axis=1)
    nearest = np.zeros(X.shape[0], dtype=np.intp)
    for i in range(1, components):
        if not squares.max() > 0:
            break
        chosen = X[rng.choice(X.shape[0], p=squares / squares.sum())]
        away = np.square(X - chosen).sum(axis=1)
        nearest = np.where(away < squares, i, nearest)
        squares = np.minimum(squares, away)
    return maximised(X, np.eye(components)[nearest], regularisation)


def fit_mixture(X: Array, components: int, settings: EmSettings | None = None, random_state: int | None = 0) -> Mixture:
    """Learn a mixture.

    Args:
        X: rows, shape (n, D), in any units.
        components: N wanted; dead ones are dropped.
        settings: of the search.
        random_state: of the starts.

    Raises:
        ValueError: there are fewer rows than components, or no component.
    """
    settings = settings or EmSettings()
    if not 1 <= components <= X.shape[0]:
        raise ValueError(f"{components} components of {X.shape[0]} rows; from 1 to as many as rows")
    standard = Standard.of(X)
    Z = standard.rows(X)
    regularisation = standard.regularisation(Z, settings.shrinkage, settings.floor)
    rng = np.random.default_rng(random_state)
    starts = settings.starts if components > 1 else 1
    tried = [
        ascend(
            Z, seeded(Z, components, regularisation, rng), regularisation, min(SHORT, settings.most), settings.enough
        )
        for _ in range(starts)
    ]
    best = max(tried, key=lambda ascent: ascent.objective[-1])
    if not best.converged and settings.most > SHORT:
        best = ascend(Z, best.mixture, regularisation, settings.most - SHORT, settings.enough)
    return Mixture(best.mixture.weights, best.mixture.gaussians.moved(standard.shift, standard.scale))
