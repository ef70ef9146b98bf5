"""Features, protocols, smoothing and scaling of learned drivers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from codriver.drivers.learned.feature_setting import HONEST, PAPER2019, FeatureSetting
from codriver.drivers.learned.features import features_of
from codriver.drivers.learned.protocol import PROTOCOLS, Protocol, folds_of, time_blocks
from codriver.drivers.learned.road_ahead import curvature_ahead
from codriver.drivers.learned.scaling import Scaling
from codriver.drivers.learned.smoothing import local_quadratic, low_pass
from codriver.drivers.learned.twice import refuse_twice
from codriver.errors import LogError, MissingSignal, UsageError
from codriver.signals import Log, Signal
from driven import driven

STATES = ("road_curvature", "sideslip_angle", "yaw_rate", "steering_wheel_angle")


def held(log: Log, name: str, time: float) -> float:
    """The newest value at or before a time."""
    signal = log[name]
    return float(signal.values[np.searchsorted(signal.time, time + 1e-6, side="right") - 1])


def test_the_papers_vector_has_29_entries_in_the_order_of_eq_1() -> None:
    table = features_of(driven(), PAPER2019)
    names = [f.signal for f in table.features]
    assert len(names) == 29
    assert names == [*STATES, *(("driver_torque", *STATES) * 5)]
    steps = [round((f.when - PAPER2019.horizon) / PAPER2019.dt) for f in table.features]
    assert steps == [0] * 4 + [-k for k in range(1, 6) for _ in range(5)]


@pytest.mark.parametrize("row", [0, 101, 555, -1])
def test_a_row_holds_what_was_there_at_its_moments(row: int) -> None:
    log = driven()
    table = features_of(log, HONEST)
    now = table.time[row]
    for value, feature in zip(table.X[row], table.features, strict=True):
        if feature.kind != "preview":
            assert value == held(log, feature.signal, now + feature.when)
    assert table.y[row] == held(log, "driver_torque", now + 0.2)


def _disturbed(log: Log, after: float) -> Log:
    """The log with everything but the road changed after a time."""
    changed = [
        Signal(s.name, s.time, np.where(s.time > after, s.values + 0.3, s.values), s.unit, s.source)
        for s in log.values()
        if s.name not in ("road_curvature", "longitudinal_speed")  # these two make the map
    ]
    return log.with_signals(*changed)


def test_an_honest_row_does_not_know_the_future_and_a_row_of_the_paper_does() -> None:
    log, cut = driven(), 60.0
    for setting, same in ((HONEST, True), (PAPER2019, False)):
        before, after = (features_of(one, setting) for one in (log, _disturbed(log, cut)))
        rows = before.time <= cut
        assert np.array_equal(before.X[rows], after.X[after.time <= cut]) is same


def test_a_causal_low_pass_does_not_look_ahead_either() -> None:
    setting, log, cut = FeatureSetting(smoothing="causal"), driven(), 60.0
    before, after = (features_of(one, setting) for one in (log, _disturbed(log, cut)))
    assert np.array_equal(before.X[before.time <= cut], after.X[after.time <= cut])


def test_rows_of_a_stretch_are_dt_apart_and_none_spans_a_hole() -> None:
    log = driven()
    torque = log["driver_torque"]
    gone = (torque.time > 40) & (torque.time < 45)
    holed = log.with_signals(Signal("driver_torque", torque.time[~gone], torque.values[~gone], "N*m", "sensor"))
    table = features_of(holed, HONEST)
    assert sum(table.lengths) == len(table)
    assert len(table.lengths) == 2 * HONEST.substeps
    edges = np.cumsum(table.lengths)
    apart = np.diff(table.time)
    assert np.allclose(np.delete(apart, edges[:-1] - 1), HONEST.dt)
    reach = (HONEST.history - 1) * HONEST.dt
    hold = 0.5  # s; a torque is held that long
    inside = (table.time > 40 + hold + 1e-6) & (table.time - reach < 45 - 1e-6)
    assert not inside.any()


def test_signals_a_drive_lacks_are_left_out_by_name() -> None:
    table = features_of([driven(), driven(seed=2).without("yaw_rate")], HONEST)
    assert "yaw_rate" in table.left_out
    assert all(f.signal != "yaw_rate" for f in table.features)
    assert set(np.unique(table.drive)) == {0, 1}


def test_what_cannot_be_learnt_from_is_refused() -> None:
    with pytest.raises(MissingSignal, match="no torque of the driver"):
        features_of(driven().without("driver_torque"))
    with pytest.raises(LogError, match="no usable row"):
        features_of(driven().between(0.0, 0.7))
    with pytest.raises(UsageError, match="whole number of ticks"):
        FeatureSetting(horizon=0.25)
    with pytest.raises(UsageError, match="smoothing"):
        FeatureSetting(smoothing="loess")


def test_the_road_ahead_is_where_the_vehicle_will_be() -> None:
    dt, n = 0.1, 400
    curvature = np.sin(np.arange(n) / 20)
    ahead = curvature_ahead(curvature, np.full(n, 10.0), dt, (1.0, 2.0))
    assert np.allclose(ahead[:-10, 0], curvature[10:])
    assert np.allclose(ahead[:-20, 1], curvature[20:])
    assert np.isnan(ahead[-1]).all()
    # At half the speed it reaches half as far, whatever comes after.
    speed = np.where(np.arange(n) < 200, 5.0, 10.0)
    ahead = curvature_ahead(curvature, speed, dt, (1.0,))
    assert np.isclose(ahead[100, 0], curvature[110])
    assert np.isclose(
        ahead[195, 0], curvature[np.searchsorted(np.cumsum(speed * dt), np.cumsum(speed * dt)[195] + 5)], atol=0.05
    )


def test_low_pass_has_its_step_response() -> None:
    x = np.r_[np.zeros(1), np.ones(50)]
    y = low_pass(x, 2.5, 0.1)
    assert np.allclose(y, 1 - np.exp(-2.5 * 0.1 * np.arange(51)))
    assert np.isnan(low_pass(np.array([np.nan, 1.0, np.nan]), 1.0, 0.1)[0])


def test_local_quadratic_is_the_weighted_fit_and_keeps_a_parabola() -> None:
    rng, dt, span = np.random.default_rng(3), 0.02, 1.0
    t = np.arange(200) * dt
    parabola = 1 - 2 * t + 0.5 * t**2
    assert np.allclose(local_quadratic(parabola, span, dt), parabola)
    x = rng.standard_normal(t.size)
    made = local_quadratic(x, span, dt)
    for k in (0, 7, 60, 199):
        near = np.abs(np.arange(t.size) - k) <= 25
        u = np.abs(np.arange(t.size)[near] - k) / 26
        fit = np.polynomial.Polynomial.fit(t[near] - t[k], x[near], 2, w=np.sqrt((1 - u**3) ** 3), domain=[-1, 1])
        assert np.isclose(made[k], fit(0.0), atol=1e-9)


def test_scaling_of_the_torque_is_shared_and_comes_back_from_a_file() -> None:
    table = features_of(driven(), HONEST)
    scaling = Scaling.of(table)
    last = table.torque_columns[0]
    assert np.allclose(scaling.features(table.X)[:, last], scaling.torque(table.X[:, last]))
    again = Scaling.from_plain(scaling.as_plain())
    assert np.array_equal(again.features(table.X), scaling.features(table.X))
    mean, sd = scaling.in_newton_metres(scaling.torque(table.y), np.ones(len(table)))
    assert np.allclose(mean, table.y)
    assert np.allclose(sd, scaling.torque_size)


def test_no_moment_of_a_judged_row_is_learnt_from() -> None:
    table = features_of(driven(), HONEST)
    reach = (HONEST.history - 1) * HONEST.dt
    for fold in folds_of(table, Protocol(), ("one",)):
        test, train = table.time[fold.test], table.time[fold.train]
        # [now - reach, now + horizon] of learnt rows never meets that of judged ones, and 5 s lie between.
        first, last = test.min() - reach, test.max() + HONEST.horizon
        assert ((train + HONEST.horizon < first - 4.9) | (train - reach > last + 4.9)).all()


def test_blocks_cover_every_row_once_and_drives_are_held_out_whole() -> None:
    one = features_of(driven(), HONEST)
    folds = time_blocks(one, 4, 5.0, HONEST)
    assert [f.name for f in folds] == ["A", "B", "C", "D"]
    assert np.array_equal(np.sort(np.concatenate([f.test for f in folds])), np.arange(len(one)))
    assert one.time[folds[0].test].min() > one.time[folds[1].test].max()  # A is the last quarter, as in the paper
    two = features_of([driven(), driven(seed=2)], HONEST)
    folds = folds_of(two, Protocol(), ("a", "b"))
    assert [set(two.drive[f.test]) for f in folds] == [{0}, {1}]
    assert not any(set(two.drive[f.test]) & set(two.drive[f.train]) for f in folds)
    with pytest.raises(UsageError, match="one drive"):
        folds_of(one, Protocol(hold_out="drives"), ("a",))


def test_the_papers_protocol_is_told_to_leak_and_the_default_is_not() -> None:
    assert PROTOCOLS["honest"].leaks == ()
    said = " ".join(PROTOCOLS["paper2019"].leaks)
    for word in ("inverse dynamics", "future", "scaling", "no gap", "itself smoothed"):
        assert word in said
    assert "sideslip_angle" in said


def test_taking_rows_ends_stretches_where_rows_are_left_out() -> None:
    table = features_of(driven(), HONEST)
    kept = table.take(np.r_[0:10, 20:30, table.lengths[0] - 5 : table.lengths[0] + 5])
    assert kept.lengths == (10, 10, 5, 5)
    assert np.array_equal(table.in_time().time, np.sort(table.time))


def test_what_varies_less_than_any_sensor_tells_is_not_blown_up() -> None:
    log = driven()
    road = log["road_curvature"]
    noise = 1e-14 * np.random.default_rng(0).standard_normal(len(road))
    straight = log.with_signals(Signal("road_curvature", road.time, noise, road.unit, "a straight"))
    scaling, bends = Scaling.of(features_of(straight)), features_of(log)
    of_road = [k for k, f in enumerate(bends.features) if f.signal == "road_curvature"]
    assert np.abs(scaling.features(bends.X)[:, of_road]).max() < 1.0


def test_one_drive_by_the_clock_of_the_day_is_not_taken_twice() -> None:
    day = 1.5e9

    def at(log: Log, offset: float) -> Log:
        return Log({n: replace(log[n], time=log[n].time + offset) for n in log})

    one, other = driven("anna", seed=1), driven("anna", seed=2)
    refuse_twice({"a": one, "b": other})
    refuse_twice({"a": at(one, day), "b": at(other, day + 86400)})
    with pytest.raises(UsageError, match="a and b are the same recording"):
        refuse_twice({"a": at(one, day), "b": at(other, day + 5)})
    with pytest.raises(UsageError, match="the same recording"):
        refuse_twice({"a": one, "b": one.between(0, 60)})
