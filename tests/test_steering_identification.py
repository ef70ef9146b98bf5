"""The wheel identified: joint filters against the paper and against textbook code, Algorithm 1, the fit over the whole record."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

import codriver as cd
from codriver.identify.steering_ekf import joint_ekf
from codriver.identify.steering_fit import fit_wheel
from codriver.identify.steering_joint import JointSettings, joint_functions
from codriver.identify.steering_likelihood import STEPS, Rows, derivatives, run_wheel, simulate
from codriver.identify.steering_passes import algorithm_1
from codriver.identify.steering_record import mend_angle
from codriver.identify.steering_ukf import Weights, joint_ukf, ukf_weights
from codriver.identify.steering_wheel import identify_steering_wheel
from codriver.identify.torque_scale import identify_torque_scale
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
from conftest import recording

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
        # One run is computed in plain numbers.
        for wheel in (Wheel(), Wheel(friction=0.5), Wheel(friction=0.2, end_stop=0.3)):
            setting = replace(REAL, wheel=wheel)
            alone, among = (simulate_wheel(CHIRP[:300], setting, runs=runs, seed=2) for runs in (1, 3))
            for name in ("angle", "rate", "measured"):
                assert np.array_equal(getattr(alone, name)[0], getattr(among, name)[0])
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


def rows_of(runs: WheelRuns, run: int = 0, form: str = "exact") -> Rows:
    n = runs.time.size
    return Rows(0.01, runs.time, runs.torque, runs.measured[run], np.ones(n, bool), np.zeros(n, bool), form)


TIME = np.arange(1501) * 0.01
CHIRP = chirp(TIME, low=0.3, high=4.0)
REAL = WheelSetting(
    Wheel(friction=0.5), WheelNoise(resolution=0.1 * DEGREE), "exact", (0.0, 0.0)
)  # a wheel with friction and an encoder of 0.1 degree


@pytest.fixture(scope="module")
def real() -> cd.Log:
    return simulate_wheel(CHIRP, REAL).log()


def with_angle(log: cd.Log, values: np.ndarray) -> cd.Log:
    return log.with_signals(cd.Signal("steering_wheel_angle", log["steering_wheel_angle"].time, values, "rad"))


def with_torque(log: cd.Log, values: np.ndarray, late: float = 0.0) -> cd.Log:
    return log.with_signals(cd.Signal("steering_motor_torque", log["steering_motor_torque"].time - late, values, "N*m"))


def is_right(fit, J_share: float = 0.02, b_share: float = 0.02) -> bool:
    found = fit.coefficients
    return bool(abs(found["J_s"].value / J - 1) < J_share and abs(found["b_s"].value / B - 1) < b_share)


class TestLikelihood:
    def test_against_statsmodels(self, paper):
        """Without friction the filter is a Kalman filter: statsmodels agrees on innovations and likelihood."""
        from statsmodels.tsa.statespace.kalman_filter import KalmanFilter

        rows = rows_of(paper)
        theta = np.array([np.log(J), np.log(B), 0.0, 0.3, np.log(1e-6), np.log(1e-4), np.log(3e-6)])
        run = run_wheel(rows, theta)
        tick = tick_of(J, B, 0.01)
        other = KalmanFilter(1, 2, initialization="known", initial_state=[rows.angle[0], 0.0],
                             initial_state_cov=np.diag([3e-6, 25.0]), loglikelihood_burn=1)  # fmt: skip
        F = np.array([[1, tick.reach], [0, tick.keep]])
        # It starts from the prediction of the second tick.
        u = np.outer([tick.lift, tick.push], rows.torque + 0.3)
        other.bind(np.ascontiguousarray(rows.angle[1:, None]))
        other["design"], other["transition"], other["selection"] = np.array([[1.0, 0]]), F, np.eye(2)
        other["state_cov"], other["obs_cov"] = np.diag([1e-6, 1e-4]), np.array([[3e-6]])
        other["state_intercept"] = u[:, 1:]
        Q = np.diag([1e-6, 1e-4])
        other.initialize_known(F @ [rows.angle[0], 0.0] + u[:, 0], F @ np.diag([3e-6, 25.0]) @ F.T + Q)
        other.loglikelihood_burn = 0
        found = other.filter()
        assert run.e[1:] == pytest.approx(found.forecasts_error[0], rel=1e-7, abs=1e-12)
        assert run.s[1:] == pytest.approx(found.forecasts_error_cov[0, 0], rel=1e-7)
        assert run.log_likelihood == pytest.approx(found.llf_obs.sum(), rel=1e-9)

    def test_information_against_the_curvature(self, real):
        """The covariance of the search is the inverse of log L's second derivatives, about."""
        rows = rows_of(simulate_wheel(CHIRP, replace(REAL, wheel=Wheel())))
        best = fit_wheel(rows)
        steps = [1e-3, 1e-3]
        curvature = np.empty((2, 2))
        for i, k in itertools.product(range(2), repeat=2):
            at = []
            for a, b in itertools.product((1, -1), repeat=2):
                theta = best.theta.copy()
                theta[i] += a * steps[i]
                theta[k] += b * steps[k]
                at.append(a * b * run_wheel(rows, theta).log_likelihood)
            curvature[i, k] = sum(at) / (4 * steps[i] * steps[k])
        size = np.sqrt(np.diag(best.covariance)[:2])
        assert best.covariance[:2, :2] / np.outer(size, size) == pytest.approx(
            np.linalg.inv(-curvature) / np.outer(size, size), abs=0.1
        )

    @pytest.mark.parametrize("friction", [0.0, 0.05])
    def test_two_filters_abreast_give_the_bits_of_each(self, continuous, friction):
        rows = replace(rows_of(continuous), fresh=np.arange(continuous.time.size) % 7 > 0)
        rows.reset[400] = True
        theta, free = np.array([np.log(J), np.log(B), friction, 0.01, *np.log([1e-9, 1e-6, 1e-6])]), [0, 2, 5]
        by_e, by_s = derivatives(rows, theta, free)
        for column, i in enumerate(free):
            step = STEPS[i] * (np.arange(7) == i)
            up, down = run_wheel(rows, theta + step), run_wheel(rows, theta - step)
            assert np.array_equal(by_e[:, column], (up.e - down.e) / (2 * STEPS[i]))
            assert np.array_equal(by_s[:, column], (up.s - down.s) / (2 * STEPS[i]))
        assert np.abs(by_e).max(axis=0).min() > 0

    def test_simulation_is_the_filter_without_measurements(self, real):
        quiet = WheelNoise(process=0.0, angle=0.0)
        for wheel, off in ((Wheel(), 1e-9), (Wheel(friction=0.5), 0.01)):
            # With friction the simulator takes finer steps.
            rows = rows_of(simulate_wheel(CHIRP, replace(REAL, wheel=wheel, noise=quiet)))
            theta = np.array([np.log(J), np.log(B), wheel.friction, 0.0, -20.0, -20.0, -20.0])
            assert simulate(rows, theta, 0, (0.0, 0.0)) == pytest.approx(rows.angle, abs=off)
            part = simulate(rows, theta, 20, (0.1, -2.0), 50)
            assert np.array_equal(part, simulate(rows, theta, 20, (0.1, -2.0))[:50])

    def test_looking_ahead_simulates_each_tick_once(self):
        from unittest.mock import patch

        ticks = []

        def counted(*given):
            ticks.append(simulate(*given).size)
            return np.zeros(ticks[-1])

        log = simulate_wheel(CHIRP, REAL).log()
        with patch("codriver.identify.steering_wheel.simulate", counted):
            identify_steering_wheel(log, filters=False)
        assert 0.5 * CHIRP.size < sum(ticks) <= CHIRP.size


class TestFit:
    @pytest.mark.parametrize("guess", [HALF, (3 * J, 0.3 * B), None])
    def test_any_start_leads_to_the_same(self, continuous, guess):
        best = fit_wheel(rows_of(continuous, 3, "euler"), guess)
        assert best.converged
        reference = fit_wheel(rows_of(continuous, 3, "euler"), (J, B))
        assert best.theta[:2] == pytest.approx(reference.theta[:2], abs=2e-4)

    @pytest.mark.slow
    @pytest.mark.parametrize(("reading", "plant", "most"), [
        ("derivative", "euler", (0.002, 0.002)), ("continuous", "euler", (0.018, 0.013)),
        ("derivative", "exact", (0.002, 0.002)), ("continuous", "exact", (0.018, 0.013)),
    ])  # fmt: skip
    def test_many_seeds(self, reading, plant, most):
        """None is lost from half of the truth; errors, their standard errors, and innovations of records not fitted on."""
        count = 200 if plant == "euler" else 50
        runs = simulate_wheel(setting=WheelSetting(noise=WheelNoise(reading), plant=plant), runs=count)
        fits = [fit_wheel(rows_of(runs, run, plant), HALF) for run in range(count)]
        found = np.exp([fit.theta[:2] for fit in fits])
        error = found / [J, B] - 1
        assert lost(found).sum() == 0
        assert np.all(np.sqrt(np.mean(error**2, axis=0)) < most)
        z = np.array(
            [[error[k, i] / fit.sd(name) for i, name in enumerate(("ln_J", "ln_b"))] for k, fit in enumerate(fits)]
        )
        assert np.all((z.std(axis=0) > 0.75) & (z.std(axis=0) < 1.15))
        nis = [run_wheel(rows_of(runs, (run + 1) % count, plant), fit.theta).nis for run, fit in enumerate(fits)]
        assert 0.9 < np.mean(nis) < 1.1
        assert np.mean([0.9 < fit.run.nis < 1.1 for fit in fits]) == 1

    @pytest.mark.slow
    def test_friction(self):
        """Left out it makes b_s far too large; in the model all three are right, within standard errors and half a per cent.

        The simulator turns round in finer steps than the model does, as real wheels do.
        """
        runs = simulate_wheel(CHIRP, REAL, runs=8)
        without = fit_wheel(rows_of(runs))
        assert np.exp(without.theta[1]) > 1.4 * B
        truth, error, z = np.array([np.log(J), np.log(B), 0.5]), [], []
        for run in range(8):
            best = fit_wheel(rows_of(runs, run), friction=True)
            error.append(best.theta[:3] - truth)
            z.append(error[-1] / [best.sd(name) for name in ("ln_J", "ln_b", "T_c")])
        assert np.all(np.abs(np.mean(error, axis=0)) < 0.005)
        assert np.sqrt(np.mean(np.square(z))) < 2

    def test_speed(self, paper):
        """Cost counted: filter runs of one fit."""
        from unittest.mock import patch

        from codriver.identify import steering_fit, steering_likelihood

        one, two = (
            patch.object(steering_likelihood, name, wraps=getattr(steering_likelihood, name))
            for name in ("_program", "_pair")
        )
        with one as ran, two as ran_two:
            steering_fit.fit_wheel(rows_of(paper, 0, "euler"), HALF)
        assert ran_two.call_count > 0
        assert ran.call_count + 2 * ran_two.call_count < 2000


class TestAlgorithm1:
    def test_restarts(self, continuous):
        """A filter that loses 36 of 200 runs finds the wheel by restarts; every pass says why it was not the last."""
        settings = JointSettings(HALF, process=(1e-4, 1e-4, 5e-8, 5e-8))
        first = lost(ends(joint_ekf(settings), continuous)[0])
        assert first.sum() > 20
        results = [algorithm_1(grid_of(continuous, run), settings) for run in np.flatnonzero(first)[:15]]
        assert all(len(result.passes) > 1 for result in results)
        assert all(p.why_not for result in results for p in result.passes[:-1])
        found = np.array([result.values for result in results if result.converged])
        assert len(found) == 15
        assert not lost(found).any()

    def test_negative_inertia_is_told(self, continuous):
        settings = JointSettings(HALF, process=(1e-4, 1e-4, 5e-8, 5e-8))
        bad = int(np.flatnonzero(lost(ends(joint_ekf(settings), continuous)[0]))[0])
        told = algorithm_1(grid_of(continuous, bad), settings).passes[0]
        assert told.lost
        assert "not positive, or not finite, at" in told.why_not

    def test_first_pass_is_the_filter(self, paper):
        result = algorithm_1(grid_of(paper), JointSettings(HALF), joint_ukf)
        assert result.converged
        assert len(result.passes) == 1
        few = replace(paper, measured=paper.measured[:1])
        assert result.values == pytest.approx(ends(joint_ukf(JointSettings(HALF)), few)[0][0])

    def test_gives_up(self):
        """A wheel that does not turn: no pass converges, and it ends."""
        time = np.arange(500) * 0.01
        still = WheelRuns(time, np.zeros(500), np.zeros((1, 500)), np.zeros((1, 500)), np.zeros((1, 500)))
        result = algorithm_1(grid_of(still), JointSettings(HALF))
        assert not result.converged
        assert result.passes[-1].why_not


class TestRecording:
    """`identify_steering_wheel` on recordings as they come: right, or told."""

    def test_a_clean_one(self, real):
        fit = identify_steering_wheel(real)
        assert is_right(fit)
        assert fit.coefficients["T_c"].value == pytest.approx(0.5, abs=0.02)
        assert fit.refused == ()
        assert {f.severity for f in fit.findings} == {"ok"}
        assert [p.name for p in fit.filters] == ["joint-ekf", "joint-ukf"]
        assert fit.r2 > 0.99

    def test_preset(self, paper):
        fit = identify_steering_wheel(paper.log(), preset="okamoto2019", guess=HALF)
        assert is_right(fit, 0.005, 0.005)
        assert "T_c" not in fit.coefficients
        assert fit.filters[0].values == pytest.approx((0.0654, 0.3498), rel=0.05)

    def test_degrees_on_the_wire(self, real, tmp_path):
        """A CSV with degrees gives the same wheel."""
        angle, torque = real["steering_wheel_angle"], real["steering_motor_torque"]
        path = tmp_path / "wheel.csv"
        rows = [
            f"{t:.2f},{a / DEGREE:.1f},{u:.5f}" for t, a, u in zip(angle.time, angle.values, torque.values, strict=True)
        ]
        path.write_text("\n".join(["time [s],steering_wheel_angle [deg],steering_motor_torque [N*m]", *rows]) + "\n")
        fit = identify_steering_wheel(cd.read(path), filters=False)
        assert is_right(fit)

    @pytest.mark.slow
    def test_encoder_jumps_and_spikes(self, real):
        values = real["steering_wheel_angle"].values.copy()
        values[600:] += 0.3
        values[1000:] -= 0.05
        values[300] += 1.0
        fit = identify_steering_wheel(with_angle(real, values), filters=False)
        assert is_right(fit)
        told = " ".join(f.text for f in fit.findings)
        assert "1 single samples of the angle are spikes" in told
        assert "2 moments fit no motion of the wheel" in told

    def test_wrapped_angle(self, real):
        whole = real["steering_wheel_angle"].values * 8
        wrapped = (whole + np.pi) % (2 * np.pi) - np.pi
        mended, jumps, findings = mend_angle(with_angle(real, wrapped)["steering_wheel_angle"])
        turns = (mended.values - whole) / (2 * np.pi)
        assert np.allclose(turns, turns[0])
        assert jumps.size == 0
        assert "wraps" in findings[0].text

    @pytest.mark.slow
    def test_end_stops(self):
        setting = replace(REAL, wheel=Wheel(friction=0.5, end_stop=1.0))
        fit = identify_steering_wheel(simulate_wheel(3 * CHIRP, setting).log(), filters=False)
        assert is_right(fit)
        assert len(fit.end_stops) == 2
        assert all(abs(abs(stop) - 1.0) < 0.25 for stop in fit.end_stops)
        assert sum("stopped at" in f.text for f in fit.findings) == 2

    def test_end_stop_by_hand(self):
        setting = replace(REAL, wheel=Wheel(friction=0.5, end_stop=1.0))
        fit = identify_steering_wheel(simulate_wheel(3 * CHIRP, setting).log(), end_stop=0.98, filters=False)
        assert is_right(fit)
        assert fit.left_out > 0.2

    @pytest.mark.slow
    def test_saturated_angle(self, real):
        values = np.clip(real["steering_wheel_angle"].values, -0.5, 2.0)
        fit = identify_steering_wheel(with_angle(real, values), filters=False)
        assert is_right(fit, 0.05, 0.05)
        assert any("rests at its greatest" in f.text for f in fit.findings)
        with pytest.raises(cd.CodriverError, match="usable"):
            identify_steering_wheel(with_angle(real, np.clip(values, -0.2, 0.02)))

    def test_late_torque(self, real):
        fit = identify_steering_wheel(with_torque(real, real["steering_motor_torque"].values, 0.05), filters=False)
        assert fit.delay == pytest.approx(0.05)
        assert is_right(fit)
        assert any("50 ms late" in f.text for f in fit.findings)

    def test_constant_torque(self):
        log = simulate_wheel(CHIRP + 0.2, REAL).log()
        fit = identify_steering_wheel(with_torque(log, CHIRP), filters=False)
        assert fit.coefficients["T_0"].value == pytest.approx(0.2, abs=0.01)
        assert is_right(fit)

    @pytest.mark.slow
    def test_wrong_sign_is_refused(self, real):
        fit = identify_steering_wheel(with_torque(real, -CHIRP), filters=False)
        assert not fit.coefficients
        with pytest.raises(cd.CodriverError, match="something else turns the wheel"):
            fit.vehicle()

    def test_hands_on_the_wheel(self):
        hands = np.convolve(np.random.default_rng(1).standard_normal(TIME.size), np.ones(60) / 60, "same") * 8
        log = simulate_wheel(CHIRP + hands, REAL).log()
        fit = identify_steering_wheel(with_torque(log, CHIRP), filters=False)
        assert not fit.coefficients
        assert any("hands on the wheel" in f.text for f in fit.findings)

    def test_slow_record_does_not_tell_the_inertia(self):
        """0.1 N m at 0.1 rad/s: b_s is told, J_s is refused with its share of the torque."""
        setting = replace(REAL, wheel=Wheel(), noise=WheelNoise())
        fit = identify_steering_wheel(
            simulate_wheel(0.1 * np.sin(0.1 * np.arange(3001) * 0.01), setting).log(), filters=False
        )
        assert [r.name for r in fit.refused] == ["J_s"]
        assert "hardly accelerates" in fit.refused[0].reason
        assert fit.coefficients["b_s"].value == pytest.approx(B, rel=0.05)
        assert "steering_inertia" not in fit.vehicle()

    @pytest.mark.slow
    def test_stuck_wheel_is_refused(self):
        fit = identify_steering_wheel(simulate_wheel(0.4 * np.sin(0.3 * TIME), REAL).log(), filters=False)
        assert not fit.coefficients

    @pytest.mark.parametrize(("change", "said"), [
        (lambda log: with_torque(log, 0 * CHIRP), "tells b_s / J_s alone"),
        (lambda log: with_angle(log, 0 * TIME), "usable|turns by"),
        (lambda log: log.between(0, 2), "at least 3 s"),
        (lambda log: log.without("steering_motor_torque"), "lacks steering_motor_torque or steering_motor_command"),
    ])  # fmt: skip
    def test_records_that_say_nothing(self, real, change, said):
        with pytest.raises(cd.CodriverError, match=said):
            identify_steering_wheel(change(real))

    def test_commands_need_a_scale(self, real):
        command = cd.Signal("steering_motor_command", TIME, (CHIRP - 0.2197) / 1.8615, "1")
        log = real.without("steering_motor_torque").with_signals(command)
        with pytest.raises(cd.CodriverError, match="no torque_scale"):
            identify_steering_wheel(log)
        scaled = identify_torque_scale(
            np.array([0.0, 1, 2, 3]), (1.8615 * np.arange(4) + 0.2197) / 9.81 / 0.14
        ).vehicle()
        fit = identify_steering_wheel(log, scaled, filters=False)
        assert is_right(fit)
        assert fit.vehicle(scaled).number("torque_scale") == pytest.approx(1.8615)

    def test_options_that_cannot_be(self, real):
        for options in ({"preset": "other"}, {"guess": (-1.0, 1.0)}, {"delay": -0.1}, {"end_stop": 0.0}):
            with pytest.raises(cd.CodriverError):
                identify_steering_wheel(real, **options)


@pytest.mark.slow
def test_a_car_on_the_road_is_refused(tmp_path):
    """The driver's torque alone does not turn a car's wheel: the tyres and the assist motor are missing."""
    names = tmp_path / "names.toml"
    tables = (
        '[steering_wheel_angle]\nsource = "angle"\nunit = "rad"\n',
        '[steering_wheel_torque]\nsource = "torque"\nunit = "N*m"\n',
    )
    names.write_text("".join(tables))
    log = cd.read(recording("udacity-lincoln-mkz") / "hmb1-20hz.csv", names=names)
    fit = identify_steering_wheel(log, torques=["steering_wheel_torque"], filters=False)
    assert not fit.coefficients
    assert fit.findings[0].severity == "bad"


class TestTorqueScale:
    def test_against_scipy(self):
        from scipy.stats import linregress

        rng = np.random.default_rng(3)
        mass = np.array([-2.0, -1, -0.5, 0.5, 1, 1.5, 2, 2.5])
        command = (mass * 9.81 * 0.14 - 0.2197) / 1.8615 + 0.02 * rng.standard_normal(8)
        fit, other = identify_torque_scale(command, mass), linregress(command, mass * 9.81 * 0.14)
        assert (fit.scale, fit.offset) == pytest.approx((other.slope, other.intercept), rel=1e-12)
        assert (fit.sd_scale, fit.sd_offset) == pytest.approx((other.stderr, other.intercept_stderr), rel=1e-9)
        assert fit.low < 1.8615 < fit.high

    def test_interval_covers(self):
        mass = np.linspace(-2, 2, 9)
        inside = 0
        for seed in range(400):
            noise = 0.05 * np.random.default_rng(seed).standard_normal(9)
            # Noise of the torque, so that least squares of torque on command has no bias.
            fit = identify_torque_scale((mass * 9.81 * 0.14 - 0.2) / 1.86, mass + noise)
            inside += fit.low < 1.86 < fit.high
        assert 0.92 < inside / 400 < 0.98

    @pytest.mark.parametrize(("command", "mass"), [
        ([1.0, 2.0], [1.0, 2.0]), ([1.0, 1.0, 1.0], [1.0, 2.0, 3.0]), ([1.0, 2.0, 3.0], [1.0, 1.0, 1.0]),
        ([1.0, 2.0, 3.0, 4.0], [1.0, -2.0, 3.0, -4.0]), ([1.0, 2.0, np.nan], [1.0, 2.0, 3.0]),
    ])  # fmt: skip
    def test_refusals(self, command, mass):
        with pytest.raises(cd.CodriverError):
            identify_torque_scale(np.array(command), np.array(mass))


@pytest.fixture(scope="module")
def folder(real, tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    angle, torque = real["steering_wheel_angle"], real["steering_motor_torque"]
    rows = [
        f"{t:.2f},{a / DEGREE:.1f},{u:.5f}" for t, a, u in zip(angle.time, angle.values, torque.values, strict=True)
    ]
    head = "time [s],steering_wheel_angle [deg],steering_motor_torque [N*m]"
    (folder / "chirp.csv").write_text("\n".join([head, *rows]) + "\n")
    (folder / "still.csv").write_text(
        "\n".join([head, *(f"{t:.2f},1.0,{u:.5f}" for t, u in zip(TIME, CHIRP, strict=True))])
    )
    (folder / "weights.csv").write_text("command,mass\n-1.58,-2\n-0.85,-1\n0.25,0.5\n0.61,1\n1.36,2\n")
    return folder


class TestCommands:
    def run(self, *arguments):
        from typer.testing import CliRunner

        from codriver.cli.app import app

        return CliRunner().invoke(app, [str(a) for a in arguments])

    def test_wheel_with_report(self, folder):
        out, page = folder / "wheel.toml", folder / "wheel.html"
        done = self.run("identify", "steering-wheel", folder / "chirp.csv", "-o", out, "--report", page)
        assert done.exit_code == 0, done.output
        assert "J_s" in done.output
        wheel = cd.load_vehicle(out)
        assert wheel.number("steering_inertia") == pytest.approx(J, rel=0.02)
        assert wheel.number("steering_friction") == pytest.approx(0.5, rel=0.04)
        text = page.read_text(encoding="utf-8")
        for said in (
            "Measured and simulated angle",
            "Autocorrelation of the innovations",
            "joint-ekf",
            "joint-ukf",
            "prediction errors",
        ):
            assert said in text
        again = self.run("identify", "steering-wheel", folder / "chirp.csv", "-o", out)
        assert isinstance(again.exception, cd.CodriverError)
        assert "there already" in str(again.exception)

    def test_json(self, folder):
        import json

        done = self.run(
            "identify", "steering-wheel", folder / "chirp.csv", "-o", folder / "j.toml", "--json", "--end-stop", "500"
        )
        told = json.loads(done.output)
        assert told["coefficients"]["J_s"]["unit"] == "kg*m^2"
        assert set(told["filters"]) == {"joint-ekf", "joint-ukf"}

    def test_still_wheel_writes_nothing(self, folder):
        done = self.run("identify", "steering-wheel", folder / "still.csv", "-o", folder / "still.toml")
        assert "turns by" in str(done.exception) or "usable" in str(done.exception)
        assert not (folder / "still.toml").exists()

    def test_torque_scale(self, folder):
        out = folder / "scale.toml"
        done = self.run(
            "identify", "torque-scale", folder / "weights.csv", "-o", out, "--report", folder / "scale.html"
        )
        assert done.exit_code == 0, done.output
        assert cd.load_vehicle(out).number("torque_scale") == pytest.approx(1.8713, abs=1e-4)
        assert (folder / "scale.html").stat().st_size > 1000

    @pytest.mark.parametrize(("text", "said"), [
        ("command,weight\n1,2\n", "no column mass"), ("command,mass\n1,x\n", "number in every cell"), ("", "no column"),
        ("command,mass\n1\n2,3\n", "number in every cell"),
    ])  # fmt: skip
    def test_weighings_that_cannot_be_read(self, tmp_path, text, said):
        from codriver.identify.torque_scale import read_weighings

        (tmp_path / "w.csv").write_text(text)
        with pytest.raises(cd.CodriverError, match=said):
            read_weighings(tmp_path / "w.csv")
