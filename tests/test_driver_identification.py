"""Drivers' parameters from drives: known drivers found again, intervals that cover, refusals by name."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import codriver as cd
from codriver.errors import LogError, MissingSignal, UsageError
from codriver.identify.driver_dual_ekf import DualTuning, _advance, dual_ekf
from codriver.identify.driver_fit import ASKED, identify_driver
from codriver.identify.driver_record import driver_record
from codriver.identify.driver_residual import whitened, whitening
from codriver.identify.driver_result import DriverFit
from codriver.identify.driver_road import by_the_road
from codriver.identify.driver_signs import sign_findings
from codriver.identify.driver_verdict import driver_findings
from codriver.models.two_point import TwoPointDriver
from codriver.simulate.circuit import CircuitDrive, CircuitSetting, simulate_circuit
from codriver.simulate.circuit_drivers import CIRCUIT_DRIVERS
from codriver.simulate.rig import RigCar
from codriver.simulate.steering import Wheel
from codriver.simulate.variability import Variability

# Noise of eyes and muscles, and gains that drift by 7 %.
VARIED = Variability(drift=0.07, near=0.002, far=0.001, motor=0.05)


def start(driver: TwoPointDriver) -> TwoPointDriver:
    return TwoPointDriver(near=driver.near, far=driver.far)


def without(log: cd.Log, *names: str) -> cd.Log:
    return cd.Log.of([log[n] for n in log if n not in names], source=log.source)


CARLA = {"same": CircuitSetting(CIRCUIT_DRIVERS["carla"], laps=2)}
CARLA["varies"] = replace(CARLA["same"], variability=VARIED)


@cache
def driven_by(who: str) -> CircuitDrive:
    """Two laps each way of carla, always the same or varying."""
    return simulate_circuit(CARLA[who], seed=1)


@cache
def fitted(who: str, by: str) -> DriverFit:
    """All of carla, from such a drive."""
    return identify_driver(driven_by(who).log(), start(CIRCUIT_DRIVERS["carla"]), by=by)


@pytest.fixture(scope="module")
def clean() -> cd.Log:
    return driven_by("same").log()


@pytest.fixture(scope="module")
def varied() -> cd.Log:
    return driven_by("varies").log()


class TestClean:
    @pytest.mark.parametrize("by", ["road", "direct"])
    def test_found_again(self, by):
        truth, fit = CIRCUIT_DRIVERS["carla"], fitted("same", by)
        assert set(fit.parameters) == set(ASKED)
        assert fit.settled
        assert not fit.refused
        for name, within in (
            ("anticipation", 0.01),
            ("compensation", 0.05),
            ("reflex", 0.03),
            ("delay", 0.08),
            ("muscle", 0.1),
        ):
            assert fit.parameters[name].value == pytest.approx(getattr(truth, name), rel=within)
        assert fit.explained > 0.999
        assert fit.rms == pytest.approx(0.02, rel=0.1)  # of the torque sensor
        assert fit.driver().anticipation == fit.parameters["anticipation"].value
        assert np.std(fit.records[0].torque - fit.torque()) < 0.05

    @pytest.mark.slow
    @pytest.mark.parametrize("name", CIRCUIT_DRIVERS)
    def test_every_driver(self, name):
        truth = CIRCUIT_DRIVERS[name]
        fit = identify_driver(simulate_circuit(CircuitSetting(truth, laps=2), seed=3).log(), start(truth))
        for p in fit.parameters.values():
            assert abs(p.value - getattr(truth, p.name)) < 4 * p.sd
        assert fit.parameters["anticipation"].value == pytest.approx(truth.anticipation, rel=0.01)
        assert fit.parameters["compensation"].value == pytest.approx(truth.compensation, rel=0.08)

    def test_offset_from_the_car_alone(self, clean):
        # Offset and heading error summed from yaw rate and sideslip, behind a high-pass.
        truth = CIRCUIT_DRIVERS["carla"]
        fit = identify_driver(without(clean, "lateral_offset", "heading_error"), start(truth), by="direct")
        assert fit.records[0].summed
        for name, within in (("anticipation", 0.01), ("compensation", 0.05), ("reflex", 0.03)):
            assert fit.parameters[name].value == pytest.approx(getattr(truth, name), rel=within)

    def test_bias_of_the_torque(self, clean):
        torque = clean["driver_torque"]
        shifted = cd.Log.of(
            [
                *without(clean, "driver_torque").values(),
                cd.Signal("driver_torque", torque.time, torque.values + 0.5, "N*m"),
            ]
        )
        plain, biased = fitted("same", "road").best, identify_driver(shifted, start(CIRCUIT_DRIVERS["carla"])).best
        assert biased.anticipation == pytest.approx(plain.anticipation, rel=1e-4)


class TestVaried:
    def test_covers(self):
        truth, fit = CIRCUIT_DRIVERS["carla"], fitted("varies", "road")
        assert "anticipation" in fit.parameters
        for p in fit.parameters.values():
            assert abs(np.log(p.value / getattr(truth, p.name))) < 3 * p.sd / p.value
            assert p.low < p.value < p.high

    @pytest.mark.slow
    def test_coverage(self):
        # Three seeds: 95 % intervals by the road hold the truth nearly always, those of prediction errors do not.
        off = {"road": [], "direct": []}
        truth = CIRCUIT_DRIVERS["anna"]
        for seed in (11, 12, 13):
            log = simulate_circuit(CircuitSetting(truth, VARIED, laps=2), seed=seed).log()
            for by, z in off.items():
                fit = identify_driver(log, start(truth), by=by)
                z += [np.log(p.value / getattr(truth, p.name)) / (p.sd / p.value) for p in fit.parameters.values()]
        covered = {by: float(np.mean(np.abs(z) < 1.96)) for by, z in off.items()}
        assert len(off["road"]) >= 9
        assert covered["road"] > 0.9
        assert covered["direct"] < covered["road"]

    def test_vague_parameters_are_named(self, varied):
        short = cd.Log.of(
            [cd.Signal(s.name, s.time[:9000], s.values[:9000], s.unit) for s in varied.values()], source="short"
        )
        fit = identify_driver(short, start(CIRCUIT_DRIVERS["carla"]))
        named = {r.name for r in fit.refused}
        assert "muscle" in named
        assert not named & set(fit.parameters)
        with pytest.raises(LogError, match="muscle: this drive hardly tells it"):
            fit.driver()


class TestRefusals:
    def test_what_one_speed_does_not_tell(self, clean):
        fit = identify_driver(clean, asked=("anticipation", "compensation", "delay", "reflex", "column_gain"))
        named = {r.name: r.reason for r in fit.refused}
        assert {"column_gain", "anticipation", "compensation"} <= set(named)
        assert "column_gain" in named["anticipation"]
        assert "at one speed" in named["column_gain"]
        assert "delay" in fit.parameters

    def test_given_and_asked(self, clean):
        fit = identify_driver(clean, start(CIRCUIT_DRIVERS["carla"]), asked=("anticipation",))
        assert set(fit.parameters) == {"anticipation"}
        assert fit.given["reflex"] == 6.0
        row = fit.table()[0]
        assert row[:3] == ("anticipation", "K_p", "1")
        assert row[5] < row[3] < row[6]

    def test_all_held(self, clean):
        with pytest.raises(UsageError, match="every parameter is held"):
            identify_driver(clean, held=ASKED)

    def test_errors(self, clean):
        for change in (
            {"asked": ()},
            {"asked": ("delay", "delay")},
            {"asked": ("near",), "by": "dual-ekf"},
            {"also": ("far",), "by": "dual-ekf"},
            {"asked": ("nearest",)},
            {"by": "magic"},
            {"spread": 0.0},
        ):
            with pytest.raises(UsageError):
                identify_driver(clean, **change)
        for drives, by in (([], "road"), ([clean, clean], "dual-ekf")):
            with pytest.raises(UsageError, match=f"{len(drives)} drives"):
                identify_driver(drives, by=by)
        with pytest.raises(MissingSignal, match="road_curvature"):
            identify_driver(without(clean, "road_curvature"))
        with pytest.raises(MissingSignal, match="yaw_rate"):
            identify_driver(without(clean, "lateral_offset", "yaw_rate"))
        brief = cd.Log.of(
            [cd.Signal(s.name, s.time[:3000], s.values[:3000], s.unit) for s in clean.values()], source="brief"
        )
        with pytest.raises(LogError, match="30 s of all signals"):
            identify_driver(brief)

    def test_speed_that_varies(self, clean):
        v = clean["longitudinal_speed"]
        wavy = cd.Signal(v.name, v.time, v.values * (1 + 0.2 * np.sin(0.1 * v.time)), v.unit)
        with pytest.raises(LogError, match="of spread"):
            identify_driver(cd.Log.of([*without(clean, v.name).values(), wavy]))

    def test_straight_road(self):
        t = np.arange(0, 120, 0.01)
        rng = np.random.default_rng(0)
        flat = {
            "longitudinal_speed": 14.0 + 0 * t,
            "road_curvature": 0 * t,
            "driver_torque": rng.standard_normal(t.size),
        }
        rest = ("steering_wheel_angle", "lateral_offset", "heading_error")
        log = cd.Log.of(
            [*(cd.Signal(n, t, x, "") for n, x in flat.items()), *(cd.Signal(n, t, 0 * t, "") for n in rest)]
        )
        with pytest.raises(LogError, match="a drive with curves"):
            identify_driver(log)


class TestWhereHeLooks:
    @pytest.mark.slow
    def test_found_by_the_road(self):
        # Given wrong, the far point makes a driver who fits and is wrong; sought, it is found, and intervals hold.
        truth = CIRCUIT_DRIVERS["carla"]
        log = simulate_circuit(CircuitSetting(truth, laps=1), seed=1).log()
        known = TwoPointDriver(far=1.43)
        given, sought = (identify_driver(log, known, also=also) for also in ((), ("near", "far")))
        assert given.explained > 0.999
        assert abs(np.log(given.best.delay / truth.delay)) > 0.5
        assert sought.parameters["far"].value == pytest.approx(truth.far, rel=0.06)
        assert sought.one_step < given.one_step
        for p in sought.parameters.values():
            assert abs(np.log(p.value / getattr(truth, p.name))) < 3 * p.sd / p.value
        assert "near" not in sought.given
        assert np.std(sought.records[0].torque - sought.torque()) < 0.05
        assert sought.filed("x").driver() == sought.driver()


class TestSeveral:
    @pytest.mark.slow
    def test_two_speeds_tell_what_one_does_not(self):
        truth = replace(CIRCUIT_DRIVERS["carla"], column_gain=0.2)
        car = RigCar()
        slow, quick = (
            simulate_circuit(
                CircuitSetting(truth, laps=1, direction=way, car=replace(car, speed=v / 3.6)), seed=1
            ).log()
            for v, way in ((35, "left"), (50, "right"))
        )
        fit = identify_driver([slow, quick], start(truth))
        assert fit.names == (*ASKED, "column_gain")
        assert fit.speeds == pytest.approx((35 / 3.6, 50 / 3.6))
        for name, within in (("column_gain", 0.1), ("anticipation", 0.05), ("reflex", 0.05)):
            assert fit.parameters[name].value == pytest.approx(getattr(truth, name), rel=within)
            assert fit.parameters[name].sd < within * fit.parameters[name].value
        # The drives of one speed, together, do not.
        alone = identify_driver(
            [quick, quick], start(truth), asked=("anticipation", "column_gain", "compensation", "reflex")
        )
        assert {r.name for r in alone.refused} == {"anticipation", "column_gain", "compensation", "reflex"} - {"reflex"}
        assert "these drives are at one" in alone.refused[0].reason

    def test_twice_the_drive_is_half_the_variance(self, varied):
        # A drive given twice: same values where the drive outweighs what was known, and errors smaller by up to sqrt(2).
        known = start(CIRCUIT_DRIVERS["carla"])
        once, twice = (identify_driver(d, known, asked=("anticipation",)) for d in (varied, [varied, varied]))
        a, b = once.parameters["anticipation"], twice.parameters["anticipation"]
        assert b.value == pytest.approx(a.value, rel=0.02)
        assert b.sd == pytest.approx(a.sd / np.sqrt(2), rel=0.1)
        assert twice.seconds == pytest.approx(2 * once.seconds)

    def test_torque_with_gaps(self, clean):
        # An estimate's torque is no number where it is not valid.
        torque = clean["driver_torque"]
        holed = torque.values.copy()
        holed[:300] = np.nan
        holed[20_000:20_030] = np.nan
        log = clean.with_signals(cd.Signal("driver_torque", torque.time, holed, "N*m", "estimate: driver-torque-pi"))
        truth = CIRCUIT_DRIVERS["carla"]
        fit = identify_driver(log, truth, asked=("anticipation", "reflex"))
        assert fit.parameters["anticipation"].value == pytest.approx(truth.anticipation, rel=0.02)
        assert fit.estimated == ("estimate: driver-torque-pi",)
        assert any("estimate's lag" in f.text for f in driver_findings(fit))
        assert not fit.drives[0].holes


class TestVerdict:
    def test_who_varies(self):
        said = {
            (who, by): " ".join(f.text for f in driver_findings(fitted(who, by)))
            for who in ("same", "varies")
            for by in ("road", "direct")
        }
        assert "always the same" in said["same", "road"]
        assert "always the same" in said["same", "direct"]
        assert "what the road makes" in said["varies", "road"]
        assert "biases prediction errors" in said["varies", "direct"]

    def test_dual_filter_is_warned_of(self):
        fit = fitted("varies", "dual-ekf")
        assert fit.path is not None
        assert fit.path.values[-1] == pytest.approx([getattr(fit.best, n) for n in fit.names])
        said = [f for f in driver_findings(fit) if f.severity == "warn"]
        assert any("filter's own" in f.text for f in said)
        # It fits well, is sure, and is wrong.
        truth = CIRCUIT_DRIVERS["carla"]
        sure = [abs(np.log(p.value / getattr(truth, p.name))) / (p.sd / p.value) for p in fit.parameters.values()]
        assert fit.explained > 0.95
        assert max(sure) > 3


class TestSigns:
    """What a fit explains away, or ends with none: signals that do not go together."""

    @pytest.mark.parametrize(
        ("name", "factor", "said"),
        [
            ("steering_wheel_angle", -1.0, "against the road's bends"),
            ("steering_wheel_angle", np.pi / 180, "units of steering_wheel_angle"),
            ("road_curvature", -1.0, "against the road's bends"),
            ("driver_torque", -1.0, "against the wheel's angle"),
            ("driver_torque", 1000.0, "no driver pulls"),
            ("lateral_offset", -1.0, "against the heading error"),
            ("heading_error", 180 / np.pi, "units of heading_error"),
            ("longitudinal_speed", 1 / 3.6, "longitudinal_speed"),
        ],
    )
    def test_wrong(self, clean, name, factor, said):
        wrong = replace(clean[name], values=clean[name].values * factor)
        log = cd.Log.of([wrong if n == name else clean[n] for n in clean], source="wrong")
        found = sign_findings(driver_record(log, 6.0, 1.3))
        assert any(f.severity == "bad" and said in f.text for f in found)

    @pytest.mark.parametrize("kmh", [15.0, 30.0, 60.0])
    @pytest.mark.parametrize("anticipation", ["far-point", "mpc"])
    def test_right(self, kmh, anticipation):
        car = replace(RigCar(), speed=kmh / 3.6)
        setting = CircuitSetting(
            CIRCUIT_DRIVERS["emma"], Variability(), anticipation, laps=1, direction="right", car=car
        )
        log = simulate_circuit(setting, seed=2).log()
        for used in (log, without(log, "lateral_offset", "heading_error")):
            assert not sign_findings(driver_record(used, 6.0, 1.3))

    def test_a_fit_to_nothing_is_bad(self, clean):
        wrong = replace(clean["road_curvature"], values=-clean["road_curvature"].values)
        log = cd.Log.of([wrong if n == "road_curvature" else clean[n] for n in clean], source="wrong")
        fit = identify_driver(log, held=("compensation", "lead", "lag", "delay", "muscle"))
        assert any(f.severity == "bad" and "than a constant" in f.text for f in driver_findings(fit))

    def test_nothing_left_of_the_drive(self, clean):
        with pytest.raises(LogError, match="whose road ahead"):
            driver_record(clean, 1e5, 1.3)


class TestParts:
    def test_what_he_saw(self, clean):
        drive = driven_by("same")
        record = driver_record(clean, drive.setting.driver.near, drive.setting.driver.far)
        rows = slice(record.first, record.last)
        assert np.abs(record.near[rows] - drive.near[rows]).max() < 1e-6
        assert np.abs(record.far[rows] - drive.far[rows]).max() < 1e-6

    @pytest.mark.parametrize("alone", [False, True])
    def test_other_points(self, clean, alone):
        log = without(clean, "lateral_offset", "heading_error") if alone else clean
        one, other = (driver_record(log, near, far) for near, far in ((6.0, 1.3), (5.0, 1.1)))
        assert one.summed is alone
        near, far = one.seen(5.0, 1.1)
        assert np.abs(near - other.near).max() < 1e-9
        assert np.abs(far - other.far).max() < 1e-9
        assert one.seen(6.0, 1.3)[0] is one.near

    def test_whitening(self):
        rng = np.random.default_rng(0)
        from scipy.signal import lfilter

        v = lfilter([1.0], [1.0, -1.5, 0.7], rng.standard_normal(50_000))
        a = whitening([v])
        assert np.allclose(a[:4], [1, -1.5, 0.7, 0], atol=0.02)
        e = whitened(a, [v])
        assert e.std() == pytest.approx(1, rel=0.02)
        assert abs(np.corrcoef(e[1:], e[:-1])[0, 1]) < 0.02

    def test_the_road_knows_no_noise(self):
        # What the road makes of what he saw is not correlated with his noise; the rest is. (Linear: no friction.)
        drive = simulate_circuit(
            CircuitSetting(CIRCUIT_DRIVERS["carla"], Variability(drift=0), wheel=Wheel(0.03, 0.35, 0.0), laps=1), seed=1
        )
        still = simulate_circuit(replace(drive.setting, variability=None), seed=1)
        record = driver_record(drive.log(), drive.setting.driver.near, drive.setting.driver.far)
        made, rows = by_the_road(record), slice(record.first, record.last)
        own = drive.near[rows] - still.near[rows]
        assert np.corrcoef(record.near[rows] - made.near[rows], own)[0, 1] > 0.8
        assert abs(np.corrcoef(made.near[rows], own)[0, 1]) < 0.1
        assert np.corrcoef(made.near[rows], still.near[rows])[0, 1] > 0.98


class TestDualFilter:
    def test_model(self, clean):
        # The filter's model over a drive, against the driver's torque with an exact delay.
        import casadi as ca

        truth = CIRCUIT_DRIVERS["carla"]
        record = driver_record(clean, truth.near, truth.far)
        x, u = ca.SX.sym("x", 4), ca.SX.sym("u", 3)
        after = _advance(truth, (), x, ca.SX(0, 1), u, record.speed, record.dt)
        run = ca.Function("f", [x, u], [after, after[3]]).mapaccum("run", record.torque.size, 1, {"base": 16})
        torque = np.array(run(np.zeros(4), np.stack([record.near, record.far, record.angle]))[1]).ravel()
        exact = truth.torque(record.near, record.far, record.angle, record.speed, record.dt)
        assert np.std(torque - exact) < 0.05 * np.std(exact)

    def test_recurrence(self, clean):
        # Remark 4 holds without the recurrence only.
        truth = CIRCUIT_DRIVERS["carla"]
        record = driver_record(clean, truth.near, truth.far)
        names = ("anticipation", "compensation", "delay")
        known = replace(truth, anticipation=4.6, compensation=9.0, delay=0.12)
        ends = {r: dual_ekf(record, known, names, DualTuning(doubt=2.0), recurrent=r).last() for r in (True, False)}
        assert ends[True]["anticipation"][0] == pytest.approx(truth.anticipation, rel=0.02)
        assert ends[True]["compensation"][0] == pytest.approx(truth.compensation, rel=0.15)
        off = {r: abs(np.log(end["anticipation"][0] / truth.anticipation)) for r, end in ends.items()}
        assert off[False] > 5 * off[True]

    def test_without_evidence(self, clean):
        record = driver_record(clean, 6.0, 1.3)
        fit = dual_ekf(record, TwoPointDriver(), ("delay",), DualTuning(doubt=1e6, wander=0.0))
        assert fit.last()["delay"] == pytest.approx((0.12, 0.12 * 0.3), rel=1e-3)
        assert fit.values.shape == (fit.time.size, 1)


class TestMultiBody:
    @pytest.mark.slow
    def test_driver_of_another_car(self):
        # The fit knows no car: what the driver saw and did in a multi-body car tells him as well.
        pytest.importorskip("vehiclemodels")
        from multi_body import drive_multi_body

        truth = CIRCUIT_DRIVERS["ben"]
        log = drive_multi_body(truth, 36 / 3.6, 1, "left")
        fit = identify_driver(log, start(truth), by="direct")
        for name, within in (("anticipation", 0.02), ("compensation", 0.05), ("reflex", 0.05), ("delay", 0.05)):
            assert fit.parameters[name].value == pytest.approx(getattr(truth, name), rel=within)
