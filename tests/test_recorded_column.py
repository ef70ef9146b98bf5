"""What two recorded columns tell of the torque balance: a car that is steered by its assistant, and a simulator's."""

from __future__ import annotations

import numpy as np
import pytest

from codriver.papers.steering2019.recorded_column import (
    HANDS_LEAVE,
    Assisted,
    Shaft,
    assisted_column,
    brush,
    correlation_time,
    explained,
    hands_by,
    linear,
    regression,
    shaft,
)
from conftest import recording


def rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(x))))


@pytest.fixture(scope="module")
def car() -> Assisted:
    return assisted_column(recording("comma2k19-rav4"))


@pytest.fixture(scope="module")
def simulator() -> Shaft:
    return shaft(recording("iracing") / "amg.ibt")


class TestAssistedCar:
    """Hands are on before 9 s and off after; the balance is fitted where they are off, the torque sensor is not looked at."""

    def test_the_sensor_itself(self, car):
        on, off = car.span(0, HANDS_LEAVE), car.span(13, 59)
        assert car.raw[on].std() > 6 * car.raw[off].std()
        # For the first three seconds hands do nothing that even the sensor could tell.
        assert car.raw[car.span(0, 3)].std() < car.raw[off].std()

    def test_the_balance_holds_without_hands(self, car):
        fitted, judged = car.span(13, 40), car.span(40, 59)
        estimate = car.estimate(fitted)
        assert 0.6 < explained(car.motor[fitted], car.motor[fitted] + estimate[fitted]) < 0.8
        assert 0.65 < explained(car.motor[judged], car.motor[judged] + estimate[judged]) < 0.85

    def test_the_driver_is_seen_dimly(self, car):
        fitted, on = car.span(13, 40), car.span(0, 8.9)
        estimate = car.estimate(fitted)
        assert rms(estimate[on]) > 1.4 * rms(estimate[car.span(40, 59)])
        assert 0.5 < np.corrcoef(estimate[on], car.sensor[on])[0, 1] < 0.75
        line = np.polyfit(estimate[on], car.sensor[on], 1)
        assert 0.25 < explained(car.sensor[on], np.polyval(line, estimate[on])) < 0.55

    def test_assist_follows_the_driver(self, car):
        on, off = car.span(0, 8.9), car.span(40, 59)
        assert np.corrcoef(car.motor[on], car.sensor[on])[0, 1] > 0.85
        assert np.corrcoef(car.motor[off], car.sensor[off])[0, 1] < 0

    def test_fitted_on_the_other_half_it_tells_nothing(self, car):
        """One minute is too little: the balance of one half is not that of the other, and hands are seen where none are."""
        fitted, judged, on = car.span(35, 59), car.span(13, 35), car.span(0, 8.9)
        estimate = car.estimate(fitted)
        p = hands_by(estimate, rms(estimate[fitted]), correlation_time(estimate[fitted]))
        assert p[judged].mean() > p[on].mean() - 0.1


class TestSimulator:
    """Shaft torque by eq. (92). Fitted up to 38 s, before the quick corners; judged behind, up to the slide at 47 s."""

    def test_sign_and_size(self, simulator):
        """The tyres turn the wheel back to the centre: with the bracket of (92), K is positive."""
        (K, front, ratio), _ = linear(simulator, simulator.time < 38)
        assert 280 < K < 380  # N m/rad at the wheel
        assert 1.3 < front < 2.1
        assert 13 < ratio < 17

    def test_linear(self, simulator):
        s = simulator
        fitted, judged = s.time < 38, (s.time > 38) & (s.time < 47)
        by_slip = linear(s, fitted)[1]
        assert explained(s.torque[fitted], by_slip[fitted]) > 0.97
        assert 0.87 < explained(s.torque[judged], by_slip[judged]) < 0.93
        # Angle alone is far worse, lateral acceleration alone somewhat; the two together are better still.
        assert explained(s.torque[judged], regression(s, fitted, s.angle)[judged]) < 0.75
        assert explained(s.torque[judged], regression(s, fitted, s.lateral)[judged]) < 0.87
        assert explained(s.torque[judged], regression(s, fitted, s.angle, s.lateral)[judged]) > 0.92

    def test_sliding_needs_saturation(self, simulator):
        s = simulator
        fitted, slide = s.time < 41, (s.time > 41) & (s.time < 49)
        assert explained(s.torque[slide], linear(s, fitted)[1][slide]) < 0
        (_, _, _, full), by_brush = brush(s, fitted)
        assert 0.06 < full < 0.13
        assert explained(s.torque[slide], by_brush[slide]) > 0.8
        assert explained(s.torque[slide], regression(s, fitted, s.angle, s.lateral)[slide]) < 0.65
