"""Identification: coefficients of drives with known truth, honest standard errors, refusals, vehicle files, reports."""

from __future__ import annotations

import json
import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

import codriver as cd
from codriver.cli import main
from codriver.errors import LogError, MissingSignal, UsageError
from codriver.identify import check_vehicle_against_log, identify_brake, identify_pedal, identify_ratio
from codriver.identify.brake import _badly_told
from codriver.identify.brake_rows import drive_rows, halves
from codriver.identify.brake_verdict import brake_findings
from codriver.identify.low_pass import centred, low_pass, rate, smooth
from codriver.identify.ratio_verdict import ratio_findings
from codriver.identify.regression import Regression, regress, solve, trimmed_rows
from codriver.identify.standard_errors import (
    autocorrelation,
    block_bootstrap,
    block_length,
    block_sums,
    blocks_of,
    newey_west,
)  # fmt: skip
from codriver.identify.usable import usable, widened
from codriver.report.document import write_document
from codriver.report.identification import brake_document, pedal_document, ratio_document
from codriver.vehicles import save_vehicle
from conftest import recording

C_B, DRAG, ROLLING, BIAS, M, PITCH = 189e-5, 0.283, 131.0, 0.05, 1550.0, 0.0015 * 9.80665
UNITS = {
    "longitudinal_acceleration": "m/s^2", "longitudinal_speed": "m/s", "engine_torque": "N*m", "brake_pressure": "Pa",
    "engine_torque_request": "N*m", "accelerator_pedal": "1", "gear": "1",
}  # fmt: skip


@pytest.fixture(scope="module")
def road():
    """The road test's log, 42 minutes as decoded from CAN frames."""
    from codriver.simulate import road_test

    return road_test("ordinary", 1).log


@pytest.fixture(scope="module")
def fit(road, car):
    return identify_brake(road, car)


@pytest.fixture(scope="module")
def ratios(road):
    return identify_ratio(road)


def smoothed(rng: np.random.Generator, n: int, seconds: float, dt: float = 0.01) -> np.ndarray:
    """Noise of unit variance that changes over so many seconds."""
    a = np.exp(-dt / seconds)
    x = lfilter([1 - a], [1, -a], rng.standard_normal(n + round(10 * seconds / dt)))[-n:]
    return x / x.std()


def synthetic(
    seconds: float = 240.0, *, seed: int = 0, brakes: bool = True, bias: float = BIAS, noise: float = 0.06, v0: float = 15.0,
    varied: bool = True, tau: float = 14.0, mass: float = M,
) -> cd.Log:  # fmt: skip
    """A drive in third gear by eq. (19), on a wavy road, with white noise of the accelerometer."""
    rng, dt = np.random.default_rng(seed), 0.01
    n = round(seconds / dt)
    wish = 0.8 * smoothed(rng, n, 3.0) if varied else np.zeros(n)
    slope = 0.02 * smoothed(rng, n, 20.0)
    v, speed, torque, pressure, own = v0, np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    for k in range(n):
        drag = ROLLING + DRAG * v * v
        aim = wish[k] + (0.15 * (v0 * (1.0 + 0.5 * np.sin(k * dt / 25.0)) - v) if varied else 0.0)
        force = mass * (aim + 9.80665 * slope[k]) + drag
        pressure[k] = max(-force, 0.0) / C_B if brakes else 0.0
        torque[k] = max(force, 0.0) / tau if brakes else force / tau
        own[k] = (tau * torque[k] - C_B * pressure[k] - drag) / mass - 9.80665 * slope[k]
        speed[k] = v
        v += dt * own[k]
    t = np.arange(n) * dt
    y = own + 9.80665 * slope + bias + noise * rng.standard_normal(n)
    columns = {
        "longitudinal_acceleration": y, "longitudinal_speed": speed, "engine_torque": torque, "brake_pressure": pressure,
        "gear": np.full(n, 3.0),
    }  # fmt: skip
    return log_of(t, columns, f"synthetic-{seed}")


def log_of(t: np.ndarray, columns: dict[str, np.ndarray], source: str = "synthetic") -> cd.Log:
    return cd.Log.of([cd.Signal(name, t, x, UNITS[name]) for name, x in columns.items()], source)


def changed(log: cd.Log, name: str, work) -> cd.Log:
    """A log with one signal's values worked on."""
    s = log[name]
    return log.with_signals(cd.Signal(name, s.time, work(s.values), s.unit))


class TestFilter:
    def test_low_pass_is_scipys(self):
        x = np.random.default_rng(0).standard_normal((500, 3))
        a = np.exp(-2 * np.pi * 5 * 0.01)
        theirs = lfilter([0, 1 - a], [1, -a], x, axis=0, zi=x[:1])[0]
        assert np.allclose(low_pass(x, 0.01), theirs, rtol=0, atol=1e-14)

    def test_step_response_is_exact(self):
        """Of a held step, whatever the tick: 1 - exp(-w t)."""
        for dt in (0.002, 0.01, 0.05):
            step = np.concatenate([np.zeros(10), np.ones(100)])
            t = np.arange(step.size) * dt - 10 * dt
            assert np.allclose(low_pass(step, dt), np.where(t > 0, 1 - np.exp(-2 * np.pi * 5 * t), 0), atol=1e-13)

    def test_silence_is_zero(self):
        """What has faded is nothing, and no denormal number, which would be slow."""
        faded = low_pass(np.concatenate([np.ones(10), np.zeros(5000)]), 0.01)
        assert (np.abs(faded[-1000:]) < 1e-40).all()
        assert not ((np.abs(faded) > 0) & (np.abs(faded) < np.finfo(float).tiny)).any()

    def test_rate_does_not_lag(self):
        """Rate and signal through their filters keep their phase: 0.2 Hz, against the signal through the 5 Hz one alone."""
        t = np.arange(6000) * 0.01
        w = 2 * np.pi * 0.2
        found, expected = rate(np.sin(w * t), 0.01)[1000:-1000], low_pass(w * np.cos(w * t), 0.01)[1000:-1000]
        lag = (np.argmax(np.correlate(found, expected, "full")) - (found.size - 1)) * 0.01
        assert abs(lag) <= 0.01
        assert found.std() == pytest.approx(
            expected.std() / (1 + (0.2 / 1.5) ** 2), rel=2e-3
        )  # 1.5 Hz, forwards and backwards
        assert np.allclose(smooth(np.full(50, 3.0), 0.01), 3.0)

    def test_centred_holds_make_rates_alike(self):
        """A 10 Hz signal held lags by 50 ms; set back, by nothing."""
        fast, slow = np.arange(0, 60, 0.01), np.arange(0, 60, 0.1)
        log = cd.Log.of([
            cd.Signal("brake_pressure", slow, np.sin(slow), "Pa"), cd.Signal("engine_torque", fast, np.sin(fast), "N*m"),
        ])  # fmt: skip
        lags = []
        for one in (log, centred(log, ("brake_pressure", "engine_torque"))):
            grid = one.sample(["brake_pressure", "engine_torque"], 0.01, start=1, stop=50)
            p, T = grid.values["brake_pressure"], grid.values["engine_torque"]
            lags.append(float(np.mean((T - p)[:-1] * np.diff(T)) / np.mean(np.diff(T) ** 2)) * 0.01)
        assert lags[0] == pytest.approx(0.045, abs=0.003)
        assert abs(lags[1]) < 0.0055  # half a tick, where clocks and ticks coincide


class TestStandardErrors:
    @pytest.fixture
    def regression(self):
        rng = np.random.default_rng(3)
        n = 2000
        X = np.column_stack([np.ones(n), lfilter([1], [1, -0.9], rng.standard_normal(n)), rng.standard_normal(n)])
        e = lfilter([1], [1, -0.8], rng.standard_normal(n))
        return X, X @ [1.0, 2.0, -0.5] + e

    @pytest.mark.parametrize("length", [1, 7, 40])
    def test_newey_west_is_statsmodels(self, regression, length):
        sm = pytest.importorskip("statsmodels.api")
        X, y = regression
        theirs = sm.OLS(y, X).fit(cov_type="HAC", cov_kwds={"maxlags": length - 1, "use_correction": False})
        e, used = y - X @ solve(X, y), np.ones(y.size, bool)
        ours = newey_west(X, e, used, np.array([0, y.size]), length)
        assert np.allclose(ours, theirs.cov_params(), rtol=1e-9)
        assert np.allclose(solve(X, y), theirs.params, rtol=1e-10)

    def test_no_pair_crosses_two_logs(self, regression):
        X, y = regression
        e, used = y - X @ solve(X, y), np.ones(y.size, bool)
        bread = np.linalg.inv(X.T @ X)
        S = sum(
            (1 - abs(j) / 9) * np.outer(X[a] * e[a], X[b] * e[b])
            for i, k in ((0, 1200), (1200, 2000)) for a in range(i, k) for j in range(-8, 9) if i <= (b := a + j) < k
        )  # fmt: skip
        assert np.allclose(newey_west(X, e, used, np.array([0, 1200, 2000]), 9), bread @ S @ bread, rtol=1e-9)

    def test_autocorrelation_with_holes(self):
        rng = np.random.default_rng(1)
        e, used = lfilter([1], [1, -0.7], rng.standard_normal(400)), rng.random(400) > 0.3
        pieces = np.array([0, 150, 400])
        x = np.where(used, e - e[used].mean(), 0.0)
        found = autocorrelation(e, used, pieces, 20)
        for lag in range(21):
            pairs = [
                (a, a + lag) for i, k in ((0, 150), (150, 400)) for a in range(i, k - lag) if used[a] and used[a + lag]
            ]
            expected = np.mean([x[a] * x[b] for a, b in pairs]) / np.mean(x[used] ** 2)
            assert found[lag] == pytest.approx(expected, abs=1e-10)

    def test_block_length(self):
        """Residuals that stay alike for longer ask for longer blocks; L = c (n/c)^(1/3)."""
        rng = np.random.default_rng(2)
        n = 40_000
        lengths = []
        for a in (0.0, 0.8, 0.98):
            e = lfilter([1], [1, -a], rng.standard_normal(n))
            c = (1 + a) / (1 - a)
            lengths.append(block_length(np.ones((n, 1)), e, np.ones(n, bool), np.array([0, n])))
            assert lengths[-1] == pytest.approx(c * (n / c) ** (1 / 3), rel=0.25)
        assert lengths[0] < lengths[1] < lengths[2]

    def test_blocks_stay_in_their_log(self):
        used = np.ones(1000, bool)
        used[100:400] = False
        starts, logs = blocks_of(used, np.array([0, 450, 1000]), 50)
        assert list(logs) == [0] * 3 + [1] * 11
        assert 450 in starts
        counts = np.add.reduceat(used.astype(int), starts[:-1])
        assert counts.sum() == 700
        assert counts.min() >= 49

    def test_bootstrap_is_the_classical_error_for_white_noise(self):
        rng = np.random.default_rng(5)
        n = 6000
        X = np.column_stack([np.ones(n), rng.standard_normal(n)])
        y = X @ [1.0, 2.0] + 0.3 * rng.standard_normal(n)
        starts, logs = blocks_of(np.ones(n, bool), np.array([0, n]), 20)
        sd = np.sqrt(np.diag(block_bootstrap(*block_sums(X, y, np.ones(n, bool), starts), logs, 0, 2000)))
        assert sd == pytest.approx(np.full(2, 0.3 / np.sqrt(n)), rel=0.1)

    @pytest.mark.parametrize("a", [0.0, 0.9, pytest.param(0.97, marks=pytest.mark.slow)])
    def test_coverage(self, a):
        """95 % intervals hold the truth in 90 to 98 % of 300 short regressions with AR(1) residuals and regressors."""
        inside = []
        for seed in range(300):
            rng = np.random.default_rng([seed, 8])
            n = 3000
            X = np.column_stack([np.ones(n), lfilter([1], [1, -0.95], rng.standard_normal(n))])
            y = X @ [0.5, 1.0] + lfilter([1], [1, -a], rng.standard_normal(n))
            found = regress(X, y, np.ones(n, bool), np.array([0, n]), seed=seed)
            inside.append(np.abs(found.solution - [0.5, 1.0]) < found.interval_factor * found.sd)
        share = np.mean(inside, axis=0)
        assert ((share >= 0.90) & (share <= 0.98)).all(), share

    def test_too_few_blocks_are_no_error_bar(self):
        e = np.cumsum(np.random.default_rng(0).standard_normal(200))
        found = regress(np.ones((200, 1)), e, np.ones(200, bool), np.array([0, 200]))
        assert found.freedom < 8
        A = np.ones((2, 1, 1))
        assert np.isinf(block_bootstrap(A, np.ones((2, 1)), np.zeros(2, int), 0)).all()


class TestRobust:
    def test_outliers_are_left_out(self):
        rng = np.random.default_rng(0)
        n = 4000
        X = np.column_stack([np.ones(n), rng.standard_normal(n)])
        clean = X @ [1.0, 2.0] + 0.1 * rng.standard_normal(n)
        y = clean.copy()
        wild = rng.random(n) < 0.08
        y[wild] += 20 * np.abs(X[wild, 1])
        found = regress(X, y, np.ones(n, bool), np.array([0, n]))
        assert found.solution == pytest.approx([1.0, 2.0], abs=0.01)
        assert found.trimmed == pytest.approx(wild.mean(), abs=0.01)
        plain = regress(X, y, np.ones(n, bool), np.array([0, n]), trim=False)
        assert plain.trimmed == 0
        assert abs(plain.solution[0] - 1.0) > 0.5

    def test_nothing_is_left_out_of_a_clean_fit(self):
        X = np.column_stack([np.ones(100), np.arange(100.0)])
        assert trimmed_rows(X, X @ [1.0, 2.0], np.ones(100, bool)).all()


class TestMasks:
    def grid(self, log):
        names = ("longitudinal_acceleration", "longitudinal_speed", "engine_torque", "brake_pressure")
        return log.sample((*names, "gear", "clutch", "brake_switch"), 0.01), names

    def test_widened(self):
        mask = np.zeros(20, bool)
        mask[10] = True
        assert list(np.flatnonzero(widened(mask, 0.02, 0.03, 0.01))) == [8, 9, 10, 11, 12, 13]

    def test_nothing_of_a_plain_drive_is_left_out(self):
        grid, names = self.grid(synthetic(60))
        assert usable(grid, names, 5).keep.mean() > 0.99

    def test_reasons(self):
        log = synthetic(100)
        log = changed(log, "gear", lambda g: np.where(np.arange(g.size) >= 3000, 4.0, g))
        log = changed(log, "brake_pressure", lambda p: np.where(np.arange(p.size) // 100 == 50, 9e8, p))
        log = changed(log, "longitudinal_speed", lambda v: np.where(np.arange(v.size) // 100 == 70, v + 4.0, v))
        log = changed(log, "engine_torque", lambda x: np.where(np.arange(x.size) // 200 == 45, np.nan, x))
        grid, names = self.grid(log)
        left = usable(grid, names, 5).left_out
        assert [round(float(t), 1) for t in grid.time[left["shift"]][[0, -1]]] == [29.8, 31.0]
        assert left["absurd"][5000:5100].all()
        assert left["absurd"].sum() < 150
        assert left["slip"][[7000, 7100]].all()
        assert left["slip"].mean() < 0.06
        assert left["missing"][9060:9190].all()
        assert not left["missing"][8900:9040].any()
        assert usable(grid, names, 3).left_out["gear"][3001:].all()

    def test_sensor_at_its_end(self):
        log = changed(
            synthetic(60, noise=0.0),
            "longitudinal_acceleration",
            lambda y: np.where(np.arange(y.size) // 100 == 30, -7.99, y),
        )
        grid, names = self.grid(log)
        assert usable(grid, names, 5).left_out["absurd"][3030:3090].all()

    def test_halves_are_of_each_log(self):
        keep = np.ones(100, bool)
        keep[:20] = False
        first, second = halves(keep, np.array([0, 60, 100]))
        assert np.flatnonzero(first).tolist() == [*range(20, 40), *range(60, 80)]
        assert (first ^ second)[keep].all()


class TestBrakeOnTheRoadTest:
    """The limits of the simulation: bias 0.05, pitch 1.5 %, ringing, quantisation, holes on the bus."""

    def test_coefficients(self, fit):
        c = fit.coefficients
        assert c["c_b"].value == pytest.approx(C_B, rel=0.005)
        assert c["kappa_2"].value == pytest.approx(DRAG, rel=0.02)
        assert c["kappa_1"].value == pytest.approx(ROLLING - M * BIAS, abs=6.0)
        assert c["gamma"].value == pytest.approx(PITCH, abs=0.0015)
        assert fit.refused == ()
        assert fit.rmse < 0.03 < 0.5 < fit.rmse_constant
        assert fit.rmse < fit.rmse_old < 0.04
        assert 15 < fit.minutes_fit < 21

    def test_learning_curve(self, fit):
        """Within 2 % at each point from 2 minutes of usable data that holds braking on."""
        late = [p for p in fit.curve if p.minutes >= 2 and p.braking > 0]
        assert len(late) > 20
        assert max(abs(p.value / C_B - 1) for p in late) < 0.02
        assert fit.curve[-1].value == pytest.approx(fit.coefficients["c_b"].value, rel=1e-9)
        assert fit.curve[-1].rmse == pytest.approx(fit.rmse, rel=1e-6)
        assert fit.curve[-1].sd == pytest.approx(fit.coefficients["c_b"].sd, rel=0.3)
        assert late[0].sd > late[-1].sd

    def test_learning_curve_is_the_fit_of_so_much_data(self, fit, car):
        """One point against numpy's least squares on the rows so far."""
        point = fit.curve[len(fit.curve) // 3]
        rows = fit.rows
        used = np.flatnonzero(fit.fitted)[: round(point.minutes * 60 / rows.dt)]
        X = np.column_stack([rows.pressure, np.ones_like(rows.y), rows.square, -rows.rate])[used]
        y = (rows.torque @ np.array(car.numbers("transmission")) - M * rows.y)[used]
        assert point.value == pytest.approx(np.linalg.lstsq(X, y, rcond=None)[0][0], rel=1e-6)

    def test_pitch_that_is_not_modelled_moves_c_b(self, road, car):
        """Why gamma is there: 2 % in c_b, 3 % in kappa_2."""
        plain = identify_brake(road, car, pitch=False).coefficients
        assert 1.01 < plain["c_b"].value / C_B < 1.03
        assert 1.01 < plain["kappa_2"].value / DRAG < 1.06
        assert "gamma" not in plain

    def test_a_wrong_mass_shows_in_gamma_and_not_in_c_b(self, road, car):
        wrong = identify_brake(road, car.with_parameter("mass", 1.1 * M, source="wrong"))
        assert wrong.coefficients["gamma"].value == pytest.approx(1 - (1 - PITCH) / 1.1, abs=0.01)
        assert wrong.coefficients["c_b"].value == pytest.approx(C_B, rel=0.01)
        assert any("no pitch" in f.text for f in brake_findings(wrong) if f.severity == "bad")

    def test_mass_alone_moves_c_b_where_pitch_is_not_fitted(self, road, car):
        right, wrong = (
            identify_brake(road, car.with_parameter("mass", m, source="tried"), pitch=False).coefficients["c_b"].value
            for m in (M, 1.05 * M)
        )
        assert wrong / right == pytest.approx(1.066, abs=0.01)

    def test_errors_agree(self, fit):
        for found in fit.coefficients.values():
            assert 0.6 < found.sd_hac / found.sd < 1.7
            assert found.low < found.value < found.high

    def test_vehicle_needs_no_brake_before(self, road, car):
        bare = cd.Vehicle("bare", "", "", {name: car.parameters[name] for name in ("mass", "transmission")})
        found = identify_brake(road, bare)
        new = found.vehicle(bare)
        assert found.rmse_old is None
        assert new.number("brake_coefficient") == found.coefficients["c_b"].value
        assert new.parameters["mass"] == car.parameters["mass"]
        assert "kappa_1 - M d_a" in new.parameters["rolling_resistance"].source
        assert "sd" in new.parameters["brake_coefficient"].source


class TestBrake:
    def test_sd_of_mass_and_tau_are_carried(self, car):
        """Against refits with another M and tau."""
        log = synthetic(300)
        uncertain = car.with_parameter("mass", M, 40.0, "scales").with_parameter(
            "transmission", car.numbers("transmission"), (0, 0, 0.3, 0, 0)
        )

        def value(mass: float, third: float, name: str) -> float:
            taus = [41, 22, third, 10, 8]
            tried = car.with_parameter("mass", mass, source="").with_parameter("transmission", taus, source="")
            return identify_brake(log, tried, pitch=False).coefficients[name].value

        found = identify_brake(log, uncertain, pitch=False).coefficients
        for name in ("c_b", "kappa_1", "kappa_2"):
            by_mass = (value(M + 20, 14, name) - value(M - 20, 14, name)) / 40
            by_tau = (value(M, 14.1, name) - value(M, 13.9, name)) / 0.2
            expected = np.sqrt(found[name].sd ** 2 + (40 * by_mass) ** 2 + (0.3 * by_tau) ** 2)
            assert found[name].sd_total == pytest.approx(expected, rel=0.02), name

    def test_synthetic_truth_is_inside(self, car):
        found = identify_brake(synthetic(400), car).coefficients
        for name, truth in (("c_b", C_B), ("kappa_1", ROLLING - M * BIAS), ("kappa_2", DRAG), ("gamma", 0.0)):
            assert abs(found[name].value - truth) < 4 * found[name].sd, name

    @pytest.mark.slow
    def test_coverage_on_drives(self, car):
        """c_b's interval holds the truth in most of 60 drives of two minutes."""
        inside = [
            found.low < C_B < found.high
            for seed in range(60)
            if (found := identify_brake(synthetic(120, seed=seed), car).coefficients.get("c_b")) is not None
        ]
        assert len(inside) > 50
        assert 0.85 <= np.mean(inside) <= 1.0

    def test_known_bias_frees_kappa_1(self, car):
        log = synthetic(300)
        offset, freed = (identify_brake(log, car, bias=b) for b in (None, BIAS))
        assert freed.coefficients["kappa_1"].value - offset.coefficients["kappa_1"].value == pytest.approx(M * BIAS)
        assert freed.coefficients["kappa_1"].value == pytest.approx(ROLLING, abs=15)
        assert "d_a is in it" not in freed.vehicle(car).parameters["rolling_resistance"].source

    def test_several_logs_have_offsets_of_their_own(self, car):
        logs = [synthetic(200, seed=1, bias=0.05), synthetic(200, seed=2, bias=-0.15)]
        found = identify_brake(logs, car)
        assert found.offsets[0] == pytest.approx(ROLLING - M * 0.05, abs=20)
        assert found.offsets[1] == pytest.approx(ROLLING + M * 0.15, abs=20)
        assert found.coefficients["c_b"].value == pytest.approx(C_B, rel=0.02)
        assert found.coefficients["kappa_2"].value == pytest.approx(DRAG, rel=0.15)
        assert found.rmse < 0.03
        assert found.sources == ("synthetic-1", "synthetic-2")
        assert max(abs(p.value / C_B - 1) for p in found.curve if p.minutes > 2) < 0.03

    def test_outliers_do_not_matter(self, car):
        log = synthetic(300)
        rng = np.random.default_rng(0)
        hit = np.convolve(rng.random(30_000) < 0.001, np.ones(20), "same") > 0
        bumpy = changed(log, "engine_torque", lambda x: x + np.where(hit, 300.0, 0.0))
        found = identify_brake(bumpy, car)
        assert found.trimmed > 0.005
        assert found.coefficients["c_b"].value == pytest.approx(C_B, rel=0.02)


class TestRefusals:
    def test_no_braking(self, car):
        found = identify_brake(synthetic(400, brakes=False), car)
        assert [r.name for r in found.refused if r.name == "c_b"] == ["c_b"]
        assert "does not brake" in next(r.reason for r in found.refused if r.name == "c_b")
        assert found.coefficients["kappa_2"].value == pytest.approx(DRAG, rel=0.15)
        assert found.vehicle(car).parameters["brake_coefficient"] == car.parameters["brake_coefficient"]
        assert found.curve == ()

    def test_one_speed(self, car):
        """One speed on a wavy road, never braking: nothing tells drag from rolling resistance."""
        wheels = np.random.default_rng(0).choice([-0.001, 0.0, 0.001], 20_000)
        log = changed(synthetic(200, varied=False, brakes=False), "longitudinal_speed", lambda v: v + wheels)
        with pytest.raises(LogError) as error:
            identify_brake(log, car)
        for name in ("c_b", "kappa_1", "kappa_2"):
            assert f"{name}:" in str(error.value)

    def test_few_speeds_leave_c_b(self, car):
        """Some seconds: c_b is told, kappa_2 is not."""
        found = identify_brake(synthetic(16, seed=3), car)
        assert "kappa_2" in [r.name for r in found.refused]
        assert "kappa_2" not in found.coefficients
        assert found.coefficients["c_b"].value == pytest.approx(C_B, rel=0.1)
        assert found.vehicle(car).parameters["drag"] == car.parameters["drag"]
        assert any("kappa_2 is refused" in f.text for f in brake_findings(found))

    def test_too_short(self, car):
        with pytest.raises(LogError, match="only 0"):
            identify_brake(synthetic(0.5), car)

    def test_short_is_refused_or_honest(self, car):
        """A few seconds: nothing, or a coefficient whose truth is not far outside."""
        for seed in range(10):
            try:
                found = identify_brake(synthetic(5.0, seed=seed), car).coefficients
            except LogError:
                continue
            if "c_b" in found:
                assert abs(found["c_b"].value - C_B) < 5 * found["c_b"].sd

    def test_standing(self, car):
        log = changed(synthetic(60, varied=False, noise=0.01), "longitudinal_speed", lambda v: 0 * v)
        with pytest.raises(LogError, match="standing or slower"):
            identify_brake(log, car)

    @pytest.mark.parametrize("name", ["brake_pressure", "engine_torque", "gear", "longitudinal_speed"])
    def test_missing_signal(self, car, name):
        with pytest.raises(MissingSignal, match=name):
            identify_brake(synthetic(20).without(name), car)

    def test_pressure_of_the_wrong_sign(self, car):
        found = identify_brake(changed(synthetic(200), "brake_pressure", lambda p: 4e6 - p), car)
        assert "sign" in next(r.reason for r in found.refused if r.name == "c_b")

    def test_empty_signal(self, car):
        log = synthetic(20)
        log = log.with_signals(cd.Signal("brake_pressure", np.array([]), np.array([]), "Pa"))
        with pytest.raises(LogError):
            identify_brake(log, car)

    def test_zoe(self):
        """No pressure on its bus: brake refuses by name. The pedal map of an electric car with regeneration is no line."""
        zoe = cd.read(recording("nuscenes-zoe-scene-0103"))
        car = cd.load_vehicle("renault-zoe")
        with pytest.raises(MissingSignal, match="brake_pressure"):
            identify_brake(zoe, car)
        with pytest.raises(LogError, match="no multiple of the pedal"):
            identify_pedal(zoe, car)
        assert identify_ratio(zoe).ratio == pytest.approx(0.01610, abs=0.0003)
        assert all(f.severity == "ok" for f in check_vehicle_against_log(zoe, car))


def pedal_log(work, seconds: float = 200.0, noise: float = 0.3, reach: float = 0.25) -> cd.Log:
    """A pedal that wanders, and the request that `work` makes of it."""
    rng = np.random.default_rng(4)
    n = round(seconds * 100)
    pedal = np.clip(0.3 + reach * smoothed(rng, n, 2.0), 0.0, 1.0)
    return log_of(
        np.arange(n) * 0.01,
        {"accelerator_pedal": pedal, "engine_torque_request": work(pedal) + noise * rng.standard_normal(n)},
    )


def g_units(y):
    return y / 9.80665


class TestUnsound:
    """What least squares would not show: told by name before anything is fitted."""

    @pytest.mark.parametrize(
        ("name", "work", "words"),
        [
            ("longitudinal_acceleration", g_units, "the accelerometer looks like g read as m/s^2"),
            ("longitudinal_acceleration", lambda y: -y, "sign is wrong"),
            ("longitudinal_acceleration", lambda y: np.random.default_rng(0).standard_normal(y.size), "hardly go together"),
            ("longitudinal_acceleration", lambda y: 0 * y, "longitudinal_acceleration is 0 m/s^2 all the time"),
            ("longitudinal_speed", lambda v: 0 * v + 20, "longitudinal_speed is 20 m/s all the time"),
            ("longitudinal_speed", lambda v: 3.6 * v, "km/h read as m/s"),
            ("engine_torque", lambda x: 0 * x + 80, "engine_torque is 80 N*m all the time"),
        ],
        ids=["g", "sign", "noise", "flat", "stuck", "km/h", "torque"],
    )  # fmt: skip
    def test_refused_by_brake_and_ratio(self, demo, car, name, work, words):
        spoilt = changed(demo.measured, name, work)
        for identify in (lambda: identify_brake(spoilt, car), lambda: identify_ratio(spoilt)):
            with pytest.raises(LogError, match=re.escape(words)):
                identify()

    def test_pressure_stuck_or_in_bar(self, demo, car):
        with pytest.raises(LogError, match="brake_pressure is 5e"):
            identify_brake(changed(demo.measured, "brake_pressure", lambda p: 0 * p + 5e5), car)
        in_bar = changed(demo.measured, "brake_pressure", lambda p: 1e-5 * p)
        for identify in (lambda: identify_brake(in_bar, car), lambda: identify_ratio(in_bar)):
            with pytest.raises(LogError, match="is its unit right"):
                identify()

    def test_slow_samples(self, demo, car):
        slow = demo.measured.with_signals(*(
            cd.Signal(name, s.time[:: round(s.rate)], s.values[:: round(s.rate)], s.unit)
            for name in UNITS if name != "gear" for s in [demo.measured[name]]
        ))  # fmt: skip
        for identify in (lambda: identify_brake(slow, car), lambda: identify_ratio(slow), lambda: identify_pedal(slow)):
            with pytest.raises(LogError, match="comes 1 times a second"):
                identify()

    def test_two_rows(self, car):
        log = synthetic(20).between(3.0, 3.015)
        with pytest.raises(LogError, match=r"has 2 samples over 0\.01 s"):
            identify_brake(log, car)


class TestSaturation:
    def test_pressure_cut_off(self, road, car):
        """At 10 bar: c_b would be 265 N/bar; the moments at the end are left out, and that is told."""
        cut = changed(road, "brake_pressure", lambda p: np.minimum(p, 10e5))
        found = identify_brake(cut, car)
        assert found.coefficients["c_b"].value == pytest.approx(C_B, rel=0.005)
        assert found.trimmed < 0.01
        assert any("brake_pressure stays at 10 bar" in f.text for f in found.rows.clipped)

    @pytest.mark.parametrize(("name", "end"), [("engine_torque", 150.0), ("longitudinal_acceleration", 1.2)])
    def test_torque_and_accelerometer_cut_off(self, road, car, name, end):
        found = identify_brake(changed(road, name, lambda x: np.minimum(x, end)), car)
        assert found.coefficients["c_b"].value == pytest.approx(C_B, rel=0.01)
        assert any(f"{name} stays at {end:.4g}" in f.text for f in found.rows.clipped)

    def test_hardly_any_braking_is_left(self, road, car):
        """Cut off at 3 bar: no wrong sign is blamed, and the sensor's end is among the reasons."""
        cut = changed(road.between(0, 1200), "brake_pressure", lambda p: np.minimum(p, 3e5))
        try:
            found = identify_brake(cut, car)
            said = " ".join(r.reason for r in found.refused) + " ".join(f.text for f in brake_findings(found))
        except LogError as error:
            said = str(error)
        assert "pressure's sign" not in said
        assert "brake_pressure stays at 3 bar" in said

    def test_honest_signals_have_no_plateau(self, fit):
        assert fit.rows.clipped == ()

    def test_a_wrong_file_is_not_called_right(self, road, car):
        part = road.between(0, 900)
        cut = changed(part, "brake_pressure", lambda p: np.minimum(p, 10e5))
        wrong = car.with_parameter("brake_coefficient", 265e-5, source="of clipped pressure")
        said = {f.severity: f.text for f in check_vehicle_against_log(cut, wrong)}
        assert "c_b or the unit" in said["bad"]
        assert all(f.severity == "ok" for f in check_vehicle_against_log(part, car))


class TestVerdict:
    """What condemns itself makes no vehicle file."""

    def refused(self, log: cd.Log, car: cd.Vehicle) -> str:
        with pytest.raises(LogError) as error:
            identify_brake(log, car).vehicle(car)
        return error.value.found

    def test_torque_of_the_wrong_sign(self, road, car):
        said = self.refused(changed(road, "engine_torque", lambda x: -x), car)
        assert "for a constant" in said
        assert "sign" in said

    def test_gear_stuck(self, road, car):
        stuck = changed(road, "gear", lambda g: 0 * g + 3)
        assert "that of another gear than the log names (gear 3 of the log: mostly gear 5)" in self.refused(stuck, car)
        assert "do not fit at all" in self.refused(stuck.without("engine_speed"), car)
        assert not any(f.severity == "ok" for f in brake_findings(identify_brake(stuck, car)))
        said = [f for f in check_vehicle_against_log(stuck, car) if f.severity == "bad"]
        assert any("that of gear 5 fits" in f.text for f in said)

    def test_gear_shifted(self, road, car):
        shifted = changed(road.without("engine_speed"), "gear", lambda g: np.maximum(g - 1, 1))
        assert "no pitch" in self.refused(shifted, car)

    def test_far_from_the_old_value(self, road, car):
        found = identify_brake(changed(road, "brake_pressure", lambda p: 10 * p), car)
        told = [f.text for f in brake_findings(found) if f.severity == "warn"]
        assert told == [
            "c_b is 0.1 times the vehicle's old value: if that was right, then the unit of the pressure, the mass or the gear "
            "is wrong"
        ]
        assert found.vehicle(car).number("brake_coefficient") == pytest.approx(C_B / 10, rel=0.01)

    @pytest.mark.parametrize(
        ("name", "value", "words"), [("kappa_1", -900.0, "kappa_1 - M d_a is -900 N"), ("kappa_2", 1.5, "kappa_2 is 1.5 kg/m")]
    )  # fmt: skip
    def test_no_such_vehicle(self, fit, car, name, value, words):
        odd = replace(fit, coefficients={**fit.coefficients, name: replace(fit.coefficients[name], value=value)})
        with pytest.raises(LogError, match=re.escape(words)):
            odd.vehicle(car)
        assert fit.vehicle(car).number("drag") == fit.coefficients["kappa_2"].value

    def test_pressure_in_a_unit_far_off(self, road, car):
        found = identify_brake(changed(road, "brake_pressure", lambda p: p / 60), car)
        assert found.coefficients.get("c_b") is None
        assert any("unit of brake_pressure is suspect" in r.reason for r in found.refused)

    def test_too_short_is_the_reason_told(self):
        """Not a standard error that is small enough."""
        few = Regression(
            np.array([C_B, 0.1]), np.array([1e-6, 0.0078 * M]), np.zeros(2), 2, np.ones(1, bool), 0.0, 0.1, 100, 4
        )
        name, reason = _badly_told(few, ["c_b", "gamma"], M)
        assert name == "gamma"
        assert "too short: 4 stretches" in reason
        assert "6 are needed" in reason
        assert "standard error" not in reason
        assert _badly_told(replace(few, freedom=50), ["c_b", "gamma"], M) == ("", "")

    def test_one_passenger_too_few_is_told_and_written(self, road, car):
        found = identify_brake(road, car.with_parameter("mass", 1.05 * M, source="with a passenger"))
        assert any("is the mass that of the drive" in f.text for f in brake_findings(found) if f.severity == "warn")
        assert found.vehicle(car).number("brake_coefficient") == pytest.approx(C_B, rel=0.005)

    @pytest.mark.parametrize("bias", [float("nan"), 500.0, -3.0])
    def test_bias_that_is_none(self, car, bias):
        with pytest.raises(UsageError, match="an accelerometer's bias"):
            identify_brake(synthetic(30), car, bias=bias)

    def test_pedal_and_its_old_value(self, demo, car):
        found = identify_pedal(changed(demo.measured, "accelerator_pedal", lambda p: p / 2), car)
        assert any("c_r is 2 times" in f.text for f in found.findings)
        spoilt = changed(demo.measured, "longitudinal_acceleration", g_units)
        assert any("g read as m/s^2" in f.text for f in identify_pedal(spoilt, car).findings)
        assert len(identify_pedal(demo.measured, car).findings) == 1


class TestRatioVerdict:
    def refused(self, log: cd.Log, car: cd.Vehicle) -> str:
        with pytest.raises(LogError) as error:
            identify_ratio(log).vehicle(car)
        return error.value.found

    def test_no_agreement_with_an_engine_that_is_not_there(self, road, ratios, car):
        assert next(f.text for f in ratio_findings(ratios, car)).endswith("and agrees with the engine's speed")
        silent = ratio_findings(identify_ratio(road.without("engine_speed")), car)
        assert [f.text for f in silent] == ["every gear that was driven is told; no engine speed to hold against it"]

    def test_gears_numbered_in_another_way(self, road, car):
        for work in (lambda g: np.where(g > 0, g + 1, g), lambda g: np.maximum(g - 1, 1)):
            shifted = changed(road.without("engine_speed"), "gear", work)
            assert "are the gears numbered in another way" in self.refused(shifted, car)
        up = changed(road, "gear", lambda g: np.where(g > 0, g + 1, g))
        assert "the log has a gear 6, and the vehicle 5" in self.refused(up, car)

    def test_torque_doubled(self, road, car):
        doubled = changed(road, "engine_torque", lambda x: 2 * x)
        assert "engine speed over speed (gear 1 0.46" in self.refused(doubled, car)
        said = ratio_findings(identify_ratio(doubled.without("engine_speed")), car)
        assert [f.severity for f in said] == ["warn"]
        assert "gear 5 0.5; if that was right, the torque's unit" in said[0].text

    def test_gear_stuck(self, road, car):
        said = self.refused(changed(road, "gear", lambda g: 0 * g + 3), car)
        assert "not one number within a gear" in said
        assert "do not fit at all" in said

    def test_sign_is_the_reason_told(self, road):
        with pytest.raises(LogError, match="the sign of engine_torque"):
            identify_ratio(changed(road, "engine_torque", lambda x: -x))


class TestPedal:
    def test_road_test(self, road, car):
        found = identify_pedal(road, car)
        assert found.c_r == pytest.approx(325.0, rel=0.001)
        assert found.r2 > 0.999
        assert [f.severity for f in found.findings] == ["ok"]
        assert found.rmse < 1 < 40 < found.rmse_constant
        assert found.vehicle(car).number("pedal_coefficient") == found.c_r

    def test_interventions_do_not_matter(self):
        """A rev limiter for some seconds, and engine drag at small pedal."""

        def work(p):
            limited = np.where(np.arange(p.size) // 300 % 20 == 7, 0.4 * 325 * p, 325 * p)
            return np.where(p < 0.05, -30.0, limited)

        found = identify_pedal(pedal_log(work))
        assert found.c_r == pytest.approx(325, rel=0.002)
        assert found.trimmed > 0.02

    @pytest.mark.parametrize(
        "work",
        [lambda p: 325 * p**2.5, lambda p: 200 - 100 * p, lambda p: 100 + 80 * p, lambda p: 325 * np.sqrt(p)],
        ids=["progressive", "falling", "offset", "root"],
    )
    def test_no_line(self, work):
        with pytest.raises(LogError, match="no multiple of the pedal"):
            identify_pedal(pedal_log(work))

    def test_bent_line_is_told(self):
        found = identify_pedal(pedal_log(lambda p: 325 * p + 25))
        assert found.findings[0].severity == "warn"
        assert found.offset == pytest.approx(25, abs=2)

    def test_little_pedal(self):
        with pytest.raises(LogError, match="of its range"):
            identify_pedal(pedal_log(lambda p: 325 * p, reach=0.01))

    def test_several_logs(self):
        logs = [pedal_log(lambda p: 325 * p), pedal_log(lambda p: 325 * p, 100)]
        assert identify_pedal(logs).c_r == pytest.approx(325, rel=0.001)


class TestRatio:
    def test_road_test(self, ratios):
        found = ratios
        assert [g.gear for g in found.gears] == [1, 2, 3, 4, 5]
        for g, tau in zip(found.gears, (41, 22, 14, 10, 8), strict=True):
            assert g.ratio * M == pytest.approx(tau, rel=0.01)
            assert found.engine_turns[g.gear] == pytest.approx(tau / 0.93, rel=0.02)
        assert found.gain[0] == pytest.approx(PITCH, abs=0.004)

    def test_one_gear_without_a_gear_signal(self):
        log = synthetic(200, brakes=False).without("gear")
        found = identify_ratio(log)
        assert found.ratio == pytest.approx(14 / M, rel=0.02)
        assert abs(found.ratio - 14 / M) < 4 * found.sd

    def test_gears_not_driven_are_refused(self):
        found = identify_ratio(synthetic(200, brakes=False))
        assert [g.gear for g in found.gears] == [3]
        assert set(found.refused) == {1, 2}
        bare = cd.Vehicle("bare", "", "", {}).with_parameter("mass", M, 30.0, "scales")
        with pytest.raises(LogError, match="gear 1"):
            found.vehicle(bare)
        kept = found.vehicle(bare.with_parameter("transmission", [41, 22, 1], source="guess"))
        assert kept.numbers("transmission")[:2] == (41, 22)
        assert kept.numbers("transmission")[2] == pytest.approx(14, rel=0.02)
        assert "kept from before: gear 1, 2" in kept.parameters["transmission"].source

    def test_several_gears_have_no_one_ratio(self, ratios):
        with pytest.raises(UsageError, match="5 gears"):
            _ = ratios.ratio

    def test_steady_torque(self):
        log = changed(synthetic(60), "engine_torque", lambda x: 0 * x + 80)
        with pytest.raises(LogError, match="engine_torque is 80"):
            identify_ratio(log)


class TestVehicleAgainstLog:
    def worst(self, log: cd.Log, car: cd.Vehicle) -> str:
        return " | ".join(f"{f.severity}: {f.text}" for f in check_vehicle_against_log(log, car) if f.severity != "ok")

    def test_right_vehicle(self, demo, car):
        findings = check_vehicle_against_log(demo.measured, car)
        assert [f.severity for f in findings] == ["ok"] * 4

    @pytest.mark.parametrize(
        ("name", "factor", "words"),
        [
            ("pedal_coefficient", 2.0, "0.5 times (a factor of 2); c_r"),
            ("mass", 2.0, "M is too large"),
            ("mass", 0.5, "M is too small"),
            ("brake_coefficient", 1.6, "c_b or the unit of the pressure"),
        ],
    )
    def test_wrong_parameter(self, demo, car, name, factor, words):
        said = self.worst(demo.measured, car.with_parameter(name, factor * car.number(name), source="wrong"))
        assert said.startswith("bad: ")
        assert words in said
        assert said.count("|") == 0

    def test_wrong_transmission(self, demo, car):
        wrong = car.with_parameter("transmission", [13, 6.9, 4.3, 3.1, 2.5], source="without the radius")
        assert "engine speed over speed" in self.worst(demo.measured, wrong)

    def test_gear_off_by_one(self, demo, car):
        shifted = changed(demo.measured, "gear", lambda g: np.maximum(g - 1, 1))
        said = self.worst(shifted, car)
        assert "that of gear 4 fits" in said
        assert "it differs by gear" in self.worst(shifted.without("engine_speed"), car)

    def test_the_accelerometer_comes_first(self, demo, car):
        """In g it contradicts the change of speed; M, tau and torque are not blamed."""
        said = self.worst(changed(demo.measured, "longitudinal_acceleration", g_units), car)
        assert said.startswith("bad: accelerometer and change of speed")
        assert "M is too" not in said

    def test_bar_for_pascal(self, demo, car):
        assert "bar taken for Pa" in self.worst(changed(demo.measured, "brake_pressure", lambda p: p * 1e-5), car)
        assert "the sign is wrong" in self.worst(changed(demo.measured, "engine_torque", lambda x: -x), car)

    def test_an_engine_that_stands_is_no_engine_speed(self, demo, car):
        still = changed(demo.measured, "engine_speed", lambda x: 0 * x)
        assert [f.severity for f in check_vehicle_against_log(still, car)] == ["ok"] * 3
        assert identify_ratio(still).engine_turns == {}

    def test_nothing_to_judge(self, car, demo):
        assert check_vehicle_against_log(cd.Log({}), car) == ()
        assert check_vehicle_against_log(demo.measured.between(0, 2), car) == ()
        short = demo.measured.without("engine_torque", "accelerator_pedal")
        assert check_vehicle_against_log(short, car) == ()


class TestReport:
    def test_brake(self, fit, car, tmp_path):
        write_document(brake_document(fit, car, "codriver identify brake"), tmp_path / "r.html")
        html = (tmp_path / "r.html").read_text()
        for words in (
            "Figure 1",
            "Figure 2",
            "Autocorrelation",
            "188.",
            "kappa_1 - M d_a",
            "gear shifts, clutch not closed",
        ):
            assert words in html

    def test_brake_without_c_b(self, car, tmp_path):
        found = identify_brake(synthetic(300, brakes=False), car)
        write_document(brake_document(found, car), tmp_path / "r.html")
        assert "c_b was not found" in (tmp_path / "r.html").read_text()

    def test_pedal_and_ratio(self, road, ratios, car, tmp_path):
        write_document(pedal_document(identify_pedal(road), None), tmp_path / "p.html")
        write_document(ratio_document(ratios, car), tmp_path / "q.html")
        assert "Figure 3" in (tmp_path / "p.html").read_text()
        assert "tau/M, gear 5" in (tmp_path / "q.html").read_text()


@pytest.fixture
def run(monkeypatch, capsys):
    """`codriver ...` in this process: exit code, standard output, standard error."""

    def call(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["codriver", *map(str, arguments)])
        code = 0
        try:
            main()
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else 0
        out, err = capsys.readouterr()
        assert "Traceback" not in out + err
        assert "should not have happened" not in err, err
        return code, out, err

    return call


class TestCommand:
    @pytest.fixture
    def can(self, demo_files):
        return demo_files.log, "--dbc", demo_files.dbc, "--names", demo_files.names

    @pytest.mark.parametrize("what", ["brake", "pedal", "ratio"])
    def test_vehicle_report_and_json(self, run, can, tmp_path, what):
        out, report = tmp_path / "v2.toml", tmp_path / "r.html"
        code, text, err = run(
            "identify", what, *can, "--vehicle", "bisoffi2017", "-o", out, "--report", report, "--json"
        )
        assert code == 0, err
        told = json.loads(text)
        new, old = cd.load_vehicle(out), cd.load_vehicle("bisoffi2017")
        changed_ones = {
            "brake": {"brake_coefficient", "rolling_resistance", "drag"}, "pedal": {"pedal_coefficient"}, "ratio": {"transmission"},
        }[what]  # fmt: skip
        assert {name for name in old.parameters if new.parameters[name] != old.parameters[name]} == changed_ones
        for name in changed_ones:
            assert "drive.blf" in new.parameters[name].source
            assert new.parameters[name].sd is not None
        assert told["result"] == str(out)
        assert told["coefficients"]
        assert "</html>" in report.read_text()
        assert sorted(p.name for p in tmp_path.iterdir()) == ["r.html", "v2.toml"]

    def test_help(self, run):
        for command in ((), ("brake",), ("pedal",), ("ratio",)):
            code, text, _ = run("identify", *command, "--help")
            assert code == 0
            assert "Usage: codriver identify" in text

    def test_table(self, run, can, tmp_path):
        code, text, _ = run("identify", "brake", *can, "--vehicle", "bisoffi2017", "-o", tmp_path / "v.toml")
        assert code == 0
        for words in (
            "c_b",
            "N/bar",
            "95 % interval",
            "189.00",
            "left out: ",
            "gear shifts",
            "validation RMSE",
            "answering a constant",
        ):
            assert words in text

    def test_refuses_to_overwrite(self, run, can, tmp_path):
        out = tmp_path / "v.toml"
        out.write_text("mine")
        arguments = ("identify", "pedal", *can, "--vehicle", "bisoffi2017", "-o", out)
        code, _, err = run(*arguments)
        assert code == 2
        assert "--overwrite" in err
        assert out.read_text() == "mine"
        assert run(*arguments, "--overwrite")[0] == 0
        assert cd.load_vehicle(out).name == "v"

    @pytest.mark.parametrize(
        ("options", "words"),
        [
            (("-o", "v.txt"), ".toml"),
            (("-o", "nowhere/v.toml"), "cannot be written"),
            (("-o", "v.toml", "--report", "r.pdf"), ".html"),
        ],
    )
    def test_bad_outputs(self, run, can, tmp_path, monkeypatch, options, words):
        monkeypatch.chdir(tmp_path)
        code, out, err = run("identify", "brake", *can, "--vehicle", "bisoffi2017", *options)
        assert (code, out) == (2, "")
        assert words in err
        assert list(tmp_path.iterdir()) == []

    def test_a_drive_that_tells_nothing(self, run, tmp_path):
        t = np.arange(3000) * 0.01
        table = np.column_stack([t, 20 + 0 * t, 0 * t, 0 * t, 60 + 0 * t, 3 + 0 * t])
        header = "time,longitudinal_speed,longitudinal_acceleration,brake_pressure,engine_torque,gear"
        path = tmp_path / "flat.csv"
        np.savetxt(path, table, "%.6g", ",", header=header, comments="")
        code, _, err = run(
            "identify",
            "brake",
            path,
            "--vehicle",
            "bisoffi2017",
            "-o",
            tmp_path / "v.toml",
            "--report",
            tmp_path / "r.html",
        )
        assert code == 1
        assert "to do:" in err
        assert [p.name for p in tmp_path.iterdir()] == ["flat.csv"]

    @pytest.mark.parametrize("bias", ["nan", "500", "inf"])
    def test_bias_is_checked_first(self, run, can, tmp_path, bias):
        options = ("--vehicle", "bisoffi2017", "-o", tmp_path / "v.toml", "--bias", bias, "--json")
        code, out, err = run("identify", "brake", *can, *options)
        assert (code, out) == (2, "") or code == 1
        assert "an accelerometer's bias" in err
        assert list(tmp_path.iterdir()) == []

    def test_condemned_writes_nothing(self, run, tmp_path, road, car):
        flipped = tmp_path / "flipped.csv"
        names = ("longitudinal_speed", "longitudinal_acceleration", "brake_pressure", "engine_torque", "gear")
        grid = changed(road.between(0, 900), "engine_torque", lambda x: -x).sample(names, 0.02, start=1.0)
        table = np.column_stack([grid.time, *(grid.values[name] for name in names)])
        table = table[np.isfinite(table).all(axis=1)]
        np.savetxt(flipped, table, "%.6g", ",", header="time," + ",".join(names), comments="")
        out = tmp_path / "v.toml"
        code, _, err = run("identify", "brake", flipped, "--vehicle", "bisoffi2017", "-o", out)
        assert code == 1
        assert "for a constant" in err
        assert not out.exists()

    def test_check_vehicle(self, run, can, tmp_path, car):
        log, *options = can
        code, text, _ = run("check", "vehicle", "bisoffi2017", "--log", log, *options)
        assert code == 0
        assert "tau is 0.93" in text
        heavy = save_vehicle(car.with_parameter("mass", 3100, source="wrong"), tmp_path / "heavy.toml")
        code, text, _ = run("check", "vehicle", heavy, "--log", log, *options)
        assert code == 1
        assert "M is too large" in text

    def test_estimate_tells(self, run, can, tmp_path, car):
        log, *options = can
        heavy = save_vehicle(car.with_parameter("mass", 3100, source="wrong"), tmp_path / "heavy.toml")
        told = {}
        for vehicle in ("bisoffi2017", heavy):
            out = tmp_path / "e.parquet"
            code, text, err = run("estimate", "intent", log, *options, "--vehicle", vehicle, "-o", out, "--json")
            assert code == 0, err
            told[Path(vehicle).stem] = json.loads(text)
        said = [f["text"] for f in told["heavy"]["findings"] if f["severity"] == "bad"]
        assert len(said) == 1
        assert said[0].startswith("vehicle file: ")
        assert "do not trust" in told["heavy"]["verdict"]
        assert not any("vehicle file" in f["text"] for f in told["bisoffi2017"]["findings"])


def test_rows_share_one_filter(demo):
    """[y1]_F of the rows is the low-pass of the held samples, whatever else happens."""
    rows = drive_rows([demo.measured], 5, 0.01, known_gears=True)
    y = demo.measured["longitudinal_acceleration"]
    held = np.interp(rows.time, y.time - 0.005, y.values)
    assert np.std(rows.y - low_pass(held, 0.01)) < 0.02


def test_the_report_tells_what_the_log_says_of_the_vehicle(tmp_path):
    """What the terminal says of a wrong c_r stands in the HTML report too."""
    from codriver.cli.estimate import estimate_file
    from codriver.simulate import write_demo

    files = write_demo(tmp_path / "demo")
    wrong = cd.load_vehicle("bisoffi2017")
    wrong = wrong.with_parameter("pedal_coefficient", 2 * wrong.number("pedal_coefficient"))
    save_vehicle(wrong, tmp_path / "wrong.toml")
    report = tmp_path / "report.html"
    estimate_file(
        "intent-pedals",
        files.log,
        tmp_path / "o.parquet",
        str(tmp_path / "wrong.toml"),
        files.dbc,
        files.names,
        report=report,
    )
    text = report.read_text(encoding="utf-8")
    assert "Do not trust this estimate" in text
    assert "vehicle file:" in text
