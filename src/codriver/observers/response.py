"""What the knob buys and costs: the continuous observer's response, in closed form from its gains.

With F = A - L C and y = [a, v] = [1/s, 1/s^2] j for a true jerk j,

    jerk estimate / true jerk       G(s) = e_4' (s I - F)^-1 L [1/s; 1/s^2]
    error after a step of jerk      e_4' exp(F t) e_4
    variance from sample noise      F X + X F' + L_i L_i' dt = 0,  X_44

Everything scales with ell: delay and settling as 1/ell, bandwidth as ell, noise as ell^1.5 (accelerometer), ell^2.5 (speed).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from codriver.models import intention_model
from codriver.observers.scaled_gain import ScaledGain
from codriver.signals.signal import Array

_JERK, _ACCELERATION, _OFFSET = 3, 1, 2


def _error_dynamics(design: ScaledGain) -> Array:
    model = intention_model()
    return np.asarray(model.A - design.L @ model.C)


def jerk_response(design: ScaledGain, frequency: npt.ArrayLike) -> npt.NDArray[np.complex128]:
    """G(2 pi i f) from true jerk to its estimate.

    Args:
        design: gains.
        frequency: Hz, shape (n,), not 0.
    """
    return _response(design, frequency, _JERK, 1)


def acceleration_response(design: ScaledGain, frequency: npt.ArrayLike) -> npt.NDArray[np.complex128]:
    """From true acceleration to its estimate; like `jerk_response`."""
    return _response(design, frequency, _ACCELERATION, 0)


def _response(design: ScaledGain, frequency: npt.ArrayLike, state: int, power: int) -> npt.NDArray[np.complex128]:
    F, eye = _error_dynamics(design), np.eye(4)
    values = []
    for f in np.atleast_1d(np.asarray(frequency, float)):
        s = 2j * np.pi * f
        values.append(np.linalg.solve(s * eye - F, design.L @ np.array([s**-power, s ** -(power + 1)]))[state])
    return np.array(values)


def delay(design: ScaledGain) -> float:
    """Low-frequency delay of the jerk estimate, s: -d arg G / d omega at 0."""
    omega = 1e-3 * design.ell
    return float(-np.angle(jerk_response(design, omega / (2 * np.pi))[0]) / omega)


def bandwidth(design: ScaledGain) -> float:
    """Frequency at which the jerk estimate is 3 dB down, Hz."""
    from scipy.optimize import brentq

    def above(f: float) -> float:
        return float(abs(jerk_response(design, f)[0]) - 10 ** (-3 / 20))

    grid = design.ell * np.geomspace(1e-2, 10, 400)
    gain = np.abs(jerk_response(design, grid))
    last = int(np.flatnonzero(gain >= 10 ** (-3 / 20))[-1])
    return float(brentq(above, grid[last], grid[last + 1]))


def settling(design: ScaledGain, share: float = 0.05) -> float:
    """Time after a step of jerk from which the error stays below `share` of the step, s."""
    from scipy.linalg import expm

    step = 1e-3 / design.ell
    advance = expm(_error_dynamics(design) * step)
    error, last = np.eye(4)[_JERK], 0
    for k in range(60_000):
        if abs(error[_JERK]) > share:
            last = k
        error = advance @ error
    return (last + 1) * step


def noise_gain(design: ScaledGain, dt: float | None = None) -> tuple[float, float]:
    """Standard deviation of the jerk per unit of white sample noise of the accelerometer and of the speed.

    Args:
        design: gains.
        dt: interval of the samples, s; None takes the design's tick.
    """
    from scipy.linalg import solve_continuous_lyapunov

    F = _error_dynamics(design)
    interval = design.dt if dt is None else dt
    gains = []
    for column in range(2):
        L = design.L[:, column : column + 1]
        gains.append(float(np.sqrt(solve_continuous_lyapunov(F, -L @ L.T * interval)[_JERK, _JERK])))
    return gains[0], gains[1]


def slope_ramp_error(design: ScaledGain) -> float:
    """Steady jerk error per unit of do_a/dt (true less estimated), a pure number whatever ell: a road growing steeper."""
    return float(np.linalg.solve(-_error_dynamics(design), np.eye(4)[_OFFSET])[_JERK])
