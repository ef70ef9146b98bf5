"""A rider who follows a path: looks ahead for the lean it needs, leans the machine with the handlebar, holds the speed.

    a = y_p''(t + T) + k_d e' + k_p e,   phi_ref = -atan(a / g)    e = y_p - y now, m; y of the road point
    tau = tau_ref - k(v) (x - x_ref)                               A x_ref + B tau_ref = 0 at that roll; k: Riccati, Sharp's model
    M = (m (v_ref' + (v_ref - v) / tau_v) + drag) R                    to the rear wheel when positive, front brake when negative

Followed is the machine's own state: this is a means to ride, not a model of a human, who has delays and does not know tyre forces.
The wanted roll is filtered over `smoothing`, s. One point ahead is looked at, at T s, about what the machine takes to lean.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import atan, cos, hypot, sin

import numpy as np
from scipy.linalg import solve_continuous_are

from codriver.models.motorcycle import motorcycle_model
from codriver.signals.signal import Array
from codriver.simulate.motorcycle.machine import Machine

Path = Callable[[float], float]  # lateral place, m, of the forward place x, m
SpeedPlan = Callable[[float], float]  # m/s of the time, s
LeanPlan = Callable[[float], float]  # rad of the time, s
# What a state's unit is worth to the rider: roll, steer, lateral velocity, yaw rate, roll rate, steer rate, both forces.
WORTH = np.array([4e4, 4e3, 0.0, 0.0, 1e3, 1e2, 0.0, 0.0])


@dataclass
class Rider:
    """A rider on a machine.

    Attributes:
        machine: that is ridden.
        path: lateral place, m, against the forward one, m. A path that turns back on itself is no function of x.
        speed: wanted, m/s, against time, s.
        lean: wanted roll, rad, against time, s; the path is not followed then.
        preview: T, s.
        stiffness, damping: k_p, 1/s^2, and k_d, 1/s.
        smoothing: of the wanted roll, s.
        speed_time: tau_v, s.
        steepest: greatest wanted roll, rad.
        strongest: greatest torque on the handlebar, N m.
    """

    machine: Machine
    path: Path
    speed: SpeedPlan
    lean: LeanPlan | None = None
    preview: float = 0.5
    smoothing: float = 0.1
    stiffness: float = 0.6
    damping: float = 1.2
    speed_time: float = 0.7
    steepest: float = 0.8
    strongest: float = 80.0
    _wanted: float = field(default=0.0, init=False)
    _gains: dict[int, tuple[Array, Array, float]] = field(default_factory=dict, init=False, repr=False)

    def begin(self) -> None:
        """Forget the last ride."""
        self._wanted = 0.0

    def inputs(self, time: float, state: Array, dt: float) -> Array:
        """Torques of this tick, `machine.INPUTS`, with a level road.

        Args:
            time: s.
            state: of the machine.
            dt: since the last tick, s.
        """
        p = self.machine.parameters.sharp
        moving = road_state(p.h, state)
        v = max(hypot(state[7], state[8]), 3.0)
        wanted = self._lean_for_path(state, v, moving[2]) if self.lean is None else self.lean(time)
        wanted = min(max(wanted, -self.steepest), self.steepest)
        self._wanted += dt / self.smoothing * (wanted - self._wanted)
        gain, balance, torque = self._law(v)
        torque = self._wanted * torque - float(gain @ (moving - self._wanted * balance))
        torque = min(max(torque, -self.strongest), self.strongest)
        wish = (self.speed(time + 0.05) - self.speed(time)) / 0.05 + (self.speed(time) - v) / self.speed_time
        push = p.mass * wish + self.machine.parameters.air_density * self.machine.parameters.drag_area / 2 * v * v
        return np.array([torque, max(push, 0) * p.Rr, max(-push, 0) * p.Rf, 0.0])

    def _lean_for_path(self, state: Array, v: float, aside: float) -> float:
        """Roll, rad, whose balanced turn brings the road point back to the path.

        Args:
            state: of the machine.
            v: speed, m/s.
            aside: lateral velocity of the road point, m/s.
        """
        p = self.machine.parameters.sharp
        yaw, roll = state[3], state[4]
        x, y = state[0] - p.h * sin(roll) * sin(yaw), state[1] + p.h * sin(roll) * cos(yaw)
        across = v * sin(yaw) + aside * cos(yaw)
        along = v * cos(yaw)
        place, slope, _ = along_path(self.path, x)
        bend = along_path(self.path, x + along * self.preview)[2]
        acceleration = bend * along**2 + self.damping * (slope * along - across) + self.stiffness * (place - y)
        return -atan(acceleration / p.g)

    def _law(self, speed: float) -> tuple[Array, Array, float]:
        """Gain, balanced state and torque per rad of roll, at the nearest whole m/s."""
        key = round(speed)
        if key not in self._gains:
            plant = motorcycle_model(self.machine.parameters.sharp)
            A, B = plant.A(float(key)), plant.B
            riccati = solve_continuous_are(A, B, np.diag(WORTH) + 1e-9 * np.eye(8), np.eye(1))
            free = np.linalg.solve(np.hstack([A[:, 1:], B]), -A[:, 0])
            self._gains[key] = ((B.T @ riccati).ravel(), np.concatenate([[1.0], free[:-1]]), float(free[-1]))
        return self._gains[key]


def along_path(path: Path, x: float, step: float = 0.5) -> tuple[float, float, float]:
    """Place, m, slope, and second derivative, 1/m, of a path, by differences.

    Args:
        path: the path.
        x: m.
        step: m.
    """
    before, here, after = path(x - step), path(x), path(x + step)
    return here, (after - before) / (2 * step), (after - 2 * here + before) / step**2


def road_state(height: float, state: Array) -> Array:
    """The linear model's state of a machine's: roll, steer, lateral velocity of the road point, rates, lateral forces.

    Args:
        height: of the rear frame's mass centre, m.
        state: `machine.STATES`.
    """
    yaw, roll = state[3], state[4]
    aside = -sin(yaw) * state[7] + cos(yaw) * state[8] + height * cos(roll) * state[11]
    return np.array([roll, state[6], aside, state[10], state[11], state[13], state[18], state[19]])
