"""The simulated motorcycle: state, inputs, equations of motion (`motion`), forces (`forces`), compiled (`compiled`).

In: any roll, pitch and steer; heave and pitch on the tyres' radial springs and, if wished, fork and rear spring, so load transfer;
toroidal tyres; magic-formula forces with relaxation, camber, saturation, load; both wheels' spin and longitudinal slip, drive and
brakes; drag of the air; pneumatic trail; steer damper; a rider who leans beside the machine, if wished; a road whose bank changes
and that turns. Not in: flexible frame, chain, end stops, unevenness, lift of the air. Contacts are frictionless to turning
about the normal, apart from the trail.

State: q[0:10], u (12), then longitudinal force front and rear, lateral force front and rear, N.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache

import casadi as ca
import numpy as np

from codriver.signals.signal import Array
from codriver.simulate.motorcycle.compiled import Code, compiled
from codriver.simulate.motorcycle.forces import forces, potential_energy
from codriver.simulate.motorcycle.kinematics import COORDINATES, UP, pose, turn
from codriver.simulate.motorcycle.motion import Flow, angular_momentum, inertia_and_rest, kinetic_energy
from codriver.simulate.motorcycle.parameters import MachineParameters

_PLACES = 10  # the turn of the wheels is no state
STATES = (
    *COORDINATES[:_PLACES], *(f"{name}_rate" for name in COORDINATES), "front_longitudinal_force", "rear_longitudinal_force",
    "front_lateral_force", "rear_lateral_force",
)  # fmt: skip
INPUTS = (
    "rider_torque", "drive_torque", "front_brake_torque", "lean_torque", "roll_moment", "bank", "road_roll_rate",
    "road_turn_rate", "road_roll_acceleration", "heading_error",
)  # fmt: skip
# N m: hands, to the left; forward; backward; hips and feet, to the right. Then of the road: its bank, rad, to the right, and the
# bank's rates, rad/s, rad/s^2; the turn of its course, rad/s, to the left; the machine's heading less the course's, rad.
OUTPUTS = (
    "body_roll_rate", "body_pitch_rate", "body_yaw_rate", "force_x", "force_y", "force_z", "front_load", "rear_load",
    "front_tan_slip", "rear_tan_slip",
)  # fmt: skip


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
    def _rate(self) -> Callable[[Array, Array], Array]:
        return _code(self.parameters, self.road, self.grip, 0).call()

    @cached_property
    def _output(self) -> Callable[[Array, Array], Array]:
        return _code(self.parameters, self.road, self.grip, 1).call()

    @cached_property
    def _linear(self) -> ca.Function:
        x, w = ca.MX.sym("x", len(STATES)), ca.MX.sym("w", len(INPUTS))
        value = _functions(self.parameters, self.road, self.grip)[0](x, w)
        return ca.Function("linear", [x, w], [ca.jacobian(value, x), ca.jacobian(value, w)])

    @cached_property
    def _conserved(self) -> ca.Function:
        x = ca.SX.sym("x", len(STATES))
        q, u = ca.vertcat(x[:_PLACES], 0, 0), x[10:22]
        q_, u_ = ca.SX.sym("q", 12), ca.SX.sym("u", 12)
        at = pose(self.parameters, q_, u_)
        energy = kinetic_energy(at) + potential_energy(self.parameters, at, q_, road=self.road)
        both = ca.substitute([ca.vertcat(energy, angular_momentum(at))], [q_, u_], [q, u])
        return ca.Function("conserved", [x], both)

    def rate(self, state: Array, inputs: Array) -> Array:
        """x', shape (26,).

        Args:
            state: see `STATES`.
            inputs: see `INPUTS`.
        """
        return self._rate(state, inputs)

    def step(self, state: Array, inputs: Array, dt: float = 1e-3) -> Array:
        """The state a step later, by Runge and Kutta's fourth order; the inputs are held.

        Args:
            state: see `STATES`.
            inputs: see `INPUTS`.
            dt: s.
        """
        k1 = self._rate(state, inputs)
        k2 = self._rate(state + dt / 2 * k1, inputs)
        k3 = self._rate(state + dt / 2 * k2, inputs)
        k4 = self._rate(state + dt * k3, inputs)
        return state + dt / 6 * (k1 + 2 * (k2 + k3) + k4)

    def output(self, state: Array, inputs: Array) -> Array:
        """What an ideal IMU and the tyres show: `OUTPUTS`, rad/s and m/s^2 in body axes, N.

        Args:
            state: see `STATES`.
            inputs: see `INPUTS`.
        """
        return self._output(state, inputs)

    def conserved(self, state: Array) -> Array:
        """Energy, J, and angular momentum about the mass centre, N m s, shape (4,). Energy has all springs, level road.

        Args:
            state: see `STATES`.
        """
        return np.asarray(self._conserved(state)).ravel()

    def linearised(self, state: Array, inputs: Array) -> tuple[Array, Array]:
        """df/dx and df/dinputs, shapes (26, 26) and (26, 10).

        Args:
            state: see `STATES`.
            inputs: see `INPUTS`.
        """
        both = self._linear(state, inputs)
        return np.asarray(both[0]), np.asarray(both[1])

    def upright(self, speed: float) -> Array:
        """The state of rolling straight ahead.

        Args:
            speed: m/s.
        """
        p = self.parameters.sharp
        state = np.zeros(len(STATES))
        state[STATES.index("z")], state[STATES.index("x_rate")] = p.h, speed
        state[STATES.index("front_spin_rate")], state[STATES.index("rear_spin_rate")] = speed / p.Rf, speed / p.Rr
        return state


@lru_cache(maxsize=16)
def _code(parameters: MachineParameters, road: bool, grip: bool, which: int) -> Code:
    """One of `_functions` as machine code: the same machine is compiled once."""
    return compiled(_functions(parameters, road, grip)[which])


@lru_cache(maxsize=8)
def _functions(parameters: MachineParameters, road: bool, grip: bool) -> tuple[ca.Function, ca.Function]:
    """Rates of the states, and `OUTPUTS`. Worked out in the heading's axes: the yaw angle is 0 there."""
    x, inputs = ca.SX.sym("x", len(STATES)), ca.SX.sym("inputs", len(INPUTS))
    q, u = ca.SX.sym("q", 12), ca.SX.sym("u", 12)
    flow = Flow(q, u, ca.SX.sym("road", 3), ca.SX.sym("road_rate", 3))
    at = pose(parameters, q, u)
    given = {name: inputs[i] for i, name in enumerate(INPUTS)}
    course, bank = turn(UP, -given["heading_error"]), given["bank"]
    gravity = parameters.sharp.g * course @ ca.vertcat(0, -ca.sin(bank), -ca.cos(bank))
    acting = forces(parameters, at, q, u, x[22:], given, gravity, road=road, grip=grip)
    mass, rest = inertia_and_rest(at, flow)
    imu = flow.acceleration(at.imu, at.imu_velocity) - gravity, ca.jacobian(at.imu_velocity, u)
    heading = turn(UP, x[3])
    free = [q, u, flow.road, flow.road_rate]
    level = [
        ca.vertcat(0, 0, x[2], 0, x[4:_PLACES], 0, 0), ca.vertcat(heading.T @ x[10:13], x[13:22]),
        *_road_motion(course, given),
    ]  # fmt: skip
    wanted = [
        mass, acting.generalised - rest, acting.relaxing, at.rear.rotation, at.rear.rate + flow.road, *imu, acting.loads,
        acting.slips,
    ]  # fmt: skip
    mass, pushed, relaxing, rotation, rate, specific, lever, loads, slips = ca.substitute(wanted, free, level)
    diagonal, upper, order = ca.ldl(mass)
    turned = ca.ldl_solve(pushed, diagonal, upper, order)
    out = ca.vertcat(rotation.T @ rate, rotation.T @ (specific + lever @ turned), loads, slips)
    moving = ca.vertcat(x[10:20], heading @ turned[:3], turned[3:], relaxing)
    return ca.Function("rate", [x, inputs], [ca.cse(moving)]), ca.Function("output", [x, inputs], [ca.cse(out)])


def _road_motion(course: ca.SX, given: dict[str, ca.SX]) -> tuple[ca.SX, ca.SX]:
    """How a banked road's frame turns beside its turn about the normal, and the rate of that, in the heading's axes.

    The course turns about the vertical, which leans to the left by the bank: r / cos(beta) about it is r about the normal and
    r tan(beta) about the left. With r steady.

    Args:
        course: rotation from the course's axes.
        given: inputs by name.
    """
    bank, rolling, turning = given["bank"], given["road_roll_rate"], given["road_turn_rate"]
    rate = ca.vertcat(rolling, turning * ca.tan(bank), 0)
    own = ca.vertcat(given["road_roll_acceleration"], turning * rolling / ca.cos(bank) ** 2, 0)
    return course @ rate, course @ (own + ca.cross(turning * UP, rate))
