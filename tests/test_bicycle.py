"""The bicycle: its model against the paper's printed numbers, its steer row fitted, and torques of two recordings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import codriver as cd
from codriver.identify import SteerRowFit, fit_steer_row, steer_record
from codriver.models import BicycleParameters, SteerMotion, SteerRow, bicycle_matrices, bicycle_model
from codriver.models.steer_row import sliding
from codriver.observers.disturbance import disturbance_observer
from codriver.observers.disturbance_design import design_disturbance_filter
from conftest import ROOT, recording

# Meijaard et al. 2007, table 1.
BENCHMARK = BicycleParameters(
    w=1.02, c=0.08, lam=np.pi / 10, g=9.81,
    rR=0.3, mR=2, IRxx=0.0603, IRyy=0.12,
    xB=0.3, zB=-0.9, mB=85, IBxx=9.2, IBxz=2.4, IBzz=2.8,
    xH=0.9, zH=-0.7, mH=4, IHxx=0.05892, IHxz=-0.00756, IHzz=0.00708,
    rF=0.35, mF=3, IFxx=0.1405, IFyy=0.28,
)  # fmt: skip
# Table 2: real eigenvalues, and the weave's real and imaginary part.
EIGENVALUES = {
    4.0: ((-12.15861426576447, -1.42944427361326), (0.41325331521125, 3.07910818603206)),
    5.0: ((-14.07838969279822, -0.32286642900409), (-0.77534188219585, 4.46486771378823)),
    10.0: ((-24.62459635017404, 0.16105338653172), (-3.72016840437287, 10.90681139476287)),
}


class TestModel:
    def test_printed_matrices(self):
        """Section 5.3 of the paper, to the last printed digit."""
        m = bicycle_matrices(BENCHMARK)
        close = {"rtol": 0, "atol": 6e-14}
        assert np.allclose(m.M, [[80.81722, 2.31941332208709], [2.31941332208709, 0.29784188199686]], **close)
        assert np.allclose(m.C1, [[0, 33.86641391492494], [-0.85035641456978, 1.68540397397560]], **close)
        assert np.allclose(m.K0, [[-80.95, -2.59951685249872], [-2.59951685249872, -0.80329488458618]], **close)
        assert np.allclose(m.K2, [[0, 76.59734589573222], [0, 2.65431523794604]], **close)

    @pytest.mark.parametrize("speed", EIGENVALUES)
    def test_printed_eigenvalues(self, speed):
        (fast, slow), (real, imaginary) = EIGENVALUES[speed]
        found = np.linalg.eigvals(bicycle_model(bicycle_matrices(BENCHMARK).to_iso(), speed).A)
        expected = [fast, slow, real + 1j * imaginary, real - 1j * imaginary]
        assert np.allclose(np.sort_complex(found), np.sort_complex(expected), rtol=1e-12, atol=1e-11)

    def test_standing_still(self):
        found = np.linalg.eigvals(bicycle_model(bicycle_matrices(BENCHMARK), 0.0).A)
        assert np.allclose(np.sort(found.real), [-5.53094371765393, -3.13164324790656, 3.13164324790656, 5.53094371765393],
                           rtol=0, atol=1e-12)  # fmt: skip

    def test_another_bicycle(self):
        """The bicycle of TU Delft's recordings, matrices by the package BicycleParameters 1.5.2."""
        m = bicycle_matrices(STEER_BY_WIRE)
        assert np.allclose(m.M, [[13.6693, 0.6679], [0.6679, 0.1401]], atol=5e-5)
        assert np.allclose(m.C1, [[0, 9.4986], [-0.4117, 0.8063]], atol=5e-5)
        assert np.allclose(m.K0, [[-19.1078, -0.9604], [-0.9604, -0.3]], atol=5e-5)
        assert np.allclose(m.K2, [[0, 18.2892], [0, 0.9862]], atol=5e-5)

    def test_signs_are_iso(self):
        """A bicycle that falls to the right steers to the right, which is negative; torque to the left steers left."""
        model = bicycle_model(bicycle_matrices(BENCHMARK).to_iso(), 5.0)
        assert all(name in cd.names.VOCABULARY for name in (*model.states, *model.inputs, *model.outputs))
        steering = model.states.index("steer_rate")
        assert model.A[steering, model.states.index("roll_angle")] < 0
        assert model.B[steering, model.inputs.index("rider_torque")] > 0
        assert model.B[model.states.index("roll_rate"), model.inputs.index("roll_moment")] > 0

    def test_steady_turn(self):
        """A left turn (steer > 0) leans left (roll < 0) by about v^2 / (g R), held by a steady torque."""
        matrices, v = bicycle_matrices(BENCHMARK).to_iso(), 5.0
        _, _, K = matrices.at(v)
        steer = 0.02
        lean = -K[0, 1] * steer / K[0, 0]
        curvature = steer * np.cos(BENCHMARK.lam) / BENCHMARK.w
        assert lean < 0
        assert lean == pytest.approx(-(v**2) * curvature / BENCHMARK.g, rel=0.05)
        held = bicycle_model(matrices, v)
        torque = K[1] @ [lean, steer]
        assert np.allclose(held.A @ [lean, steer, 0, 0] + held.B @ [0, torque], 0, atol=1e-12)

    def test_heavier_rider_needs_more(self):
        light, heavy = (bicycle_matrices(replace(BENCHMARK, mB=m)) for m in (60, 100))
        assert heavy.K0[0, 0] < light.K0[0, 0] < 0


# Riderless steer-by-wire bicycle of TU Delft, K. Pasma, MSc thesis 2024, in github.com/mechmotum/sbw_bicycle_with_model_matching.
STEER_BY_WIRE = BicycleParameters(
    w=1.036, c=0.0803, lam=np.deg2rad(18.2),
    rR=0.3498, mR=10.12, IRxx=0.1040, IRyy=0.1641,
    xB=0.462, zB=-0.698, mB=20.9, IBxx=1.64, IBxz=0.654, IBzz=1.94,
    xH=0.944, zH=-0.595, mH=0.6, IHxx=0.0098, IHxz=-0.00044, IHzz=0.00396,
    rF=0.3498, mF=1.78, IFxx=0.0644, IFyy=0.1289,
)  # fmt: skip


def ride(
    seconds: float = 120.0, dt: float = 0.01, speed: float = 4.15, by_hand: float = 1.0, friction: float = 0.0,
    encoder: float = 0.0, gyro: float = 0.0, seed: int = 0,
) -> cd.Log:  # fmt: skip
    """A steer-by-wire bicycle that a controller balances from the roll rate it measures, with random torque by hand and pushes."""
    rng = np.random.default_rng(seed)
    model = bicycle_model(bicycle_matrices(STEER_BY_WIRE).to_iso(), speed)
    steps = 10  # the plant runs ten times as fine, for the friction's sake
    n, F = round(seconds / dt), model.transition(dt / steps)
    G = np.linalg.solve(model.A, (F - np.eye(4)) @ model.B)
    hand = (
        by_hand * np.convolve(rng.standard_normal(n), np.hanning(30), "same") / np.sqrt(np.hanning(30) @ np.hanning(30))
    )
    push = 3.0 * np.convolve(rng.standard_normal(n), np.hanning(20), "same")
    x, rows = np.zeros(4), np.empty((n, 6))
    for k in range(n):
        rate = x[2] + gyro * rng.standard_normal()
        torque = -2.0 * (6.5 - speed) * rate + hand[k]
        rows[k] = x[0], rate, x[1], speed, torque, push[k]
        for _ in range(steps):
            x = F @ x + G @ [push[k], torque - friction * np.tanh(x[3] / 0.05)]
    if encoder:
        rows[:, 2] = np.round(rows[:, 2] / encoder) * encoder
    names = ("roll_angle", "roll_rate", "steer_angle", "longitudinal_speed", "rider_torque", "roll_moment")
    time = np.arange(n) * dt
    return cd.Log.of([cd.Signal(name, time, column, "") for name, column in zip(names, rows.T, strict=True)])


OWN = SteerRow.of(bicycle_matrices(STEER_BY_WIRE).to_iso())
GIVEN = {"K0_dd": OWN.K0_dd}


class TestSteerRow:
    def test_torque_of_a_motion(self):
        """The row's torque of a motion of the whole bicycle is the one that made it, without filtering."""
        model, v, rng = bicycle_model(bicycle_matrices(STEER_BY_WIRE).to_iso(), 3.0), 3.0, np.random.default_rng(1)
        x, u = rng.standard_normal((4, 50)), rng.standard_normal((2, 50))
        rates = model.A @ x + model.B @ u
        motion = SteerMotion(x[0], x[2], rates[2], x[1], x[3], rates[3], sliding(x[3]), np.full(50, v))
        assert np.allclose(OWN.torque(motion), u[1], atol=1e-12)
        assert np.allclose(OWN.with_values(friction=0.3, offset=0.1).torque(motion) - u[1],
                           0.3 * np.tanh(x[3] / 0.05) + 0.1, atol=1e-12)  # fmt: skip

    def test_model_is_the_second_row(self):
        """With the roll of the whole bicycle as its input the fork moves as in the whole bicycle."""
        whole, fork = bicycle_model(bicycle_matrices(STEER_BY_WIRE).to_iso(), 3.0), OWN.model(3.0)
        assert all(name in cd.names.VOCABULARY for name in (*fork.states, *fork.inputs, *fork.outputs))
        x, u = np.array([0.1, -0.2, 0.3, 0.5]), np.array([7.0, 2.0])
        rates = whole.A @ x + whole.B @ u
        assert fork.A @ x[[1, 3]] + fork.B @ [u[1], x[0], x[2], rates[2]] == pytest.approx(rates[[1, 3]])
        with pytest.raises(ValueError, match="must be positive"):
            OWN.with_values(M_dd=-0.1).model(3.0)

    def test_filter_finds_the_torque(self):
        """Encoder of 0.77 mrad, friction: the estimate follows 20 ms late, and its band is honest at that."""
        log = ride(encoder=7.7e-4, friction=0.25)
        found, truth = filtered(log, OWN.with_values(friction=0.25), 4.15)
        assert r2(found[2:], truth[:-2]) > 0.85
        assert r2(found, truth) > 0.6


class TestFit:
    def test_coefficients_within_their_errors(self):
        fit = fit_steer_row([steer_record(ride(seed=seed, friction=0.25), 0.01) for seed in (1, 2)], GIVEN)
        truth = OWN.with_values(friction=0.25)
        assert fit.r2 > 0.97
        for name in ("M_dd", "C1_dd", "K2_dd", "friction"):
            assert getattr(fit.row, name) == pytest.approx(getattr(truth, name), rel=0.12), name
        assert fit.sd["M_dd"] < 0.05 * fit.row.M_dd
        assert fit.sd["K0_dd"] == 0

    def test_two_speeds_tell_gravity_from_speed(self):
        records = [steer_record(ride(seed=k, speed=v), 0.01) for k, v in enumerate((3.0, 4.15, 5.5))]
        fit = fit_steer_row(records)
        assert fit.row.K0_dd == pytest.approx(OWN.K0_dd, abs=0.15)
        assert fit.row.K2_dd == pytest.approx(OWN.K2_dd, rel=0.1)
        with pytest.raises(cd.errors.LogError, match="apart"):
            fit_steer_row(records[:1])

    def test_a_controller_alone_is_not_a_bicycle(self):
        """The torque is made from the measured roll rate only: its least squares finds the gain, not the bicycle."""
        record = steer_record(ride(by_hand=0.0, gyro=0.02), 0.01)
        by_torque = fit_steer_row([record], GIVEN, by="torque")
        assert by_torque.r2 > 0.99
        assert by_torque.row.C1_dphi * 4.15 == pytest.approx(-2.0 * (6.5 - 4.15), rel=0.1)
        assert by_torque.row.M_dd < 0.3 * OWN.M_dd

    def test_wrong_sign_is_refused(self):
        log = ride()
        torque = log["rider_torque"]
        turned = log.with_signals(cd.Signal("rider_torque", torque.time, -torque.values, ""))
        with pytest.raises(cd.errors.LogError, match="M_dd comes out as -"):
            fit_steer_row([steer_record(turned, 0.01)], GIVEN)

    def test_what_cannot_be(self):
        log = ride(20.0)
        with pytest.raises(cd.errors.MissingSignal, match="rider_torque"):
            steer_record(log.without("rider_torque"), 0.01)
        unknown = steer_record(log.without("rider_torque"), 0.01, known_torque=False)
        assert np.isnan(unknown.torque).all()
        assert unknown.used.any()
        record = steer_record(log, 0.01)
        with pytest.raises(cd.errors.UsageError, match="M_pp"):
            fit_steer_row([record], {"M_pp": 1.0})
        with pytest.raises(cd.errors.UsageError, match="magic"):
            fit_steer_row([record], by="magic")
        with pytest.raises(cd.errors.LogError, match="usable rows"):
            fit_steer_row([steer_record(log.between(0, 2.1), 0.01)], GIVEN)

    def test_encoder_jumps_at_the_start(self):
        """A fork that shows another zero for 0.3 s: told, left out, and the fit is as without it."""
        log = ride()
        angle = log["steer_angle"]
        jumped = np.where(angle.time < 0.3, angle.values + 0.8, angle.values)
        record = steer_record(log.with_signals(cd.Signal("steer_angle", angle.time, jumped, "")), 0.01)
        (finding,) = record.findings
        assert finding.text.startswith("the encoder of the steer angle jumps 1 times, by up to 0.79")
        assert finding.text.endswith("; from 0.30 to 119.99 s is used")
        assert not record.used[:130].any()
        assert record.used[135]
        clean = fit_steer_row([steer_record(log, 0.01)], GIVEN)
        assert fit_steer_row([record], GIVEN).row.M_dd == pytest.approx(clean.row.M_dd, rel=0.02)


def r2(found: np.ndarray, truth: np.ndarray) -> float:
    return float(1 - np.mean((found - truth) ** 2) / truth.var())


def filtered(log: cd.Log, row: SteerRow, speed: float, dt: float = 0.01) -> tuple[np.ndarray, np.ndarray]:
    """The torque by the Kalman filter of the steer row, friction added, and the known one; from 3 s on."""
    rate = log["roll_rate"]
    acceleration = np.r_[0.0, np.diff(rate.values) / np.diff(rate.time)]
    log = log.with_signals(cd.Signal("roll_acceleration", rate.time, acceleration, ""))
    design = design_disturbance_filter(
        row.model(speed), ("rider_torque",), dt, unknown_noise=[4.0], output_noise=[1e-6], state_noise=[0.0, 0.25]
    )
    estimate = cd.compile(disturbance_observer(design, [1.0, 5.0, 10.0])).run(log)
    found = estimate["rider_torque"].values + row.drag(estimate["steer_rate"].values)
    skip, n = round(3 / dt), min(found.size, len(rate))
    return found[skip:n], log["rider_torque"].values[skip:n]


@pytest.fixture(scope="module")
def logs() -> dict[str, cd.Log]:
    folder, names = recording("tudelft-steer-by-wire-bicycle"), ROOT / "tests" / "names" / "steer-by-wire.toml"
    runs = {name: cd.read(folder / f"{name}.log", names=names) for name in (
        "bode_normal_4mps_1.2Hz", "bode_normal_4mps_1.6Hz", "bode_normal_4mps_2.4Hz",
        "eigen_normal_sil6.5n2_14.4kph", "eigen_normal_sil6.5n2_9kph",
    )}  # fmt: skip
    fallen = "bode_normal_4mps_1.2Hz"
    return runs | {fallen: runs[fallen].between(0, 59)}


@pytest.fixture(scope="module")
def fits(logs: dict[str, cd.Log]) -> dict[str, SteerRowFit]:
    records = [steer_record(logs[f"bode_normal_4mps_{f}Hz"], 0.01) for f in ("1.6", "2.4")]
    return {way: fit_steer_row(records, GIVEN, by=way) for way in ("acceleration", "torque")}


class TestSteerByWire:
    """Fitted on two of TU Delft's runs, judged on three others. docs/bicycle.md has the figures."""

    def test_read_without_a_time_column(self, logs):
        for log in logs.values():
            assert len(log) == 5
            assert not log.faults
            assert np.diff(log["steer_angle"].time) == pytest.approx(0.01)

    def test_bicycle_found_is_the_one_measured(self, fits):
        """Signs of all, and the size of those that the record tells, against the bicycle weighed and measured by its makers."""
        row = fits["acceleration"].row
        for name in ("M_dphi", "M_dd", "C1_dphi", "C1_dd", "K0_dphi", "K2_dd"):
            assert getattr(row, name) * getattr(OWN, name) > 0, name
        for name in ("M_dd", "C1_dd", "K2_dd"):
            assert getattr(row, name) == pytest.approx(getattr(OWN, name), rel=0.35), name
        assert 0.3 < row.friction < 0.45

    @pytest.mark.parametrize(("run", "least", "delayed"), [
        ("bode_normal_4mps_1.2Hz", 0.91, 0.87), ("eigen_normal_sil6.5n2_14.4kph", 0.90, 0.87),
        ("eigen_normal_sil6.5n2_9kph", 0.81, 0.79),
    ])  # fmt: skip
    def test_torque_of_runs_kept_back(self, logs, fits, run, least, delayed):
        record = steer_record(logs[run], 0.01)
        for way in ("acceleration", "torque"):
            assert r2(fits[way].row.torque(record.motion)[record.used], record.torque[record.used]) > least
        speed = float(np.median(logs[run]["longitudinal_speed"].values))
        found, truth = filtered(logs[run], fits["torque"].row, speed)
        assert r2(found[4:], truth[:-4]) > delayed

    def test_no_lag_of_the_motor(self, logs):
        """A command that acts 60 ms late does not fit: M_dd comes out negative."""
        late = [steer_record(logs[f"bode_normal_4mps_{f}Hz"], 0.01, delay=0.06) for f in ("1.6", "2.4")]
        with pytest.raises(cd.errors.LogError, match="M_dd comes out as -"):
            fit_steer_row(late, GIVEN)


class TestDavis:
    """Each half by the row fitted on the other, against regression on angle and rate with friction."""

    def test_halves(self):
        folder = recording("davis-instrumented-bicycle")
        log = cd.read(folder / "run-283-first-60s.csv", names=ROOT / "tests" / "names" / "davis-bicycle.toml")
        first, second = (steer_record(log.between(*ends), 0.005) for ends in ((0, 30), (30, 60)))
        base = {"M_dd": 0.0, "M_dphi": 0.0, "C1_dphi": 0.0, "K0_dphi": 0.0, "K0_dd": 0.0}
        for learnt, judged, least in ((first, second, 0.94), (second, first, 0.955)):
            row = fit_steer_row([learnt], {"K0_dd": -0.77}, by="torque").row
            regression = fit_steer_row([learnt], base, by="torque").row
            truth = judged.torque[judged.used]
            whole, simple = (r2(r.torque(judged.motion)[judged.used], truth) for r in (row, regression))
            assert whole > least
            assert whole > simple > 0.9
            with pytest.raises(cd.errors.LogError, match="M_dd comes out as"):
                fit_steer_row([learnt], {"K0_dd": -0.77})
