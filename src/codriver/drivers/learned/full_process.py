"""The marginal likelihood of a Gaussian process on all its rows.

    log p(y) = -y' K_T^-1 y / 2 - log|K_T| / 2 - n/2 log 2 pi,      K_T = K + sigma_n^2 I            2019 eq. (10), (19)
    d log p  = sum((a a' - K_T^-1) dK_T) / 2,                       a = K_T^-1 y

n^3 operations and some n^2 numbers for each evaluation.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import cho_solve, cholesky

from codriver.drivers.learned.exponential_kernel import Sigmas, by_lengths
from codriver.signals.signal import Array


def factor(sigmas: Sigmas, X: Array) -> Array:
    """L with K_T = L L', shape (n, n)."""
    return np.asarray(cholesky(sigmas.kernel(sigmas.distances(X, X)) + sigmas.n**2 * np.eye(len(X)), lower=True))


def log_likelihood(theta: Array, X: Array, y: Array) -> tuple[float, Array]:
    """log p(y) and its derivative at theta = log(sigma_f, sigma_n, lengths)."""
    sigmas, n = Sigmas.of(theta), y.size
    r = sigmas.distances(X, X)
    K = sigmas.kernel(r)
    L = cholesky(K + sigmas.n**2 * np.eye(n), lower=True)
    a = cho_solve((L, True), y)
    value = -0.5 * float(y @ a) - float(np.sum(np.log(np.diag(L)))) - 0.5 * n * np.log(2.0 * np.pi)
    M = np.outer(a, a) - cho_solve((L, True), np.eye(n))
    MK = M * K
    lengths = 0.5 * by_lengths(MK, r, X, X, sigmas)
    return value, np.array([MK.sum(), sigmas.n**2 * np.trace(M), *lengths])
