"""A ride: machine and rider through time, and what was true.

Truth in the observers' terms (`models.motorcycle`): roll, steer, their rates, yaw rate about the road's normal, lateral velocity of
the road point, tyre forces, rider torque, speed; and the IMU's ideal signals in body axes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from codriver.errors import UsageError
from codriver.signals.signal import Array
from codriver.simulate.motorcycle.machine import INPUTS, OUTPUTS, STATES
from codriver.simulate.motorcycle.rider import Rider, road_state


@dataclass(frozen=True, eq=False)
class Ride:
    """A ride.

    Attributes:
        time: s, shape (n,).
        states: shape (n, 20), `machine.STATES`.
        inputs: held from this tick to the next, shape (n, 4), `machine.INPUTS`.
        outputs: shape (n, 10), `machine.OUTPUTS`.
        linear: shape (n, 8), in the linear model's terms, `models.motorcycle.STATES`.
        rider: who rode.
    """

    time: Array
    states: Array
    inputs: Array
    outputs: Array
    linear: Array
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


def level(_time: float) -> float:
    """A road without bank.

    Args:
        _time: s.
    """
    return 0.0


def ride(rider: Rider, duration: float, dt: float = 1e-3, bank: Callable[[float], float] = level) -> Ride:
    """Let a rider ride from x = 0, upright, along the path's start.

    Args:
        rider: with machine, path and speed.
        duration: s.
        dt: of a tick, s.
        bank: of the road against time, rad, to the right; roll is from the road's normal. The rider does not know it.

    Raises:
        UsageError: the machine fell.
    """
    count = round(duration / dt)
    rider.begin()
    height = rider.machine.parameters.sharp.h
    state = rider.machine.upright(rider.speed(0.0))
    state[1] = rider.path(0.0)
    states, inputs, outputs = (
        np.empty((count, len(STATES))),
        np.empty((count, len(INPUTS))),
        np.empty((count, len(OUTPUTS))),
    )
    for i in range(count):
        states[i] = state
        inputs[i] = rider.inputs(i * dt, state, dt)
        inputs[i, 3] = bank(i * dt)
        outputs[i] = rider.machine.output(state, inputs[i])
        state = rider.machine.step(state, inputs[i], dt)
        if not abs(state[4]) < 1.2:
            raise UsageError(
                found=f"the motorcycle fell: roll {state[4]:.2f} rad after {i * dt:.1f} s",
                expected="a roll below 1.2 rad",
                do="ask for less lateral acceleration",
            )
    linear = np.array([road_state(height, row) for row in states])
    time = np.asarray(np.arange(count) * dt, dtype=np.float64)
    return Ride(time, states, inputs, outputs, linear, rider)
