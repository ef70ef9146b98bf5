"""Estimate.check(): quiet when all is well, loud when something is wrong."""

import numpy as np
import pytest

import codriver as cd
from codriver.simulate import demo_drive, truth_log
from conftest import motion_log


def kinematic(log, **options):
    return cd.compile(cd.build("kinematic", dt=0.01, **options)).run(log)


def found(check, severity):
    return " | ".join(f.text for f in check.findings if f.severity == severity)


def test_quiet_on_a_good_drive():
    log, _ = motion_log(120)
    check = kinematic(log).check()
    assert check.trusted
    assert not found(check, "bad")
    assert not found(check, "warn")


def test_wrong_sign_of_the_accelerometer():
    log, _ = motion_log(120)
    a = log["longitudinal_acceleration"]
    wrong = log.with_signals(cd.Signal(a.name, a.time, -a.values, a.unit))
    check = kinematic(wrong).check()
    assert not check.trusted
    assert "sign is wrong" in found(check, "bad")


def test_accelerometer_in_g():
    log, _ = motion_log(120)
    a = log["longitudinal_acceleration"]
    check = kinematic(log.with_signals(cd.Signal(a.name, a.time, a.values / 9.81, a.unit))).check()
    assert "check the units of both" in found(check, "warn") + found(check, "bad")


def test_offset_that_is_no_road():
    log, _ = motion_log(120)
    a = log["longitudinal_acceleration"]
    check = kinematic(log.with_signals(cd.Signal(a.name, a.time, a.values + 9.81, a.unit))).check()
    assert "more than any road" in found(check, "bad")


def test_slipping_wheels_show():
    """The wheels spin up by 6 m/s for 1.5 s while the accelerometer sees nothing."""
    log, _ = motion_log(200)
    v = log["longitudinal_speed"]
    slip = v.values + 6 * ((v.time > 100) & (v.time < 101.5))
    check = kinematic(log.with_signals(cd.Signal(v.name, v.time, slip, v.unit))).check()
    spans = [span for f in check.findings if "slip" in f.text for span in f.spans]
    assert any(start < 101 and stop > 100 for start, stop in spans)


def test_mass_wrong_by_a_factor_shows(car, demo):
    """A vehicle with a quarter of its mass: u four times too large."""
    good = cd.compile(cd.build("intent-pedals", car)).run(demo.measured).check()
    light = car.with_parameter("mass", car.number("mass") / 4)
    bad = cd.compile(cd.build("intent-pedals", light)).run(demo.measured).check()
    assert good.trusted
    assert max(bad.lean.values()) > 1.5 * max(good.lean.values()) or not bad.trusted


def test_standing_all_the_time():
    t = np.arange(6000) / 100
    log = cd.Log.of([
        cd.Signal("longitudinal_speed", t, np.zeros(t.size), "m/s"),
        cd.Signal("longitudinal_acceleration", t, 0.05 * np.random.default_rng(0).standard_normal(t.size), "m/s^2"),
    ])  # fmt: skip
    check = kinematic(log).check()
    assert check.valid_share == 0
    assert not check.trusted


@pytest.mark.slow
@pytest.mark.parametrize(("ell", "low", "high"), [(1.0, 0.78, 0.97), (2.0, 0.92, 0.99), (3.0, 0.95, 1.0)])
def test_coverage_on_simulated_drives(ell, low, high, car):
    """How often the true intentional jerk lies in the 95 % band, over six drives the band was not chosen on."""
    shares = []
    for seed in range(11, 17):
        drive = demo_drive(seed)
        estimate = cd.compile(cd.build("intent-pedals", car, ell=ell)).run(drive.measured)
        truth = truth_log(drive.trace)["intentional_jerk"]
        error = estimate.columns["intentional_jerk"] - np.interp(estimate.time, truth.time, truth.values)
        inside = np.abs(error) <= 1.96 * estimate.sd("intentional_jerk")
        shares.append(inside[estimate.valid].mean())
    assert low < np.mean(shares) < high, shares
