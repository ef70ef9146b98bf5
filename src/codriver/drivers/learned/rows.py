"""What every learned model asks of its rows, by scikit-learn's own checks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from sklearn.utils.validation import check_is_fitted, validate_data

from codriver.drivers.learned.regressor import TorqueRegressor, stretches
from codriver.signals.signal import Array


def training_rows(model: TorqueRegressor, X: Array, y: Array, lengths: Sequence[int] | None) -> tuple[Array, Array]:
    """X (n, d) and y (n,) as float64; notes d on the model.

    Raises:
        ValueError: wrong shapes, missing values, fewer than 2 rows, or lengths that do not sum to n.
    """
    X, y = validate_data(model, X, y, dtype=np.float64, y_numeric=True, ensure_min_samples=2)
    stretches(X.shape[0], lengths)
    return X, np.asarray(y, dtype=np.float64)


def rows(model: TorqueRegressor, X: Array, lengths: Sequence[int] | None) -> Array:
    """X (n, d) as float64, for a fitted model.

    Raises:
        NotFittedError: nothing was learnt yet.
        ValueError: another number of columns, missing values, or lengths that do not sum to n.
    """
    check_is_fitted(model)
    X = validate_data(model, X, dtype=np.float64, reset=False)
    stretches(X.shape[0], lengths)
    return X


def array(state: Mapping[str, Any], name: str) -> Array:
    """An array of numbers out of a state, where it may be a list."""
    return np.asarray(state[name], dtype=np.float64)
