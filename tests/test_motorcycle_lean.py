"""The motorcycle at any lean: Sharp's at none, derivatives by differences, the nonlinear machine, energy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import codriver as cd
from codriver.models import MotorcycleParameters, motorcycle_model
from codriver.models.motorcycle_lean import USUAL, LeanParameters, lean_functions
from rides import leaning_ride, machine, vehicle

BARE = {"front_crown": 0.0, "rear_crown": 0.0, "pneumatic_trail": 0.0, "drag": 0.0}


@pytest.fixture(scope="module")
def full() -> LeanParameters:
    return LeanParameters.from_vehicle(vehicle())


@pytest.fixture(scope="module")
def functions(full):
    return lean_functions(full)


def rates(f, x, v, dv):
    return np.asarray(f(x, v, dv, np.sin(x[0]), np.cos(x[0]))).ravel()


@pytest.mark.parametrize("v", [2.0, 20.0, 50.0])
def test_upright_and_bare_it_is_sharps(full, v):
    plant = motorcycle_model(full.sharp)
    A = np.asarray(lean_functions(replace(full, **BARE))[1](np.zeros(10), v, 0, 0, 1)[1])
    np.testing.assert_allclose(A[:, :8], plant.A(v), rtol=1e-10, atol=1e-9)
    np.testing.assert_allclose(A[:, 8:9], plant.B, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize(("v", "dv"), [(20.0, 1.2), (30.0, -5.0), (0.5, 0.0)])
def test_jacobian_by_differences(functions, v, dv):
    f, linear = functions
    x = np.array([0.5, 0.03, -0.2, -0.4, 0.3, 0.2, 300.0, 500.0, 10.0, 5.0])
    A = np.asarray(linear(x, v, dv, np.sin(x[0]), np.cos(x[0]))[1])
    found = np.empty((8, 10))
    for i in range(10):
        h = 1e-5 * max(1.0, abs(x[i]))
        off = np.eye(10)[i] * h
        found[:, i] = (rates(f, x + off, v, dv) - rates(f, x - off, v, dv)) / (2 * h)
    size = np.abs(found).max(axis=1, keepdims=True)
    np.testing.assert_allclose(A / size, found / size, atol=2e-6)


def test_mirrored(functions):
    """Everything to the other side."""
    x = np.array([0.4, 0.02, -0.2, -0.4, 0.3, 0.2, 300.0, 500.0, 10.0, 5.0])
    np.testing.assert_allclose(rates(functions[0], -x, 20.0, 1.0), -rates(functions[0], x, 20.0, 1.0), atol=1e-8)


def test_falls_as_a_pendulum(full):
    """Without tyre forces it turns about its mass centre: in free lean no roll moment but the crown's and the road's push up."""
    p = replace(full, **BARE, sharp=replace(full.sharp, e=0.0, load=0.0, Mf=1e-9, Ifx=1e-9, Ifz=1e-9, Crxz=0.0))
    x = np.zeros(10)
    x[0] = 0.6
    q = p.sharp
    # A body on a frictionless line: centre falls straight, Lagrange's equation of one angle by hand.
    expected = q.Mr * q.g * q.h * np.sin(0.6) / (q.Irx + q.Mr * (q.h * np.sin(0.6)) ** 2)
    assert rates(lean_functions(p)[0], x, 0.0, 0.0)[4] == pytest.approx(expected, rel=1e-6)


def test_against_the_nonlinear_machine(full, functions):
    """Its accelerations along a ride to 30 degrees, beside those of Sharp's model: most of the error is gone."""
    done = leaning_ride()
    true = np.gradient(done.linear, done.time, axis=0)
    pick = np.arange(300, len(done.time) - 100, 20)
    dv = np.gradient(done.speed, done.time)
    plant = motorcycle_model(full.sharp)
    by_lean, by_sharp = [], []
    for k in pick:
        x = np.concatenate([done.linear[k], [done.of("rider_torque")[k], 0.0]])
        by_lean.append(rates(functions[0], x, done.speed[k], dv[k]) - true[k])
        by_sharp.append(plant.A(done.speed[k]) @ x[:8] + plant.B[:, 0] * x[8] - true[k])
    lean, sharp = (np.sqrt(np.mean(np.square(e), axis=0)) for e in (by_lean, by_sharp))
    assert (lean[2:6] < [0.2, 0.2, 0.2, 8.0]).all()
    assert (lean[2:6] < 0.4 * sharp[2:6]).all()


def test_parameters(full):
    assert full.front_crown == USUAL["front_crown_radius"]
    assert full.imu == machine().parameters.imu
    told = vehicle().with_parameter("rear_crown_radius", 0.11, source="measured")
    assert LeanParameters.from_vehicle(told).rear_crown == 0.11
    assert full.crown(-full.sharp.b) == pytest.approx(full.rear_crown)
    assert full.crown(full.sharp.front) == pytest.approx(full.front_crown)
    sharp = MotorcycleParameters.from_vehicle(cd.load_vehicle("sharp1971"))
    assert 0.9 * sharp.h < full.height < sharp.h
