"""Hidden Markov models with Gaussian emissions: filter, smoother, and Baum-Welch over several stretches.

    forward    f_t = (p_t b_t) / c_t,   p_1 = pi,   p_t = f_{t-1}' A,   c_t = sum p_t b_t
    backward   beta_t = A (b_{t+1} beta_{t+1}) / c_{t+1},   beta = 1 at the end of a stretch
    gamma_t = f_t beta_t,      xi = A  sum_t f_t (b_{t+1} beta_{t+1} / c_{t+1})'

    pi_i ~ sum gamma_{1,i} + kappa,      A_ij ~ xi_ij + kappa                 Gaussians: `gaussians`, with r = gamma

b_t = exp(l_t - max l_t) of the log densities l_t, so the largest is 1 whatever the row; the maximum comes back in
log L = sum log c_t + max l_t. A Dirichlet prior of kappa rows on each transition keeps all of A above 0: hence c_t is at least
the smallest of A, and beta_t at most one over that. Nothing under- or overflows, as in log space, without a logarithm in the loop.

Stretches run side by side: rows are ordered by time within the stretch, and every step of the loop takes all stretches that are
still going.

L. R. Rabiner 1989, doi 10.1109/5.18626.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import inf

import numpy as np
import numpy.typing as npt

from codriver.drivers.learned.gaussians import Gaussians, Regularisation, Standard
from codriver.drivers.learned.mixture import EmSettings, Mixture, alive, criterion, log_sum
from codriver.signals.signal import Array

KAPPA = 0.1  # rows' worth of the prior on each transition
UNSCALED = 8  # steps that the sum of probabilities may shrink before it is made 1 again


@dataclass(frozen=True, eq=False)
class SideBySide:
    """Rows of several stretches in the order of time within the stretch.

    Attributes:
        rows: the row numbers in that order, shape (n,).
        edges: step t takes those from edges[t] to edges[t + 1], as many as stretches are still going.
        before: for each but the rows of the first step, where the row before is, in that order.
    """

    rows: npt.NDArray[np.intp]
    edges: list[int]
    before: npt.NDArray[np.intp]

    @classmethod
    def of(cls, lengths: list[int]) -> SideBySide:
        """Of stretches one after the other, none of them empty."""
        sizes = np.array(lengths)
        rank = np.argsort(np.argsort(-sizes, kind="stable"))  # the longest first, so those still going are the first
        step = np.arange(sizes.sum()) - np.repeat(np.cumsum(sizes) - sizes, sizes)
        going = np.bincount(step)
        edges = np.concatenate([[0], np.cumsum(going)])
        before = np.arange(edges[1], step.size) - np.repeat(going[:-1], going[1:])
        return cls(np.lexsort((np.repeat(rank, sizes), step)), edges.tolist(), before)


def filtered(b: Array, initial: Array, transition: Array, order: SideBySide) -> tuple[Array, Array]:
    """The forward recursion.

    Args:
        b: densities over the largest of their row, shape (n, N), in the order of `order`.
        initial, transition: pi (N,), A (N, N), above 0.
        order: of the rows.

    Returns:
        f, shape (n, N), and c, shape (n,), in the order of `order`.
    """
    f, edges = np.empty_like(b), order.edges
    p = np.tile(initial, (edges[1], 1))
    for t, (first, last) in enumerate(pairwise(edges)):
        now = f[first:last]
        np.multiply(p[: last - first], b[first:last], out=now)
        whole = now / now.sum(axis=1, keepdims=True) if t % UNSCALED == UNSCALED - 1 else now
        p = np.dot(whole, transition)
    total = f.sum(axis=1)
    f /= total[:, np.newaxis]
    c = total.copy()
    unscaled = np.repeat(np.arange(len(edges) - 1) % UNSCALED != 0, np.diff(edges))[edges[1] :]
    c[edges[1] :][unscaled] /= total[order.before[unscaled]]
    return f, c


def smoothed(b: Array, f: Array, c: Array, transition: Array, order: SideBySide) -> tuple[Array, Array]:
    """The backward recursion, for what `filtered` took and gave.

    Returns:
        gamma, shape (n, N), in the order of `order`; xi, shape (N, N), expected number of transitions.
    """
    beta, scaled = np.ones_like(b), b / c[:, np.newaxis]
    back = np.ascontiguousarray(transition.T)
    edges = order.edges
    for t in range(len(edges) - 2, 0, -1):
        first, last = edges[t], edges[t + 1]
        scaled[first:last] *= beta[first:last]
        np.matmul(scaled[first:last], back, out=beta[edges[t - 1] : edges[t - 1] + last - first])
    xi = transition * (f[order.before].T @ scaled[edges[1] :])
    return f * beta, xi


@dataclass(frozen=True, eq=False)
class HiddenMarkov:
    """A hidden Markov model with Gaussian emissions.

    Attributes:
        initial: pi, shape (N,).
        transition: A, shape (N, N), rows sum to 1; A_ij from i to j.
        gaussians: N of them.
    """

    initial: Array
    transition: Array
    gaussians: Gaussians

    @property
    def components(self) -> int:
        """N."""
        return self.initial.size

    def filter(self, X: Array, lengths: list[int]) -> tuple[Array, float]:
        """Probabilities of the states given the rows so far, shape (n, N); log-likelihood.

        Args:
            X: rows (n, D) of the stretches, one after the other.
            lengths: of the stretches, none 0.
        """
        order = SideBySide.of(lengths)
        b, most = scaled_densities(self.gaussians.log_densities(X[order.rows]))
        f, c = filtered(b, self.initial, self.transition, order)
        return in_given_order(f, order), float(np.log(c).sum() + most.sum())

    def log_likelihood(self, X: Array, lengths: list[int]) -> float:
        """Of rows (n, D)."""
        return self.filter(X, lengths)[1]

    def parameters(self) -> int:
        """How many free numbers."""
        return self.gaussians.parameters() + (self.components - 1) * (self.components + 1)

    def criterion(self, name: str, X: Array, lengths: list[int]) -> float:
        """AIC or BIC on rows (n, D)."""
        return criterion(name, self.log_likelihood(X, lengths), self.parameters(), X.shape[0])


def scaled_densities(log_densities: Array) -> tuple[Array, Array]:
    """exp(l - max l), shape (n, N), and max l, shape (n,)."""
    most = log_densities.max(axis=1)
    return np.exp(log_densities - most[:, np.newaxis]), most


def in_given_order(values: Array, order: SideBySide) -> Array:
    """Values (n, ...) in the order of `order` put back to that of the stretches."""
    out = np.empty_like(values)
    out[order.rows] = values
    return out


def baum_welch(
    X: Array, lengths: list[int], start: HiddenMarkov, regularisation: Regularisation, most: int, enough: float,
    kappa: float = KAPPA,
) -> tuple[HiddenMarkov, tuple[float, ...]]:  # fmt: skip
    """Expectation and maximisation.

    Args:
        X: rows (n, D), standardised.
        lengths: of the stretches, none 0.
        start: where from.
        regularisation: of the covariances.
        most, enough: as in `EmSettings`.
        kappa: rows' worth of the prior on each transition.

    Returns:
        the model; log-likelihood and log prior before every step.
    """
    order = SideBySide.of(lengths)
    X = X[order.rows]
    model, trace, before = start, [], -inf
    for _ in range(most):
        b, peak = scaled_densities(model.gaussians.log_densities(X))
        f, c = filtered(b, model.initial, model.transition, order)
        gamma, xi = smoothed(b, f, c, model.transition, order)
        prior = regularisation.log_prior(model.gaussians) + _log_dirichlet(model, kappa)
        trace.append(float(np.log(c).sum() + peak.sum()) + prior)
        kept = alive(gamma)
        gamma, xi = gamma[:, kept], xi[np.ix_(kept, kept)]
        converged = trace[-1] - before < enough * X.shape[0] and bool(kept.all())
        before = trace[-1] if kept.all() else -inf
        model = HiddenMarkov(
            shares(gamma[: len(lengths)].sum(axis=0) + kappa), shares(xi + kappa), regularisation.gaussians(X, gamma)
        )
        if converged:
            break
    return model, tuple(trace)


def shares(counts: Array) -> Array:
    """Counts over the sum of their row."""
    return np.asarray(counts / counts.sum(axis=-1, keepdims=True))


def _log_dirichlet(model: HiddenMarkov, kappa: float) -> float:
    if kappa == 0:
        return 0.0
    return float(kappa * (np.log(model.initial).sum() + np.log(model.transition).sum()))


def from_mixture(X: Array, lengths: list[int], mixture: Mixture) -> HiddenMarkov:
    """A model to start from: the mixture's components, and transitions as the rows belong to them one after the other."""
    R = log_sum(mixture.joint(X))[1]
    first = np.cumsum([0, *lengths[:-1]])
    later = np.setdiff1d(np.arange(X.shape[0]), first)
    return HiddenMarkov(
        shares(R[first].sum(axis=0) + KAPPA), shares(R[later - 1].T @ R[later] + KAPPA), mixture.gaussians
    )


def fit_hidden_markov(
    X: Array, lengths: list[int], mixture: Mixture, settings: EmSettings | None = None
) -> HiddenMarkov:
    """Learn a hidden Markov model from a mixture on.

    Args:
        X: rows (n, D) of the stretches, one after the other, in any units.
        lengths: of the stretches, none 0.
        mixture: of the same rows; has as many components as states are wanted. Dead ones are dropped.
        settings: of the search.
    """
    settings = settings or EmSettings()
    standard = Standard.of(X)
    Z = standard.rows(X)
    start = from_mixture(X, lengths, mixture)
    start = HiddenMarkov(
        start.initial, start.transition, start.gaussians.moved(-standard.shift / standard.scale, 1 / standard.scale)
    )
    regularisation = standard.regularisation(Z, settings.shrinkage, settings.floor)
    model = baum_welch(Z, lengths, start, regularisation, settings.most, settings.enough)[0]
    return HiddenMarkov(model.initial, model.transition, model.gaussians.moved(standard.shift, standard.scale))
