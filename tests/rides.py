"""Rides of the nonlinear motorcycle for tests of its observers: simulated once a session, as logs with the IMU's names.

Noise as the 2018 paper has it: 7.5 % of each sensor's rms at 1 kHz; biases of 0.5 deg/s and 0.2 m/s^2.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

import codriver as cd
from codriver.models import MotorcycleParameters
from codriver.names import quantity
from codriver.simulate.motorcycle import (
    Machine,
    MachineParameters,
    Ride,
    Rider,
    RideSensors,
    RideSetting,
    ramp,
    relative_noise,
    ride,
    sense,
    simulate_ride,
    straight,
)
from codriver.simulate.motorcycle.files import nominal_vehicle

DEGREE, KMH = np.pi / 180, 1 / 3.6
NAMES = {
    "body_roll_rate": "roll_rate", "body_pitch_rate": "pitch_rate", "body_yaw_rate": "yaw_rate",
    "force_y": "lateral_acceleration", "force_z": "vertical_acceleration", "steer_angle": "steer_angle",
    "speed": "longitudinal_speed",
}  # fmt: skip
BIASES = {"gyro_bias": (0.5 * DEGREE,) * 3, "accelerometer_bias": (0.2,) * 3}
TRUTH = {
    "roll_angle": "roll", "rider_torque": "rider_torque", "front_lateral_force": "front_lateral_force",
    "rear_lateral_force": "rear_lateral_force",
}  # fmt: skip


@cache
def machine() -> Machine:
    """Without suspension, on a rider who sits still."""
    return Machine(MachineParameters(MotorcycleParameters.from_vehicle(cd.load_vehicle("sharp1971"))))


vehicle = cache(nominal_vehicle)


def _steady(value: float):
    return ramp(value, value, 0.0, 1.0)


@cache
def leaning_ride() -> Ride:
    """4.5 s at 70 km/h: to 30 degrees to the right and over to the left."""
    lean = lambda t: 0.55 * np.sin(2 * np.pi * max(t - 0.5, 0.0) / 5.0)  # noqa: E731
    return ride(Rider(machine(), straight(), _steady(70 * KMH), lean=lean), 4.5)


@cache
def scenario(name: str) -> Ride:
    """Of the paper's kind, on a machine with suspension and a rider who leans his body: truth at 1 kHz."""
    return simulate_ride(RideSetting(name, rate=1000), seed=1).ride


def noisy(done: Ride, **more: object) -> RideSensors:
    """The paper's noise, an encoder of 4096 counts, the front wheel's speed."""
    return replace(relative_noise(done, 0.075), wheel=True, **more)


def ride_log(done: Ride, sensors: RideSensors, seed: int = 0, every: int = 1, start: int = 0) -> cd.Log:
    measured = sense(done, sensors, seed)
    t = done.time[start::every]
    return cd.Log.of(
        [cd.Signal(name, t, measured[key][start::every], quantity(name).unit) for key, name in NAMES.items()]
    )


def errors(estimate: cd.Estimate, done: Ride, name: str, after: float = 1.0) -> np.ndarray:
    """Estimated less true, from so many seconds after the start on."""
    true = np.interp(estimate.time, done.time, done.of(TRUTH[name]))
    return (estimate[name].values - true)[estimate.time >= estimate.time[0] + after]


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
