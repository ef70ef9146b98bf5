"""Gaussians in several dimensions, and what keeps them from becoming singular.

    log N(x; mu, Sigma) = -1/2 |W (x - mu)|^2 + log |W| - D/2 log(2 pi),        W = L^-1,   Sigma = L L'

From rows x_k that belong to a Gaussian with responsibility r_k, n = sum r_k:

    mu = sum r_k x_k / n,      S = sum r_k (x_k - mu)(x_k - mu)' / n
    Sigma = (n S + nu Sigma_0) / (n + nu),      eigenvalues at least `floor`

Sigma_0 is the covariance of all rows: nu rows' worth of a prior (inverse Wishart), so a Gaussian of few rows resembles the
whole instead of a spike. Features of a history are almost copies of each other, some are constant or equal, then Sigma_0 too is
singular; the floor, in units of the rows' variance in each column, holds there. Both together are the exact maximum of

    sum r_k log N(x_k; mu, Sigma) + nu/2 (log |Sigma^-1| - tr Sigma^-1 Sigma_0)

over all Sigma whose eigenvalues are at least the floor. So expectation and maximisation still only ever go up.

Prior: C. Fraley, A. E. Raftery 2007, doi 10.1007/s00357-007-0004-5.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import log, pi

import numpy as np

from codriver.signals.signal import Array

ROWS = 1024  # at a time, so that they stay in the cache


@dataclass(frozen=True, eq=False)
class Gaussians:
    """N Gaussians in D dimensions.

    Attributes:
        means: shape (N, D).
        covariances: shape (N, D, D).
        factors: W, shape (N, D, D), lower triangles.
        log_peaks: log densities at the means, shape (N,).
    """

    means: Array
    covariances: Array
    factors: Array
    log_peaks: Array

    @classmethod
    def of(cls, means: Array, covariances: Array) -> Gaussians:
        """From means (N, D) and covariances (N, D, D).

        Raises:
            ValueError: a covariance is not positive definite.
        """
        from scipy.linalg import solve_triangular

        try:
            roots = np.linalg.cholesky(covariances)
        except np.linalg.LinAlgError as error:
            raise ValueError("a covariance is not positive definite") from error
        eye = np.eye(means.shape[1])
        factors = np.array([solve_triangular(L, eye, lower=True) for L in roots])
        log_sizes = np.log(np.diagonal(factors, axis1=1, axis2=2)).sum(axis=1)
        return cls(means, covariances, factors, log_sizes - 0.5 * means.shape[1] * log(2 * pi))

    def log_densities(self, X: Array) -> Array:
        """Of rows (n, D) under each, shape (n, N)."""
        out = np.empty((X.shape[0], self.means.shape[0]))
        for first in range(0, X.shape[0], ROWS):
            part = slice(first, first + ROWS)
            for i, W in enumerate(self.factors):
                e = (X[part] - self.means[i]) @ W.T
                out[part, i] = self.log_peaks[i] - 0.5 * np.einsum("ij,ij->i", e, e)
        return out

    def parameters(self) -> int:
        """How many free numbers."""
        N, D = self.means.shape
        return N * (D + D * (D + 1) // 2)

    def only(self, kept: Array) -> Gaussians:
        """Some of them; `kept` is a mask or numbers."""
        return Gaussians(self.means[kept], self.covariances[kept], self.factors[kept], self.log_peaks[kept])

    def moved(self, shift: Array, scale: Array) -> Gaussians:
        """Those of rows shift + scale x, if these are of rows x."""
        return Gaussians.of(shift + scale * self.means, self.covariances * np.multiply.outer(scale, scale))


@dataclass(frozen=True, eq=False)
class Regularisation:
    """What keeps Gaussians of standardised rows from becoming singular.

    Attributes:
        pooled: Sigma_0, shape (D, D).
        shrinkage: nu, rows.
        floor: of the eigenvalues.
    """

    pooled: Array
    shrinkage: float
    floor: float

    def gaussians(self, X: Array, R: Array) -> Gaussians:
        """The maximum for rows X (n, D) and responsibilities R (n, N), whose columns sum to more than 0."""
        counts = R.sum(axis=0)
        means = (R.T @ X) / counts[:, np.newaxis]
        roots = np.sqrt(R)
        sums = np.tile(self.shrinkage * self.pooled, (counts.size, 1, 1))
        for first in range(0, X.shape[0], ROWS):
            part = slice(first, first + ROWS)
            for i, mean in enumerate(means):
                e = (X[part] - mean) * roots[part, i : i + 1]
                sums[i] += e.T @ e
        return Gaussians.of(means, self.floored(sums / (counts + self.shrinkage)[:, np.newaxis, np.newaxis]))

    def floored(self, covariances: Array) -> Array:
        """With eigenvalues of at least the floor, shape (N, D, D)."""
        values, vectors = np.linalg.eigh(covariances)
        low = values[:, 0] < self.floor
        if not low.any():
            return covariances
        V = vectors[low]
        raised = covariances.copy()
        raised[low] = (V * np.maximum(values[low], self.floor)[:, np.newaxis, :]) @ np.swapaxes(V, 1, 2)
        return 0.5 * (raised + np.swapaxes(raised, 1, 2))

    def log_prior(self, gaussians: Gaussians) -> float:
        """nu/2 (log |Sigma^-1| - tr Sigma^-1 Sigma_0), summed."""
        if self.shrinkage == 0:
            return 0.0
        W = gaussians.factors
        log_sizes = 2.0 * np.log(np.diagonal(W, axis1=1, axis2=2)).sum()
        traces = np.einsum("nij,jk,nik->", W, self.pooled, W, optimize=True)
        return float(0.5 * self.shrinkage * (log_sizes - traces))


@dataclass(frozen=True, eq=False)
class Standard:
    """Rows in units of their own: mean 0 and standard deviation 1, a constant column 0.

    Attributes:
        shift, scale: shape (D,).
    """

    shift: Array
    scale: Array

    @classmethod
    def of(cls, X: Array) -> Standard:
        """Of rows (n, D)."""
        shift, scale = X.mean(axis=0), X.std(axis=0)
        # What rounding leaves of a constant column is no spread.
        constant = scale <= 1e-12 * np.abs(X).max(axis=0)
        return cls(shift, np.where(constant, 1.0, scale))

    def rows(self, X: Array) -> Array:
        """Rows (n, D) in these units."""
        return (X - self.shift) / self.scale

    def regularisation(self, X: Array, shrinkage: float, floor: float) -> Regularisation:
        """For rows that are in these units."""
        return Regularisation(X.T @ X / X.shape[0], shrinkage, floor)
