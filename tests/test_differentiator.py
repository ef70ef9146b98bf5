"""Rate of a steer angle, body to road frame, and the low-pass: against closed forms, scipy, and quantised encoders."""

from __future__ import annotations

from math import atan, cos, pi

import numpy as np
import pytest

import codriver as cd
from codriver.errors import DesignError, UsageError
from codriver.models.road_frame import body_frame, by_roll, by_squares, by_turn
from codriver.observers.butterworth import butterworth_filter
from codriver.observers.differentiator import (
    algebraic_differentiator,
    algebraic_taps,
    delay_of,
    kalman_differentiator,
    rate_sd,
)
from codriver.observers.observer import Observer, chain
from codriver.observers.road_frame import road_frame_observer
from codriver.testing import check_observer

COUNT = 2 * pi / 4096  # rad: an encoder of 4096 counts
DT = 0.01


def run(observer: Observer, signals: dict[str, np.ndarray], missing: np.ndarray | None = None) -> dict[str, np.ndarray]:
    n = next(iter(signals.values())).size
    there = np.ones(n, bool) if missing is None else ~missing
    flags = dict.fromkeys(observer.channels, there)
    return cd.compile(observer).run_grid(cd.Grid(np.arange(n) * observer.dt, observer.dt, signals, flags, flags))


def slalom(dt: float = DT, seconds: float = 40.0) -> tuple[np.ndarray, np.ndarray]:
    """A steer angle of some degrees with hands that twitch, and its rate."""
    t = np.arange(round(seconds / dt)) * dt
    parts = ((0.05, 2 * pi * 0.5, 0.0), (0.01, 2 * pi * 1.7, 1.0), (0.002, 2 * pi * 4.0, 2.0))
    angle = sum(a * np.sin(w * t + p) for a, w, p in parts)
    rate = sum(a * w * np.cos(w * t + p) for a, w, p in parts)
    return np.asarray(angle), np.asarray(rate)


def rmse(found: np.ndarray, truth: np.ndarray, late: float, dt: float = DT) -> float:
    """Against the truth so much earlier."""
    t = np.arange(truth.size) * dt
    return float(np.sqrt(np.mean((found - np.interp(t - late, t, truth))[200:] ** 2)))


class TestAlgebraic:
    @pytest.mark.parametrize(("kappa", "mu"), [(0.0, 0.0), (1.0, 0.0), (0.5, -0.5), (2.0, 1.0)])
    def test_is_the_integral(self, kappa, mu):
        """The definition: average of the rate weighted by Beta(mu + 2, kappa + 2), by numerical integration."""
        from scipy.integrate import quad
        from scipy.stats import beta

        M, T = 10, 0.1
        taps = algebraic_taps(DT, T, kappa, mu)
        t = np.arange(M + 1) * DT
        y = np.sin(20 * t) + t**2
        weight = beta(mu + 2, kappa + 2).pdf
        slopes = np.diff(y) / DT
        expected = sum(
            slopes[M - 1 - i] * quad(weight, i / M, (i + 1) / M)[0] for i in range(M)
        )  # fmt: skip
        assert taps @ y[::-1] == pytest.approx(expected, rel=1e-9)
        assert delay_of(taps, DT) == pytest.approx(T * (mu + 2) / (mu + kappa + 4), abs=0.02 * T)

    def test_classic_kernel(self):
        """kappa = mu = 0: 6/T^3 int (T - 2 s) y ds, on a parabola, in the limit of small ticks."""
        from scipy.integrate import quad

        T, dt = 0.1, 0.0005
        taps = algebraic_taps(dt, T)
        now = 0.4
        y = np.exp(now - np.arange(taps.size) * dt)
        exact = 6 / T**3 * quad(lambda s: (T - 2 * s) * np.exp(now - s), 0, T)[0]
        assert taps @ y == pytest.approx(exact, rel=1e-6)

    def test_straight_lines_are_exact(self):
        taps = algebraic_taps(DT, 0.08, 1.0)
        assert taps.sum() == pytest.approx(0, abs=1e-10)
        assert -taps @ np.arange(taps.size) * DT == pytest.approx(1)

    def test_step_is_the_filter(self):
        """Against scipy's lfilter, after the window is full."""
        from scipy.signal import lfilter

        angle, _ = slalom()
        observer = algebraic_differentiator(DT, 0.08)
        found = run(observer, {"steer_angle": angle})
        expected = lfilter(observer.gains["taps"][0], [1.0], angle)
        assert np.allclose(found["steer_rate"][8:], expected[8:], atol=1e-11)
        assert (found["valid"][:8] == 0).all()
        assert (found["valid"][8:] == 1).all()

    def test_a_gap(self):
        angle, _ = slalom()
        missing = np.zeros(angle.size, bool)
        missing[500] = True
        found = run(algebraic_differentiator(DT, 0.08), {"steer_angle": angle}, missing)
        assert (found["valid"][500:509] == 0).all()
        assert found["valid"][509] == 1

    def test_noise_of_a_count(self):
        """Independent roundings: the predicted spread, over a dithered encoder."""
        rng = np.random.default_rng(0)
        angle = 0.3 * np.arange(4000) * DT
        rounded = np.round((angle + rng.uniform(-0.5, 0.5, angle.size) * COUNT) / COUNT) * COUNT
        found = run(algebraic_differentiator(DT, 0.08), {"steer_angle": rounded})["steer_rate"][20:] - 0.3
        predicted = rate_sd(algebraic_taps(DT, 0.08), COUNT / np.sqrt(6))  # rounding and dither alike
        assert found.std() == pytest.approx(predicted, rel=0.08)

    def test_refusals(self):
        for window in (0.001, 5.0):
            with pytest.raises(DesignError, match="window"):
                algebraic_differentiator(DT, window)
        with pytest.raises(DesignError, match="exponents"):
            algebraic_taps(DT, 0.08, -1.0)


class TestKalman:
    def test_band_holds(self):
        """A rate that is what the filter takes it for; a rounded angle: errors are as large as told."""
        rng = np.random.default_rng(1)
        n, q = 6000, 40.0
        slope = np.cumsum(rng.standard_normal(n)) * np.sqrt(q * DT)
        rate = np.append(0, np.cumsum(slope)[:-1] * DT)
        angle = np.append(0, np.cumsum(rate * DT + slope * DT**2 / 2)[:-1])
        observer = kalman_differentiator(DT, COUNT)
        found = run(observer, {"steer_angle": np.round(angle / COUNT) * COUNT})
        error = (found["steer_rate"] - rate)[500:]
        assert 0.7 < np.sqrt(np.mean((error / found["steer_rate_sd"][500:]) ** 2)) < 1.3

    def test_missing_rows(self):
        angle, rate = slalom()
        missing = np.random.default_rng(2).random(angle.size) < 0.3
        observer = kalman_differentiator(DT, COUNT)
        found = run(observer, {"steer_angle": angle}, missing)
        assert rmse(found["steer_rate"], rate, 0.0) < 3 * rmse(
            run(observer, {"steer_angle": angle})["steer_rate"], rate, 0.0
        )

    def test_refusals(self):
        with pytest.raises(DesignError, match="count"):
            kalman_differentiator(DT)
        with pytest.raises(DesignError):
            kalman_differentiator(DT, COUNT, order=3)


class TestOnAnEncoder:
    def test_window_and_way(self):
        """1 kHz, 4096 counts, a rate of 0.139 rad/s rms: a slope over 5 ms errs as much as the rate, one over 80 ms by 4 % of it,
        but 40 ms late; at once the Kalman filter errs least."""
        dt = 0.001
        angle, rate = slalom(dt, 20.0)
        rounded = np.round(angle / COUNT) * COUNT
        errors = {}
        for window in (0.005, 0.02, 0.03, 0.04, 0.06, 0.08):
            observer = algebraic_differentiator(dt, window)
            found = run(observer, {"steer_angle": rounded})["steer_rate"]
            errors[window] = rmse(found, rate, window / 2, dt), rmse(found, rate, 0.0, dt)
        kalman = run(kalman_differentiator(dt, COUNT), {"steer_angle": rounded})["steer_rate"]
        assert errors[0.005][0] > rate.std()
        assert errors[0.08][0] < 0.04 * rate.std()
        assert rmse(kalman, rate, 0.0, dt) < min(own for _, own in errors.values())


class TestRoadFrame:
    @pytest.mark.parametrize("phi", [-0.6, -0.1, 0.3])
    def test_round_trip(self, phi):
        a, W = -2.0, 0.2
        seen = body_frame(phi, a, W)
        back = by_roll(phi, *seen)
        assert back.lateral_acceleration == pytest.approx(a)
        assert back.yaw_rate == pytest.approx(W)
        squares = by_squares(*seen, acceleration_noise=0.0, rate_noise=0.0)
        assert abs(squares.lateral_acceleration) == pytest.approx(abs(a))
        assert squares.yaw_rate == pytest.approx(W)
        assert squares.outside == 0

    @pytest.mark.parametrize("way", [1.0, -1.0])
    def test_balanced_turn(self, way):
        """Nothing is seen along the body's y: the turn is told by the gyroscope, the paper's sign is chance."""
        v, W = 20.0, 0.3 * way
        a = v * W
        phi = -atan(a / 9.81)
        f_y, f_z, q, r = body_frame(phi, a, W)
        assert f_y == pytest.approx(0, abs=1e-12)
        assert q < 0  # the nose of a machine that leans into its turn goes up, to either side
        turn = by_turn(v, r)
        assert turn.lateral_acceleration == pytest.approx(a)
        assert turn.yaw_rate == pytest.approx(W)
        assert turn.outside == turn.doubtful_sign == 0
        left, right = (by_squares(f_y + e, f_z, q, r, acceleration_noise=0.05, rate_noise=1e-3) for e in (0.01, -0.01))
        assert left.lateral_acceleration == pytest.approx(-right.lateral_acceleration, rel=1e-2)
        assert abs(left.lateral_acceleration) == pytest.approx(abs(a), rel=1e-2)
        assert left.doubtful_sign == right.doubtful_sign == 1

    def test_steeper_than_can_be(self):
        assert by_turn(30.0, 0.32).outside == 1
        assert by_turn(30.0, -0.32).yaw_rate == pytest.approx(-0.32 / cos(np.arcsin(0.9)))

    def test_on_a_slalom(self):
        """The paper's (17) on balanced leaning with the noise of a good sensor, beside the turn's way."""
        rng = np.random.default_rng(3)
        t = np.arange(4000) * DT
        v, W = 20.0, 0.15 * np.sin(2 * pi * 0.3 * t)
        a = v * W
        seen = np.array([body_frame(-atan(x / 9.81), x, w) for x, w in zip(a, W, strict=True)]).T
        noisy = [s + sd * rng.standard_normal(t.size) for s, sd in zip(seen, (0.1, 0.1, 0.005, 0.005), strict=True)]
        names = ("lateral_acceleration", "vertical_acceleration", "pitch_rate", "yaw_rate")
        squares = run(road_frame_observer(DT, "squares"), dict(zip(names, noisy, strict=True)))
        turn = run(road_frame_observer(DT, "turn"), {"longitudinal_speed": np.full(t.size, v), "yaw_rate": noisy[3]})
        bad, good = (np.sqrt(np.mean((w["lateral_acceleration"] - a) ** 2)) for w in (squares, turn))
        assert good < 0.15
        assert bad > 15 * good
        assert squares["outside_domain"].mean() > 0.05
        assert squares["sign_doubtful"].mean() > 0.9
        assert turn["sign_doubtful"].max() == turn["outside_domain"].max() == 0

    def test_no_such_way(self):
        with pytest.raises(UsageError, match="squares or turn"):
            road_frame_observer(DT, "guess")  # type: ignore[arg-type]


class TestButterworth:
    @pytest.mark.parametrize("order", [1, 2, 3, 4])
    def test_against_scipy(self, order):
        from scipy.signal import butter, sosfilt, sosfilt_zi

        x = 30 + np.cumsum(np.random.default_rng(4).standard_normal(500))
        sos = butter(order, 5.0, fs=100.0, output="sos")
        expected, _ = sosfilt(sos, x, zi=sosfilt_zi(sos) * x[0])
        found = run(butterworth_filter(DT, ("rider_torque",), 5.0, order), {"rider_torque": x})["rider_torque"]
        assert np.allclose(found, expected, atol=1e-9)

    def test_delay(self):
        ramp = np.arange(3000) * DT
        observer = butterworth_filter(DT, ("rider_torque",), 5.0)
        found = run(observer, {"rider_torque": ramp})["rider_torque"]
        assert ramp[-1] - found[-1] == pytest.approx(observer.settings["filter_delay"], rel=1e-9)
        assert observer.settings["filter_delay"] == pytest.approx(2 / (2 * pi * 5.0), rel=0.02)

    def test_behind_another(self):
        """In a chain the filtered rate takes the place of the raw one."""
        both = chain(algebraic_differentiator(DT), butterworth_filter(DT, ("steer_rate",), 10.0))
        assert [o.name for o in both.outputs] == ["valid", "steer_rate"]
        check_observer(both)

    def test_refusals(self):
        with pytest.raises(DesignError, match="cut-off"):
            butterworth_filter(DT, ("rider_torque",), 60.0)
        with pytest.raises(UsageError):
            butterworth_filter(DT, ("torque_of_the_rider",), 5.0)


@pytest.mark.parametrize(
    "observer",
    [
        algebraic_differentiator(DT), kalman_differentiator(DT, COUNT), road_frame_observer(DT, "squares"),
        road_frame_observer(DT), butterworth_filter(DT, ("rider_torque", "steer_rate"), 5.0),
    ],
    ids=lambda o: o.name,
)  # fmt: skip
def test_checklist(observer):
    check_observer(observer)
