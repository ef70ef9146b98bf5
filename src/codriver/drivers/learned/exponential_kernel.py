"""The exponential kernel of a Gaussian process, and how it changes with its parameters.

    k(z, z') = sigma_f^2 exp(-r),      r^2 = sum_i (z_i - z'_i)^2 / l_i^2

With one length l = sigma_l for all features it is 2019 eq. (9); with a length for each it tells features that matter (short) from
those that do not (long).

    dk / d log l_i = k (z_i - z'_i)^2 / (l_i^2 r)

The parameters are searched as theta = (log sigma_f, log sigma_n, log l_1, ...), for a torque of about unit variance.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize
from scipy.spatial.distance import cdist

from codriver.signals.signal import Array

# Start and bounds of the search; lengths start at 3 sqrt(d), which is twice the distance of two rows.
START_F, START_N, START_LENGTH = 1.0, 0.3, 3.0
BOUNDS_F, BOUNDS_N, BOUNDS_LENGTH = (1e-3, 1e3), (1e-4, 1e2), (1e-2, 1e5)


class Sigmas(NamedTuple):
    """Parameters.

    Attributes:
        f: sigma_f, standard deviation of the function.
        n: sigma_n, standard deviation of the noise.
        lengths: shape (1,) or (d,).
    """

    f: float
    n: float
    lengths: Array

    @classmethod
    def of(cls, theta: Array) -> Sigmas:
        """From their logarithms."""
        values = np.exp(theta)
        return cls(float(values[0]), float(values[1]), values[2:])

    def kernel(self, r: Array) -> Array:
        """k at scaled distances."""
        return np.asarray(self.f**2 * np.exp(-r))

    def distances(self, X: Array, Z: Array) -> Array:
        """r between rows (n, d) and (m, d), shape (n, m)."""
        return np.asarray(cdist(X / self.lengths, Z / self.lengths))

    def times(self, scale: float) -> Sigmas:
        """Those of a torque that many times as large."""
        return Sigmas(self.f * scale, self.n * scale, self.lengths)


def by_lengths(W: Array, r: Array, X: Array, Z: Array, sigmas: Sigmas) -> Array:
    """sum_ij W_ij (x_i - z_j)^2 / (l^2 r_ij) for each length: with W = P k, the sum of P dk / d log l.

    Args:
        W: weights, shape (n, m).
        r: scaled distances, shape (n, m).
        X, Z: rows, shapes (n, d) and (m, d).
        sigmas: their lengths.
    """
    A, B = X / sigmas.lengths, Z / sigmas.lengths
    over = np.divide(W, r, out=np.zeros_like(W), where=r > 0)
    each = over.sum(axis=1) @ A**2 + over.sum(axis=0) @ B**2 - 2.0 * np.sum(A * (over @ B), axis=0)
    return np.asarray(each) if sigmas.lengths.size > 1 or X.shape[1] == 1 else np.array([each.sum()])


def greatest(likelihood: Callable[[Array], tuple[float, Array]], d: int, ard: bool) -> Sigmas:
    """Where a likelihood, given with its derivative, is greatest.

    Args:
        likelihood: theta -> (log likelihood, derivative).
        d: number of features.
        ard: a length for each feature; otherwise one for all.
    """
    count = d if ard else 1
    theta = np.log([START_F, START_N, *[START_LENGTH * np.sqrt(d)] * count])
    bounds = np.log([BOUNDS_F, BOUNDS_N, *[BOUNDS_LENGTH] * count])

    def less(at: Array) -> tuple[float, Array]:
        value, slope = likelihood(at)
        return -value, -slope

    found = minimize(less, theta, jac=True, method="L-BFGS-B", bounds=bounds, options={"maxiter": 60})
    return Sigmas.of(found.x)
