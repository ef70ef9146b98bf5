"""The two-point driver: its transfer functions by another library, its steps by brute integration, what he sees by geometry."""

from __future__ import annotations

from dataclasses import replace

import control
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from codriver.models.road_sight import PathAhead, path_errors
from codriver.models.two_point import TwoPointDriver

DRIVER = TwoPointDriver()
SPEED = 50 / 3.6


class TestModel:
    @pytest.mark.parametrize("order", [1, 2])
    @pytest.mark.parametrize("delay", [0.0, 0.15])
    def test_transfer_functions(self, order, delay):
        driver = replace(DRIVER, delay=delay)
        model = driver.model(SPEED, order)
        s = control.tf("s")
        num, den = control.pade(delay, order) if delay else ([1.0], [1.0])
        late = control.tf(num, den)
        arm = 1 / (driver.muscle * s + 1)
        hold = driver.column_gain * SPEED + driver.reflex
        expected = (
            hold * late * arm * driver.compensation / SPEED * (driver.lead * s + 1) / (driver.lag * s + 1),
            hold * late * arm * driver.anticipation,
            -driver.reflex * arm,
        )
        w = 1j * np.array([0.1, 1.0, 5.0, 30.0])
        got = control.ss(model.A, model.B, model.C, model.D)
        for k, wanted in enumerate(expected):
            assert np.allclose([got(x)[0, k] for x in w], [wanted(x) for x in w], rtol=1e-9)

    def test_refusals(self):
        with pytest.raises(ValueError, match="lag is 0"):
            TwoPointDriver(lag=0.0)
        with pytest.raises(ValueError, match="delay is -1"):
            TwoPointDriver(delay=-1.0)
        with pytest.raises(ValueError, match="speed of 0"):
            DRIVER.model(0.0)
        with pytest.raises(ValueError, match="order 3"):
            DRIVER.model(SPEED, 3)
        with pytest.raises(ValueError, match="tick of 0"):
            DRIVER.tick(0.0, SPEED)


class TestTick:
    @pytest.mark.parametrize("delay", [0.0, 0.05, 0.123])
    def test_brute_integration(self, delay):
        # Inputs that run straight between ticks: the lags are solved exactly, the delay is a shift of the input.
        driver, dt, n = replace(DRIVER, delay=delay), 0.01, 120
        rng = np.random.default_rng(0)
        near, far, angle = np.cumsum(np.cumsum(rng.standard_normal((3, n)), axis=1), axis=1) * 0.001
        near[0] = far[0] = angle[0] = 0.0
        t = np.arange(n) * dt

        def of(x, at):
            return np.interp(at, t, x, left=0.0)

        # The slow part of the compensation first, on a fine grid; then the torque with the shifted wanted angle.
        def rates(now, x):
            slow_late = np.interp(now - delay, fine, slow, left=0.0)
            wanted = driver.anticipation * of(far, now - delay) + driver.compensation / SPEED * (
                driver.lead / driver.lag * of(near, now - delay) + (1 - driver.lead / driver.lag) * slow_late
            )
            return (driver.hold(SPEED) * wanted - driver.reflex * of(angle, now) - x) / driver.muscle

        fine = np.arange(0, t[-1] + 1e-9, dt / 20)
        slow = solve_ivp(
            lambda now, x: (of(near, now) - x) / driver.lag, (0, t[-1]), [0.0], t_eval=fine, max_step=dt / 4, rtol=1e-9
        ).y[0]  # fmt: skip
        brute = solve_ivp(rates, (0, t[-1]), [0.0], t_eval=t, max_step=dt / 4, rtol=1e-9, atol=1e-12).y[0]
        tick = driver.tick(dt, SPEED)
        state, torque = tick.start(), []
        for k in range(n):
            state, now = tick.advance(state, near[k], driver.anticipation * far[k], angle[k])
            torque.append(now)
        # A part of a tick's delay is made by the straight line between two wanted angles.
        assert np.allclose(torque, brute, atol=3e-4 * np.abs(brute).max())
        assert np.allclose(torque, driver.torque(near, far, angle, SPEED, dt), atol=1e-12)

    def test_motor_noise_and_gain(self):
        tick = DRIVER.tick(0.01, SPEED)
        held = tick.start()
        for _ in range(2000):
            held, torque = tick.advance(held, 0.02, 0.1, 0.3, gain=2.0, motor=0.5)
        steady = DRIVER.hold(SPEED) * (0.1 + 2 * DRIVER.compensation / SPEED * 0.02) - DRIVER.reflex * 0.3 + 0.5
        assert torque == pytest.approx(steady, abs=1e-9)

    def test_as_the_linear_model(self):
        # Slow inputs: the Pade fraction is the delay.
        dt, n = 0.01, 2000
        t = np.arange(n) * dt
        u = np.stack([0.02 * np.sin(1.1 * t), 0.05 * np.sin(0.7 * t), 0.5 * np.sin(0.9 * t)])
        model = DRIVER.model(SPEED)
        _, linear = control.forced_response(control.ss(model.A, model.B, model.C, model.D), t, u, squeeze=True)
        torque = DRIVER.torque(*u, SPEED, dt)
        assert np.allclose(torque, linear, atol=2e-3 * np.abs(linear).max())


class TestSight:
    def test_a_circle(self):
        # On a circle the chord to a point l ahead is seen at l rho / 2.
        s = np.linspace(0, 300, 4)
        path = PathAhead.of(s, np.full(4, 0.01))
        assert np.allclose(path.bend(np.array([0.0, 33.3, 120.0]), 8.0), 0.04)

    def test_a_point_in_the_plane(self):
        # The path drawn by brute force; small curvature, so that the small-angle direction is the direction.
        knots, rho = np.array([0.0, 20, 50, 90, 140]), np.array([0, 2e-4, 2e-4, -3e-4, 0])
        path = PathAhead.of(knots, rho)
        s = np.linspace(0, 140, 140001)
        heading = np.concatenate([[0], np.cumsum(np.interp(s[:-1] + 5e-4, knots, rho) * 1e-3)])
        x, y = (np.concatenate([[0], np.cumsum(f(heading[:-1]) * 1e-3)]) for f in (np.cos, np.sin))
        for at, ahead in ((0, 15), (30, 10), (47, 25), (100, 40)):
            i, k = at * 1000, (at + ahead) * 1000
            seen = np.arctan2(y[k] - y[i], x[k] - x[i]) - heading[i]
            assert path.bend(np.array([float(at)]), float(ahead))[0] == pytest.approx(seen, abs=1e-6)

    def test_beyond_the_end(self):
        path = PathAhead.of(np.array([0.0, 10.0]), np.array([0.02, 0.02]))
        assert path.bend(np.array([8.0]), 10.0)[0] == pytest.approx(0.1)

    def test_errors_of_the_path(self):
        # Straight road, sideslip constant: y = v beta t. A yaw rate r: psi = r t, y = v r t^2 / 2.
        t = np.arange(0, 2.001, 0.01)
        one = np.ones(t.size)
        y, psi = path_errors(t, 10 * one, 0 * one, 0.01 * one, 0 * one)
        assert np.allclose(y, 0.1 * t)
        assert not psi.any()
        y, psi = path_errors(t, 10 * one, 0.02 * one, 0 * one, 0.3 * one)
        assert np.allclose(psi, 0.1 * t)
        assert np.allclose(y, 0.5 * t**2)

    def test_refusals(self):
        with pytest.raises(ValueError, match="do not rise"):
            PathAhead.of(np.array([0.0, 0.0]), np.zeros(2))
        with pytest.raises(ValueError, match="must be"):
            PathAhead.of(np.zeros(3), np.zeros(2))
