"""Hands on or off: the filter against brute force, its calibration where the model is right and where it is not."""

from __future__ import annotations

from dataclasses import replace
from math import inf

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.stats import norm

import codriver as cd
from codriver.errors import UsageError
from codriver.observers.column import logged_column
from codriver.observers.driver_torque import driver_torque_observer
from codriver.observers.hands import SCALES, HandsSettings, hands_observer
from codriver.observers.observer import Observer
from codriver.observers.torque_noise import TorqueNoise
from codriver.simulate.hands import OFF, STEERING, HandsDrives, HandsSetting, simulate_hands
from codriver.simulate.judge_hands import HandsJudged, judge_hands
from codriver.testing import check_observer

DT = 0.01
NAMES = ("driver_torque", "driver_torque_sd", "valid")
NOISE = TorqueNoise(order=1, angle=5e-4, slip=0.0, rate=0.0, torque=3.0)
INDEPENDENT = 1e-6  # s, a correlation time far below the tick: every sample counts in full


def run(observer: Observer, *columns: np.ndarray) -> np.ndarray:
    values = dict(zip(NAMES, columns, strict=True))
    there = {name: np.isfinite(x) for name, x in values.items()}
    n = columns[0].size
    return cd.compile(observer).run_grid(cd.Grid(np.arange(n) * DT, DT, values, there, there))["hands_on"]


def forward(s: HandsSettings, z: np.ndarray, band: np.ndarray, valid: np.ndarray, count: float) -> np.ndarray:
    """The forward algorithm with densities as scipy has them."""
    p, change = s.long_run(), expm(s.rates() * DT)
    on = []
    for zk, sk, good in zip(z, band, valid, strict=True):
        p = p @ change
        if good:
            B = (s.share * sk) ** 2 + s.floor**2
            spreads = [(0.0,), (s.quiet_torque,), tuple(c * s.pulling_torque for c in SCALES)]
            density = [np.mean([norm.pdf(zk, 0, np.sqrt(B + a * a)) for a in group]) for group in spreads]
            p = p * np.array(density) ** count
            p = p / p.sum()
        on.append(p[1] + p[2])
    return np.array(on)


def chained(setting: HandsSetting, walk: float = 3.0) -> Observer:
    car = setting.vehicle()
    first = driver_torque_observer(car, logged_column(car, DT), replace(NOISE, torque=walk), DT)
    return cd.chain(first, hands_observer(DT), "driver-torque-hands")


def probability(drives: HandsDrives, setting: HandsSetting, walk: float = 3.0) -> np.ndarray:
    program = cd.compile(chained(setting, walk), ["hands_on", "valid"])
    return np.array([program.run(drives.log(k)).columns["hands_on"] for k in range(drives.state.shape[0])])


class TestFilter:
    @pytest.mark.parametrize("correlation", [INDEPENDENT, 0.02, 0.5])
    def test_brute_force(self, correlation):
        rng = np.random.default_rng(0)
        z, band = 0.3 * rng.standard_normal(300), rng.uniform(0.05, 0.4, 300)
        valid = (rng.random(300) < 0.8).astype(float)
        settings = HandsSettings(correlation=correlation, quiet_torque=0.1, cap=500.0)
        r = np.exp(-DT / correlation)
        found = run(hands_observer(DT, settings), z, band, valid)
        np.testing.assert_allclose(found, forward(settings, z, band, valid, (1 - r) / (1 + r)), rtol=1e-9, atol=1e-12)

    def test_a_missing_value_is_as_an_invalid_one(self):
        rng = np.random.default_rng(1)
        z, band, valid = rng.standard_normal(100), np.full(100, 0.1), np.ones(100)
        holes = z.copy()
        holes[40:60], valid[40:60] = np.nan, 0.0
        np.testing.assert_array_equal(
            run(hands_observer(DT), holes, band, np.ones(100)), run(hands_observer(DT), z, band, valid)
        )

    def test_without_an_estimate_it_forgets(self):
        s = HandsSettings()
        long_run = expm(s.rates() * 1e4)[0]
        np.testing.assert_allclose(s.long_run(), long_run, atol=1e-9)
        n = 60_000
        z = np.where(np.arange(n) < 500, 2.0, 0.0)
        p = run(hands_observer(DT, s), z, np.full(n, 0.1), np.where(np.arange(n) < 500, 1.0, 0.0))
        assert p[499] > 0.99
        assert 0.6 < p[499 + 1000] < p[499]
        assert p[-1] == pytest.approx(1 - long_run[0], abs=1e-3)

    def test_long_run_share_of_two_states(self):
        s = HandsSettings(off_dwell=30, on_dwell=10, pulling_dwell=inf, pulling_first=1)
        np.testing.assert_allclose(s.long_run(), [0.75, 0, 0.25], atol=1e-12)

    def test_one_wild_sample_does_not_decide(self):
        z, one = np.zeros(4000), np.ones(4000)
        z[3000] = 500.0
        p = run(hands_observer(DT, HandsSettings(correlation=0.3)), z, 0.1 * one, one)
        assert p[2999] < 0.35
        assert p[3000] < 0.5
        assert abs(p[3001] - p[2999]) < 0.15

    def test_certain_to_the_last_bit_it_stays_a_probability(self):
        z, one = np.full(5000, 50.0), np.ones(5000)
        p = run(hands_observer(DT, HandsSettings(correlation=INDEPENDENT)), z, 0.1 * one, one)
        assert 0.999 < p[-1] <= 1
        assert np.isfinite(p).all()

    def test_behind_the_torque_observer(self, tmp_path):
        setting = HandsSetting(seconds=20.0)
        check_observer(chained(setting))
        result = cd.compile(chained(setting)).run(simulate_hands(setting).log())
        cd.write_report(result, tmp_path / "report.html")
        assert "hands_on" in (tmp_path / "report.html").read_text()

    def test_floor_of_a_stretch_without_hands(self):
        rng = np.random.default_rng(2)
        band = rng.uniform(0.2, 0.4, 100_000)
        s = HandsSettings(share=0.5, floor=0.1)
        z = np.sqrt((0.5 * band) ** 2 + 0.3**2) * rng.standard_normal(band.size)
        assert s.floored(z, band).floor == pytest.approx(0.3, rel=0.01)
        assert s.floored(0 * z, band).floor == pytest.approx(0.01)

    @pytest.mark.parametrize(
        "wrong",
        [{"floor": 0.0}, {"on_dwell": -1.0}, {"off_dwell": inf}, {"pulling_first": 1.5}, {"correlation": np.nan}],
    )
    def test_what_cannot_be_is_refused(self, wrong):
        with pytest.raises(UsageError, match=next(iter(wrong))):
            hands_observer(DT, HandsSettings(**wrong))


class TestCalibration:
    """Samples made by the filter's own model: p must be what it says, within what chance allows."""

    @staticmethod
    def made(s: HandsSettings, n: int, correlation: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
        """z that is alike over `correlation`, s; and whether hands are on."""
        rng = np.random.default_rng(seed)
        change, state, states = expm(s.rates() * DT).cumsum(1), 0, np.empty(n, int)
        for k, u in enumerate(rng.random(n)):
            state = int(np.searchsorted(change[state], u))
            states[k] = min(state, 2)
        keep = np.exp(-DT / correlation)
        noise = np.empty((2, n))
        noise[:, 0] = rng.standard_normal(2)
        kicks = np.sqrt(1 - keep**2) * rng.standard_normal((2, n))
        for k in range(1, n):
            noise[:, k] = keep * noise[:, k - 1] + kicks[:, k]
        spread = np.array([0.0, s.quiet_torque, s.pulling_torque])[states]
        if correlation < DT:
            spread *= np.where(states == 2, rng.choice(SCALES, n), 1.0)
        return s.floor * noise[0] + spread * noise[1], (states > 0).astype(float)

    QUICK = HandsSettings(
        off_dwell=5,
        on_dwell=6,
        quiet_dwell=2,
        pulling_dwell=2,
        share=1,
        floor=0.1,
        quiet_torque=0.02,
        pulling_torque=0.3,
    )

    def judged(self, s: HandsSettings, assumed: float, true: float) -> HandsJudged:
        observer = hands_observer(DT, replace(s, correlation=assumed))
        made = [self.made(s, 30_000, true, seed) for seed in range(4)]
        z, on = (np.array(x) for x in zip(*made, strict=True))
        one = np.ones(30_000)
        return judge_hands(np.array([run(observer, x, 1e-6 * one, one) for x in z]), on, DT)

    def test_exact_where_the_model_is(self):
        # Dwell times of a fraction of a second, so that 20 minutes hold some thousand changes.
        often = replace(self.QUICK, off_dwell=0.5, on_dwell=0.6, quiet_dwell=0.2, pulling_dwell=0.2)
        judged = self.judged(often, INDEPENDENT, INDEPENDENT)
        assert judged.calibration_error < 0.015
        for b in judged.bins:
            assert b.share < 0.01 or abs(b.said - b.found) < 0.04

    @pytest.mark.slow
    def test_correlated_samples_need_the_tempering(self):
        right, naive = self.judged(self.QUICK, 0.3, 0.3), self.judged(self.QUICK, INDEPENDENT, 0.3)
        assert right.calibration_error < 0.08 < naive.calibration_error
        assert right.log_loss < 0.85 * naive.log_loss


class TestJudge:
    def test_by_hand(self):
        on = np.array([[0, 0, 0, 1, 1, 1, 1, 0, 0, 0.0]])
        p = np.array([[0.2, 0.6, 0.2, 0.2, 0.2, 0.8, 0.8, 0.8, 0.8, 0.2]])
        judged = judge_hands(p, on, 0.5)
        assert judged.on_delay == 1.0
        assert judged.off_delay == 1.0
        assert judged.on_missed == judged.off_missed == 0
        # One rise above 0.5 in 6 ticks of hands off, 3 s.
        assert judged.false_alarms == pytest.approx(1200)
        assert judged.brier == pytest.approx(np.mean((p - on) ** 2))
        assert judged.log_loss == pytest.approx(-np.log([0.8, 0.4, 0.8, 0.2, 0.2, 0.8, 0.8, 0.2, 0.2, 0.8]).mean())
        table = {b.low: (b.share, b.said, b.found) for b in judged.bins if b.share}
        assert table[0.2] == pytest.approx((0.5, 0.2, 0.4))
        assert table[0.8] == pytest.approx((0.4, 0.8, 0.5))
        assert judged.calibration_error == pytest.approx(0.5 * 0.2 + 0.1 * 0.6 + 0.4 * 0.3)

    def test_never_told(self):
        judged = judge_hands(np.full((1, 6), 0.3), np.array([[0, 0, 1, 1, 0, 0.0]]), 1.0)
        assert judged.on_delay == inf
        assert judged.on_missed == 1


class TestSimulated:
    SHORT = HandsSetting(seconds=120.0)

    def test_the_column_turns_by_its_torques(self):
        """J delta'' + b delta' + friction is the sum of the torques, by differences of the angle."""
        frictionless = replace(self.SHORT, wheel=replace(self.SHORT.wheel, friction=0.0))
        d = simulate_hands(frictionless, seed=3)
        wheel, delta = frictionless.wheel, d.angle[0]
        second = (delta[2:] - 2 * delta[1:-1] + delta[:-2]) / DT**2
        first = (delta[2:] - delta[:-2]) / (2 * DT)
        total = (d.driver_torque + d.motor_torque + d.alignment_torque)[0]
        held = (total[1:-1] + total[:-2]) / 2
        error = wheel.inertia * second + wheel.damping * first - held
        assert np.sqrt(np.mean(error**2)) < 0.02 * np.sqrt(np.mean(held**2)) + 0.01

    def test_hands_and_lane(self):
        d = simulate_hands(self.SHORT, drives=6, seed=4)
        assert (d.driver_torque[d.state == OFF] == 0).all()
        assert np.abs(d.driver_torque[d.state == STEERING]).mean() > 0.2
        assert np.abs(d.offset).max() < 1.2
        assert 0.2 < d.hands_on.mean() < 0.9
        log, truth = d.log(2), d.truth(2)
        assert set(log) == {"steering_wheel_angle", "alignment_torque"}
        np.testing.assert_array_equal(truth["hands_on"].values, d.state[2] != OFF)

    def test_a_drive_is_that_of_its_seed(self):
        one, two = (
            simulate_hands(replace(self.SHORT, seconds=20.0), drives=1),
            simulate_hands(replace(self.SHORT, seconds=20.0), drives=2),
        )
        np.testing.assert_array_equal(one.measured[0], two.measured[0])
        assert not np.array_equal(two.measured[0], two.measured[1])


@pytest.mark.slow
class TestSimulatedDrives:
    """Drives of other seeds than those the defaults were fitted on."""

    @pytest.mark.parametrize("walk", [1.0, 3.0, 8.0])
    def test_calibrated_and_telling(self, walk):
        setting = HandsSetting()
        drives = simulate_hands(setting, drives=8, seed=900)
        judged = judge_hands(probability(drives, setting, walk), drives.hands_on, DT)
        share = judge_hands(np.full(drives.state.shape, drives.hands_on.mean()), drives.hands_on, DT)
        assert judged.calibration_error < 0.1
        assert judged.log_loss < 0.75 * share.log_loss
        assert judged.brier < 0.7 * share.brier

    def test_errors_of_the_model_want_a_floor(self):
        """With friction that the torque observer knows dimly, the defaults are too sure; a stretch without hands mends most."""
        base = HandsSetting()
        setting = replace(base, wheel=replace(base.wheel, friction=0.4))
        car = setting.vehicle()
        observer = driver_torque_observer(car, logged_column(car, DT), NOISE, DT)
        program, drives, other = cd.compile(observer), *(simulate_hands(setting, drives=4, seed=k) for k in (910, 911))
        known = [program.run(other.log(k)).columns for k in range(4)]
        columns = [np.array([c[name] for c in known]) for name in NAMES]
        off = (other.state == OFF) & (columns[2] > 0)
        fitting = HandsSettings().floored(columns[0][off], columns[1][off])
        seen = [program.run(drives.log(k)).columns for k in range(4)]
        plain, mended = (
            judge_hands(
                np.array([run(hands_observer(DT, s), *(c[name] for name in NAMES)) for c in seen]), drives.hands_on, DT
            )
            for s in (HandsSettings(), fitting)
        )
        assert mended.log_loss < 0.55 < 0.6 < plain.log_loss
        assert mended.calibration_error < 0.1
