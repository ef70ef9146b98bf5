"""Joint unscented Kalman filter of the wheel and its parameters.

    X = (z, z + c S, z - c S),   S S' = Phi,   c = sqrt(lambda + n),   lambda = alpha^2 (n + kappa) - n,   n = 4           (63)
    W_m0 = lambda / (lambda + n),   W_c0 = W_m0 + 1 - alpha^2 + beta,   all others 1 / (2 (lambda + n))                    (64)-(65)
    z- = sum W_m f(X),   Phi- = Q_z + sum W_c (f(X) - z-)(f(X) - z-)'                                                      (67)-(68)

The paper prints W_m and W_c the wrong way round, and n_x = 2 for n: with either, every run is lost. The points of the update,
drawn anew about z- (69), need not be drawn: the angle is a state, so with m = sum W_m and d = (1 - m) delta-

    y^ = m delta-,   s = R + sum W_c d^2 + 2 W c^2 Phi-_11,   Phi_zy = 2 W c^2 Phi-_1                                      (71)-(73)

where m = 1, d = 0 and 2 W c^2 = 1 with the right weights. S is Cholesky's, found as L D^(1/2) from Phi = L D L': there no root
waits for another.
Okamoto, Tsiotras 2019 (Robotics and Autonomous Systems); Wan, van der Merwe 2000, doi:10.1109/ASSPCC.2000.882463.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from codriver.identify.steering_ekf import finish, unpack
from codriver.identify.steering_joint import OUTPUTS, PAIRS, JointSettings, held_up, joint_functions
from codriver.kernel import Scalar, select, sqrt
from codriver.observers.observer import Observer, Scalars

N = 4  # of the joint state


@dataclass(frozen=True)
class Weights:
    """Of the sigma points.

    Attributes:
        spread: c.
        mean: of the first point in the mean.
        covariance: of the first point in the covariance.
        other: of each other point, in both.
    """

    spread: float
    mean: float
    covariance: float
    other: float


def ukf_weights(n: int = N, alpha: float = 1e-3, beta: float = 2.0, kappa: float = 0.0) -> Weights:
    """The right form of (64)-(65); by default with the numbers of (86).

    Args:
        n: states, all of them.
        alpha, beta, kappa: as in the paper.
    """
    scale = alpha**2 * (n + kappa)
    first = (scale - n) / scale
    return Weights(scale**0.5, first, first + 1 - alpha**2 + beta, 0.5 / scale)


def joint_ukf(
    settings: JointSettings, weights: Weights | None = None, *, angle: str = "steering_wheel_angle",
    torque: str = "steering_motor_torque",
) -> Observer:  # fmt: skip
    """The filter as an observer.

    Args:
        settings: guess, noise, tick.
        weights: of the sigma points; those of (86) by default.
        angle, torque: standard names of what is measured and what drives the wheel.
    """
    w = weights or ukf_weights()
    f, _ = joint_functions(settings.dt, settings.keep == "log")
    total, share = w.mean + 2 * N * w.other, 2 * w.other * w.spread**2

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        z, P = unpack(carry)
        before, started = carry["torque_before"], carry["started"]
        moved_mean, moved = _moved(f, z, P, before, settings, w)
        z_minus = [select(started, moved_mean[i], z[i]) for i in range(4)]
        P_minus = {(i, k): select(started, moved[i, k], P[i, k]) for i, k in PAIRS}
        column = [share * P_minus[0, i] for i in range(4)]
        s = column[0] + settings.angle + (w.covariance + 2 * N * w.other) * ((1 - total) * z_minus[0]) ** 2
        fresh = ok[angle]
        e = select(fresh, y[angle] - total * z_minus[0], 0.0)
        gain = [c / s for c in column]
        z_new = held_up([z_minus[i] + gain[i] * e for i in range(4)], settings)
        P_new = {(i, k): P_minus[i, k] - select(fresh, gain[i] * column[k], 0.0) for i, k in PAIRS}
        return finish(settings, carry, z_new, P_new, e, s, select(ok[torque], u[torque], before))

    return Observer(
        "joint-ukf", settings.dt, (torque,), (angle,), settings.carry, OUTPUTS, step, settings=settings.describe()
    )


def _moved(
    f: Any, z: Any, P: Any, torque: Scalar, settings: JointSettings, w: Weights
) -> tuple[list[Scalar], dict[tuple[int, int], Scalar]]:
    """Mean and covariance of the points moved by f, eq. (63)-(68)."""
    import casadi as ca

    root = cholesky({(i, k): P[i, k] for i, k in PAIRS})
    points = [z]
    for m in range(N):
        step = w.spread * ca.vertcat(*[root.get((i, m), 0.0) for i in range(N)])
        points += [z + step, z - step]
    after = [f(point, torque) for point in points]
    mean = w.mean * after[0] + w.other * sum(after[1:])
    off = [point - mean for point in after]
    covariance = {
        (i, k): w.covariance * off[0][i] * off[0][k] + w.other * sum(d[i] * d[k] for d in off[1:]) for i, k in PAIRS
    }
    for i, q in enumerate(settings.process_in_z):
        covariance[i, i] = covariance[i, i] + q
    return [mean[i] for i in range(N)], covariance


def cholesky(P: dict[tuple[int, int], Scalar]) -> dict[tuple[int, int], Scalar]:
    """The lower root of a symmetric matrix given by its upper entries; NaN where it is not positive."""
    over, unit = dict[tuple[int, int], Scalar](), dict[tuple[int, int], Scalar]()
    for k in range(N):
        for i in range(k, N):
            over[i, k] = P[k, i] - sum(over[i, m] * unit[k, m] for m in range(k))
            unit[i, k] = over[i, k] / over[k, k] if i > k else 1.0
    scale = [sqrt(over[k, k]) for k in range(N)]
    return {(i, k): unit[i, k] * scale[k] for i, k in unit}
