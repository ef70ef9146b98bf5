"""An artificial neural network with one hidden layer.

    f(z) = W_o' tanh(W_h z + b_h) + b_o                                      2019 eq. (26), N_h hidden units

Training minimises, by Levenberg's and Marquardt's method with the exact derivative J = df/dw (`least_squares`),

    sum (y - f)^2 + alpha |w|^2,      w all weights but b_o

from several random starts. A fifth of the rows, as blocks with a gap (`blocks`), is held out: a start stops where its error
there has not fallen for some steps, and goes back to where it was least; the start with the least error there wins. Then it goes on
from the winner with all rows, with as many steps as the winner took at most (`refit`).

    sd(z)^2 = s^2 (1 + J H^-1 J'),      H = sum J'J + alpha I                (Laplace's approximation, Gauss-Newton Hessian)

so the standard deviation grows away from the training rows, as far as the weights are free there. s is taken from the errors of the
rows held out, each over its own sqrt(1 + J H^-1 J').

Okamoto, Tsiotras 2019, section 2.6. D. J. C. MacKay 1992, doi 10.1162/neco.1992.4.3.448. L. Prechelt 1998,
doi 10.1016/S0893-6080(98)00010-0 (when to stop).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
from scipy.linalg import cholesky, solve_triangular

from codriver.drivers.learned.blocks import gap_that_fits, held_out
from codriver.drivers.learned.least_squares import Trained, train
from codriver.drivers.learned.regressor import State, TorqueRegressor
from codriver.drivers.learned.ridge import dot
from codriver.drivers.learned.rows import array, rows, training_rows
from codriver.kernel import Scalar, sqrt
from codriver.signals.signal import Array

SHARE = 0.2  # of the rows held out
_CHUNK = 20_000  # rows of J at a time


class Weights(NamedTuple):
    """W_h (N_h, d), b_h (N_h,), W_o (N_h,), b_o."""

    W_h: Array
    b_h: Array
    W_o: Array
    b_o: float

    @classmethod
    def of(cls, w: Array, d: int) -> Weights:
        """From one vector of N_h (d + 2) + 1."""
        hidden = (w.size - 1) // (d + 2)
        edge = hidden * d
        return cls(w[:edge].reshape(hidden, d), w[edge : edge + hidden], w[edge + hidden : -1], float(w[-1]))


def output(w: Array, X: Array) -> Array:
    """f at rows X (n, d), shape (n,); w as one vector."""
    net = Weights.of(w, X.shape[1])
    return np.tanh(X @ net.W_h.T + net.b_h) @ net.W_o + net.b_o


def output_and_jacobian(w: Array, X: Array) -> tuple[Array, Array]:
    """f, shape (n,), and df/dw, shape (n, N_h (d + 2) + 1)."""
    n, d = X.shape
    net = Weights.of(w, d)
    phi = np.tanh(X @ net.W_h.T + net.b_h)
    slope = (1.0 - phi**2) * net.W_o
    J = np.empty((n, w.size))
    J[:, : slope.shape[1] * d] = (slope[:, :, np.newaxis] * X[:, np.newaxis, :]).reshape(n, -1)
    J[:, slope.shape[1] * d :] = np.hstack([slope, phi, np.ones((n, 1))])
    return phi @ net.W_o + net.b_o, J


class NetworkRegressor(TorqueRegressor):
    """A neural network with one hidden layer of tanh.

    Args:
        hidden: N_h.
        restarts: random starts.
        alpha: weight decay, above 0.
        max_steps: of one start.
        patience: steps without a lower error on the held-out rows, after which a start stops.
        gap: rows between the held-out blocks and the others.
        refit: go on with all rows at the end.
        random_state: of the starts; a number gives the same network every time.
    """

    kind: ClassVar[str] = "ann"

    def __init__(
        self,
        hidden: int = 2,
        restarts: int = 5,
        alpha: float = 0.01,
        max_steps: int = 200,
        patience: int = 10,
        gap: int = 10,
        refit: bool = True,
        random_state: Any = 0,
    ) -> None:
        self.hidden, self.restarts, self.alpha, self.max_steps = hidden, restarts, alpha, max_steps
        self.patience, self.gap, self.refit, self.random_state = patience, gap, refit, random_state

    def fit(self, X: Array, y: Array, lengths: Sequence[int] | None = None) -> Self:
        """Learn.

        Args:
            X: features, standardised, shape (n, d).
            y: torque, standardised, shape (n,).
            lengths: of the stretches, for the gaps round the held-out blocks.

        Raises:
            ValueError: no hidden unit, no start, alpha not above 0, or wrong shapes.
        """
        from sklearn.utils import check_random_state

        if self.hidden < 1 or self.restarts < 1 or not self.alpha > 0:
            raise ValueError(
                f"hidden = {self.hidden}, restarts = {self.restarts}, alpha = {self.alpha}; 1 or more, 1 or more, above 0"
            )
        X, y = training_rows(self, X, y, lengths)
        random = check_random_state(self.random_state)
        learned, kept = held_out(y.size, SHARE, gap_that_fits(y.size, self.gap), lengths)
        decay = np.full(self.hidden * (X.shape[1] + 2) + 1, float(self.alpha))
        decay[-1] = 0.0
        starts = [start(random, self.hidden, X[learned], y[learned]) for _ in range(self.restarts)]
        ends = [
            train(output_and_jacobian, output, w, (X[learned], y[learned]), (X[kept], y[kept]), decay, self.max_steps,
                  self.patience)
            for w in starts
        ]  # fmt: skip
        best: Trained = min(ends, key=lambda end: end.judged)
        self.held_out_errors_ = np.sort([end.judged for end in ends])
        self.steps_ = best.steps
        factor = self._factor(best.w, X[learned], decay)
        relative = 1.0 + np.sum(self._spread(best.w, factor, X[kept]) ** 2, axis=1)
        self.sd_ = float(np.sqrt(np.mean((y[kept] - output(best.w, X[kept])) ** 2 / relative)))
        w = best.w
        if self.refit:
            w = train(output_and_jacobian, output, w, (X, y), None, decay, max(best.steps, 1), self.patience).w
            factor = self._factor(w, X, decay)
        self._take(w, np.asarray(factor), X.shape[1])
        return self

    @staticmethod
    def _factor(w: Array, X: Array, decay: Array) -> Array:
        """Lower L with H = L L'."""
        J = output_and_jacobian(w, X)[1]
        return np.asarray(cholesky(J.T @ J + np.diag(decay), lower=True))

    @staticmethod
    def _spread(w: Array, factor: Array, X: Array) -> Array:
        """L^-1 J' as rows, shape (n, p)."""
        return np.asarray(solve_triangular(factor, output_and_jacobian(w, X)[1].T, lower=True)).T

    def _take(self, w: Array, factor: Array, d: int) -> None:
        """What predictions are made from."""
        self.weights_, self.factor_, self.n_features_in_ = w, factor, d
        self.inverse_ = np.asarray(solve_triangular(factor, np.eye(w.size), lower=True))

    def predict(self, X: Array, return_std: bool = False, lengths: Sequence[int] | None = None) -> Any:
        """Mean, shape (n,); with `return_std` also the standard deviation of a new observation, shape (n,)."""
        X = rows(self, X, lengths)
        mean = output(self.weights_, X)
        if not return_std:
            return mean
        relative = np.empty(mean.size)
        for first in range(0, mean.size, _CHUNK):
            part = slice(first, first + _CHUNK)
            V = output_and_jacobian(self.weights_, X[part])[1] @ self.inverse_.T
            relative[part] = np.einsum("ij,ij->i", V, V)
        return mean, self.sd_ * np.sqrt(1.0 + relative)

    def state(self) -> State:
        """All weights as one vector, the factor L of H, s."""
        return {"features": self.n_features_in_, "weights": self.weights_, "factor": self.factor_, "sd": self.sd_}

    def restore(self, state: Mapping[str, Any]) -> Self:
        """Take over what `state` gave; arrays may come as lists."""
        self.sd_ = float(state["sd"])
        self._take(array(state, "weights"), array(state, "factor"), int(state["features"]))
        return self

    def step(self, carry: Mapping[str, Scalar], z: Sequence[Scalar]) -> tuple[dict[str, Scalar], Scalar, Scalar]:
        """One prediction on scalars."""
        import casadi as ca

        net = Weights.of(self.weights_, self.n_features_in_)
        phi = [ca.tanh(dot(row, z) + b) for row, b in zip(net.W_h, net.b_h.tolist(), strict=True)]
        slope = [w * (1.0 - p * p) for w, p in zip(net.W_o.tolist(), phi, strict=True)]
        J = [*(g * z_i for g in slope for z_i in z), *slope, *phi, 1.0]
        parts = [dot(row[: i + 1], J[: i + 1]) for i, row in enumerate(self.inverse_)]
        return {}, dot(net.W_o, phi) + net.b_o, self.sd_ * sqrt(1.0 + sum(part * part for part in parts))


def start(random: Any, hidden: int, X: Array, y: Array) -> Array:
    """Random weights: hidden units with inputs of about unit variance, the output layer by least squares."""
    d = X.shape[1]
    W_h = random.standard_normal((hidden, d)) / np.sqrt(d)
    b_h = 0.5 * random.standard_normal(hidden)
    phi = np.column_stack([np.tanh(X @ W_h.T + b_h), np.ones(y.size)])
    last = np.linalg.solve(phi.T @ phi + 1e-3 * y.size * np.diag([*[1.0] * hidden, 0.0]), phi.T @ y)
    return np.concatenate([W_h.ravel(), b_h, last])
