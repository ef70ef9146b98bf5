"""Wrong signs, units and axes of a two-wheeler's sensors are told, whatever the estimator says of itself."""

from __future__ import annotations

import numpy as np
import pytest

import codriver as cd
from codriver.run import observer_for
from codriver.simulate.motorcycle import RideSetting, simulate_ride
from codriver.simulate.motorcycle.files import nominal_vehicle
from codriver.trust.motorcycle import motorcycle_findings

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


def without(log: cd.Log, name: str) -> cd.Log:
    return cd.Log.of([signal for signal in log.values() if signal.name != name])


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
    assert "roll_rate has a bias of about 10 deg/s" in bad("motorcycle-uio", biased, vehicle)
    assert "nobody rolls over" in "".join(told(without(biased, "yaw_rate"), ("roll_rate", "longitudinal_speed")))


@pytest.mark.parametrize("zero", [0.5, -1.0])
def test_zero_of_the_encoder(log, vehicle, zero):
    d = log["steer_angle"]
    off = log.with_signals(cd.Signal("steer_angle", d.time, d.values + zero * DEGREE, d.unit))
    assert f"steer_angle is off its zero by {'-' if zero < 0 else ''}" in bad("motorcycle-uio", off, vehicle)


def test_short_ride_is_not_judged(log, vehicle):
    assert "sign" not in bad("motorcycle-uio", scaled(log, -1, "yaw_rate").between(0, 5), vehicle)


@pytest.fixture(scope="module")
def track() -> cd.Log:
    return simulate_ride(RideSetting("track", noise=0.075, seconds=45.0), seed=3).log()


def told(log: cd.Log, uses: tuple[str, ...], **found: float) -> dict[str, str]:
    """What is said of a log, severity by text, whoever estimates from it; without running the estimator."""
    grid = log.sample(list(uses), 0.01)
    values = {"roll_angle": np.zeros(len(grid))} | {name: np.full(len(grid), value) for name, value in found.items()}
    return {
        f.text: f.severity
        for f in motorcycle_findings(values, np.ones(len(grid), bool), grid, log)
        if f.severity != "ok"
    }


LINEAR = ("roll_rate", "yaw_rate", "steer_angle", "longitudinal_speed")


def changed(log: cd.Log, name: str, change) -> cd.Log:
    return log.with_signals(cd.Signal(name, log[name].time, change(log[name].time, log[name].values), log[name].unit))


def test_nothing_is_said_of_sound_bends(track):
    assert told(track, LINEAR) == {}


@pytest.mark.parametrize(("name", "bias", "severity"), [
    ("roll_rate", 1.2, "bad"), ("roll_rate", -0.7, "warn"), ("yaw_rate", 2.0, "bad"), ("yaw_rate", -2.0, "bad"),
])  # fmt: skip
def test_biases_by_bends(track, name, bias, severity):
    off = changed(track, name, lambda t, x: x + bias * DEGREE)
    said = told(off, LINEAR)
    text = next(text for text in said if text.startswith(f"{name} has a bias"))
    assert said[text] == severity
    assert abs(float(text.split("about ")[1].split()[0]) - bias) < 0.35
    # An estimator that finds it hears nothing of it.
    assert told(off, LINEAR, **{f"{name}_bias": bias * DEGREE}) == {}


@pytest.mark.parametrize(("name", "change", "said"), [
    ("longitudinal_speed", lambda t, v: 1.3 * v, "speed times yaw rate is 1.3 times"),
    ("longitudinal_speed", lambda t, v: v / 1.609, "speed times yaw rate is 0.6"),
    ("roll_rate", lambda t, p: 2 * p, "times the lean that speed and yaw rate balance"),
    ("roll_rate", lambda t, p: p + 3 * DEGREE * (t > 22), "a lean that departs by"),
    ("roll_rate", lambda t, p: np.clip(p, -0.2, 0.2), "the end of the sensor's range"),
    ("yaw_rate", lambda t, r: np.where((t > 20) & (t < 25), 0.1, r), "yaw_rate is 0.1 for 4.9"),
    ("steer_angle", lambda t, d: np.where(t > 20, d[2000], d), "while it moves, where it stays for"),
    ("yaw_rate", lambda t, r: np.where(np.arange(t.size) % 400 == 7, 3.0, r), "single samples stand out"),
    ("lateral_acceleration", lambda t, a: a + 1.5, "an IMU askew about x by 8"),
    ("longitudinal_acceleration", lambda t, a: a - 1.5, "an IMU askew about y by -9"),
])  # fmt: skip
def test_more_faults(track, name, change, said):
    assert any(said in text for text in told(changed(track, name, change), LINEAR))


@pytest.mark.parametrize(("name", "delay", "slow"), [("roll_rate", 0.2, "roll_rate"), ("yaw_rate", 0.2, "yaw_rate")])
def test_late_rate(track, name, delay, slow):
    late = track.with_signals(cd.Signal(name, track[name].time + delay, track[name].values, track[name].unit))
    assert any(text.startswith(f"{slow} comes about 0.") for text in told(late, LINEAR))


def test_turned_about_z(track):
    x, y = track["longitudinal_acceleration"], track["lateral_acceleration"]
    c, s = np.cos(15 * DEGREE), np.sin(15 * DEGREE)
    turned = track.with_signals(
        cd.Signal(x.name, x.time, c * x.values - s * y.values, x.unit),
        cd.Signal(y.name, y.time, s * x.values + c * y.values, y.unit),
    )
    assert any("about z" in text for text in told(turned, LINEAR))


def test_short_ride_says_that_it_cannot_be_judged(track):
    assert any("too short to tell" in text for text in told(track.between(0, 3), LINEAR))


def test_steer_that_rests_on_a_straight_is_sound(track):
    rests = changed(track, "steer_angle", lambda t, d: np.where(t < 6, 0.0, d))
    assert told(rests, LINEAR) == {}


def every(log: cd.Log, count: int, *names: str) -> cd.Log:
    """Every so many-th sample of some signals."""
    return log.with_signals(*(cd.Signal(n, log[n].time[::count], log[n].values[::count], log[n].unit) for n in names))


def test_speed_once_a_second(track):
    said = told(every(track, 100, "longitudinal_speed"), LINEAR)
    assert any("longitudinal_speed comes every 1 s, and a value holds for 0.5 s" in text for text in said)
    assert told(every(track, 20, "longitudinal_speed"), LINEAR) == {}


def test_a_slow_log_runs_at_the_rate_that_the_tyres_need(log, vehicle):
    slow = every(log, 5, *log)
    assert observer_for("motorcycle-kalman", slow, vehicle).dt == 0.01
    assert observer_for("motorcycle-imu", slow, vehicle).dt == 0.05
    assert observer_for("motorcycle-kalman", slow, vehicle, rate=125).dt == 0.008


def test_speed_out_of_range_is_named(log):
    check = cd.estimate_log("bicycle-kalman", log, cd.load_vehicle("pasma2024")).check()
    text = next(f.text for f in check.findings if "is valid" in f.text)
    assert "100% out of range" in text
    assert "between 1.5 and 12 m/s" in text


@pytest.mark.parametrize("hole", [1.0, 5.0])
def test_a_hole_is_no_fault_of_the_sensors(track, hole):
    """In mid-bend, where held values would add up to a lean."""
    holed = cd.Log.of([
        cd.Signal(s.name, s.time[there], s.values[there], s.unit)
        for s in track.values() for there in [(s.time < 14.0) | (s.time > 14.0 + hole)]
    ])  # fmt: skip
    assert told(holed, LINEAR) == {}
