"""The single-track car held against a multi-body car by others, and the two-point driver in it."""

from __future__ import annotations

import numpy as np
import pytest

from codriver.simulate.circuit_drivers import CIRCUIT_DRIVERS

pytest.importorskip("vehiclemodels")
from multi_body import MultiBody, drive_multi_body

# The multi-body car's tyres have a force at no slip whose sign follows the camber (sign(gamma) in its lateral formula), which
# adds about 1 mrad of sideslip towards the outside of either turn.
CAMBER = 2e-3


class TestSingleTrack:
    @pytest.mark.parametrize(("speed", "steer"), [(10.0, 0.03), (14.0, 0.01)])
    def test_steady_turn(self, speed, steer):
        left, right = MultiBody(speed), MultiBody(speed)
        for k in range(400):
            left.steer_to(min(steer, steer * k / 50))
            right.steer_to(-min(steer, steer * k / 50))
        car = left.single_track()
        A, B = car.model(speed).A, car.model(speed).B[:, 0]
        beta, r = np.linalg.solve(-A, B) * steer
        assert (left.yaw_rate - right.yaw_rate) / 2 == pytest.approx(r, rel=0.015)
        assert (left.sideslip - right.sideslip) / 2 == pytest.approx(beta, abs=CAMBER)

    @pytest.mark.parametrize(("frequency", "within"), [(0.25, 0.05), (0.5, 0.05), (1.0, 0.1)])
    def test_lane_change(self, frequency, within):
        # One period of a sine; lateral acceleration up to about 1.5 m/s^2.
        speed, dt, n = 14.0, 0.01, 500
        t = np.arange(n) * dt
        steer = 0.02 * np.sin(2 * np.pi * frequency * t) * (t < 1 / frequency)
        body = MultiBody(speed)
        car = body.single_track()
        beta = r = 0.0
        made = np.zeros((n, 2))
        for k in range(n):
            made[k] = body.yaw_rate, r
            after = steer[min(k + 1, n - 1)]
            body.steer_to(after, dt)
            beta, r = car.advance(beta, r, after, speed, dt)
        assert np.sqrt(np.mean((made[:, 0] - made[:, 1]) ** 2)) < within * np.sqrt(np.mean(made[:, 0] ** 2))


class TestDriver:
    @pytest.mark.slow
    def test_round_the_circuit(self):
        log = drive_multi_body(CIRCUIT_DRIVERS["anna"], 36 / 3.6, 1, "left")
        assert np.abs(log["lateral_offset"].values).max() < 1.0
        assert np.abs(log["longitudinal_speed"].values - 10).max() < 0.1
        # A whole lap to the left.
        r = log["yaw_rate"].values
        assert np.sum((r[1:] + r[:-1]) / 2) * 0.01 == pytest.approx(2 * np.pi, abs=0.1)
