"""The motorcycle's linear Kalman filter: against one in numpy, its stationary gains against scipy's Riccati solver, on rides."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm, solve_discrete_are

import codriver as cd
from codriver.errors import UsageError
from codriver.models import MotorcycleParameters, motorcycle_model
from codriver.models.road_frame import by_turn
from codriver.observers import motorcycle_kalman as kalman
from codriver.testing import check_observer
from rides import BIASES, DEGREE, errors, leaning_ride, noisy, ride_log, rms

DT, LOW, HIGH = 0.01, 5.0, 45.0


@pytest.fixture(scope="module")
def model():
    return motorcycle_model(MotorcycleParameters.from_vehicle(cd.load_vehicle("sharp1971"))).with_walking_inputs()


@pytest.fixture(scope="module")
def program(model):
    return cd.compile(kalman.motorcycle_kalman(model, DT))


@pytest.fixture(scope="module")
def constant(model):
    """For samples that do not scatter, so that it is the other form's limit."""
    noise = kalman.LinearNoise(sample=0.0)
    return cd.compile(kalman.motorcycle_kalman(model, DT, form="constant", noise=noise))


@pytest.fixture(scope="module")
def log():
    return ride_log(leaning_ride(), noisy(leaning_ride()), every=10)


def measured(log: cd.Log) -> tuple[np.ndarray, np.ndarray]:
    """The rows of the model, and the speed."""
    grid = log.sample((*kalman.SENSED, kalman.SPEED), DT)
    v = grid.values[kalman.SPEED]
    turn = [by_turn(float(a), float(b)) for a, b in zip(v, grid.values["yaw_rate"], strict=True)]
    sensed = [grid.values[name] for name in kalman.SENSED[:2]]
    return np.column_stack([*sensed, [r.yaw_rate for r in turn], 0 * v]), v


def rows_at(model, v: float) -> np.ndarray:
    """Steer, roll rate, yaw rate, and what is left of a balanced turn."""
    C = np.zeros((4, 9))
    C[0, 1] = C[1, 4] = C[2, 3] = 1
    C[3] = model.C[4]
    C[3, 3] -= v
    return C


def test_against_numpy(model, program, log):
    """Joint updates and matrix exponentials, at a speed that changes from tick to tick."""
    y, v = measured(log)
    noise = kalman.LinearNoise()
    found = program.run(log)
    scatter, rates = np.full(2, 0.05**2), np.column_stack([log[name].values for name in kalman.SENSED[1:]])
    x, P = np.zeros(9), np.diag(kalman.START**2)
    x[[0, 1, 3, 4]] = -v[0] * y[0, 2] / 9.81, y[0, 0], y[0, 2], y[0, 1]
    Q = np.diag(noise.process() * DT)
    for k in range(len(y)):
        if k:
            F = expm(model.A(v[k]) * DT)
            x, P = F @ x, F @ P @ F.T + Q
            if k > 1:
                bend = rates[k] - 2 * rates[k - 1] + rates[k - 2]
                scatter = scatter + (bend**2 / 6 - scatter) / (min(k, kalman.SCATTER_TIME / DT) + 10)
            C = rows_at(model, v[k])
            R = np.diag([noise.encoder**2, noise.gyro**2 + scatter[0], noise.turn**2 + scatter[1], noise.balance**2])
            K = np.linalg.solve(C @ P @ C.T + R, C @ P).T
            x, P = x + K @ (y[k] - C @ x), (np.eye(9) - K @ C) @ P
        for i, name in enumerate(model.states):
            out = "heading_rate" if name == "yaw_rate" else name
            sd = np.sqrt(P[i, i])
            assert abs(found.columns[out][k] - x[i]) < 0.01 * sd + 1e-9, (k, name)
            if i:  # the roll's has what is systematic on top
                assert found.columns[f"{out}_sd"][k] == pytest.approx(sd, rel=0.005), (k, name)


def test_stationary_gains_by_scipy(model):
    made = kalman.design_motorcycle_gains(model, DT, LOW, HIGH)
    noise, W = kalman.LinearNoise(), kalman.SIZES
    for v, K in zip(made.speeds[::4], made.K[::4], strict=True):
        F, c = expm(model.A(v) * W / W[:, None] * DT), rows_at(model, v) * W
        R = np.diag(noise.rows(DT))
        P = solve_discrete_are(F.T, c.T, np.diag(noise.process() * DT / W**2), R)
        expected = P @ c.T @ np.linalg.inv(c @ P @ c.T + R) * W[:, None]
        np.testing.assert_allclose(
            K / W[:, None], expected / W[:, None], atol=1e-6 * np.abs(expected / W[:, None]).max()
        )
    assert made.certificate.holds
    for v in np.linspace(LOW, HIGH, 17):
        closed = expm(model.A(v) * DT) @ (np.eye(9) - made.at(v) @ rows_at(model, v))
        assert np.abs(np.linalg.eigvals(closed)).max() < 1


def test_constant_form_settles_to_the_kalman_form(program, constant):
    """At one speed between two nodes, long after the start, with all rows there."""
    t = np.arange(0, 60, DT)
    turn = 0.2 * np.sin(t)
    values = {
        "steer_angle": 0.01 * np.sin(t),
        "roll_rate": 0.3 * np.cos(t),
        "yaw_rate": turn,
        "longitudinal_speed": 0 * t + 17.3,
    }
    log = cd.Log.of([cd.Signal(name, t, v, "") for name, v in values.items()])
    one, other = program.run(log), constant.run(log)
    for name in ("roll_angle", "rider_torque", "front_lateral_force"):
        sd = one.columns[f"{name}_sd"][-1]
        assert np.abs(one[name].values - other[name].values)[-500:].max() < 0.15 * sd
        assert other.columns[f"{name}_sd"][-1] == pytest.approx(sd, rel=0.05)


def test_ride(program, log):
    done = leaning_ride()
    found = program.run(log)
    assert rms(errors(found, done, "roll_angle")) < 1.8 * DEGREE
    assert rms(errors(found, done, "rider_torque")) < 15
    assert found.valid[250:].all()
    biased = program.run(ride_log(done, noisy(done, **BIASES), every=10))
    for estimate in (found, biased):
        off = np.abs(errors(estimate, done, "roll_angle", kalman.SETTLE))
        assert np.mean(off < 1.96 * estimate.columns["roll_angle_sd"][-off.size :]) > 0.9


def test_flags(program):
    t = np.arange(0, 6, DT)
    speed = np.where(t < 3, 20.0, 50.0)
    values = {"steer_angle": 0 * t, "roll_rate": 0 * t, "yaw_rate": 0 * t, "longitudinal_speed": speed}
    found = program.run(cd.Log.of([cd.Signal(name, t, v, "") for name, v in values.items()]))
    assert np.array_equal(found.columns["speed_in_range"] == 1, speed < 45)
    assert not found.valid[:190].any()
    assert found.valid[210:295].all()
    assert not found.valid[305:].any()


def test_no_such_form(model):
    with pytest.raises(UsageError, match="kalman or constant"):
        kalman.motorcycle_kalman(model, form="euler")


@pytest.mark.slow
@pytest.mark.parametrize("form", ["kalman", "constant"])
def test_checklist(model, form):
    check_observer(kalman.motorcycle_kalman(model, DT, form=form), rows=40)
