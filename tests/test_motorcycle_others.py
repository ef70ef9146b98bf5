"""The motorcycle's unknown-input observer, the IMU baseline, and the family."""

from __future__ import annotations

import shutil
import subprocess

import numpy as np
import pytest
from scipy.linalg import expm

import codriver as cd
from codriver.errors import DesignError
from codriver.export import export_c
from codriver.models import MotorcycleParameters, motorcycle_model
from codriver.models.motorcycle_lean import LeanParameters
from codriver.observers import best, build
from codriver.observers.motorcycle_family import FAMILY
from codriver.observers.motorcycle_imu import ImuNoise, crown_correction, motorcycle_imu
from codriver.observers.motorcycle_uio import design_motorcycle_uio, motorcycle_uio
from codriver.observers.series import series, terms_needed
from codriver.observers.speed_tracker import CARRY, track_speed
from codriver.testing import check_observer
from rides import DEGREE, errors, leaning_ride, noisy, ride_log, rms, scenario, vehicle

LOW, HIGH, DT = 8.0, 40.0, 0.005


@pytest.fixture(scope="module")
def model():
    return motorcycle_model(MotorcycleParameters.from_vehicle(cd.load_vehicle("sharp1971")))


@pytest.fixture(scope="module")
def design(model):
    return design_motorcycle_uio(model, LOW, HIGH, DT)


class TestUnknownInput:
    def test_error_sees_no_torque_at_any_change_of_speed(self, model, design):
        """Machine and observer together in fine steps, speed and torque wild: the error decays as if there were none."""
        rng = np.random.default_rng(2)
        M0, M1, L0, L1 = design.affine()
        W = np.array([0.1, 0.01, 0.5, 0.2, 0.2, 0.2, 300, 300])
        x, z = rng.standard_normal(8) * W, np.zeros(10)
        e = x - (z[:8] - design.E @ model.C @ x)
        h = 1e-4
        for k in range(4000):
            v = LOW + (HIGH - LOW) * (k // 500 % 2)
            torque = 300 * rng.standard_normal()
            big = np.zeros((19, 19))
            big[:8, :8], big[:8, 18] = model.A(v), model.B[:, 0] * torque
            big[8:18, :8], big[8:18, 8:18] = (L0 + v * L1) @ model.C, M0 + v * M1
            moved = expm(big * h) @ np.concatenate([x, z, [1.0]])
            e = expm((M0 + v * M1)[:8, :8] * h) @ e
            x, z = moved[:8], moved[8:18]
            if np.abs(x / W).max() > 1e3:  # nobody rides it
                x, z = x / 1e3, np.append((x / 1e3) + design.E @ model.C @ (x / 1e3) - e, z[8:])
        found = z[:8] - design.E @ model.C @ x
        np.testing.assert_allclose((x - found) / W, e / W, atol=1e-6 * np.abs(x / W).max() + 1e-9)
        assert np.abs(e / W).max() < 3

    def test_torque(self, model, design):
        """On its own model at a speed at which it stays up: a sine of torque, as late as tau."""
        v, t = 9.0, np.arange(0, 10, DT)
        torque = 8 * np.sin(2 * t)
        big = np.zeros((10, 10))
        big[:8, :8], big[:8, 8:9], big[8, 9] = model.A(v), model.B, 1
        F = expm(big * DT)
        x = np.zeros((t.size, 8))
        for k in range(1, t.size):
            x[k] = (F @ [*x[k - 1], torque[k - 1], (torque[k] - torque[k - 1]) / DT])[:8]
        y = x @ model.C.T
        there = np.ones(t.size, bool)
        values = dict(zip(model.outputs, y.T, strict=True)) | {"longitudinal_speed": np.full(t.size, v)}
        flags = dict.fromkeys(values, there)
        found = cd.compile(motorcycle_uio(design, DT)).run_grid(cd.Grid(t, DT, values, flags, flags))
        late = t > 5
        delayed = 8 * (np.sin(2 * t) - 0.1 * np.cos(2 * t)) / 1.01  # 1 / (1 + tau s), tau = 0.05
        assert rms((found["rider_torque"] - delayed)[late]) < 0.02 * rms(torque)
        assert rms((found["roll_angle"] - x[:, 0])[late]) < 0.01 * rms(x[:, 0])
        assert found["valid"][late].all()

    def test_where_there_is_none(self, model):
        """Encoder alone: the torque is not in the angle's first derivative."""
        angle = model.with_outputs({"steer_angle": model.C[0]})
        with pytest.raises(DesignError, match=r"at 8 m/s: no unknown-input observer: rank"):
            design_motorcycle_uio(angle, LOW, HIGH)
        with pytest.raises(DesignError, match="some of steer_angle"):
            design_motorcycle_uio(model.with_outputs({"roll_angle": np.eye(8)[0]}), LOW, HIGH)

    def test_checklist(self, design):
        check_observer(motorcycle_uio(design, DT), rows=40)


class TestImu:
    def test_steady_turn(self):
        """c puts the point mass right in a steady turn, of which the closed form is known."""
        done = leaning_ride()
        p = LeanParameters.from_vehicle(vehicle())
        c = crown_correction(p)
        assert 1.1 < c < 1.25
        log = ride_log(done, noisy(done), every=5)
        found = cd.compile(motorcycle_imu(DT, c)).run(log)
        assert rms(errors(found, done, "roll_angle")) < 2.5 * DEGREE
        assert np.mean(np.abs(errors(found, done, "roll_angle")) < 1.96 * found.columns["roll_angle_sd"][200:]) > 0.9

    def test_is_the_complementary_filter(self):
        """Settled: a constant gain on the rate and on the balanced turn, by scipy's Riccati solver and a loop."""
        noise = ImuNoise()
        t = np.arange(0, 120, DT)
        p, r = 0.2 * np.cos(t) + 0.01, -0.15 * np.sin(t)
        values = {"roll_rate": p, "yaw_rate": r, "longitudinal_speed": np.full(t.size, 15.0)}
        found = cd.compile(motorcycle_imu(DT, noise=noise)).run(
            cd.Log.of([cd.Signal(n, t, v, "") for n, v in values.items()])
        )
        from scipy.linalg import solve_discrete_are

        F, C = np.array([[1, -DT], [0, 1]]), np.array([[1.0, 0.0]])
        R = 2 * noise.turn**2 * noise.lasting / DT
        P = solve_discrete_are(F.T, C.T, np.diag([noise.rate**2, noise.walk**2]) * DT, np.array([[R]]))
        K = (P @ C.T / (P[0, 0] + R)).ravel()
        x = np.array([found.columns["roll_angle"][22000], found.columns["roll_rate_bias"][22000]])
        for k in range(22001, 24000):
            x = F @ x + [DT * (p[k] + p[k - 1]) / 2, 0]
            x = x + K * (np.arcsin(-15 * r[k] / 9.81) - x[0])
        assert x[0] == pytest.approx(found.columns["roll_angle"][23999], abs=2e-4)
        assert x[1] == pytest.approx(found.columns["roll_rate_bias"][23999], abs=2e-4)

    def test_checklist(self):
        check_observer(motorcycle_imu(0.01))


class TestParts:
    def test_series(self):
        A = np.random.default_rng(0).standard_normal((4, 4))
        terms = terms_needed([A], 0.1, 1e-9, 15)
        np.testing.assert_allclose(np.eye(4) + series(A, A, 0.1, terms), expm(0.1 * A), atol=1e-8)
        with pytest.raises(DesignError, match="within 3 terms"):
            terms_needed([100 * A], 0.1, 1e-9, 3)

    def test_speed_tracker(self):
        """A ramp of speed at every tenth tick is followed without lag; the rate too."""
        carry = dict(CARRY)
        for k in range(600):
            carry = track_speed(carry, 10 + 2 * k * 0.01, float(k % 10 == 0), 4.0, 0.01)
        assert carry["speed"] == pytest.approx(10 + 2 * 5.99, abs=1e-3)
        assert carry["speed_rate"] == pytest.approx(2, abs=1e-3)


class TestFamily:
    def test_preference(self):
        done = leaning_ride()
        log = ride_log(done, noisy(done), every=10)
        assert best(log, vehicle(), family=FAMILY).estimator == "motorcycle-ekf"
        assert best(log, None, family=FAMILY).estimator == "motorcycle-imu"
        few = [n for n in log if n not in ("lateral_acceleration", "vertical_acceleration", "pitch_rate")]
        assert best(few, vehicle(), family=FAMILY).estimator == "motorcycle-kalman"

    def test_estimate(self):
        done = leaning_ride()
        log = ride_log(done, noisy(done), every=10)
        made = cd.estimate_log("motorcycle-imu", log, vehicle())
        assert made.provenance["vehicle"] == "sharp1971"

    def test_heading_rate_is_the_roads(self):
        outputs = [o.name for o in build("motorcycle-uio", vehicle(), dt=0.01).outputs]
        assert "heading_rate" in outputs
        assert "yaw_rate" not in outputs


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "form", "real"),
    [
        ("motorcycle-ekf", "kalman", "double"), ("motorcycle-kalman", "constant", "float"), ("motorcycle-ts", "kalman", "float"),
        ("motorcycle-uio", "kalman", "double"),
    ],
)  # fmt: skip
def test_exported(name, form, real, tmp_path):
    """In C as here: bit for bit in double, within the README's tolerance in float."""
    if shutil.which("gcc") is None:
        pytest.skip("gcc is not installed")
    if name == "motorcycle-ts":
        pytest.importorskip("cvxpy")
    export_c(cd.compile(build(name, vehicle(), dt=0.01, form=form)), tmp_path, real)
    sources = sorted(map(str, tmp_path.glob("*.c")))
    strict = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-ffp-contract=off"]
    subprocess.run(["gcc", *strict, *sources, "-o", tmp_path / "check", "-lm"], check=True)
    ran = subprocess.run([tmp_path / "check"], capture_output=True, text=True)
    assert ran.stdout.startswith("ok: 400 rows"), ran.stdout


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "slalom", "lane_change", "torque"),
    [
        ("motorcycle-kalman", 0.5, 0.5, 8), ("motorcycle-ts", 0.5, 0.4, 10), ("motorcycle-uio", 1.6, 1.7, 10),
        ("motorcycle-imu", 1.5, 1.8, None),
    ],
)  # fmt: skip
def test_bounds_on_rides(name, slalom, lane_change, torque):
    """The paper's noise; roll in degrees. The paper's observer, as it has it: 1.53 and 1.55."""
    if name == "motorcycle-ts":
        pytest.importorskip("cvxpy")
    program = cd.compile(build(name, vehicle(), dt=DT))
    for done, most in ((scenario("slalom"), slalom), (scenario("double-lane-change"), lane_change)):
        found = program.run(ride_log(done, noisy(done)))
        assert rms(errors(found, done, "roll_angle")) < most * DEGREE
        if torque is not None:
            assert rms(errors(found, done, "rider_torque")) < torque
