"""Equations of motion by Newton and Euler, projected on the coordinates' rates; the derivatives by casadi.

    sum_i J_v^T m a + J_w^T (I w' + w x I w) + J_w^T d/dt(i_w Omega axle) = Q,     J = dv/du

The road may turn under the machine: v = v_road + w_r x (p - foot), w = w_road + w_r, where w_r is how the road's frame turns beside
the heading (`ride`). J is of the motion on the road alone; what the turning road adds is known.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from codriver.simulate.motorcycle.kinematics import Body, Pose, WheelPose


@dataclass(frozen=True, eq=False)
class Flow:
    """Coordinates, their rates, and how the road's frame turns.

    Attributes:
        q, u: shape (12, 1).
        road: w_r, rad/s, shape (3, 1), in the axes of q.
        road_rate: its rate in these axes, rad/s^2.
    """

    q: ca.SX
    u: ca.SX
    road: ca.SX
    road_rate: ca.SX

    def velocity(self, place: ca.SX, velocity: ca.SX) -> ca.SX:
        """True velocity of a point, m/s.

        Args:
            place: m.
            velocity: on the road, m/s.
        """
        return velocity + ca.cross(self.road, place - ca.vertcat(self.q[:2], 0))

    def known(self, value: ca.SX) -> ca.SX:
        """The part of d/dt that does not hang on u'; for a vector as the road's frame sees it.

        Args:
            value: of q, u and `road`.
        """
        rate = ca.jtimes(value, self.q, self.u)
        return rate + ca.jtimes(value, self.road, self.road_rate) if ca.depends_on(value, self.road) else rate

    def acceleration(self, place: ca.SX, velocity: ca.SX) -> ca.SX:
        """True acceleration of a point, m/s^2, without J u'.

        Args:
            place: m.
            velocity: on the road, m/s.
        """
        true = self.velocity(place, velocity)
        return self.known(true) + ca.cross(self.road, true)


def inertia_and_rest(at: Pose, flow: Flow) -> tuple[ca.SX, ca.SX]:
    """M and r of M u' + r = Q, shapes (12, 12) and (12, 1). Coordinates that nothing hangs on get a mass of 1.

    Args:
        at: the parts.
        flow: coordinates and road.
    """
    mass, rest = ca.SX(12, 12), ca.SX.zeros(12)
    for body in at.bodies:
        jacobian = ca.jacobian(body.velocity, flow.u)
        mass += body.mass * jacobian.T @ jacobian
        rest += body.mass * jacobian.T @ flow.acceleration(body.centre, body.velocity)
        if body.inertia.nnz():
            turning, moment = _turning(body, flow)
            mass += turning.T @ body.inertia @ turning
            rest += turning.T @ moment
    for wheel in (at.front_wheel, at.rear_wheel):
        spinning = ca.jacobian(wheel.spin, flow.u)
        turning = ca.jacobian(wheel.rate, flow.u)
        true = wheel.spin + ca.dot(flow.road, wheel.axle)
        tilting = ca.cross(wheel.frame.rate + flow.road, wheel.axle)
        mass += wheel.spin_inertia * spinning.T @ spinning
        rest += wheel.spin_inertia * turning.T @ (flow.known(true) * wheel.axle + true * tilting)
    for i in range(12):
        if not mass[i, :].nnz():
            mass[i, i] = 1
    return mass, rest


def _turning(body: Body, flow: Flow) -> tuple[ca.SX, ca.SX]:
    """dw/du, and the moment I w' + w x I w without what hangs on u'."""
    rate = body.frame.rate
    true = rate + flow.road
    known = flow.known(true) + ca.cross(flow.road, true)
    return ca.jacobian(rate, flow.u), body.inertia @ known + ca.cross(true, body.inertia @ true)


def kinetic_energy(at: Pose) -> ca.SX:
    """T on a road that stays, J.

    Args:
        at: the parts.
    """
    total = ca.SX(0)
    for body in at.bodies:
        turning = ca.dot(body.frame.rate, body.inertia @ body.frame.rate)
        total += (body.mass * ca.dot(body.velocity, body.velocity) + turning) / 2
    for wheel in (at.front_wheel, at.rear_wheel):
        total += wheel.spin_inertia * wheel.spin**2 / 2
    return total


def angular_momentum(at: Pose) -> ca.SX:
    """Of the whole machine about its mass centre, N m s, in the world's axes.

    Args:
        at: the parts.
    """
    mass = sum(body.mass for body in at.bodies)
    centre = sum((body.mass * body.centre for body in at.bodies), ca.SX.zeros(3)) / mass
    total = ca.SX.zeros(3)
    for body in at.bodies:
        total += body.inertia @ body.frame.rate + body.mass * ca.cross(body.centre - centre, body.velocity)
    for wheel in (at.front_wheel, at.rear_wheel):
        total += _momentum(wheel)
    return total


def _momentum(wheel: WheelPose) -> ca.SX:
    return wheel.spin_inertia * wheel.spin * wheel.axle
