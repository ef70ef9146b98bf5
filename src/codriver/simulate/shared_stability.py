"""How much authority arms and motor bear before the wheel shakes: eigenvalues of the whole loop, linear and in continuous time.

    x = (driver's states, delta_s, omega, beta, r, psi, y, T_a)          x' = A(g) x
    T_a' = (asked - T_a) / tau                                           asked: `assist`, "present" or "path"

Friction, limit, rate, fading and noise are left out, the visual delay is a Pade fraction of second order, and nothing ticks: a
motor that ticks has a little less margin. Arms that hold the wheel stiffly through a lagging muscle are a spring that answers late;
a motor that multiplies their torque makes it stiffer, and late enough it pushes instead of holding.
"""

from __future__ import annotations

from dataclasses import replace
from math import nan

import numpy as np

from codriver.errors import UsageError
from codriver.signals.signal import Array
from codriver.simulate.shared_control import SharedSetting

_MOST = 20.0


def loop_matrix(setting: SharedSetting) -> Array:
    """A, of shape (m, m); the last state is the motor's torque.

    Args:
        setting: an assist that is no "predicted" one, which ticks.

    Raises:
        UsageError: it is one, or its lag is 0.
    """
    assist, s = setting.assist, setting.driven()
    if assist.kind == "predicted" or not assist.lag > 0:
        raise UsageError(
            f"eigenvalues with the assist '{assist.kind}', lag {assist.lag:g} s", "present, path or none, with a lag", "simulate it"
        )  # fmt: skip
    v, car, driver, wheel = s.car.speed, s.car, s.driver, s.wheel
    model, plane = driver.model(v), s.single_track().model(v)
    m, back, far = model.A.shape[0], car.alignment / car.ratio, assist.ahead * v
    hand, delta, omega, beta, r, psi, y, motor = m - 1, *range(m, m + 7)
    A = np.zeros((m + 7, m + 7))
    A[:m, :m] = model.A
    for column, ahead in zip(model.B.T[:2], (driver.near, driver.far * v), strict=True):
        A[:m, psi] -= column
        A[:m, y] -= column / ahead
    A[:m, delta] += model.B[:, 2]
    A[delta, omega] = 1
    A[omega, [hand, motor]] = 1 / wheel.inertia
    A[omega, [beta, r, delta, omega]] = (
        np.array([back, back * car.front / v, -back / car.ratio, -wheel.damping]) / wheel.inertia
    )
    A[np.ix_([beta, r], [beta, r])], A[[beta, r], delta] = plane.A, plane.B[:, 0] / car.ratio
    A[psi, r] = 1
    A[y, [psi, beta]] = v
    A[motor, motor] = -1 / assist.lag
    if assist.kind == "present":
        A[motor, hand] = assist.gain / assist.lag
    elif assist.kind == "path":
        A[motor, [y, psi, beta, r]] = (
            -assist.gain * assist.stiffness / assist.lag * np.array([1, far, far, far**2 / (2 * v)])
        )
    return A


def slowest_decay(setting: SharedSetting) -> float:
    """The least of -Re(eigenvalue), 1/s; negative where the loop is unstable."""
    return float(-np.linalg.eigvals(loop_matrix(setting)).real.max())


def largest_gain(setting: SharedSetting) -> float:
    """The gain at which the loop becomes unstable, to 0.1 %; NaN if it is not below 20.

    Args:
        setting: its own gain does not count.

    Raises:
        UsageError: as `loop_matrix`; or the loop is unstable with gain 0.
    """

    def stable(gain: float) -> bool:
        return slowest_decay(replace(setting, assist=replace(setting.assist, gain=gain))) > 0

    if not stable(0.0):
        raise UsageError("a loop that is unstable without assist", "a driver who drives", "change the driver")
    gains = np.geomspace(0.01, _MOST, 150)
    first = next((k for k, gain in enumerate(gains) if not stable(float(gain))), None)
    if first is None:
        return nan
    low, high = (float(gains[first - 1]) if first else 0.0), float(gains[first])
    while high - low > 1e-3 * high:
        middle = (low + high) / 2
        low, high = (middle, high) if stable(middle) else (low, middle)
    return (low + high) / 2
