"""The Kalman filter of a plant whose unknown inputs are states: its matrices at a tick, and what they prove.

    x_k = F x_{k-1} + G_0 u_{k-1} + G_1 u_k + w,   cov w = Q_d        u straight between ticks
    y_k = C x_k + D u_k + n,                       var n = R          of each sample
    Q_d = integral of exp(A s) Q exp(A' s) ds

x holds the plant's states, the unknown inputs and, at order 2, their rates (`unknown_input`). Remark 3 of the 2019 paper holds
that such a filter needs more measurements than unknown inputs; it needs a detectable pair, no more.

The gain is the stationary one where every tick has every measurement; the filter itself carries its covariance, so rows may be
missing or slower. Okamoto, Tsiotras 2019 (Robotics and Autonomous Systems), section 3.1; Van Loan 1978,
doi:10.1109/TAC.1978.1101743.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from codriver.errors import DesignError
from codriver.models import StateSpace
from codriver.observers.observer import Certificate, stable
from codriver.observers.unknown_input import refuse_undetectable, with_unknown
from codriver.signals.signal import Array


@dataclass(frozen=True, eq=False)
class DisturbanceDesign:
    """The filter at one tick.

    Attributes:
        model: the augmented model (known inputs only).
        plant_states: how many of its states are the plant's.
        unknown: names of the unknown inputs.
        dt: tick, s.
        F, G_0, G_1: shapes (n, n), (n, m), (n, m).
        Q, Q_d: intensity and covariance a tick, shape (n, n).
        R: variance of a sample of each output, shape (p,).
        P: stationary covariance after the update, shape (n, n); P_predicted before it.
        K: stationary gain, shape (n, p).
        certificate: detectability and the poles of a tick, recomputed from the gain.
    """

    model: StateSpace
    plant_states: int
    unknown: tuple[str, ...]
    dt: float
    F: Array
    G_0: Array
    G_1: Array
    Q: Array
    Q_d: Array
    R: Array
    P: Array
    P_predicted: Array
    K: Array
    certificate: Certificate


def design_disturbance_filter(
    model: StateSpace, unknown: Sequence[str], dt: float, *, unknown_noise: Sequence[float], output_noise: Sequence[float],
    state_noise: Sequence[float] | None = None, order: int = 1,
) -> DisturbanceDesign:  # fmt: skip
    """Design.

    Args:
        model: the plant with all inputs.
        unknown: names of the unknown ones.
        dt: tick, s.
        unknown_noise: intensity of the white noise that drives each unknown input: unit^2/s at order 1, unit^2/s^3 at order 2.
        output_noise: variance of a sample of each output, unit^2.
        state_noise: intensity of the noise of each state of the plant, unit^2/s; none by default.
        order: of the random walk, 1 or 2.

    Raises:
        DesignError: the pair is not detectable, noises that cannot be, or no stable filter.
    """
    from scipy.linalg import solve_discrete_are

    unknown = tuple(unknown)
    augmented = with_unknown(model, unknown, order)
    refuse_undetectable(augmented, unknown)
    n, k = len(model.states), len(unknown)
    plant = np.zeros(n) if state_noise is None else np.asarray(state_noise, float)
    driven, R = np.asarray(unknown_noise, float), np.asarray(output_noise, float)
    sizes = plant.shape == (n,) and driven.shape == (k,) and R.shape == (len(model.outputs),)
    if not (sizes and (driven > 0).all() and (R > 0).all() and (plant >= 0).all() and dt > 0):
        raise DesignError(
            f"noises {driven.tolist()}, {plant.tolist()}, {R.tolist()}, tick {dt:g} s",
            f"positive numbers for {k} unknown inputs and {len(model.outputs)} outputs, {n} for the states, not negative",
            "correct the noises",
        )  # fmt: skip
    Q = np.diag([*plant, *([0.0] * (k * (order - 1))), *driven])
    F, (G_0, G_1) = augmented.transition(dt), augmented.input_maps(dt)
    Q_d, C = augmented.process_noise(Q, dt), augmented.C
    # In units in which every state's noise is about 1: outputs in rad and torques in N m differ by 1e4, squared 1e8.
    scale = np.sqrt(np.maximum(np.diag(Q_d), 1e-300))
    try:
        scaled = solve_discrete_are(
            (F * scale / scale[:, None]).T, (C * scale).T, Q_d / np.outer(scale, scale), np.diag(R)
        )
    except (np.linalg.LinAlgError, ValueError) as error:
        raise DesignError(
            f"the Riccati equation has no solution for these noises ({error})", "noises of usual size", "correct them"
        ) from None
    predicted = scaled * np.outer(scale, scale)
    K = predicted @ C.T @ np.linalg.inv(C @ predicted @ C.T + np.diag(R))
    left = np.eye(F.shape[0]) - K @ C
    P = left @ predicted @ left.T + K @ np.diag(R) @ K.T
    return DisturbanceDesign(
        augmented, n, unknown, dt, F, G_0, G_1, Q, Q_d, R, P, predicted, K, _certify(F, left, dt, unknown)
    )


def _certify(F: Array, left: Array, dt: float, unknown: tuple[str, ...]) -> Certificate:
    """What the gain shows: the poles of a tick."""
    poles = np.linalg.eigvals(left @ F).astype(complex)
    continuous = np.asarray(np.log(np.where(poles == 0, 1e-300, poles)) / dt, dtype=complex)
    decay = float(-continuous.real.max())
    claims = (
        f"(A, C) with {', '.join(unknown)} among the states is detectable (PBH)",
        f"a tick of the stationary filter is stable: |poles| <= {np.abs(poles).max():.6f}",
        f"the error decays with {decay:.4g} 1/s or quicker where every tick has its measurements",
    )
    if not stable(poles):
        raise DesignError(
            f"the filter fails its certificate: {'; '.join(claims)}", "a stable filter", "correct the noises"
        )
    return Certificate(True, claims, continuous, poles, decay)
