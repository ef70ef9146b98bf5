"""Driver styles: bursts against plans, intervals against theory, scores against least squares, places against geometry."""

from __future__ import annotations

import base64
import gzip
import json
import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import codriver as cd
from codriver.drivers import (
    burst_threshold,
    compare_drivers,
    course_of,
    default_scale,
    describe_style,
    find_bursts,
    load_scale,
    make_scale,
    rate_style,
    save_scale,
    save_styles,
    slope_agreement,
)
from codriver.drivers.bursts import runs
from codriver.drivers.counts import dispersion, poisson_interval
from codriver.drivers.pedal import reversals
from codriver.drivers.position import Path as Line
from codriver.drivers.position import has_position, path_of, place, project
from codriver.drivers.resampling import block_index, interval, quantile_intervals
from codriver.drivers.scale import features_of, scores, sure
from codriver.drivers.scale_file import parse_scale, scale_text
from codriver.drivers.threshold import greatest_response, impulse_response
from codriver.errors import LogError, MissingSignal, UsageError
from codriver.logs.write import Column, write_table
from codriver.observers import design_scaled_gain
from codriver.observers.intent import INTENTION
from codriver.observers.observer import Output
from codriver.simulate import drive, measured_log, truth_log
from codriver.simulate.road import KMH, Curve, Grade, Stop, Zone, build_road
from codriver.simulate.styles import STYLES

DT = 0.01
OUTPUTS = (*INTENTION, Output("valid", "1", "flag", "settled"))


def hilly(seed: int, length: float = 4200.0):
    """Some five minutes with hills, of which no other seed has the same."""
    random = np.random.default_rng(seed)
    at = np.arange(250.0, length - 350.0, 400.0)
    return build_road(
        f"hills {seed}", length,
        [Zone(0, 50 * KMH), Zone(900, 80 * KMH), Zone(1900, 50 * KMH), Zone(2600, 100 * KMH), Zone(3700, 50 * KMH)],
        grades=[Grade(float(s), 150.0, float(random.normal(0, 0.03))) for s in at],
        curves=[Curve(500, 560, 40), Curve(2100, 2150, -35), Curve(1400, 1480, 120)], stops=[Stop(0, 2.0), Stop(2300, 5.0)],
    )  # fmt: skip


@pytest.fixture(scope="module")
def driven(car):
    """Estimates, truths, traces and logs of three drivers on one road, and of one on another road."""
    found = {}
    for style, road in (("aggressive", 1), ("ordinary", 1), ("smooth", 1), ("ordinary", 2)):
        trace = drive(hilly(road), 400.0, style=STYLES[style], seed=40 + road, record_every=5)
        log = measured_log(trace, seed=7)
        found[style, road] = cd.estimate_log("intent-pedals", log, car), truth_log(trace), trace, log
    return found


@pytest.fixture(scope="module")
def triplet(driven):
    return {style: driven[style, 1][0] for style in ("aggressive", "ordinary", "smooth")}


def made(jerk: np.ndarray, speed: np.ndarray | float = 15.0, valid: np.ndarray | None = None, **log: cd.Signal):
    """An estimate of given jerk and speed."""
    n = jerk.size
    time = np.arange(n) * DT
    columns = {
        "longitudinal_speed": np.broadcast_to(np.asarray(speed, float), n).copy(),
        "intentional_acceleration": np.cumsum(jerk) * DT, "acceleration_offset": np.zeros(n), "intentional_jerk": jerk,
        "valid": np.ones(n) if valid is None else valid.astype(float),
    }  # fmt: skip
    settings = {"ell": "2.0", "preset": "bisoffi2017", "form": "kalman", "delay_s": "0.455581"}
    return cd.Estimate(
        "intent-pedals", cd.Grid(time, DT, {}, {}, {}), columns, OUTPUTS, (), settings, cd.Log(log, "made")
    )


def bump(n: int, centre: int, half: int, peak: float) -> np.ndarray:
    x = np.clip((np.arange(n) - centre) / half, -1, 1)
    return peak * (1 - x**2) ** 2


class TestThreshold:
    @pytest.mark.parametrize(("preset", "ell"), [("bisoffi2017", 1.0), ("bisoffi2017", 3.0), ("bisoffi2015", 2.0)])
    def test_impulse_response_is_that_of_another_library(self, preset, ell):
        from scipy.signal import StateSpace, impulse

        from codriver.models import intention_model

        design = design_scaled_gain(preset, 0.01, ell)
        model = intention_model()
        # From true jerk to estimate: the error dynamics driven by the jump of the acceleration.
        system = StateSpace(model.A - design.L @ model.C, [[0], [1], [0], [0]], [[0, 0, 0, -1]], [[0]])
        time, h = impulse_response(design)
        wanted = impulse(system, T=time)[1]
        assert np.abs(h - wanted).max() < 1e-6 * h.max()
        assert h.sum() * (time[1] - time[0]) == pytest.approx(1.0, abs=5e-3)

    def test_scales_with_the_knob(self):
        one, two = (greatest_response(design_scaled_gain("bisoffi2017", 0.01, ell)) for ell in (1.0, 2.0))
        assert two == pytest.approx(2 * one, rel=1e-4)
        assert two == pytest.approx(1.70, abs=0.01)

    def test_noise_of_a_log_that_holds_nothing_else(self, car):
        """Steady driving with known white noise: the noise told is the scatter of the jerk."""
        random = np.random.default_rng(3)
        t = np.arange(12_000) * DT
        log = cd.Log.of([
            cd.Signal("longitudinal_acceleration", t, 0.08 * random.standard_normal(t.size), "m/s^2"),
            cd.Signal("longitudinal_speed", t, 15 + 0.02 * random.standard_normal(t.size), "m/s"),
        ])  # fmt: skip
        estimate = cd.estimate_log("kinematic", log)
        scatter = estimate["longitudinal_jerk"].values[estimate.valid].std()
        found = burst_threshold(estimate)
        assert found.noise == pytest.approx(scatter, rel=0.15)
        assert not found.noisy

    def test_noise_sets_the_threshold_of_a_bad_sensor(self):
        random = np.random.default_rng(3)
        t = np.arange(6000) * DT
        log = cd.Log.of([
            cd.Signal("longitudinal_acceleration", t, 3.0 * random.standard_normal(t.size), "m/s^2"),
            cd.Signal("longitudinal_speed", t, 15 + 0.02 * random.standard_normal(t.size), "m/s"),
        ])  # fmt: skip
        found = burst_threshold(cd.estimate_log("kinematic", log))
        assert found.noisy
        assert found.on > 0.5


class TestBursts:
    def test_one_burst(self):
        jerk = bump(3000, 1500, 100, -1.2)
        (burst,) = find_bursts(made(jerk))
        limits = find_bursts(made(jerk)).threshold
        above = np.flatnonzero(-jerk > limits.off)
        assert burst.peak == pytest.approx(15.0)
        assert (burst.start, burst.stop) == pytest.approx((above[0] * DT, (above[-1] + 1) * DT))
        assert burst.sign == -1
        assert burst.jerk == -1.2
        assert burst.change == pytest.approx(jerk[above].sum() * DT)
        assert burst.duration == pytest.approx(above.size * DT)

    @pytest.mark.parametrize(
        ("jerk", "count"),
        [
            (bump(3000, 1500, 100, 0.3), 0),  # too low
            (bump(3000, 1500, 6, 3.0), 0),  # a spike: too short
            (bump(3000, 1500, 15, 1.0), 0),  # too little change
            (bump(3000, 1500, 200, 0.8) - bump(3000, 1500, 40, 0.5), 1),  # uneven top, above half the threshold
            (bump(3000, 1500, 200, 0.8) - bump(3000, 1500, 40, 0.8), 2),  # two
            (bump(3000, 1000, 100, 1.0) - bump(3000, 1200, 100, 1.0), 2),  # up, and at once down
        ],
    )
    def test_what_counts(self, jerk, count):
        assert len(find_bursts(made(jerk))) == count

    def test_times_are_shifted_only_if_asked(self):
        estimate = made(bump(3000, 1500, 100, 1.0))
        plain, shifted = find_bursts(estimate), find_bursts(estimate, shift=True)
        assert plain.shifted == 0.0
        assert plain[0].peak - shifted[0].peak == pytest.approx(0.455581)
        assert plain[0].duration == pytest.approx(shifted[0].duration)

    def test_what_is_not_valid_is_no_burst(self):
        valid = np.ones(3000, bool)
        valid[1400:1600] = False
        assert len(find_bursts(made(bump(3000, 1500, 100, 1.0), valid=valid))) == 0

    def test_refuses_an_estimate_of_the_vehicle(self, driven):
        with pytest.raises(MissingSignal, match="intentional_jerk"):
            find_bursts(cd.estimate_log("kinematic", driven["ordinary", 1][3]))
        with pytest.raises(UsageError, match="threshold"):
            find_bursts(made(np.zeros(100)), threshold=-1.0)

    def test_planned_bursts_are_found(self, driven):
        """Roads and seeds that set no threshold: large planned bursts have an answer of their sign within twice the delay."""
        planned = found = answered = bursts = 0
        for estimate, truth, _, _ in driven.values():
            mine, late = find_bursts(estimate), 2 * 0.4556
            jerk, time = truth["planned_jerk"].values, truth["planned_jerk"].time
            valid = np.interp(time, estimate.time, estimate.valid.astype(float)) > 0.5
            spans = []
            for sign in (1, -1):
                for a, b in runs(sign * jerk > 0.02):
                    if valid[a] and valid[b - 1]:
                        spans.append((time[a], time[b - 1] + late, sign, abs(jerk[a:b].sum()) * DT))
            for start, stop, sign, change in spans:
                if change >= 0.5:
                    planned += 1
                    found += any(b.sign == sign and start <= b.peak <= stop for b in mine)
            answered += sum(
                any(s == b.sign and a <= b.peak <= z for a, z, s, _ in spans) for b in mine if not b.in_shift
            )
            bursts += sum(not b.in_shift for b in mine)
        assert planned > 40
        assert found / planned > 0.8
        assert answered / bursts > 0.7


class TestIntervals:
    @pytest.mark.parametrize(("rounds", "least"), [(24, 0.75), pytest.param(120, 0.86, marks=pytest.mark.slow)])
    def test_quantiles_of_correlated_noise_are_covered(self, rounds, least):
        """AR(1) with a memory of 2 s, whose quantiles are known: 95 % intervals hold them about as often."""
        from scipy.signal import lfilter
        from scipy.stats import norm

        random = np.random.default_rng(5)
        phi, n = 0.95, 6000  # at 10 Hz: ten minutes, 20 blocks of 30 s
        wanted = {p: norm.ppf(p) for p in (0.05, 0.5, 0.95)}
        held = dict.fromkeys(wanted, 0)
        narrow = 0
        for _ in range(rounds):
            x = lfilter([np.sqrt(1 - phi**2)], [1, -phi], random.standard_normal(n + 200))[200:]
            found = quantile_intervals(x, block_index(n, 0.1).astype(int), tuple(wanted))
            for p, q in wanted.items():
                held[p] += found[p].low <= q <= found[p].high
            narrow += abs(np.median(x)) <= 1.96 * 1.2533 / np.sqrt(n)  # as if samples were independent
        assert all(least <= count / rounds <= 1.0 for count in held.values()), held
        assert narrow / rounds < 0.4

    def test_interval_of_a_mean_is_student_s(self):
        """Blocks of equal weight: sums whose statistic is a mean, against Student's interval of the blocks."""
        from scipy.stats import t

        random = np.random.default_rng(2)
        blocks = 12
        x = 10 + random.standard_normal(blocks)
        found = interval(lambda s: s[:, 0] / s[:, 1], np.stack([x, np.ones(blocks)], axis=1))
        half = t.ppf(0.975, blocks - 1) * x.std(ddof=1) / np.sqrt(blocks)
        assert found.value == pytest.approx(x.mean())
        assert (found.high - found.low) / 2 == pytest.approx(half, rel=0.12)

    def test_positive_numbers_stay_positive_and_few_blocks_say_nothing(self):
        sums = np.stack([np.array([0.1, 0.0, 9.0, 0.2, 0.1, 0.0]), np.ones(6)], axis=1)
        found = interval(lambda s: s[:, 0] / s[:, 1], sums)
        assert 0 < found.low < found.value < found.high
        assert not interval(lambda s: s[:, 0] / s[:, 1], sums[:4]).known

    @pytest.mark.parametrize(("count", "exposure"), [(0, 3.0), (1, 2.0), (17, 5.5), (240, 53.0)])
    def test_poisson_interval(self, count, exposure):
        from scipy.stats import poisson

        low, high = poisson_interval(count, exposure)
        assert poisson.cdf(count, high * exposure) == pytest.approx(0.025, abs=1e-9)
        if count:
            assert poisson.sf(count - 1, low * exposure) == pytest.approx(0.025, abs=1e-9)
        else:
            assert low == 0.0

    def test_dispersion_is_that_of_a_quasi_poisson_fit(self):
        sm = pytest.importorskip("statsmodels.api")
        random = np.random.default_rng(8)
        km = random.uniform(0.1, 0.6, 60)
        counts = random.negative_binomial(2, 1 / (1 + 3 * km)).astype(float)
        fit = sm.GLM(counts, np.ones(60), family=sm.families.Poisson(), exposure=km).fit()
        assert dispersion(counts, km) == pytest.approx(fit.pearson_chi2 / fit.df_resid)
        assert dispersion(np.ones(10), np.ones(10)) == 1.0


def test_reversals_of_a_zigzag():
    """Ten full swings of 10 % turn twenty times less the first; swings of 1 % within the play never."""
    t = np.arange(0, 100, 0.1)
    assert reversals(0.5 + 0.05 * np.sin(2 * np.pi * t / 10), 0.02).size == 20
    assert reversals(0.5 + 0.005 * np.sin(2 * np.pi * t / 10), 0.02).size == 0
    gappy = np.where((t > 30) & (t < 31), np.nan, 0.5 + 0.05 * np.sin(2 * np.pi * t / 10))
    assert reversals(gappy, 0.02).size == 20
    assert reversals(np.full(50, np.nan), 0.02).size == 0


class TestCourse:
    def test_distance_of_the_speed(self, driven):
        estimate, truth, _, _ = driven["ordinary", 1]
        course = course_of(estimate)
        assert course.source == "speed"
        true = np.interp(estimate.time, truth["distance"].time, truth["distance"].values)
        assert np.abs(course.s - true).max() < 8.0  # of 4.2 km
        assert course.drift is not None

    def test_distance_of_the_log_and_their_disagreement(self, car, driven):
        _, truth, _, log = driven["ordinary", 1]
        d = truth["distance"]
        with_distance = log.with_signals(cd.Signal("distance", d.time, 1000 + 1.02 * d.values, "m"))
        course = course_of(cd.estimate_log("intent-pedals", with_distance, car))
        assert course.source == "distance"
        assert course.length == pytest.approx(1.02 * (d.values[-1] - d.values[0]), rel=1e-3)
        assert course.disagreement == pytest.approx(-0.02 / 1.02, abs=2e-3)
        # A distance that starts again at every lap is none.
        laps = log.with_signals(cd.Signal("distance", d.time, np.mod(d.values, 900.0), "m"))
        assert course_of(cd.estimate_log("intent-pedals", laps, car)).source == "speed"

    def test_projection_is_the_nearest_point(self):
        """Against brute force over a line of points 2 cm apart, along a road that bends."""
        s = np.arange(0.0, 2000.0, 5.0)
        heading = 1.2 * np.sin(s / 300)
        x, y = np.cumsum(5 * np.cos(heading)), np.cumsum(5 * np.sin(heading))
        line = Line(s, x, y, 45.0, 11.0)
        random = np.random.default_rng(1)
        at = np.sort(random.uniform(20, 1960, 150))
        px = np.interp(at, s, x) + random.normal(0, 3, at.size)
        py = np.interp(at, s, y) + random.normal(0, 3, at.size)
        fine = np.arange(0, 1995, 0.02)
        fx, fy = np.interp(fine, s, x), np.interp(fine, s, y)
        wanted = np.array([fine[np.argmin((fx - a) ** 2 + (fy - b) ** 2)] for a, b in zip(px, py, strict=True)])
        found, off = project(line, px, py)
        assert np.abs(found - wanted).max() < 0.03
        assert off.max() < 20

    def test_positions_take_out_drift_and_a_late_start(self, car, driven):
        """A drive whose log begins 300 m later and whose speed is 2 % too large finds its place by its positions."""
        first, second = (with_position(driven[style, 1]) for style in ("ordinary", "smooth"))
        reference = cd.estimate_log("intent-pedals", first, car)
        truth = driven["smooth", 1][1]["distance"]
        begin = float(np.interp(300.0, truth.values, truth.time))
        v = second["longitudinal_speed"]
        late = second.with_signals(cd.Signal(v.name, v.time, 1.02 * v.values, v.unit)).between(begin, 1e9)
        estimate = cd.estimate_log("intent-pedals", late, car)
        assert has_position(estimate)
        course = place(estimate, path_of(reference))
        true = np.interp(estimate.time, truth.time, truth.values)
        assert np.median(np.abs(course.s - true)) < 6.0
        assert np.median(np.abs(course_of(estimate).s - true)) > 100.0

    def test_another_place_is_refused(self, car, driven):
        log = with_position(driven["ordinary", 1])
        north = log["latitude"]
        away = log.with_signals(cd.Signal("latitude", north.time, north.values + 0.1, "deg"))
        line = path_of(cd.estimate_log("intent-pedals", log, car))
        with pytest.raises(UsageError, match="off the reference"):
            place(cd.estimate_log("intent-pedals", away, car), line)


def with_position(entry) -> cd.Log:
    """A log with GPS fixes at 5 Hz, 2 m of noise, on a road drawn from its distance."""
    _, truth, _, log = entry
    time = truth["distance"].time[::20]
    s = truth["distance"].values[::20]
    fine = np.arange(0.0, 4300.0)
    heading = 0.8 * np.sin(fine / 350)
    random = np.random.default_rng(int(s[-1] * 1000) % 1000)
    north = np.interp(s, fine, np.cumsum(np.cos(heading))) + random.normal(0, 2, s.size)
    east = np.interp(s, fine, np.cumsum(np.sin(heading))) + random.normal(0, 2, s.size)
    metre = np.degrees(1 / 6_371_000.0)
    return log.with_signals(
        cd.Signal("latitude", time, 46 + north * metre, "deg"),
        cd.Signal("longitude", time, 11 + east * metre / np.cos(np.radians(46)), "deg"),
    )


class TestSlopes:
    def test_measures(self):
        """Against numpy on the same numbers; an offset is no slope; the truth is one more column."""
        s = np.arange(3000.0)
        true = 3 * np.sin(s / 200)
        random = np.random.default_rng(0)
        slopes = {
            "a": true + 1 + 0.1 * random.standard_normal(s.size),
            "b": true + 0.1 * random.standard_normal(s.size),
        }
        found = slope_agreement(slopes, 1.0, true)
        (pair,) = found.pairs
        assert pair.rms == pytest.approx(np.sqrt(np.mean((slopes["a"] - slopes["b"]) ** 2)))
        assert pair.rms_centred == pytest.approx(0.1414, rel=0.1)
        assert pair.correlation == pytest.approx(np.corrcoef(slopes["a"], slopes["b"])[0, 1])
        assert [p.names for p in found.against_truth] == [("a", "truth"), ("b", "truth")]
        assert slope_agreement({"a": 0 * true, "b": true}, 1.0).pairs[0].correlation is None
        assert slope_agreement({"a": true[:100], "b": true[:100]}, 1.0).pairs == ()

    def test_drivers_of_one_road_agree(self, driven, triplet):
        """Figure 7: the slope of several drivers coincides, and is the road's."""
        comparison = compare_drivers(triplet)
        road = driven["ordinary", 1][1]
        true = 100 * np.tan(np.interp(comparison.along.places, road["distance"].values, road["road_slope"].values))
        found = slope_agreement(
            {n: x["slope"] for n, x in comparison.along.signals.items()}, comparison.along.step, true
        )
        assert len(found.pairs) == 3
        assert all(p.correlation > 0.95 for p in (*found.pairs, *found.against_truth))
        assert all(p.rms_centred < 0.6 for p in (*found.pairs, *found.against_truth))

    def test_two_roads_are_told(self, driven):
        found = compare_drivers({"here": driven["ordinary", 1][0], "there": driven["ordinary", 2][0]})
        assert any(f.severity == "warn" and "another road" in f.text for f in found.findings)


class TestStyle:
    def test_numbers_are_those_of_the_columns(self, triplet):
        estimate = triplet["ordinary"]
        style = describe_style(estimate, "o")
        jerk = estimate.columns["intentional_jerk"][estimate.valid]
        assert style.seconds == pytest.approx(estimate.valid.sum() * DT)
        assert style.jerk_rms.value == pytest.approx(np.sqrt(np.mean(jerk**2)))
        assert [style.jerk[p].value for p in (0.05, 0.99)] == pytest.approx(list(np.quantile(jerk, [0.05, 0.99])))
        inside = [b for b in find_bursts(estimate)]
        assert style.bursts.count == len(inside)
        assert style.burst_peak.value == pytest.approx(np.exp(np.mean([np.log(abs(b.jerk)) for b in inside])))
        assert sum(b.seconds for b in style.bands) == pytest.approx(style.seconds, rel=0.05)
        assert all(i.low <= i.value <= i.high for i in (style.jerk_rms, style.burst_peak, style.reversals))

    def test_two_logs_of_a_driver_are_one(self, triplet):
        a, b = describe_style(triplet["ordinary"]), describe_style(triplet["smooth"])
        both = describe_style([triplet["ordinary"], triplet["smooth"]], "both")
        assert both.seconds == pytest.approx(a.seconds + b.seconds)
        assert both.bursts.count == a.bursts.count + b.bursts.count
        squares = a.jerk_rms.value**2 * a.seconds + b.jerk_rms.value**2 * b.seconds
        assert both.jerk_rms.value == pytest.approx(np.sqrt(squares / both.seconds))

    def test_what_does_not_compare_is_refused(self, car, driven, triplet):
        log = driven["ordinary", 1][3]
        with pytest.raises(UsageError, match="ell"):
            describe_style([triplet["ordinary"], cd.estimate_log("intent-pedals", log, car, ell=3)])
        with pytest.raises(UsageError, match="intent-torque"):
            compare_drivers({"a": triplet["ordinary"], "b": cd.estimate_log("intent-torque", log, car)})
        with pytest.raises(UsageError, match="no estimate"):
            describe_style([])
        other = describe_style(cd.estimate_log("intent-pedals", log, car, ell=3))
        with pytest.raises(UsageError, match="ell"):
            rate_style(other, default_scale())
        assert compare_drivers({"a": cd.estimate_log("intent-pedals", log, car, ell=3)}).scale is None

    def test_a_stretch(self, driven, triplet):
        estimate = triplet["ordinary"]
        s = course_of(estimate).s
        style = describe_style(estimate, start=900.0, stop=1900.0)
        inside = estimate.valid & (s >= 900) & (s < 1900)
        assert style.seconds == pytest.approx(inside.sum() * DT)
        assert style.kilometres == pytest.approx(1.0, abs=0.02)
        with pytest.raises(LogError, match="stretch"):
            describe_style(estimate, start=9000.0)
        with pytest.raises(UsageError, match="stretch"):
            compare_drivers({"a": estimate}, start=5.0, stop=1.0)

    def test_no_distance_and_no_speed(self, car, driven):
        """Pedals alone: jerk is described, nothing is claimed per kilometre, no class."""
        log = driven["ordinary", 1][3].without("longitudinal_speed", "longitudinal_acceleration")
        found = compare_drivers({"a": cd.estimate_log("pedals-only", log, car)})
        assert found.along is None
        assert found.styles[0].bursts.per_km is None
        assert found.styles[0].jerk_rms.value > 0
        assert any("no curvilinear" in f.text for f in found.findings)
        with pytest.raises(MissingSignal):
            compare_drivers({"a": cd.estimate_log("pedals-only", log, car)}, start=0.0, stop=100.0)

    def test_standing_most_of_the_time(self):
        valid = np.zeros(60_000, bool)
        valid[50_000:53_000] = True
        style = describe_style(made(bump(60_000, 51_000, 100, 1.0), valid=valid))
        assert style.seconds == pytest.approx(30.0)
        rating = rate_style(style, default_scale())
        assert rating.kind == "cannot tell"
        assert any("valid driving" in why for why in rating.why)
        with pytest.raises(LogError, match="valid"):
            describe_style(made(np.zeros(1000), valid=np.zeros(1000, bool)))


class TestScale:
    def test_score_is_weighted_least_squares(self, triplet):
        """Against statsmodels: features less their means, regressed on the steps."""
        sm = pytest.importorskip("statsmodels.api")
        scale, style = default_scale(), describe_style(triplet["ordinary"])
        total = style.sums.sum(axis=0, keepdims=True)
        x, t = features_of(total)
        weight = (np.minimum(1, t[0] / scale.seconds)[:, None] / scale.scatter**2).ravel()
        there = np.isfinite(x[0].ravel())
        fit = sm.WLS((x[0] - scale.mean).ravel()[there], scale.step.ravel()[there], weights=weight[there]).fit(
            cov_type="fixed scale"
        )
        score, sd = scores(scale, total)
        assert score[0] == pytest.approx(fit.params[0])
        assert sd[0] == pytest.approx(fit.bse[0])

    def test_order_of_drivers(self, triplet):
        found = compare_drivers(triplet)
        assert [r.name for r in found.ranking] == ["aggressive", "ordinary", "smooth"]
        assert all(r.low <= r.rank <= r.high for r in found.ranking)
        assert all(sum(r.probability.values()) == pytest.approx(1.0) for r in found.ratings)
        assert found.ratings[0].kind == "aggressive"

    def test_file_round_trip(self, tmp_path):
        scale = default_scale()
        save_scale(scale, tmp_path / "own.toml")
        again = load_scale(tmp_path / "own.toml")
        assert np.array_equal(again.mean, scale.mean)
        assert replace(again, mean=scale.mean, step=scale.step, scatter=scale.scatter, seconds=scale.seconds).name
        assert scale_text(again) == scale_text(scale)
        with pytest.raises(UsageError, match="there already"):
            save_scale(scale, tmp_path / "own.toml")
        with pytest.raises(UsageError, match="toml"):
            save_scale(scale, tmp_path / "own.txt")

    @pytest.mark.parametrize(
        ("old", "new", "said"),
        [
            ("[settings]", "[setings]", "setings"),
            ("drivers = 96", "drivers = true", "drivers"),
            ("scatter = ", "scatter = -", "scatter"),
            ("thresholds = [-0", "thresholds = [5, -0", "thresholds"),
            ('observer = "intent-pedals"', "", "observer"),
            ("[urban]", "[urban", "TOML"),
        ],
    )
    def test_wrong_files_are_named(self, old, new, said):
        text = scale_text(default_scale())
        assert old in text
        with pytest.raises(UsageError, match=said):
            parse_scale(text.replace(old, new, 1), "x.toml")

    def test_own_fleet_has_terciles(self, triplet):
        """Without classes a third of the reference is below, a third above the thresholds; scores have mean 0."""
        styles = [describe_style(triplet[s], f"{s} {k}", start=a, stop=a + 2000.0)
                  for s in triplet for k, a in enumerate((0.0, 1000.0, 2000.0))]  # fmt: skip
        scale = make_scale(styles, "own", "test")
        score = np.array([scores(scale, s.sums.sum(axis=0, keepdims=True))[0][0] for s in styles])
        assert (score < scale.thresholds[0]).sum() == 3
        assert (score > scale.thresholds[1]).sum() == 3
        with pytest.raises(UsageError, match="6 at least"):
            make_scale(styles[:4], "own", "test")
        with pytest.raises(UsageError, match="classes"):
            make_scale(styles, "own", "test", kinds=["smooth"] * 9)


def write_log(path: Path, log: cd.Log) -> Path:
    grid = log.sample(list(log), 0.02)
    write_table(path, grid.time, [Column(name, values, log[name].unit) for name, values in grid.values.items()])
    return path


@pytest.fixture(scope="module")
def files(driven, tmp_path_factory):
    folder = tmp_path_factory.mktemp("styles")
    return {s: write_log(folder / f"{s}.parquet", driven[s, 1][3]) for s in ("aggressive", "smooth")}


@pytest.fixture
def run(monkeypatch, capsys):
    """Runs `codriver style` in this process; what it printed, or its error where another exit code is expected."""
    from codriver.cli import main

    def call(*words: object, code: int = 0) -> str:
        monkeypatch.setattr(sys, "argv", ["codriver", "style", *map(str, words)])
        with pytest.raises(SystemExit) as end:
            main()
        said = capsys.readouterr()
        assert end.value.code == code, said.out + said.err
        return said.err if code == 2 or not said.out else said.out

    return call


class TestCommand:
    def test_all_of_it(self, run, files, tmp_path):
        table, report = tmp_path / "t.csv", tmp_path / "r.html"
        said = json.loads(run(
            files["aggressive"], "--driver", f"anna={files['smooth']}", "--vehicle", "bisoffi2017", "-o", table,
            "--report", report, "--box", "900:1900:country road", "--json",
        ))  # fmt: skip
        rows = {row["driver"]: row for row in said["drivers"]}
        assert list(rows) == ["aggressive", "anna"]
        assert rows["aggressive"]["score"] > rows["anna"]["score"]
        assert rows["aggressive"]["rank"] == 1
        assert rows["anna"]["bursts_per_km_low"] < rows["anna"]["bursts_per_km"] < rows["anna"]["bursts_per_km_high"]
        lines = table.read_text(encoding="utf-8").splitlines()
        assert len(lines) == 3
        html = report.read_text(encoding="utf-8")
        assert "anna" in html
        charts = gzip.decompress(
            base64.b64decode(re.search(r'id="charts">(.*?)</script>', html, re.S).group(1))
        ).decode()
        assert "country road" in charts
        assert all(label in charts for label in ("v, km/h", "p_r, %", "p_b, bar", "slope, %"))

    def test_one_log_as_text_and_a_stretch(self, run, files):
        said = run(files["smooth"], "--vehicle", "bisoffi2017", "--from", 200, "--to", 3000)
        assert "smooth" in said
        assert "2.8" in said

    @pytest.mark.parametrize(
        ("words", "said"),
        [
            ((), "no log was given"),
            (("missing.blf",), "does not exist"),
            (("--driver", "anna"), "NAME=LOG"),
            (("LOG", "--box", "5:1:x", "--report", "r.html"), "FROM below TO"),
            (("LOG", "--box", "1:2", "--report", "r.html"), "FROM:TO:LABEL"),
            (("LOG", "--box", "1:2"), "FROM:TO:LABEL"),
            (("LOG", "--box", "1:2:ramp"), "--box without --report"),
            (("LOG", "-o", "t.mf4"), "styles"),
            (("LOG", "-o", "LOG"), "is an input"),
            (("LOG", "--report", "r.txt"), ".html"),
            (("LOG", "--align", "stars"), "--align"),
            (("LOG", "--reference", "LOG", "--vehicle", "bisoffi2017"), "scale file"),
            (("LOG", "--from", "900", "--to", "100", "--vehicle", "bisoffi2017"), "stretch"),
        ],
    )
    def test_misuse(self, run, words, said, files):
        words = [str(files["smooth"]) if word == "LOG" else word for word in words]
        before = files["smooth"].read_bytes()
        assert said in run(*words, code=2)
        assert files["smooth"].read_bytes() == before

    def test_a_log_that_cannot_feed(self, run, files):
        assert "give --vehicle" in run(files["smooth"], code=1)

    def test_own_reference(self, run, driven, files, tmp_path, monkeypatch):
        """Six logs make a scale; it rates another; too few are refused and leave nothing; what is there is kept."""
        logs = []
        for k, (entry, start) in enumerate((e, s) for e in driven.values() for s in (20.0, 80.0)):
            if k < 7:
                logs.append(write_log(tmp_path / f"d{k}.parquet", entry[3].between(start, start + 60)))
        scale, table, car = tmp_path / "fleet.toml", tmp_path / "t.csv", ("--vehicle", "bisoffi2017")
        run(*logs[:6], *car, "--write-reference", scale)
        said = json.loads(run(files["smooth"], *car, "--reference", scale, "--json"))
        assert said["scale"] == "fleet"
        assert said["drivers"][0]["score"] is not None
        before = scale.read_bytes()
        assert "is there already" in run(*logs[:6], *car, "--write-reference", scale, code=2)
        other = tmp_path / "other.toml"
        other.write_text("kept = 1\n", encoding="utf-8")
        assert "scale file" in run(*logs[:6], *car, "--write-reference", other, "--overwrite", code=2)
        assert "6 at least" in run(*logs[:2], *car, "--write-reference", tmp_path / "n.toml", "-o", table, code=2)
        assert not table.exists()
        # The scale is the last to be written: where that fails, the table is not there either, and the old scale is.
        with monkeypatch.context() as patch:
            patch.setattr("codriver.drivers.scale_file.scale_text", lambda scale: 1 / 0)
            run(*logs[:6], *car, "--write-reference", scale, "--overwrite", "-o", table, code=1)
        assert scale.read_bytes() == before
        assert not table.exists()
        run(*logs[1:7], *car, "--write-reference", scale, "--overwrite", "-o", table)
        assert scale.read_bytes() != before
        assert sorted(p.name for p in tmp_path.iterdir() if p.suffix != ".parquet") == [
            "fleet.toml",
            "other.toml",
            "t.csv",
        ]


# What a new user gets wrong, and a word of the finding.
WRONG = {
    "sign": ("longitudinal_acceleration", lambda x: -x, "sign is wrong"),
    "g": ("longitudinal_acceleration", lambda x: x / 9.81, "looks like g read as"),
    "per cent": ("accelerator_pedal", lambda x: 100 * x, "accelerator_pedal: .*outside"),
    "km/h": ("longitudinal_speed", lambda x: 3.6 * x, "km/h read as m/s"),
    "torque": ("engine_torque", lambda x: 2 * x, "M is too small, tau too large, or the torque"),
    "gear": ("gear", lambda x: np.where(x > 0, x + 1, x), "gear numbers .* are shifted"),
}


class TestDataThatContradict:
    def wrong(self, log: cd.Log, what: str) -> cd.Log:
        name, change, _ = WRONG[what]
        signal = log[name]
        return log.with_signals(cd.Signal(name, signal.time, change(signal.values), signal.unit))

    @pytest.mark.parametrize("what", WRONG)
    def test_no_class_and_no_score(self, what, driven, run, tmp_path):
        """Beside a sound driver: exit code 0. Alone: 1. Never a class, and the finding is said."""
        log = driven["ordinary", 1][3].between(20.0, 260.0)
        bad = write_log(tmp_path / "bad.parquet", self.wrong(log, what))
        table, report = tmp_path / "t.csv", tmp_path / "r.html"
        words = (bad, "--vehicle", "bisoffi2017", "-o", table, "--report", report)
        said = json.loads(run(*words, "--json", code=1))
        (row,) = said["drivers"]
        assert (row["class"], row["score"], row["rank"]) == ("cannot tell", None, None)
        assert "the data contradict" in row["why"]
        worst = [f["text"] for f in said["findings"] if f["severity"] == "bad"]
        assert re.search(WRONG[what][2], " ".join(worst)), worst
        assert worst[0].startswith("bad: ")
        assert worst[0][5:] in row["findings"]
        assert "cannot tell" in table.read_text(encoding="utf-8")
        assert "the data contradict" in report.read_text(encoding="utf-8")

    def test_beside_a_sound_driver(self, driven, files, run, tmp_path):
        """The sound one is rated as if alone; a scale of the two is refused."""
        bad = write_log(tmp_path / "bad.parquet", self.wrong(driven["ordinary", 1][3], "sign"))
        car = ("--vehicle", "bisoffi2017")
        alone = json.loads(run(files["smooth"], *car, "--json"))["drivers"][0]
        both = json.loads(run(bad, files["smooth"], *car, "--json"))["drivers"]
        assert both[0]["class"] == "cannot tell"
        assert (both[1]["class"], both[1]["score"], both[1]["rank"]) == (alone["class"], alone["score"], 1)
        assert "no scale of these drivers: bad" in run(
            bad, files["smooth"], *car, "--write-reference", tmp_path / "s.toml", code=1
        )
        assert not (tmp_path / "s.toml").exists()

    def test_it_is_said_without_the_command(self, car, driven):
        log = self.wrong(driven["ordinary", 1][3], "sign")
        found = compare_drivers({"a": cd.estimate_log("intent-pedals", log, car)})
        assert found.judged == ()
        assert found.ratings[0].kind == "cannot tell"
        assert found.ranking == ()
        assert found.told[0].severity == "bad"
        assert "sign is wrong" in found.told[0].text

    @pytest.mark.parametrize(("p", "said"), [(0.6, "60 %"), (0.99, "99 %"), (0.996, "> 99 %"), (1.0, "> 99 %")])
    def test_never_100_per_cent(self, p, said):
        assert sure(p) == said

    def test_no_class_is_said_to_be_certain(self, files, run):
        assert "aggressive > 99 %" in run(files["aggressive"], "--vehicle", "bisoffi2017")


def test_table_as_parquet_holds_what_the_comparison_says(triplet, tmp_path):
    import pyarrow.parquet as pq

    found = compare_drivers(triplet)
    rows = pq.read_table(save_styles(found, tmp_path / "t.parquet")).to_pylist()
    assert [row["driver"] for row in rows] == list(triplet)
    for row, style, rating in zip(rows, found.styles, found.ratings, strict=True):
        assert row["score"] == rating.score
        assert row["class"] == rating.kind
        assert row["jerk_q95_m/s3"] == style.jerk[0.95].value


@pytest.mark.slow
def test_classes_on_the_road_test(car):
    """42 minutes that no threshold has seen: the paper's aggressive and smooth drivers are never taken for one another."""
    from codriver.simulate.road_test import road_test

    wanted = {"aggressive": "aggressive", "smooth": "smooth", "ordinary": "intermediate"}
    estimates = {name: cd.estimate_log("intent-pedals", road_test(name, 15).log, car) for name in wanted}
    found = compare_drivers(estimates)
    assert [r.name for r in found.ranking] == ["aggressive", "ordinary", "smooth"]
    kinds = {s.name: r.kind for s, r in zip(found.styles, found.ratings, strict=True)}
    assert kinds["aggressive"] == "aggressive"
    assert kinds["smooth"] == "smooth"
    assert all(p.correlation > 0.9 for p in found.agreement.pairs)
