"""The two models that every other has to beat: the torque stays as it was, or goes on as it went.

    T(t_k) = T(t_{k-1})                                                      2019 eq. (3), piecewise constant
    T(t_k) = T(t_{k-1}) + h (T(t_{k-1}) - T(t_{k-2}))                        2019 eq. (4)-(5), piecewise linear

with h the number of ticks extrapolated: 1 in the paper, more where the torque further ahead is asked for. They learn one number:
the rms residual s on the training rows, which is their standard deviation.

The torque's columns of X and y must have been scaled by the same offset and factor: these models pass columns through.

Okamoto, Tsiotras 2019, section 2.2.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Self

import numpy as np

from codriver.drivers.learned.regressor import State, TorqueRegressor
from codriver.drivers.learned.rows import rows, training_rows
from codriver.kernel import Scalar
from codriver.signals.signal import Array


class _Passing(TorqueRegressor):
    """A weighted sum of columns, weights given."""

    @abstractmethod
    def _weights(self) -> dict[int, float]:
        """Weight by column."""

    def _sum(self, column: Any) -> Any:
        """The weighted sum of what `column(place)` gives."""
        terms = [
            weight * column(place) if weight != 1.0 else column(place) for place, weight in self._weights().items()
        ]
        return sum(terms[1:], start=terms[0])

    def _refuse_columns(self, d: int) -> None:
        """ValueError where X has no such column."""
        for place in self._weights():
            if not 0 <= place < d:
                raise ValueError(f"X has {d} feature(s), columns 0 to {d - 1}; the torque is to be in column {place}")

    def fit(self, X: Array, y: Array, lengths: Sequence[int] | None = None) -> Self:
        """Learn the standard deviation.

        Args:
            X: features, shape (n, d), torque scaled as y is.
            y: torque, shape (n,).
            lengths: of the stretches; they make no difference.
        """
        X, y = training_rows(self, X, y, lengths)
        self._refuse_columns(X.shape[1])
        self.sd_ = float(np.sqrt(np.mean((y - self._sum(lambda place: X[:, place])) ** 2)))
        return self

    def predict(self, X: Array, return_std: bool = False, lengths: Sequence[int] | None = None) -> Any:
        """Mean, and with `return_std` the rms residual of the training rows, both of shape (n,)."""
        X = rows(self, X, lengths)
        mean = np.array(self._sum(lambda place: X[:, place]))
        return (mean, np.full(mean.size, self.sd_)) if return_std else mean

    def state(self) -> State:
        """The standard deviation and the number of features."""
        return {"features": self.n_features_in_, "sd": self.sd_}

    def restore(self, state: Mapping[str, Any]) -> Self:
        """Take over what `state` gave."""
        self.n_features_in_, self.sd_ = int(state["features"]), float(state["sd"])
        self._refuse_columns(self.n_features_in_)
        return self

    def step(self, carry: Mapping[str, Scalar], z: Sequence[Scalar]) -> tuple[dict[str, Scalar], Scalar, Scalar]:
        """One prediction on scalars."""
        return {}, self._sum(lambda place: z[place]), self.sd_

    def __sklearn_tags__(self) -> Any:
        """For scikit-learn's checks: no good regression of whatever data."""
        tags = super().__sklearn_tags__()
        tags.regressor_tags.poor_score = True
        return tags


class PiecewiseConstant(_Passing):
    """The torque stays as it was.

    Args:
        last: column of T(t_{k-1}).
    """

    kind: ClassVar[str] = "pwc"

    def __init__(self, last: int = 0) -> None:
        self.last = last

    def _weights(self) -> dict[int, float]:
        return {self.last: 1.0}


class PiecewiseLinear(_Passing):
    """The torque goes on as it went.

    Args:
        last: column of T(t_{k-1}).
        before: column of T(t_{k-2}).
        ahead: h, ticks from t_{k-1} to the torque asked for.
    """

    kind: ClassVar[str] = "pwl"

    def __init__(self, last: int = 0, before: int = 1, ahead: float = 1.0) -> None:
        self.last, self.before, self.ahead = last, before, ahead

    def _weights(self) -> dict[int, float]:
        if self.last == self.before:
            raise ValueError(f"both torques in column {self.last}; T(k-1) and T(k-2) are different columns")
        return {self.last: 1.0 + self.ahead, self.before: -self.ahead}
