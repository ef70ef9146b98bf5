"""Least squares on drives: robust to outliers, with standard errors for residuals that are alike from tick to tick.

    minimise sum over used k of (y_k - x_k' theta)^2

Moments that the masks let pass and that still do not fit (a pothole, a slipping converter) are trimmed: Huber's weights
(corner 1.5 s) lead to a fit that they cannot bend, rows further than 5 s from it are left out, and least squares on the rest
is the answer. s is 1.4826 times the median absolute residual. Huber 1964, doi:10.1214/aoms/1177703732.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from codriver.errors import LogError
from codriver.identify.standard_errors import Index, block_bootstrap, block_length, block_sums, blocks_of, newey_west
from codriver.signals.grid import Flags
from codriver.signals.signal import Array

CORNER, TRIM = 1.5, 5.0  # times the robust standard deviation
ROUNDS = 8


@dataclass(frozen=True, eq=False)
class Regression:
    """A fit.

    Attributes:
        solution: theta, shape (p,).
        sd: from the block bootstrap, shape (p,).
        sd_hac: from Newey and West's formula, shape (p,).
        freedom: degrees of freedom of a t interval: blocks less coefficients.
        used: rows that the answer rests on, shape (n,).
        trimmed: share of the rows offered that were left out as outliers.
        residual: RMS over the rows used.
        length: of a block, ticks.
        blocks: how many.
    """

    solution: Array
    sd: Array
    sd_hac: Array
    freedom: int
    used: Flags
    trimmed: float
    residual: float
    length: int
    blocks: int

    @property
    def interval_factor(self) -> float:
        """Half the width of a 95 % interval, in standard deviations."""
        from scipy.special import stdtrit  # Student's t; scipy.stats takes a second to load

        return float(stdtrit(self.freedom, 0.975)) if self.freedom > 0 else float("inf")


def regress(X: Array, y: Array, offered: Flags, pieces: Index, *, seed: int = 0, trim: bool = True) -> Regression:
    """Fit and judge.

    Args:
        X: rows, shape (n, p), in time order, log after log.
        y: target, shape (n,).
        offered: rows that may be used.
        pieces: first rows of the logs, and n.
        seed: of the bootstrap.
        trim: leave outliers out.

    Raises:
        LogError: there are too few rows, or columns that cannot be told apart.
    """
    if offered.sum() <= X.shape[1]:
        raise LogError(f"{int(offered.sum())} usable ticks", f"more than {X.shape[1]}, by far", "record a longer drive")
    used = trimmed_rows(X, y, offered) if trim else offered.copy()
    solution = solve(X[used], y[used])
    e = y - X @ solution
    length = block_length(X, e, used, pieces)
    starts, logs = blocks_of(used, pieces, length)
    covariance = block_bootstrap(*block_sums(X, y, used, starts), logs, seed)
    hac = newey_west(X, e, used, pieces, length)
    blocks = starts.size - 1
    return Regression(
        solution, np.sqrt(np.diag(covariance)), np.sqrt(np.diag(hac)), blocks - X.shape[1], used,
        1.0 - float(used.sum() / offered.sum()), rms(e[used]), length, blocks,
    )  # fmt: skip


def solve(X: Array, y: Array) -> Array:
    """Least squares by the normal equations of scaled columns; y of shape (n,) or (n, m).

    Raises:
        LogError: columns that cannot be told apart.
    """
    A = X.T @ X
    size = np.sqrt(np.diag(A))
    if not (size > 0).all():
        raise LogError("a coefficient that nothing in the drive excites", "a drive that does", "record another drive")
    A = A / size / size[:, None]
    if np.linalg.cond(A) > 1e11:
        raise LogError(
            "coefficients that the drive cannot tell apart", "speeds and pedals that vary", "record another drive"
        )
    right = X.T @ y
    return np.asarray((np.linalg.solve(A, (right.T / size).T).T / size).T)


def trimmed_rows(X: Array, y: Array, offered: Flags) -> Flags:
    """The rows offered, less those far from a fit that outliers cannot bend."""
    rows, target = X[offered], y[offered]
    theta = solve(rows, target)
    for _ in range(ROUNDS):
        e = target - rows @ theta
        s = _spread(e)
        if s == 0:
            return offered.copy()
        root = np.sqrt(np.minimum(1.0, CORNER * s / np.maximum(np.abs(e), 1e-300)))
        new = solve(rows * root[:, None], target * root)
        done = np.allclose(new, theta, rtol=1e-3, atol=0.0)
        theta = new
        if done:
            break
    e = target - rows @ theta
    s = _spread(e)
    kept = offered.copy()
    # Rounding is no outlier: a fit without noise keeps all its rows.
    kept[offered] = np.abs(e) <= max(TRIM * s, 1e-9 * float(np.abs(target).max(initial=0.0)))
    return kept


def rms(x: Array) -> float:
    """Root mean square; NaN of nothing."""
    return float(np.sqrt(np.mean(x**2))) if x.size else float("nan")


def _spread(e: Array) -> float:
    """Standard deviation of the bulk."""
    return 1.4826 * float(np.median(np.abs(e)))
