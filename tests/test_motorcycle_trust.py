"""Wrong signs, units and axes of a two-wheeler's sensors are told, whatever the estimator says of itself."""

from __future__ import annotations

import numpy as np
import pytest

import codriver as cd
from codriver.simulate.motorcycle import RideSetting, simulate_ride
from codriver.simulate.motorcycle.files import nominal_vehicle

DEGREE = np.pi / 180


@pytest.fixture(scope="module")
def log() -> cd.Log:
    return simulate_ride(RideSetting("slalom", noise=0.075, bias=1.0)).log()


@pytest.fixture(scope="module")
def vehicle() -> cd.Vehicle:
    return nominal_vehicle()


def scaled(log: cd.Log, factor: float, *names: str) -> cd.Log:
    made = [cd.Signal(name, log[name].time, factor * log[name].values, log[name].unit) for name in names]
    return log.with_signals(*made)


def swapped(log: cd.Log, one: str, other: str) -> cd.Log:
    pair = [cd.Signal(a, log[b].time, log[b].values, log[a].unit) for a, b in ((one, other), (other, one))]
    return log.with_signals(*pair)


def bad(name: str, log: cd.Log, vehicle: cd.Vehicle | None) -> str:
    check = cd.estimate_log(name, log, vehicle).check()
    return "\n".join(f.text for f in check.findings if f.severity == "bad" and "innovations" not in f.text)


GYRO = ("roll_rate", "pitch_rate", "yaw_rate")
ACCELEROMETER = ("lateral_acceleration", "vertical_acceleration")


@pytest.mark.parametrize("name", ["motorcycle-ekf", "motorcycle-uio", "motorcycle-imu"])
def test_sound_ride(log, vehicle, name):
    assert bad(name, log, vehicle) == ""
    check = cd.estimate_log(name, log, vehicle).check()
    assert any("go together" in f.text for f in check.findings)


@pytest.mark.parametrize(("names", "factor", "said"), [
    (("roll_rate",), -1, "sign of roll_rate"), (("yaw_rate",), -1, "sign of yaw_rate"),
    (("steer_angle",), -1, "sign of steer_angle"), (GYRO, DEGREE, "gyroscope in radians read as degrees"),
    (("roll_rate",), DEGREE, "degrees or radians"), (("steer_angle",), 1 / DEGREE, "steer angle in degrees"),
    (("steer_angle",), DEGREE, "steer angle in radians"), (("steer_angle",), 0, "steer_angle is 0 all the time"),
    (("yaw_rate",), 0, "yaw_rate is 0 all the time"),
])  # fmt: skip
def test_no_innovations(log, vehicle, names, factor, said):
    assert said in bad("motorcycle-uio", scaled(log, factor, *names), vehicle)


@pytest.mark.parametrize(("names", "factor", "said"), [
    (("pitch_rate",), -1, "sign of pitch_rate"), (("vertical_acceleration",), -1, "z down"),
    (ACCELEROMETER, 1 / 9.81, "g read as m/s^2"), (ACCELEROMETER, 9.81, "m/s^2 read as g"),
])  # fmt: skip
def test_accelerometer_and_pitch(log, vehicle, names, factor, said):
    assert said in bad("motorcycle-ekf", scaled(log, factor, *names), vehicle)
    assert said not in bad("motorcycle-uio", scaled(log, factor, *names), vehicle)  # takes neither


def test_axes(log, vehicle):
    assert "another axis" in bad("motorcycle-imu", swapped(log, "roll_rate", "pitch_rate"), vehicle)
    assert "lateral_acceleration shows" in bad("motorcycle-ekf", swapped(log, *ACCELEROMETER), vehicle)


def test_bias_that_is_not_found(log, vehicle):
    p = log["roll_rate"]
    biased = log.with_signals(cd.Signal("roll_rate", p.time, p.values + 10 * DEGREE, p.unit))
    assert "nobody rolls over" in bad("motorcycle-uio", biased, vehicle)


@pytest.mark.parametrize("zero", [0.5, -1.0])
def test_zero_of_the_encoder(log, vehicle, zero):
    d = log["steer_angle"]
    off = log.with_signals(cd.Signal("steer_angle", d.time, d.values + zero * DEGREE, d.unit))
    assert f"steer_angle is off its zero by {'-' if zero < 0 else ''}" in bad("motorcycle-uio", off, vehicle)


def test_short_ride_is_not_judged(log, vehicle):
    assert "sign" not in bad("motorcycle-uio", scaled(log, -1, "yaw_rate").between(0, 5), vehicle)
