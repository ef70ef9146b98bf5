"""The tick of the Kalman filter with unknown inputs, on scalars: what its observers and its likelihood share.

    predict   x- = F x + G_0 u_before + G_1 u,   P- = F P F' + Q_d
    update    row by row, where it is fresh:      e = y - C x- - D u,   s = C P- C' + r,   x = x- + P- C' e / s

F, Q_d and r may be numbers or symbols; P starts wide.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from codriver.kernel import Scalar, select
from codriver.observers.covariance import Matrix, plain, predict_covariance, predict_mean, update_row
from codriver.observers.observer import Scalars
from codriver.signals.signal import Array


@dataclass(frozen=True)
class Filter:
    """What a tick needs.

    Attributes:
        F: (n, n) numbers.
        G_0, G_1: (n, m) numbers.
        C, D: (p, n) and (p, m) numbers.
        Q_d: (n, n) numbers or symbols.
        R: p numbers or symbols.
        wide: n variances to start from, numbers or symbols.
    """

    F: Array
    G_0: Array
    G_1: Array
    C: Array
    D: Array
    Q_d: Array | Matrix
    R: Sequence[Scalar]
    wide: Sequence[Scalar]

    @property
    def size(self) -> int:
        """How many states."""
        return int(self.F.shape[0])


@dataclass(frozen=True)
class Moments:
    """Mean and covariance of the state."""

    x: list[Scalar]
    P: Matrix


@dataclass(frozen=True)
class Row:
    """A measured row: its innovation and its variance."""

    e: Scalar
    s: Scalar


def carried(size: int) -> dict[str, float]:
    """The scalars of the moments, all 0: x_0, ..., P_00, P_01, ..."""
    return dict.fromkeys([*(f"x_{i}" for i in range(size)), *(f"P_{i}{j}" for i, j in pairs(size))], 0.0)


def pairs(size: int) -> list[tuple[int, int]]:
    """The upper triangle."""
    return [(i, j) for i in range(size) for j in range(i, size)]


def unpack(carry: Mapping[str, Scalar], size: int) -> Moments:
    """The moments from the carry."""
    P = [[carry[f"P_{min(i, j)}{max(i, j)}"] for j in range(size)] for i in range(size)]
    return Moments([carry[f"x_{i}"] for i in range(size)], P)


def pack(moments: Moments) -> Scalars:
    """The moments as scalars of the carry."""
    n = len(moments.x)
    return {**{f"x_{i}": moments.x[i] for i in range(n)}, **{f"P_{i}{j}": moments.P[i][j] for i, j in pairs(n)}}


def predict(filter: Filter, now: Moments, before: Sequence[Scalar], given: Sequence[Scalar]) -> Moments:
    """The moments a tick on.

    Args:
        filter: the model.
        now: moments of the tick before.
        before, given: known inputs of the tick before and of this one.
    """
    x = predict_mean(now.x, filter.F)
    if given:
        moved, late = predict_mean(before, filter.G_0), predict_mean(given, filter.G_1)
        x = [x[i] + (moved[i] + late[i]) for i in range(filter.size)]
    return Moments(x, predict_covariance(now.P, filter.F, filter.Q_d))


def update(
    filter: Filter, now: Moments, rows: Sequence[Scalar], fresh: Sequence[Scalar], given: Sequence[Scalar]
) -> tuple[Moments, list[Row]]:
    """Take the rows that are there.

    Args:
        filter: the model.
        now: predicted moments.
        rows: measured values; what stands where one is not fresh does not matter.
        fresh: 1 where it is there.
        given: known inputs of this tick.
    """
    x, P, told = now.x, now.P, []
    for k, (value, there) in enumerate(zip(rows, fresh, strict=True)):
        h = [plain(c) for c in filter.C[k]]
        expected: Scalar = 0.0
        for factor, state in zip(h, x, strict=True):
            expected = expected + factor * state if factor != 0 else expected
        for factor, known in zip(filter.D[k], given, strict=True):
            expected = expected + plain(factor) * known if factor != 0 else expected
        e = select(there, value - expected, 0.0)
        seen = [i for i, c in enumerate(h) if c != 0]
        before = P
        x, P, s = update_row(x, P, h, e, filter.R[k], there)
        if len(seen) == 1:
            P = _without_cancelling(before, P, seen[0], select(there, filter.R[k] / s, 1.0))
        told.append(Row(e, s))
    return Moments(x, P), told


def _without_cancelling(before: Matrix, after: Matrix, state: int, share: Scalar) -> Matrix:
    """The updated covariance with the measured state's row as P r / s, which equals P - P P / s and loses no digits.

    An encoder is far better than what a filter knows of the angle behind a gap or a start; in single precision the difference
    would be noise.
    """
    n = len(after)
    row = [share * before[state][j] for j in range(n)]
    return [[row[j] if i == state else row[i] if j == state else after[i][j] for j in range(n)] for i in range(n)]


def chosen(when: Scalar, yes: Moments, no: Moments) -> Moments:
    """`yes` where the flag is 1, else `no`."""
    n = len(no.x)
    return Moments(
        [select(when, yes.x[i], no.x[i]) for i in range(n)],
        [[select(when, yes.P[i][j], no.P[i][j]) for j in range(n)] for i in range(n)],
    )


def started(filter: Filter, x: Sequence[Scalar]) -> Moments:
    """Moments to start from: the mean given, the covariance wide."""
    n = filter.size
    return Moments(list(x), [[filter.wide[i] if i == j else 0.0 for j in range(n)] for i in range(n)])
