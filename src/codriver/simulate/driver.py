"""The driver: sees the road, plans bursts of acceleration, and works the pedals towards the plan, imperfectly.

Plan.  Every tenth of a second the driver compares the speeds wanted ahead with his own: slowing from v to v_k in the
distance d_k needs a = (v_k^2 - v^2) / (2 d_k). Strong need: brake; mild need: lift; room above: accelerate; else hold
the speed. A wish that differs from what is already planned by more than his patience, for longer than his reaction
time, becomes a burst (`plan.py`). The end of a manoeuvre is foreseen: he begins to let go when the speed gained
during the letting go will just bring him to the speed wanted.

Pedals.  He knows his car roughly. The force for the plan is, with his own idea (^) of the car,

    F = M^ a_plan + kappa_1^ + kappa_2^ v^2 + share M^ g sin(alpha) + M^ k (v_plan - v_seen)

F above what the released car does goes to the accelerator by his sense tau^ of the gear, which follows a shift only
slowly (he feels it by the car's answer); F below it goes to the brake; between the two both pedals are released. The
foot ignores changes within its play, wanders a little, and needs time from pedal to pedal (`feet.py`).
"""

from __future__ import annotations

import math
import random

import numpy as np

from codriver.signals.signal import Array
from codriver.simulate.car import GRAVITY
from codriver.simulate.car_parameters import CarParameters
from codriver.simulate.feet import Feet
from codriver.simulate.plan import Plan, duration_of
from codriver.simulate.road import Road
from codriver.simulate.styles import Style

HORIZON = 320  # looked ahead, m
HOLD = 14e5  # brake pressure at standstill, Pa
FEEDBACK = 0.45  # k, 1/s
SEEING = 0.2  # time constant with which speed is perceived, s
FEELING = 0.6  # time constant with which a new gear is felt, s


class Driver:
    """A driver on a road, at standstill or rolling; `decide` at a steady tick, `feet.move` at the simulation's step.

    Attributes:
        feet: the pedals.
        plan: the intention.
    """

    def __init__(
        self, style: Style, road: Road, car: CarParameters, seed: int, distance: float = 0.0, speed: float = 0.0
    ) -> None:
        self.style, self._road, self._random = style, road, random.Random(seed)
        self.plan = Plan()
        self._standing = speed == 0.0
        self.feet = Feet(style.foot, style.travel, HOLD if self._standing else 0.0)
        self._speeds = _own_speeds(style, road)
        self._ahead = np.arange(1.0, HORIZON + 1.0)
        self._scenes = [p for p in road.scenes if p.at >= distance]
        self._free: Array | None = None  # the speeds behind the scene in sight
        self._free_at = 0.0
        guess = self._random.gauss
        self._mass = car.mass * (1 + 0.04 * guess(0, 1))
        self._brake, self._pedal = car.brake * (1 + 0.06 * guess(0, 1)), car.pedal * (1 + 0.06 * guess(0, 1))
        self._rolling, self._drag = car.rolling * (1 + 0.1 * guess(0, 1)), car.drag * (1 + 0.1 * guess(0, 1))
        self._taus, self._friction = car.transmission, car.friction + car.friction_slope * 160.0
        self._tau = self._taus[0]
        self._seen, self._planned_speed, self._wander = speed, speed, 0.0
        self._stops = [p for p in road.stops if p.at >= distance - 1.0]
        self._leave = (
            self._stops.pop(0).wait if self._standing and self._stops and self._stops[0].at <= distance + 1.0 else 1.0
        )
        self._wish_sign, self._wish_since, self._ticks = 0, 0.0, 0
        self._braking = self._standing

    def decide(self, dt: float, time: float, distance: float, speed: float, gear: int, shifting: bool) -> None:
        """See, plan, and set what the feet want.

        Args:
            dt: since the last call, s (0.02 to 0.05).
            time: s.
            distance, speed: of the car, m and m/s.
            gear: engaged gear.
            shifting: whether the gearbox is at work (the driver waits for the end before he judges the new gear).
        """
        self._seen += dt / SEEING * (speed - self._seen)
        if not shifting:
            self._tau += dt / FEELING * (self._taus[gear - 1] - self._tau)
        if self._standing:
            self._wait(time)
        elif self._ticks % 5 == 0:
            self._think(time, distance, self._seen)
        self._ticks += 1
        self._work_pedals(dt, time, distance, speed)

    # ---- plan

    def _wait(self, time: float) -> None:
        """Stand until it is time to leave, then leave with a burst."""
        if time >= self._leave:
            self._standing = False
            self._wish_since = time

    def _think(self, time: float, distance: float, v: float) -> None:
        style, plan = self.style, self.plan
        self._look(time, distance)
        stop = self._stops[0].at - distance if self._stops else math.inf
        if v < 0.12 and plan.goal <= 0.0 and stop < 25.0:
            self._standing, self._leave = True, time + self._stops.pop(0).wait
            if plan.goal:
                plan.burst(time, 0.0, 0.6)
            return
        wish, ending = self._wanted(distance, v, stop)
        worth = abs(wish - plan.goal) > style.patience or (ending and wish != plan.goal)
        sign = 0 if not worth else 1 if wish > plan.goal else -1
        if sign != self._wish_sign:
            self._wish_sign, self._wish_since = sign, time
        urgent = wish < plan.goal - 1.2
        progress = plan.progress(time)
        if not worth or progress < (0.0 if ending else 0.5 if urgent else 1.0):
            return
        if ending or time - self._wish_since >= style.reaction:
            scatter = 1.0 if ending else max(0.7, 1 + style.scatter * self._random.gauss(0, 1))
            goal = max(-3.6, min(2.6, wish * scatter))
            duration = duration_of(goal - plan.goal, style.jerk)
            plan.burst(time, goal, duration * max(0.7, 1 + style.scatter * self._random.gauss(0, 1)))

    def _look(self, time: float, distance: float) -> None:
        """Lower the speeds wanted where a scene is in sight, and restore them when it is over."""
        if self._free is not None and time >= self._free_at:
            self._speeds, self._free = self._free, None
        if self._free is None and self._scenes and distance >= self._scenes[0].at - self._scenes[0].seen:
            scene = self._scenes.pop(0)
            self._free, self._free_at = self._speeds, time + scene.lasts
            self._speeds = self._free.copy()
            around = slice(max(0, int(scene.at) - 10), int(scene.at) + 10)
            self._speeds[around] = np.minimum(self._speeds[around], scene.speed)

    def _wanted(self, distance: float, v: float, stop: float) -> tuple[float, bool]:
        """The acceleration wanted (m/s^2), and whether it is the foreseen end of a manoeuvre."""
        style, now = self.style, self.plan.goal
        here = min(int(distance), self._speeds.size - HORIZON - 1)
        ahead = self._speeds[here : here + HORIZON]
        # Part of the way is driven before the braking has built up.
        lost = v * (style.reaction + 0.6 if now > -0.25 else 0.35)
        room = np.maximum(self._ahead - lost, 6.0)
        own = float(ahead[0])
        needs = np.where(ahead < min(v, own) - 0.5, (ahead * ahead - v * v) / (2.0 * room), 0.0)
        worst = int(needs.argmin())
        need, goal = float(needs[worst]), float(ahead[worst])
        if v - own > 0.8 and (own - v) / 3.0 < need:  # too fast already: mended within some seconds
            need, goal = (own - v) / 3.0, own
        if stop < HORIZON:
            for_stop = -v * v / (2.0 * max(stop - 1.0 - lost, 1.0))
            # A stop still far off is no reason to crawl.
            if for_stop < need and (for_stop < -0.5 * style.braking or stop < 40.0):
                need, goal = for_stop, 0.0
        letting_go = 0.5 * duration_of(now, style.jerk)
        if now < -0.25:
            last_metres = stop < 12.0 and v < 4.0
            if goal == 0.0 and (need < 0.4 * now or last_metres):
                # The last of a stop: nearly all of the deceleration is let go, so that the car comes to rest without
                # a jolt.
                return (-0.35, True) if v <= -1.1 * now * letting_go and v < 6.0 else (min(need, -0.6), False)
            if need > 0.5 * now or v - goal <= -now * letting_go:
                return 0.0, True
            return need * 1.03, False
        free = self._drag * v * v / self._mass + (self._rolling + self._tau * self._friction) / self._mass
        if need < -style.braking:
            return need * 1.05, False
        if need < -style.lift:
            return -min(free, -need), False
        wanted = float(ahead[: max(2, int(2.5 * v))].min())
        wanted = min(wanted, math.sqrt(1.6 * style.braking * max(stop - 1.0, 0.5)))
        if now > 0.2 and v + now * letting_go >= wanted:
            return 0.0, True
        if need > -0.3 * style.lift and v < wanted - (0.4 if now > 0.2 else 1.3):
            eager = float(self._road.eager[here])
            return style.acceleration * eager * max(0.25, 1.0 - v / 45.0), False
        error = wanted - v
        return (max(-0.4, min(0.4, 0.25 * error)), False) if abs(error) > 1.0 else (0.0, False)

    # ---- pedals

    def _work_pedals(self, dt: float, time: float, distance: float, speed: float) -> None:
        feet, style = self.feet, self.style
        if self._standing:
            feet.want_side, feet.want_brake, feet.want_accelerator = True, HOLD, 0.0
            self._planned_speed, self._braking = 0.0, True
            return
        planned, _ = self.plan.at(time)
        self._planned_speed += dt * (planned + (speed - self._planned_speed) / 2.5)
        table = self._road.slope
        slope = float(table[min(int(distance), table.size - 1)])
        v, mass = self._seen, self._mass
        force = (
            mass * planned
            + self._rolling
            + self._drag * v * v
            + style.slope_share * mass * GRAVITY * math.sin(slope)
            + mass * FEEDBACK * (self._planned_speed - v)
        )
        drag = self._friction * min(1.0, v / 4.0)  # the engine's drag torque as he feels it
        off = -self._tau * drag  # what the released car does
        if force < off - 160.0:
            self._braking = True
        elif force > off + 60.0:
            self._braking = False
        feet.want_side = self._braking
        noise = self._random.gauss(0, 1)
        self._wander += dt / 0.7 * -self._wander + math.sqrt(2 * dt / 0.7) * style.tremor * noise
        if self._braking:
            wanted = max(0.0, off - force) / self._brake
            wanted *= 1.0 + 2.0 * self._wander
            feet.want_brake = _play(feet.want_brake, wanted, style.play * 25e5)
            feet.want_accelerator = 0.0
        else:
            torque = force / self._tau
            # Below the drag's blending the pedal takes the drag away first.
            pedal = (torque + drag) / (self._pedal + drag / 0.06)
            pedal = torque / self._pedal if pedal > 0.06 else pedal
            pedal = max(0.0, pedal) * (1.0 + 3.0 * self._wander) + (self._wander if pedal > 0.02 else 0.0)
            feet.want_accelerator = _play(feet.want_accelerator, min(1.0, max(0.0, pedal)), style.play)
            feet.want_brake = 0.0


def _play(held: float, wanted: float, play: float) -> float:
    """What is held follows what is wanted only when they differ by more than the play; a released pedal is released."""
    if wanted <= 0.0:
        return 0.0
    return min(max(held, wanted - play), wanted + play)


def _own_speeds(style: Style, road: Road) -> Array:
    """The speed this driver wants at each metre (m/s): his share of the signed speed, and what bends allow."""
    bend = np.sqrt(style.lateral / np.maximum(np.abs(road.curvature), 1e-6))
    speeds = np.minimum(style.speed * road.limit, bend)
    return np.concatenate([speeds, np.full(HORIZON + 1, speeds[-1])])
