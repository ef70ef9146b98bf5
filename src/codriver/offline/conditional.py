"""The state at one tick given that at the next: what a smoother is made of.

With filtered moments x, P of tick k, and the next state F x + b + w, cov w = Q:

    x_k | x_k+1, rows up to k  ~  N(a + G x_k+1, C)
    P- = F P F' + Q,  G = P F' P-^-1,  a = x - G (F x + b),  C = (I - G F) P (I - G F)' + G Q G'

Such conditionals chain to another of the kind,

    x_i | x_k ~ N(m + A x_k, S)   gives   x_i | x_k+1 ~ N(m + A a + A G x_k+1, S + A C A'),

and chaining is associative, which is all that the passes rest on. Over the whole record it is the smoother of Rauch, Tung,
Striebel 1965, doi:10.2514/3.3166; the chains are those of Sarkka, Garcia-Fernandez 2021, doi:10.1109/TAC.2020.2976316.
Everything is on scalars, so that it is recorded and compiled as the observers' steps are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from codriver.kernel import Scalar, select
from codriver.observers.covariance import Matrix, predict_covariance, predict_mean, symmetric
from codriver.signals.signal import Array


@dataclass(frozen=True)
class Conditional:
    """x given another state z: N(m + A z, S), S symmetric."""

    A: Matrix
    m: list[Scalar]
    S: Matrix


def pairs(n: int) -> list[tuple[int, int]]:
    """The upper triangle of n states."""
    return [(i, j) for i in range(n) for j in range(i, n)]


def identity(n: int) -> Conditional:
    """A state of n numbers given itself."""
    return Conditional([[float(i == j) for j in range(n)] for i in range(n)], [0.0] * n, [[0.0] * n for _ in range(n)])


def given_next(
    x: Sequence[Scalar], P: Matrix, shift: Sequence[Scalar], last: Scalar, F: Array, Qd: Array
) -> Conditional:
    """A tick's state given the next tick's.

    Args:
        x, P: filtered mean and covariance of the tick.
        shift: what known inputs add to each state on the way to the next tick.
        last: 1 where nothing is to be learnt from the next tick: the result is then N(x, P) whatever comes.
        F, Qd: transition and process covariance.
    """
    n = len(x)
    ahead = [moved + more for moved, more in zip(predict_mean(x, F), shift, strict=True)]
    FP = [predict_mean([P[k][j] for k in range(n)], F) for j in range(n)]  # column j of F P
    gain = [_solve(predict_covariance(P, F, Qd), column) for column in FP]  # row j of G, since G' = P-^-1 F P
    G: Matrix = [[select(last, 0.0, g) for g in row] for row in gain]
    left = [[float(i == j) - _dot(G[i], [float(F[k, j]) for k in range(n)]) for j in range(n)] for i in range(n)]
    S = sum_of(congruent(left, P), congruent(G, [[float(q) for q in row] for row in Qd]))
    return Conditional(G, [x[i] - _dot(G[i], ahead) for i in range(n)], S)


def chain_of(first: Conditional, then: Conditional) -> Conditional:
    """x given z, from x given y and y given z."""
    n = len(first.m)
    A = [[_dot(first.A[i], [then.A[k][j] for k in range(n)]) for j in range(n)] for i in range(n)]
    m, S = applied(first, then.m, then.S)
    return Conditional(A, m, S)


def applied(one: Conditional, m: Sequence[Scalar], S: Matrix) -> tuple[list[Scalar], Matrix]:
    """Mean and covariance of x, where the state it depends on has the mean m and the covariance S."""
    return [one.m[i] + _dot(one.A[i], m) for i in range(len(m))], sum_of(one.S, congruent(one.A, S))


def chosen(when: Scalar, yes: Conditional, no: Conditional) -> Conditional:
    """`yes` where the flag is 1, else `no`."""
    n = len(no.m)
    pick = lambda a, b: [[select(when, a[i][j], b[i][j]) for j in range(n)] for i in range(n)]  # noqa: E731
    m = [select(when, a, b) for a, b in zip(yes.m, no.m, strict=True)]
    return Conditional(pick(yes.A, no.A), m, pick(yes.S, no.S))


def congruent(A: Matrix, S: Matrix) -> Matrix:
    """A S A', symmetric to the last bit."""
    n = len(S)
    AS = [[_dot(A[i], [S[k][j] for k in range(n)]) for j in range(n)] for i in range(n)]
    return symmetric([[_dot(AS[i], A[j]) if i <= j else 0.0 for j in range(n)] for i in range(n)])


def sum_of(one: Matrix, other: Matrix) -> Matrix:
    """The sum of two symmetric matrices, symmetric to the last bit."""
    n = len(one)
    return symmetric([[one[i][j] + other[i][j] if i <= j else 0.0 for j in range(n)] for i in range(n)])


def _solve(M: Matrix, b: Sequence[Scalar]) -> list[Scalar]:
    """M^-1 b for a positive definite M, by L D L'."""
    n = len(b)
    L: Matrix = [[0.0] * n for _ in range(n)]
    D: list[Scalar] = []
    for j in range(n):
        scaled = [L[j][k] * D[k] for k in range(j)]
        D.append(M[j][j] - _dot(L[j][:j], scaled))
        inverse = 1.0 / D[j]
        for i in range(j + 1, n):
            L[i][j] = (M[i][j] - _dot(L[i][:j], scaled)) * inverse
    y: list[Scalar] = []
    for i in range(n):
        y.append(b[i] - _dot(L[i][:i], y))
    z: list[Scalar] = [0.0] * n
    for i in reversed(range(n)):
        z[i] = y[i] * (1.0 / D[i]) - _dot([L[k][i] for k in range(i + 1, n)], z[i + 1 :])
    return z


def _dot(a: Sequence[Scalar], b: Sequence[Scalar]) -> Scalar:
    """Sum of products; factors that are the numbers 0 or 1 cost nothing once recorded."""
    total: Scalar = 0.0
    for x, y in zip(a, b, strict=True):
        total = total + x * y
    return total
