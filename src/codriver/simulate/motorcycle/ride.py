"""A ride: machine and rider through time, and what was true.

Truth in the observers' terms (`models.motorcycle`): roll, steer, their rates, yaw rate about the road's normal, lateral velocity of
the road point, tyre forces, rider torque, speed; and the IMU's ideal signals in body axes.

A banked road leans to the right of its course by beta(s). Its frame turns with the course about the vertical, of which the machine
on its flat ground knows only the part about the normal; the rest is added to all that feels inertia:

    w_r = (beta', kappa s' tan beta, 0) in the course's axes
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, hypot

import numpy as np

from codriver.errors import UsageError
from codriver.signals.signal import Array
from codriver.simulate.motorcycle.machine import INPUTS, OUTPUTS, STATES
from codriver.simulate.motorcycle.rider import ROLL, X_RATE, Y_RATE, YAW, Rider, road_point, road_state

_ROAD = INPUTS.index("bank")
_FALLEN = 1.2  # rad
_BANK_STEP = 0.5  # m


@dataclass(frozen=True, eq=False)
class Ride:
    """A ride.

    Attributes:
        time: s, shape (n,).
        states: shape (n, 26), `machine.STATES`.
        inputs: held from this tick to the next, shape (n, 10), `machine.INPUTS`.
        outputs: shape (n, 10), `machine.OUTPUTS`.
        linear: shape (n, 8), in the linear model's terms, `models.motorcycle.STATES`.
        distance, offset: of the road point along the course and to the left of it, m, shape (n,).
        rider: who rode.
    """

    time: Array
    states: Array
    inputs: Array
    outputs: Array
    linear: Array
    distance: Array
    offset: Array
    rider: Rider

    def of(self, name: str) -> Array:
        """A state, input or output by its name, shape (n,).

        Args:
            name: in `STATES`, `INPUTS` or `OUTPUTS`.
        """
        for names, values in ((STATES, self.states), (INPUTS, self.inputs), (OUTPUTS, self.outputs)):
            if name in names:
                return values[:, names.index(name)]
        raise KeyError(name)

    @property
    def speed(self) -> Array:
        """Of the rear frame's mass centre over the road, m/s, shape (n,)."""
        return np.hypot(self.of("x_rate"), self.of("y_rate"))

    @property
    def ahead(self) -> Array:
        """Velocity of the road point along the machine, m/s, shape (n,): in a turn it is outside of the mass centre, and faster."""
        yaw, side = self.of("yaw"), self.rider.machine.parameters.sharp.h * np.sin(self.of("roll"))
        return np.cos(yaw) * self.of("x_rate") + np.sin(yaw) * self.of("y_rate") - side * self.of("yaw_rate")


def level(_distance: float) -> float:
    """A road without bank.

    Args:
        _distance: m.
    """
    return 0.0


def ride(
    rider: Rider, duration: float, dt: float = 1e-3, bank: Callable[[float], float] = level, every: int = 1
) -> Ride:  # fmt: skip
    """Let a rider ride from the course's start, upright, at the speed wanted there.

    Args:
        rider: with machine, course and speed.
        duration: s.
        dt: of a tick, s.
        bank: of the road against distance, rad, to the right, smooth; roll is from the road's normal. The rider does not know it.
        every: how many ticks from one that is kept to the next.

    Raises:
        UsageError: the machine fell.
    """
    rider.begin()
    machine, height = rider.machine, rider.machine.parameters.sharp.h
    count = (round(duration / dt) + every - 1) // every
    state = machine.upright(rider.speed(0.0, 0.0))
    state[:2] += rider.path.at(0.0)[:2]
    state[YAW] = rider.path.at(0.0)[2]
    state[X_RATE], state[Y_RATE] = state[X_RATE] * np.cos(state[YAW]), state[X_RATE] * np.sin(state[YAW])
    states, inputs = np.empty((count, len(STATES))), np.empty((count, len(INPUTS)))
    outputs, along = np.empty((count, len(OUTPUTS))), np.empty((count, 2))
    for i in range(count * every):
        given = rider.inputs(i * dt, state, dt)
        given[_ROAD:] = _road(rider, state, bank)
        if i % every == 0:
            k = i // every
            states[k], inputs[k], outputs[k] = state, given, machine.output(state, given)
            along[k] = rider.path.locate(*road_point(height, state), rider.distance)
        state = machine.step(state, given, dt)
        if not abs(state[ROLL]) < _FALLEN:
            raise UsageError(
                found=f"the motorcycle fell: roll {state[ROLL]:.2f} rad after {i * dt:.1f} s",
                expected=f"a roll below {_FALLEN:g} rad",
                do="ask for less lateral acceleration",
            )
    linear = np.array([road_state(height, row) for row in states])
    time = np.asarray(np.arange(count) * (dt * every), dtype=np.float64)
    return Ride(time, states, inputs, outputs, linear, along[:, 0], along[:, 1], rider)


def _road(rider: Rider, state: Array, bank: Callable[[float], float]) -> tuple[float, float, float, float, float]:
    """The last five of `INPUTS` here."""
    if bank is level:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    place, d = rider.distance, _BANK_STEP
    before, here, after = bank(place - d), bank(place), bank(place + d)
    heading, bend = rider.path.at(place)[2:]
    error = state[YAW] - heading
    _, offset = rider.path.locate(*road_point(rider.machine.parameters.sharp.h, state), place)
    ahead = hypot(state[X_RATE], state[Y_RATE]) * cos(error) / (1 - bend * offset)  # along the course, m/s
    slope, curve = (after - before) / (2 * d), (after - 2 * here + before) / d**2
    return here, slope * ahead, bend * ahead, curve * ahead * ahead, error
