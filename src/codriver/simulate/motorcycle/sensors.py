"""What sensors make of a ride: IMU in the rear frame at an offset, steering encoder, wheel speed.

    y = s + b + n,   n ~ N(0, sigma^2)          gyroscope, accelerometer; b a constant bias
    delta = q round((delta + delta_0) / q)      encoder of 2 pi / q counts, its zero delta_0 off
    v = c omega_f R_f                           wheel speed by the radius when upright: too high by some percent when leaning

The accelerometer measures the specific force at its place in body axes: gravity, centripetal and lever-arm terms are all in it.
Its axes are ISO 8855: forward, left, up.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np

from codriver.signals.signal import Array
from codriver.simulate.motorcycle.ride import Ride

GYRO = ("body_roll_rate", "body_pitch_rate", "body_yaw_rate")
ACCELEROMETER = ("force_x", "force_y", "force_z")
SENSED = (*GYRO, *ACCELEROMETER, "steer_angle", "speed")


@dataclass(frozen=True)
class RideSensors:
    """The sensors.

    Attributes:
        gyro_noise, accelerometer_noise: sigma a sample, rad/s and m/s^2.
        gyro_bias, accelerometer_bias: forward, left, up, rad/s and m/s^2.
        counts: of the steering encoder in a turn; 0 for an ideal one.
        zero: what the encoder shows when the handlebar is straight, rad.
        speed_noise: sigma a sample, m/s.
        speed_scale: c, of the measured to the true speed.
        wheel: whether the speed is the front wheel's, not that over ground.
    """

    gyro_noise: float = 0.005
    accelerometer_noise: float = 0.1
    gyro_bias: tuple[float, float, float] = (0.0, 0.0, 0.0)
    accelerometer_bias: tuple[float, float, float] = (0.0, 0.0, 0.0)
    counts: int = 4096
    zero: float = 0.0
    speed_noise: float = 0.05
    speed_scale: float = 1.0
    wheel: bool = False


IDEAL = RideSensors(gyro_noise=0.0, accelerometer_noise=0.0, counts=0, speed_noise=0.0)


def relative_noise(ride: Ride, share: float) -> RideSensors:
    """Noise whose sd is a part of each sensor's rms over the ride; the largest of the three axes' for an IMU's.

    Gravity is taken from the accelerometer's vertical axis first. The paper bounds its noise by 5 to 10 % of each signal's largest
    value, which is about as much.

    Args:
        ride: the ride.
        share: 0.05 for 5 %.
    """
    gyro = max(float(np.sqrt(np.mean(ride.of(name) ** 2))) for name in GYRO)
    gravity = ride.rider.machine.parameters.sharp.g
    level = {"force_z": gravity}
    force = max(float(np.sqrt(np.mean((ride.of(name) - level.get(name, 0.0)) ** 2))) for name in ACCELEROMETER)
    return RideSensors(gyro_noise=share * gyro, accelerometer_noise=share * force, speed_noise=0.0)


def sense(ride: Ride, sensors: RideSensors, seed: int = 0) -> dict[str, Array]:
    """The measured signals, `SENSED`, each of shape (n,).

    Args:
        ride: the ride.
        sensors: the sensors.
        seed: of the noise.
    """
    rng = np.random.default_rng(seed)
    count = len(ride.time)
    measured = {}
    for names, noise, bias in (
        (GYRO, sensors.gyro_noise, sensors.gyro_bias),
        (ACCELEROMETER, sensors.accelerometer_noise, sensors.accelerometer_bias),
    ):
        for name, offset in zip(names, bias, strict=True):
            measured[name] = ride.of(name) + offset + noise * rng.standard_normal(count)
    steer = ride.of("steer") + sensors.zero
    if sensors.counts:
        tick = 2 * pi / sensors.counts
        steer = tick * np.round(steer / tick)
    measured["steer_angle"] = steer
    rolling = ride.of("front_spin_rate") * ride.rider.machine.parameters.sharp.Rf if sensors.wheel else ride.speed
    measured["speed"] = sensors.speed_scale * rolling + sensors.speed_noise * rng.standard_normal(count)
    return measured
