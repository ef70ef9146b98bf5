"""A rider who follows a course: looks ahead for the lean it needs, leans machine and body, holds the speed, puts his feet down.

    a = kappa(s + v T) v^2 - k_d e' - k_p e,   phi_ref = -atan(a / g) / (1 + share m_b l / (m h))     e offset of the road point
    tau: `rider_law`
    lambda_ref = share phi_ref,   hips (k_b - m_b g l) lambda_ref     lean of the body beside the machine
    M = (m (v_ref' + (v_ref - v) / tau_v) + drag) R                   to the rear wheel; when negative, by `FRONT_BRAKE` to both
    w' = -w / T_w + noise                                             remnant, added to the torque; he does not know it
    L = -(k_L phi + c_L phi') at a standstill, gone at `FEET_UP`      feet on the road

The wanted roll is filtered over `smoothing`, s; throttle and brakes follow over `WRIST_TIME`. One point ahead is looked at, at T s,
about what the machine takes to lean.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import atan, cos, hypot, sin, sqrt

import numpy as np

from codriver.signals.signal import Array
from codriver.simulate.motorcycle.course import Course
from codriver.simulate.motorcycle.machine import INPUTS, STATES, Machine
from codriver.simulate.motorcycle.paths import SpeedPlan
from codriver.simulate.motorcycle.rider_law import Hands

LeanPlan = Callable[[float], float]  # rad of the time, s
FEET_DOWN, FEET_UP = 2.5, 4.0  # m/s
FEET = 5000.0, 800.0  # k_L, N m/rad, and c_L, N m s/rad
FRONT_BRAKE = 0.6  # share of the front brake
LET_GO = 0.5  # m/s, below which the brakes are let go, so that they never push back
REMNANT_TIME = 0.2  # s
WRIST_TIME = 0.15  # s, over which throttle and brakes follow
RIDABLE = 3.0  # m/s, the slowest at which the handlebar is used as at speed
(X, Y, YAW, ROLL, STEER, X_RATE, Y_RATE, YAW_RATE, ROLL_RATE, STEER_RATE, FRONT, REAR) = (
    STATES.index(name)
    for name in (
        "x", "y", "yaw", "roll", "steer", "x_rate", "y_rate", "yaw_rate", "roll_rate", "steer_rate", "front_lateral_force",
        "rear_lateral_force",
    )
)  # fmt: skip


@dataclass
class Rider:
    """A rider on a machine.

    Attributes:
        machine: that is ridden.
        path: the course.
        speed: wanted, m/s, against time, s, and distance along the course, m.
        lean: wanted roll, rad, against time, s; the course is not followed then.
        preview: T, s.
        stiffness, damping: k_p, 1/s^2, and k_d, 1/s.
        smoothing: of the wanted roll, s.
        speed_time: tau_v, s.
        steepest: greatest wanted roll, rad.
        strongest: greatest torque on the handlebar, N m.
        body: share of the roll by which the body leans further; needs an upper body.
        delay: by which the rider acts late on what he feels, s.
        feels_forces: whether he feels the tyres' forces.
        remnant: sd of what his hands do beside, N m, for some `REMNANT_TIME`.
        seed: of that.
    """

    machine: Machine
    path: Course
    speed: SpeedPlan
    lean: LeanPlan | None = None
    preview: float = 0.5
    smoothing: float = 0.1
    stiffness: float = 0.6
    damping: float = 1.2
    speed_time: float = 0.7
    steepest: float = 0.8
    strongest: float = 80.0
    body: float = 0.0
    delay: float = 0.0
    feels_forces: bool = True
    remnant: float = 0.0
    seed: int = 0
    _noise: np.random.Generator = field(init=False, repr=False)
    _beside: float = field(default=0.0, init=False)
    _push: float = field(default=0.0, init=False)
    _wanted: float = field(default=0.0, init=False)
    _hands: Hands | None = field(default=None, init=False, repr=False)
    _distance: float = field(default=0.0, init=False)

    def begin(self) -> None:
        """Forget the last ride."""
        self._wanted, self._distance, self._beside, self._push, self._hands = 0.0, 0.0, 0.0, 0.0, None
        self._noise = np.random.default_rng(self.seed)

    @property
    def distance(self) -> float:
        """Along the course, m, at the last tick."""
        return self._distance

    def inputs(self, time: float, state: Array, dt: float) -> Array:
        """What the rider does in this tick, `machine.INPUTS`, on a level road.

        Args:
            time: s.
            state: of the machine.
            dt: since the last tick, s.
        """
        parameters = self.machine.parameters
        p = parameters.sharp
        if self._hands is None:
            self._hands = Hands(self.machine, self.feels_forces, self.delay, dt)
        moving = road_state(p.h, state)
        here: list[float] = state.tolist()  # Python's own numbers, which are faster one by one
        v = hypot(here[X_RATE], here[Y_RATE])
        self._distance = self.path.locate(*road_point(p.h, here), self._distance)[0]
        wanted = self._lean_for_path(here, v, float(moving[2])) if self.lean is None else self.lean(time)
        wanted = min(max(wanted, -self.steepest), self.steepest)
        feet = min(max((FEET_UP - v) / (FEET_UP - FEET_DOWN), 0.0), 1.0)
        self._wanted += dt / self.smoothing * ((1 - feet) * wanted - self._wanted)
        given = dict.fromkeys(INPUTS, 0.0)
        torque = self._hands.torque(max(v, RIDABLE), moving, self._wanted, self.strongest)
        if self.remnant:
            fade = dt / REMNANT_TIME
            self._beside += sqrt(2 * fade) * self.remnant * self._noise.standard_normal() - fade * self._beside
        given["rider_torque"] = torque + self._beside
        given["roll_moment"] = -feet * (FEET[0] * here[ROLL] + FEET[1] * here[ROLL_RATE])
        body = parameters.upper_body
        if body is not None:
            given["lean_torque"] = (body.stiffness - body.mass * p.g * body.above) * self.body * self._wanted
        now, ahead = self.speed(time, self._distance), here[X_RATE] * cos(here[YAW]) + here[Y_RATE] * sin(here[YAW])
        wish = (self.speed(time + 0.05, self._distance + 0.05 * v) - now) / 0.05 + (now - ahead) / self.speed_time
        wanted_push = p.mass * wish + parameters.air_density * parameters.drag_area / 2 * v * v
        self._push += dt / WRIST_TIME * (wanted_push - self._push)
        push = self._push if self._push > 0 else self._push * min(max(ahead / LET_GO, 0.0), 1.0)
        given["drive_torque"], given["front_brake_torque"] = (
            (max(push, 0) - (1 - FRONT_BRAKE) * max(-push, 0)) * p.Rr,
            FRONT_BRAKE * max(-push, 0) * p.Rf,
        )
        return np.array([given[name] for name in INPUTS])

    def _lean_for_path(self, state: Sequence[float], v: float, aside: float) -> float:
        """Roll, rad, whose balanced turn brings the road point back to the path.

        Args:
            state: of the machine.
            v: speed, m/s.
            aside: lateral velocity of the road point, m/s.
        """
        parameters = self.machine.parameters
        p, body = parameters.sharp, parameters.upper_body
        x, y = road_point(p.h, state)
        px, py, heading, _ = self.path.at(self._distance)
        offset = cos(heading) * (y - py) - sin(heading) * (x - px)
        turned = state[YAW] - heading
        leaving = v * sin(turned) + aside * cos(turned)
        bend = self.path.curvature_at(self._distance + v * self.preview)
        acceleration = bend * v * v - self.damping * leaving - self.stiffness * offset
        more = 0.0 if body is None else self.body * body.mass * body.above / (p.mass * p.h)
        return -atan(acceleration / p.g) / (1 + more)


def road_point(height: float, state: Sequence[float] | Array) -> tuple[float, float]:
    """The point on the road below the rear frame's mass centre were it upright, m.

    Args:
        height: of the rear frame's mass centre, m.
        state: `machine.STATES`.
    """
    yaw, side = state[YAW], height * sin(state[ROLL])
    return state[X] - side * sin(yaw), state[Y] + side * cos(yaw)


def road_state(height: float, state: Array) -> Array:
    """The linear model's state of a machine's: roll, steer, lateral velocity of the road point, rates, lateral forces.

    Args:
        height: of the rear frame's mass centre, m.
        state: `machine.STATES`.
    """
    yaw, roll = state[YAW], state[ROLL]
    aside = -sin(yaw) * state[X_RATE] + cos(yaw) * state[Y_RATE] + height * cos(roll) * state[ROLL_RATE]
    return np.array(
        [roll, state[STEER], aside, state[YAW_RATE], state[ROLL_RATE], state[STEER_RATE], state[FRONT], state[REAR]]
    )
