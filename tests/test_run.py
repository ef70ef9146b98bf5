"""From a log to an estimate in one call, and the figures that terminal, JSON and report share."""

import numpy as np
import pytest

import codriver as cd
from codriver.errors import MissingSignal, UsageError
from codriver.report.numbers import figures
from codriver.run import choose, estimate_log
from codriver.summary import summarise
from conftest import motion_log
from toy_wheel import toy_wheel, wheel_log


def test_by_name_and_by_family(demo, car):
    by_family = estimate_log("intent", demo.measured, car)
    assert by_family.observer == "intent-pedals"
    by_hand = cd.compile(cd.build("intent-pedals", car, dt=by_family.grid.dt)).run(demo.measured)
    assert by_family.columns["intentional_jerk"].tobytes() == by_hand.columns["intentional_jerk"].tobytes()
    assert estimate_log("kinematic", demo.measured, ell=1.0, rate=50).grid.dt == 0.02


def test_why_it_was_chosen(demo, car):
    log = motion_log(5)[0]
    assert choose("intent", demo.measured, car) == ("intent-pedals", "the best this log can feed")
    name, why = choose("intent", log, car)
    assert name == "kinematic"
    assert "intent-pedals lacks accelerator_pedal" in why
    assert choose("kinematic", log) == ("kinematic", "")
    with pytest.raises(UsageError, match="or intent"):
        choose("intend", log)


@pytest.mark.parametrize("rate", [0.0, -1.0, 1e9, float("nan")])
def test_rates_that_cannot_be(rate):
    with pytest.raises(UsageError, match="rate"):
        estimate_log("kinematic", motion_log(5)[0], rate=rate)


def test_figures_of_a_drive(demo, car):
    estimate = estimate_log("intent-pedals", demo.measured, car)
    told = summarise(estimate)
    jerk = estimate.columns["intentional_jerk"][estimate.valid]
    assert told.estimates["intentional_jerk"].rms == pytest.approx(np.sqrt(np.mean(jerk**2)))
    assert told.valid_share == estimate.valid.mean()
    assert told.shares["braking"] == estimate.flag("braking").mean()
    shifting = estimate.flag("gear_shift").astype(int)
    assert told.gear_shifts == np.sum(np.diff(shifting) == 1) > 3
    assert told.to_dict()["braking_share"] == round(told.shares["braking"], 4)


@pytest.mark.parametrize("name", ["intent-pedals", "pedals-only"])
def test_distance_is_that_of_the_road(name, demo, car):
    """Whether the estimator takes the speed or not; the truth is not far."""
    true = demo.trace["distance"]
    told = summarise(estimate_log(name, demo.measured, car))
    assert told.distance == pytest.approx(true[-1] - true[0], rel=0.01)


def test_report_says_the_same(demo, car):
    estimate = estimate_log("intent-pedals", demo.measured, car)
    told = summarise(estimate)
    rows = {row.name: row.value for row in figures(estimate, told)}
    assert rows["distance"] == f"{told.distance / 1000:.2f} km"
    assert rows["gear shifts"] == str(told.gear_shifts)
    assert rows["braking"] == f"{told.shares['braking']:.1%}"


def test_distance_bridges_a_hole_by_the_estimate():
    log, _ = motion_log(60)
    v = log["longitudinal_speed"]
    kept = (v.time < 20) | (v.time > 25)
    holed = log.with_signals(cd.Signal(v.name, v.time[kept], v.values[kept], "m/s"))
    whole, bridged = (summarise(estimate_log("kinematic", each)).distance for each in (log, holed))
    assert bridged == pytest.approx(whole, rel=0.01)


def test_what_there_is_no_flag_for_is_not_told():
    told = summarise(cd.compile(toy_wheel()).run(wheel_log())).to_dict()
    assert not {"gear_shifts", "braking_share", "standstill_share"} & set(told)
    assert told["distance_m"] is None
    assert set(told["estimates"]) == {"steering_wheel_angle", "driver_torque"}


def test_nothing_valid_has_no_figures():
    t = np.arange(500) / 100
    still = cd.Log.of(
        [cd.Signal(n, t, 0 * t, u) for n, u in (("longitudinal_speed", "m/s"), ("longitudinal_acceleration", "m/s^2"))]
    )
    told = summarise(estimate_log("kinematic", still))
    assert told.valid_share == 0.0
    assert all(f.rms is None and f.mean_sd is None for f in told.estimates.values())


def test_without_valid_there_is_no_summary():
    estimate = cd.compile(cd.build("kinematic"), outputs=["longitudinal_jerk"]).run(motion_log(5)[0])
    with pytest.raises(MissingSignal, match="'valid' was left out"):
        summarise(estimate)
