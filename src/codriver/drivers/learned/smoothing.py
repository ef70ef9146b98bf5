"""Smoothing of signals on a tick: a first-order low-pass, and the paper's local quadratic.

    y_k = y_{k-1} + (1 - exp(-w dt)) (x_k - y_{k-1})                        first-order low-pass, exact for a held input
    y_k = a of argmin sum_j W((t_j - t_k) / (span / 2)) (x_j - a - b (t_j - t_k) - c (t_j - t_k)^2)^2,   W(u) = (1 - |u|^3)^3

The low-pass knows the past only and lags 1 / w at low frequency. The local quadratic (loess) sees span / 2 of the future.

Cleveland 1979, doi:10.1080/01621459.1979.10481038; the paper names neither its span nor whether the torque is smoothed too.
Okamoto, Tsiotras 2019 (Robotics and Autonomous Systems), section 5.2.
"""

from __future__ import annotations

import numpy as np

from codriver.signals.signal import Array


def low_pass(values: Array, cutoff: float, dt: float) -> Array:
    """First-order low-pass that starts at the first finite value and holds over values that are not finite.

    Args:
        values: shape (n,).
        cutoff: w, rad/s.
        dt: tick, s.
    """
    gain = -np.expm1(-cutoff * dt)
    made = np.full(values.shape, np.nan)
    state = np.nan
    for k, value in enumerate(values.tolist()):
        if value == value:
            state = value if state != state else state + gain * (value - state)
        made[k] = state
    return made


def local_quadratic(values: Array, span: float, dt: float) -> Array:
    """Local quadratic with tricube weights over `span`; near the ends the fit is one-sided.

    Args:
        values: shape (n,), finite.
        span: s; a window shorter than five ticks leaves the values as they are.
        dt: tick, s.
    """
    half = int(span / 2 / dt + 1e-9)
    if half < 2 or values.size < 2 * half + 1:
        return values.copy()
    made = np.convolve(values, _weights(half, half, span / dt / 2)[::-1], mode="same")
    for k in range(half):
        left, right = _weights(k, half, span / dt / 2), _weights(half, k, span / dt / 2)
        made[k] = left @ values[: k + half + 1]
        made[-1 - k] = right @ values[values.size - 1 - k - half :]
    return np.asarray(made)


def _weights(before: int, after: int, reach: float) -> Array:
    """What each of before + 1 + after values counts in the fit at the one after `before`."""
    t = np.arange(-before, after + 1, dtype=np.float64)
    root = np.sqrt(np.maximum(1 - np.minimum(np.abs(t) / (reach + 1), 1) ** 3, 0) ** 3)
    design = np.stack([np.ones_like(t), t / reach, (t / reach) ** 2], axis=1) * root[:, None]
    return np.asarray(np.linalg.pinv(design)[0] * root)
