"""The three rides of the 2018 paper, each as a setting from which a ride with its truth is made.

track                 a closed lap with bends to both sides, 30 to 100 km/h
slalom                while speeding up from 50 to 100 km/h
double-lane-change    at 100 km/h

Of the paper's own courses no figures are printed: these are made up. Ridden by a late rider who leans his body and does not feel
the tyres' forces, on Sharp's machine with suspension. Noise is in parts of each sensor's rms, as `sensors.relative_noise` has it. A
bank, if wished, swings to both sides along the way: beta(s) = bank sin(2 pi s / BANK_WAVE), risen over the first half wave.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import pi, sin

import numpy as np

from codriver.errors import UsageError
from codriver.models.motorcycle import MotorcycleParameters
from codriver.signals import Log, Signal
from codriver.signals.signal import Array
from codriver.simulate.motorcycle.course import Course
from codriver.simulate.motorcycle.machine import Machine
from codriver.simulate.motorcycle.parameters import MachineParameters, Suspension, UpperBody
from codriver.simulate.motorcycle.paths import (
    SpeedPlan,
    closed,
    double_lane_change,
    for_bends,
    ramp,
    rise,
    slalom,
)
from codriver.simulate.motorcycle.ride import Ride, level, ride
from codriver.simulate.motorcycle.rider import Rider
from codriver.simulate.motorcycle.sensors import IDEAL, RideSensors, relative_noise, sense
from codriver.simulate.motorcycle.variations import NOMINAL_RIDER, with_rider, with_tyres
from codriver.vehicles import load_vehicle
from codriver.vehicles.known import KNOWN

_KMH = 1 / 3.6
TICK = 1e-3  # s, of the machine
BANK_WAVE = 300.0  # m
GYRO_BIAS, ACCELEROMETER_BIAS = 0.5 * pi / 180, 0.2  # rad/s, m/s^2: what is usual
_RISE = BANK_WAVE / 2
_IMU = tuple((KNOWN[name].low, KNOWN[name].high) for name in ("imu_forward", "imu_left", "imu_height"))  # m


@dataclass(frozen=True, eq=False)
class Scenario:
    """Where and how fast.

    Attributes:
        course: to follow.
        speed: wanted.
        seconds: how long.
    """

    course: Course
    speed: SpeedPlan
    seconds: float


def _track() -> Scenario:
    course = closed()
    return Scenario(course, for_bends(course, 30 * _KMH, 100 * _KMH, 7.5, start=60 * _KMH), 80.0)


def _slalom() -> Scenario:
    return Scenario(slalom(2.0, 100.0), ramp(50 * _KMH, 100 * _KMH, 2.0, 14.0), 16.0)


def _double_lane_change() -> Scenario:
    return Scenario(double_lane_change(3.5, 70.0, 40.0), ramp(100 * _KMH, 100 * _KMH, 0.0, 1.0), 8.0)


SCENARIOS: dict[str, Callable[[], Scenario]] = {
    "track": _track, "slalom": _slalom, "double-lane-change": _double_lane_change,
}  # fmt: skip


@dataclass(frozen=True)
class RideSetting:
    """A ride to be made.

    Attributes:
        scenario: of `SCENARIOS`.
        noise: of gyroscope and accelerometer, in parts of the rms; 0 for none, the paper has 0.05 to 0.1.
        bias: of gyroscope and accelerometer, in `GYRO_BIAS` and `ACCELEROMETER_BIAS` an axis, to sides that the seed draws.
        speed_error: of the wheel's speed, beside what lean and slip make of it; 0.02 for 2 % too fast.
        counts: of the steering encoder in a turn; 0 for an ideal one.
        zero: what the encoder shows when the handlebar is straight, rad; the log's reader is not told.
        imu: its place from the road point below the rear frame's mass centre when upright, m: forward, left, up.
        bank: greatest of the road, rad.
        rider_mass: kg.
        tyre_stiffness: in parts of Sharp's.
        remnant: sd of what the rider's hands do of their own, N m.
        rate: of the log, Hz, of which a thousand is a multiple.
        seconds: end after so many; None for the whole ride.

    Raises:
        UsageError: something that cannot be.
    """

    scenario: str = "track"
    noise: float = 0.0
    bias: float = 0.0
    speed_error: float = 0.0
    counts: int = 4096
    zero: float = 0.0
    imu: tuple[float, float, float] = MachineParameters.imu
    bank: float = 0.0
    rider_mass: float = NOMINAL_RIDER
    tyre_stiffness: float = 1.0
    remnant: float = 0.3
    rate: int = 100
    seconds: float | None = None

    def __post_init__(self) -> None:
        if self.scenario not in SCENARIOS:
            raise UsageError(f"scenario '{self.scenario}'", f"one of {', '.join(SCENARIOS)}", "choose one of these")
        if self.rate < 10 or round(1 / TICK) % self.rate:
            raise UsageError(f"a rate of {self.rate} Hz", "10, 20, 50, 100, 200, 500, 1000, ...", "choose one of these")
        for wrong, found, expected in (
            (not 0 <= self.noise <= 1, f"noise of {100 * self.noise:g} %", "0 to 100 %"),
            (
                not abs(self.bank) <= 0.2,
                f"a road that banks by {self.bank * 180 / pi:.3g} degrees",
                "11 degrees at most either way",
            ),
            (
                not abs(self.speed_error) <= 0.2,
                f"a speed error of {100 * self.speed_error:g} %",
                "20 % at most either way",
            ),
            (not abs(self.bias) <= 20, f"biases {self.bias:g} times the usual", "20 times at most either way"),
            (self.counts < 0, f"an encoder of {self.counts} counts", "0 or more"),
            (
                not abs(self.zero) <= 0.2,
                f"an encoder {self.zero * 180 / pi:.3g} degrees off its zero",
                "11 degrees at most either way",
            ),
            (
                not all(low <= at <= high for at, (low, high) in zip(self.imu, _IMU, strict=True)),
                f"an IMU at {', '.join(f'{at:g}' for at in self.imu)} m",
                f"forward, left, up within {', '.join(f'{low:g} to {high:g}' for low, high in _IMU)} m",
            ),
        ):
            if wrong:
                raise UsageError(found, expected, "change it")
        if self.seconds is not None and not self.seconds > 0:
            raise UsageError(f"a ride of {self.seconds:g} s", "more than 0 s", "choose such")

    def machine(self) -> MachineParameters:
        """What is ridden."""
        made = with_tyres(with_rider(nominal_machine(), self.rider_mass), self.tyre_stiffness)
        return replace(made, imu=self.imu)

    def bank_at(self, distance: float) -> float:
        """Of the road, rad, to the right.

        Args:
            distance: m.
        """
        return self.bank * rise(distance / _RISE) * sin(2 * pi * distance / BANK_WAVE)


@dataclass(frozen=True, eq=False)
class RideRecord:
    """A ride and what was recorded of it.

    Attributes:
        setting: what was asked for.
        seed: of rider and sensors.
        ride: with the truth.
        measured: `sensors.SENSED`.
    """

    setting: RideSetting
    seed: int
    ride: Ride
    measured: dict[str, Array]

    def log(self) -> Log:
        """What a logger has: IMU in the leaning frame's axes, encoder, wheel speed."""
        time = self.ride.time
        signals = [Signal(name, time, self.measured[column], unit, source) for name, column, unit, source in LOGGED]
        return Log.of(signals, source=f"simulated motorcycle, {self.setting.scenario}")

    def truth(self) -> Log:
        """What was true; roll from the road's normal, yaw about it, velocities of the road point below the rear frame."""
        d = self.ride
        roll, steer, aside, yaw_rate, roll_rate, steer_rate, front, rear = d.linear.T
        made = (
            ("roll_angle", roll, "rad"), ("pitch_angle", d.of("pitch"), "rad"), ("steer_angle", steer, "rad"),
            ("lateral_velocity", aside, "m/s"), ("heading_rate", yaw_rate, "rad/s"), ("roll_rate", roll_rate, "rad/s"),
            ("steer_rate", steer_rate, "rad/s"), ("front_lateral_force", front, "N"), ("rear_lateral_force", rear, "N"),
            ("rider_torque", d.of("rider_torque"), "N*m"), ("rider_lean", d.of("rider_lean"), "rad"),
            ("longitudinal_speed", d.ahead, "m/s"), ("distance", d.distance, "m"), ("lateral_offset", d.offset, "m"),
            ("road_bank", d.of("bank"), "rad"),
        )  # fmt: skip
        return Log.of([Signal(n, d.time, v, unit, "simulation") for n, v, unit in made], source="simulated motorcycle")


# Standard name, of `sensors.SENSED`, unit, sensor.
LOGGED = (
    ("roll_rate", "body_roll_rate", "rad/s", "gyroscope"), ("pitch_rate", "body_pitch_rate", "rad/s", "gyroscope"),
    ("yaw_rate", "body_yaw_rate", "rad/s", "gyroscope"), ("longitudinal_acceleration", "force_x", "m/s^2", "accelerometer"),
    ("lateral_acceleration", "force_y", "m/s^2", "accelerometer"), ("vertical_acceleration", "force_z", "m/s^2", "accelerometer"),
    ("steer_angle", "steer_angle", "rad", "encoder"), ("longitudinal_speed", "speed", "m/s", "front wheel"),
)  # fmt: skip


def nominal_machine() -> MachineParameters:
    """Sharp's machine with suspension and upper body, as an observer is designed for."""
    sharp = MotorcycleParameters.from_vehicle(load_vehicle("sharp1971"))
    return MachineParameters(sharp, suspension=Suspension(), upper_body=UpperBody())


def simulate_ride(setting: RideSetting | None = None, seed: int = 0) -> RideRecord:
    """Make a ride. The same setting and seed give the same numbers.

    Args:
        setting: what ride; track without noise by default.
        seed: of rider's hands, biases' signs and noise.

    Raises:
        UsageError: the machine fell.
    """
    s = setting or RideSetting()
    scenario = SCENARIOS[s.scenario]()
    rider = Rider(
        Machine(s.machine()), scenario.course, scenario.speed, body=0.15, delay=0.15,
        feels_forces=False, remnant=s.remnant, seed=seed,
    )  # fmt: skip
    seconds = scenario.seconds if s.seconds is None else min(s.seconds, scenario.seconds)
    done = ride(rider, seconds, TICK, s.bank_at if s.bank else level, round(1 / TICK / s.rate))
    return RideRecord(s, seed, done, sense(done, sensors_of(s, done, seed), seed))


def sensors_of(setting: RideSetting, done: Ride, seed: int) -> RideSensors:
    """The sensors of a setting.

    Args:
        setting: with noise, bias, speed error.
        done: whose signals' sizes the noise goes by.
        seed: of the biases' signs.
    """
    base = relative_noise(done, setting.noise) if setting.noise else IDEAL
    signs = np.random.default_rng([seed, 2018]).choice([-1.0, 1.0], 6) * setting.bias
    gyro, force = signs[:3] * GYRO_BIAS, signs[3:] * ACCELEROMETER_BIAS
    return replace(
        base, gyro_bias=(float(gyro[0]), float(gyro[1]), float(gyro[2])),
        accelerometer_bias=(float(force[0]), float(force[1]), float(force[2])), counts=setting.counts,
        zero=setting.zero, speed_scale=1 + setting.speed_error, wheel=True,
    )  # fmt: skip
