"""Ridge regression (an ARX model, where the features hold past torques): the linear model that every other has to beat.

    f(z) = y_0 + w' (z - z_0),      w = (Z'Z + alpha I)^-1 Z' (y - y_0)
    sd(z) = s sqrt(1 + 1/n + (z - z_0)' (Z'Z + alpha I)^-1 (z - z_0))

z_0, y_0 are the means of the training rows, Z their features less z_0; the offset is not shrunk. A feature that does not vary has
the weight 0, and what is smaller than the rounding of the largest weight is 0 too.

alpha is chosen by leaving out blocks of rows (`blocks`): for every block one singular value decomposition of the rest,
Z = U S V', gives the error at all alpha at once,

    y - f = (y - y_0) - Z_test V diag(S_i / (S_i^2 + alpha)) U' (y - y_0).

s is taken from the errors e of the blocks left out, each over its own sqrt(1 + 1/n + ...): so the standard deviation is that of
rows never seen, also where the model is wrong and its errors resemble their neighbours'.

A. E. Hoerl, R. W. Kennard 1970, doi 10.1080/00401706.1970.10488634.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np

from codriver.drivers.learned.blocks import block_folds, gap_that_fits
from codriver.drivers.learned.regressor import State, TorqueRegressor
from codriver.drivers.learned.rows import array, rows, training_rows
from codriver.kernel import Scalar, sqrt
from codriver.signals.signal import Array

ALPHAS = np.logspace(-5, 6, 45)  # tried, for standardised features
_LEAST = 1e-9  # a column that varies less than this counts as constant


class Decomposed(NamedTuple):
    """Training rows, ready for any alpha.

    Attributes:
        z_0, y_0: means, shape (d,) and a number.
        S: singular values, shape (d,).
        Vt: right singular vectors as rows, shape (d, d).
        Uy: U' (y - y_0), shape (d,).
        n: rows.
    """

    z_0: Array
    y_0: float
    S: Array
    Vt: Array
    Uy: Array
    n: int

    def weights(self, alpha: float) -> Array:
        """w, shape (d,)."""
        return self.Vt.T @ (self.S / (self.S**2 + alpha) * self.Uy)

    def spread(self, alpha: float) -> Array:
        """G, shape (d, d), with G'G = (Z'Z + alpha I)^-1."""
        return self.Vt / np.sqrt(self.S**2 + alpha)[:, np.newaxis]


def decompose(X: Array, y: Array) -> Decomposed:
    """The singular value decomposition of centred rows; X (n, d), y (n,)."""
    z_0, y_0 = X.mean(axis=0), float(y.mean())
    missing = max(X.shape[1] - X.shape[0], 0)  # rows of zeros, so that there are d singular vectors
    Z = np.vstack([X - z_0, np.zeros((missing, X.shape[1]))])
    U, S, Vt = np.linalg.svd(Z, full_matrices=False)
    return Decomposed(z_0, y_0, S, Vt, U[: X.shape[0]].T @ (y - y_0), X.shape[0])


class RidgeRegressor(TorqueRegressor):
    """Ridge regression with an offset.

    Args:
        alpha: of the shrinking, above 0; None: by leaving out blocks.
        folds: how many blocks.
        gap: rows between a block and the rows learned from.
    """

    kind: ClassVar[str] = "ridge"

    def __init__(self, alpha: float | None = None, folds: int = 5, gap: int = 10) -> None:
        self.alpha, self.folds, self.gap = alpha, folds, gap

    def fit(self, X: Array, y: Array, lengths: Sequence[int] | None = None) -> Self:
        """Learn.

        Args:
            X: features, shape (n, d).
            y: torque, shape (n,).
            lengths: of the stretches, for the gaps between blocks.

        Raises:
            ValueError: alpha is not above 0, or the shapes are wrong.
        """
        if self.alpha is not None and not self.alpha > 0:
            raise ValueError(f"alpha = {self.alpha}; above 0, or None")
        X, y = training_rows(self, X, y, lengths)
        alphas = ALPHAS if self.alpha is None else np.array([float(self.alpha)])
        errors, relative = self._left_out(X, y, alphas, lengths)
        best = int(np.argmin(np.mean(errors**2, axis=1)))
        self.alpha_ = float(alphas[best])
        self.left_out_ = errors[best]
        self.sd_ = float(np.sqrt(np.mean(errors[best] ** 2 / relative[best])))
        whole = decompose(X, y)
        weights = np.where(X.std(axis=0) > _LEAST, whole.weights(self.alpha_), 0.0)
        self._take(whole.z_0, whole.y_0, without_dust(weights), without_dust(whole.spread(self.alpha_)), whole.n)
        return self

    def _left_out(self, X: Array, y: Array, alphas: Array, lengths: Sequence[int] | None) -> tuple[Array, Array]:
        """Errors of rows left out, and their variances over s^2; both of shape (alphas, n)."""
        n = y.size
        errors, relative = np.empty((alphas.size, n)), np.empty((alphas.size, n))
        for train, test in block_folds(n, min(self.folds, n), gap_that_fits(n, self.gap), lengths):
            part = decompose(X[train], y[train])
            Z = (X[test] - part.z_0) @ part.Vt.T
            kept = 1.0 / (part.S**2 + alphas[:, np.newaxis])
            errors[:, test] = (y[test] - part.y_0) - (kept * part.S * part.Uy) @ Z.T
            relative[:, test] = 1.0 + 1.0 / part.n + kept @ (Z**2).T
        return errors, relative

    def _take(self, z_0: Array, y_0: float, w: Array, G: Array, n: int) -> None:
        """What predictions are made from."""
        self.centre_, self.offset_, self.coef_, self.spread_, self.rows_ = z_0, y_0, w, G, n
        self.n_features_in_ = w.size

    def predict(self, X: Array, return_std: bool = False, lengths: Sequence[int] | None = None) -> Any:
        """Mean, shape (n,); with `return_std` also the standard deviation of a new observation, shape (n,)."""
        Z = rows(self, X, lengths) - self.centre_
        mean = self.offset_ + Z @ self.coef_
        if not return_std:
            return mean
        relative = np.einsum("ij,ij->i", G := Z @ self.spread_.T, G)
        return mean, self.sd_ * np.sqrt(1.0 + 1.0 / self.rows_ + relative)

    def state(self) -> State:
        """Weights, means, the factor G of the variance, s, alpha and n."""
        return {
            "centre": self.centre_, "offset": self.offset_, "coef": self.coef_, "spread": self.spread_,
            "rows": self.rows_, "sd": self.sd_, "alpha": self.alpha_,
        }  # fmt: skip

    def restore(self, state: Mapping[str, Any]) -> Self:
        """Take over what `state` gave; arrays may come as lists."""
        self.sd_, self.alpha_ = float(state["sd"]), float(state["alpha"])
        self._take(
            array(state, "centre"), float(state["offset"]), array(state, "coef"), array(state, "spread"),
            int(state["rows"]),
        )  # fmt: skip
        return self

    def step(self, carry: Mapping[str, Scalar], z: Sequence[Scalar]) -> tuple[dict[str, Scalar], Scalar, Scalar]:
        """One prediction on scalars."""
        off = [z_i - z_0 for z_i, z_0 in zip(z, self.centre_.tolist(), strict=True)]
        mean = self.offset_ + dot(self.coef_, off)
        parts = [dot(row, off) for row in self.spread_]
        return {}, mean, self.sd_ * sqrt(1.0 + 1.0 / self.rows_ + sum(part * part for part in parts))


def without_dust(weights: Array) -> Array:
    """Weights, with 0 for those that are smaller than the rounding of the largest; single precision cannot even hold some."""
    return np.where(np.abs(weights) > np.finfo(np.float64).eps * np.abs(weights).max(initial=0.0), weights, 0.0)


def dot(weights: Array, values: Sequence[Scalar]) -> Scalar:
    """Sum of products on scalars."""
    return sum(weight * value for weight, value in zip(weights.tolist(), values, strict=True))
