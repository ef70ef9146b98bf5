"""What a driver's torque leaves unexplained, as a function of the logarithms of his parameters, and its whitening.

v(theta) = T_dr - T(theta; what he saw),    low-passed and thinned to RATE Hz, less its mean (a constant torque is bias)
e_k = v_k - a_1 v_{k-1} - ... - a_p v_{k-p}                                        a by Yule and Walker
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from codriver.identify.driver_record import DriverRecord
from codriver.models.two_point import TwoPointDriver
from codriver.signals.signal import Array

RATE = 20.0  # Hz
ORDER = 12  # p
_STEP = 1e-4  # of theta, for derivatives
Residual = Callable[[Array], Array]


def thinning(dt: float) -> int:
    """Ticks of a record to one of the residual."""
    return max(round(1 / (RATE * dt)), 1)


def driver_of(known: TwoPointDriver, names: tuple[str, ...], theta: Array) -> TwoPointDriver:
    """The driver whose parameters `names` are exp(theta), and the rest known."""
    return replace(known, **dict(zip(names, np.exp(theta).tolist(), strict=True)))


def residual_of(record: DriverRecord, known: TwoPointDriver, names: tuple[str, ...]) -> Residual:
    """v as a function of theta."""
    from scipy.signal import butter, sosfilt

    every = thinning(record.dt)
    sections = butter(4, 0.4 / every * 2, output="sos") if every > 1 else None

    def residual(theta: Array) -> Array:
        driver = driver_of(known, names, theta)
        v = record.torque - driver.torque(record.near, record.far, record.angle, record.speed, record.dt)
        thin = (v if sections is None else sosfilt(sections, v))[record.first : record.last : every]
        return np.asarray(thin - thin.mean())

    return residual


def jacobian(residual: Residual, theta: Array) -> Array:
    """dv / dtheta, shape (n, p)."""
    moves = _STEP * np.eye(theta.size)
    return np.stack([(residual(theta + m) - residual(theta - m)) / (2 * _STEP) for m in moves], axis=1)


def whitening(v: Array) -> Array:
    """1, -a_1, ..., -a_p."""
    from scipy.linalg import solve_toeplitz

    p = min(ORDER, v.size // 20)
    r = np.array([v[: v.size - k] @ v[k:] for k in range(p + 1)])
    r[0] *= 1 + 1e-9
    return np.concatenate([[1.0], -solve_toeplitz(r[:-1], r[1:])])


def whitened(filter_: Array, x: Array) -> Array:
    """e of a column or of columns, without the first p."""
    from scipy.signal import lfilter

    return np.asarray(lfilter(filter_, [1.0], x, axis=0)[filter_.size - 1 :])
