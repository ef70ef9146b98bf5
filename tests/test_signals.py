"""The sampler: batch equals live, flags mean what they say, faults in stamps do no harm."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import codriver as cd
from codriver.errors import LogError, MissingSignal, UsageError
from codriver.signals import Channel, Sampler
from codriver.signals.sampler import TOLERANCE


@given(
    stamps=st.lists(st.floats(0, 2, allow_nan=False), min_size=1, max_size=60),
    bad=st.integers(0, 5),
    dt=st.sampled_from([0.01, 0.02, 0.05, 0.1]),
    hold=st.sampled_from([0.0, 0.05, 0.3]),
)
@settings(max_examples=200, deadline=None)
def test_batch_equals_live(stamps, bad, dt, hold):
    """Column by column or value by value: the same values and flags on every tick."""
    time = np.sort(np.array(stamps))
    values = np.arange(time.size, dtype=float)
    values[:: bad + 2] = np.nan if bad else values[:: bad + 2]
    signal = cd.Signal("x", time, values, "")
    channel = Channel("x", hold)
    grid = cd.Log.of([signal]).sample([channel], dt, start=0.0, stop=2.0)
    sampler, pushed = Sampler([channel], dt), 0
    for k, tick in enumerate(grid.time):
        while pushed < time.size and time[pushed] <= tick + TOLERANCE:
            sampler.push("x", time[pushed], values[pushed])
            pushed += 1
        row, fresh, held = sampler.row(tick)
        assert row["x"] == grid.values["x"][k] or (np.isnan(row["x"]) and np.isnan(grid.values["x"][k]))
        assert fresh["x"] == grid.fresh["x"][k]
        assert held["x"] == grid.held["x"][k]


def test_hold_by_hand():
    """Values at 0.005, 0.012, 0.018 and 0.055 s on ticks of 10 ms, held for 20 ms."""
    signal = cd.Signal("x", np.array([0.005, 0.012, 0.018, 0.055]), np.array([1.0, 2, 3, 4]), "")
    grid = cd.Log.of([signal]).sample([Channel("x", 0.02)], 0.01, start=0.0, stop=0.06)
    np.testing.assert_array_equal(grid.values["x"], [np.nan, 1, 3, 3, 3, 3, 4])
    np.testing.assert_array_equal(grid.fresh["x"], [0, 1, 1, 0, 0, 0, 1])
    np.testing.assert_array_equal(grid.held["x"], [0, 1, 1, 1, 0, 0, 1])


def test_a_value_late_for_its_tick_is_not_used_early():
    """Live, a stamp from after the tick waits for the next one."""
    sampler = Sampler([Channel("x", 1.0)], 0.01)
    sampler.push("x", 0.015, 7.0)
    assert sampler.row(0.01)[1]["x"] is False
    assert sampler.row(0.02)[0]["x"] == 7.0


def test_missing_channel_is_never_fresh():
    grid = cd.Log.of([cd.Signal("x", np.arange(5) * 0.1, np.ones(5), "")]).sample(["x", "gear"], 0.1)
    assert not grid.fresh["gear"].any()
    assert not grid.held["gear"].any()


@pytest.mark.parametrize("dt", [0.0, -1.0, float("nan"), float("inf")])
def test_bad_tick_is_refused(dt):
    with pytest.raises(UsageError, match="tick"):
        cd.Log.of([]).sample(["gear"], dt)


def test_mixed_clocks_are_refused():
    """Epoch stamps beside stamps from 0 would ask for 1e11 ticks."""
    log = cd.Log.of([cd.Signal("gear", np.array([0.0, 1.7e9]), np.ones(2), "1")])
    with pytest.raises(LogError, match="mixed clocks"):
        log.sample(["gear"], 0.01)


def test_log_never_changes():
    values = np.ones(3)
    signal = cd.Signal("x", np.arange(3.0), values, "")
    with pytest.raises(ValueError, match="read-only"):
        signal.values[0] = 2
    values[0] = 5  # the caller's own array stays his
    log = cd.Log.of([signal])
    assert "y" not in log
    assert "y" in log.with_signals(cd.Signal("y", np.arange(3.0), np.ones(3), ""))
    assert "x" not in log.without("x")
    with pytest.raises(MissingSignal, match="has no signal 'gear'"):
        log["gear"]


def test_wrong_unit_shows_in_the_range():
    log = cd.Log.of([cd.Signal("longitudinal_speed", np.arange(100.0), np.full(100, 130.0), "m/s")])
    assert "is its unit right" in log.implausible()[0]


@pytest.mark.parametrize("time", [[0.0, 2.0, 1.0], [0.0, np.nan, 1.0], [0.0, 1.0, np.nan]])
def test_stamps_that_do_not_run_forward_are_refused(time):
    """Sampling searches the stamps, and would find the wrong values in silence."""
    with pytest.raises(ValueError, match=r"x: stamp \d is .* must be numbers that do not decrease"):
        cd.Signal("x", np.array(time), np.zeros(3), "")
    assert len(cd.Signal("x", np.zeros(3), np.zeros(3), "")) == 3
