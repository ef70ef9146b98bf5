"""Equations of motion of the simulated motorcycle, Lagrange's, from its kinetic energy; the derivatives by casadi.

    d/dt (dT/du) - dT/dq = Q,   T = sum m v^2 / 2 + w I w / 2 + i_w (w_w . axle)^2 / 2
    sigma / V F' + F = F_0       the tyre's forces, `tyre`

In: any roll, pitch and steer; heave and pitch on radial tyre springs, so load transfer; toroidal tyres; magic-formula forces with
relaxation, camber, saturation, load; both wheels' spin and longitudinal slip, drive torque and brakes; drag of the air; pneumatic
trail; steer damper; road bank. Not in: suspension beside the tyres' springs, leaning rider, flexible frame, chain, unevenness,
curvature of the road's surface. Contacts are frictionless to turning about the normal, apart from the trail.

State: q[0:7], u (9), then longitudinal force front and rear, lateral force front and rear, N.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from codriver.signals.signal import Array
from codriver.simulate.motorcycle.kinematics import UP, Pose, WheelPose, pose
from codriver.simulate.motorcycle.parameters import MachineParameters, TyreParameters
from codriver.simulate.motorcycle.tyre import steady_forces

STATES = (
    "x", "y", "z", "yaw", "roll", "pitch", "steer",
    "x_rate", "y_rate", "z_rate", "yaw_rate", "roll_rate", "pitch_rate", "steer_rate", "front_spin_rate", "rear_spin_rate",
    "front_longitudinal_force", "rear_longitudinal_force", "front_lateral_force", "rear_lateral_force",
)  # fmt: skip
INPUTS = (
    "rider_torque",
    "drive_torque",
    "front_brake_torque",
    "bank",
)  # N m, to the left; forward; backward; rad, to the right
OUTPUTS = (
    "body_roll_rate", "body_pitch_rate", "body_yaw_rate", "force_x", "force_y", "force_z", "front_load", "rear_load",
    "front_tan_slip", "rear_tan_slip",
)  # fmt: skip
SLOWEST = 1.0  # m/s in the slips' denominators


@dataclass(frozen=True, eq=False)
class Machine:
    """The simulated motorcycle.

    Attributes:
        parameters: of it.
        road: whether there is a road; without it the machine flies.
        grip: whether the tyres have forces along the road.
    """

    parameters: MachineParameters
    road: bool = True
    grip: bool = True

    @cached_property
    def _functions(self) -> tuple[ca.Function, ca.Function, ca.Function]:
        x, inputs = ca.SX.sym("x", len(STATES)), ca.SX.sym("inputs", len(INPUTS))
        q, u = ca.SX.sym("q", 9), ca.SX.sym("u", 9)
        at = pose(self.parameters, q, u)
        energy = kinetic_energy(at)
        momentum = ca.gradient(energy, u)
        mass = ca.jacobian(momentum, u)
        forces, relaxing, loads, slips = self._forces(at, u, x[16:], inputs)
        rest = ca.gradient(energy, q) - ca.jtimes(momentum, q, u) + forces
        diagonal, upper, order = ca.ldl(mass)
        turned = ca.ldl_solve(rest, diagonal, upper, order)
        specific = (
            ca.jtimes(at.imu_velocity, q, u) + ca.jtimes(at.imu_velocity, u, turned) - self._gravity(q, inputs[3])
        )
        out = ca.vertcat(at.rear.rotation.T @ at.rear.rate, at.rear.rotation.T @ specific, loads, slips)
        place = [ca.vertcat(x[:7], 0, 0), x[7:16]]

        def of_state(expression: ca.SX) -> ca.SX:
            return ca.substitute([expression], [q, u], place)[0]

        rate = ca.Function("rate", [x, inputs], [of_state(ca.vertcat(u[:7], turned, relaxing))])
        output = ca.Function("output", [x, inputs], [of_state(out)])
        conserved = ca.Function(
            "conserved", [x], [of_state(ca.vertcat(energy + self._potential(at), angular_momentum(at)))]
        )
        return rate, output, conserved

    @cached_property
    def _step(self) -> ca.Function:
        rate = self._functions[0]
        x, inputs, dt = ca.MX.sym("x", len(STATES)), ca.MX.sym("inputs", len(INPUTS)), ca.MX.sym("dt")
        k1 = rate(x, inputs)
        k2 = rate(x + dt / 2 * k1, inputs)
        k3 = rate(x + dt / 2 * k2, inputs)
        k4 = rate(x + dt * k3, inputs)
        return ca.Function("step", [x, inputs, dt], [x + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4)])

    def rate(self, state: Array, inputs: Array) -> Array:
        """x', shape (20,).

        Args:
            state: see `STATES`.
            inputs: see `INPUTS`.
        """
        return np.asarray(self._functions[0](state, inputs)).ravel()

    def step(self, state: Array, inputs: Array, dt: float = 1e-3) -> Array:
        """The state a step later, by Runge and Kutta's fourth order; the inputs are held.

        Args:
            state: see `STATES`.
            inputs: see `INPUTS`.
            dt: s.
        """
        return np.asarray(self._step(state, inputs, dt)).ravel()

    def output(self, state: Array, inputs: Array) -> Array:
        """What an ideal IMU and the tyres show: `OUTPUTS`, rad/s and m/s^2 in body axes, N.

        Args:
            state: see `STATES`.
            inputs: see `INPUTS`.
        """
        return np.asarray(self._functions[1](state, inputs)).ravel()

    def conserved(self, state: Array) -> Array:
        """Energy, J, and angular momentum about the mass centre, N m s, shape (4,). Energy has the tyres' springs, level road.

        Args:
            state: see `STATES`.
        """
        return np.asarray(self._functions[2](state)).ravel()

    def linearised(self, state: Array, inputs: Array) -> tuple[Array, Array]:
        """df/dx and df/dinputs, shapes (20, 20) and (20, 4).

        Args:
            state: see `STATES`.
            inputs: see `INPUTS`.
        """
        x, w = ca.MX.sym("x", len(STATES)), ca.MX.sym("w", len(INPUTS))
        value = self._functions[0](x, w)
        both = ca.Function("linear", [x, w], [ca.jacobian(value, x), ca.jacobian(value, w)])(state, inputs)
        return np.asarray(both[0]), np.asarray(both[1])

    def upright(self, speed: float) -> Array:
        """The state of rolling straight ahead.

        Args:
            speed: m/s.
        """
        p = self.parameters.sharp
        state = np.zeros(len(STATES))
        state[2], state[7] = p.h, speed
        state[14:16] = speed / p.Rf, speed / p.Rr
        return state

    def _gravity(self, q: ca.SX, bank: ca.SX) -> ca.SX:
        side = ca.sin(bank)
        return self.parameters.sharp.g * ca.vertcat(ca.sin(q[3]) * side, -ca.cos(q[3]) * side, -ca.cos(bank))

    def _potential(self, at: Pose) -> ca.SX:
        p, g = self.parameters, self.parameters.sharp.g
        total = g * (at.rear.mass * at.rear.centre[2] + at.front.mass * at.front.centre[2])
        if self.road:
            for wheel, tyre in ((at.front_wheel, p.front), (at.rear_wheel, p.rear)):
                total += tyre.radial_stiffness * ca.fmax(-wheel.contact[2], 0) ** 2 / 2
        return total

    def _forces(self, at: Pose, u: ca.SX, tyres: ca.SX, inputs: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX]:
        """Generalised forces; the tyre forces' rates; loads; tan(alpha) of both tyres."""
        m, p = self.parameters, self.parameters.sharp
        generalised = ca.SX.zeros(9)

        def push(velocity: ca.SX, force: ca.SX) -> ca.SX:
            return ca.jacobian(velocity, u).T @ force

        q = ca.vertcat(ca.SX.zeros(3), ca.atan2(at.rear_wheel.forward[1], at.rear_wheel.forward[0]))
        gravity = self._gravity(q, inputs[3])
        for frame in (at.rear, at.front):
            generalised += push(frame.velocity, frame.mass * gravity)
        if self.grip:
            drag = -m.air_density * m.drag_area / 2 * ca.norm_2(at.rear.velocity + 1e-9) * at.rear.velocity
            generalised += push(at.rear.velocity, drag)
        generalised[6] += inputs[0] - p.K * u[6]
        generalised[7] -= inputs[2]
        generalised[8] += inputs[1]
        if not self.road:
            return generalised, ca.SX.zeros(4), ca.SX.zeros(2), ca.SX.zeros(2)
        sides = (
            (at.front_wheel, m.front, (p.Cf1, p.Cf2), p.sf, at.front.rate),
            (at.rear_wheel, m.rear, (p.Cr1, p.Cr2), p.sr, at.rear.rate),
        )
        rates, loads, slips = [ca.SX.zeros(2), ca.SX.zeros(2)], [], []
        for i, (wheel, tyre, stiffnesses, length, turning) in enumerate(sides):
            load = normal_load(wheel, tyre)
            loads.append(load)
            force = load * UP
            speed = ca.fmax(ca.dot(wheel.hub_velocity, wheel.forward), SLOWEST)
            tan_slip = ca.dot(wheel.contact_velocity, wheel.left) / speed
            slips.append(tan_slip)
            if self.grip:
                kappa = -ca.dot(wheel.contact_velocity, wheel.forward) / speed
                along, side = tyres[i], tyres[2 + i]
                wanted = steady_forces(
                    ca.fmax(load, 1.0), tan_slip, wheel.camber, kappa, along, m.loads[i], stiffnesses, tyre
                )
                rates[0][i] = speed / length * (wanted[0] - along)
                rates[1][i] = speed / length * (wanted[1] - side)
                force += along * wheel.forward + side * wheel.left
                generalised += push(turning, -wanted[2] * side * UP)
            generalised += push(wheel.contact_velocity, force)
        return generalised, ca.vertcat(*rates), ca.vertcat(*loads), ca.vertcat(*slips)


def normal_load(wheel: WheelPose, tyre: TyreParameters) -> ca.SX:
    """A tyre's load, N: spring and damper while it is pressed, never pulling.

    Args:
        wheel: where it is.
        tyre: its spring and damper.
    """
    pressed = -wheel.contact[2]
    return ca.if_else(
        pressed > 0, ca.fmax(tyre.radial_stiffness * pressed - tyre.radial_damping * wheel.contact_velocity[2], 0), 0
    )


def kinetic_energy(at: Pose) -> ca.SX:
    """T, J.

    Args:
        at: the parts.
    """
    total = ca.SX(0)
    for frame in (at.rear, at.front):
        total += (
            frame.mass * ca.dot(frame.velocity, frame.velocity) / 2 + ca.dot(frame.rate, frame.inertia @ frame.rate) / 2
        )
    for wheel in (at.front_wheel, at.rear_wheel):
        total += wheel.spin_inertia * ca.dot(wheel.rate, wheel.axle) ** 2 / 2
    return total


def angular_momentum(at: Pose) -> ca.SX:
    """Of the whole machine about its mass centre, N m s, in the world's axes.

    Args:
        at: the parts.
    """
    mass = at.rear.mass + at.front.mass
    centre = (at.rear.mass * at.rear.centre + at.front.mass * at.front.centre) / mass
    total = ca.SX.zeros(3)
    for frame in (at.rear, at.front):
        total += frame.inertia @ frame.rate + frame.mass * ca.cross(frame.centre - centre, frame.velocity)
    for wheel in (at.front_wheel, at.rear_wheel):
        total += wheel.spin_inertia * ca.dot(wheel.rate, wheel.axle) * wheel.axle
    return total
