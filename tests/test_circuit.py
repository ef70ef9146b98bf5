"""The closed loop on the circuit: against brute integration, closed forms, and a plan solved another way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from typer.testing import CliRunner

import codriver as cd
from codriver.cli.app import app
from codriver.errors import UsageError
from codriver.models.road_sight import PathAhead, path_errors
from codriver.models.two_point import TwoPointDriver
from codriver.simulate.circuit import CircuitSetting, _drive, simulate_circuit
from codriver.simulate.circuit_drivers import CIRCUIT_DRIVERS, circuit_driver
from codriver.simulate.circuit_files import FILES
from codriver.simulate.circuit_way import way_curvature, way_length
from codriver.simulate.predictive import Plan, plan_law
from codriver.simulate.rig import RigCar, circuit_length
from codriver.simulate.steering import Wheel
from codriver.simulate.variability import Variability, Variation, wander

SMOOTH = Wheel(0.0298, 0.3515, 0.0)
ONE_LAP = CircuitSetting(laps=1, direction="left")


def on_path(setting: CircuitSetting, path: PathAhead, n: int) -> np.ndarray:
    return _drive(setting, path, n, Variation.none(n), np.zeros(n), None)


class TestWay:
    def test_round(self):
        length = circuit_length()
        s = np.linspace(0, length, 200001)
        turned = np.trapezoid(way_curvature(s, 1, "left"), s)
        assert turned == pytest.approx(2 * np.pi, abs=1e-6)
        assert np.trapezoid(way_curvature(s, 1, "right"), s) == pytest.approx(-2 * np.pi, abs=1e-6)

    def test_both_ways(self):
        # The second half is the first one backwards, and nothing jumps where they meet.
        whole = way_length(2, "both")
        s = np.arange(0, whole, 0.1)
        rho = way_curvature(s, 2, "both")
        assert np.abs(np.diff(rho)).max() < 2e-4
        u = np.linspace(0, whole / 2 - 1e-6, 5000)
        assert np.allclose(way_curvature(whole - u, 2, "both"), -way_curvature(u, 2, "both"), atol=1e-9)

    def test_refusals(self):
        with pytest.raises(ValueError, match="direction 'up'"):
            way_curvature(np.zeros(1), 1, "up")


class TestLoop:
    def test_brute_integration(self):
        # No friction: linear, with the delay as a Pade fraction of second order.
        s = replace(ONE_LAP, wheel=SMOOTH, torque_noise=0.0, resolution=0.0)
        drive = simulate_circuit(s)
        v, car, driver = s.car.speed, s.car, s.driver
        model, plane = driver.model(v), s.single_track().model(v)
        fine = np.linspace(0, v * 60, 60001)
        path = PathAhead.of(fine, way_curvature(fine, 1, "left"))
        near, far = path.bend(fine, driver.near), path.bend(fine, driver.far * v)
        back, m = car.alignment / car.ratio, model.A.shape[0]

        def rates(t, x):
            hand, (delta, omega, beta, r, psi, y) = x[:m], x[m:]
            place = v * t
            seen = (
                np.interp(place, fine, near) - y / driver.near - psi,
                np.interp(place, fine, far) - y / (driver.far * v) - psi,
                delta,
            )
            aligned = back * (beta + car.front * r / v - delta / car.ratio)
            pushed = (hand[-1] + aligned - s.wheel.damping * omega) / s.wheel.inertia
            slid = plane.A @ [beta, r] + plane.B[:, 0] * delta / car.ratio
            rho = np.interp(place, path.distance, path.curvature)
            return np.concatenate(
                [model.A @ hand + model.B @ seen, [omega, pushed], slid, [r - v * rho, v * (psi + beta)]]
            )

        t = np.arange(0, 40, 0.5)
        brute = solve_ivp(rates, (0, 40), np.zeros(m + 6), t_eval=t, max_step=0.02, rtol=1e-7, atol=1e-9).y
        rows = np.searchsorted(drive.time, t - 1e-9)
        for mine, at, within in (
            (drive.driver_torque, m - 1, 0.01),
            (drive.angle, m, 0.01),
            (drive.offset, m + 5, 0.02),
        ):
            assert np.allclose(mine[rows], brute[at], atol=within * np.abs(brute[at]).max())

    def test_steady_turn(self):
        s = replace(ONE_LAP, wheel=SMOOTH)
        v, car, single = s.car.speed, s.car, s.single_track()
        n, rho = 3000, 0.01
        place = v * s.dt * np.arange(n + 1000)
        angle, _, torque, aligned, beta, r, y, psi, *_ = on_path(s, PathAhead.of(place, np.full(place.size, rho)), n)[
            :, -1
        ]
        assert r == pytest.approx(v * rho, rel=1e-6)
        assert psi == pytest.approx(-beta, rel=1e-6)
        steer = (single.wheelbase + single.understeer_gradient * v * v) * rho
        assert angle == pytest.approx(car.ratio * steer, rel=1e-6)
        # The front tyres bear the mass on the front axle.
        slip = single.front_mass * v * v * rho / single.front_stiffness
        assert torque == pytest.approx(car.alignment / car.ratio * slip, rel=1e-6)
        assert aligned == pytest.approx(-torque, rel=1e-6)
        # Where he sits: the wheel angle he wants is what balances his arms.
        d = s.driver
        wanted = (torque + d.reflex * angle) / d.hold(v)
        near, far = d.near * rho / 2 - y / d.near - psi, d.far * v * rho / 2 - y / (d.far * v) - psi
        assert d.anticipation * far + d.compensation / v * near == pytest.approx(wanted, rel=1e-6)

    def test_speed_and_sums(self):
        drive = simulate_circuit(ONE_LAP)
        y, psi = path_errors(
            drive.time, np.full(drive.time.size, ONE_LAP.car.speed), drive.curvature, drive.sideslip, drive.yaw_rate
        )
        assert np.abs(y - drive.offset).max() < 0.02
        assert np.abs(psi - drive.heading).max() < 1e-3

    @pytest.mark.parametrize("anticipation", ["far-point", "mpc"])
    @pytest.mark.parametrize("name", CIRCUIT_DRIVERS)
    def test_stays_on_the_road(self, name, anticipation):
        s = CircuitSetting(CIRCUIT_DRIVERS[name], Variability(), anticipation, laps=1, direction="right")
        drive = simulate_circuit(s, seed=1)
        assert 0.02 < np.std(drive.offset) < 0.5
        assert np.abs(drive.offset).max() < 2.0
        # The torque is what the tyres ask for, and no more trembling than that.
        assert 0.8 < np.std(drive.driver_torque) < 1.6

    @pytest.mark.slow
    @pytest.mark.parametrize("name", CIRCUIT_DRIVERS)
    def test_many_seeds(self, name):
        for seed in range(1):
            for speed in (30, 50):
                s = CircuitSetting(CIRCUIT_DRIVERS[name], Variability(), laps=2, car=RigCar(speed=speed / 3.6))
                assert np.std(simulate_circuit(s, seed=seed).offset) < 0.5

    def test_leaves_the_road(self):
        drowsy = replace(ONE_LAP, driver=TwoPointDriver(delay=0.8))
        with pytest.raises(UsageError, match="off the path after"):
            simulate_circuit(drowsy)

    def test_refusals(self):
        for change in ({"direction": "up"}, {"anticipation": "none"}, {"laps": 0}):
            with pytest.raises(UsageError):
                replace(ONE_LAP, **change)
        with pytest.raises(UsageError, match="driver 'zoe'"):
            circuit_driver("zoe")


class TestVariability:
    def test_wander(self):
        x = wander(np.random.default_rng(0), 400_000, 0.01, 0.5)
        assert x.std() == pytest.approx(1, abs=0.05)
        assert np.mean(x[:-50] * x[50:]) == pytest.approx(np.exp(-1), abs=0.05)

    def test_seeds(self):
        varied = replace(ONE_LAP, variability=Variability())
        one, again, other = (simulate_circuit(varied, seed=k) for k in (3, 3, 4))
        assert np.array_equal(one.driver_torque, again.driver_torque)
        assert np.array_equal(one.measured_torque, again.measured_torque)
        assert np.std(one.driver_torque - other.driver_torque) > 0.1

    def test_off(self):
        one, other = (simulate_circuit(ONE_LAP, seed=k) for k in (3, 4))
        assert np.array_equal(one.driver_torque, other.driver_torque)
        none = Variability(drift=0, near=0, far=0, motor=0, floor=0)
        assert np.allclose(
            simulate_circuit(replace(ONE_LAP, variability=none)).driver_torque, one.driver_torque, atol=1e-12
        )

    def test_refusal(self):
        with pytest.raises(ValueError, match="drift_time is 0"):
            Variability(drift_time=0)


class TestPlan:
    def test_brute_force(self):
        # The same cost as least squares over rollouts by scipy, without the matrices of the plan.
        plan, s = Plan(horizon=0.8, step=0.1), ONE_LAP
        v, car = s.car.speed, s.single_track()
        law = plan_law(car, v, plan)
        rng = np.random.default_rng(5)
        x0, rho = rng.standard_normal(4) * [0.02, 0.1, 0.05, 0.3], 0.01 * rng.standard_normal(9)
        plane = car.model(v)

        def costs(angles):
            rows, x = [], x0
            for i, d in enumerate(angles):

                def rates(t, z, d=d, i=i):
                    bent = rho[i] + (rho[i + 1] - rho[i]) * t / 0.1
                    return [*(plane.A @ z[:2] + plane.B[:, 0] * d), z[1] - v * bent, v * (z[2] + z[0])]  # fmt: skip

                x = solve_ivp(rates, (0, 0.1), x, rtol=1e-9, atol=1e-11).y[:, -1]
                rows += [x[3] / plan.offset, (x[2] + x[0]) / plan.course]
            return np.array([*rows, *(np.diff(angles) / plan.change)])

        zero = costs(np.zeros(8))
        columns = np.array([costs(row) - zero for row in np.eye(8)]).T
        best = np.linalg.lstsq(columns, -zero, rcond=None)[0]
        assert law.state @ x0 + law.ahead @ rho == pytest.approx(best[0], rel=1e-4)

    def test_steady_circle(self):
        # A long plan on a circle, the car on it: the first angle is that of the steady turn.
        s = ONE_LAP
        v, car, rho = s.car.speed, s.single_track(), 0.01
        law = plan_law(car, v, Plan(horizon=4.0))
        steer = (car.wheelbase + car.understeer_gradient * v * v) * rho
        beta = np.linalg.solve(-car.model(v).A, car.model(v).B[:, 0])[0] * steer
        assert law.state @ [beta, v * rho, -beta, 0] + law.ahead.sum() * rho == pytest.approx(steer, rel=1e-6)


class TestFiles:
    def test_written_and_read(self, tmp_path):
        out = tmp_path / "laps"
        said = CliRunner().invoke(
            app, ["simulate", "circuit", "-o", str(out), "--driver", "ben", "--laps", "1", "--seed", "2"]
        )
        assert said.exit_code == 0, said.output
        assert sorted(p.name for p in out.iterdir()) == sorted(FILES)
        log = cd.read(out / "drive.csv", names=out / "names.toml")
        drive = simulate_circuit(CircuitSetting(circuit_driver("ben"), Variability(), laps=1), seed=2)
        made = drive.log()
        for name, within in (
            ("driver_torque", 1e-4),
            ("steering_wheel_angle", 1e-5),
            ("road_curvature", 1e-7),
            ("lateral_offset", 1e-5),
        ):
            assert np.allclose(log[name].values, made[name].values, atol=within)
        truth = cd.read(out / "truth.parquet")
        assert np.allclose(truth["driver_torque"].values, drive.driver_torque)
        again = CliRunner().invoke(app, ["simulate", "circuit", "-o", str(out)])
        assert isinstance(again.exception, UsageError)
        assert "earlier simulation" in again.exception.found

    def test_refusals(self, tmp_path):
        for words in (["--driver", "zoe"], ["--speed", "300"], ["--direction", "up"], ["--anticipation", "no"]):
            said = CliRunner().invoke(app, ["simulate", "circuit", "-o", str(tmp_path / "x"), *words])
            assert isinstance(said.exception, UsageError)
            assert words[1] in said.exception.found
            assert not (tmp_path / "x").exists()
