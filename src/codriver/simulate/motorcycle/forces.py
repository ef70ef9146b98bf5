"""What acts on the simulated motorcycle: weight, air, hands, engine, brake, springs, and the tyres on the road.

N = (k s + c s' + Y sin phi_w) / cos phi_w                        the tyre's spring lies in the wheel's plane
sigma / V F' + F = F_0(N, slip, camber)                           along and across, `tyre`
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos

import casadi as ca

from codriver.simulate.motorcycle.kinematics import UP, Pose, WheelPose
from codriver.simulate.motorcycle.parameters import MachineParameters, TyreParameters
from codriver.simulate.motorcycle.tyre import steady_forces

SLOWEST = 1.0  # m/s in the slips' denominators


@dataclass(frozen=True, eq=False)
class Forces:
    """Forces on the machine.

    Attributes:
        generalised: on the coordinates, shape (12, 1).
        relaxing: rates of the tyres' four forces, N/s.
        loads: of front and rear tyre, N.
        slips: tan(alpha) of both.
    """

    generalised: ca.SX
    relaxing: ca.SX
    loads: ca.SX
    slips: ca.SX


def forces(
    m: MachineParameters, at: Pose, q: ca.SX, u: ca.SX, tyres: ca.SX, inputs: dict[str, ca.SX], gravity: ca.SX,
    *, road: bool, grip: bool,
) -> Forces:  # fmt: skip
    """All forces as expressions.

    Args:
        m: the parameters.
        at: the parts.
        q, u: coordinates and rates.
        tyres: longitudinal force front and rear, lateral force front and rear, N.
        inputs: of the machine, by name.
        gravity: m/s^2, shape (3, 1).
        road, grip: whether there is a road, and force along it.
    """
    p = m.sharp
    generalised = ca.SX.zeros(12)

    def push(velocity: ca.SX, force: ca.SX) -> ca.SX:
        return ca.jacobian(velocity, u).T @ force

    for body in at.bodies:
        generalised += push(body.velocity, body.mass * gravity)
    if grip:
        over = u[:3]
        generalised[:3] -= m.air_density * m.drag_area / 2 * ca.sqrt(ca.dot(over, over) + 1e-12) * over
    generalised[4] += inputs["roll_moment"]
    generalised[6] += inputs["rider_torque"] - p.K * u[6]
    generalised[10] -= inputs["front_brake_torque"]
    generalised[11] += inputs["drive_torque"]
    if m.suspension is not None:
        front, rear = rest_forces(m)
        generalised[7] -= front + m.suspension.front_stiffness * q[7] + m.suspension.front_damping * u[7]
        generalised[8] -= rear + m.suspension.rear_stiffness * q[8] + m.suspension.rear_damping * u[8]
    if m.upper_body is not None:
        generalised[9] += inputs["lean_torque"] - m.upper_body.stiffness * q[9] - m.upper_body.damping * u[9]
    if not road:
        return Forces(generalised, ca.SX.zeros(4), ca.SX.zeros(2), ca.SX.zeros(2))
    sides = (
        (at.front_wheel, m.front, (p.Cf1, p.Cf2), p.sf),
        (at.rear_wheel, m.rear, (p.Cr1, p.Cr2), p.sr),
    )
    relaxing, loads, slips = ca.SX.zeros(4), [], []
    for i, (wheel, tyre, stiffnesses, length) in enumerate(sides):
        along, side = tyres[i], tyres[2 + i]
        load = normal_load(wheel, tyre, side if grip else ca.SX(0))
        loads.append(load)
        force = load * UP
        speed = ca.fmax(ca.dot(wheel.hub_velocity, wheel.forward), SLOWEST)
        tan_slip = ca.dot(wheel.contact_velocity, wheel.left) / speed
        slips.append(tan_slip)
        if grip:
            kappa = -ca.dot(wheel.contact_velocity, wheel.forward) / speed
            wanted = steady_forces(
                ca.fmax(load, 1.0), tan_slip, wheel.camber, kappa, along, m.loads[i], stiffnesses, tyre
            )
            relaxing[i] = speed / length * (wanted[0] - along)
            relaxing[2 + i] = speed / length * (wanted[1] - side)
            force += along * wheel.forward + side * wheel.left
            generalised += push(wheel.frame.rate, -wanted[2] * side * UP)
        generalised += push(wheel.contact_velocity, force)
    return Forces(generalised, relaxing, ca.vertcat(*loads), ca.vertcat(*slips))


def normal_load(wheel: WheelPose, tyre: TyreParameters, side: ca.SX) -> ca.SX:
    """A tyre's load, N, while it is pressed; never pulling.

    Args:
        wheel: where it is.
        tyre: its spring and damper.
        side: lateral force, N.
    """
    spring = tyre.radial_stiffness * wheel.deflection + tyre.radial_damping * wheel.deflection_rate
    return ca.if_else(wheel.deflection > 0, ca.fmax((spring + side * wheel.axle[2]) / wheel.upright, 0), 0)


def rest_forces(m: MachineParameters) -> tuple[float, float]:
    """What fork and rear spring carry at rest, N.

    Args:
        m: with a suspension.
    """
    soft, p = m.suspension, m.sharp
    if soft is None:
        return 0.0, 0.0
    front, rear = m.loads
    return cos(p.eps) * (front - soft.front_unsprung * p.g), rear - soft.rear_unsprung * p.g


def potential_energy(m: MachineParameters, at: Pose, q: ca.SX, *, road: bool) -> ca.SX:
    """Of weight on a level road and of all springs, J.

    Args:
        m: the parameters.
        at: the parts.
        q: coordinates.
        road: whether there is one.
    """
    total = ca.SX(0)
    for body in at.bodies:
        total += body.mass * m.sharp.g * body.centre[2]
    if road:
        for wheel, tyre in ((at.front_wheel, m.front), (at.rear_wheel, m.rear)):
            total += tyre.radial_stiffness * ca.fmax(wheel.deflection, 0) ** 2 / 2
    if m.suspension is not None:
        front, rear = rest_forces(m)
        total += front * q[7] + m.suspension.front_stiffness * q[7] ** 2 / 2
        total += rear * q[8] + m.suspension.rear_stiffness * q[8] ** 2 / 2
    if m.upper_body is not None:
        total += m.upper_body.stiffness * q[9] ** 2 / 2
    return total
