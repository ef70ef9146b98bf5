"""Estimators by name and family: what they need, which is the best, and one added from outside."""

import dataclasses

import pytest

import codriver as cd
from codriver.errors import MissingSignal, UsageError
from codriver.observers import ESTIMATORS, Estimator, Preset, best, build, families, feeds, register
from codriver.observers.registry import needed_signals
from codriver.vehicles import built_in_vehicles
from toy_wheel import toy_wheel

EVERYTHING = {name for estimator in ESTIMATORS.values() for name in estimator.signals}


@pytest.fixture
def toy():
    """An estimator of another family, there for one test."""
    estimator = Estimator(
        "toy-wheel", (), ("steering_wheel_angle",), "the wheel's torque", "torque",
        lambda vehicle, design: toy_wheel(dt=design.dt),
    )  # fmt: skip
    yield register(estimator)
    del ESTIMATORS["toy-wheel"]


@pytest.mark.parametrize("vehicle", built_in_vehicles())
@pytest.mark.parametrize("name", ESTIMATORS)
def test_needs_are_those_of_the_observer(name, vehicle):
    car, estimator = cd.load_vehicle(vehicle), ESTIMATORS[name]
    if any(p not in car for p in estimator.parameters):
        assert needed_signals(name, car) == estimator.signals
        return
    required = build(name, car).required
    assert needed_signals(name, car) == required
    assert set(estimator.signals) - set(required) <= {"gear"}  # a car of one gear
    assert set(required) <= set(estimator.signals)


def test_best_in_order_of_preference(car):
    assert best(EVERYTHING, car).estimator == "intent-pedals"
    assert best(EVERYTHING - {"brake_pressure"}, car).estimator == "intent-torque"
    assert best(EVERYTHING, None).estimator == "kinematic"
    with pytest.raises(MissingSignal, match=r"at least longitudinal_acceleration and longitudinal_speed \(kinematic\)"):
        best({"gear"}, car)


def test_another_family_is_never_the_best_of_this_one(toy, car):
    angle = {"steering_wheel_angle"}
    assert {"intent", "torque"} <= set(families())
    with pytest.raises(MissingSignal):
        best(angle, car)
    assert best(angle, None, family="torque").estimator == "toy-wheel"
    assert [f.estimator for f in feeds(EVERYTHING, car, "torque")] == ["toy-wheel"]
    assert {f.family for f in feeds(EVERYTHING, car)} == set(families())
    with pytest.raises(UsageError, match="intent, driver-torque, motorcycle, torque"):
        best(angle, None, family="weather")


def test_an_estimator_from_outside_is_built_alike(toy):
    observer = cd.build("toy-wheel", dt=0.02)
    assert (observer.name, observer.dt) == ("toy-wheel", 0.02)
    assert observer.settings["estimator"] == "toy-wheel"
    assert "preset" not in observer.settings


@pytest.mark.parametrize("name", ["kinematic", "intent"])
def test_names_are_taken_once(name):
    with pytest.raises(UsageError, match="free"):
        register(dataclasses.replace(ESTIMATORS["kinematic"], name=name))


def test_presets():
    given = Preset((1e-2, 1e-4, 1e-1, 1.0), (1.0, 1e-2), 2.5, "mine")
    assert cd.build("kinematic").settings["preset"] == "bisoffi2017"
    assert cd.build("kinematic", preset="bisoffi2015").settings["ell"] == 1.4
    own = cd.build("kinematic", preset=given)
    assert (own.settings["preset"], own.settings["ell"]) == ("own", 2.5)


@pytest.mark.parametrize("option", [{"ell": 2.0}, {"preset": "bisoffi2017"}])
def test_what_pedals_only_has_not_is_refused(option, car):
    assert "preset" not in cd.build("pedals-only", car).settings
    with pytest.raises(UsageError, match=r"pedals-only has no (knob|noise)"):
        cd.build("pedals-only", car, **option)


def test_nothing_of_a_design_is_lost(car):
    """`build` renames and adds settings; all else is the chain's."""
    observer = cd.build("intent-torque", car, form="constant")
    assert observer.certificate is not None
    assert observer.certificate.holds
    assert {"L", "K", "P"} <= set(observer.gains)
    assert {"vehicle", "form", "ell", "dt", "preset"} <= set(observer.settings)
