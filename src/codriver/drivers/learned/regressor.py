"""What a learned driver is made of: a regression of the torque on features, with a standard deviation.

    T(t_k) = f(z(t_k))                                                       2019 eq. (2)

A `TorqueRegressor` is a scikit-learn regressor: `fit(X, y)`, `predict(X)`, parameters by `get_params`, so it works in a
`Pipeline`, in `cross_validate` and in `GridSearchCV`. Beyond that it tells its standard deviation, it is stored as plain numbers
(no pickle), and where it can be it has a step for the kernel, from which an `Observer` and C code are made.

Rows of a record are in the order of time. Models with a memory take `lengths`, the lengths of the stretches without holes that X is
made of, one after the other; to others the rows are independent.

Okamoto, Tsiotras 2019 (Robotics and Autonomous Systems), section 2.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, ClassVar, Self

import numpy as np
from sklearn.base import BaseEstimator, RegressorMixin

from codriver.errors import DesignError
from codriver.kernel import Scalar
from codriver.signals.signal import Array

# What `state` may hold: numbers, texts, lists and arrays of numbers, and mappings of such.
State = dict[str, Any]
Prediction = Array | tuple[Array, Array]


class TorqueRegressor(RegressorMixin, BaseEstimator, ABC):
    """A regression of the torque, with a standard deviation.

    Attributes:
        kind: its name on the command line and in a stored driver.
        has_memory: whether a prediction depends on the rows before it.
        has_step: whether `step` is there.
    """

    kind: ClassVar[str]
    has_memory: ClassVar[bool] = False
    has_step: ClassVar[bool] = True

    @abstractmethod
    def fit(self, X: Array, y: Array, lengths: Sequence[int] | None = None) -> Self:
        """Learn.

        Args:
            X: features, shape (n, d); standardised, unless the model does not care.
            y: torque, shape (n,).
            lengths: of the stretches without holes, summing to n; None: one stretch.
        """

    @abstractmethod
    def predict(self, X: Array, return_std: bool = False, lengths: Sequence[int] | None = None) -> Any:
        """Mean, shape (n,); with `return_std` also the standard deviation of a new observation, shape (n,)."""

    @abstractmethod
    def state(self) -> State:
        """What was learnt, as plain numbers and arrays."""

    @abstractmethod
    def restore(self, state: Mapping[str, Any]) -> Self:
        """Take over what `state` gave; arrays may come as lists."""

    def initial(self) -> dict[str, float]:
        """The carried scalars of `step` and what they start from."""
        return {}

    def step(self, carry: Mapping[str, Scalar], z: Sequence[Scalar]) -> tuple[dict[str, Scalar], Scalar, Scalar]:
        """One prediction on scalars, for the kernel.

        Args:
            carry: the carried scalars.
            z: the features, d of them.

        Returns:
            the new carry, mean and standard deviation.

        Raises:
            DesignError: this kind has no step.
        """
        raise DesignError(
            f"a driver of kind '{self.kind}' has no step", "one that can run sample by sample",
            "choose another --model for use on a bus or a control unit",
        )  # fmt: skip


def stretches(n: int, lengths: Sequence[int] | None) -> list[slice]:
    """The stretches of n rows.

    Raises:
        ValueError: the lengths do not sum to n.
    """
    sizes = [n] if lengths is None else [int(size) for size in lengths]
    if sum(sizes) != n or min(sizes, default=0) < 0:
        raise ValueError(f"lengths sum to {sum(sizes)}; X has {n} rows")
    edges = np.cumsum([0, *sizes])
    return [slice(int(a), int(b)) for a, b in pairwise(edges) if b > a]
