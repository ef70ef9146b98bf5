"""The Kalman gain with one knob.

    0   = A P + P A' + Q - P C' R^-1 C P,   L_K = P C' R^-1                  (continuous Riccati equation)
    L   = T L_K diag(1, ell),               T = diag(1, ell, ell, ell^2)      (2017 eq. 17, 2015 eq. 18)

so that the eigenvalues of A - L C are ell times those of A - L_K C. The printed right factor of 2017's (17) is 4 x 4; with
two measurements only diag(1, ell) fits and scales the eigenvalues. L is itself the stationary Kalman gain for

    Q_ell = T Q T,   R_ell = diag(1, 1/ell) R diag(1, 1/ell),

up to one common factor, so that a Kalman filter with these handles rows that are missing. At a tick dt the filter is

    F = exp(A dt),  Q_d = integral of exp(A s) Q_ell exp(A' s) ds,  R_d = R_ell / dt,

and its stationary gain K (discrete Riccati equation) is the constant-gain form: its poles are exp(ell lambda dt) to 4e-4
at 20 Hz and 2e-5 at 100 Hz, where forward Euler is off by 13-22 % and 1-3 %.

Bisoffi et al. 2017, section III, doi:10.1109/TMECH.2017.2716838.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from codriver.errors import DesignError, UsageError
from codriver.models import intention_model
from codriver.observers.observer import Certificate, stable
from codriver.signals.signal import Array

# Far beyond both, the Riccati equations lose their digits; what lies between is designed and certified.
ELL_RANGE = (0.01, 100.0)
DT_RANGE = (1e-6, 100.0)  # s


@dataclass(frozen=True)
class Preset:
    """Noise: diagonals of Q (v, a_i, o_a, j_i) and R (accelerometer, speed), the knob found best with it, source and name."""

    Q: tuple[float, float, float, float]
    R: tuple[float, float]
    ell: float
    source: str
    name: str = "own"


PRESETS: dict[str, Preset] = {
    "bisoffi2017": Preset(
        (1e-2, 1e-4, 1e-1, 1.0), (1.0, 1e-2), 2.0, "2017 eq. (21), ell from section IV-B", "bisoffi2017"
    ),
    "bisoffi2015": Preset((1e-8, 1e-6, 1e-2, 1.0), (1.0, 1e-3), 1.4, "2015 eq. (20), ell from figure 3", "bisoffi2015"),
}


@dataclass(frozen=True, eq=False)
class ScaledGain:
    """The design at one ell and one tick.

    Attributes:
        ell, dt: the knob and the tick, s.
        L_K, L: continuous gains, shape (4, 2), columns (accelerometer, speed).
        Q, R: Q_ell (4, 4) and R_ell (2, 2), intensities.
        F, Qd, Rd: transition, process and measurement covariance at dt.
        K: stationary gain of the filter at dt, shape (4, 2).
        P: stationary covariance after the update, shape (4, 4), in units of the noise scale.
        P_predicted: the same before the update.
        certificate: stability and the scaling of the eigenvalues, recomputed from the gains.
    """

    ell: float
    dt: float
    L_K: Array
    L: Array
    Q: Array
    R: Array
    F: Array
    Qd: Array
    Rd: Array
    K: Array
    P: Array
    P_predicted: Array
    certificate: Certificate


def design_scaled_gain(preset: Preset | str, dt: float, ell: float | None = None) -> ScaledGain:
    """Design the gain of the longitudinal observers.

    Args:
        preset: noise, or the name of a paper's: "bisoffi2017", "bisoffi2015".
        dt: tick, s.
        ell: the knob: larger is quicker and noisier; None takes the preset's.

    Raises:
        UsageError: no such preset; ell or dt out of range.
        DesignError: the observer would not be stable, or the tick is too long for it.
    """
    if isinstance(preset, str):
        if preset not in PRESETS:
            raise UsageError(f"no preset '{preset}'", f"one of {', '.join(PRESETS)}", "choose one, or pass a Preset")
        preset = PRESETS[preset]
    ell = preset.ell if ell is None else ell
    if not ELL_RANGE[0] <= ell <= ELL_RANGE[1]:
        bounds = f"{ELL_RANGE[0]:g} to {ELL_RANGE[1]:g}"
        raise UsageError(f"ell = {ell:g}", f"a number from {bounds}", "start from 2; the papers use 0.8 to 3")
    check_tick(dt)
    from scipy.linalg import solve_continuous_are, solve_discrete_are

    model = intention_model()
    A, C = model.A, model.C
    Q0, R0 = np.diag(preset.Q), np.diag(preset.R)
    P0 = solve_continuous_are(A.T, C.T, Q0, R0)
    L_K = P0 @ C.T @ np.linalg.inv(R0)
    L = np.diag([1.0, ell, ell, ell**2]) @ L_K @ np.diag([1.0, ell])
    Q, R = scaled_noise(preset, ell)
    F, Qd, Rd = model.transition(dt), model.process_noise(Q, dt), R / dt
    predicted = solve_discrete_are(F.T, C.T, Qd, Rd)
    K = predicted @ C.T @ np.linalg.inv(C @ predicted @ C.T + Rd)
    left = np.eye(4) - K @ C
    P = left @ predicted @ left.T + K @ Rd @ K.T  # Joseph's form keeps it positive definite
    return ScaledGain(ell, dt, L_K, L, Q, R, F, Qd, Rd, K, P, predicted, _certify(A, C, F, L_K, L, K, ell, dt))


def scaled_noise(preset: Preset, ell: float) -> tuple[Array, Array]:
    """Q_ell, shape (4, 4), and R_ell, shape (2, 2)."""
    T, left = np.diag([1.0, ell, ell, ell**2]), np.diag([1.0, 1.0 / ell])
    return T @ np.diag(preset.Q) @ T, left @ np.diag(preset.R) @ left


def check_tick(dt: float) -> None:
    """Whether a tick can be designed for.

    Raises:
        UsageError: it is out of range.
    """
    if not DT_RANGE[0] <= dt <= DT_RANGE[1]:
        bounds = f"{DT_RANGE[0]:g} to {DT_RANGE[1]:g} s"
        raise UsageError(f"dt = {dt:g} s", f"a tick of {bounds}", "choose the sensors' tick, such as 0.01 s")


def _certify(A: Array, C: Array, F: Array, L_K: Array, L: Array, K: Array, ell: float, dt: float) -> Certificate:
    """What the gains themselves show: stability, scaling, and how near the step's poles are to the paper's."""
    base = np.sort_complex(np.linalg.eigvals(A - L_K @ C))
    scaled = np.sort_complex(np.linalg.eigvals(A - L @ C)).astype(complex)
    discrete = np.linalg.eigvals((np.eye(4) - K @ C) @ F).astype(complex)
    wanted = np.exp(scaled * dt)
    # Relative to how fast each pole is; matched by nearness, since complex pairs may come in another order.
    pole_error = max(float(np.min(np.abs(discrete - w)) / abs(1 - w)) for w in wanted)
    scaling_error = float(np.max(np.abs(scaled - ell * base)) / np.max(np.abs(scaled)))
    decay = float(-scaled.real.max())
    claims = (
        f"A - L C is stable: the slowest error decays with {decay:.4g} 1/s",
        f"its eigenvalues are ell = {ell:g} times those of A - L_K C, to {scaling_error:.1e}",
        f"the step at dt = {dt:g} s is stable: |poles| <= {np.abs(discrete).max():.6f}",
        f"its poles are exp(lambda dt) of the continuous design to {pole_error:.1e}",
    )
    holds = decay > 0 and stable(discrete) and scaling_error < 1e-6
    if not holds:
        raise DesignError(
            f"the observer for ell = {ell:g} at dt = {dt:g} s fails its certificate: {'; '.join(claims)}",
            "a stable observer whose eigenvalues scale with ell",
            "choose a smaller ell or a shorter tick",
        )
    return Certificate(holds, claims, scaled, discrete, decay)
