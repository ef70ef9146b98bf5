"""Where the simulated motorcycle's parts are, at any roll, pitch and steer: no small angles.

    R = Rz(psi) Rx(phi) Ry(theta),   front frame: R times the turn by delta about the steer axis (-sin eps, 0, cos eps)
    contact = hub + (R_w - rho) d - rho N

q = (x, y, z, psi, phi, theta, delta, s_f, s_r): rear frame's mass centre in the world (z up), m; yaw to the left, roll to the
right, pitch nose down, steer to the left, turn of the wheels in their frames, rad. A wheel is a torus: d the steepest way down in
its plane, rho the crown radius, N the road's normal, R_w the radius. Loaded radii at rest are Sharp's, so the free ones are load /
stiffness more.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin

import casadi as ca

from codriver.simulate.motorcycle.parameters import MachineParameters

COORDINATES = ("x", "y", "z", "yaw", "roll", "pitch", "steer", "front_spin", "rear_spin")
UP = ca.DM([0, 0, 1])
LEFT = ca.DM([0, 1, 0])


def skew_part(turn_rate: ca.SX) -> ca.SX:
    """The vector w of a matrix whose antisymmetric part is w x.

    Args:
        turn_rate: R' R^T, shape (3, 3).
    """
    return ca.vertcat(turn_rate[2, 1], turn_rate[0, 2], turn_rate[1, 0])


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
        centre: mass centre, m.
        velocity: of it, m/s.
        mass: kg.
        inertia: about the mass centre, world axes, kg m^2.
    """

    rotation: ca.SX
    rate: ca.SX
    centre: ca.SX
    velocity: ca.SX
    mass: float
    inertia: ca.SX


@dataclass(frozen=True, eq=False)
class WheelPose:
    """A wheel in the world.

    Attributes:
        axle: unit vector, to the left.
        rate: angular velocity with its spin, rad/s.
        spin_inertia: about the axle, kg m^2.
        hub_velocity: m/s.
        contact: lowest point, m; below the road where the tyre is pressed.
        contact_velocity: of the tyre's material above it on the road's surface, m/s.
        forward, left: unit vectors on the road.
        camber: to the right, rad.
    """

    axle: ca.SX
    rate: ca.SX
    spin_inertia: float
    hub_velocity: ca.SX
    contact: ca.SX
    contact_velocity: ca.SX
    forward: ca.SX
    left: ca.SX
    camber: ca.SX


@dataclass(frozen=True, eq=False)
class Pose:
    """Both frames and wheels, and the IMU's velocity, m/s."""

    rear: Frame
    front: Frame
    front_wheel: WheelPose
    rear_wheel: WheelPose
    imu_velocity: ca.SX


def pose(machine: MachineParameters, q: ca.SX, u: ca.SX) -> Pose:
    """The parts as expressions.

    Args:
        machine: the parameters.
        q: coordinates, shape (9, 1).
        u: their rates, shape (9, 1).
    """
    p = machine.sharp
    c, s = cos(p.eps), sin(p.eps)
    axis = ca.DM([-s, 0, c])
    rear_turn = turn(UP, q[3]) @ turn(ca.DM([1, 0, 0]), q[4]) @ turn(LEFT, q[5])
    front_turn = rear_turn @ turn(axis, q[6])

    def rate(rotation: ca.SX) -> ca.SX:
        moved = ca.reshape(ca.jtimes(ca.vec(rotation), q, u), 3, 3)
        return skew_part(moved @ rotation.T)

    def velocity(point: ca.SX) -> ca.SX:
        return ca.jtimes(point, q, u)

    mass_centre = ca.DM([0, 0, p.h])
    head = ca.DM([p.a * c, 0, p.a * s])  # foot of a on the steer axis

    def on_rear(point: ca.DM) -> ca.SX:
        return q[:3] + rear_turn @ (point - mass_centre)

    def on_front(point: ca.DM) -> ca.SX:
        return on_rear(head) + front_turn @ (point - head)

    rear_inertia = ca.DM([[p.Irx, 0, p.Crxz], [0, machine.rear_pitch_inertia, 0], [p.Crxz, 0, p.Irz]])
    tilt = ca.DM([[c, 0, -s], [0, 1, 0], [s, 0, c]])  # columns: across the steer axis, left, along it
    front_inertia = tilt @ ca.diag(ca.DM([p.Ifx, machine.front_pitch_inertia, p.Ifz])) @ tilt.T
    front_centre = on_front(head + p.f * axis + p.e * ca.DM([c, 0, s]))
    rear = Frame(rear_turn, rate(rear_turn), q[:3], u[:3], p.Mr, rear_turn @ rear_inertia @ rear_turn.T)
    front = Frame(
        front_turn,
        rate(front_turn),
        front_centre,
        velocity(front_centre),
        p.Mf,
        front_turn @ front_inertia @ front_turn.T,
    )

    def wheel(frame: Frame, hub: ca.SX, spin: ca.SX, inertia: float, radius: float, crown: float) -> WheelPose:
        axle = frame.rotation @ LEFT
        down = axle * axle[2] - UP
        down = down / ca.norm_2(down)
        arm = (radius - crown) * down - crown * UP
        forward = ca.cross(axle, UP)
        forward = forward / ca.norm_2(forward)
        lowest = hub + arm
        touching = arm + ca.fmax(-lowest[2], 0) * UP  # on the road's surface, not below
        turning = frame.rate + spin * axle
        moving = velocity(hub)
        return WheelPose(
            axle, turning, inertia, moving, lowest, moving + ca.cross(turning, touching), forward, ca.cross(UP, forward),
            ca.asin(axle[2]),
        )  # fmt: skip

    load_f, load_r = machine.loads
    free_f, free_r = p.Rf + load_f / machine.front.radial_stiffness, p.Rr + load_r / machine.rear.radial_stiffness
    return Pose(
        rear, front,
        wheel(front, on_front(ca.DM([p.front, 0, p.Rf])), u[7], p.ify, free_f, machine.front.crown),
        wheel(rear, on_rear(ca.DM([-p.b, 0, p.Rr])), u[8], p.iry, free_r, machine.rear.crown),
        velocity(on_rear(ca.DM(machine.imu))),
    )  # fmt: skip
