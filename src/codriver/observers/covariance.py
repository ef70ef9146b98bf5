"""Kalman filter algebra on scalars, for steps that are recorded.

Matrices are lists of rows. Constant zeros drop out when the step is recorded, so a sparse F costs what it must.
Measurements come one row at a time: with independent noises that is the same as all at once, needs no matrix inverse, and
a row that is missing is left out, which is all that a multi-rate bus asks for.
"""

from __future__ import annotations

from collections.abc import Sequence

from codriver.kernel import Scalar
from codriver.signals.signal import Array

Matrix = list[list[Scalar]]


def predict_covariance(P: Matrix, F: Array | Matrix, Q: Array | Matrix) -> Matrix:
    """F P F' + Q, by its upper triangle.

    Args:
        P: symmetric, n x n scalars.
        F, Q: n x n, numbers or scalars.
    """
    n = len(P)
    FP = [[_dot([(F[i][k], P[k][j]) for k in range(n)]) for j in range(n)] for i in range(n)]
    return symmetric(
        [[_dot([(F[j][k], FP[i][k]) for k in range(n)]) + plain(Q[i][j]) for j in range(n)] for i in range(n)]
    )


def predict_mean(x: Sequence[Scalar], F: Array | Matrix) -> list[Scalar]:
    """F x, for F of numbers or scalars."""
    return [_dot([(F[i][k], x[k]) for k in range(len(x))]) for i in range(len(F))]


def update_row(
    x: Sequence[Scalar], P: Matrix, h: Sequence[Scalar], innovation: Scalar, R: Scalar, ok: Scalar
) -> tuple[list[Scalar], Matrix, Scalar]:
    """Update with one measured row where ok is 1; without it, nothing changes.

        s = h P h' + R,  k = P h' / s,  x + k e,  P - k s k'

    Args:
        x, P: predicted state and covariance.
        h: the row of C, numbers or scalars.
        innovation: e = y - h x - d u; 0 where the row is missing.
        R: noise variance of the row.
        ok: 1 where the row is there, else 0.

    Returns:
        x, P, and the innovation variance s.
    """
    n = len(x)
    Ph = [_dot([(h[k], P[i][k]) for k in range(n)]) for i in range(n)]
    s = _dot([(h[k], Ph[k]) for k in range(n)]) + R
    # One division; s is positive. Written as a choice between 1 / s and 0, CasADi would divide every product by s.
    weight = ok / s
    step = weight * innovation
    return (
        [x[i] + Ph[i] * step for i in range(n)],
        symmetric([[P[i][j] - Ph[i] * Ph[j] * weight for j in range(n)] for i in range(n)]),
        s,
    )


def symmetric(M: Matrix) -> Matrix:
    """The matrix whose lower triangle is the upper one, so that rounding cannot pull them apart."""
    return [[M[min(i, j)][max(i, j)] for j in range(len(M))] for i in range(len(M))]


def _dot(pairs: list[tuple[Scalar, Scalar]]) -> Scalar:
    """Sum of factor times scalar; factors that are the numbers 0 or 1 cost nothing."""
    total: Scalar = None
    for factor, scalar in pairs:
        number = float(factor) if isinstance(factor, (int, float)) else None  # a symbol (LPV, EKF) is no number
        if number == 0:
            continue
        term = scalar if number == 1 else (factor if number is None else number) * scalar
        total = term if total is None else total + term
    return 0.0 if total is None else total


def plain(x: Scalar) -> Scalar:
    """A Python float instead of a numpy one, which CasADi would take for a matrix; symbols as they are."""
    return float(x) if isinstance(x, (int, float)) else x
