"""The design of the pedals' filter: bursts of jerk seen through a noisy sensor, with one knob.

    x' = A x + [0; 0; 1] white noise q,   A = [0 1 0; 0 0 1; 0 -w^2 -2 w],   y = x_1 + noise of intensity R h
    w  = ell w_1,   q = ell^6 q_1

with R the variance of a sample (m^2/s^4) and h their interval (s). With S = diag(1, ell, ell^2) the Riccati equation has
P(ell) = ell S P(1) S, so the gain is ell S L(1) and the poles are exactly ell times those of ell = 1, for any R. Less noise
makes quicker poles, by about the sixth root of R.

The estimate of a true jerk j answers G(s) = e_2' (s I - A + L C)^-1 L / s, whose low-frequency delay is `pedal_delay`.
w_1 and q_1 are chosen on simulated drives (docs/fused.md).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from codriver.errors import UsageError
from codriver.models import StateSpace
from codriver.signals.signal import Array

W_1 = 1.5  # rad/s
Q_1 = 27 / 64  # m^2/s^9 per rad: at ell = 2 a standard deviation of the jerk of 0.5 m/s^3
ELL_RANGE = (0.1, 20.0)
# What a usual pedal (0.4 % steps, 50 Hz) makes of acceleration in a middle gear; for the delay that is told.
NOMINAL_SD, NOMINAL_INTERVAL = 0.01, 0.02  # m/s^2, s


@dataclass(frozen=True, eq=False)
class PedalGain:
    """The design at one ell and one tick.

    Attributes:
        ell, dt: the knob and the tick, s.
        A: shape (3, 3); states a_p, j_p, c_p.
        q: intensity of the noise that drives c_p.
        F, Qd: transition and process covariance at dt.
        jerk_variance, curve_variance: of j_p and c_p where nothing is measured, m^2/s^6 and m^2/s^8.
    """

    ell: float
    dt: float
    A: Array
    q: float
    F: Array
    Qd: Array
    jerk_variance: float
    curve_variance: float


def design_pedal_gain(dt: float, ell: float) -> PedalGain:
    """Design the pedals' filter.

    Args:
        dt: tick, s.
        ell: the knob: larger is quicker and noisier.

    Raises:
        UsageError: ell is out of range.
    """
    if not ELL_RANGE[0] <= ell <= ELL_RANGE[1]:
        bounds = f"{ELL_RANGE[0]:g} to {ELL_RANGE[1]:g}"
        raise UsageError(f"ell = {ell:g}", f"a number from {bounds} for intent-fused", "start from 2")
    w, q = ell * W_1, ell**6 * Q_1
    A = np.array([[0, 1, 0], [0, 0, 1], [0, -w * w, -2 * w]], float)
    Q = np.diag([0.0, 0.0, q])
    model = StateSpace(
        A, np.zeros((3, 1)), np.array([[1.0, 0.0, 0.0]]), np.zeros((1, 1)), ("a_p", "j_p", "c_p"), ("none",), ("y",)
    )
    return PedalGain(
        ell, dt, A, q, model.transition(dt), model.process_noise(Q, dt), q / (4 * w**3), q / (4 * w)
    )  # fmt: skip


def stationary_gain(gain: PedalGain, sd: float = NOMINAL_SD, interval: float = NOMINAL_INTERVAL) -> Array:
    """The continuous filter's stationary gain L, shape (3,).

    Args:
        gain: the design.
        sd: noise of a sample, m/s^2.
        interval: of the samples, s.
    """
    from scipy.linalg import solve_continuous_are

    # Solved at ell = 1 and scaled: the equation itself loses its digits at large ell.
    S, one = np.array([1.0, gain.ell, gain.ell**2]), design_pedal_gain(gain.dt, 1.0)
    C, R = np.array([[1.0, 0.0, 0.0]]), np.array([[sd * sd * interval]])
    P = solve_continuous_are(one.A.T, C.T, np.diag([0.0, 0.0, one.q]), R)
    return np.asarray(gain.ell * S * (P[:, 0] / R[0, 0]))


def pedal_response(
    gain: PedalGain, frequency: npt.ArrayLike, sd: float = NOMINAL_SD, interval: float = NOMINAL_INTERVAL
) -> npt.NDArray[np.complex128]:
    """G(2 pi i f) from the pedals' true jerk to its estimate.

    Args:
        gain: the design.
        frequency: Hz, shape (n,), not 0.
        sd, interval: of the samples, m/s^2 and s.
    """
    L = stationary_gain(gain, sd, interval)
    closed = gain.A - np.outer(L, [1.0, 0.0, 0.0])
    values = []
    for f in np.atleast_1d(np.asarray(frequency, float)):
        s = 2j * np.pi * f
        values.append(np.linalg.solve(s * np.eye(3) - closed, L / s)[1])
    return np.array(values)


def pedal_delay(gain: PedalGain, sd: float = NOMINAL_SD, interval: float = NOMINAL_INTERVAL) -> float:
    """Low-frequency delay of the jerk, s: -d arg G / d omega at 0; like `pedal_response`."""
    omega = 1e-3 * gain.ell
    return float(-np.angle(pedal_response(gain, omega / (2 * np.pi), sd, interval)[0]) / omega)


def pedal_noise(gain: PedalGain, sd: float = NOMINAL_SD, interval: float = NOMINAL_INTERVAL) -> float:
    """Standard deviation of the estimated jerk from the samples' noise alone, m/s^3; like `pedal_response`."""
    from scipy.linalg import solve_continuous_lyapunov

    L = stationary_gain(gain, sd, interval)
    closed = gain.A - np.outer(L, [1.0, 0.0, 0.0])
    return float(np.sqrt(solve_continuous_lyapunov(closed, -np.outer(L, L) * sd * sd * interval)[1, 1]))
