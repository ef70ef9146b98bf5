"""A two-point driver steers a car round a circuit by torque: the closed loop of road, eyes, arms, steering wheel and car.

    J_s delta_s'' + b_s delta_s' + T_c sign(delta_s') = T_dr + T_aln,   T_aln = K_aln / g_s (beta + l_f r / v - delta_s / g_s)
    psi' = r - v rho,   y' = v (psi + beta);   beta, r: single-track car at constant speed
    T_dr: `models.two_point`, from theta_near, theta_far (`models.road_sight`) and delta_s

As Okamoto, Tsiotras 2019 (Robotics and Autonomous Systems), fig. 1 and section 5.2, with this project's car and circuit instead of
CarSim's. Anticipation is by the far point, or by a predictive plan (`predictive`) in its place. A driver may vary (`variability`).
The car holds its angle's line between ticks exactly; the wheel takes SUBSTEPS a tick. A motor may add its torque to the driver's
(`shared_control`); he may want to be beside the path for a while (`detour`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import pi
from typing import NamedTuple

import numpy as np

from codriver.errors import UsageError
from codriver.models.road_sight import PathAhead
from codriver.models.single_track import SingleTrack
from codriver.models.steering import tick_of
from codriver.models.two_point import TwoPointDriver
from codriver.signals import Log, Signal
from codriver.signals.signal import Array
from codriver.simulate.circuit_way import DIRECTIONS, way_curvature, way_length
from codriver.simulate.detour import Detour, wanted_offset
from codriver.simulate.predictive import Plan, plan_law
from codriver.simulate.rig import RigCar
from codriver.simulate.steering import Wheel
from codriver.simulate.variability import Variability, Variation

ANTICIPATIONS = ("far-point", "mpc")
SUBSTEPS = 2  # of the wheel, a tick
WIDTH = 4.0  # m; a car further off has left the road
_BEYOND = 100.0  # m of road seen past the end


class Seen(NamedTuple):
    """What is measured at a tick: angle and driver's torque by sensors, the rest as `CircuitDrive`."""

    angle: float
    torque: float
    sideslip: float
    yaw_rate: float
    curvature: float
    offset: float
    heading: float


Motor = Callable[
    [int, Seen], float
]  # tick and what is measured to the motor's torque on the column, N m, until the next


@dataclass(frozen=True)
class CircuitSetting:
    """A drive to be made.

    Attributes:
        driver, variability: who; None if he is always the same.
        anticipation: of ANTICIPATIONS; plan: of "mpc".
        wheel, car: what; the car's speed is held.
        laps: each way; direction: of DIRECTIONS.
        dt: tick, s.
        resolution: of the encoder, rad.
        torque_noise: sd of the torque sensor's noise, N m.
        detours: of the driver's own.

    Raises:
        UsageError: no such direction or anticipation, no lap, or a tick or a speed that is not positive.
    """

    driver: TwoPointDriver = field(default_factory=TwoPointDriver)
    variability: Variability | None = None
    anticipation: str = "far-point"
    plan: Plan = field(default_factory=Plan)
    wheel: Wheel = field(default_factory=lambda: Wheel(0.0298, 0.3515, 0.15))
    car: RigCar = field(default_factory=RigCar)
    laps: int = 4
    direction: str = "both"
    dt: float = 0.01
    resolution: float = 0.1 * pi / 180
    torque_noise: float = 0.02
    detours: tuple[Detour, ...] = ()

    def __post_init__(self) -> None:
        for name, value, known in (
            ("direction", self.direction, DIRECTIONS), ("anticipation", self.anticipation, ANTICIPATIONS),
        ):  # fmt: skip
            if value not in known:
                raise UsageError(f"{name} '{value}'", f"one of {', '.join(known)}", "choose one of these")
        if self.laps < 1 or not self.dt > 0 or not self.car.speed > 0:
            raise UsageError(
                f"{self.laps} laps with a tick of {self.dt:g} s at {self.car.speed:g} m/s",
                "at least 1 lap, a positive tick and a positive speed",
                "change the setting",
            )

    def single_track(self) -> SingleTrack:
        """The car in plan view."""
        c = self.car
        return SingleTrack(c.mass, c.inertia, c.front, c.rear, c.front_stiffness, c.rear_stiffness)


@dataclass(frozen=True, eq=False)
class CircuitDrive:
    """What happened; columns of shape (n,).

    Attributes:
        setting: what was asked for.
        seed: of variability and sensors.
        time: s.
        angle, rate, measured: of the wheel, true, and by the encoder, rad and rad/s.
        driver_torque, measured_torque, alignment_torque, motor_torque: N m.
        sideslip, yaw_rate, curvature, offset, heading: rad, rad/s, 1/m, m, rad.
        near, far: directions of the two points, rad, as they are, not as they are seen.
        variation: how the driver varied.
    """

    setting: CircuitSetting
    seed: int
    time: Array
    angle: Array
    rate: Array
    measured: Array
    driver_torque: Array
    measured_torque: Array
    alignment_torque: Array
    sideslip: Array
    yaw_rate: Array
    curvature: Array
    offset: Array
    heading: Array
    near: Array
    far: Array
    variation: Variation
    motor_torque: Array

    def log(self) -> Log:
        """What the simulator logs: angle and torque by sensors, the rest from its vehicle model and scene."""
        made = (
            ("steering_wheel_angle", self.measured, "rad", "encoder"),
            ("driver_torque", self.measured_torque, "N*m", "torque sensor"),
            ("alignment_torque", self.alignment_torque, "N*m", "vehicle model"),
            ("longitudinal_speed", np.full(self.time.size, self.setting.car.speed), "m/s", "vehicle model"),
            ("sideslip_angle", self.sideslip, "rad", "vehicle model"),
            ("yaw_rate", self.yaw_rate, "rad/s", "vehicle model"),
            ("road_curvature", self.curvature, "1/m", "scene"),
            ("lateral_offset", self.offset, "m", "scene"),
            ("heading_error", self.heading, "rad", "scene"),
            *([("steering_motor_torque", self.motor_torque, "N*m", "motor")] if self.motor_torque.any() else []),
        )
        return Log.of(
            [Signal(n, self.time, v, unit, source) for n, v, unit, source in made], source="simulated circuit"
        )

    def truth(self) -> Log:
        """What was true: the driver's torque, angle and rate of the wheel, and where the two points were."""
        made = (
            ("driver_torque", self.driver_torque, "N*m"), ("steering_wheel_angle", self.angle, "rad"),
            ("steering_wheel_rate", self.rate, "rad/s"), ("near_angle", self.near, "rad"), ("far_angle", self.far, "rad"),
        )  # fmt: skip
        return Log.of(
            [Signal(n, self.time, v, unit, "simulation") for n, v, unit in made], source="truth of the circuit"
        )


def simulate_circuit(
    setting: CircuitSetting | None = None, *, seed: int = 0, motor: Motor | None = None
) -> CircuitDrive:
    """Drive.

    Args:
        setting: driver, car, laps.
        seed: of the driver's variability and the sensors' noise.
        motor: on the column.

    Raises:
        UsageError: the car leaves the road.
    """
    s = setting or CircuitSetting()
    path, n = circuit_path(s)
    varied = Variation.none(n)
    if s.variability is not None:
        varied = Variation.draw(s.variability, n, s.dt, np.random.default_rng([seed, 61]))
    noise = s.torque_noise * np.random.default_rng([seed, 67]).standard_normal(n)
    return drive_along(s, path, n, varied, noise, motor, seed)


def circuit_path(setting: CircuitSetting) -> tuple[PathAhead, int]:
    """The way of a drive, sampled where the car is at each tick and on beyond the end, and the number of ticks."""
    v, dt = setting.car.speed, setting.dt
    n = int(way_length(setting.laps, setting.direction) / (v * dt)) + 1
    place = v * dt * np.arange(n + round(_BEYOND / (v * dt)), dtype=np.float64)
    return PathAhead.of(place, way_curvature(place, setting.laps, setting.direction)), n


def drive_along(
    setting: CircuitSetting, path: PathAhead, n: int, varied: Variation, noise: Array, motor: Motor | None = None, seed: int = 0
) -> CircuitDrive:  # fmt: skip
    """Drive along any path.

    Args:
        setting: driver and car; its laps do not count.
        path: sampled where the car is at each tick, and on beyond the end.
        n: ticks.
        varied: how the driver varies.
        noise: of the torque sensor, N m, shape (n,).
        motor: on the column.
        seed: to be noted.

    Raises:
        UsageError: the car leaves the road.
    """
    kept = _drive(setting, path, n, varied, noise, motor)
    angle, rate, torque, aligned, beta, r, y, psi, near, far, added = kept
    return CircuitDrive(
        setting, seed, setting.dt * np.arange(n, dtype=np.float64), angle, rate, _encoded(angle, setting.resolution), torque,
        torque + noise, aligned, beta, r, path.curvature[:n], y, psi, near, far, varied, added,
    )  # fmt: skip


def _encoded(angle: Array, resolution: float) -> Array:
    """The angle as the encoder shows it."""
    return np.round(angle / resolution) * resolution if resolution > 0 else angle


def _drive(s: CircuitSetting, path: PathAhead, n: int, varied: Variation, noise: Array, motor: Motor | None) -> Array:
    """Angle, rate, torque, alignment, sideslip, yaw rate, offset, heading, near and far angle, motor's torque; shape (11, n)."""
    v, car, driver, sizes = s.car.speed, s.car, s.driver, s.variability
    h = s.dt / SUBSTEPS
    wheel, friction = tick_of(s.wheel.inertia, s.wheel.damping, h), s.wheel.friction
    plane = s.single_track().model(v)
    F, (G0, G1) = plane.transition(h).tolist(), (G[:, 0].tolist() for G in plane.input_maps(h))
    (f11, f12), (f21, f22) = F
    back, lever, ratio = car.alignment / car.ratio, car.front / v, car.ratio
    ahead = driver.far * v
    place = path.distance[:n]
    near_bend, far_bend = path.bend(place, driver.near).tolist(), path.bend(place, ahead).tolist()
    planned, gains = _planned(s, path, n)
    rho = path.curvature.tolist()
    columns = [x.tolist() for x in (varied.anticipation, varied.compensation, varied.near, varied.far, varied.motor)]
    aside, sensed = wanted_offset(s.detours, s.dt * np.arange(n, dtype=np.float64)).tolist(), noise.tolist()
    tick = driver.tick(s.dt, v)
    state = tick.start()
    share, floor = (sizes.motor, sizes.floor) if sizes is not None else (0.0, 0.0)
    kept = np.zeros((n, 11))
    delta = omega = beta = r = psi = y = trembled = added = 0.0
    for k, (more_far, more_near, near_noise, far_noise, muscle) in enumerate(zip(*columns, strict=True)):
        off = y - aside[k]
        near, far = near_bend[k] - off / driver.near - psi, far_bend[k] - off / ahead - psi
        if gains is None:
            wanted = driver.anticipation * (far + far_noise)
        else:
            # The plan reckons with the car as it is, on a course that is seen as well or badly as the far point.
            state_part = gains[0] * beta + gains[1] * r + gains[2] * (psi - far_noise) + gains[3] * off
            wanted = ratio * (planned[k] + state_part)
        # Of what the muscles are told, without the noise that they had a tick ago: else noise would be gain.
        trembled = muscle * (share * abs(state.pull - trembled) + floor)
        state, torque = tick.advance(state, near + near_noise, more_far * wanted, delta, more_near, trembled)
        aligned = back * (beta + lever * r - delta / ratio)
        if motor is not None:
            shown = round(delta / s.resolution) * s.resolution if s.resolution > 0 else delta
            added = motor(k, Seen(shown, torque + sensed[k], beta, r, rho[k], y, psi))
        kept[k] = delta, omega, torque, aligned, beta, r, y, psi, near, far, added
        for i in range(SUBSTEPS):
            steered, slid, turned, headed = delta / ratio, beta, r, psi
            delta, omega = wheel.advance(delta, omega, torque + added + back * (beta + lever * r - steered), friction)
            after = delta / ratio
            beta, r = (
                f11 * slid + f12 * turned + G0[0] * steered + G1[0] * after,
                f21 * slid + f22 * turned + G0[1] * steered + G1[1] * after,
            )
            bent = rho[k] + (rho[k + 1] - rho[k]) * (i + 0.5) / SUBSTEPS
            psi += h * ((turned + r) / 2 - v * bent)
            y += h * v * ((headed + psi) + (slid + beta)) / 2
        if not abs(y) < WIDTH:
            raise UsageError(
                f"the car is {abs(y):.1f} m off the path after {k * s.dt:.1f} s at {3.6 * v:.0f} km/h",
                f"a driver who keeps it within {WIDTH:g} m",
                "drive slower, or change the driver's gains, delay or variability",
            )
    return kept.T


def _planned(s: CircuitSetting, path: PathAhead, n: int) -> tuple[list[float], list[float] | None]:
    """Of a plan: what the curvatures ahead add to the road wheels' angle, and the gains of beta, r, psi, y."""
    if s.anticipation != "mpc":
        return [], None
    law = plan_law(s.single_track(), s.car.speed, s.plan)
    steps = s.car.speed * law.step * np.arange(law.ahead.size)
    seen = np.interp(path.distance[:n, None] + steps, path.distance, path.curvature)
    return (seen @ law.ahead).tolist(), law.state.tolist()
