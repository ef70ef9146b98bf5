"""A drive that gives no row of features is told which condition failed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from codriver.drivers.learned.evaluate import evaluate
from codriver.drivers.learned.features import features_of
from codriver.drivers.learned.learned_driver import fit_driver
from codriver.drivers.learned.protocol import Protocol
from codriver.errors import LogError
from codriver.signals import Log, Signal
from driven import driven

PROTOCOL = Protocol()


def a_minute() -> Log:
    """Of a drive."""
    return driven().between(0.0, 60.0)


def every(log: Log, name: str, step: int) -> Log:
    """The log with each step-th value of a signal only."""
    signal = log[name]
    return log.with_signals(replace(signal, time=signal.time[::step], values=signal.values[::step]))


def on_clock(log: Log, factor: float) -> Log:
    """The log with its clock in another unit."""
    return log.with_signals(*(replace(s, time=s.time * factor) for s in log.signals.values()))


def still(log: Log) -> Log:
    """The log of a vehicle that hardly moves."""
    speed = log["longitudinal_speed"]
    return log.with_signals(replace(speed, values=np.full(len(speed), 0.3)))


def holed(log: Log) -> Log:
    """The log with a yaw rate that is there for 0.3 s of four."""
    rate = log["yaw_rate"]
    return log.with_signals(replace(rate, values=np.where(rate.time % 4 < 0.3, rate.values, np.nan)))


def silent(log: Log) -> Log:
    """The log with a yaw rate without values."""
    rate = log["yaw_rate"]
    return log.with_signals(replace(rate, values=np.full(len(rate), np.nan)))


@pytest.mark.parametrize(
    ("log", "said"),
    [
        (every(a_minute(), "driver_torque", 100), "driver_torque comes every 1 s: too slow, as a value counts for 0.5 s"),
        (on_clock(a_minute(), 1e-3), "it lasts 0.06 s by its clock"), (on_clock(a_minute(), 100.0), "wrong unit of time"),
        (still(a_minute()), "never goes faster than 0.3 m/s"), (holed(a_minute()), "yaw_rate is missing most"),
        (silent(a_minute()), "yaw_rate has fewer than two values"), (a_minute().between(0.0, 0.5), "it lasts 0.4"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said(log: Log, said: str) -> None:
    with pytest.raises(LogError, match="no usable row of features in anna 1: ") as refused:
        features_of(log)
    assert said in refused.value.found


def test_one_drive_of_several_without_rows_is_told() -> None:
    drives = {"monday": driven(), "tuesday": every(driven(seed=2), "driver_torque", 100)}
    driver = fit_driver(drives, "pwc", protocol=PROTOCOL)
    assert [f.severity for f in driver.doubts if "tuesday gives no row" in f.text] == ["bad"]
    assert not [f for f in driver.doubts if "monday" in f.text]


def test_what_the_parts_held_out_take_is_said() -> None:
    with pytest.raises(LogError, match=r"of \d+ usable rows to learn from when \w is held out") as refused:
        evaluate({"a": driven().between(0.0, 35.0)}, ["pwc"])
    left, rows, part, gaps = (
        int(word.rstrip(";,")) for word in refused.value.found.split() if word.rstrip(";,").isdigit()
    )
    assert left < 150 <= rows
    assert left + part + gaps == rows


def test_a_signal_of_one_value_is_told() -> None:
    one = Signal("yaw_rate", np.array([1.0]), np.array([0.1]), "rad/s", "x")
    with pytest.raises(LogError, match="yaw_rate has fewer than two values"):
        features_of(a_minute().with_signals(one))
