"""Rides of the nonlinear motorcycle: steady turning against closed form, stable manoeuvres, sensors."""

from __future__ import annotations

from dataclasses import replace
from math import cos, pi, sin, tan

import numpy as np
import pytest
from scipy.optimize import brentq

import codriver as cd
from codriver.errors import UsageError
from codriver.models import MotorcycleParameters
from codriver.simulate.motorcycle import (
    FRONT_TYRE,
    IDEAL,
    INPUTS,
    REAR_TYRE,
    Machine,
    MachineParameters,
    Rider,
    RideSensors,
    double_lane_change,
    ramp,
    relative_noise,
    ride,
    sense,
    slalom,
    straight,
)  # fmt: skip

KMH = 1 / 3.6


def steady(value: float):
    return ramp(value, value, 0.0, 1.0)


@pytest.fixture(scope="module")
def parameters() -> MachineParameters:
    return MachineParameters(MotorcycleParameters.from_vehicle(cd.load_vehicle("sharp1971")))


@pytest.fixture(scope="module")
def machine(parameters) -> Machine:
    return Machine(parameters)


def turning(machine: Machine, lean: float, speed: float = 20.0):
    return ride(Rider(machine, straight(), steady(speed), lean=lambda _t: lean), 5.0)


@pytest.fixture(scope="module")
def turn(machine):
    return turning(machine, 0.5)


@pytest.fixture(scope="module")
def lane_change(machine):
    return ride(Rider(machine, double_lane_change(3.5, 70.0, 40.0), steady(100 * KMH)), 7.5)


def closed_form(machine: Machine, speed: float, yaw_rate: float) -> float:
    """Roll of a rigid machine in a steady turn to the right: moments about the line through the contacts.

    m g (H - rho) sin = m v r (rho + (H - rho) cos) + sum(i_w / R_w) v r cos;  inertia terms in r^2 left out.
    """
    p, m = machine.parameters.sharp, machine.parameters
    j = (p.a + p.e) * sin(p.eps) + p.f * cos(p.eps)
    height = (p.Mf * j + p.Mr * p.h) / p.mass
    share = m.loads[0] / sum(m.loads)
    rho = share * m.front.crown + (1 - share) * m.rear.crown
    spin = p.ify / p.Rf + p.iry / p.Rr

    def moment(roll: float) -> float:
        arm = (height - rho) * sin(roll)
        up = rho + (height - rho) * cos(roll)
        return p.mass * p.g * arm - p.mass * speed * yaw_rate * up - spin * speed * yaw_rate * cos(roll)

    return brentq(moment, 0.0, 1.4)


class TestSteadyTurn:
    def test_it_is_steady(self, turn):
        last = turn.of("roll")[-1000:]
        assert np.ptp(last) < 1e-3

    @pytest.mark.parametrize("lean", [0.2, 0.5])
    def test_lean_against_closed_form(self, machine, turn, lean):
        done = turn if lean == 0.5 else turning(machine, lean)
        speed, rate, roll = done.speed[-1], -done.of("yaw_rate")[-1], done.of("roll")[-1]
        expected = closed_form(machine, speed, rate)
        assert roll == pytest.approx(expected, rel=2e-3)
        # a point mass on thin tyres leans clearly less: the correction is not lost in the tolerance
        assert expected / np.arctan(speed * rate / machine.parameters.sharp.g) > 1.06

    @pytest.mark.slow
    def test_thin_tyres_lean_less(self, parameters, turn):
        thin = replace(parameters, front=replace(FRONT_TYRE, crown=0.0), rear=replace(REAR_TYRE, crown=0.0))
        machine = Machine(thin)
        done = turning(machine, 0.5)
        speed, rate, roll = done.speed[-1], -done.of("yaw_rate")[-1], done.of("roll")[-1]
        assert roll == pytest.approx(closed_form(machine, speed, rate), rel=5e-3)
        assert tan(roll) / (speed * rate) < tan(turn.of("roll")[-1]) / (turn.speed[-1] * -turn.of("yaw_rate")[-1])

    def test_loads_carry_the_weight(self, machine, turn):
        p = machine.parameters.sharp
        assert turn.of("front_load")[-1] + turn.of("rear_load")[-1] == pytest.approx(p.mass * p.g, rel=2e-3)


class TestManoeuvres:
    def test_double_lane_change(self, lane_change):
        assert 0.15 < np.abs(lane_change.of("roll")).max() < 0.4
        assert np.abs(lane_change.offset).max() < 0.4
        assert np.abs(lane_change.speed - 100 * KMH).max() < 0.5
        assert np.abs(lane_change.of("rider_torque")).max() < 60

    @pytest.mark.slow
    def test_slalom_while_accelerating(self, machine):
        done = ride(Rider(machine, slalom(1.5, 100.0), ramp(50 * KMH, 100 * KMH, 2.0, 14.0)), 16.0)
        assert np.abs(done.offset).max() < 0.7
        assert 0.3 < np.abs(done.of("roll")).max() < 0.6
        assert done.speed[-1] == pytest.approx(100 * KMH, abs=0.6)

    @pytest.mark.slow
    def test_mirrored(self, machine, lane_change):
        done = ride(Rider(machine, double_lane_change(-3.5, 70.0, 40.0), steady(100 * KMH)), 4.0)
        n = len(done.time)
        np.testing.assert_allclose(done.of("roll"), -lane_change.of("roll")[:n], atol=1e-6)
        np.testing.assert_allclose(done.of("front_load"), lane_change.of("front_load")[:n], atol=1e-3)

    @pytest.mark.slow
    def test_bank(self, machine):
        """Straight on along a slope to the right: the tyres hold the weight's part along it, and the machine stands upright."""
        bank = 0.05
        done = ride(Rider(machine, straight(), steady(20.0)), 10.0, bank=lambda _t: bank)
        p = machine.parameters.sharp
        side = done.of("front_lateral_force")[-1] + done.of("rear_lateral_force")[-1]
        assert side == pytest.approx(p.mass * p.g * sin(bank), rel=0.02)
        # from the vertical upright, but for the crown: more from the road's normal
        assert -1.25 * bank < done.of("roll")[-1] < -bank

    def test_who_asks_too_much_falls(self, machine):
        with pytest.raises(UsageError, match="fell"):
            ride(Rider(machine, straight(), steady(15.0), lean=lambda _t: 1.5, steepest=1.5), 5.0)


class TestSensors:
    def test_at_rest_on_its_wheels_it_feels_gravity(self, machine):
        force = machine.output(machine.upright(0.0), np.zeros(len(INPUTS)))[3:6]
        np.testing.assert_allclose(force, [0, 0, machine.parameters.sharp.g], atol=1e-6)

    def test_gyro_is_the_turn_of_the_frame(self, lane_change):
        """From yaw, roll and pitch rates by hand, at a roll of up to 15 degrees."""
        roll, pitch = lane_change.of("roll"), lane_change.of("pitch")
        yaw_rate, roll_rate, pitch_rate = (lane_change.of(f"{name}_rate") for name in ("yaw", "roll", "pitch"))
        left = pitch_rate + yaw_rate * np.sin(roll)
        ahead = roll_rate * np.cos(pitch) - yaw_rate * np.cos(roll) * np.sin(pitch)
        np.testing.assert_allclose(lane_change.of("body_pitch_rate"), left, atol=1e-9)
        np.testing.assert_allclose(lane_change.of("body_roll_rate"), ahead, atol=1e-9)

    def test_accelerometer_at_the_offset_in_a_steady_turn(self, machine, turn):
        """Centripetal force by the radius of the IMU's own circle, turned into the leaning frame."""
        p, g = machine.parameters, machine.parameters.sharp.g
        roll, pitch, yaw = (turn.of(name)[-1] for name in ("roll", "pitch", "yaw"))
        rate = turn.of("yaw_rate")[-1]
        ca, sa, cr, sr, cp, sp = cos(yaw), sin(yaw), cos(roll), sin(roll), cos(pitch), sin(pitch)
        to_world = (
            np.array([[ca, -sa, 0], [sa, ca, 0], [0, 0, 1]])
            @ np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
            @ np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
        )
        arm = to_world @ (np.array(p.imu) - [0, 0, p.sharp.h])
        spin = np.array([0, 0, rate])
        velocity = np.array([turn.of("x_rate")[-1], turn.of("y_rate")[-1], 0.0]) + np.cross(spin, arm)
        expected = to_world.T @ (np.cross(spin, velocity) + np.array([0, 0, g]))
        measured = [turn.of(f"force_{axis}")[-1] for axis in "xyz"]
        np.testing.assert_allclose(measured, expected, atol=0.03)

    def test_noise_bias_and_counts(self, lane_change):
        kind = RideSensors(gyro_bias=(0.01, 0, 0), accelerometer_bias=(0, 0.2, 0), counts=1024, speed_scale=1.02)
        clean, dirty = sense(lane_change, IDEAL), sense(lane_change, kind)
        np.testing.assert_array_equal(clean["body_roll_rate"], lane_change.of("body_roll_rate"))
        error = dirty["body_roll_rate"] - clean["body_roll_rate"]
        assert error.mean() == pytest.approx(0.01, abs=3e-4)
        assert error.std() == pytest.approx(kind.gyro_noise, rel=0.05)
        assert (dirty["force_y"] - clean["force_y"]).mean() == pytest.approx(0.2, abs=5e-3)
        counts = dirty["steer_angle"] * 1024 / (2 * pi)
        np.testing.assert_allclose(counts, np.round(counts), atol=1e-9)
        assert np.abs(dirty["steer_angle"] - clean["steer_angle"]).max() <= pi / 1024 + 1e-12
        assert (dirty["speed"] / clean["speed"]).mean() == pytest.approx(1.02, abs=1e-3)

    def test_relative_noise(self, lane_change):
        kind = relative_noise(lane_change, 0.075)
        rms = np.sqrt(np.mean(lane_change.of("body_roll_rate") ** 2))
        assert kind.gyro_noise == pytest.approx(0.075 * rms, rel=1e-9)  # rolls most
        again = sense(lane_change, kind, seed=3)
        np.testing.assert_array_equal(again["force_y"], sense(lane_change, kind, seed=3)["force_y"])
