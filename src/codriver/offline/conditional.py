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
from codriver.observers.covariance import Matrix, predict_covariance, predict_mean
from codriver.signals.signal import Array

N = 4
PAIRS = [(i, j) for i in range(N) for j in range(i, N)]


@dataclass(frozen=True)
class Conditional:
    """x given another state z: N(m + A z, S), S symmetric."""

    A: Matrix
    m: list[Scalar]
    S: Matrix


def identity() -> Conditional:
    """A state given itself."""
    return Conditional([[float(i == j) for j in range(N)] for i in range(N)], [0.0] * N, [[0.0] * N for _ in range(N)])


def given_next(x: Sequence[Scalar], P: Matrix, shift: Scalar, last: Scalar, F: Array, Qd: Array) -> Conditional:
    """A tick's state given the next tick's.

    Args:
        x, P: filtered mean and covariance of the tick.
        shift: what the known input adds to the first state on the way to the next tick.
        last: 1 where nothing is to be learnt from the next tick: the result is then N(x, P) whatever comes.
        F, Qd: transition and process covariance.
    """
    ahead = predict_mean(x, F)
    ahead[0] = ahead[0] + shift
    FP = [predict_mean([P[k][j] for k in range(N)], F) for j in range(N)]  # column j of F P
    gain = [_solve(predict_covariance(P, F, Qd), column) for column in FP]  # row j of G, since G' = P-^-1 F P
    G: Matrix = [[select(last, 0.0, g) for g in row] for row in gain]
    left = [[float(i == j) - _dot(G[i], [float(F[k, j]) for k in range(N)]) for j in range(N)] for i in range(N)]
    S = sum_of(congruent(left, P), congruent(G, [[float(q) for q in row] for row in Qd]))
    return Conditional(G, [x[i] - _dot(G[i], ahead) for i in range(N)], S)


def chain_of(first: Conditional, then: Conditional) -> Conditional:
    """x given z, from x given y and y given z."""
    A = [[_dot(first.A[i], [then.A[k][j] for k in range(N)]) for j in range(N)] for i in range(N)]
    m, S = applied(first, then.m, then.S)
    return Conditional(A, m, S)


def applied(one: Conditional, m: Sequence[Scalar], S: Matrix) -> tuple[list[Scalar], Matrix]:
    """Mean and covariance of x, where the state it depends on has the mean m and the covariance S."""
    return [one.m[i] + _dot(one.A[i], m) for i in range(N)], sum_of(one.S, congruent(one.A, S))


def chosen(when: Scalar, yes: Conditional, no: Conditional) -> Conditional:
    """`yes` where the flag is 1, else `no`."""
    pick = lambda a, b: [[select(when, a[i][j], b[i][j]) for j in range(N)] for i in range(N)]  # noqa: E731
    m = [select(when, a, b) for a, b in zip(yes.m, no.m, strict=True)]
    return Conditional(pick(yes.A, no.A), m, pick(yes.S, no.S))


def congruent(A: Matrix, S: Matrix) -> Matrix:
    """A S A', symmetric to the last bit."""
    AS = [[_dot(A[i], [S[k][j] for k in range(N)]) for j in range(N)] for i in range(N)]
    upper = {(i, j): _dot(AS[i], A[j]) for i, j in PAIRS}
    return [[upper[min(i, j), max(i, j)] for j in range(N)] for i in range(N)]


def sum_of(one: Matrix, other: Matrix) -> Matrix:
    """The sum of two symmetric matrices, symmetric to the last bit."""
    upper = {(i, j): one[i][j] + other[i][j] for i, j in PAIRS}
    return [[upper[min(i, j), max(i, j)] for j in range(N)] for i in range(N)]


def _solve(M: Matrix, b: Sequence[Scalar]) -> list[Scalar]:
    """M^-1 b for a positive definite M, by L D L'."""
    L: Matrix = [[0.0] * N for _ in range(N)]
    D: list[Scalar] = []
    for j in range(N):
        scaled = [L[j][k] * D[k] for k in range(j)]
        D.append(M[j][j] - _dot(L[j][:j], scaled))
        inverse = 1.0 / D[j]
        for i in range(j + 1, N):
            L[i][j] = (M[i][j] - _dot(L[i][:j], scaled)) * inverse
    y: list[Scalar] = []
    for i in range(N):
        y.append(b[i] - _dot(L[i][:i], y))
    z: list[Scalar] = [0.0] * N
    for i in reversed(range(N)):
        z[i] = y[i] * (1.0 / D[i]) - _dot([L[k][i] for k in range(i + 1, N)], z[i + 1 :])
    return z


def _dot(a: Sequence[Scalar], b: Sequence[Scalar]) -> Scalar:
    """Sum of products; factors that are the numbers 0 or 1 cost nothing once recorded."""
    total: Scalar = 0.0
    for x, y in zip(a, b, strict=True):
        total = total + x * y
    return total
