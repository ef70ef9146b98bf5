"""What a wrong names file does to a torque is told before it is learnt."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from codriver.drivers.learned.drive_doubts import correlation, doubts_about, time_between_changes
from codriver.drivers.learned.evaluate import evaluate
from codriver.drivers.learned.learned_driver import fit_driver
from codriver.drivers.learned.protocol import Protocol
from codriver.finding import Finding
from codriver.signals import Log, Signal
from driven import driven

SPARSE = Protocol().with_features(dense=False)


def scaled(log: Log, factor: float) -> Log:
    """The log with another torque."""
    torque = log["driver_torque"]
    return log.with_signals(replace(torque, values=factor * torque.values))


def repeated(log: Log, every: int) -> Log:
    """The log with a torque that takes a new value at every so many samples."""
    torque = log["driver_torque"]
    slow = torque.values[np.arange(len(torque)) // every * every]
    return log.with_signals(replace(torque, values=slow))


def told(**drives: Log) -> list[Finding]:
    """Doubts at the features' tick."""
    return doubts_about(drives, "driver_torque", 0.1)


def test_drives_as_they_are_raise_no_doubt() -> None:
    assert told(monday=driven(), tuesday=driven(seed=2), wednesday=driven("carla", seed=3)) == []


def test_one_of_three_drives_with_the_other_sign_is_named() -> None:
    (found,) = told(monday=driven(), tuesday=scaled(driven(seed=2), -1), wednesday=driven("carla", seed=3))
    assert found.severity == "bad"
    assert "torque of tuesday" in found.text
    assert found.text.endswith("turn the sign in the recording, or leave it out")


def test_of_two_drives_that_contradict_each_other_both_are_named() -> None:
    drives = {"monday": driven(), "tuesday": scaled(driven(seed=2), -1)}
    said = [f.text for f in evaluate(drives, ["pwc"], protocol=SPARSE, calibrate=False).verdict("ridge")]
    assert any("opposite signs" in text and "monday +0." in text and "tuesday -0." in text for text in said)


def test_a_straight_drive_is_not_asked_for_its_sign() -> None:
    torque = driven()["driver_torque"]
    noise = np.random.default_rng(3).standard_normal(len(torque))
    assert told(monday=driven(), tuesday=driven().with_signals(replace(torque, values=noise))) == []


@pytest.mark.parametrize("answer", ["yaw_rate", "road_curvature"])
def test_without_the_angle_the_yaw_rate_is_asked(answer: str) -> None:
    drives = {
        name: log.without(*(n for n in log if n not in ("driver_torque", answer)))
        for name, log in (("a", driven()), ("b", scaled(driven(seed=2), -1)))
    }
    assert bool(told(**drives)) == (answer == "yaw_rate")


def test_a_torque_in_a_wrong_unit_is_told_when_it_is_learnt() -> None:
    driver = fit_driver({"monday": scaled(driven(), 1000)}, "pwc", protocol=SPARSE)
    assert [f.severity for f in driver.doubts] == ["bad"]
    assert "monday" in driver.doubts[0].text
    assert "unit" in driver.doubts[0].text
    (found,) = told(monday=scaled(driven(), 0.02), tuesday=driven(seed=2))
    assert "tuesday is 50 times that of monday" in found.text
    assert len(told(monday=scaled(driven(), 1000), tuesday=driven(seed=2))) == 1


def test_a_slow_torque_repeated_on_quick_rows_is_told() -> None:
    (found,) = told(monday=repeated(driven(), 100), tuesday=driven(seed=2))
    assert "monday changes every 1 s only" in found.text
    assert told(monday=repeated(driven(), 5)) == []


def test_a_coarse_torque_is_not_taken_for_a_slow_one() -> None:
    torque = driven()["driver_torque"]
    assert told(monday=driven().with_signals(replace(torque, values=np.round(torque.values, 1)))) == []
    calm = replace(torque, values=np.round(0.5 * np.sin(0.31 * torque.time) + 0.5 * np.sin(0.17 * torque.time), 1))
    assert np.quantile(time_between_changes(calm), 0.1) > 0.15
    assert told(monday=driven().with_signals(calm)) == []


def test_correlation_and_changes_by_hand() -> None:
    time = np.arange(0.0, 10.0, 0.1)
    wave = Signal("driver_torque", time, np.sin(time), "N*m", "x")
    angle = Signal("steering_wheel_angle", time, 2 * np.sin(time) + np.cos(time), "rad", "x")
    assert correlation(wave, angle) == pytest.approx(np.corrcoef(wave.values, angle.values)[0, 1])
    assert correlation(wave, replace(angle, values=np.ones(time.size))) == 0.0
    steps = Signal(
        "driver_torque", np.array([0.0, 1.0, 2.5, 3.0, 7.0]), np.array([1.0, 2.0, 2.0, 3.0, 4.0]), "N*m", "x"
    )
    assert time_between_changes(steps).tolist() == [2.0, 4.0]
