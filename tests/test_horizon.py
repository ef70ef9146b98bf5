"""Error against horizon: rollouts against matrix exponentials and the simulator, errors against sums over the drive itself."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.linalg import expm

from codriver.drivers.learned import rollout
from codriver.drivers.learned.calibration import Calibration
from codriver.drivers.learned.feature_setting import FeatureSetting
from codriver.drivers.learned.features import features_of
from codriver.drivers.learned.horizon import error_against_horizon
from codriver.drivers.learned.horizon_errors import HorizonErrors
from codriver.drivers.learned.learned_driver import LearnedDriver, fit_driver
from codriver.drivers.learned.protocol import Protocol
from codriver.drivers.learned.regressor import TorqueRegressor
from codriver.drivers.learned.rollout import ColumnAndCar, Motion, check_rollable, roll_out, wheel_rates
from codriver.drivers.learned.scaling import Scaling
from codriver.errors import MissingSignal, UsageError
from codriver.signals import Log, Signal
from codriver.simulate.circuit import CircuitSetting, simulate_circuit
from codriver.simulate.circuit_files import circuit_vehicle
from codriver.simulate.rig import RigCar
from codriver.simulate.steering import Wheel
from codriver.vehicles import Vehicle
from driven import driven

WHEEL, CAR = Wheel(0.0298, 0.3515, 0.15), RigCar()
SETTING = FeatureSetting(history=2, preview=0.4)
WIDE = {"driver_torque": 1e6, "steering_wheel_angle": 1e6, "yaw_rate": 1e6, "sideslip_angle": 1e6}


def vehicle(**changes: float) -> Vehicle:
    """That of the circuit."""
    made = circuit_vehicle(CircuitSetting(wheel=WHEEL, car=CAR))
    for name, value in changes.items():
        made = made.with_parameter(name, value)
    return made


class Linear(TorqueRegressor):
    """The torque is a sum of features with given weights."""

    kind = "linear"

    def __init__(self, weights: tuple[float, ...] = ()) -> None:
        self.weights = weights

    def fit(self, X, y, lengths=None):
        return self

    def predict(self, X, return_std=False, lengths=None):
        return X @ np.array(self.weights)

    def state(self):
        return {"weights": list(self.weights)}

    def restore(self, state):
        self.weights = tuple(state["weights"])
        return self


def linear_driver(weights: dict[tuple[str, float], float]) -> LearnedDriver:
    """A driver whose torque is linear in (signal, when)."""
    table = features_of(driven(), SETTING)
    known = tuple(weights.get((f.signal, round(f.when, 6)), 0.0) for f in table.features)
    size = len(table.features)
    return LearnedDriver(
        "linear", "linear", Protocol(features=SETTING), tuple({f.signal for f in table.features} - {table.target}), table.target,
        table.features, Scaling(np.zeros(size), np.ones(size), 0.0, 1.0), Linear(known), Calibration(),
    )  # fmt: skip


STABLE = {
    ("driver_torque", 0.0): 0.4, ("driver_torque", -0.2): 0.1, ("steering_wheel_angle", 0.0): -1.2,
    ("steering_wheel_angle", -0.2): 0.3, ("yaw_rate", 0.0): -0.8, ("sideslip_angle", 0.0): 2.0, ("road_curvature", 0.0): 20.0,
    ("road_curvature", 0.4): 30.0,
}  # fmt: skip


def test_a_linear_driver_and_a_linear_plant_give_the_powers_of_a_matrix(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rollout, "SUBSTEP", 1e-4)
    plant = ColumnAndCar.from_vehicle(vehicle(steering_friction=0.0))
    table = features_of(driven(), replace(SETTING, preview=0.4 + 4 * 0.2))
    rows = np.arange(0, len(table), 97)
    table = table.take(rows)
    rates = np.linspace(-0.3, 0.3, rows.size)
    made = roll_out(linear_driver(STABLE), table, plant, rates, 5, WIDE).torque

    # (delta, omega, beta, r) between moments, the torque a ramp: exactly.
    v = CAR.speed
    A, B = CAR.matrices()
    back = CAR.alignment / CAR.ratio
    F = np.zeros((4, 4))
    F[0, 1] = 1
    F[1] = np.array([-back / CAR.ratio, -WHEEL.damping, back, back * CAR.front / v]) / WHEEL.inertia
    F[2:, 2:], F[2:, 0] = A, B / CAR.ratio
    whole = np.zeros((6, 6))
    whole[:4, :4], whole[1, 4], whole[4, 5] = F, 1 / WHEEL.inertia, 1 / 0.2
    E = expm(0.2 * whole)
    keep, now, ramp = E[:4, :4], E[:4, 4], E[:4, 5]
    column = {(f.signal, round(f.when, 6)): k for k, f in enumerate(table.features)}
    for row in range(rows.size):
        z = {key: float(table.X[row, k]) for key, k in column.items()}
        x = np.array([z["steering_wheel_angle", 0.0], rates[row], z["sideslip_angle", 0.0], z["yaw_rate", 0.0]])
        torque, torque_before, angle_before = (
            z["driver_torque", 0.0],
            z["driver_torque", -0.2],
            z["steering_wheel_angle", -0.2],
        )
        for step in range(5):
            road = [z["road_curvature", round(0.2 * (step + ahead), 6)] for ahead in (0, 2)]
            then = (
                0.4 * torque + 0.1 * torque_before - 1.2 * x[0] + 0.3 * angle_before - 0.8 * x[3] + 2 * x[2]
                + 20 * road[0] + 30 * road[1]
            )  # fmt: skip
            assert made[row, step] == pytest.approx(then, abs=2e-4)
            angle_before = x[0]
            x = keep @ x + now * torque + ramp * (then - torque)
            torque_before, torque = torque, then


def test_the_plant_follows_the_simulator_for_two_seconds() -> None:
    drive = simulate_circuit(CircuitSetting(laps=1, direction="left"))
    plant, k = ColumnAndCar.from_vehicle(vehicle()), np.arange(500, drive.time.size - 300, 37)
    speed = np.full(k.size, CAR.speed)
    motion = Motion(drive.angle[k], drive.rate[k], drive.sideslip[k], drive.yaw_rate[k])
    for step in range(10):
        before, after = (drive.driver_torque[k + 20 * (step + i)] for i in (0, 1))
        motion = plant.advance(motion, speed, before, after, 0.2)
    for mine, true in (
        (motion.angle, drive.angle),
        (motion.sideslip, drive.sideslip),
        (motion.yaw_rate, drive.yaw_rate),
    ):
        assert np.sqrt(np.mean((mine - true[k + 200]) ** 2)) < 0.01 * np.std(true)
    # In a steady turn the lateral acceleration is v r.
    for _ in range(40):
        motion = plant.advance(motion, speed, after, after, 0.2)
    assert np.allclose(plant.lateral_acceleration(motion, speed), CAR.speed * motion.yaw_rate, atol=1e-4)


def test_rate_of_the_wheel_as_logged_or_from_the_angle() -> None:
    drive = simulate_circuit(CircuitSetting(laps=1, direction="left", resolution=0.0))
    time = np.arange(20, 600) * 0.1
    truth = np.interp(time, drive.time, drive.rate)
    assert np.std(wheel_rates(drive.log(), time, 0.1) - truth) < 0.06 * np.std(truth)
    logged = drive.log().with_signals(drive.truth()["steering_wheel_rate"])
    assert np.allclose(wheel_rates(logged, time, 0.1), truth, atol=1e-9)
    # A wheel whose first stamp lies between the ticks of the others is read at their ticks all the same, not later.
    late = Log.of([s.between(0.07, 1e9) if s.name == "steering_wheel_rate" else s for s in logged.values()])
    assert np.allclose(wheel_rates(late, time, 0.1), truth, atol=1e-9)


def test_what_diverges_is_held_and_counted() -> None:
    driver = linear_driver({("driver_torque", 0.0): -3.0})
    table = features_of(driven(), replace(SETTING, preview=0.4 + 9 * 0.2))
    bounds = {"driver_torque": 10.0, "steering_wheel_angle": 4.0, "yaw_rate": 1.0, "sideslip_angle": 0.5}
    made = roll_out(driver, table, ColumnAndCar.from_vehicle(vehicle()), np.zeros(len(table)), 10, bounds)
    assert np.isfinite(made.torque).all()
    assert np.abs(made.torque).max() == 10.0
    assert (np.diff(made.diverged.astype(int), axis=1) >= 0).all()
    first = np.abs(table.X[:, table.torque_columns[0]])
    assert (made.diverged[:, 9] >= (first * 3.0**10 > 10.0)).all()
    assert made.diverged[:, 9].mean() > 0.95
    assert made.diverged[:, 0].mean() < 0.05


@cache
def judged() -> HorizonErrors:
    """Ridge on two laps of a driver who varies."""
    return error_against_horizon({"anna": driven()}, ("ridge",), (0.2, 1.0, 2.0), vehicle())


def test_the_torque_that_stays_and_the_first_step() -> None:
    found, log = judged(), driven()
    torque = log["driver_torque"].values
    # One block of the drive is as long as another, and the ends that have no future are left out.
    rough = [np.sqrt(np.mean((torque[k:] - torque[:-k]) ** 2)) for k in (20, 100, 200)]
    assert np.allclose(found.direct["pwc"], rough, rtol=0.03)
    # One step iterated is one step.
    assert found.iterated["ridge"][0] == pytest.approx(found.direct["ridge"][0], rel=1e-12)
    assert found.road == pytest.approx(3.4)
    assert found.folds == ("A", "B", "C", "D")
    assert found.left_out == ("lateral_acceleration",)


def test_the_road_ahead_makes_two_seconds_little_harder_than_one() -> None:
    found = judged()
    for errors in (found.direct["ridge"], found.iterated["ridge"]):
        assert errors[2] < 0.3 * found.direct["pwc"][2]
        assert errors[2] < 1.4 * errors[1]
    assert found.direct["ridge"][2] < found.iterated["ridge"][2]
    assert (found.diverged["ridge"] == 0).all()
    assert [f.severity for f in found.verdict()] == ["ok", "ok"]


def test_a_vehicle_that_is_wrong_spoils_the_iterated_form_only() -> None:
    wrong = error_against_horizon({"anna": driven()}, ("ridge",), (2.0,), vehicle(alignment_stiffness=2500.0))
    assert wrong.direct["ridge"][0] == pytest.approx(judged().direct["ridge"][2], rel=1e-9)
    assert wrong.iterated["ridge"][0] > 1.5 * judged().iterated["ridge"][2]


def test_without_a_vehicle_or_with_several_drives() -> None:
    drives = {"one": driven(direction="left"), "two": driven(seed=2, direction="left")}
    found = error_against_horizon(drives, ("ridge", "pwc"), (0.4,))
    assert found.folds == ("one", "two")
    assert not found.iterated
    assert list(found.direct) == ["pwc", "pwl", "ridge"]


def test_nothing_of_the_future_but_the_road() -> None:
    drives = {"one": driven(direction="left"), "two": driven(seed=2, direction="left")}
    moment = 60.0

    def spoilt(signal: Signal) -> Signal:
        kept = signal.name in ("road_curvature", "longitudinal_speed")  # together they are the map
        return signal if kept else replace(signal, values=np.where(signal.time > moment + 1e-6, 7.0, signal.values))

    changed = {**drives, "two": Log.of([spoilt(s) for s in drives["two"].values()], source="two")}
    before, after = (error_against_horizon(d, ("ridge",), (0.3, 1.0), vehicle()) for d in (drives, changed))
    for found in (before, after):
        assert found.folds == ("one", "two")
    known = [(f.part == 1) & (f.time <= moment + 1e-6) for f in (before, after)]
    assert known[0].sum() > 500
    for key in before.made:
        assert np.array_equal(before.made[key][known[0]], after.made[key][known[1]])
    assert not np.array_equal(before.truth[known[0]], after.truth[known[1]])


def test_between_steps_the_iterated_torque_runs_straight() -> None:
    found = error_against_horizon({"anna": driven()}, ("ridge",), (0.1, 0.2, 0.3, 0.4), vehicle())
    made = found.made["iterated", "ridge"]
    assert np.allclose(made[:, 0], (found.now + made[:, 1]) / 2)
    assert np.allclose(made[:, 2], (made[:, 1] + made[:, 3]) / 2)
    assert np.allclose(
        found.made["direct", "pwl"][:, 3] - found.now, 4 * (found.made["direct", "pwl"][:, 0] - found.now)
    )


def test_moments_are_matched_on_any_clock() -> None:
    """Stamps since 1970, and between whole ticks: the same errors as from 0 on."""
    log = driven(direction="left")
    moved = Log.of([replace(s, time=s.time + 1479424215.05) for s in log.values()], source="moved")
    plain, late = (error_against_horizon({"a": one}, ("ridge",), (0.2, 1.0), vehicle()) for one in (log, moved))
    assert late.rows == plain.rows
    for key in plain.made:
        assert np.allclose(late.rmse(*key), plain.rmse(*key), rtol=1e-4)


def test_errors_part_by_part() -> None:
    found = judged()
    each, whole = found.parts("direct", "ridge"), found.rmse("direct", "ridge")
    rows = np.bincount(found.part)
    assert np.allclose(np.sqrt((rows[:, None] * each**2).sum(axis=0) / rows.sum()), whole)
    assert np.allclose(found.spread("direct", "ridge"), [np.std(c, ddof=1) / 2 for c in each.T])


def test_moments_inside_the_band_as_a_fit_to_the_other_drive_has_it() -> None:
    drives = {"one": driven(direction="left"), "two": driven(seed=2, direction="left")}
    found = error_against_horizon(drives, ("ridge",), (0.2,))
    made = fit_driver(drives["one"], "ridge").predict(drives["two"])
    at = {round(t, 3): k for k, t in enumerate(made.time)}
    rows = np.flatnonzero(found.part == 1)
    there = [at[round(t, 3)] for t in found.time[rows]]
    inside = (made.measured >= made.low) & (made.measured <= made.high)
    assert np.array_equal(found.inside["ridge"][rows, 0], inside[there])
    assert 0.85 < found.coverage["ridge"][0] < 1
    assert set(found.coverage) == {"pwc", "pwl", "ridge"}


def test_a_road_that_is_not_known_is_no_hindrance() -> None:
    log = Log.of([s for s in driven(direction="left").values() if s.name != "road_curvature"], source="bare")
    found = error_against_horizon({"bare": log}, ("ridge",), (0.2, 0.4), vehicle())
    assert found.road == 0
    assert found.iterated["ridge"][0] == pytest.approx(found.direct["ridge"][0], rel=1e-12)


def test_refusals() -> None:
    log = driven()
    with pytest.raises(UsageError, match=r"horizons 0\.25 s"):
        error_against_horizon({"anna": log}, ("ridge",), (0.25,))
    with pytest.raises(UsageError, match=r"a horizon of 2\.8 s"):
        error_against_horizon({"anna": log}, ("ridge",), (2.6, 2.8))
    with pytest.raises(UsageError, match="has a memory"):
        error_against_horizon({"anna": log}, ("hmm-gmr",), (0.2,), vehicle())
    bare = Log.of([s for s in log.values() if s.name != "sideslip_angle"], source="bare")
    with pytest.raises(MissingSignal, match="bare has no sideslip_angle"):
        error_against_horizon({"bare": bare}, ("ridge",), (0.2,), vehicle())
    with pytest.raises(UsageError, match=r"a horizon of 0\.4 s, to be iterated"):
        check_rollable(fit_driver(log, "pwc", protocol=Protocol().with_features(horizon=0.4)))
    driver, plant = linear_driver(STABLE), ColumnAndCar.from_vehicle(vehicle())
    table = features_of(log, SETTING)
    with pytest.raises(UsageError, match=r"a road that is not known 2 s ahead"):
        roll_out(driver, table, plant, np.zeros(len(table)), 9, WIDE)
