"""codriver.testing passes on codriver's own parts, and fails on broken ones."""

import dataclasses

import numpy as np
import pytest

import codriver as cd
from codriver.logs.can_trace import read_blf
from codriver.observers import Observer, Output
from codriver.testing import check_observer, check_reader, check_vehicle
from codriver.vehicles import built_in_vehicles


@pytest.mark.parametrize("form", ["kalman", "constant"])
@pytest.mark.parametrize("name", ["intent-pedals", "intent-torque", "kinematic", "pedals-only"])
@pytest.mark.parametrize("dt", [0.01, 0.05])
def test_estimators(name, form, dt, car):
    check_observer(cd.build(name, car, form=form, dt=dt))


@pytest.mark.parametrize("name", built_in_vehicles())
def test_vehicles(name):
    check_vehicle(cd.load_vehicle(name))


def test_blf_reader(demo_files, tmp_path):
    whole = demo_files.log.read_bytes()
    broken = [tmp_path / "cut.blf", tmp_path / "noise.blf", tmp_path / "empty.blf"]
    broken[0].write_bytes(whole[: len(whole) // 2])
    broken[1].write_bytes(np.random.default_rng(0).bytes(5000))
    broken[2].write_bytes(b"")
    check_reader(read_blf, demo_files.log, broken, demo_files.dbc)


def observer(step, **changes) -> Observer:
    fields = dict(
        name="mine", dt=0.01, inputs=("gear",), measured=(), carry={"s": 0.0}, step=step,
        outputs=(Output("y", "1", "estimate"), Output("good", "1", "flag")),
    )  # fmt: skip
    return Observer(**{**fields, **changes})


def test_broken_observers_are_found():
    fine = observer(lambda c, u, y, ok, rho: ({"s": c["s"] + ok["gear"]}, {"y": c["s"], "good": ok["gear"]}))
    check_observer(fine)
    with pytest.raises(AssertionError, match="NaN"):
        check_observer(observer(lambda c, u, y, ok, rho: (c, {"y": u["gear"] * ok["gear"], "good": ok["gear"]})))
    with pytest.raises(AssertionError, match="not always 0 or 1"):
        check_observer(observer(lambda c, u, y, ok, rho: (c, {"y": c["s"], "good": 2 * ok["gear"]})))
    with pytest.raises(AssertionError, match="no standard names"):
        check_observer(dataclasses.replace(fine, inputs=("gearr",)))


def test_broken_vehicle_is_found(car):
    with pytest.raises(AssertionError, match="outside"):
        check_vehicle(car.with_parameter("mass", 1.0))
