"""The wheel identified: joint filters against the paper and against textbook code, Algorithm 1, the fit over the whole record."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import codriver as cd
from codriver.identify.steering_ekf import joint_ekf
from codriver.identify.steering_joint import JointSettings, joint_functions
from codriver.identify.steering_ukf import Weights, joint_ukf, ukf_weights
from codriver.models.steering import soften, steering_model, tick_of
from codriver.observers.observer import Observer
from codriver.simulate.steering import (
    Wheel,
    WheelNoise,
    WheelRuns,
    WheelSetting,
    chirp,
    simulate_wheel,
)

J, B = 0.0672, 0.3562  # eq. (82)
HALF = (0.5 * J, 0.5 * B)
DEGREE = np.pi / 180


def grid_of(runs: WheelRuns, run: int = 0) -> cd.Grid:
    there = np.ones(runs.time.size, bool)
    return cd.Grid(
        runs.time, 0.01, {"steering_wheel_angle": runs.measured[run], "steering_motor_torque": runs.torque},
        {"steering_wheel_angle": there}, {"steering_motor_torque": there},
    )  # fmt: skip


def ends(observer: Observer, runs: WheelRuns) -> tuple[np.ndarray, np.ndarray]:
    """Last J_s and b_s of each run, shape (runs, 2); mean squared normalised innovation from 1 s on, shape (runs,)."""
    program = cd.compile(observer)
    last, nis = [], []
    for run in range(runs.measured.shape[0]):
        out = program.run_grid(grid_of(runs, run))
        last.append([out["steering_inertia"][-1], out["steering_damping"][-1]])
        with np.errstate(all="ignore"):
            e = out["steering_wheel_angle_innovation"] / out["steering_wheel_angle_innovation_sd"]
            nis.append(np.mean(e[100:] ** 2))
    return np.array(last), np.array(nis)


def lost(last: np.ndarray) -> np.ndarray:
    """Runs that end further than half of the truth from it, or nowhere."""
    return ~(np.abs(last / [J, B] - 1) < 0.5).all(axis=1)


@pytest.fixture(scope="module")
def paper() -> WheelRuns:
    """The preset okamoto2019, 200 seeds."""
    return simulate_wheel(runs=200)


@pytest.fixture(scope="module")
def continuous() -> WheelRuns:
    """Process noise of 0.01 dt a tick, 200 seeds."""
    return simulate_wheel(setting=WheelSetting(noise=WheelNoise("continuous")), runs=200)


class TestModel:
    @pytest.mark.parametrize("damping", [0.3562, 1e-7, 0.0, 40.0])
    def test_exact_tick_is_the_matrix_exponential(self, damping):
        from scipy.linalg import expm

        model = steering_model(J, damping, ("driver_torque",))
        whole = expm(np.block([[model.A, model.B], [np.zeros((1, 3))]]) * 0.01)
        tick = tick_of(J, damping, 0.01)
        assert np.allclose([tick.reach, tick.keep, tick.lift, tick.push],
                           [whole[0, 1], whole[1, 1], whole[0, 2], whole[1, 2]], rtol=1e-12)  # fmt: skip

    def test_named_and_observable(self):
        model = steering_model(J, B)
        assert model.states == ("steering_wheel_angle", "steering_wheel_rate")
        assert model.inputs == ("alignment_torque", "driver_torque")
        assert all(name in cd.names.VOCABULARY for name in (*model.states, *model.inputs, *model.outputs))
        assert model.observability() == 2
        with pytest.raises(ValueError, match="must be positive"):
            steering_model(-1e-3, B)

    def test_friction_holds_a_wheel_at_rest(self):
        tick = tick_of(J, B, 0.01)
        assert tick.advance(0.3, 0.0, 0.49, 0.5) == pytest.approx((0.3, 0.0), abs=1e-15)
        assert tick.advance(0.3, 0.0, 0.51, 0.5)[1] > 0
        assert soften(np.array([-3.0, -0.5, 0.0, 2.0]), 1.0) == pytest.approx([-2, 0, 0, 1])

    def test_friction_against_an_integrator(self):
        """A slipping wheel against scipy with the friction's sign fixed."""
        from scipy.integrate import solve_ivp

        tick, x = tick_of(J, B, 0.01), (0.0, 3.0)
        for _ in range(20):
            x = tick.advance(*x, 0.2, 0.4)
        exact = solve_ivp(lambda t, x: [x[1], (0.2 - B * x[1] - 0.4) / J], (0, 0.2), [0, 3], rtol=1e-10, atol=1e-12).y
        assert x == pytest.approx(exact[:, -1], rel=1e-8)

    def test_euler_is_eq_77(self):
        tick = tick_of(J, B, 0.01, "euler")
        A = np.array([[1, 0.01], [0, 1 - B * 0.01 / J]])
        assert tick.advance(0.3, -2.0, 1.5) == pytest.approx(A @ [0.3, -2.0] + [0, 0.01 / J * 1.5])

    def test_simulated_wheel_without_noise(self):
        """Against the exact response in pieces; an end stop holds."""
        from scipy.signal import cont2discrete, dlsim

        quiet = WheelNoise(process=0.0, angle=0.0)
        torque = chirp(np.arange(801) * 0.01)
        runs = simulate_wheel(torque, WheelSetting(noise=quiet, plant="exact", start=(0.0, 0.0)))
        model = steering_model(J, B, ("driver_torque",))
        *system, dt = cont2discrete((model.A, model.B, model.C, model.D), 0.01)
        assert runs.angle[0] == pytest.approx(dlsim((*system, dt), torque)[1][:, 0], abs=1e-12)
        stopped = WheelSetting(Wheel(end_stop=0.5), quiet, "exact", (0.0, 0.0))
        held = simulate_wheel(np.full(801, 3.0), stopped)
        assert held.angle[0, -1] == pytest.approx(0.5 + 3 / 200, abs=1e-3)

    def test_a_run_is_the_same_however_many_there_are(self):
        assert np.array_equal(simulate_wheel(runs=3, seed=2).measured[1], simulate_wheel(runs=2, seed=2).measured[1])
        with pytest.raises(cd.CodriverError, match="one of step, continuous, derivative"):
            simulate_wheel(setting=WheelSetting(noise=WheelNoise("often")))


class TestJacobian:
    """J_z of eq. (79), with the right entries of (81)."""

    @pytest.mark.parametrize("z", [(0.3, 2.0, J, B), (-1.0, -4.0, 0.03, 0.9)])
    def test_entries(self, z):
        _, omega, inertia, damping = z
        u, dt = 1.3, 0.01
        found = np.array(joint_functions(dt, False)[1](z, u))
        right = np.eye(4)
        right[0, 1] = dt
        right[1, 1] -= damping * dt / inertia
        right[1, 2:] = dt * (damping * omega - u) / inertia**2, -omega * dt / inertia
        assert found == pytest.approx(right, rel=1e-14)
        printed = damping * omega / inertia - u / inertia**2  # (81) as printed, times dt
        assert abs(dt * printed - found[1, 2]) > 0.1 * abs(found[1, 2])

    def test_dual_ekf_learns_nothing_in_one_step(self):
        """Remark 4: the angle after one Euler step does not depend on J_s and b_s; after two it does."""
        import casadi as ca

        f, jacobian = joint_functions(0.01, False)
        z = ca.SX.sym("z", 4)
        H = ca.DM([[1, 0, 0, 0]])
        assert (H @ jacobian(z, 1.3)[:, 2:]).nnz() == 0 or np.all(
            np.array(ca.DM(H @ jacobian([0, 2, J, B], 1.3)))[0, 2:] == 0
        )
        twice = ca.Function("twice", [z], [H @ ca.jacobian(f(f(z, 1.3), 1.3), z)[:, 2:]])
        assert np.all(np.abs(np.array(twice([0, 2, J, B]))) > 1e-4)

    def test_dual_ekf_stays_where_it_started(self, paper):
        """A dual EKF with the one-step Jacobian of (81) leaves its parameters untouched by 1500 measurements."""
        _, jacobian = joint_functions(0.01, False)
        p, P = np.array(HALF), np.diag([8e-3, 0.1])
        x, S = np.zeros(2), np.eye(2)
        R = 0.01 * DEGREE**2
        for k in range(1, 400):
            tick = tick_of(*p, 0.01, "euler")
            whole = np.array(jacobian(np.r_[x, p], paper.torque[k - 1]))
            A, H_p = whole[:2, :2], whole[:1, 2:]
            x, S = np.array(tick.advance(*x, paper.torque[k - 1])), A @ S @ A.T + 0.01 * np.eye(2)
            e = paper.measured[0, k] - x[0]
            gain_p = P @ H_p.T / (H_p @ P @ H_p.T + S[0, 0] + R)
            p, P = p + gain_p[:, 0] * e, P + 5e-8 * np.eye(2)
            gain = S[:, 0] / (S[0, 0] + R)
            x, S = x + gain * e, S - np.outer(gain, S[0])
        assert tuple(p) == HALF


def textbook(make: str, runs: WheelRuns, settings: JointSettings) -> np.ndarray:
    """z after each tick by plain numpy, the equations as the paper has them (right weights)."""
    z, P = np.array([0, 0, *settings.guess]), np.diag(settings.start_variance)
    Q, R, H, dt = np.diag(settings.process), settings.angle, np.array([[1.0, 0, 0, 0]]), settings.dt

    def f(z, u):
        return np.array([z[0] + dt * z[1], z[1] + dt * (u - z[3] * z[1]) / z[2], z[2], z[3]])

    def points(z, P, w):
        root = w.spread * np.linalg.cholesky(P)
        return np.vstack([z, z + root.T, z - root.T])

    path = []
    for k in range(runs.time.size):
        w = ukf_weights()
        Wm = np.array([w.mean] + 8 * [w.other])
        Wc = np.array([w.covariance] + 8 * [w.other])
        if k:
            u = runs.torque[k - 1]
            if make == "ekf":
                F = np.eye(4)
                F[0, 1], F[1, 1] = dt, 1 - z[3] * dt / z[2]
                F[1, 2:] = dt * (z[3] * z[1] - u) / z[2] ** 2, -z[1] * dt / z[2]
                z, P = f(z, u), F @ P @ F.T + Q
            else:
                X = np.array([f(point, u) for point in points(z, P, w)])
                z = Wm @ X
                P = Q + (X - z).T * Wc @ (X - z)
        if make == "ekf":
            S, cross, predicted = H @ P @ H.T + R, P @ H.T, z[:1]
        else:
            X = points(z, P, w)
            Y = X[:, :1]
            predicted = Wm @ Y
            S = R + (Y - predicted).T * Wc @ (Y - predicted)
            cross = (X - z).T * Wc @ (Y - predicted)
        K = cross / S
        z, P = z + K[:, 0] * (runs.measured[0, k] - predicted[0]), P - K @ S @ K.T
        path.append(z)
    return np.array(path)


class TestJointFilters:
    @pytest.mark.parametrize(("make", "rel"), [("ekf", 1e-9), ("ukf", 1e-3)])
    def test_against_textbook_code(self, paper, make, rel):
        """The UKF with alpha = 1e-3 cancels six digits, in either code."""
        settings = JointSettings(HALF)
        out = cd.compile({"ekf": joint_ekf, "ukf": joint_ukf}[make](settings)).run_grid(grid_of(paper))
        z = np.column_stack(
            [out[n] for n in ("steering_wheel_angle", "steering_wheel_rate", "steering_inertia", "steering_damping")]
        )
        assert z[:, 2:] == pytest.approx(textbook(make, paper, settings)[:, 2:], rel=rel)

    def test_table_1(self, paper):
        """0.0654, 0.3498 by EKF; 0.0681, 0.3572 by UKF; none of 200 is lost."""
        ekf, ekf_nis = ends(joint_ekf(JointSettings(HALF)), paper)
        ukf, ukf_nis = ends(joint_ukf(JointSettings(HALF)), paper)
        assert lost(ekf).sum() == lost(ukf).sum() == 0
        assert 0.0650 <= ekf[:, 0].mean() <= 0.0658
        assert 0.3480 <= ekf[:, 1].mean() <= 0.3505
        assert 0.0678 <= ukf[:, 0].mean() <= 0.0686
        assert 0.3550 <= ukf[:, 1].mean() <= 0.3575
        # The paper's own run lies among ours.
        for found, printed in ((ekf, (0.0654, 0.3498)), (ukf, (0.0681, 0.3572))):
            assert np.all(np.abs(found.mean(axis=0) - printed) < 4 * found.std(axis=0))
        # The bias comes from a filter that expects far more noise than there is.
        assert ekf_nis.mean() < 0.01
        assert ukf_nis.mean() < 0.01

    def test_other_readings_of_the_noise(self, continuous):
        """0.01 a step loses many runs, the EKF most; 0.01 dt loses none."""
        step = simulate_wheel(setting=WheelSetting(noise=WheelNoise("step")), runs=200)
        ekf, ukf = joint_ekf(JointSettings(HALF)), joint_ukf(JointSettings(HALF))
        assert 50 <= lost(ends(ekf, step)[0]).sum() <= 100
        assert 5 <= lost(ends(ukf, step)[0]).sum() <= 30
        for observer, bias in ((ekf, (-2.8, -1.9)), (ukf, (1.3, 0.1))):
            last, _ = ends(observer, continuous)
            assert lost(last).sum() == 0
            assert 100 * (last / [J, B] - 1).mean(axis=0) == pytest.approx(bias, abs=0.6)

    def test_matched_noise(self, continuous):
        """With Q as the noise is, the EKF as printed loses runs and the UKF none, the opposite of the paper's claim."""
        matched = JointSettings(HALF, process=(1e-4, 1e-4, 5e-8, 5e-8))
        assert 20 <= lost(ends(joint_ekf(matched), continuous)[0]).sum() <= 55
        assert lost(ends(joint_ukf(matched), continuous)[0]).sum() == 0
        assert lost(ends(joint_ukf(matched, ukf_weights(alpha=1.0)), continuous)[0]).sum() > 150

    @pytest.mark.parametrize("make", [joint_ekf, joint_ukf])
    def test_log_parameters(self, continuous, make):
        """Positive all the way: none lost, innovations as large as promised, errors of the best there is."""
        still = JointSettings(HALF, process=(1e-4, 1e-4, 0.0, 0.0), keep="log")
        last, nis = ends(make(still), continuous)
        assert lost(last).sum() == 0
        assert 0.9 < nis.mean() < 1.1
        assert np.all(np.sqrt(np.mean((last / [J, B] - 1) ** 2, axis=0)) < [0.018, 0.013])

    def test_bounds(self, continuous):
        bounded = JointSettings(HALF, process=(1e-4, 1e-4, 5e-8, 5e-8), keep="bounds")
        assert lost(ends(joint_ekf(bounded), continuous)[0]).sum() == 0

    @pytest.mark.parametrize("fault", ["weights as printed", "n_x = 2"])
    def test_weights_of_the_paper_lose_every_run(self, paper, fault):
        """(64)-(65) as printed weigh the first point by 1 - 1/4e-6 + 3 in the mean; the sum is then 4, not 1."""
        right = ukf_weights()
        assert right.mean + 8 * right.other == pytest.approx(1, abs=1e-9)
        if fault == "n_x = 2":
            scale = 2e-6 + 2  # lambda + n with lambda = alpha^2 2 - 2
            wrong = Weights(scale**0.5, 1 - 4 / scale, 1 - 4 / scale + 3 - 1e-6, 0.5 / scale)
        else:
            wrong = replace(right, mean=right.covariance, covariance=right.mean)
        few = replace(paper, measured=paper.measured[:20])
        assert lost(ends(joint_ukf(JointSettings(HALF)), few)[0]).sum() == 0
        assert lost(ends(joint_ukf(JointSettings(HALF), wrong), few)[0]).all()

    def test_nees_of_the_log_filter(self, continuous):
        """Errors of angle, rate, J_s and b_s against the covariance the filter claims; 99.9 % bounds of a mean of 200."""
        from scipy.stats import chi2

        settings = JointSettings((J, B), (1.0, 0.0), process=(1e-4, 1e-4, 0.0, 0.0), keep="log")
        program = cd.compile(joint_ukf(settings))
        rng = np.random.default_rng(5)
        spread = []
        for run in range(200):
            start = (1.0 + rng.normal(), rng.normal())
            guess = tuple(np.exp(np.log([J, B]) + rng.normal(size=2) * [0.3, 0.3]))
            here = replace(
                settings, guess=guess, start=start, start_variance=(1, 1, (0.3 * guess[0]) ** 2, (0.3 * guess[1]) ** 2)
            )
            after, _ = program.advance(grid_of(continuous, run), here.carry)
            error = np.array([after[f"z_{i}"] for i in range(4)]) - [
                continuous.angle[run, -1], continuous.rate[run, -1], np.log(J), np.log(B)
            ]  # fmt: skip
            P = np.array([[after[f"P_{min(i, k)}{max(i, k)}"] for k in range(4)] for i in range(4)])
            spread.append(error @ np.linalg.solve(P, error))
        low, high = chi2.ppf([0.0005, 0.9995], 800) / 200
        assert low < np.mean(spread) < high

    def test_a_missing_angle_is_no_angle(self, paper):
        """Ticks without a measurement, NaN in their place, are passed by prediction."""
        grid = grid_of(paper)
        ok = grid.fresh["steering_wheel_angle"].copy()
        ok[400:500] = False
        values = np.where(ok, paper.measured[0], np.nan)
        holes = cd.Grid(
            grid.time, 0.01, {**grid.values, "steering_wheel_angle": values}, {"steering_wheel_angle": ok}, grid.held
        )
        out = cd.compile(joint_ekf(JointSettings(HALF))).run_grid(holes)
        assert np.all(np.isfinite(out["steering_inertia"]))
        assert out["steering_inertia"][-1] == pytest.approx(J, rel=0.05)

    def test_settings_that_cannot_be(self):
        with pytest.raises(cd.CodriverError, match="one of free, log, bounds"):
            JointSettings(HALF, keep="somehow")
        with pytest.raises(cd.CodriverError, match="positive"):
            JointSettings((-0.01, 0.3))

    def test_as_printed_in_every_language(self, paper, tmp_path):
        """Compiled code and CasADi's interpreter give the same bits."""
        from codriver.kernel.record import interpret

        observer = joint_ukf(JointSettings(HALF, keep="log"))
        recorded, carry = observer.record(), dict(observer.carry)
        out = cd.compile(observer).run_grid(grid_of(paper))
        for k in range(30):
            row = {"steering_motor_torque": paper.torque[k], "steering_wheel_angle": paper.measured[0, k]}
            new, outputs = interpret(recorded, carry, {**row, **{flag.name: 1.0 for flag in observer.flags}})
            carry = {**carry, **dict(zip(recorded.carry, new, strict=True))}
            assert outputs == [out[name][k] for name in recorded.outputs]
