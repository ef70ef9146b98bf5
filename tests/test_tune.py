"""Tuning: the likelihood against statsmodels, noise found again, delays, the curve against what filters do, and the command."""

import json

import numpy as np
import pytest

import codriver as cd
from codriver.errors import LogError, UsageError
from codriver.models import intention_model
from codriver.observers import PRESETS, design_scaled_gain, find_preset, save_preset
from codriver.observers.jerk_forms import WIDE_START
from codriver.observers.response import delay, noise_gain
from codriver.observers.riccati import stationary_predicted, tick_map
from codriver.observers.running_response import running_response
from codriver.report.tuning import tuning_document
from codriver.tune import Likelihood, calm_jerk, ell_for_delay, fit_noise, likely_ell, sensor_noise, tune
from codriver.tune.likelihood import LEAST_BLOCKS
from conftest import recording
from test_offline import gappy_log

PAPER = PRESETS["bisoffi2017"]
DT = 0.01


def drawn_log(preset, ell, seconds, seed, every=1):
    """A drive drawn from the model itself: states and rows with the preset's own noise, times 4e-4."""
    rng = np.random.default_rng(seed)
    design, C, n = design_scaled_gain(preset, DT, ell), intention_model().C, round(seconds / DT)
    factor = 4e-4
    w = rng.standard_normal((n, 4)) @ np.linalg.cholesky(factor * design.Qd).T
    v = rng.standard_normal((n, 2)) * np.sqrt(factor * np.diag(design.Rd))
    x, rows = np.array([0.0, 0.0, 0.3, 0.0]), np.empty((n, 2))
    for k in range(n):
        rows[k] = C @ x + v[k]
        x = design.F @ x + w[k]
    t = np.arange(n) * DT
    # The drawn speed wanders; it is made a fast car's, so that it never stands.
    return cd.Log.of([
        cd.Signal("longitudinal_acceleration", t, rows[:, 0], "m/s^2"),
        cd.Signal("longitudinal_speed", t[::every], 1e5 + rows[::every, 1], "m/s"),
    ])  # fmt: skip


def run(log, ell=2.0, preset="bisoffi2017"):
    return cd.compile(cd.build("kinematic", dt=DT, ell=ell, preset=preset)).run(log)


@pytest.mark.parametrize("ell", [1.0, 2.5])
@pytest.mark.parametrize(("share_a", "share_v"), [(1.0, 1.0), (0.7, 0.3)])
def test_likelihood_against_statsmodels(share_a, share_v, ell):
    """The log likelihood of all rows, with the factor that is found, is statsmodels' for Q and R times that factor."""
    module = pytest.importorskip("statsmodels.tsa.statespace.kalman_filter")
    log, y = gappy_log(2000, DT, 5, share_a, share_v)
    found = Likelihood([run(log)], every_row=True).at(PAPER, ell)
    design = design_scaled_gain(PAPER, DT, ell)
    mean = np.array([y[0, 1], 0.0, y[0, 0] if np.isfinite(y[0, 0]) else 0.0, 0.0])

    def other(factor):
        kf = module.KalmanFilter(k_endog=2, k_states=4)
        kf.bind(y.copy())
        kf["design"], kf["obs_cov"] = intention_model().C, factor * design.Rd
        kf["transition"], kf["selection"], kf["state_cov"] = design.F, np.eye(4), factor * design.Qd
        kf.initialize_known(mean, factor * WIDE_START * np.diag(np.diag(design.P)))
        kf.tolerance = 0
        return kf.loglike()

    assert found.count == np.isfinite(y).sum()
    assert found.log_likelihood == pytest.approx(other(found.factor), rel=1e-9)
    assert found.blocks.sum() == pytest.approx(found.log_likelihood)
    assert other(found.factor) > max(other(1.05 * found.factor), other(0.95 * found.factor))


def test_likelihood_runs_the_filter_itself(demo, car):
    """On a drive with gears, a standstill and holes its innovations are those of the estimator, whatever noise it began with."""
    log = demo.measured
    begun = cd.estimate_log("intent-pedals", log, car, ell=1.0, preset="bisoffi2015")
    wanted = cd.estimate_log("intent-pedals", log, car, ell=2.0)
    used = {row: wanted.flag(f"{row}_used") for row in ("acceleration", "speed")}
    e, sd = ({row: wanted.columns[f"{row}_innovation{end}"] for row in used} for end in ("", "_sd"))
    one = Likelihood([begun], every_row=True)
    square, logs = one._terms(PAPER, 2.0)[0]
    n = used["acceleration"].sum()
    for row, part in (("acceleration", slice(n)), ("speed", slice(n, None))):
        np.testing.assert_allclose(square[part] * np.exp(logs[part]), e[row][used[row]] ** 2, rtol=1e-6, atol=1e-12)
    # The estimator's variances hold the learnt factor, their ratio does not.
    both = used["acceleration"] & used["speed"]
    ratio = np.exp(logs[:n][both[used["acceleration"]]] - logs[n:][both[used["speed"]]])
    np.testing.assert_allclose(ratio, (sd["acceleration"] / sd["speed"])[both] ** 2, rtol=1e-7)


def test_rows_that_do_not_count(demo, car):
    """Shifts, standstills and starts are left out, the same rows for every noise; nothing left is an error."""
    estimate = cd.estimate_log("intent-pedals", demo.measured, car)
    some, every = Likelihood([estimate]), Likelihood([estimate], every_row=True)
    assert some.at(PAPER, 1.0).count == some.at(PAPER, 3.0).count < 0.9 * every.at(PAPER, 1.0).count
    standing = demo.measured.between(0.0, 4.0)
    with pytest.raises(LogError, match="innovations that count"):
        Likelihood([cd.estimate_log("intent-pedals", standing, car)])


@pytest.mark.parametrize("every", [1, 2])
def test_ell_is_found_again(every):
    """Drives drawn from the model at ell = 1.5: the most likely ell is that, within three standard errors of a few per cent."""
    one = Likelihood([run(drawn_log(PAPER, 1.5, 300, seed, every)) for seed in (1, 2)])
    found = likely_ell(one, PAPER)
    assert found.spread < 0.1
    assert abs(np.log(found.best / 1.5)) < 3 * found.spread
    assert found.found.log_likelihood >= np.nanmax(found.log_likelihood)
    assert found.found.factor == pytest.approx(4e-4, rel=0.05)


def test_noise_is_found_again():
    """Q and R of drives drawn from the model, begun elsewhere: those that are told lie within three standard errors."""
    true = cd.Preset((1e-4, 1e-4, 1.0, 20.0), (1.0, 0.05), 2.0, "made up")
    one = Likelihood([run(drawn_log(true, 2.0, 400, seed)) for seed in (3, 4)])
    fit = fit_noise(one, PAPER, "own", "test")
    assert fit.converged
    assert fit.found.log_likelihood > fit.start.log_likelihood
    assert fit.found.log_likelihood >= one.at(true, 2.0).log_likelihood
    told = {r.name: r for r in fit.ratios if r.told}
    assert {"Q of the offset", "Q of the jerk", "R of the speed"} <= set(told)
    for name, value in (("Q of the offset", 1.0), ("Q of the jerk", 20.0), ("R of the speed", 0.05)):
        assert abs(np.log(told[name].found / value)) < 3 * told[name].spread, name
    # 1e-4 adds nothing to the acceleration beside a jerk of 20: no drive can tell it.
    assert "Q of the acceleration" not in told
    assert fit.found.factor == pytest.approx(4e-4, rel=0.05)


@pytest.mark.slow
def test_standard_errors_hold_from_ten_blocks_on(monkeypatch):
    """Drives drawn from the model: 1.96 standard errors hold the truth from 100 s on, and from 20 s they do not."""
    monkeypatch.setattr("codriver.tune.noise.LEAST_BLOCKS", 1)
    true = cd.Preset((1e-4, 1e-4, 1.0, 20.0), (1.0, 0.05), 2.0, "made up")
    values = {"Q of the offset": 1.0, "Q of the jerk": 20.0, "R of the speed": 0.05}
    program, share = cd.compile(cd.build("kinematic", dt=DT, ell=2.0)), {}
    for seconds in (22, 102):
        held = []
        for seed in range(30):
            fit = fit_noise(Likelihood([program.run(drawn_log(true, 2.0, seconds, 1000 + seed))]), PAPER, "own", "test")
            held += [abs(np.log(r.found / values[r.name])) < 1.96 * r.spread for r in fit.ratios if r.name in values]
        share[seconds] = np.mean(held)
    assert share[22] < 0.85
    assert share[102] > 0.88


def test_it_never_gets_worse():
    """Begun at the truth, the result is at least as likely."""
    one = Likelihood([run(drawn_log(PAPER, 2.0, 60, 7))])
    fit = fit_noise(one, PAPER, "own", "test")
    assert fit.found.log_likelihood >= fit.start.log_likelihood
    assert fit.preset.ell == PAPER.ell


@pytest.mark.parametrize("wanted", [0.2, 0.5, 1.0])
@pytest.mark.parametrize(
    "preset", [PAPER, PRESETS["bisoffi2015"], cd.Preset((1e-3, 1e-3, 2.0, 9.0), (0.5, 0.02), 1.0, "own")]
)
def test_ell_for_a_delay(preset, wanted):
    ell = ell_for_delay(preset, wanted)
    assert delay(design_scaled_gain(preset, DT, ell)) == pytest.approx(wanted, rel=1e-4)
    if preset is PAPER:
        assert ell == pytest.approx(0.911 / wanted, rel=0.01)
    with pytest.raises(UsageError, match="a delay of"):
        ell_for_delay(preset, 1e-9)


@pytest.mark.parametrize("ell", [1.0, 2.0, 3.0])
@pytest.mark.parametrize("paper", sorted(PRESETS))
def test_rows_on_every_tick_give_the_closed_form(paper, ell):
    """Noise to 1 %, delay but for half a tick."""
    design = design_scaled_gain(paper, DT, ell)
    found = running_response(design)
    assert found.delay == pytest.approx(delay(design) - DT / 2, rel=0.01)
    np.testing.assert_allclose(found.noise, noise_gain(design), rtol=0.01)


@pytest.mark.parametrize("ell", [0.5, 2.0, 6.0])
@pytest.mark.parametrize("paper", sorted(PRESETS))
def test_stationary_covariance(paper, ell):
    """By doubling and by scipy's solver; over a period of ticks in which rows come in turn, by many steps."""
    design, C = design_scaled_gain(paper, DT, ell), intention_model().C
    every_tick = stationary_predicted([tick_map(design.F, design.Qd, C, np.diag(design.Rd))])
    np.testing.assert_allclose(every_tick, design.P_predicted, rtol=1e-8, atol=1e-12)
    rows = [[0, 1], [0], [], [0]]
    found = stationary_predicted([tick_map(design.F, design.Qd, C[here], np.diag(design.Rd)[here]) for here in rows])
    P = every_tick
    for _ in range(round(8000 / ell) // len(rows)):
        for here in rows:
            S = C[here] @ P @ C[here].T + design.Rd[np.ix_(here, here)]
            P = design.F @ (P - P @ C[here].T @ np.linalg.inv(S) @ C[here] @ P) @ design.F.T + design.Qd
    np.testing.assert_allclose(found, P, rtol=1e-6)


@pytest.mark.parametrize(("ell", "every"), [(3.0, (1, 1)), (3.0, (1, 5)), (1.0, (2, 3))])
def test_the_running_filter_has_that_noise_and_delay(ell, every):
    """The estimator over a million ticks of white noise, row by row: 3 %. And over a ramp of jerk: 1 %."""
    n, found = 600_000, running_response(design_scaled_gain(PAPER, DT, ell), every)
    t, white = np.arange(n) * DT, np.random.default_rng(1).standard_normal(n)
    for row in (0, 1):
        values = [white * (row == 0), 1000 + white * (row == 1)]
        names = ("longitudinal_acceleration", "longitudinal_speed")
        log = cd.Log.of([
            cd.Signal(name, t[::step], v[::step], "") for name, v, step in zip(names, values, every, strict=True)
        ])  # fmt: skip
        program = cd.compile(cd.build("kinematic", dt=DT, ell=ell), ["longitudinal_jerk"])
        assert program.run(log).columns["longitudinal_jerk"][5000:].std() == pytest.approx(found.noise[row], rel=0.03)
    t = np.arange(7801) * DT  # whole periods of either row, and its end
    ramp = {"longitudinal_acceleration": t**2 / 2, "longitudinal_speed": 10 + t**3 / 6}
    log = cd.Log.of([cd.Signal(name, t[::m], v[::m], "") for (name, v), m in zip(ramp.items(), every, strict=True)])
    late = t - run(log, ell).columns["longitudinal_jerk"][: t.size]
    assert late[-601:-1].mean() == pytest.approx(found.delay, rel=0.01)


def test_sensor_noise_is_seen_through_the_drive(demo, car):
    """The simulated accelerometer scatters by 0.06 m/s^2, the mean of two wheels by 0.012 / sqrt(2) m/s; with their steps."""
    found = sensor_noise([cd.estimate_log("intent-pedals", demo.measured, car)])
    assert found[0] == pytest.approx(np.hypot(0.06, 0.01 / 12**0.5), rel=0.05)
    assert found[1] == pytest.approx(np.hypot(0.012, 0.01 / 12**0.5) / 2**0.5, rel=0.05)


def test_calm_stretches(car):
    """Pedals at rest: the scatter is the noise. Pedals that move: there is no calm stretch. No pedals: nobody can say."""
    n = 12000
    t, rng = np.arange(n) * DT, np.random.default_rng(2)
    sd = 0.05
    log = cd.Log.of([
        cd.Signal("longitudinal_acceleration", t, sd * rng.standard_normal(n), ""),
        cd.Signal("longitudinal_speed", t, np.full(n, 20.0), ""),
    ])  # fmt: skip
    pedal = np.where(t < 1.0, 1.0, 0.2)
    still = log.with_signals(cd.Signal("accelerator_pedal", t, pedal, "1"))
    moving = log.with_signals(cd.Signal("accelerator_pedal", t, 0.5 + 0.4 * np.sin(t), "1"))
    assert calm_jerk([run(log)]) is None
    assert calm_jerk([run(moving)]) is None
    gain = running_response(design_scaled_gain(PAPER, DT, 2.0)).noise[0]
    assert calm_jerk([run(still)]) == pytest.approx(gain * sd, rel=0.15)


@pytest.fixture(scope="module")
def tuned(demo, car):
    """By likelihood, by delay, and by both, on the demo."""
    asked = {"likelihood": {}, "delay": {"delay": 0.5}, "both": {"delay": 0.5, "likelihood": True}}
    return {way: tune([demo.measured], "intent", car, name="mine", **options) for way, options in asked.items()}


@pytest.mark.parametrize("way", ["likelihood", "delay", "both"])
def test_what_a_tuning_says(way, tuned):
    """The result is on its own curve, and is as likely as it says."""
    one = tuned[way]
    assert one.estimator == "intent-pedals"
    assert (one.noise is None) == (way == "delay")
    if way == "delay":
        assert (one.preset.Q, one.preset.R) == (PAPER.Q, PAPER.R)
    if way != "likelihood":
        assert one.chosen.slow_delay == pytest.approx(0.5, rel=1e-4)
    else:
        assert one.evidence.log_likelihood >= one.profile.found.log_likelihood >= one.noise.start.log_likelihood
    delays = [p.delay for p in one.curve]
    noises = np.log([p.noise for p in one.curve])
    assert np.interp(one.chosen.delay, delays[::-1], noises[::-1]) == pytest.approx(np.log(one.chosen.noise), abs=0.05)
    for p in (*one.marks, one.chosen):
        assert 0.9 * p.noise < p.calm < 2 * p.noise
    assert [w.row for w in one.after] == ["acceleration", "speed"]


def test_likelihood_whitens_the_innovations(tuned):
    """What maximum likelihood is for; what comes out lags far less than one would choose."""
    one = tuned["likelihood"]
    for before, after in zip(one.before, one.after, strict=True):
        assert abs(after.correlation[0]) < 0.4 * abs(before.correlation[0])
    assert one.chosen.slow_delay < 0.2


def test_an_own_preset_is_used(tuned, demo, car, tmp_path):
    save_preset(tuned["both"].preset, tmp_path / "mine.toml")
    estimate = cd.estimate_log("intent-pedals", demo.measured, car, preset=tmp_path / "mine.toml")
    assert float(estimate.provenance["delay_s"]) == pytest.approx(0.5, rel=1e-4)
    assert estimate.provenance["preset"] == "mine"


@pytest.mark.parametrize("way", ["likelihood", "delay", "both"])
def test_document(way, tuned):
    document = tuning_document(tuned[way], "mine.toml", "codriver tune ...")
    assert [s.title for s in document.sections] == [
        "Where it lies", "What the rows say", "Innovations before and after", "How to use it",
    ]  # fmt: skip
    said = " ".join(part for s in document.sections for part in s.parts if isinstance(part, str))
    assert "--preset mine.toml" in said
    assert ("ripples of body" in said) == (way == "likelihood")


def test_what_cannot_be_tuned(demo, car):
    with pytest.raises(UsageError, match="no drives"):
        tune([], "kinematic")
    with pytest.raises(UsageError, match="has no noise"):
        tune([demo.measured], "pedals-only", car)
    with pytest.raises(UsageError, match="has no noise"):
        tune([demo.measured], "pedals-only", car, delay=0.4)
    with pytest.raises(UsageError, match="neither a delay nor"):
        tune([demo.measured], "kinematic", likelihood=False)


# What a new user gets wrong in one sensor, and what is said.
WRONG = {
    "sign": ("longitudinal_acceleration", lambda x: -x, "sign is wrong"),
    "stuck at 0": ("longitudinal_acceleration", lambda x: 0 * x, "longitudinal_acceleration is 0 all the time"),
    "mostly held": ("longitudinal_acceleration", lambda x: np.repeat(x[::50], 50)[: x.size], "has no scatter"),
    "g": ("longitudinal_acceleration", lambda x: x / 9.81, "g read as"),
    "km/h": ("longitudinal_speed", lambda x: 3.6 * x, "km/h read as"),
}


@pytest.mark.parametrize("what", WRONG)
@pytest.mark.parametrize("options", [{}, {"delay": 0.4}], ids=["likelihood", "delay"])
def test_drives_whose_data_contradict_are_refused(what, options, demo):
    name, change, said = WRONG[what]
    signal = demo.measured[name]
    log = demo.measured.with_signals(cd.Signal(name, signal.time, change(signal.values), signal.unit))
    with pytest.raises(LogError, match="not fit to tune on") as refused:
        tune([demo.measured, log], "kinematic", **options)
    assert said in str(refused.value)


def test_a_stuck_sensor_on_a_steady_drive_is_refused():
    """A constant speed to which the check has nothing to say: 1 m/s^2 of hill, nothing else."""
    t, noise = np.arange(15_000) * DT, np.random.default_rng(0).standard_normal(15_000)
    log = cd.Log.of([
        cd.Signal("longitudinal_acceleration", t, 1 + 0.05 * noise, "m/s^2"),
        cd.Signal("longitudinal_speed", t, np.full(t.size, 20.0), "m/s"),
    ])  # fmt: skip
    assert run(log).check().trusted
    with pytest.raises(LogError, match="longitudinal_speed is 20 all the time"):
        tune([log], "kinematic", delay=0.4)


def test_standard_errors_need_blocks(demo):
    """A short drive tells neither Q and R nor how sure ell is; it may still serve for a delay."""
    short = demo.measured.between(20.0, 90.0)
    with pytest.raises(LogError, match="at least 10 blocks, 100 s"):
        tune([short], "kinematic")
    one = tune([short], "kinematic", delay=0.4)
    assert one.blocks < LEAST_BLOCKS
    assert one.profile.spread == np.inf
    said = " ".join(part for s in tuning_document(one).sections for part in s.parts if isinstance(part, str))
    assert f"too few blocks of 10 s count ({one.blocks}, 10 are needed)" in said
    # The band of the preset begun with is too narrow for it, which no wrong sensor is the cause of: at a larger ell it fits.
    assert not run(short).check().trusted
    assert run(short, one.profile.best).check().trusted
    fit = fit_noise(Likelihood([run(short)]), PAPER, "own", "test")
    assert not any(ratio.told or np.isfinite(ratio.spread) for ratio in fit.ratios)
    # Two such drives have enough together.
    assert np.isfinite(tune([short, demo.measured.between(90.0, 180.0)], "kinematic", delay=0.4).profile.spread)


def test_the_zoe_scene_is_too_short():
    log = cd.read(recording("nuscenes-zoe-scene-0103"))
    with pytest.raises(LogError, match="1 block of 10 s: too few"):
        tune([log], "kinematic")


class TestCommand:
    @pytest.fixture
    def call(self, demo_files):
        from typer.testing import CliRunner

        from codriver.cli.app import app

        options = ["--dbc", str(demo_files.dbc), "--names", str(demo_files.names)]

        def command(*arguments):
            return CliRunner().invoke(app, ["tune", "kinematic", str(demo_files.log), *options, *map(str, arguments)])

        return command

    def test_preset_report_and_json(self, call, tmp_path):
        out, report = tmp_path / "mine.toml", tmp_path / "mine.html"
        ran = call("--delay", 0.4, "--likelihood", "-o", out, "--report", report, "--json")
        assert ran.exit_code == 0, ran.output
        told = json.loads(ran.stdout)
        preset = find_preset(out)
        assert (preset.name, preset.ell) == ("mine", told["preset"]["ell"])
        assert told["chosen"]["delay_s"] == pytest.approx(0.4, rel=1e-4)
        assert told["converged"] is True
        assert "Delay against noise" in report.read_text(encoding="utf-8")
        assert sorted(path.name for path in tmp_path.iterdir()) == ["mine.html", "mine.toml"]

    def test_nothing_is_overwritten(self, call, tmp_path):
        kept = tmp_path / "car.toml"
        kept.write_text('name = "a car"\n', encoding="utf-8")
        for wrong in (kept, tmp_path / "preset.txt", tmp_path / "bisoffi2017.toml", tmp_path / "none" / "x.toml"):
            for also in ((), ("--overwrite",)):
                assert isinstance(call("--delay", 0.4, "-o", wrong, *also).exception, UsageError)
        assert kept.read_text(encoding="utf-8") == 'name = "a car"\n'

    def test_a_preset_is_replaced_only_if_asked(self, call, tmp_path):
        out = tmp_path / "mine.toml"
        save_preset(cd.Preset((1, 1, 1, 1), (1, 1), 1.0, "test", "mine"), out)
        before = out.read_bytes()
        refused = call("--delay", 0.4, "-o", out).exception
        assert isinstance(refused, UsageError)
        assert "--overwrite" in str(refused)
        assert out.read_bytes() == before
        ran = call("--delay", 0.4, "-o", out, "--overwrite")
        assert ran.exit_code == 0, ran.output
        assert "kinematic tuned on drive.blf" in ran.stdout
        assert find_preset(out).ell == pytest.approx(0.911 / 0.4, rel=0.01)

    def test_preset_and_report_both_or_neither(self, call, tmp_path, monkeypatch):
        monkeypatch.setattr("codriver.observers.save_preset", lambda preset, path: 1 / 0)
        ran = call("--delay", 0.4, "-o", tmp_path / "mine.toml", "--report", tmp_path / "mine.html")
        assert isinstance(ran.exception, ZeroDivisionError)
        assert not list(tmp_path.iterdir())

    @pytest.mark.parametrize("command", ["tune", "smooth"])
    def test_help_offers_what_it_takes(self, command):
        from typer.testing import CliRunner

        from codriver.cli.app import app

        said = CliRunner().invoke(app, [command, "--help"]).stdout
        assert "kinematic" in said
        assert "pedals-only" not in said

    def test_misuse(self, call):
        assert isinstance(call("--delay", -1).exception, UsageError)
        assert isinstance(call("--preset", "none").exception, UsageError)
