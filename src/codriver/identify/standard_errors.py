"""Standard errors of least squares whose residuals are alike from tick to tick.

With rows x_k, residuals e_k, scores u_k = x_k e_k (0 where a row is not used) and A = sum x_k x_k':

    covariance = A^-1 S A^-1,   S = sum over lags |j| < L of (1 - |j| / L) sum_k u_k u_{k+j}'          (Newey-West)
               = A^-1 (1 / L sum_k m_k m_k') A^-1,   m_k = u_k + ... + u_{k+L-1}

The second line is the same sum, in one pass. The block bootstrap needs no formula: blocks of L ticks are drawn with
replacement, each from its own log, and the fit is repeated. L comes from the data: a coefficient's error is the sum of
A^-1 u_k over the rows, so what counts is over how many ticks c the entries of A^-1 u_k are alike (c = 1 + 2 sum of the
autocorrelation, up to its first value below 0.05; the greatest of all coefficients and of e_k itself). With n rows

    L = c (n / c)^(1/3)

Newey, West 1987, doi:10.2307/1913610; Kunsch 1989, doi:10.1214/aos/1176347265 (blocks, and L growing as n^(1/3)).
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import numpy.typing as npt

from codriver.signals.grid import Flags
from codriver.signals.signal import Array

Index = npt.NDArray[np.intp]  # first rows of logs or blocks

DRAWS = 500
LEAST_ALIKE = 0.05
# No autocorrelation is looked for beyond: this share of a log, and so many ticks.
LONGEST, MOST_LAGS = 0.25, 6000


def autocorrelation(e: Array, used: Flags, pieces: Index, most: int) -> Array:
    """Autocorrelation of series that have holes, lags 0 to `most`, shape (most + 1,) or (most + 1, m).

    Args:
        e: residuals, shape (n,) or (n, m).
        used: which of them count, shape (n,).
        pieces: first rows of the logs, and n, shape (logs + 1,); no pair crosses them.
        most: greatest lag, ticks.
    """
    from scipy.fft import irfft, next_fast_len, rfft

    columns = e.reshape(e.shape[0], -1).T
    mean = columns[:, used].mean(axis=1, keepdims=True) if used.any() else 0.0
    series = np.vstack([np.where(used, columns - mean, 0.0), used.astype(float)])
    total = np.zeros((series.shape[0], most + 1))
    for i, k in pairwise(pieces):
        lags = min(most, int(k - i) - 1) + 1
        size = next_fast_len(int(k - i) + lags, real=True)
        for row, x in zip(total, series, strict=True):
            spectrum = rfft(x[i:k], size)
            row[:lags] += irfft(spectrum.real**2 + spectrum.imag**2, size)[:lags]
    covariance = total[:-1] / np.maximum(total[-1], 0.5)
    rho = covariance / np.where(covariance[:, :1] > 0, covariance[:, :1], 1.0)
    return np.asarray(rho.T.reshape(most + 1, *e.shape[1:]))


def block_length(X: Array, e: Array, used: Flags, pieces: Index) -> int:
    """L, ticks: see the module's docstring."""
    longest = int(np.diff(pieces).max())
    most = max(min(round(LONGEST * longest), MOST_LAGS), 1)
    influence = X @ np.linalg.inv(X[used].T @ X[used]) * e[:, None]
    alike = 1.0
    for rho in autocorrelation(np.column_stack([e, influence]), used, pieces, most).T:
        below = np.flatnonzero(rho[1:] < LEAST_ALIKE)
        first = int(below[0]) + 1 if below.size else rho.size
        alike = max(alike, 1.0 + 2.0 * float(rho[1:first].sum()))
    return max(round(alike * (max(float(used.sum()) / alike, 1.0)) ** (1 / 3)), 1)


def newey_west(X: Array, e: Array, used: Flags, pieces: Index, length: int) -> Array:
    """Covariance of the coefficients, Bartlett weights, greatest lag `length` - 1.

    Args:
        X: rows, shape (n, p).
        e: residuals, shape (n,).
        used: which rows count, shape (n,).
        pieces: first rows of the logs, and n; no pair crosses them.
        length: L, ticks.
    """
    scores = X * np.where(used, e, 0.0)[:, None]
    S = np.zeros((X.shape[1],) * 2)
    for i, k in pairwise(pieces):
        total = np.vstack([np.zeros((1, X.shape[1])), np.cumsum(scores[i:k], axis=0)])
        n = k - i
        ends = np.arange(1, n + length)
        moving = total[np.minimum(ends, n)] - total[np.maximum(ends - length, 0)]
        S += moving.T @ moving / length
    inverse = np.linalg.inv(X[used].T @ X[used])
    return np.asarray(inverse @ S @ inverse)


def blocks_of(used: Flags, pieces: Index, length: int) -> tuple[Index, Index]:
    """Blocks of at least `length` used ticks, within one log.

    Returns:
        First rows of the blocks and n, shape (blocks + 1,); the log of each block, shape (blocks,).
    """
    starts: list[int] = []
    logs: list[int] = []
    for number, (i, k) in enumerate(pairwise(pieces)):
        rows = i + np.flatnonzero(used[i:k])
        count = max(rows.size // length, 1)
        cuts = rows[np.arange(1, count) * rows.size // count] if rows.size else []
        starts += [int(i), *(int(c) for c in cuts)]
        logs += [number] * count
    return np.array([*starts, used.size]), np.array(logs)


def block_sums(X: Array, y: Array, used: Flags, starts: Index) -> tuple[Array, Array]:
    """X'X and X'y of each block: shapes (blocks, p, p) and (blocks, p)."""
    there = X * used[:, None]
    p = X.shape[1]
    pairs = [(i, k) for i in range(p) for k in range(i, p)]
    A = np.empty((starts.size - 1, p, p))
    for i, k in pairs:
        A[:, i, k] = A[:, k, i] = np.add.reduceat(there[:, i] * X[:, k], starts[:-1])
    return A, np.add.reduceat(there * y[:, None], starts[:-1], axis=0)


def block_bootstrap(A: Array, b: Array, logs: Index, seed: int, draws: int = DRAWS) -> Array:
    """Covariance of the coefficients by drawing blocks with replacement, each log's from its own.

    Args:
        A, b: X'X and X'y of the blocks, shapes (blocks, p, p) and (blocks, p).
        logs: the log of each block, shape (blocks,).
        seed: of the draws.
        draws: how many.

    Returns:
        Shape (p, p); infinite where there are too few blocks to tell.
    """
    blocks, p = b.shape
    if blocks <= p + 1:
        return np.full((p, p), np.inf)
    rng = np.random.default_rng(seed)
    times = np.zeros((draws, blocks))
    for log in np.unique(logs):
        own = np.flatnonzero(logs == log)
        times[:, own] = rng.multinomial(own.size, np.full(own.size, 1 / own.size), draws)
    left = (times @ A.reshape(blocks, -1)).reshape(draws, p, p)
    right = times @ b
    scale = np.sqrt(np.maximum(np.einsum("dii->di", left), 1e-300))
    left = left / scale[:, :, None] / scale[:, None, :]
    # A draw without a single stretch that excites a coefficient says nothing of it.
    sound = np.linalg.cond(left) < 1e10
    found = np.linalg.solve(left[sound], (right[sound] / scale[sound])[..., None])[..., 0] / scale[sound]
    if found.shape[0] < draws / 2:
        return np.full((p, p), np.inf)
    return np.asarray(np.cov(found, rowvar=False).reshape(p, p) * blocks / (blocks - p))
