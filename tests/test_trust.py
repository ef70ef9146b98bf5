"""Estimate.check(): quiet when all is well, loud when something is wrong."""

import numpy as np
import pytest

import codriver as cd
from codriver.errors import MissingSignal
from codriver.observers import Output
from codriver.simulate import demo_drive, truth_log
from codriver.trust.rows import row_findings
from conftest import motion_log
from toy_wheel import OUTPUTS, toy_wheel, wheel_log


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


class TestForeignObserver:
    """Rows are found by their role, whatever they are called."""

    def test_sound(self):
        check = cd.compile(toy_wheel()).run(wheel_log()).check()
        assert list(check.nis) == list(check.lean) == ["angle"]
        assert 0.5 < check.nis["angle"] < 1.5
        assert check.valid_share == 1.0
        assert check.verdict == "nothing speaks against it"
        assert "(1 is right" in found(check, "ok")

    def test_innovations_far_outside_their_band(self):
        check = cd.compile(toy_wheel(innovation_sd=1e-6)).run(wheel_log()).check()
        assert not check.trusted
        assert "angle: the innovations scatter" in found(check, "bad")
        assert "ell" not in found(check, "bad")  # it has no such knob
        assert "slip" not in found(check, "warn")

    @pytest.mark.parametrize(("times", "severity"), [(1, "ok"), (4, "warn"), (12, "bad")])
    def test_what_a_model_takes_for_granted_is_bad_beyond_eight_bands(self, times, severity):
        """Balance in a turn is no sensor's: four times the band, which is bad of an encoder, is a warning."""
        white = times * np.random.default_rng(0).standard_normal(5000)
        grid = wheel_log().sample(("steering_wheel_angle",), 0.01)
        n = len(grid)
        for row, worst in (("balance", severity), ("angle", "ok" if times == 1 else "bad")):
            values = {f"{row}_innovation": white[:n], f"{row}_innovation_sd": np.ones(n), "valid": np.ones(n)}
            outputs = (
                Output(f"{row}_innovation", "m/s^2", "innovation"), Output(f"{row}_innovation_sd", "m/s^2", "innovation_sd"),
                Output("valid", "1", "flag"),
            )  # fmt: skip
            said = row_findings(values, outputs, ("angle",), values["valid"] > 0.5, grid, None, {}, {})
            assert [f.severity for f in said if "lean" in f.text] == [worst], row
            assert any("taken for granted" in f.text for f in said) == (row == "balance" and times > 1)

    def test_much_too_wide_a_band_is_no_praise(self):
        check = cd.compile(toy_wheel(innovation_sd=1.0)).run(wheel_log()).check()
        assert "the band is wide for this sensor" in found(check, "ok")
        assert "is right" not in found(check, "ok")

    @pytest.mark.parametrize("sd", [0.0, -1.0, float("nan")])
    def test_a_standard_deviation_that_is_none(self, sd):
        check = cd.compile(toy_wheel(innovation_sd=sd)).run(wheel_log()).check()
        assert "not above 0" in found(check, "bad")
        assert not check.nis

    def test_no_standard_deviation(self):
        check = cd.compile(toy_wheel(outputs=OUTPUTS[:5])).run(wheel_log()).check()
        assert "no standard deviation of its innovations" in found(check, "warn")

    def test_no_innovations(self):
        check = cd.compile(toy_wheel(outputs=OUTPUTS[:2])).run(wheel_log()).check()
        assert "cannot be judged: no innovations among the outputs" in found(check, "warn")

    def test_used_says_which_count(self):
        used = Output("angle_used", "1", "flag")
        late = toy_wheel(innovation_sd=1.0, outputs=(*OUTPUTS, used))
        step = late.step

        def never(carry, u, y, ok, rho):
            new, out = step(carry, u, y, ok, rho)
            return new, {**out, "angle_used": 0.0}

        check = cd.compile(toy_wheel(step=never, outputs=(*OUTPUTS, used))).run(wheel_log()).check()
        assert "only 0 valid innovations" in found(check, "warn")

    def test_lean_is_taken_over_the_knob(self):
        """A lean that lasts 2 s shows more over 5 s than over 0.5 s."""
        log = wheel_log()
        slow = cd.compile(toy_wheel(settings={"ell": 0.2})).run(log).check()
        usual = cd.compile(toy_wheel(settings={"ell": "high"})).run(log).check()
        same = cd.compile(toy_wheel(settings={"ell": 2.0})).run(log).check()
        assert usual.lean == same.lean != slow.lean


class TestFewerOutputs:
    """What was left out is not judged, and is not taken for granted."""

    def test_estimates_alone(self):
        log, _ = motion_log(60)
        program = cd.compile(cd.build("kinematic"), outputs=["longitudinal_jerk"])
        check = program.run(log).check()
        assert np.isnan(check.valid_share)
        assert not check.nis
        assert "cannot be judged: the flag 'valid' is not among the outputs" in found(check, "warn")
        assert "valid" not in found(check, "ok")
        with pytest.raises(MissingSignal, match="left out"):
            _ = program.run(log).valid

    def test_validity_without_innovations(self):
        log, _ = motion_log(60)
        check = cd.compile(cd.build("kinematic"), outputs=["longitudinal_jerk", "valid"]).run(log).check()
        assert check.valid_share > 0.9
        assert "cannot be judged: no innovations" in found(check, "warn")

    def test_one_row_of_two(self):
        log, _ = motion_log(60)
        names = ["valid", "speed_innovation", "speed_innovation_sd", "speed_used"]
        check = cd.compile(cd.build("kinematic"), outputs=names).run(log).check()
        assert list(check.nis) == ["speed"]
        assert "acceleration: cannot be judged" in found(check, "warn")

    def test_no_flag_at_all_is_valid_always(self):
        estimate = cd.compile(toy_wheel()).run(wheel_log(2.0))
        assert estimate.valid.all()
        assert estimate.valid.shape == estimate.time.shape

    @pytest.mark.parametrize("make", [toy_wheel, lambda: cd.build("kinematic")])
    def test_not_one_tick(self, make):
        log = wheel_log(2.0).with_signals(*motion_log(2)[0].values())
        estimate = cd.compile(make()).run(log, start=5.0, stop=4.0)
        assert "not one tick" in found(estimate.check(), "bad")


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


def test_units_betray_themselves():
    """Each wrong unit is named, the right way round, and is bad."""
    log, _ = motion_log(120)
    v, a = log["longitudinal_speed"], log["longitudinal_acceleration"]
    for factor, said in ((3.6, "km/h read as m/s"), (1.609, "km/h read as mph"), (0.621, "mph read as km/h")):
        check = kinematic(log.with_signals(cd.Signal(v.name, v.time, factor * v.values, v.unit))).check()
        assert said in found(check, "bad"), factor
    check = kinematic(log.with_signals(cd.Signal(a.name, a.time, a.values / 9.80665, a.unit))).check()
    assert "g read as m/s^2" in found(check, "bad")


@pytest.mark.parametrize(
    ("name", "factor", "said"),
    [
        ("accelerator_pedal", 0.01, "accelerator pedal goes with what the car does, yet is never above 0.0098 of 1"),
        ("brake_pressure", 1e-5, "brake pressure goes with what the car does, yet is never above 0.00022 bar"),
        ("brake_pressure", 1e-2, "never above 0.22 bar"),
    ],
)
def test_pedals_in_too_small_a_unit(demo, car, name, factor, said):
    """Such a pedal adds nothing, so innovations and known input show nothing."""
    s = demo.measured[name]
    log = demo.measured.with_signals(cd.Signal(name, s.time, factor * s.values, s.unit))
    assert said in found(cd.compile(cd.build("intent-pedals", car)).run(log).check(), "bad")
    assert said in found(cd.compile(cd.build("pedals-only", car)).run(log).check(), "bad")
    assert "what the car does" not in found(kinematic(log).check(), "bad")  # which does not use it


def test_pedals_that_rest_are_no_wrong_unit(demo, car):
    """Cruise control and coasting: sensors that show their noise alone."""
    rng = np.random.default_rng(0)
    log = demo.measured
    for name, noise in (("accelerator_pedal", 0.004), ("brake_pressure", 5e3)):
        s = log[name]
        log = log.with_signals(cd.Signal(name, s.time, noise * rng.standard_normal(s.time.size), s.unit))
    check = cd.compile(cd.build("intent-pedals", car)).run(log).check()
    assert "what the car does" not in found(check, "bad")


def test_stuck_speed():
    log, _ = motion_log(120)
    v = log["longitudinal_speed"]
    check = kinematic(log.with_signals(cd.Signal(v.name, v.time, np.full(v.time.size, 10.0), v.unit))).check()
    assert "stuck" in found(check, "bad")


def test_spikes_in_the_speed_are_told(demo):
    log, _ = motion_log(120)
    v = log["longitudinal_speed"]
    spikes = v.values + 20.0 * (np.random.default_rng(0).random(v.time.size) < 0.01)
    assert "spikes" in found(kinematic(log.with_signals(cd.Signal(v.name, v.time, spikes, v.unit))).check(), "warn")
    assert "spikes" not in str(kinematic(demo.measured).check().findings)
