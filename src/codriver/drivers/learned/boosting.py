"""Gradient boosting on what a ridge regression leaves.

    f(z) = ridge(z) + eta sum_{m=1}^M tree_m(z)

Each tree is fitted to what ridge and the trees before it leave of the training rows, on half of them, drawn afresh, with a third of
the features tried at each node. Trees are shallow: one of depth 2 is an interaction of two features.

M is chosen by leaving out blocks of rows (`blocks`), each time with a ridge regression of the rest and trees on its residuals; it
may be 0, and then this is the ridge regression. The standard deviation is the rms error of all rows so left out, the same
everywhere: neither far features nor noisy stretches widen it.

The trees learn from the residuals of the rows that ridge itself learned from. Residuals of rows left out from ridge were tried: on
200 to 4500 rows of 29 features they were nowhere better, on 200 rows 1 to 5 % worse, as their jumps from block to block are noise.

In the kernel a tree of depth 2 is 3 comparisons and 3 selections.

J. H. Friedman 2002, doi 10.1016/S0167-9473(01)00065-2.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Self

import numpy as np

from codriver.drivers.learned.blocks import block_folds, gap_that_fits
from codriver.drivers.learned.regressor import State, TorqueRegressor
from codriver.drivers.learned.ridge import RidgeRegressor
from codriver.drivers.learned.rows import rows, training_rows
from codriver.drivers.learned.trees import Trees
from codriver.kernel import Scalar, select
from codriver.signals.signal import Array

DRAWN = 0.5  # of the rows, for each tree
TRIED = 1.0 / 3.0  # of the features, at each node


class BoostedRidge(TorqueRegressor):
    """Ridge regression and shallow trees on its residual.

    Args:
        trees: M at most.
        depth: of each tree.
        rate: eta.
        leaf: rows in a leaf, at least.
        folds: blocks left out in turn.
        gap: rows between a block and the rows learned from.
        random_state: of the rows and features drawn; a number gives the same trees every time.
    """

    kind: ClassVar[str] = "boosting"

    def __init__(
        self,
        trees: int = 200,
        depth: int = 2,
        rate: float = 0.1,
        leaf: int = 20,
        folds: int = 5,
        gap: int = 10,
        random_state: Any = 0,
    ) -> None:
        self.trees, self.depth, self.rate, self.leaf = trees, depth, rate, leaf
        self.folds, self.gap, self.random_state = folds, gap, random_state

    def fit(self, X: Array, y: Array, lengths: Sequence[int] | None = None) -> Self:
        """Learn.

        Args:
            X: features, shape (n, d).
            y: torque, shape (n,).
            lengths: of the stretches, for the gaps between blocks.

        Raises:
            ValueError: a setting is out of its range, or the shapes are wrong.
        """
        X, y = training_rows(self, X, y, lengths)
        errors = self._left_out(X, y, lengths)
        best = int(np.argmin(np.mean(errors**2, axis=1)))
        self.sd_ = float(np.sqrt(np.mean(errors[best] ** 2)))
        self.ridge_ = RidgeRegressor(folds=self.folds, gap=self.gap).fit(X, y, lengths)
        grown = self._grow(X, y - self.ridge_.predict(X), best).estimators_[:, 0] if best else ()
        self.trees_ = Trees.of((tree.tree_ for tree in grown), self.rate)
        return self

    def _left_out(self, X: Array, y: Array, lengths: Sequence[int] | None) -> Array:
        """Errors of rows left out, shape (trees + 1, n): with 0, 1, ... trees."""
        n = y.size
        errors = np.empty((self.trees + 1, n))
        for train, test in block_folds(n, min(self.folds, n), gap_that_fits(n, self.gap), lengths):
            if train.size < 2:
                errors[:, test] = y[test] - y[train].mean()
                continue
            ridge = RidgeRegressor(folds=self.folds, gap=self.gap).fit(X[train], y[train])
            errors[:, test] = y[test] - ridge.predict(X[test])
            grown = self._grow(X[train], y[train] - ridge.predict(X[train]), self.trees)
            errors[1:, test] -= np.array(list(grown.staged_predict(X[test])))
        return errors

    def _grow(self, X: Array, residual: Array, trees: int) -> Any:
        """Trees on a residual."""
        from sklearn.ensemble import GradientBoostingRegressor

        return GradientBoostingRegressor(
            n_estimators=trees, max_depth=self.depth, learning_rate=self.rate, min_samples_leaf=self.leaf,
            subsample=DRAWN, max_features=TRIED, init="zero", random_state=self.random_state,
        ).fit(X, residual)  # fmt: skip

    def predict(self, X: Array, return_std: bool = False, lengths: Sequence[int] | None = None) -> Any:
        """Mean, and with `return_std` the rms error of rows left out, both of shape (n,)."""
        X = rows(self, X, lengths)
        columns = np.asfortranarray(X)
        mean = self.trees_.total(self.ridge_.predict(X), lambda feature: columns[:, feature], np.where)
        return (mean, np.full(mean.size, self.sd_)) if return_std else mean

    def state(self) -> State:
        """The ridge regression's state, the trees as arrays, the standard deviation."""
        return {"ridge": self.ridge_.state(), "trees": self.trees_.state(), "sd": self.sd_}

    def restore(self, state: Mapping[str, Any]) -> Self:
        """Take over what `state` gave; arrays may come as lists."""
        self.ridge_ = RidgeRegressor(folds=self.folds, gap=self.gap).restore(state["ridge"])
        self.trees_, self.sd_ = Trees.restored(state["trees"]), float(state["sd"])
        self.n_features_in_ = self.ridge_.n_features_in_
        return self

    def step(self, carry: Mapping[str, Scalar], z: Sequence[Scalar]) -> tuple[dict[str, Scalar], Scalar, Scalar]:
        """One prediction on scalars."""
        linear = self.ridge_.step({}, z)[1]
        return {}, self.trees_.total(linear, lambda feature: z[feature], select), self.sd_
