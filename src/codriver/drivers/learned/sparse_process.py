"""A sparse Gaussian process: m points stand for n rows.

    F = log N(y | 0, Q + sigma_n^2 I) - tr(K - Q) / (2 sigma_n^2),      Q = K_fu K_uu^-1 K_uf

a lower bound of the log marginal likelihood, reached where the m points are all rows (M. K. Titsias 2009, AISTATS, PMLR 5:567-574).
F and its derivative take some n m^2 operations, where the full form takes n^3.

With S = Q + sigma_n^2 I, a = S^-1 y, A = K_uu^-1 K_uf:

    dF = sum(P dK_uf) - sum(P A' dK_uu) / 2 - n d(sigma_f^2) / (2 sigma_n^2)
         + (a'a - tr S^-1 + tr(K - Q) / sigma_n^4) d(sigma_n^2) / 2,      P = A (a a' - S^-1 + I / sigma_n^2)

The points are rows, drawn as k-means++ draws its centres: each with a probability in the square of its distance from those
before it (D. Arthur, S. Vassilvitskii 2007, SODA, 1027-1035). Centres of k-means itself, the farthest rows (pivoted Cholesky)
and rows at random predicted no better where measured, and mostly worse. The other usual approximation (FITC, E. Snelson,
Z. Ghahramani 2006, NIPS 18), about a ridge regression, won on a simulated driver's next torque by 1 to 2 %, lost elsewhere by up
to 22 %, and its sigma_n often went to zero.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import cholesky, solve_triangular

from codriver.drivers.learned.exponential_kernel import Sigmas, by_lengths
from codriver.signals.signal import Array

JITTER = 1e-8  # of sigma_f^2, on the diagonal of K_uu


class Sparse(NamedTuple):
    """A posterior on m points.

    Attributes:
        weights: of the kernel at the points, shape (m,).
        outer: L with K_uu = L L', shape (m, m).
        inner: L_B with I + L^-1 K_uf K_fu L^-T / sigma_n^2 = L_B L_B', shape (m, m).
    """

    weights: Array
    outer: Array
    inner: Array


def choose_points(X: Array, m: int, random: Any) -> Array:
    """Rows of X, at most m different ones, shape (m, d)."""
    chosen = [int(random.randint(X.shape[0]))]
    nearest = np.sum((X - X[chosen[0]]) ** 2, axis=1)
    while len(chosen) < m and (total := float(nearest.sum())) > 0:
        chosen.append(int(random.choice(X.shape[0], p=nearest / total)))
        nearest = np.minimum(nearest, np.sum((X - X[chosen[-1]]) ** 2, axis=1))
    return np.asarray(X[chosen])


def outer_factor(sigmas: Sigmas, points: Array) -> Array:
    """L with K_uu = L L'."""
    return _outer(sigmas, sigmas.distances(points, points))


def _outer(sigmas: Sigmas, R_uu: Array) -> Array:
    return np.asarray(cholesky(sigmas.kernel(R_uu) + JITTER * sigmas.f**2 * np.eye(len(R_uu)), lower=True))


def condition(sigmas: Sigmas, points: Array, X: Array, y: Array) -> Sparse:
    """The posterior, given points (m, d) and rows (n, d)."""
    L = outer_factor(sigmas, points)
    V = solve_triangular(L, sigmas.kernel(sigmas.distances(points, X)), lower=True)
    L_B = cholesky(np.eye(len(L)) + V @ V.T / sigmas.n**2, lower=True)
    c = solve_triangular(L_B, V @ y / sigmas.n**2, lower=True)
    weights = solve_triangular(L, solve_triangular(L_B, c, lower=True, trans=1), lower=True, trans=1)
    return Sparse(np.asarray(weights), L, np.asarray(L_B))


def bound(theta: Array, points: Array, X: Array, y: Array) -> tuple[float, Array]:
    """F and its derivative at theta = log(sigma_f, sigma_n, lengths)."""
    sigmas = Sigmas.of(theta)
    n, noise, signal = y.size, sigmas.n**2, sigmas.f**2
    R_uu, R_uf = sigmas.distances(points, points), sigmas.distances(points, X)
    L, K_uf = _outer(sigmas, R_uu), sigmas.kernel(R_uf)
    V = solve_triangular(L, K_uf, lower=True)
    L_B = cholesky(np.eye(len(L)) + V @ V.T / noise, lower=True)
    c = solve_triangular(L_B, V @ y / noise, lower=True)
    left = n * signal - float(np.sum(V**2))  # tr(K - Q)
    log_det = n * np.log(noise) + 2.0 * float(np.sum(np.log(np.diag(L_B))))
    F = -0.5 * (n * np.log(2.0 * np.pi) + log_det + float(y @ y) / noise - float(c @ c)) - left / (2.0 * noise)

    a = (y - V.T @ solve_triangular(L_B, c, lower=True, trans=1)) / noise
    W = solve_triangular(L_B, V / noise, lower=True)  # S^-1 = I / sigma_n^2 - W'W
    A = solve_triangular(L, V, lower=True, trans=1)
    P = np.outer(A @ a, a) + (A @ W.T) @ W
    PA = P @ A.T
    by_uf, by_uu = P * K_uf, PA * sigmas.kernel(R_uu)
    d_f = 2.0 * by_uf.sum() - by_uu.sum() - JITTER * signal * np.trace(PA) - n * signal / noise
    d_n = noise * (float(a @ a) - n / noise + float(np.sum(W**2)) + left / noise**2)
    d_l = by_lengths(by_uf, R_uf, points, X, sigmas) - 0.5 * by_lengths(by_uu, R_uu, points, points, sigmas)
    return F, np.array([d_f, d_n, *d_l])
