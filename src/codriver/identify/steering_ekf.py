"""Joint extended Kalman filter of the wheel and its parameters.

    z- = f(z, T),   Phi- = J_z Phi J_z' + Q_z                                                     (57)-(58)
    K = Phi- H' / s,   s = H Phi- H' + R,   z = z- + K (y - H z-),   Phi = Phi- - K s K'          (59)-(61)

J_z is taken at the filtered state, eq. (62), from CasADi (Box I prints the predicted one). With y in radians H = (1, 0, 0, 0);
the paper's degrees scale R alone. Okamoto, Tsiotras 2019 (Robotics and Autonomous Systems), section 3.2.
"""

from __future__ import annotations

from typing import Any

from codriver.identify.steering_joint import OUTPUTS, PAIRS, JointSettings, held_up, joint_functions, physical
from codriver.kernel import Scalar, select, sqrt
from codriver.observers.observer import Observer, Scalars


def joint_ekf(
    settings: JointSettings, *, angle: str = "steering_wheel_angle", torque: str = "steering_motor_torque"
) -> Observer:
    """The filter as an observer, which compiles, runs live and exports as any other.

    Args:
        settings: guess, noise, tick.
        angle, torque: standard names of what is measured and what drives the wheel.
    """
    import casadi as ca

    f, jacobian = joint_functions(settings.dt, settings.keep == "log")
    Q = ca.diag(ca.DM(list(settings.process_in_z)))

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        z, P = unpack(carry)
        before = carry["torque_before"]
        F = jacobian(z, before)
        z_moved, P_moved = f(z, before), F @ P @ F.T + Q
        started = carry["started"]
        z_minus = [select(started, z_moved[i], z[i]) for i in range(4)]
        P_minus = {(i, k): select(started, P_moved[i, k], P[i, k]) for i, k in PAIRS}
        column = [P_minus[0, i] for i in range(4)]
        s = column[0] + settings.angle
        fresh = ok[angle]
        e = select(fresh, y[angle] - z_minus[0], 0.0)
        gain = [c / s for c in column]
        z_new = held_up([z_minus[i] + gain[i] * e for i in range(4)], settings)
        P_new = {(i, k): P_minus[i, k] - select(fresh, gain[i] * column[k], 0.0) for i, k in PAIRS}
        return finish(settings, carry, z_new, P_new, e, s, select(ok[torque], u[torque], before))

    return Observer(
        "joint-ekf", settings.dt, (torque,), (angle,), settings.carry, OUTPUTS, step, settings=settings.describe()
    )


def unpack(carry: Scalars) -> tuple[Any, Any]:
    """z, shape (4, 1), and its covariance, shape (4, 4), from the carry."""
    import casadi as ca

    rows = [[carry[f"P_{min(i, k)}{max(i, k)}"] for k in range(4)] for i in range(4)]
    return ca.vertcat(*[carry[f"z_{i}"] for i in range(4)]), ca.vertcat(*[ca.horzcat(*row) for row in rows])


def finish(
    settings: JointSettings, carry: Scalars, z: list[Scalar], P: dict[tuple[int, int], Scalar], e: Scalar, s: Scalar, torque: Scalar
) -> tuple[Scalars, Scalars]:  # fmt: skip
    """The new carry and the outputs of a joint filter."""
    new = {
        **carry, "started": 1.0, "torque_before": torque, **{f"z_{i}": z[i] for i in range(4)},
        **{f"P_{i}{k}": P[i, k] for i, k in PAIRS},
    }  # fmt: skip
    values, sds = physical(z, P, settings)
    numbers = (*values, *sds, e, sqrt(s))
    return new, {output.name: number for output, number in zip(OUTPUTS, numbers, strict=True)}
