"""The motorcycle's extended Kalman filter: against a textbook one in numpy, on rides of the nonlinear machine, at rest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

import codriver as cd
from codriver.errors import DesignError
from codriver.models.motorcycle_lean import LeanParameters, lean_functions
from codriver.names import quantity
from codriver.observers import motorcycle_ekf as ekf
from codriver.report.panels import panels
from codriver.simulate.motorcycle import RideSetting, simulate_ride
from codriver.testing import check_observer
from rides import BIASES, DEGREE, errors, leaning_ride, noisy, ride_log, rms, scenario, vehicle


@pytest.fixture(scope="module")
def parameters() -> LeanParameters:
    return LeanParameters.from_vehicle(vehicle())


@pytest.fixture(scope="module")
def program(parameters):
    return cd.compile(ekf.motorcycle_ekf(parameters, 0.005))


def textbook(
    p: LeanParameters, log: cd.Log, dt: float, count: int, noise: ekf.EkfNoise
) -> tuple[np.ndarray, np.ndarray]:
    """The same filter with numpy, matrix exponentials, joint updates, and derivatives of the rows by differences."""
    f = lean_functions(p)[0]
    X, n, Z = p.imu
    rho, g = p.crown(X), p.sharp.g
    grid = log.sample((*ekf.ROWS, ekf.SPEED), dt)
    y = np.column_stack([grid.values[row] for row in ekf.ROWS])
    speed = grid.values[ekf.SPEED]
    v, dv, fade = speed[0], 0.0, np.exp(-ekf.TRACKING * dt)
    var, floors = np.square(list(ekf.SCATTER.values())), np.array(list(noise.floors(dt).values()))
    n_x = len(noise.states)
    decay = np.zeros(n_x)
    decay[9:11] = -1 / ekf.MOMENT_TIME, -1 / ekf.PITCH_TIME

    def rate(x):
        return np.concatenate([np.asarray(f(x[:10], v, dv, np.sin(x[0]), np.cos(x[0]))).ravel(), (decay * x)[8:]])

    def heave(x):
        S, C, rolling = np.sin(x[0]), np.cos(x[0]), rate(x)[4]
        return (rho - Z) * (rolling * S + x[4] ** 2 * C) + n * (rolling * C - x[4] ** 2 * S)

    def rows(x):
        a, S, C = rate(x)[2:5], np.sin(x[0]), np.cos(x[0])
        # Acceleration of the IMU: by its place in the road's frame, turned with W.
        r = np.array([X, -Z * S + n * C, rho * (1 - C) + Z * C + n * S])
        r1 = x[4] * np.array([0, -Z * C - n * S, rho * S - Z * S + n * C])
        r2 = a[2] / x[4] * r1 + x[4] ** 2 * np.array([0, Z * S - n * C, rho * C - Z * C - n * S])
        W = np.array([0, 0, x[3]])
        acc = np.array([dv - x[3] * x[2], a[0] + v * x[3], g]) + r2 + np.cross([0, 0, a[1]], r)
        acc += 2 * np.cross(W, r1) + np.cross(W, np.cross(W, r))
        body = np.array([[0, C, S], [0, -S, C]]) @ acc
        return np.array([x[4], x[10] + x[3] * S, x[3] * C, *body, x[1]]) + np.array(
            [*x[11:16], *(x[16:] if n_x > 16 else [0])]
        )

    def bent(function, x):
        h = 1e-6 * np.maximum(1, np.abs(x))
        return np.column_stack([(function(x + e) - function(x - e)) / (2 * e.sum()) for e in np.diag(h)])

    lean = np.arcsin((y[0, 3] - v * y[0, 2]) / g)
    x, P = np.zeros(n_x), np.diag(np.square(noise.start()))
    turn = y[0, 2] / np.cos(lean)
    share = p.sharp.load / (p.sharp.mass * g)
    x[[0, 1, 3, 4]] = lean, y[0, 5], turn, y[0, 0]
    x[6:8] = p.sharp.mass * v * turn * np.array([share, 1 - share])
    means, sds = [], []
    for k in range(count):
        if k:
            ahead = v + dt * dv
            e = speed[k] - ahead
            v, dv = ahead + (1 - fade**2) * e, dv + (1 - fade) ** 2 / dt * e
            if k > 1:
                bend = y[k, :5] - 2 * y[k - 1, :5] + y[k - 2, :5]
                var = var + (bend**2 / 6 - var) / (min(k, ekf.SCATTER_TIME / dt) + 10)
            A, now = bent(rate, x), rate(x)
            whole = np.zeros((n_x + 1, n_x + 1))
            whole[:n_x, :n_x], whole[:n_x, n_x] = A, now
            moved = expm(whole * dt)
            x, F = x + moved[:n_x, n_x], moved[:n_x, :n_x]
            P = F @ P @ F.T + np.diag(noise.process() * dt)
            R = floors + np.append(var, 0)
            R[[0, 2]] += (noise.tilt * x[[3, 4]]) ** 2 * 2 * ekf.TILT_TIME / dt
            R[4] += (noise.heave * heave(x)) ** 2 * 2 * ekf.HEAVE_TIME / dt
            if noise.zero:
                R[5] += (noise.bend * x[1]) ** 2 * 2 * ekf.BEND_TIME / dt
            R = np.diag(R)
            H = bent(rows, x)
            S = H @ P @ H.T + R
            K = np.linalg.solve(S, H @ P).T
            x, P = x + K @ (y[k] - rows(x)), P - K @ S @ K.T
        means.append(x)
        sds.append(np.sqrt(np.diag(P)))
    return np.array(means), np.array(sds)


class TestAgainstTextbook:
    @pytest.mark.parametrize("zero", [0.0, 0.5 * DEGREE])
    def test_states_and_bands(self, parameters, zero):
        """From the middle of a turn; ours has one derivative from the tick's start."""
        done, dt, count = leaning_ride(), 0.005, 60
        log = ride_log(done, noisy(done), start=1300)
        noise = ekf.EkfNoise(zero=zero)
        found = cd.compile(ekf.motorcycle_ekf(parameters, dt, noise=noise)).run(log)
        x, sd = textbook(parameters, log, dt, count, noise)
        for i, name in enumerate(noise.states):
            size = sd[-1, i] if i else np.hypot(sd[-1, i], noise.share * x[-1, i])  # what is told beside, not carried
            assert np.abs(found[name].values[:count] - x[:, i]).max() < 0.05 * sd[:, i].max(), name
            assert found.columns[f"{name}_sd"][count - 1] == pytest.approx(size, rel=0.01), name


@pytest.fixture(scope="module")
def estimate(program):
    done = leaning_ride()
    return program.run(ride_log(done, noisy(done)))


@pytest.fixture(scope="module")
def quick(parameters):
    return cd.compile(ekf.motorcycle_ekf(parameters, 0.001))


class TestRide:
    def test_lean_torque_forces(self, estimate):
        done = leaning_ride()
        assert rms(errors(estimate, done, "roll_angle")) < 0.5 * DEGREE
        assert rms(errors(estimate, done, "rider_torque")) < 4
        assert rms(errors(estimate, done, "front_lateral_force")) < 25
        assert rms(errors(estimate, done, "rear_lateral_force")) < 25
        assert estimate.valid[100:].all()
        assert estimate.check().trusted

    def test_from_the_middle_of_a_turn(self, program):
        """The log begins at 25 degrees."""
        done = leaning_ride()
        log = ride_log(done, noisy(done), start=1750)
        found = program.run(log)
        assert done.of("roll")[1750] > 24 * DEGREE
        assert found["roll_angle"].values[0] > 15 * DEGREE
        assert rms(errors(found, done, "roll_angle", 0.5)) < 1.5 * DEGREE

    def test_rows_that_are_missing(self, program):
        """Without pitch rate and vertical acceleration, steer at 50 Hz and speed at 10 Hz, never on the same tick."""
        done = leaning_ride()
        full = ride_log(done, noisy(done))
        pick = {"steer_angle": slice(3, None, 20), "longitudinal_speed": slice(7, None, 100)}
        signals = [
            cd.Signal(name, s.time[pick.get(name, slice(None))], s.values[pick.get(name, slice(None))], s.unit)
            for name, s in full.items()
            if name not in ("pitch_rate", "vertical_acceleration")
        ]
        found = program.run(cd.Log.of(signals))
        assert rms(errors(found, done, "roll_angle")) < 1.5 * DEGREE
        assert found.valid[100:].all()
        assert (found.columns["pitch_rate_innovation"] == 0).all()

    def test_an_outage_is_told_and_survived(self, program):
        done = leaning_ride()
        full = ride_log(done, noisy(done))
        there = (full["yaw_rate"].time < 1.5) | (full["yaw_rate"].time > 1.8)
        found = program.run(cd.Log.of([cd.Signal(n, s.time[there], s.values[there], s.unit) for n, s in full.items()]))
        k = int(1.79 / 0.005)
        assert not found.valid[k]
        assert found.columns["roll_angle_sd"][k] > 1.5 * found.columns["roll_angle_sd"][int(1.49 / 0.005)]
        assert found.valid[-100:].all()
        assert rms(errors(found, done, "roll_angle", 2.5)) < 0.6 * DEGREE


def test_report(estimate):
    """Lean first, then torque, forces, steer, biases; flags only where one is raised; truth beside where it is there."""
    done = leaning_ride()
    truth = cd.Log.of([cd.Signal("roll_angle", done.time, done.of("roll"), "rad")])
    made = panels(estimate, truth)
    titles = [panel.title.split(",")[0] for panel in made]
    assert titles[:4] == [
        "Lean of the machine from the vertical", "Torque of the rider on the handlebar", "Lateral forces of the tyres",
        "Steer angle",
    ]  # fmt: skip
    assert len(set(titles)) == len(titles)
    assert [item.name for item in made[0].items] == ["95% band", "estimate, not valid", "estimate", "true"]
    assert {"Biases of the gyroscope", "Biases of the accelerometer", "Flags"} <= set(titles)
    flags = made[titles.index("Flags")]
    assert [line.name for line in flags.items] == ["not valid"]


def at_rest(roll: np.ndarray, t: np.ndarray, gyro_bias: float) -> cd.Log:
    """A machine on its stand, moved by hand, at v = 0."""
    rng = np.random.default_rng(3)
    values = {
        "roll_rate": np.gradient(roll, t) + gyro_bias + 0.005 * rng.standard_normal(t.size),
        "pitch_rate": 0.005 * rng.standard_normal(t.size), "yaw_rate": 0.005 * rng.standard_normal(t.size),
        "lateral_acceleration": 9.81 * np.sin(roll) + 0.1 * rng.standard_normal(t.size),
        "vertical_acceleration": 9.81 * np.cos(roll) + 0.1 * rng.standard_normal(t.size),
        "steer_angle": np.full(t.size, 0.1), "longitudinal_speed": np.zeros(t.size),
    }  # fmt: skip
    return cd.Log.of([cd.Signal(name, t, v, quantity(name).unit) for name, v in values.items()])


class TestAtRest:
    def test_lean_by_gravity(self, program):
        """From 11 degrees to the right over to 9 to the left, with a biased gyroscope; no claim, but a lean with a band."""
        t = np.arange(0, 12, 0.005)
        roll = np.interp(t, [0, 4, 6, 12], [0.2, 0.2, -0.15, -0.15])
        found = program.run(at_rest(roll, t, 0.5 * DEGREE))
        off = found["roll_angle"].values - roll
        assert rms(off[200:]) < 2 * DEGREE
        assert (np.abs(off) < 3 * found.columns["roll_angle_sd"])[200:].all()
        assert found.columns["roll_rate_bias"][-1] == pytest.approx(0.5 * DEGREE, abs=0.1 * DEGREE)
        assert (found.columns["slow"] == 1).all()
        assert (found.columns["speed_in_range"] == 0).all()
        assert not found.valid.any()


class TestDesign:
    def test_too_long_a_tick(self, parameters):
        with pytest.raises(DesignError, match="poles up to"):
            ekf.motorcycle_ekf(parameters, 0.1, high=60)

    @pytest.mark.slow
    def test_checklist(self, parameters):
        check_observer(ekf.motorcycle_ekf(parameters, 0.01), rows=40)


@pytest.mark.slow
class TestBounds:
    """What is to hold with the paper's noise at 1 kHz, on rides that nothing was fitted to: degrees, N m, N."""

    @pytest.mark.parametrize(
        ("name", "roll", "torque", "force"),
        [("slalom", 0.3, 2.5, 20), ("double-lane-change", 0.3, 2.5, 12), ("track", 0.6, 4.5, 40)],
    )
    def test_with_noise(self, quick, name, roll, torque, force):
        done = scenario(name)
        found = quick.run(ride_log(done, noisy(done)))
        assert rms(errors(found, done, "roll_angle")) < roll * DEGREE
        assert rms(errors(found, done, "rider_torque")) < torque
        assert rms(errors(found, done, "front_lateral_force")) < force

    @pytest.mark.parametrize("name", ["slalom", "double-lane-change"])
    def test_biases_are_found(self, quick, name):
        done = scenario(name)
        found = quick.run(ride_log(done, noisy(done, **BIASES)))
        assert rms(errors(found, done, "roll_angle", 4.0)) < 0.5 * DEGREE
        assert found.columns["roll_rate_bias"][-1] == pytest.approx(0.5 * DEGREE, abs=0.15 * DEGREE)

    def test_on_a_banked_road_the_lean_is_from_the_vertical(self, quick):
        """The bank swings to 3 degrees either way; from the road's normal the same estimate errs by it."""
        done = simulate_ride(RideSetting("slalom", rate=1000, bank=3 * DEGREE), seed=1).ride
        found = quick.run(ride_log(done, noisy(done)))
        bank = np.interp(found.time, done.time, done.of("bank"))[found.time >= 1.0 - 1e-9]
        off = errors(found, done, "roll_angle")
        assert rms(off) > 0.8 * rms(bank) > 1.2 * DEGREE
        assert rms(off - bank) < 0.3 * DEGREE
        sd = found.columns["roll_angle_sd"][found.time >= 1.0 - 1e-9]
        assert (np.abs(off - bank) < 1.96 * sd).mean() > 0.9

    @pytest.mark.parametrize("change", ["soft", "heavy"])
    def test_bands_cover_a_wrong_machine(self, parameters, change):
        """95 % bands hold where tyres are 20 % softer, or the rider 20 kg heavier, than told."""
        q = parameters.sharp
        told = {
            "soft": replace(parameters, sharp=replace(q, Cf1=1.25 * q.Cf1, Cr1=1.25 * q.Cr1)),
            "heavy": replace(parameters, sharp=replace(q, Mr=q.Mr - 20, h=q.h - 0.02, load=q.load - 80)),
        }[change]
        outputs = [
            f"{name}{kind}" for name in ("roll_angle", "rider_torque", "front_lateral_force") for kind in ("", "_sd")
        ]
        program = cd.compile(ekf.motorcycle_ekf(told, 0.005), [*outputs, "valid"])
        done = scenario("slalom")
        found = program.run(ride_log(done, noisy(done)))
        for name in outputs[::2]:
            inside = np.abs(errors(found, done, name)) < 1.96 * found.columns[f"{name}_sd"][found.time >= 1.0 - 1e-9]
            assert inside.mean() > 0.9, name
