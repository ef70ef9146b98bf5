"""Figures on drives that a driver learnt from, or on another kind of torque, are told to be such."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from codriver.drivers.learned.driver_file import driver_text, parse_driver
from codriver.drivers.learned.fingerprint import KEPT, WINDOW, fingerprint, learnt_from
from codriver.drivers.learned.learned_driver import LearnedDriver, fit_driver
from codriver.drivers.learned.likeness import unfair
from codriver.drivers.learned.protocol import Protocol
from codriver.drivers.learned.recognise import recognise
from codriver.errors import LogError, MissingSignal
from codriver.signals import Signal
from driven import driven

SPARSE = Protocol().with_features(dense=False)


@pytest.fixture(scope="module")
def anna() -> LearnedDriver:
    """A driver as he comes out of his file."""
    return parse_driver(driver_text(fit_driver([driven(), driven(seed=2)], "pwc", name="anna", protocol=SPARSE)), "x")


def test_a_print_is_short_and_that_of_the_values_alone() -> None:
    torque = driven()["driver_torque"]
    mine = fingerprint(torque)
    assert len(mine) == KEPT
    assert mine == fingerprint(replace(torque, time=torque.time + 12.3))
    assert mine == fingerprint(replace(torque, values=torque.values.astype(np.float32).astype(float)))
    assert not set(mine) & set(fingerprint(driven(seed=2)["driver_torque"]))
    assert fingerprint(Signal("driver_torque", np.arange(50.0), np.ones(50), "N*m", "x")) == []


def test_windows_do_not_care_for_repeats_nor_for_gaps() -> None:
    values = np.random.default_rng(2).standard_normal(WINDOW + 3)
    once = Signal("driver_torque", np.arange(values.size, dtype=float), values, "N*m", "x")
    many = np.repeat(values, 3)
    many[1::3] = np.nan
    thrice = Signal("driver_torque", np.arange(many.size, dtype=float), many, "N*m", "x")
    assert fingerprint(once) == fingerprint(thrice)
    assert len(fingerprint(once)) == 4


def test_a_fifth_of_a_drive_learnt_from_is_known_again(anna: LearnedDriver) -> None:
    whole = driven(seed=2)
    length = (whole.stop - whole.start) / 5
    parts = [whole.between(whole.start + k * length, whole.start + (k + 1) * length) for k in range(5)]
    assert all(learnt_from(part["driver_torque"], anna.training["prints"]) for part in parts)
    for other in (driven(seed=7), driven("carla", seed=3)):
        assert not learnt_from(other["driver_torque"], anna.training["prints"])


def test_unfair_figures_are_told(anna: LearnedDriver) -> None:
    assert unfair(anna, driven(seed=7)) == []
    (own,) = unfair(anna, driven())
    assert (own.severity, "anna learnt from" in own.text) == ("bad", True)
    torque = driven(seed=7)["driver_torque"]
    estimated = driven(seed=7).with_signals(replace(torque, source="estimate: driver-torque-pi"))
    (kind,) = unfair(anna, estimated)
    assert kind.severity == "warn"
    assert "anna learnt from was measured" in kind.text
    learnt = fit_driver(estimated, "pwc", protocol=SPARSE)
    (kind,) = unfair(learnt, driven("carla", seed=3))
    assert "learnt from was an estimate" in kind.text


def test_compare_tells_who_learnt_from_the_drive(anna: LearnedDriver) -> None:
    ben = fit_driver(driven("ben"), "pwc", name="ben", protocol=SPARSE)
    found = {one.name: one.unfair for one in recognise(driven(), [anna, ben])}
    assert [f.severity for f in found["anna"]] == ["bad"]
    assert found["ben"] == ()


def test_compare_names_the_driver_whose_signal_the_drive_lacks(anna: LearnedDriver) -> None:
    ben = fit_driver(driven("ben"), "ridge", name="ben", protocol=SPARSE)
    bare = fit_driver(driven().without("yaw_rate"), "ridge", name="bare", protocol=SPARSE)
    with pytest.raises(MissingSignal, match="ben needs what carla 3 lacks") as refused:
        recognise(driven("carla", seed=3).without("yaw_rate"), [bare, ben])
    assert "leave ben out" in refused.value.do
    with pytest.raises(LogError, match="bare: no usable row"):
        recognise(driven("carla", seed=3).between(0, 0.3), [bare, ben])
