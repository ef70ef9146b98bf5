"""The observer's step against oracles that others wrote, and in the corners where the model does not hold."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import codriver as cd
from codriver.models import intention_model
from codriver.observers import design_scaled_gain
from codriver.observers.jerk_forms import STATES, WIDE_START
from codriver.observers.noise_scale import PRIOR_SCALE
from codriver.signals import Grid
from conftest import constant, motion_log


def grid_of(dt, columns, fresh=None, held=None):
    """A grid by hand; what is not said is there on every tick."""
    n = len(next(iter(columns.values())))
    yes = {name: np.ones(n, bool) for name in columns}
    return Grid(np.arange(n) * dt, dt, {k: np.asarray(v, float) for k, v in columns.items()}, fresh or yes, held or yes)


def random_rows(n, seed, share_a, share_v):
    """Noisy measurements with rows missing at random; the first speed is there."""
    rng = np.random.default_rng(seed)
    a, v = rng.standard_normal(n), 20 + 0.1 * rng.standard_normal(n)
    ok_a, ok_v = rng.random(n) < share_a, rng.random(n) < share_v
    ok_v[0] = True
    return a, v, ok_a, ok_v


def run_kinematic(dt, a, v, ok_a, ok_v, ell=2.0, form="kalman"):
    """Estimates (n, 4) and the final covariance of the compiled step."""
    observer = cd.build("kinematic", dt=dt, ell=ell, form=form)
    program = cd.compile(observer)
    columns = {"longitudinal_acceleration": a, "longitudinal_speed": v, "gear": np.ones(a.size)}
    flags = {"longitudinal_acceleration": ok_a, "longitudinal_speed": ok_v, "gear": np.ones(a.size, bool)}
    stepper = program.live()
    rows = []
    for k in range(a.size):
        row = [columns[c][k] for c in observer.channels] + [bool(flags[c][k]) for c in observer.channels]
        out = dict(zip(stepper.outputs, stepper(row), strict=True))
        rows.append([out[o.name] for o in observer.outputs if o.role == "estimate"])
    return np.array(rows), stepper.carry


def start(design, a, v, ok_a):
    """The prior the observer starts from at its first speed."""
    x = np.array([v[0], 0.0, a[0] if ok_a[0] else 0.0, 0.0])
    return x, WIDE_START * np.diag(np.diag(design.P))


@pytest.mark.parametrize(("share_a", "share_v"), [(1.0, 1.0), (1.0, 0.5), (0.6, 0.3), (0.3, 0.05)])
def test_against_brute_force(share_a, share_v):
    """The last state given all rows at once, from the joint Gaussian of states and measurements: no recursion at all."""
    dt, n = 0.02, 40
    design, C = design_scaled_gain("bisoffi2017", dt, 2.0), intention_model().C
    a, v, ok_a, ok_v = random_rows(n, 3, share_a, share_v)
    mean, P0 = start(design, a, v, ok_a)
    # Stack x_0 ... x_{n-1}: covariance by powers of F.
    means, covariance = [mean], np.zeros((4 * n, 4 * n))
    marginals = [P0]
    for _ in range(n - 1):
        means.append(design.F @ means[-1])
        marginals.append(design.F @ marginals[-1] @ design.F.T + design.Qd)
    for i in range(n):
        block = marginals[i]
        for k in range(i, n):
            covariance[4 * i : 4 * i + 4, 4 * k : 4 * k + 4] = block
            covariance[4 * k : 4 * k + 4, 4 * i : 4 * i + 4] = block.T
            block = block @ design.F.T
    rows, noise, measured = [], [], []
    for k in range(n):
        for i, (ok, y) in enumerate(((ok_a, a), (ok_v, v))):
            if ok[k]:
                row = np.zeros(4 * n)
                row[4 * k : 4 * k + 4] = C[i]
                rows.append(row)
                noise.append(design.Rd[i, i])
                measured.append(y[k])
    H, big = np.array(rows), np.concatenate(means)
    S = H @ covariance @ H.T + np.diag(noise)
    gain = covariance[-4:] @ H.T @ np.linalg.inv(S)
    wanted = big[-4:] + gain @ (np.array(measured) - H @ big)
    P = covariance[-4:, -4:] - gain @ H @ covariance[:, -4:]
    found, carry = run_kinematic(dt, a, v, ok_a, ok_v)
    np.testing.assert_allclose(found[-1], wanted, rtol=1e-8, atol=1e-8)
    ours = [[carry[f"P_{STATES[min(i, k)]}_{STATES[max(i, k)]}"] for k in range(4)] for i in range(4)]
    np.testing.assert_allclose(ours, P, rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize(("share_a", "share_v"), [(1.0, 1.0), (1.0, 0.5), (0.7, 0.3)])
def test_against_statsmodels(share_a, share_v):
    """statsmodels' Kalman filter, which handles partly missing rows, over 2,000 steps."""
    kalman = pytest.importorskip("statsmodels.tsa.statespace.kalman_filter")
    dt, n = 0.01, 2000
    design, C = design_scaled_gain("bisoffi2017", dt, 2.0), intention_model().C
    a, v, ok_a, ok_v = random_rows(n, 5, share_a, share_v)
    mean, P0 = start(design, a, v, ok_a)
    other = kalman.KalmanFilter(k_endog=2, k_states=4)
    other.bind(np.column_stack([np.where(ok_a, a, np.nan), np.where(ok_v, v, np.nan)]))
    other["design"], other["obs_cov"] = C, design.Rd
    other["transition"], other["selection"], other["state_cov"] = design.F, np.eye(4), design.Qd
    other.initialize_known(mean, P0)
    # Where nothing is missing statsmodels would stop updating P once it has converged; ours goes on.
    other.tolerance = 0
    wanted = other.filter().filtered_state.T
    found, _ = run_kinematic(dt, a, v, ok_a, ok_v)
    np.testing.assert_allclose(found, wanted, rtol=1e-7, atol=1e-7)


@pytest.mark.parametrize("ell", [1.0, 2.0, 3.0])
def test_kalman_equals_constant_gain_when_nothing_is_missing(ell):
    """From the stationary covariance on, the two forms are one filter; from the wide start they meet."""
    dt, n = 0.01, 6000
    a, v, ok_a, ok_v = random_rows(n, 1, 1.0, 1.0)
    kalman, _ = run_kinematic(dt, a, v, ok_a, ok_v, ell)
    fixed, _ = run_kinematic(dt, a, v, ok_a, ok_v, ell, "constant")
    assert np.abs(kalman - fixed)[:200].max() > 1e-3
    np.testing.assert_allclose(kalman[-500:], fixed[-500:], atol=1e-7)


def test_step_on_plain_floats_is_the_recorded_step(car):
    """The step can be followed with a debugger: on floats it gives what the machine code gives."""
    observer = cd.build("intent-pedals", car, dt=0.01)
    stepper = cd.compile(observer).live()
    rng = np.random.default_rng(2)
    carry = dict(observer.carry)
    for _ in range(200):
        values = {c: float(rng.uniform(0, 5)) for c in observer.channels} | {"gear": float(rng.integers(0, 6))}
        ok = {c: float(rng.random() < 0.8) for c in observer.channels}
        carry, out = observer.step(carry, values, values, ok, {})
        machine = stepper([*[values[c] for c in observer.channels], *[int(ok[c]) for c in observer.channels]])
        for name, number in zip(stepper.outputs, machine, strict=True):
            assert float(out[name]) == pytest.approx(number, rel=1e-9, abs=1e-12), name


@given(seed=st.integers(0, 2**31), share=st.floats(0.05, 1.0))
@settings(max_examples=25, deadline=None)
def test_covariance_stays_positive(seed, share):
    """Whatever is missing, the covariance stays symmetric positive definite and the estimates finite."""
    a, v, ok_a, ok_v = random_rows(400, seed, share, share)
    found, carry = run_kinematic(0.01, a, v, ok_a, ok_v)
    P = np.array([[carry[f"P_{STATES[min(i, k)]}_{STATES[max(i, k)]}"] for k in range(4)] for i in range(4)])
    assert np.isfinite(found).all()
    assert np.linalg.eigvalsh(P).min() > 0


def test_nan_that_is_not_ok_does_no_harm():
    """A missing value may be NaN: its flag says it is not there."""
    a, v, ok_a, ok_v = random_rows(300, 0, 0.5, 0.5)
    clean, _ = run_kinematic(0.01, a, v, ok_a, ok_v)
    dirty, _ = run_kinematic(0.01, np.where(ok_a, a, np.nan), np.where(ok_v, v, np.nan), ok_a, ok_v)
    np.testing.assert_array_equal(clean, dirty)


def test_gaps_in_the_speed():
    """2-s gaps every 10 s: the Kalman form at most doubles its error; holding the last speed is far worse."""
    log, _ = motion_log(200, seed=4)
    speed = log["longitudinal_speed"]
    kept = np.mod(speed.time, 10) > 2
    gappy = log.with_signals(cd.Signal("longitudinal_speed", speed.time[kept], speed.values[kept], "m/s"))
    newest = np.maximum.accumulate(np.where(kept, np.arange(kept.size), 0))
    holding = log.with_signals(cd.Signal("longitudinal_speed", speed.time, speed.values[newest], "m/s"))
    quiet, _ = motion_log(200, noise=0, speed_noise=0)
    program = cd.compile(cd.build("kinematic", dt=0.01, ell=2))
    reference = program.run(quiet).columns["longitudinal_jerk"]

    def error(drive):
        off = program.run(drive).columns["longitudinal_jerk"] - reference
        return float(np.sqrt(np.mean(off[2000:] ** 2)))

    whole, gaps, held = error(log), error(gappy), error(holding)
    assert gaps <= 0.15 * held
    assert gaps <= 2 * whole, (whole, gaps, held)


def drive_log(car, seconds=30.0, **changes):
    """Constant 10 m/s in third gear, pedal balanced against drag, all signals at 100 Hz; `changes` replace columns."""
    t = np.arange(round(seconds * 100)) / 100
    columns = {
        "accelerator_pedal": 0.05, "brake_pressure": 0.0, "engine_torque": 16.25, "engine_torque_request": 16.25, "gear": 3,
        "clutch": 0.0, "longitudinal_acceleration": 0.0, "longitudinal_speed": 10.0,
    }  # fmt: skip
    signals = [constant(n, c, t) for n, c in columns.items() if n not in changes]
    signals += [cd.Signal(n, t, np.asarray(c, float), "") for n, c in changes.items() if c is not None]
    return cd.Log.of(signals)


def test_open_clutch_cuts_the_engine(car):
    """With the clutch open the engine's torque reaches no wheel: u = -tau/M T_r."""
    log = drive_log(car, clutch=np.ones(3000), engine_torque=np.full(3000, 100.0))
    u = cd.compile(cd.build("intent-torque", car)).run(log).columns["known_input"]
    np.testing.assert_allclose(u, -14 / 1550 * 16.25)


def test_known_input_is_equation_10a(car):
    """u = tau/M T_e - (1 - sigma)(tau/M c_r p_r + c_b/M p_b), by hand; while braking only tau/M T_e is left."""
    log = drive_log(car, engine_torque=np.full(3000, 40.0), accelerator_pedal=np.full(3000, 0.2))
    u = cd.compile(cd.build("intent-pedals", car)).run(log).columns["known_input"]
    np.testing.assert_allclose(u, 14 / 1550 * (40 - 325 * 0.2), rtol=1e-12)
    braking = drive_log(car, engine_torque=np.full(3000, -20.0), brake_pressure=np.full(3000, 20e5))
    estimate = cd.compile(cd.build("intent-pedals", car)).run(braking)
    np.testing.assert_allclose(estimate.columns["known_input"], 14 / 1550 * -20, rtol=1e-12)
    assert estimate.flag("braking").all()
    assert estimate.flag("both_pedals").all()  # the pedal still shows 5 %


def test_brake_has_hysteresis(car):
    """sigma goes on above 0.7 bar and off below 0.35 bar."""
    pressure = np.concatenate([np.linspace(0, 1e5, 1000), np.linspace(1e5, 0, 2000)])
    sigma = cd.compile(cd.build("intent-pedals", car)).run(drive_log(car, brake_pressure=pressure)).flag("braking")
    on, off = np.flatnonzero(np.diff(sigma.astype(int)) == 1)[0], np.flatnonzero(np.diff(sigma.astype(int)) == -1)[0]
    assert pressure[on] <= 0.7e5 <= pressure[on + 1]
    assert pressure[off] >= 0.35e5 >= pressure[off + 1]
    assert np.abs(np.diff(sigma.astype(int))).sum() == 2


def test_gear_unknown_during_a_shift_keeps_the_intention(car):
    """While the gear reads neutral, u is minus the intention in the old gear; then tau is the new gear's."""
    gear = np.concatenate([np.full(1500, 3.0), np.zeros(50), np.full(1450, 4.0)])
    torque = np.where(gear == 0, 0.0, 16.25)
    estimate = cd.compile(cd.build("intent-torque", car)).run(
        drive_log(car, gear=gear, clutch=None, engine_torque=torque)
    )
    u = estimate.columns["known_input"]
    np.testing.assert_allclose(u[1500:1550], -14 / 1550 * 16.25)
    np.testing.assert_allclose(u[1550:], 0, atol=1e-15)
    shift = estimate.flag("gear_shift")
    assert shift[1500:1600].all()
    assert not shift[:1500].any()
    assert not shift[1610:].any()


@pytest.mark.parametrize(("gear", "known"), [(6, False), (-1, False), (0, True), (5, True)])
def test_a_gear_that_the_vehicle_lacks_is_not_known(gear, known, car):
    """Sixth gear, or reverse, of a car whose file has neither: not valid. Neutral is known: no torque passes."""
    gears = np.concatenate([np.full(1500, 3.0), np.full(1500, float(gear))])
    estimate = cd.compile(cd.build("intent-torque", car)).run(drive_log(car, gear=gears))
    assert estimate.valid[1000:1500].all()
    assert estimate.flag("inputs_known")[1600:].all() == known
    assert estimate.valid[1600:].any() == known


def test_the_brake_switch_does_not_latch_the_pressure(car):
    """A rest pressure of 0.4 bar and one second of the switch: braking for that second only."""
    switch = np.zeros(3000)
    switch[1000:1100] = 1
    log = drive_log(car, brake_pressure=np.full(3000, 0.4e5), brake_switch=switch)
    sigma = cd.compile(cd.build("intent-pedals", car)).run(log).flag("braking")
    np.testing.assert_array_equal(np.flatnonzero(sigma), np.arange(1000, 1100))


@pytest.mark.parametrize("form", ["kalman", "constant"])
def test_lost_input_returns_gently(form, car):
    """u = -0.3 m/s^2, lost for 2 s: the jump of u is not taken for the driver's; valid again when settled."""
    log = drive_log(car, engine_torque=np.full(3000, -17.0), seconds=30)
    torque = log["engine_torque"]
    kept = (torque.time < 15) | (torque.time > 17)
    broken = log.with_signals(cd.Signal("engine_torque", torque.time[kept], torque.values[kept], "N*m"))
    estimate = cd.compile(cd.build("intent-torque", car, form=form)).run(broken)
    jerk = estimate.columns["intentional_jerk"]
    after = estimate.valid & (estimate.time > 15.6)
    assert after.any()
    assert not estimate.valid[(estimate.time > 15.6) & (estimate.time < 17.1)].any()
    assert (np.abs(jerk[after]) < 0.15).all()


@pytest.mark.parametrize("every", [1, 2, 5, 8, 12, 20])
@pytest.mark.parametrize("preset", ["bisoffi2017", "bisoffi2015"])
def test_constant_form_bears_sparse_rows(preset, every):
    """The speed on every n-th tick only: stable, and near the Kalman form (without counting, unstable from 5 or 8 on)."""
    log, _ = motion_log(200, noise=0, speed_noise=0)
    v = log["longitudinal_speed"]
    sparse = log.with_signals(cd.Signal(v.name, v.time[::every], v.values[::every], v.unit))
    run = lambda drive, form: cd.compile(cd.build("kinematic", preset=preset, form=form, ell=1.4)).run(drive)  # noqa: E731
    reference = run(log, "kalman").columns["longitudinal_jerk"][6000:]
    found = run(sparse, "constant").columns["longitudinal_jerk"][6000:]
    assert np.sqrt(np.mean((found[: reference.size] - reference[: found.size]) ** 2)) < 0.12


def test_constant_form_is_not_valid_in_a_gap():
    log, _ = motion_log(60)
    kept = (log["longitudinal_speed"].time < 30) | (log["longitudinal_speed"].time > 40)
    gappy = cd.Log.of([cd.Signal(s.name, s.time[kept], s.values[kept], s.unit) for s in log.values()])
    estimate = cd.compile(cd.build("kinematic", form="constant")).run(gappy)
    assert not estimate.valid[(estimate.time > 30.6) & (estimate.time < 42)].any()
    assert estimate.valid[(estimate.time > 50) & (estimate.time < 59)].all()


@pytest.mark.parametrize("form", ["kalman", "constant"])
def test_band_does_not_learn_from_the_start(form):
    """A log that starts while braking hard has nearly the band of one that starts before."""
    t = np.arange(6000) / 100
    a = np.where(t < 30, 0.0, -0.5)
    v = 40 + np.cumsum(a) / 100
    noise = 0.05 * np.random.default_rng(0).standard_normal(t.size)
    log = cd.Log.of(
        [cd.Signal("longitudinal_speed", t, v, "m/s"), cd.Signal("longitudinal_acceleration", t, a + noise, "m/s^2")]
    )
    program = cd.compile(cd.build("kinematic", form=form))
    whole, late = program.run(log), program.run(log.between(35, 60))
    assert late.sd("longitudinal_jerk")[-1] < 1.5 * whole.sd("longitudinal_jerk")[-1]


def test_standstill(car):
    """Standing on a slope with the brake on: no intention, no jerk, and the offset is the slope."""
    v = np.concatenate([np.full(1000, 10.0), 10 - 0.01 * np.arange(1000) * 1.0, np.zeros(2000)])
    a = np.gradient(v, 0.01) + 0.4
    t = np.arange(v.size) / 100
    log = cd.Log.of([
        cd.Signal("longitudinal_speed", t, v, "m/s"), cd.Signal("longitudinal_acceleration", t, a, "m/s^2"),
        constant("accelerator_pedal", 0, t), constant("brake_pressure", 30e5, t), constant("engine_torque", 20, t),
        constant("gear", 1, t),
    ])  # fmt: skip
    estimate = cd.compile(cd.build("intent-pedals", car)).run(log)
    stands = slice(3000, None)
    assert estimate.flag("standstill")[stands].all()
    assert not estimate.valid[stands].any()
    assert (estimate.columns["intentional_acceleration"][stands] == 0).all()
    assert (estimate.columns["intentional_jerk"][stands] == 0).all()
    assert estimate.columns["acceleration_offset"][-1] == pytest.approx(0.4, abs=0.02)


def test_reverse():
    """Unsigned wheel speeds in reverse gear: the speed is negative, and backing up is a negative acceleration."""
    t = np.arange(2000) / 100
    v = -np.clip(0.8 * t, 0, 4)
    log = cd.Log.of([
        cd.Signal("longitudinal_speed", t, np.abs(v), "m/s"),
        cd.Signal("longitudinal_acceleration", t, np.gradient(v, 0.01), "m/s^2"), constant("gear", -1, t),
    ])  # fmt: skip
    estimate = cd.compile(cd.build("kinematic", dt=0.01)).run(log)
    assert estimate.columns["longitudinal_speed"][-1] == pytest.approx(-4, abs=0.05)
    assert estimate.columns["longitudinal_acceleration"][450] == pytest.approx(-0.8, abs=0.1)


def test_missing_input_is_flagged_and_the_rest_goes_on(car):
    """The torque falls silent for 5 s: after its hold time the estimate is not valid, later it is again."""
    log = drive_log(car)
    torque = log["engine_torque"]
    kept = (torque.time < 12) | (torque.time > 17)
    broken = log.with_signals(cd.Signal("engine_torque", torque.time[kept], torque.values[kept], "N*m"))
    estimate = cd.compile(cd.build("intent-pedals", car)).run(broken)
    time = estimate.time
    assert not estimate.valid[(time > 12.6) & (time < 16.9)].any()
    assert estimate.valid[(time > 10) & (time < 12.4)].all()
    assert estimate.valid[time > 20].all()
    assert np.isfinite(estimate.columns["intentional_jerk"]).all()


def test_pedals_only_is_equation_23(car):
    """Against scipy's filter of the same s / (1 + s / (2 pi 2)), and the band's absence."""
    from scipy.signal import lsim

    t = np.arange(3000) / 100
    pedal = 0.2 + 0.1 * np.sin(2 * np.pi * 0.3 * t)
    estimate = cd.compile(cd.build("pedals-only", car, dt=0.01)).run(drive_log(car, accelerator_pedal=pedal))
    w = 2 * np.pi * 2
    _, rate, _ = lsim(([w, 0], [1, w]), pedal - pedal[0], t)
    np.testing.assert_allclose(estimate.columns["intentional_jerk"], 14 / 1550 * 325 * rate, atol=1e-9)
    np.testing.assert_allclose(estimate.columns["intentional_acceleration"], 14 / 1550 * 325 * pedal, rtol=1e-12)
    assert estimate.sd("intentional_jerk") is None


def test_brake_coefficient_does_not_matter_in_the_pedal_estimator(car, demo):
    """c_b multiplies p_b (1 - sigma): +5 % changes nothing that counts; mass +5 % does."""
    run = lambda c: cd.compile(cd.build("intent-pedals", c, ell=2)).run(demo.measured).columns["intentional_jerk"]  # noqa: E731
    base = run(car)
    rms = np.sqrt(np.mean(base**2))

    def change(name):
        other = run(car.with_parameter(name, 1.05 * car.number(name)))
        return np.sqrt(np.mean((other - base) ** 2)) / rms

    assert change("brake_coefficient") < 0.005
    assert change("mass") > 0.01
    assert change("pedal_coefficient") > 0.01


def test_prior_scale_is_a_sensors():
    """The prior of the noise scale is an accelerometer of 0.05 m/s^2 rms at 100 Hz, given R = 1."""
    assert pytest.approx(0.05**2 / 100) == PRIOR_SCALE
