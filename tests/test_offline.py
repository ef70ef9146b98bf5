"""The smoothers against the joint Gaussian, statsmodels and the filter; what they do not look across; what they are worth."""

import json

import numpy as np
import pytest

import codriver as cd
from codriver.errors import UsageError
from codriver.models import intention_model
from codriver.observers import design_scaled_gain
from codriver.observers.jerk_forms import WIDE_START
from codriver.offline import SmoothedEstimate, smooth
from codriver.simulate.judge import at
from conftest import motion_log

MOTION = ("longitudinal_speed", "longitudinal_acceleration", "acceleration_offset", "longitudinal_jerk")
INTENTION = ("longitudinal_speed", "intentional_acceleration", "acceleration_offset", "intentional_jerk")


def gappy_log(n, dt, seed, share_a, share_v):
    """Random rows, some missing; the first and last speed are there. Also the rows as arrays, NaN where missing."""
    rng = np.random.default_rng(seed)
    t = np.arange(n) * dt
    y = np.column_stack([rng.standard_normal(n), 20 + 0.1 * rng.standard_normal(n)])
    y[rng.random(n) > share_a, 0] = np.nan
    missing = rng.random(n) > share_v
    missing[[0, -1]] = False
    y[missing, 1] = np.nan
    signals = []
    for column, name in enumerate(("longitudinal_acceleration", "longitudinal_speed")):
        there = np.isfinite(y[:, column])
        signals.append(cd.Signal(name, t[there], y[there, column], ""))
    return cd.Log.of(signals), y


def prior(design, y):
    """What the observer starts from at its first speed."""
    mean = np.array([y[0, 1], 0.0, y[0, 0] if np.isfinite(y[0, 0]) else 0.0, 0.0])
    return mean, WIDE_START * np.diag(np.diag(design.P))


def joint(design, y):
    """Mean and covariance of all states stacked, and each row with its noise: (mean, covariance, H, noise, values, tick)."""
    n, C = len(y), intention_model().C
    mean, P0 = prior(design, y)
    means, marginals = [mean], [P0]
    for _ in range(n - 1):
        means.append(design.F @ means[-1])
        marginals.append(design.F @ marginals[-1] @ design.F.T + design.Qd)
    covariance = np.zeros((4 * n, 4 * n))
    for i in range(n):
        block = marginals[i]
        for k in range(i, n):
            covariance[4 * i : 4 * i + 4, 4 * k : 4 * k + 4] = block
            covariance[4 * k : 4 * k + 4, 4 * i : 4 * i + 4] = block.T
            block = block @ design.F.T
    H, noise, values, tick = [], [], [], []
    for k, i in zip(*np.nonzero(np.isfinite(y)), strict=True):
        row = np.zeros(4 * n)
        row[4 * k : 4 * k + 4] = C[i]
        H.append(row)
        noise.append(design.Rd[i, i])
        values.append(y[k, i])
        tick.append(k)
    return np.concatenate(means), covariance, np.array(H), np.array(noise), np.array(values), np.array(tick)


def given(model, k, last):
    """The state at tick k given the rows up to tick `last`, at one stroke: mean and variances."""
    mean, covariance, H, noise, values, tick = model
    use = tick <= last
    S = H[use] @ covariance @ H[use].T + np.diag(noise[use])
    here = slice(4 * k, 4 * k + 4)
    gain = covariance[here] @ H[use].T @ np.linalg.inv(S)
    return (
        mean[here] + gain @ (values[use] - H[use] @ mean),
        np.diag(covariance[here, here] - gain @ H[use] @ covariance[:, here]),
    )


@pytest.mark.parametrize(
    ("share_a", "share_v", "lag"),
    [
        *((1.0, 1.0, lag) for lag in (1, None)),
        *((1.0, 0.5, lag) for lag in (5, 13)),
        *((0.6, 0.3, lag) for lag in (1, 13, None)),
        *((0.3, 0.05, lag) for lag in (5, None)),
    ],
)
def test_against_brute_force(share_a, share_v, lag):
    """Every state given exactly the rows that it may look at, from the joint Gaussian: no recursion at all."""
    dt, n = 0.02, 40
    log, y = gappy_log(n, dt, 3, share_a, share_v)
    design = design_scaled_gain("bisoffi2017", dt, 2.0)
    model = joint(design, y)
    found = smooth(log, "kinematic", dt=dt, ell=2.0, lag=None if lag is None else lag * dt)
    scale = scales(found, log, dt)
    for k in range(n):
        mean, variance = given(model, k, n - 1 if lag is None else min(k + lag, n - 1))
        np.testing.assert_allclose([found.columns[name][k] for name in MOTION], mean, rtol=1e-8, atol=1e-8)
        sd = [found.sd(name)[k] for name in MOTION]
        np.testing.assert_allclose(sd, np.sqrt(scale[k] * variance), rtol=1e-6)


def scales(found, log, dt):
    """The filter's noise scale at each tick: its jerk's variance over that of the covariance it carries."""
    program = cd.compile(cd.build("kinematic", dt=dt, ell=2.0))
    stepper, grid, scale = program.live(), found.grid, []
    for k in range(len(grid)):
        row = [grid.values[c][k] for c in program.observer.channels]
        flags = [bool(column[k]) for column in program.observer.flag_columns(grid)]
        out = dict(zip(stepper.outputs, stepper([*row, *flags]), strict=True))
        scale.append(out["longitudinal_jerk_sd"] ** 2 / stepper.carry["P_jerk_jerk"])
    return np.array(scale)


def test_against_statsmodels():
    """statsmodels' smoother over 2,000 partly missing rows."""
    module = pytest.importorskip("statsmodels.tsa.statespace.kalman_smoother")
    dt, n = 0.01, 2000
    log, y = gappy_log(n, dt, 5, 0.7, 0.3)
    design = design_scaled_gain("bisoffi2017", dt, 2.0)
    other = module.KalmanSmoother(k_endog=2, k_states=4)
    other.bind(y.copy())
    other["design"], other["obs_cov"] = intention_model().C, design.Rd
    other["transition"], other["selection"], other["state_cov"] = design.F, np.eye(4), design.Qd
    other.initialize_known(*prior(design, y))
    other.tolerance = 0
    wanted = other.smooth().smoothed_state.T
    found = smooth(log, "kinematic", dt=dt, ell=2.0)
    np.testing.assert_allclose(np.column_stack([found.columns[name] for name in MOTION]), wanted, rtol=1e-7, atol=1e-7)


def stretches(estimate):
    """First and last tick of each stretch of moving with known inputs."""
    started = np.logical_or.accumulate(estimate.flag("speed_used"))
    moving = started & ~estimate.flag("standstill") & estimate.flag("inputs_known")
    edges = np.flatnonzero(np.diff(np.concatenate([[0], moving.astype(int), [0]])))
    return list(zip(edges[::2], edges[1::2] - 1, strict=True))


def test_a_stretch_with_known_input_against_statsmodels(demo, car):
    """From leaving a standstill to the next, with the powertrain's input, rows at two rates and a hole in the speed."""
    module = pytest.importorskip("statsmodels.tsa.statespace.kalman_smoother")
    dt, C = 0.01, intention_model().C
    speed = demo.measured["longitudinal_speed"]
    kept = (speed.time < 41) | (speed.time > 42.2)
    log = demo.measured.with_signals(cd.Signal(speed.name, speed.time[kept], speed.values[kept], "m/s"))
    found, filtered = (smooth(log, "intent-pedals", car, dt=dt, ell=2.0, lag=lag) for lag in (None, 0.0))
    first, last = max(stretches(found), key=lambda s: s[1] - s[0])
    assert found.flag("standstill")[first - 1]
    assert first * dt < 41 < 43 < last * dt
    design = design_scaled_gain("bisoffi2017", dt, 2.0)
    # At a standstill a_i and j_i are 0, as uncertain as in the stationary filter; v and o_a are the filter's.
    x0 = np.array([filtered.columns[name][first - 1] for name in INTENTION])
    P0 = _covariance_before(log, car, dt, first)
    here = slice(first, last + 1)
    u = found.columns["known_input"][here]
    y = np.column_stack([
        np.where(found.grid.fresh[name][here], found.grid.values[name][here], np.nan)
        for name in ("longitudinal_acceleration", "longitudinal_speed")
    ])  # fmt: skip
    push = np.zeros((4, u.size))
    push[0] = 0.5 * dt * (u + np.append(u[1:], 0.0))
    other = module.KalmanSmoother(k_endog=2, k_states=4)
    other.bind(y.copy())
    other["design"], other["obs_cov"] = C, design.Rd
    other["transition"], other["selection"], other["state_cov"] = design.F, np.eye(4), design.Qd
    other["obs_intercept"], other["state_intercept"] = np.vstack([u, 0 * u]), push
    mean = design.F @ x0 + np.array([0.5 * dt * u[0], 0, 0, 0])
    other.initialize_known(mean, design.F @ P0 @ design.F.T + design.Qd)
    other.tolerance = 0
    wanted = other.smooth().smoothed_state.T
    ours = np.column_stack([found.columns[name][here] for name in INTENTION])
    np.testing.assert_allclose(ours, wanted, rtol=1e-6, atol=1e-6)


def _covariance_before(log, car, dt, tick):
    """What the filter carries into a tick."""
    program = cd.compile(cd.build("intent-pedals", car, dt=dt, ell=2.0))
    first = program.run(log)
    grid = log.sample(program.observer.channels, dt, start=first.time[0], stop=first.time[tick - 1])
    carry, _ = program.advance(grid, program.observer.carry)
    states = ("speed", "acceleration", "offset", "jerk")
    entry = lambda i, k: carry[f"P_{states[min(i, k)]}_{states[max(i, k)]}"]  # noqa: E731
    return np.array([[entry(i, k) for k in range(4)] for i in range(4)])


def test_between_filter_and_whole_drive(demo, car):
    """No lag is the filter to the bit, a lag longer than the drive is the fixed interval; the last sample is the filter's."""
    log = demo.measured
    causal = cd.estimate_log("intent-pedals", log, car, ell=2.0)
    none, half, long, whole = (smooth(log, "intent-pedals", car, ell=2.0, lag=lag) for lag in (0.0, 0.5, 150.0, None))
    for name in causal.columns:
        np.testing.assert_array_equal(none.columns[name], causal.columns[name])
    for name in INTENTION:
        np.testing.assert_allclose(long.columns[name], whole.columns[name], rtol=1e-9, atol=1e-9)
        assert np.abs(half.columns[name] - whole.columns[name]).max() > 1e-3
        last = stretches(whole)[-1][1]
        assert whole.columns[name][last] == pytest.approx(causal.columns[name][last], abs=1e-12)
        # Knowing more never makes it less sure.
        assert np.all(whole.sd(name) <= half.sd(name) * (1 + 1e-9))
        assert np.all(half.sd(name) <= causal.sd(name) * (1 + 1e-9))


def test_a_stretch_does_not_know_the_next(demo, car):
    """What comes after the car stood, or after an input was lost, changes nothing before."""
    log = demo.measured
    torque = log["engine_torque"]
    lost = (torque.time > 60) & (torque.time < 64)
    broken = log.with_signals(cd.Signal(torque.name, torque.time[~lost], torque.values[~lost], "N*m"))
    whole = smooth(broken, "intent-pedals", car, ell=2.0)
    gaps = ~whole.flag("inputs_known") & (whole.time > 55)
    begin, end = whole.time[gaps][[0, -1]]
    assert 60 < begin < end < 65
    assert not whole.valid[gaps].any()
    accelerometer = broken["longitudinal_acceleration"]
    for cut in (begin, end):
        bent = accelerometer.values + 3.0 * (accelerometer.time > cut + 0.005)
        changed = broken.with_signals(cd.Signal(accelerometer.name, accelerometer.time, bent, "m/s^2"))
        other = smooth(changed, "intent-pedals", car, ell=2.0)
        before = whole.time < begin - 0.005
        for name in INTENTION:
            np.testing.assert_array_equal(whole.columns[name][before], other.columns[name][before])
    assert np.abs(other.columns["intentional_jerk"] - whole.columns["intentional_jerk"]).max() > 0.1
    standing = whole.flag("standstill")
    assert standing.any()
    assert not whole.columns["intentional_jerk"][standing].any()


def test_it_says_that_it_is_not_causal(demo, car):
    whole = smooth(demo.measured, "intent", car, lag=0.5)
    assert isinstance(whole, SmoothedEstimate)
    assert (whole.observer, whole.lag) == ("intent-pedals, smoothed", 0.5)
    assert whole.provenance["smoother"] == "fixed lag of 0.5 s"
    assert "delay_s" not in whole.provenance
    assert whole.check().trusted


def test_the_start_is_valid_sooner_and_judged_later():
    """A filter knows little in its first seconds, and its innovations there say nothing of the smoothed estimate."""
    log, _ = motion_log(30)
    causal, whole = cd.estimate_log("kinematic", log), smooth(log, "kinematic")
    assert whole.valid[:40].all()
    assert not causal.valid[:40].any()
    ours, theirs = whole.check(), causal.check()
    assert all(ours.nis[row] < theirs.nis[row] for row in ("acceleration", "speed"))
    assert [f.severity for f in ours.findings if f.severity != "ok"] == []
    later = causal.valid & (causal.time > causal.time[causal.valid][0] + 1.0)
    normal = causal.columns["speed_innovation"] / causal.columns["speed_innovation_sd"]
    assert ours.nis["speed"] == pytest.approx(np.mean(normal[later] ** 2), rel=1e-3)


def test_what_cannot_be_smoothed(demo, car):
    with pytest.raises(UsageError, match="pedals-only cannot be smoothed"):
        smooth(demo.measured, "pedals-only", car)
    for lag in (-1.0, float("nan"), float("inf")):
        with pytest.raises(UsageError, match="a lag of"):
            smooth(demo.measured, "intent-pedals", car, lag=lag)


def test_a_known_jerk_is_found_without_lag():
    """On a sinusoidal jerk the smoother is several times nearer to the moment's truth than the filter."""
    log, jerk = motion_log(60)
    rms = lambda x: float(np.sqrt(np.mean(x[500:-500] ** 2)))  # noqa: E731
    causal, whole = cd.estimate_log("kinematic", log, ell=2.0), smooth(log, "kinematic", ell=2.0)
    errors = [rms(e.columns["longitudinal_jerk"] - jerk) for e in (causal, whole)]
    assert errors[1] < 0.2 * errors[0]


@pytest.mark.parametrize(("ell", "share", "coverage"), [(1.0, 0.75, 0.75), (2.0, 0.5, 0.9), (3.0, 0.5, 0.95)])
def test_how_much_better(ell, share, coverage, demo, car):
    """Jerk against the moment's truth, with no lag taken out: the filter is no better than the answer 0, the smoother is."""
    causal = cd.estimate_log("intent-pedals", demo.measured, car, ell=ell)
    whole = smooth(demo.measured, "intent-pedals", car, ell=ell)
    truth, valid = at(demo.truth, "intentional_jerk", causal.time), causal.valid
    rms = lambda x: np.sqrt(np.mean(x[valid] ** 2))  # noqa: E731
    off = whole.columns["intentional_jerk"] - truth
    ours, filtered, zero = rms(off), rms(causal.columns["intentional_jerk"] - truth), rms(truth)
    assert ours < share * filtered
    assert ours < share * zero
    assert filtered > 0.8 * zero
    inside = (np.abs(off) <= 1.96 * whole.sd("intentional_jerk"))[whole.valid]
    assert inside.mean() > coverage


def test_command(tmp_path, demo_files):
    """`codriver smooth` is `smooth`, with the outputs, summary and report of `codriver estimate`."""
    from typer.testing import CliRunner

    from codriver.cli.app import app

    out, report = tmp_path / "drive.parquet", tmp_path / "drive.html"
    options = ["--dbc", str(demo_files.dbc), "--names", str(demo_files.names), "--vehicle", "bisoffi2017"]
    asked = ["smooth", "intent", str(demo_files.log), "-o", str(out), *options, "--ell", "2.5", "--report", str(report)]
    ran = CliRunner().invoke(app, [*asked, "--lag", "0.5", "--json"])
    assert ran.exit_code == 0, ran.output
    told = json.loads(ran.stdout)
    assert (told["estimator"], told["settings"]["smoother"]) == ("intent-pedals, smoothed", "fixed lag of 0.5 s")
    log = cd.read(demo_files.log, dbc=demo_files.dbc, names=demo_files.names)
    wanted = smooth(log, "intent-pedals", "bisoffi2017", ell=2.5, lag=0.5)
    import pyarrow.parquet as pq

    np.testing.assert_array_equal(pq.read_table(out)["intentional_jerk"].to_numpy(), wanted.columns["intentional_jerk"])
    assert "fixed lag of 0.5 s" in report.read_text(encoding="utf-8")
    refused = CliRunner().invoke(app, ["smooth", "pedals-only", *asked[2:]])
    assert isinstance(refused.exception, UsageError)
    assert CliRunner().invoke(app, [*asked, "--lag", "-1"]).exception.exit_code == 2
