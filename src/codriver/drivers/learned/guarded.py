"""The default: boosted ridge on the change of the torque, which says less the further a moment is from all it has learnt.

    f(z) = T(t_k) + g clip(x' w + 1/2 sum of trees(x)),     g = 1 / (1 + max(h / h_99 - 1, 0)),     h = x' (C + I / 1000)^-1 x

x are the features as newest values and differences from them, standardised; C is their covariance on the training rows, h_99 the
99 % quantile of h there; no change is foretold that is beyond the least and greatest one learnt from. Inside what was learnt g is
1. Where a drive goes beyond it (sharper bends, other speeds), a linear model's error grows without bound; there g takes f back to
"the torque stays" (3), which holds for any drive. Trees count half: what they add on one's own drives only half carries over.

Features are not cut off one by one: neighbours in time stand in the sum with opposite signs, and cutting one of them alone made
rides of four minutes up to 1.6 times as bad as ridge.

    sd(z) = g s + (1 - g) s_3,     s: rms error on blocks left out,     s_3: rms change of the torque over the horizon

The ridge part is `ridge`, shrunk towards no change; the trees are stochastic boosting on what it leaves, of a size that is fixed.

Friedman 2002, doi:10.1016/S0167-9473(01)00065-2.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Self

import numpy as np

from codriver.drivers.learned.blocks import block_folds, gap_that_fits
from codriver.drivers.learned.regressor import State, TorqueRegressor
from codriver.drivers.learned.ridge import RidgeRegressor, dot, without_dust
from codriver.drivers.learned.rows import array, rows, training_rows
from codriver.drivers.learned.trees import Trees
from codriver.kernel import Scalar, select
from codriver.signals.signal import Array

FAR = 0.99  # quantile of h beyond which a row is far
SOFT = 1e-3  # added to C, so that a direction in which the training rows hardly vary does not decide alone
TREES_COUNT = 0.5
LEAF = 0.01  # of the rows: no leaf speaks for less
_LEAST = 1e-9  # a column that varies less than this counts as constant


class GuardedRegressor(TorqueRegressor):
    """Boosted ridge on the change, guarded.

    Args:
        last: column of the newest torque, scaled as y is.
        newest: for each column the column with the newest value of its signal (itself, for the newest); None: all are newest.
        trees: how many.
        depth: of a tree.
        rate: of learning.
        folds: blocks left out in turn, for the standard deviation.
        gap: rows between a block and the rows learnt from.
        random_state: of the rows and features drawn; a number gives the same trees every time.
    """

    kind: ClassVar[str] = "guarded"

    def __init__(
        self, last: int = 0, newest: Sequence[int] | None = None, trees: int = 80, depth: int = 3, rate: float = 0.05,
        folds: int = 3, gap: int = 10, random_state: Any = 0,
    ) -> None:  # fmt: skip
        self.last, self.newest, self.trees, self.depth, self.rate = last, newest, trees, depth, rate
        self.folds, self.gap, self.random_state = folds, gap, random_state

    def fit(self, X: Array, y: Array, lengths: Sequence[int] | None = None) -> Self:
        """Learn; see `TorqueRegressor.fit`.

        Raises:
            ValueError: X has no column `last`, `newest` does not fit X, or the shapes are wrong.
        """
        X, y = training_rows(self, X, y, lengths)
        d, n = X.shape[1], y.size
        if not 0 <= self.last < d:
            raise ValueError(f"X has {d} feature(s); the newest torque is to be in column {self.last}")
        if self.newest is not None and (len(self.newest) != d or not all(0 <= k < d for k in self.newest)):
            raise ValueError(f"newest names {len(self.newest)} columns; X has {d} feature(s)")
        errors = np.empty(n)
        for train, test in block_folds(n, min(self.folds, n), gap_that_fits(n, self.gap), lengths):
            self._learn(X[train], y[train])
            errors[test] = y[test] - self._mean(X[test])[0]
        change = y - X[:, self.last]
        self.sd_, self.change_sd_ = float(np.sqrt(np.mean(errors**2))), float(np.sqrt(np.mean(change**2)))
        self._learn(X, y)
        return self

    def _learn(self, X: Array, y: Array) -> None:
        """Everything but the standard deviations."""
        D = X - self._base(X)
        self.centre_ = D.mean(axis=0)
        size = D.std(axis=0)
        self.size_ = np.where(size > _LEAST, size, 1.0)
        x = (D - self.centre_) / self.size_
        # h = |R x|^2.
        covariance = x.T @ x / len(x) + SOFT * np.eye(x.shape[1])
        self.root_ = without_dust(np.linalg.inv(np.linalg.cholesky(covariance)))
        self.far_ = max(float(np.quantile(np.sum((x @ self.root_.T) ** 2, axis=1), FAR)), _LEAST)
        change = y - X[:, self.last]
        self.least_, self.most_ = float(change.min()), float(change.max())
        self.ridge_ = RidgeRegressor(folds=self.folds, gap=self.gap).fit(x, change)
        self.trees_ = self._grow(x, change - self.ridge_.predict(x))

    def _base(self, X: Array) -> Array:
        """What is taken off each column: the newest value of its signal, of the newest nothing."""
        if self.newest is None:
            return np.zeros_like(X)
        newest = np.asarray(self.newest)
        return np.where(newest == np.arange(newest.size), 0.0, X[:, newest])

    def _grow(self, x: Array, residual: Array) -> Trees:
        """Trees on a residual."""
        from sklearn.ensemble import GradientBoostingRegressor

        grown = GradientBoostingRegressor(
            n_estimators=self.trees, max_depth=self.depth, learning_rate=self.rate,
            min_samples_leaf=max(1, round(LEAF * residual.size)), subsample=0.5, max_features=1 / 3, init="zero",
            random_state=self.random_state,
        ).fit(x, residual)  # fmt: skip
        return Trees.of((tree.tree_ for tree in grown.estimators_[:, 0]), TREES_COUNT * self.rate)

    def _mean(self, X: Array) -> tuple[Array, Array]:
        """Mean and guard g, shape (n,) each."""
        x = (X - self._base(X) - self.centre_) / self.size_
        far = np.sum((x @ self.root_.T) ** 2, axis=1) / self.far_
        guard = 1 / (1 + np.maximum(far - 1, 0.0))
        columns = np.asfortranarray(x)
        change = self.trees_.total(self.ridge_.predict(x), lambda k: columns[:, k], np.where)
        return X[:, self.last] + guard * np.clip(change, self.least_, self.most_), guard

    def predict(self, X: Array, return_std: bool = False, lengths: Sequence[int] | None = None) -> Any:
        """Mean, and with `return_std` the standard deviation, both of shape (n,)."""
        mean, guard = self._mean(rows(self, X, lengths))
        return (mean, guard * self.sd_ + (1 - guard) * self.change_sd_) if return_std else mean

    def state(self) -> State:
        """Scaling, distance, limits of the change, ridge, trees and standard deviations."""
        return {
            "centre": self.centre_, "size": self.size_, "root": self.root_, "far": self.far_, "least": self.least_,
            "most": self.most_, "ridge": self.ridge_.state(), "trees": self.trees_.state(), "sd": self.sd_,
            "change_sd": self.change_sd_,
        }  # fmt: skip

    def restore(self, state: Mapping[str, Any]) -> Self:
        """Take over what `state` gave; arrays may come as lists."""
        for name in ("centre", "size", "root"):
            setattr(self, f"{name}_", array(state, name))
        self.ridge_ = RidgeRegressor(folds=self.folds, gap=self.gap).restore(state["ridge"])
        self.trees_ = Trees.restored(state["trees"])
        for name in ("far", "least", "most", "sd", "change_sd"):
            setattr(self, f"{name}_", float(state[name]))
        self.n_features_in_ = self.centre_.size
        return self

    def step(self, carry: Mapping[str, Scalar], z: Sequence[Scalar]) -> tuple[dict[str, Scalar], Scalar, Scalar]:
        """One prediction on scalars."""
        newest = range(len(z)) if self.newest is None else self.newest
        off = [value if k == j else value - z[k] for j, (value, k) in enumerate(zip(z, newest, strict=True))]
        x = [(v - c) / s for v, c, s in zip(off, self.centre_.tolist(), self.size_.tolist(), strict=True)]
        parts = [dot(row, x) for row in self.root_]
        far = sum(part * part for part in parts) / self.far_
        guard = 1 / (1 + select(far > 1, far - 1, 0.0))
        linear = self.ridge_.offset_ + dot(
            self.ridge_.coef_, [v - c for v, c in zip(x, self.ridge_.centre_.tolist(), strict=True)]
        )
        change = self.trees_.total(linear, lambda k: x[k], select)
        change = select(change < self.least_, self.least_, select(change > self.most_, self.most_, change))
        return {}, z[self.last] + guard * change, guard * self.sd_ + (1 - guard) * self.change_sd_
