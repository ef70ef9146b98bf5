"""Where the simulated motorcycle's parts are, at any roll, pitch and steer: no small angles.

    R = Rz(psi) Rx(phi) Ry(theta),   front frame: R times the turn by delta about the steer axis (-sin eps, 0, cos eps)
    contact = hub + (R_w - rho - s) d - rho N,   its height 0 gives the tyre's deflection s

q = (x, y, z, psi, phi, theta, delta, s_f, s_r, lambda, turn_f, turn_r): the rear frame's mass centre in the world (z up), m; yaw
to the left, roll to the right, pitch nose down, steer to the left, rad; travel of the suspensions, pressed in, m; the rider's lean
to the right of the frame, rad; turn of the wheels in their frames, rad. The rear frame's mass centre is Sharp's, rider upright.

A wheel is a torus: d the steepest way down in its plane, rho the crown radius, N the road's normal, R_w the radius. It gives way
along d: the load and the side force of a balanced turn lie in the wheel's plane together, and with a crown of 0 the contact stays
there. Loaded radii at rest are Sharp's, so the free ones are load / stiffness more.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin

import casadi as ca
import numpy as np

from codriver.simulate.motorcycle.masses import Solid, solid, without
from codriver.simulate.motorcycle.parameters import MachineParameters

COORDINATES = (
    "x", "y", "z", "yaw", "roll", "pitch", "steer", "front_travel", "rear_travel", "rider_lean", "front_spin", "rear_spin",
)  # fmt: skip
UP = ca.DM([0, 0, 1])
LEFT = ca.DM([0, 1, 0])
AHEAD = ca.DM([1, 0, 0])
NOWHERE = ca.DM([0, 0, 0])


def turn(axis: ca.DM, angle: ca.SX) -> ca.SX:
    """Rotation about a unit axis (Rodrigues).

    Args:
        axis: shape (3, 1).
        angle: rad.
    """
    k = ca.skew(axis)
    return ca.SX.eye(3) + ca.sin(angle) * k + (1 - ca.cos(angle)) * (k @ k)


@dataclass(frozen=True, eq=False)
class Frame:
    """A rigid frame in the world.

    Attributes:
        rotation: from the frame to the world, shape (3, 3).
        rate: angular velocity, world, rad/s.
    """

    rotation: ca.SX
    rate: ca.SX


@dataclass(frozen=True, eq=False)
class Body:
    """A mass in the world.

    Attributes:
        frame: that it is in.
        mass: kg.
        inertia: about the mass centre, world axes, kg m^2.
        centre: m.
        velocity: of it, m/s.
    """

    frame: Frame
    mass: float
    inertia: ca.SX
    centre: ca.SX
    velocity: ca.SX


@dataclass(frozen=True, eq=False)
class WheelPose:
    """A wheel in the world.

    Attributes:
        frame: that carries it.
        axle: unit vector, to the left.
        spin: angular velocity about the axle, rad/s.
        spin_inertia: about the axle, kg m^2.
        rate: angular velocity with its spin, rad/s.
        hub_velocity: m/s.
        deflection: s, m; negative in the air.
        deflection_rate: m/s.
        contact_velocity: of the tyre's material on the road, m/s.
        forward, left: unit vectors on the road.
        camber: to the right, rad.
        upright: cosine of the camber.
    """

    frame: Frame
    axle: ca.SX
    spin: ca.SX
    spin_inertia: float
    rate: ca.SX
    hub_velocity: ca.SX
    deflection: ca.SX
    deflection_rate: ca.SX
    contact_velocity: ca.SX
    forward: ca.SX
    left: ca.SX
    camber: ca.SX
    upright: ca.SX


@dataclass(frozen=True, eq=False)
class Pose:
    """All parts, and the IMU's place and velocity, m and m/s."""

    rear: Frame
    front: Frame
    bodies: tuple[Body, ...]
    front_wheel: WheelPose
    rear_wheel: WheelPose
    imu: ca.SX
    imu_velocity: ca.SX


def solids(machine: MachineParameters) -> tuple[Solid, Solid]:
    """Sharp's frames, in the rear frame's axes from the road point below its mass centre, upright.

    Args:
        machine: the parameters.
    """
    p = machine.sharp
    c, s = cos(p.eps), sin(p.eps)
    of_rear = np.array([[p.Irx, 0, p.Crxz], [0, machine.rear_pitch_inertia, 0], [p.Crxz, 0, p.Irz]])
    rear = solid(p.Mr, (0, 0, p.h), of_rear)
    tilt = ca.DM([[c, 0, -s], [0, 1, 0], [s, 0, c]])  # columns: across the steer axis, left, along it
    inertia = (tilt @ ca.diag(ca.DM([p.Ifx, machine.front_pitch_inertia, p.Ifz])) @ tilt.T).full()
    centre = (p.a * c - p.f * s + p.e * c, 0, p.a * s + p.f * c + p.e * s)
    return rear, solid(p.Mf, centre, inertia)


def pose(machine: MachineParameters, q: ca.SX, u: ca.SX) -> Pose:
    """The parts as expressions.

    Args:
        machine: the parameters.
        q: coordinates, shape (12, 1).
        u: their rates, shape (12, 1).
    """
    p, soft, rider = machine.sharp, machine.suspension, machine.upper_body
    c, s = cos(p.eps), sin(p.eps)
    axis = ca.DM([-s, 0, c])
    heading = turn(UP, q[3])
    rolled = heading @ turn(AHEAD, q[4])
    rear = Frame(rolled @ turn(LEFT, q[5]), u[3] * UP + u[4] * heading @ AHEAD + u[5] * rolled @ LEFT)
    front = Frame(rear.rotation @ turn(axis, q[6]), rear.rate + u[6] * rear.rotation @ axis)

    def at(
        frame: Frame, arm: ca.SX | ca.DM, origin: tuple[ca.SX, ca.SX], sliding: ca.SX | ca.DM = NOWHERE
    ) -> tuple[ca.SX, ca.SX]:  # fmt: skip
        """Place and velocity of a point in a frame: arm from the origin, its rate in the frame."""
        turned = frame.rotation @ arm
        return origin[0] + turned, origin[1] + ca.cross(frame.rate, turned) + frame.rotation @ sliding

    centre = ca.DM([0, 0, p.h])
    head = ca.DM([p.a * c, 0, p.a * s])  # foot of a on the steer axis
    origin = q[:3], u[:3]
    steered = at(rear, head - centre, origin)
    front_arm, rear_arm = ca.DM([p.front, 0, p.Rf]), ca.DM([-p.b, 0, p.Rr])
    front_hub, rear_hub = at(front, front_arm - head, steered), at(rear, rear_arm - centre, origin)
    whole_rear, whole_front = solids(machine)
    parts_rear: list[Solid] = []
    parts_front: list[Solid] = []
    bodies: list[Body] = []
    if soft is not None:
        front_hub = at(front, front_arm - head + q[7] * axis, steered, u[7] * axis)
        rear_hub = at(rear, rear_arm - centre + q[8] * UP, origin, u[8] * UP)
        parts_front.append(solid(soft.front_unsprung, front_arm.full().ravel(), (0, 0, 0)))
        parts_rear.append(solid(soft.rear_unsprung, rear_arm.full().ravel(), (0, 0, 0)))
        bodies.append(Body(front, soft.front_unsprung, ca.SX(3, 3), *front_hub))
        bodies.append(Body(rear, soft.rear_unsprung, ca.SX(3, 3), *rear_hub))
    if rider is not None:
        hip = ca.DM([rider.hip[0], 0, rider.hip[1]])
        body = solid(rider.mass, (rider.hip[0], 0, rider.hip[1] + rider.above), rider.inertia)
        leaning = Frame(rear.rotation @ turn(AHEAD, q[9]), rear.rate + u[9] * rear.rotation @ AHEAD)
        parts_rear.append(body)
        bodies.append(in_frame(leaning, body, at(leaning, rider.above * UP, at(rear, hip - centre, origin))))
    rest_rear, rest_front = without(whole_rear, parts_rear), without(whole_front, parts_front)
    bodies.append(in_frame(rear, rest_rear, at(rear, ca.DM(rest_rear.centre) - centre, origin)))
    bodies.append(in_frame(front, rest_front, at(front, ca.DM(rest_front.centre) - head, steered)))

    def wheel(
        frame: Frame, hub: tuple[ca.SX, ca.SX], spin: ca.SX, inertia: float, radius: float, crown: float
    ) -> WheelPose:
        axle = frame.rotation @ LEFT
        upright = ca.sqrt(1 - axle[2] ** 2)
        down = (axle * axle[2] - UP) / upright
        deflection = radius - crown - (hub[0][2] - crown) / upright
        touching = (radius - crown - ca.fmax(deflection, 0)) * down - crown * UP
        forward = ca.cross(axle, UP) / upright
        turning = frame.rate + spin * axle
        return WheelPose(
            frame, axle, ca.dot(turning, axle), inertia, turning, hub[1], deflection, ca.jtimes(deflection, q, u),
            hub[1] + ca.cross(turning, touching), forward, ca.cross(UP, forward), ca.asin(axle[2]), upright,
        )  # fmt: skip

    load_f, load_r = machine.loads
    free_f, free_r = p.Rf + load_f / machine.front.radial_stiffness, p.Rr + load_r / machine.rear.radial_stiffness
    return Pose(
        rear, front, tuple(bodies),
        wheel(front, front_hub, u[10], p.ify, free_f, machine.front.crown),
        wheel(rear, rear_hub, u[11], p.iry, free_r, machine.rear.crown),
        *at(rear, ca.DM(machine.imu) - centre, origin),
    )  # fmt: skip


def in_frame(frame: Frame, body: Solid, at: tuple[ca.SX, ca.SX]) -> Body:
    """A body that moves with a frame.

    Args:
        frame: the frame.
        body: its mass and inertia, in the frame's axes.
        at: place and velocity of its mass centre.
    """
    return Body(frame, body.mass, frame.rotation @ ca.DM(body.inertia) @ frame.rotation.T, *at)
