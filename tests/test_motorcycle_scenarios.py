"""Courses, riders, scenarios, variations and files of the simulated motorcycle."""

from __future__ import annotations

from dataclasses import replace
from math import cos, pi, sin

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

from codriver.cli.app import app
from codriver.errors import UsageError
from codriver.logs import read
from codriver.simulate.motorcycle import (
    SCENARIOS,
    STATES,
    Machine,
    Rider,
    RideSetting,
    by_curvature,
    closed,
    double_lane_change,
    for_bends,
    nominal_machine,
    ramp,
    ride,
    simulate_ride,
    slalom,
    straight,
    with_rider,
    with_tyres,
)
from codriver.simulate.motorcycle.files import FILES, nominal_vehicle
from codriver.simulate.motorcycle.paths import rise
from codriver.simulate.motorcycle.tyre import cornering_stiffness
from codriver.vehicles import load_vehicle

KMH = 1 / 3.6


def steady(value: float):
    return ramp(value, value, 0.0, 1.0)


@pytest.fixture(scope="module")
def machine() -> Machine:
    return Machine(nominal_machine())


@pytest.fixture(scope="module")
def lane_change():
    return simulate_ride(
        RideSetting("double-lane-change", noise=0.075, bias=1.0, speed_error=0.02, seconds=6.0), seed=3
    )


class TestCourse:
    def test_circle(self):
        radius = 40.0
        circle = by_curvature(lambda s: np.full_like(s, 1 / radius), 2 * pi * radius)
        np.testing.assert_allclose(circle.place[-1], 0, atol=1e-9)
        assert np.abs(np.hypot(circle.place[:, 0], circle.place[:, 1] - radius) - radius).max() < 1e-9
        distance, offset = circle.locate(0.0, 2 * radius + 3.0, pi * radius - 5)
        assert distance == pytest.approx(pi * radius, abs=1e-3)
        assert offset == pytest.approx(-3.0, abs=1e-3)

    def test_place_as_function(self):
        course = slalom(2.0, 100.0)
        for s in (10.0, 77.3, 333.3):
            x, y, heading, _ = course.at(s)
            along = (x - 30) / 100
            assert y == pytest.approx(2 * rise(along) * sin(2 * pi * along), abs=1e-3)
            if along > 1:
                slope = 4 * pi / 100 * cos(2 * pi * along)
                assert np.tan(heading) == pytest.approx(slope, abs=1e-4)
                bend = -8 * pi**2 / 100**2 * sin(2 * pi * along) / (1 + slope**2) ** 1.5
                assert course.curvature_at(s) == pytest.approx(bend, abs=2e-5)

    def test_located_point_is_the_nearest(self):
        course, rng = closed(), np.random.default_rng(5)
        for s in rng.uniform(5, course.length - 5, 30):
            x, y, heading, _ = course.at(s)
            side = rng.uniform(1, 3) * rng.choice([-1, 1])
            point = np.array([x - side * sin(heading), y + side * cos(heading)])
            distance, offset = course.locate(*point, s + rng.uniform(-2, 2))
            near = course.place[max(round(s / course.step) - 60, 0) : round(s / course.step) + 60]
            assert abs(offset) == pytest.approx(np.hypot(*(near - point).T).min(), abs=0.01)
            assert distance == pytest.approx(s, abs=0.02)

    def test_track_closes_and_has_bends_to_both_sides(self):
        track = closed(laps=2)
        middle = len(track.heading) // 2
        for place in (track.place[-1], track.place[middle]):
            np.testing.assert_allclose(place, 0, atol=2e-3)
        assert track.heading[-1] == pytest.approx(4 * pi, abs=1e-3)
        assert track.curvature.min() < -0.01
        assert track.curvature.max() > 0.05

    def test_what_does_not_close_is_refused(self):
        with pytest.raises(ValueError, match="360"):
            closed(((50.0, 90.0), (50.0, 0.0), (50.0, 90.0)))

    def test_speed_for_bends(self):
        track = closed()
        plan = for_bends(track, 30 * KMH, 100 * KMH, 7.5, start=60 * KMH)
        s = np.arange(0, track.length, 0.5)
        v = np.array([plan(0.0, float(place)) for place in s])
        bend = np.array([abs(track.curvature_at(float(place))) for place in s])
        assert v[0] == pytest.approx(60 * KMH)
        assert v.max() == pytest.approx(100 * KMH, abs=0.1)
        assert (bend * v**2).max() < 7.5 + 1e-6
        along = np.diff(v**2) / 2 / 0.5
        assert -3.01 < along.min() < -2
        assert 2 < along.max() < 2.51


class TestBank:
    @pytest.mark.parametrize("bank", [0.1, pytest.param(-0.1, marks=pytest.mark.slow)])
    def test_steady_turn_on_a_banked_circle(self, machine, bank):
        """The gyroscope turns about the true vertical; roll by moments about the contacts in the road's axes."""
        rigid = replace(nominal_machine(), suspension=None, upper_body=None)
        machine = Machine(rigid)
        circle = by_curvature(lambda s: np.full_like(s, -1 / 80), 1000.0)
        done = ride(Rider(machine, circle, steady(15.0)), 7.0, bank=lambda _s: bank, every=10)
        roll, pitch = done.of("roll")[-1], done.of("pitch")[-1]
        turn = done.of("yaw_rate")[-1]
        assert np.ptp(done.of("roll")[-50:]) < 2e-3
        error = done.of("heading_error")[-1]
        body = Rotation.from_euler("ZXY", [error, roll, pitch])
        rates = np.array([done.of(f"body_{name}_rate")[-1] for name in ("roll", "pitch", "yaw")])
        vertical = np.array([0, sin(bank), cos(bank)])  # in the course's axes
        np.testing.assert_allclose(body.apply(rates), turn / cos(bank) * vertical, atol=5e-3)
        p = rigid.sharp
        j = (p.a + p.e) * sin(p.eps) + p.f * cos(p.eps)
        share = rigid.loads[0] / sum(rigid.loads)
        rho = share * rigid.front.crown + (1 - share) * rigid.rear.crown
        arm = (p.Mf * j + p.Mr * p.h) / p.mass - rho
        about = -turn / cos(bank)
        a = done.speed[-1] * about  # to the right
        spin = (p.ify / p.Rf + p.iry / p.Rr) * done.speed[-1] * about

        def moment(phi: float) -> float:
            up, side = p.g * cos(bank) + a * sin(bank), a * cos(bank) - p.g * sin(bank)
            return p.mass * (up * arm * sin(phi) - side * (rho + arm * cos(phi))) - spin * cos(phi + bank)

        assert roll == pytest.approx(brentq(moment, -1, 1.4), abs=2e-3)
        loads = done.of("front_load")[-1] + done.of("rear_load")[-1]
        assert loads == pytest.approx(p.mass * (p.g * cos(bank) + a * sin(bank)), rel=2e-3)

    def test_the_gyroscope_adds_up_to_the_attitude(self, machine):
        """Heading about the vertical, bank, roll and pitch from the truth, against the ideal gyroscope's integral."""
        course = by_curvature(lambda s: 0.012 * np.sin(s / 25), 400.0)
        rider = Rider(machine, course, steady(18.0), delay=0.15, feels_forces=False)
        done = ride(rider, 3.0, bank=lambda s: 0.1 * rise(s / 30) * sin(s / 20))
        rates = np.column_stack([done.of(f"body_{name}_rate") for name in ("roll", "pitch", "yaw")])
        attitude = Rotation.identity()
        for rate in (rates[1:] + rates[:-1]) / 2:
            attitude = attitude * Rotation.from_rotvec(rate * 1e-3)
        banks = done.of("bank")
        vertical = np.sum((done.of("road_turn_rate") / np.cos(banks))[:-1]) * 1e-3
        true = Rotation.from_euler("ZX", [vertical, banks[-1]]) * Rotation.from_euler(
            "ZXY", [done.of("heading_error")[-1], done.of("roll")[-1], done.of("pitch")[-1]]
        )
        assert np.abs(banks).max() > 0.08
        assert np.ptp(done.of("roll")) > 0.4
        assert (true.inv() * attitude).magnitude() < 2e-3


def test_the_accelerometer_is_the_second_derivative_of_its_place(machine):
    """While swerving, by differences of the place that roll, pitch and yaw say, at 1 kHz."""
    rider = Rider(machine, slalom(1.0, 40.0, start=2.0), steady(15.0), delay=0.15, feels_forces=False)
    done = ride(rider, 2.0)
    p = machine.parameters
    angles = np.column_stack([done.of(name) for name in ("yaw", "roll", "pitch")])
    body = Rotation.from_euler("ZXY", angles)
    place = np.column_stack([done.of(name) for name in "xyz"]) + body.apply(np.array(p.imu) - [0, 0, p.sharp.h])
    acceleration = (place[2:] - 2 * place[1:-1] + place[:-2]) / 1e-6
    expected = body[1:-1].inv().apply(acceleration + np.array([0, 0, p.sharp.g]))
    shown = np.column_stack([done.of(f"force_{axis}") for axis in "xyz"])
    assert np.ptp(done.of("roll")) > 0.3
    np.testing.assert_allclose(shown[1000:-1], expected[999:], atol=0.02)


class TestRider:
    def test_from_rest_and_back(self, machine):
        def speed(time: float, _distance: float) -> float:
            return max(min(4 * time, 12.0, 4 * (8.0 - time)), 0.0)

        rider = Rider(machine, double_lane_change(2.0, 20.0, 2.0, 6.0), speed, delay=0.15, feels_forces=False)
        done = ride(rider, 10.0, every=10)
        assert done.speed[0] == 0
        assert done.speed.max() > 11.5
        assert done.speed[-1] < 0.2
        assert done.ahead.min() > -0.05
        assert np.abs(done.of("roll")).max() > 0.05
        assert np.abs(done.of("roll"))[-1] < 0.01
        assert np.abs(done.offset).max() < 0.8

    def test_hips_push_the_machine_the_other_way(self, machine):
        state, given = machine.upright(20.0), np.zeros(10)
        still = machine.rate(state, given)
        given[3] = 10.0
        pushed = machine.rate(state, given) - still
        assert pushed[STATES.index("rider_lean_rate")] > 0 > pushed[STATES.index("roll_rate")]

    def test_braking_dives(self, machine):
        """Fork's travel by statics: load along the steer axis, the brake force's part along it, less what does not hang on it."""
        rider = Rider(machine, straight(), ramp(30.0, 21.0, 0.0, 3.0))
        done = ride(rider, 2.0, every=10)
        p, soft = machine.parameters.sharp, machine.parameters.suspension
        eps = p.eps - done.of("pitch")[-1]  # the nose dives: the axis stands steeper
        load, brake = done.of("front_load")[-1], -done.of("front_longitudinal_force")[-1]
        slowing = -np.diff(done.speed)[-1] / 0.01
        weight = soft.front_unsprung * p.g
        along = (load - weight) * cos(eps) + (brake - soft.front_unsprung * slowing) * sin(eps)
        rest = (machine.parameters.loads[0] - weight) * cos(p.eps)
        travel = done.of("front_travel")[-1]
        assert travel > 0.015
        assert travel == pytest.approx((along - rest) / soft.front_stiffness, rel=0.03)


class TestScenarios:
    def test_sizes(self, lane_change):
        done = lane_change.ride
        assert 0.2 < np.abs(done.of("roll")).max() < 0.35
        assert np.abs(done.offset).max() < 0.5
        assert np.abs(done.of("rider_lean")).max() > 0.03

    def test_seeds(self):
        setting = RideSetting("slalom", noise=0.05, seconds=0.6)
        one, again, other = (simulate_ride(setting, seed) for seed in (1, 1, 2))
        for name, signal in one.log().items():
            np.testing.assert_array_equal(signal.values, again.log()[name].values)
        np.testing.assert_array_equal(one.ride.states, again.ride.states)
        assert not np.array_equal(one.ride.states, other.ride.states)

    def test_sensors_err_as_told(self, lane_change):
        log, done = lane_change.log(), lane_change.ride
        for name, true in (("roll_rate", "body_roll_rate"), ("yaw_rate", "body_yaw_rate")):
            error = log[name].values - done.of(true)
            assert abs(error.mean()) == pytest.approx(0.5 * pi / 180, rel=0.2)
        force = log["lateral_acceleration"].values - done.of("force_y")
        assert abs(force.mean()) == pytest.approx(0.2, rel=0.2)
        upright = np.abs(done.of("roll")) < 0.02
        assert (log["longitudinal_speed"].values / done.speed)[upright].mean() == pytest.approx(1.02, abs=4e-3)

    def test_an_imu_elsewhere_and_an_encoder_off_its_zero(self):
        """A rigid frame: f' - f = w' x d + w x (w x d); the same rates, the same ride."""
        asked = {"scenario": "double-lane-change", "rate": 1000, "seconds": 2.0, "counts": 0}
        here, there = (
            simulate_ride(RideSetting(**asked, **more)) for more in ({}, {"imu": (1.1, -0.17, 0.5), "zero": 0.02})
        )
        a, b, d = here.measured, there.measured, np.array([1.0, -0.2, -0.3])
        np.testing.assert_array_equal(here.ride.of("roll"), there.ride.of("roll"))
        np.testing.assert_allclose(b["steer_angle"] - a["steer_angle"], 0.02, atol=1e-12)
        w = np.column_stack([a[name] for name in ("body_roll_rate", "body_pitch_rate", "body_yaw_rate")])
        moved = np.cross(np.gradient(w, here.ride.time, axis=0), d) + np.cross(w, np.cross(w, d))
        for axis, name in enumerate(("force_x", "force_y", "force_z")):
            np.testing.assert_allclose((b[name] - a[name])[2:-2], moved[2:-2, axis], atol=0.03)
        assert np.abs(moved[:, 1]).max() > 0.3

    def test_a_leaning_wheel_turns_faster(self, machine):
        done = ride(Rider(machine, straight(), steady(20.0), lean=lambda _t: 0.6), 4.0, every=10)
        p, roll = machine.parameters.sharp, done.of("roll")[-1]
        crown = machine.parameters.front.crown
        wheel = done.of("front_spin_rate")[-1] * p.Rf / done.ahead[-1]
        assert wheel == pytest.approx(p.Rf / (p.Rf - crown * (1 - cos(roll))), abs=4e-3)
        assert wheel > 1.02

    def test_the_truths_speed_is_the_road_points(self, lane_change):
        done, h = lane_change.ride, lane_change.ride.rider.machine.parameters.sharp.h
        yaw, side = done.of("yaw"), h * np.sin(done.of("roll"))
        place = np.column_stack([done.of("x") - side * np.sin(yaw), done.of("y") + side * np.cos(yaw)])
        moving = np.gradient(place, done.time, axis=0)
        ahead = np.cos(yaw) * moving[:, 0] + np.sin(yaw) * moving[:, 1]
        aside = np.cos(yaw) * moving[:, 1] - np.sin(yaw) * moving[:, 0]
        truth = lane_change.truth()
        np.testing.assert_allclose(truth["longitudinal_speed"].values[1:-1], ahead[1:-1], atol=2e-3)
        np.testing.assert_allclose(truth["lateral_velocity"].values[1:-1], aside[1:-1], atol=5e-3)

    def test_what_cannot_be_is_refused(self):
        for wrong in (
            {"scenario": "wheelie"},
            {"rate": 300},
            {"noise": -1.0},
            {"seconds": 0.0},
            {"bank": 1.0},
            {"zero": 1.0},
            {"imu": (0.0, 0.0, 9.0)},
        ):
            with pytest.raises(UsageError):
                RideSetting(**wrong)
        with pytest.raises(UsageError, match="rider"):
            RideSetting(rider_mass=20.0).machine()

    @pytest.mark.slow
    @pytest.mark.parametrize("changed", [{}, {"rider_mass": 110.0, "tyre_stiffness": 0.7}])
    def test_track(self, changed):
        done = simulate_ride(RideSetting("track", **changed)).ride
        roll = np.degrees(done.of("roll"))
        assert -50 < roll.min() < -35
        assert 35 < roll.max() < 50
        assert done.speed.min() == pytest.approx(30 * KMH, abs=0.7)
        assert done.speed.max() == pytest.approx(100 * KMH, abs=0.5)
        assert np.sqrt(np.mean(done.offset**2)) < 0.8
        assert done.distance[-1] > closed().length - 40

    @pytest.mark.slow
    def test_slalom(self):
        done = simulate_ride(RideSetting("slalom", bank=0.05)).ride
        assert 0.3 < np.abs(done.of("roll")).max() < 0.7
        assert done.speed[0] == pytest.approx(50 * KMH, abs=0.3)
        assert done.speed[-1] == pytest.approx(100 * KMH, abs=0.5)
        assert np.ptp(done.of("bank")) > 0.05


class TestVariations:
    def test_another_rider(self):
        own = nominal_machine()
        heavy = with_rider(own, 110.0)
        assert heavy.sharp.mass == pytest.approx(own.sharp.mass + 35)
        assert sum(heavy.loads) == pytest.approx(heavy.sharp.mass * own.sharp.g)
        # moments about the rear contact: the rider's 35 kg sit b - 0.1 m in front of it
        wheelbase = own.sharp.b + own.sharp.front
        assert heavy.sharp.b + heavy.sharp.front == pytest.approx(wheelbase, rel=1e-9)
        more = 35 * own.sharp.g * (own.sharp.b - 0.1) / wheelbase
        assert heavy.loads[0] - own.loads[0] == pytest.approx(more, rel=1e-9)
        assert with_rider(own, 75.0) == own

    def test_it_is_the_same_tyre(self):
        own = nominal_machine()
        heavy = with_rider(own, 110.0)
        for i, (tyre, was) in enumerate(((heavy.front, own.front), (heavy.rear, own.rear))):
            new, old = ((m.sharp.Cf1, m.sharp.Cr1)[i] for m in (heavy, own))
            for load in (800.0, 1500.0):
                mine = float(cornering_stiffness(load, heavy.loads[i], new, tyre))
                assert mine == pytest.approx(float(cornering_stiffness(load, own.loads[i], old, was)), rel=1e-9)

    def test_soft_tyres(self):
        own = nominal_machine()
        soft = with_tyres(own, 0.7)
        assert soft.sharp.Cf2 == pytest.approx(0.7 * own.sharp.Cf2)
        assert replace(soft.sharp, Cf1=1, Cf2=1, Cr1=1, Cr2=1) == replace(own.sharp, Cf1=1, Cf2=1, Cr1=1, Cr2=1)


class TestFiles:
    def test_what_the_command_writes_is_the_ride(self, tmp_path):
        out = tmp_path / "ride"
        asked = [
            "--scenario",
            "slalom",
            "--noise",
            "7.5",
            "--bias",
            "1",
            "--duration",
            "1",
            "--seed",
            "4",
            "--imu",
            "-0.3",
            "0",
            "0.9",
        ]
        said = CliRunner().invoke(app, ["simulate", "motorcycle", "-o", str(out), *asked])
        assert said.exit_code == 0, said.output
        assert "50 to " in said.output
        assert sorted(path.name for path in out.iterdir()) == sorted(FILES)
        record = simulate_ride(RideSetting("slalom", noise=0.075, bias=1.0, seconds=1.0, imu=(-0.3, 0.0, 0.9)), seed=4)
        log = read(out / "ride.csv", names=out / "names.toml")
        for name, signal in record.log().items():
            np.testing.assert_allclose(log[name].values, signal.values, atol=2e-4)
            assert log[name].unit == signal.unit
        truth = read(out / "truth.parquet")
        for name, signal in record.truth().items():
            np.testing.assert_array_equal(truth[name].values, signal.values)
        assert load_vehicle(out / "vehicle.toml") == nominal_vehicle((-0.3, 0.0, 0.9))
        again = CliRunner().invoke(app, ["simulate", "motorcycle", "-o", str(out)])
        assert isinstance(again.exception, UsageError)

    def test_vehicle(self):
        vehicle, machine = nominal_vehicle(), nominal_machine()
        assert vehicle.number("imu_height") == machine.imu[2]
        assert vehicle.number("drag") == pytest.approx(0.36)
        assert vehicle.number("rear_frame_mass") == pytest.approx(machine.sharp.Mr)

    def test_all_scenarios_are_named(self):
        assert set(SCENARIOS) == {"track", "slalom", "double-lane-change"}


@pytest.mark.parametrize(("setting", "said"), [
    ({"noise": -0.05}, "noise of -5 %"), ({"bank": 0.5}, "banks by 28.6 degrees"), ({"speed_error": -1.5}, "speed error of -150 %"),
    ({"bias": 1e6}, "biases 1e"), ({"counts": -1}, "-1 counts"),
])  # fmt: skip
def test_impossible_settings_are_refused_in_the_units_of_the_command(setting, said):
    with pytest.raises(UsageError, match=said):
        RideSetting("slalom", **setting)
