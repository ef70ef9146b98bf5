"""Figure 2 of the 2017 paper: a coefficient and the validation error against minutes of identification data.

After each block of the fit half the coefficients are those of all rows so far, from accumulated normal equations:

    theta_m = (sum_{b <= m} A_b)^-1 sum_{b <= m} b_b

Validation needs no pass over the data either: with the validation rows' own sums A_v, b_v and s_v = sum of squares,
N RMSE^2 = theta' A_v theta - 2 theta' b_v + s_v. The standard error at m is that of the blocks' scores s_b = b_b - A_b theta
of the final fit, sum of s_b s_b' over the blocks so far, between the inverses.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from codriver.identify.brake_rows import DriveRows
from codriver.identify.regression import Regression
from codriver.identify.standard_errors import block_sums, blocks_of
from codriver.signals.grid import Flags
from codriver.signals.signal import Array


@dataclass(frozen=True)
class LearningPoint:
    """One point of the curve.

    Attributes:
        minutes: of usable identification data.
        braking: of them with the brake pressed.
        value: c_b so far, N/Pa; NaN where it cannot be told yet.
        sd: its standard error.
        rmse: on the validation half, m/s^2.
    """

    minutes: float
    braking: float
    value: float
    sd: float
    rmse: float


def learning_curve(
    X: Array, target: Array, y: Array, force: Array, fit: Regression, rows: DriveRows, validation: Flags, M: float,
    names: list[str], least: float = 5.0,
) -> tuple[LearningPoint, ...]:  # fmt: skip
    """The curve of c_b; empty if it was not fitted.

    Args:
        X, target: rows and target of the fit, shapes (n, p) and (n,); target is force - M y.
        y, force: [y1]_F, m/s^2, and known force, N.
        fit: the final fit: its rows, weights and blocks.
        rows: the drive.
        validation: rows of the second half.
        M: mass, kg.
        names: of the columns.
        least: seconds between points, at least.
    """
    if "c_b" not in names:
        return ()
    place = names.index("c_b")
    starts, _ = blocks_of(fit.used, rows.pieces, max(fit.length, round(least / rows.dt)))
    A, b = block_sums(X, target, fit.used, starts)
    scores = b - A @ fit.solution
    ticks = np.add.reduceat(fit.used.astype(float), starts[:-1])
    braking = np.add.reduceat((fit.used & rows.pressed).astype(float), starts[:-1])
    V, w = X[validation], target[validation]
    A_v, b_v, s_v = V.T @ V, V.T @ w, float(w @ w)
    points = []
    for A_m, b_m, S_m, minutes, minutes_braking in zip(
        np.cumsum(A, axis=0), np.cumsum(b, axis=0), np.cumsum(scores[:, :, None] * scores[:, None, :], axis=0),
        (np.cumsum(ticks) * rows.dt / 60).tolist(), (np.cumsum(braking) * rows.dt / 60).tolist(), strict=True,
    ):  # fmt: skip
        there = np.diag(A_m) > 0  # logs that have begun
        inner = np.ix_(there, there)
        size = np.sqrt(np.diag(A_m)[there])
        scaled = A_m[inner] / size / size[:, None]
        value = sd = rmse = float("nan")
        if there[place] and np.linalg.cond(scaled) < 1e8:
            inverse = np.linalg.inv(scaled) / size / size[:, None]
            theta = fit.solution.copy()  # offsets of logs to come are the final ones
            theta[there] = inverse @ b_m[there]
            k = int(there[:place].sum())
            value = float(theta[place])
            sd = float(np.sqrt((inverse @ S_m[inner] @ inverse)[k, k]))
            rmse = float(np.sqrt(max(float(theta @ A_v @ theta - 2 * theta @ b_v) + s_v, 0.0) / max(len(w), 1))) / M
        points.append(LearningPoint(minutes, minutes_braking, value, sd, rmse))
    return tuple(points)
