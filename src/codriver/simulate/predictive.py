"""Anticipation by a plan: the wheel angle that a model-predictive controller would start with.

    minimise  sum_i (y_i / y_unit)^2 + ((psi_i + beta_i) / course_unit)^2 + ((d_i - d_{i-1}) / step_unit)^2,     i = 1 .. N

over the road wheels' angles d_0 .. d_{N-1}, each held for h s, and no change after the last, where (beta, r, psi, y) follow the
single-track model at constant speed on a path whose curvature the driver sees ahead. y, offset, m; psi, heading error, rad; beta,
sideslip, rad. Nothing is bounded, so the first angle is a fixed linear function of state and curvatures, and the plan is made
once: CasADi gives the Hessian and the mixed derivatives of the cost.

The idea, a two-point driver whose anticipation is predictive control, is Okamoto, Tsiotras 2016, "A new hybrid sensorimotor
driver model with model predictive control" (IEEE SMC, 1866-1871); cost and horizon here are this project's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from codriver.models.single_track import SingleTrack
from codriver.models.state_space import StateSpace
from codriver.signals.signal import Array


@dataclass(frozen=True)
class Plan:
    """What the plan weighs.

    Attributes:
        horizon: s, seen ahead.
        step: h, s.
        offset, course, change: y_unit, m; course_unit, rad; step_unit, rad of the road wheels.
    """

    horizon: float = 1.5
    step: float = 0.1
    offset: float = 1.0
    course: float = 0.2
    change: float = 0.005


@dataclass(frozen=True, eq=False)
class PlanLaw:
    """The plan's first angle of the road wheels, rad: state @ (beta, r, psi, y) + ahead @ rho.

    Attributes:
        state: shape (4,).
        ahead: of the curvatures h, 2 h, ... and now ahead, the present one first, shape (N + 1,), m.
        step: h, s.
    """

    state: Array
    ahead: Array
    step: float


def plan_law(car: SingleTrack, speed: float, plan: Plan) -> PlanLaw:
    """Solve the plan once and for all states.

    Args:
        car: whose motion is predicted.
        speed: m/s.
        plan: horizon and weights.
    """
    import casadi as ca

    n = round(plan.horizon / plan.step)
    model = _on_path(car, speed)
    F = model.transition(plan.step)
    G0, G1 = model.input_maps(plan.step)
    held, early, late = (G0 + G1)[:, 0], G0[:, 1], G1[:, 1]
    angles, start, rho = ca.SX.sym("d", n), ca.SX.sym("x", 4), ca.SX.sym("rho", n + 1)
    x, cost = start, ca.SX(0)
    for i in range(n):
        x = ca.mtimes(ca.DM(F), x) + ca.DM(held) * angles[i] + ca.DM(early) * rho[i] + ca.DM(late) * rho[i + 1]
        cost += (x[3] / plan.offset) ** 2 + ((x[2] + x[0]) / plan.course) ** 2
    cost += ca.sumsqr(ca.diff(angles)) / plan.change**2
    given = ca.vertcat(start, rho)
    slope = ca.gradient(cost, angles)
    derivatives = ca.Function("plan", [], [ca.jacobian(slope, angles), ca.jacobian(slope, given)])()
    hessian, mixed = (np.array(ca.DM(derivatives[name])) for name in ("o0", "o1"))
    law = -np.linalg.solve(hessian, mixed)[0]
    return PlanLaw(law[:4], law[4:], plan.step)


def _on_path(car: SingleTrack, speed: float) -> StateSpace:
    """Single track and path errors; inputs angle of the road wheels and curvature."""
    plane = car.model(speed)
    A, B = np.zeros((4, 4)), np.zeros((4, 2))
    A[:2, :2], B[:2, :1] = plane.A, plane.B
    A[2, 1], B[2, 1] = 1.0, -speed
    A[3, 0] = A[3, 2] = speed
    states = ("sideslip_angle", "yaw_rate", "heading_error", "lateral_offset")
    return StateSpace(A, B, np.eye(4), np.zeros((4, 2)), states, ("steer_angle", "road_curvature"), states)
