"""The bicycle's Kalman filter: against one in numpy, its bands on its own model, a ride, and two recorded bicycles."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from dataclasses import replace
from math import cos

import numpy as np
import pytest
from scipy.linalg import expm

import codriver as cd
from codriver.cli import main
from codriver.export import export_c
from codriver.models import BicycleParameters, bicycle_matrices
from codriver.models.bicycle import bicycle_lpv
from codriver.observers import best, build
from codriver.observers.bicycle_kalman import (
    GYRO,
    NEEDED,
    SCATTER_TIME,
    SENSED,
    SPEED,
    STATES,
    BicycleNoise,
    augmented_bicycle,
    bicycle_kalman,
)
from codriver.testing import check_observer
from conftest import ROOT, recording

DT, DEGREE = 0.01, np.pi / 180
NAMES = ROOT / "tests" / "names"


@pytest.fixture(scope="module")
def benchmark() -> BicycleParameters:
    return BicycleParameters.from_vehicle(cd.load_vehicle("meijaard2007"))


def arm(p: BicycleParameters) -> float:
    return -p.g * float(bicycle_matrices(p).K0[0, 0])


def yaw_row(p: BicycleParameters, v: float) -> np.ndarray:
    """Of the yaw rate on the augmented states, by the steer axis's tilt, the wheelbase and the trail."""
    row = np.zeros(8)
    row[1], row[3] = v * cos(p.lam) / p.w, p.c * cos(p.lam) / p.w
    return row


def drawn(p: BicycleParameters, noise: BicycleNoise, v: float, seconds: float, seed: int) -> tuple[cd.Log, np.ndarray]:
    """A ride that the filter's own model makes, and its states; the speed is one at which the bicycle balances by itself."""
    rng = np.random.default_rng(seed)
    model = augmented_bicycle(bicycle_matrices(p).to_iso(), noise.lasting)
    F, n = expm(model.A(v) * DT), round(seconds / DT)
    shake = np.sqrt(noise.process(arm(p)) * DT)
    x = np.zeros((n, 8))
    x[0] = np.array([0, 0, 0, 0, 0, 0, 1, 1]) * np.sqrt(noise.start(arm(p))) * rng.standard_normal(8)
    for k in range(1, n):
        x[k] = F @ x[k - 1] + shake * rng.standard_normal(8)
    seen = {
        "steer_angle": x[:, 1] + x[:, 7] + noise.encoder * rng.standard_normal(n),
        "roll_rate": x[:, 2] + x[:, 6] + 0.02 * rng.standard_normal(n),
        "yaw_rate": x @ yaw_row(p, v) + 0.02 * rng.standard_normal(n),
        SPEED: np.full(n, v),
    }
    time = np.arange(n) * DT
    return cd.Log.of([cd.Signal(name, time, values, "") for name, values in seen.items()]), x


def balanced(p: BicycleParameters, seconds: float = 40.0, seed: int = 3) -> tuple[cd.Log, dict[str, np.ndarray]]:
    """A ride from 3 to 7 m/s: a rider who steers into the fall and swings, pulls at the frame, sensors with noise and biases."""
    rng = np.random.default_rng(seed)
    lpv, dt = bicycle_lpv(bicycle_matrices(p).to_iso()), 1e-3
    n = round(seconds / dt)
    t = np.arange(n) * dt
    v = 5 - 2 * np.cos(2 * np.pi * t / seconds)
    pull = 40.0 * ((t % 8) > 7.6)
    x, torque = np.zeros((n, 4)), np.zeros(n)
    for k in range(n - 1):
        torque[k] = (
            -12 * x[k, 2] * max(6.5 - v[k], 0.3) - 8 * x[k, 0] + 2.0 * np.sin(2.5 * t[k]) + 1.5 * np.sin(0.9 * t[k])
        )
        x[k + 1] = x[k] + dt * (lpv.A(v[k]) @ x[k] + lpv.B @ [pull[k], torque[k]])
    every = slice(None, None, 10)
    truth = {"roll_angle": x[every, 0], "rider_torque": torque[every], "steer_angle": x[every, 1]}
    m = truth["roll_angle"].size
    rate = np.array([yaw_row(p, a) @ np.r_[s, np.zeros(4)] for a, s in zip(v[every], x[every], strict=True)])
    seen = {
        "steer_angle": np.round((x[every, 1] + 0.01) / 7.7e-4) * 7.7e-4,
        "roll_rate": x[every, 2] + 0.01 + 0.01 * rng.standard_normal(m),
        "yaw_rate": rate + 0.01 * rng.standard_normal(m),
        SPEED: v[every],
    }
    return cd.Log.of([cd.Signal(name, t[every], values, "") for name, values in seen.items()]), truth


def rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.mean(x**2)))


def test_against_numpy(benchmark):
    """Joint updates, matrix exponentials, a speed that changes and a yaw rate that comes every third tick."""
    log, _ = balanced(benchmark, 5.0)
    yaw = log["yaw_rate"]
    log = log.with_signals(cd.Signal("yaw_rate", yaw.time[::3], yaw.values[::3], ""))
    noise = BicycleNoise()
    found = cd.compile(bicycle_kalman(benchmark, DT)).run(log)
    grid = log.sample((*SENSED, SPEED), DT)
    model = augmented_bicycle(bicycle_matrices(benchmark).to_iso(), noise.lasting)
    y, v = np.column_stack([grid.values[name] for name in SENSED]), grid.values[SPEED]
    fresh = np.column_stack([grid.fresh[name] for name in SENSED])
    Q, P = np.diag(noise.process(arm(benchmark)) * DT), np.diag(noise.start(arm(benchmark)))
    R0 = [noise.encoder**2, noise.gyro**2, noise.turn**2]
    scatter, seen = dict.fromkeys(GYRO, 0.05**2), {name: [] for name in GYRO}
    x = np.zeros(8)
    x[:3] = -(v[0] ** 2) * y[0, 0] * cos(benchmark.lam) / benchmark.w / 9.81, y[0, 0], y[0, 1]
    for k in range(len(y)):
        if k:
            F = expm(model.A(v[k]) * DT)
            x, P = F @ x, F @ P @ F.T + Q
        for name in GYRO:
            i = SENSED.index(name)
            if fresh[k, i]:
                past = seen[name]
                past.append(y[k, i])
                if len(past) > 2:
                    bend = past[-1] - 2 * past[-2] + past[-3]
                    count = min(len(past) - 1 + 10, SCATTER_TIME / DT)
                    scatter[name] += (bend**2 / 6 - scatter[name]) / count
        C = np.array([*model.C, yaw_row(benchmark, v[k])])
        use = [i for i in range(3) if fresh[k, i] and (k or i == 2)]
        R = np.diag(np.add(R0, [0.0, scatter["roll_rate"], scatter["yaw_rate"]]))[np.ix_(use, use)]
        C, e = C[use], y[k, use] - C[use] @ x
        K = np.linalg.solve(C @ P @ C.T + R, C @ P).T
        x, P = x + K @ e, (np.eye(8) - K @ C) @ P
        for i, name in enumerate(STATES):
            sd = np.sqrt(P[i, i])
            assert abs(found.columns[name][k] - x[i]) < 0.005 * sd + 1e-9, (k, name)
            if i:  # the roll's has what is systematic on top
                assert found.columns[f"{name}_sd"][k] == pytest.approx(sd, rel=0.003), (k, name)


def test_bands_on_its_own_model(benchmark):
    """Errors in standard deviations, on forty rides that its own noises make; 5 m/s, where the benchmark is stable."""
    noise = BicycleNoise(gyro=0.0, turn=0.0, share=0.0, bias=0.0)
    program = cd.compile(bicycle_kalman(benchmark, DT, noise=noise))
    squares = {name: [] for name in STATES}
    for seed in range(40):
        log, x = drawn(benchmark, noise, 5.0, 20.0, seed)
        found = program.run(log).columns
        for i, name in enumerate(STATES):
            squares[name].append((((found[name] - x[:, i]) / found[f"{name}_sd"]) ** 2)[300:])
    for name, each in squares.items():
        every = np.concatenate(each)
        assert 0.7 < every.mean() < 1.4, (name, every.mean())
        assert np.mean(every < 1.96**2) > 0.9, name
    assert 0.85 < np.mean([np.mean(squares[name]) for name in STATES]) < 1.15


def test_ride(benchmark):
    log, truth = balanced(benchmark)
    found = cd.compile(build("bicycle-kalman", "meijaard2007", dt=DT)).run(log).columns
    late = slice(500, None)
    off = (found["roll_angle"] - truth["roll_angle"])[late]
    assert rms(truth["roll_angle"][late]) > 2 * DEGREE
    assert rms(off) < 0.3 * DEGREE
    assert np.mean(np.abs(off) < 1.96 * found["roll_angle_sd"][late]) > 0.95
    torque = (found["rider_torque"] - truth["rider_torque"])[late]
    assert rms(torque) < 0.35 * rms(truth["rider_torque"][late])
    assert np.mean(np.abs(torque) < 1.96 * found["rider_torque_sd"][late]) > 0.95
    assert found["steer_offset"][-1] == pytest.approx(0.01, abs=0.002)
    assert found["roll_rate_bias"][-1] == pytest.approx(0.01, abs=0.005)
    assert found["valid"][late].all()
    assert found["turn_measured"][late].all()


def test_without_yaw_rate(benchmark):
    """A straight ride tells the zero; a circle is taken for one, and flagged as not measured."""
    log, truth = balanced(benchmark)
    program = cd.compile(bicycle_kalman(benchmark, DT))
    found = program.run(log.without("yaw_rate")).columns
    assert not found["turn_measured"][200:].any()
    assert found["steer_offset"][-1] == pytest.approx(0.01, abs=2 * found["steer_offset_sd"][-1])
    with_it = program.run(log).columns
    off, without = ((c["roll_angle"] - truth["roll_angle"])[500:] for c in (with_it, found))
    assert rms(off) < rms(without) < 2 * DEGREE
    assert np.mean(np.abs(without) < 1.96 * found["roll_angle_sd"][500:]) > 0.9
    time = np.arange(0, 60, DT)
    circle = {"steer_angle": 0.1 + 0 * time, "roll_rate": 0 * time, SPEED: 5 + 0 * time}
    blind = program.run(cd.Log.of([cd.Signal(name, time, x, "") for name, x in circle.items()])).columns
    assert blind["steer_offset"][-1] > 0.05
    assert not blind["turn_measured"][-1]


def test_friction_and_flags(benchmark):
    log, _ = balanced(benchmark, 12.0)
    plain, rubbing = (cd.compile(bicycle_kalman(benchmark, DT, friction=f)).run(log).columns for f in (0.0, 0.5))
    np.testing.assert_allclose(
        rubbing["rider_torque"] - plain["rider_torque"], 0.5 * np.tanh(plain["steer_rate"] / 0.05), atol=1e-9
    )
    fast = log.with_signals(cd.Signal(SPEED, log[SPEED].time, 0 * log[SPEED].time + 13.0, ""))
    found = cd.compile(bicycle_kalman(benchmark, DT)).run(fast).columns
    assert not found["speed_in_range"].any()
    assert not found["valid"].any()


def test_a_house_observer():
    check_observer(build("bicycle-kalman", "pasma2024", dt=DT))


def test_chosen_for_bicycles_only():
    signals = (*NEEDED, SPEED)
    assert best(signals, cd.load_vehicle("pasma2024"), family="motorcycle").estimator == "bicycle-kalman"
    assert best((*signals, "yaw_rate"), cd.load_vehicle("moore2012"), family="motorcycle").estimator == "bicycle-kalman"
    assert (
        best((*signals, "yaw_rate"), cd.load_vehicle("sharp1971"), family="motorcycle").estimator == "motorcycle-kalman"
    )
    assert best((*signals, "yaw_rate"), None, family="motorcycle").estimator == "motorcycle-imu"
    assert build("bicycle-kalman", "pasma2024").settings["friction"] == 0.384
    assert build("bicycle-kalman", "moore2012").settings["friction"] == 0


@pytest.mark.parametrize("real", ["double", "float"])
def test_exported(real, tmp_path):
    """The C answers as codriver does: its own check, in double bit for bit, in float within its tolerance."""
    if shutil.which("gcc") is None:
        pytest.skip("gcc is not installed")
    export_c(cd.compile(build("bicycle-kalman", "pasma2024", dt=DT)), tmp_path, real)
    sources = sorted(tmp_path.glob("*.c"))
    strict = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-ffp-contract=off"]
    subprocess.run(["gcc", *strict, *sources, "-o", tmp_path / "check", "-lm"], check=True)
    ran = subprocess.run([tmp_path / "check"], capture_output=True, text=True)
    assert ran.stdout.startswith("ok: 400 rows"), ran.stdout


def told(monkeypatch, capsys, *arguments: str) -> dict:
    """What `codriver estimate motorcycle` says."""
    monkeypatch.setattr(sys, "argv", ["codriver", "estimate", "motorcycle", *arguments, "--json"])
    with pytest.raises(SystemExit) as end:
        main()
    assert not end.value.code
    return json.loads(capsys.readouterr().out)


def test_command_line(benchmark, monkeypatch, capsys, tmp_path):
    """A ride as CSV, without the yaw rate: the estimator is found by the vehicle, and a sensor that is not there is not judged."""
    log, truth = balanced(benchmark, 20.0)
    names = ("steer_angle", "roll_rate", SPEED)
    table = np.column_stack([log["steer_angle"].time, *(log[name].values for name in names)])
    np.savetxt(tmp_path / "ride.csv", table, delimiter=",", header=",".join(["time", *names]), comments="")
    out, report = tmp_path / "out.csv", tmp_path / "ride.html"
    given = [str(tmp_path / "ride.csv"), "--vehicle", "meijaard2007", "-o", str(out), "--report", str(report)]
    said = json.dumps(told(monkeypatch, capsys, *given))
    assert "bicycle-kalman" in said
    assert "yaw_rate:" not in said
    assert "no yaw rate for 100% of the valid time" in said
    found = cd.read(out)
    assert rms(found["roll_angle"].values - truth["roll_angle"]) < 3 * DEGREE
    assert "rider_torque" in found
    page = report.read_text(encoding="utf-8")
    assert "Lean of the machine" in page
    assert "Torque of the rider on the handlebar" in page


def judged(log: cd.Log, vehicle: str, dt: float) -> dict[str, float]:
    """Root mean squares of roll (degrees) and R2 of the torque, from 5 s on; and what lies inside the bands."""
    k = round(5 / dt)
    found = (
        cd.compile(build("bicycle-kalman", vehicle, dt=dt))
        .run(log.without("roll_angle").without("rider_torque"))
        .columns
    )
    truth = log.sample(("roll_angle", "rider_torque"), dt).values
    n = truth["roll_angle"].size
    roll, torque = ((found[name][:n] - truth[name])[k:] for name in ("roll_angle", "rider_torque"))
    late = round(0.02 / dt)
    missed = found["rider_torque"][k + late : n] - truth["rider_torque"][k : n - late]
    return {
        "roll": rms(roll) / DEGREE, "zero": rms(truth["roll_angle"][k:]) / DEGREE,
        "r2": 1 - float(np.mean(missed**2) / truth["rider_torque"][k:].var()),
        "roll inside": float(np.mean(np.abs(roll) < 1.96 * found["roll_angle_sd"][k:n])),
        "torque inside": float(np.mean(np.abs(torque) < 1.96 * found["rider_torque_sd"][k:n])),
    }  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("run", "roll", "r2"), [
    ("bode_normal_4mps_1.2Hz", 0.85, 0.75), ("bode_normal_4mps_1.6Hz", 0.8, 0.8), ("bode_normal_4mps_2.4Hz", 0.8, 0.78),
    ("eigen_normal_sil6.5n2_14.4kph", 0.6, 0.78), ("eigen_normal_sil6.5n2_9kph", 0.65, 0.7),
])  # fmt: skip
def test_steer_by_wire(run, roll, r2):
    """No roll, no yaw rate, nothing but the makers' figures and friction; the last two runs and the first were not fitted on."""
    log = cd.read(recording("tudelft-steer-by-wire-bicycle") / f"{run}.log", names=NAMES / "steer-by-wire.toml")
    found = judged(log.between(0, 59) if "1.2Hz" in run else log, "pasma2024", DT)
    assert found["roll"] < min(roll, 0.5 * found["zero"])
    assert found["r2"] > r2
    assert found["roll inside"] > 0.95
    assert found["torque inside"] > 0.95


class TestDavis:
    @pytest.fixture
    def log(self) -> cd.Log:
        path = recording("davis-instrumented-bicycle") / "run-283-first-60s.csv"
        log = cd.read(path, names=NAMES / "davis-bicycle.toml").without("roll_moment")
        table = np.genfromtxt(path, delimiter=",", skip_header=1, usecols=(8, 9))
        rate = -np.gradient(table[:, 0], table[:, 1])
        return log.with_signals(cd.Signal("yaw_rate", table[:, 1], rate, "rad/s"))

    def test_rider(self, log):
        with_yaw, without = judged(log, "moore2012", 0.005), judged(log.without("yaw_rate"), "moore2012", 0.005)
        assert with_yaw["roll"] < 0.3
        assert without["roll"] < 0.4
        assert with_yaw["zero"] > 0.9
        assert min(with_yaw["r2"], without["r2"]) > 0.65
        assert min(with_yaw["roll inside"], with_yaw["torque inside"]) > 0.95

    def test_yaw_rate_by_the_wheels(self, log):
        """What the filter takes as its row, against the measured heading."""
        p = BicycleParameters.from_vehicle(cd.load_vehicle("moore2012"))
        steer = log["steer_angle"]
        rate = np.gradient(steer.values, steer.time)
        made = (log[SPEED].values * steer.values + p.c * rate) * cos(p.lam) / p.w
        slope = np.polyfit(made, log["yaw_rate"].values, 1)[0]
        assert slope == pytest.approx(1, abs=0.03)
        assert np.corrcoef(made, log["yaw_rate"].values)[0, 1] > 0.97


def test_noise_of_moment_grows_with_the_bicycle(benchmark):
    """A heavy rider's pushes are greater than those of an empty bicycle, as its weight is."""
    own = BicycleParameters.from_vehicle(cd.load_vehicle("pasma2024"))
    sizes = [BicycleNoise().start(arm(p))[5] ** 0.5 / arm(p) for p in (own, benchmark)]
    assert sizes == pytest.approx([0.05, 0.05])
    assert replace(BicycleNoise(), moment=0.1).process(arm(own))[5] == pytest.approx(
        4 * BicycleNoise().process(arm(own))[5]
    )
