"""Scaling of features and torque to mean 0 and standard deviation 1, learnt from the training rows.

The torque's past and the torque to come share one scale, so "as it was" stays "as it was". A column that does not vary keeps its
size.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from codriver.drivers.learned.features import FeatureTable
from codriver.signals.signal import Array

_LEAST = 1e-9  # SI units, and of a column's largest value: less variation than that is rounding


@dataclass(frozen=True, eq=False)
class Scaling:
    """Mean and size of columns and torque.

    Attributes:
        mean, size: of the columns, shape (d,).
        torque_mean, torque_size: N m.
    """

    mean: Array
    size: Array
    torque_mean: float
    torque_size: float

    @classmethod
    def of(cls, table: FeatureTable) -> Self:
        """From the rows of a table."""
        known = table.y[np.isfinite(table.y)]
        torque_mean, torque_size = float(known.mean()), _size(known)
        mean = table.X.mean(axis=0)
        size = np.array([_size(column) for column in table.X.T])
        shared = list(table.torque_columns)
        mean[shared], size[shared] = torque_mean, torque_size
        return cls(mean, size, torque_mean, torque_size)

    def features(self, X: Array) -> Array:
        """Standardised features."""
        return np.asarray((X - self.mean) / self.size)

    def torque(self, y: Array) -> Array:
        """Standardised torque."""
        return np.asarray((y - self.torque_mean) / self.torque_size)

    def in_newton_metres(self, mean: Array, sd: Array) -> tuple[Array, Array]:
        """Mean and sd of a standardised prediction, N m."""
        return self.torque_mean + self.torque_size * mean, self.torque_size * sd

    def as_plain(self) -> dict[str, Any]:
        """For a file."""
        return {
            "mean": self.mean.tolist(), "size": self.size.tolist(), "torque_mean": self.torque_mean,
            "torque_size": self.torque_size,
        }  # fmt: skip

    @classmethod
    def from_plain(cls, plain: Mapping[str, Any]) -> Self:
        """From `as_plain`."""
        mean, size = (np.asarray(plain[name], dtype=np.float64) for name in ("mean", "size"))
        return cls(mean, size, float(plain["torque_mean"]), float(plain["torque_size"]))


def _size(values: Array) -> float:
    size = float(values.std())
    return size if size > _LEAST * max(float(np.abs(values).max(initial=0.0)), 1.0) else 1.0
