"""What a driver's torque leaves unexplained, as a function of the logarithms of his parameters, and its whitening.

v(theta) = T_dr - T(theta; what he saw),    low-passed and thinned to RATE Hz, less its mean in each drive (bias)
e_k = v_k - a_1 v_{k-1} - ... - a_p v_{k-p}                                        a by Yule and Walker
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from codriver.identify.driver_record import DriverRecord
from codriver.models.two_point import TwoPointDriver
from codriver.signals.signal import Array

RATE = 20.0  # Hz
ORDER = 12  # p
_STEP = 1e-4  # of theta, for derivatives
Residual = Callable[[Array], tuple[Array, ...]]  # theta to v of each drive


def thinning(dt: float) -> int:
    """Ticks of a record to one of the residual."""
    return max(round(1 / (RATE * dt)), 1)


def driver_of(known: TwoPointDriver, names: tuple[str, ...], theta: Array) -> TwoPointDriver:
    """The driver whose parameters `names` are exp(theta), and the rest known."""
    return replace(known, **dict(zip(names, np.exp(theta).tolist(), strict=True)))


def residual_of(records: Sequence[DriverRecord], known: TwoPointDriver, names: tuple[str, ...]) -> Residual:
    """v of each drive as a function of theta."""
    from scipy.signal import butter, sosfilt

    sections = [butter(4, 0.4 / n * 2, output="sos") if n > 1 else None for n in (thinning(r.dt) for r in records)]

    # A derivative moves one parameter: most of the time he looks where he did before.
    looks = [lru_cache(maxsize=6)(record.seen) for record in records]

    def residual(theta: Array) -> tuple[Array, ...]:
        driver = driver_of(known, names, theta)
        found = []
        for record, low, seen in zip(records, sections, looks, strict=True):
            v = record.torque - driver.torque(*seen(driver.near, driver.far), record.angle, record.speed, record.dt)
            thin = (v if low is None else sosfilt(low, v))[record.first : record.last : thinning(record.dt)]
            found.append(np.asarray(thin - thin.mean()))
        return tuple(found)

    return residual


def jacobian(residual: Residual, theta: Array) -> tuple[Array, ...]:
    """dv / dtheta of each drive, shape (n, p)."""
    steps = _STEP * np.eye(theta.size)
    moved = [(residual(theta + step), residual(theta - step)) for step in steps]
    drives = range(len(moved[0][0]))
    return tuple(np.stack([(up[d] - down[d]) / (2 * _STEP) for up, down in moved], axis=1) for d in drives)


def whitening(drives: Sequence[Array]) -> Array:
    """1, -a_1, ..., -a_p, one for all drives."""
    from scipy.linalg import solve_toeplitz

    p = min(ORDER, min(v.size for v in drives) // 20)
    r = np.array([sum(v[: v.size - k] @ v[k:] for v in drives) for k in range(p + 1)])
    r[0] *= 1 + 1e-9
    return np.concatenate([[1.0], -solve_toeplitz(r[:-1], r[1:])])


def whitened(filter_: Array, drives: Sequence[Array]) -> Array:
    """e of a column or of columns, one drive after the other, each without its first p."""
    from scipy.signal import lfilter

    return np.concatenate([lfilter(filter_, [1.0], x, axis=0)[filter_.size - 1 :] for x in drives])
