"""The report: one file that needs nothing else, says what there is to say, and draws its plots."""

import base64
import gzip
import json
import re
import shutil
import subprocess

import numpy as np
import pytest

import codriver
from codriver.errors import UsageError
from codriver.estimate import Estimate
from codriver.observers import Output, Preset
from codriver.report import write_report
from codriver.report.numbers import errors, expected_lag
from codriver.report.pack import MOST, Pack, thin_out
from codriver.report.shown import number, shown
from codriver.report.stretches import gaps, not_valid
from codriver.signals import Grid, Log, Signal
from toy_wheel import OUTPUTS, toy_wheel, wheel_log

ESTIMATORS = ("intent-pedals", "intent-torque", "kinematic", "pedals-only")


def made_log(duration: float = 60.0, seed: int = 1) -> Log:
    """A drive in third gear on a level road: speed waves, pedals that make it, a wandering gear."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, duration, 0.01)
    a = 1.2 * np.sin(0.4 * time)
    v = 15.0 + 3.0 * (1 - np.cos(0.4 * time))
    gas, brake = np.clip(a, 0, None) * 1550 / 14 / 325, np.clip(-a, 0, None) * 1550 / 189e-5
    torque = 325 * gas
    gear = 3.0 + (time % 20 > 14)

    def signal(name: str, values: np.ndarray, unit: str, noise: float = 0.0) -> Signal:
        return Signal(name, time, values + noise * rng.standard_normal(time.size), unit, f"Bus.{name}")

    return Log.of(
        [
            signal("longitudinal_speed", v, "m/s", 0.02), signal("longitudinal_acceleration", a, "m/s^2", 0.1),
            signal("accelerator_pedal", gas, "1"), signal("brake_pressure", brake, "Pa"),
            signal("engine_torque", torque, "N*m"), signal("engine_torque_request", torque, "N*m"),
            signal("gear", gear, "1"),
        ],
        source="recordings/drive.blf",
    )  # fmt: skip


def run(name: str, log: Log) -> Estimate:
    vehicle = None if name == "kinematic" else codriver.load_vehicle("bisoffi2017")
    return codriver.compile(codriver.build(name, vehicle)).run(log)


@pytest.fixture(scope="module")
def log() -> Log:
    return made_log()


@pytest.fixture(scope="module")
def estimates(log: Log) -> dict[str, Estimate]:
    return {name: run(name, log) for name in ESTIMATORS}


def written(estimate: Estimate, tmp_path, **options) -> str:
    path = tmp_path / "report.html"
    write_report(estimate, path, **options)
    return path.read_text(encoding="utf-8")


def figure_of(html: str) -> dict:
    return json.loads(re.search(r'id="figure">(.*?)</script>', html, re.S).group(1))


def unpacked(html: str, column: int) -> np.ndarray:
    """A column, decoded as the page does it, without the page's code."""
    spec = figure_of(html)["columns"]
    data = gzip.decompress(base64.b64decode(re.search(r'id="columns">(.*?)</script>', html, re.S).group(1)))
    return decoded(data, spec)[column]


def decoded(data: bytes, columns: list[dict]) -> list[np.ndarray]:
    planes = np.frombuffer(data, np.uint8).reshape(4, -1).astype(np.int64)
    zigzag = planes[0] + (planes[1] << 8) + (planes[2] << 16) + (planes[3] << 24)
    change = (zigzag >> 1) ^ -(zigzag & 1)
    found, at = [], 0
    for column in columns:
        total = np.cumsum(change[at : at + column["n"]])
        total = (total + 2**31) % 2**32 - 2**31
        found.append(np.where(total == -(2**31), np.nan, column["base"] + column["step"] * total))
        at += column["n"]
    return found


class TestPage:
    @pytest.mark.parametrize("name", ESTIMATORS)
    def test_needs_nothing_beside_it(self, name, estimates, tmp_path):
        html = written(estimates[name], tmp_path)
        assert not re.search(r"<(script|img|iframe|link|source|object)[^>]*\b(src|href)\s*=", html)
        assert not re.search(r"https?:|url\(|@import", html)
        assert "default-src 'none'" in html  # the browser itself refuses to load anything
        assert len(html) < 4_000_000

    def test_says_what_it_is(self, estimates, tmp_path):
        estimate = estimates["intent-pedals"]
        html = written(estimate, tmp_path, command="codriver estimate drive.blf")
        for said in (
            "Driver intention: drive.blf", "bisoffi2017", "m/s³", "m/s²", "km/h", "bar", "codriver estimate drive.blf",
            "Bus.brake_pressure", "0.456 s", "gear shifts", "95% band", codriver.__version__,
        ):  # fmt: skip
            assert said in html, said
        check = estimate.check()
        assert check.verdict in html
        assert all(finding.text.replace("m/s^2", "m/s²").replace("'", "&#x27;") in html for finding in check.findings)

    def test_titles(self, estimates, tmp_path):
        assert "<title>Monday</title>" in written(estimates["kinematic"], tmp_path, title="Monday")
        assert "Vehicle acceleration and jerk" in written(estimates["kinematic"], tmp_path)

    def test_strings_of_files_are_escaped(self, log, tmp_path):
        evil = "<script>alert(1)</script>"
        speed = log["longitudinal_speed"]
        bad = Log(
            {**log.signals, speed.name: Signal(speed.name, speed.time, speed.values, "m/s", evil)}, f"/x/{evil}&.blf",
            (f"fault {evil}",),
        )  # fmt: skip
        truth = Log({speed.name: speed}, source=evil)
        html = written(run("kinematic", bad), tmp_path, title=f"t {evil}", command=evil, truth=truth)
        assert evil not in html
        assert html.count("&lt;script&gt;alert(1)&lt;/script&gt;") >= 6

    def test_written_whole_or_not_at_all(self, estimates, tmp_path):
        path = tmp_path / "report.html"
        path.write_text("before")
        with pytest.raises(UsageError, match="cannot be written"):
            write_report(estimates["kinematic"], tmp_path / "no folder" / "report.html")
        write_report(estimates["kinematic"], path)
        assert path.read_text().endswith("</html>\n")
        assert [p.name for p in tmp_path.iterdir()] == ["report.html"]

    def test_same_estimate_gives_the_same_bytes(self, estimates, tmp_path):
        assert written(estimates["intent-torque"], tmp_path) == written(estimates["intent-torque"], tmp_path)


class TestPanels:
    @pytest.mark.parametrize(
        ("name", "there", "absent"),
        [
            ("intent-pedals", ("Intentional jerk", "Road slope", "Innovations", "Gear"), ("Torque",)),
            ("intent-torque", ("Intentional jerk", "Torque of engine", "Innovations"), ()),
            ("kinematic", ("Jerk of the vehicle", "Acceleration of the vehicle", "Road slope"), ("Intentional",)),
            ("pedals-only", ("Intentional jerk", "Speed", "Pedals"), ("Road slope", "Innovations")),
        ],
    )
    def test_adapt_to_the_estimator(self, name, there, absent, estimates, tmp_path):
        spec = figure_of(written(estimates[name], tmp_path))
        headings = " ".join(a["text"] for a in spec["layout"]["annotations"])
        assert all(word in headings for word in there)
        assert not any(word in headings for word in absent)
        bands = [t for t in spec["traces"] if "band" in t["name"]]
        assert bool(bands) == (name != "pedals-only")
        assert len(spec["traces"]) == len(spec["sources"])

    def test_curves_are_the_estimate_in_display_units(self, estimates, tmp_path):
        estimate = estimates["kinematic"]
        html = written(estimate, tmp_path)
        spec = figure_of(html)
        speed = next(
            s["column"] for t, s in zip(spec["traces"], spec["sources"], strict=True)
            if t["name"] == "estimate" and t["yaxis"] == "y"
        )  # fmt: skip
        values = unpacked(html, speed)
        wanted = np.where(estimate.valid, 3.6 * estimate.columns["longitudinal_speed"], np.nan)
        np.testing.assert_allclose(values, wanted, atol=5e-3)
        assert np.array_equal(np.isnan(values), np.isnan(wanted))

    def test_shadings(self, estimates, tmp_path):
        spec = figure_of(written(estimates["intent-pedals"], tmp_path))
        assert set(spec["stretches"]) == {"braking", "gear_shift", "not_valid"}
        assert len(spec["stretches"]["gear_shift"]) == 6 - 1  # up and down every 20 s, the last down is at the end

    def test_dates_as_seconds_start_at_zero(self, log, tmp_path):
        moved = Log({n: Signal(n, s.time + 1.5e9, s.values, s.unit, s.source) for n, s in log.items()}, "x")
        html = written(run("kinematic", moved), tmp_path)
        assert figure_of(html)["span"][0] == 0.0
        assert "1500000000.000 s of the recording" in html


class TestForeignObserver:
    """A report of an observer of which it knows no name: a wheel's torque from its angle."""

    @pytest.fixture
    def wheel(self) -> Estimate:
        return codriver.compile(toy_wheel()).run(wheel_log())

    def test_each_estimate_has_its_panel(self, wheel, tmp_path):
        torque = wheel.log["driver_torque"]
        truth = Log.of([Signal("driver_torque", torque.time, torque.values, "N*m")])
        spec = figure_of(written(wheel, tmp_path, truth=truth))
        titles = [a["text"] for a in spec["layout"]["annotations"]]
        assert len(titles) == 3
        assert "Steering wheel angle" in titles[0]
        assert "Driver torque: torque of the driver's hands" in titles[1].replace("&#x27;", "'")
        assert "Innovations" in titles[2]
        names = {axis: [t["name"] for t in spec["traces"] if t["yaxis"] == axis] for axis in ("y", "y3", "y5")}
        assert names == {
            "y": ["measured", "95% band", "estimate"], "y3": ["measured", "95% band", "estimate", "true"], "y5": ["angle"],
        }  # fmt: skip
        assert spec["layout"]["yaxis"]["title"]["text"] == "°"

    def test_tables_and_words(self, wheel, tmp_path):
        html = written(wheel, tmp_path)
        for said in (
            "Steering wheel angle and driver torque: wheel.csv", "Estimated by toy-wheel from steering wheel angle",
            "driver torque, RMS", "steering wheel angle, 5% to 95%", "angle: the innovations scatter", "half a second",
        ):  # fmt: skip
            assert said in html, said
        for absent in ("1/ell", "gear shifts", "jerk", "braking"):
            assert absent not in re.sub(r"<script.*?</script>|<style.*?</style>", "", html, flags=re.S), absent

    def test_a_delay_it_states_is_told(self, tmp_path):
        estimate = codriver.compile(toy_wheel(settings={"delay_s": 0.123})).run(wheel_log())
        assert "expected delay</td><td class=num><b>0.123 s" in written(estimate, tmp_path).replace(
            "<td>", "<td class=num>"
        )

    def test_a_meaning_is_escaped(self, tmp_path):
        evil = tuple(Output(o.name, o.unit, o.role, "<script>alert(1)</script>") for o in OUTPUTS)
        html = written(codriver.compile(toy_wheel(outputs=evil)).run(wheel_log()), tmp_path)
        assert "<script>alert" not in html
        assert any("&lt;script&gt;" in a["text"] for a in figure_of(html)["layout"]["annotations"])


class TestOddEstimates:
    def test_three_samples(self, log, tmp_path):
        short = log.between(0.0, 0.03)
        for name in ESTIMATORS:
            assert "Do not trust" in written(run(name, short), tmp_path) or name == "pedals-only"

    def test_no_samples(self, estimates, tmp_path):
        whole = estimates["kinematic"]
        none = {n: v[:0] for n, v in whole.columns.items()}
        grid = Grid(
            whole.grid.time[:0], 0.01,
            *({n: v[:0] for n, v in d.items()} for d in (whole.grid.values, whole.grid.fresh, whole.grid.held)),
        )  # fmt: skip
        empty = Estimate("kinematic", grid, none, whole.outputs, whole.measured, whole.provenance, whole.log)
        assert "nothing to draw" in written(empty, tmp_path)

    def test_nothing_valid(self, log, tmp_path):
        standing = log.with_signals(
            Signal("longitudinal_speed", log["longitudinal_speed"].time, np.zeros(6000), "m/s", "still")
        )
        html = written(run("intent-pedals", standing), tmp_path, truth=log)
        assert "Do not trust this estimate" in html
        assert "standing still" in html
        assert "nothing valid" in html

    def test_fewer_outputs(self, log, tmp_path):
        program = codriver.compile(codriver.build("kinematic"), outputs=("longitudinal_jerk", "valid"))
        headings = figure_of(written(program.run(log), tmp_path))["layout"]["annotations"]
        assert any("Jerk" in a["text"] for a in headings)

    def test_long_drive_stays_small_and_keeps_its_extremes(self, tmp_path):
        log = made_log(3600.0)
        a = log["longitudinal_acceleration"]
        values = a.values.copy()
        values[123_457] = 19.0
        estimate = run("intent-pedals", log.with_signals(Signal(a.name, a.time, values, a.unit, a.source)))
        html = written(estimate, tmp_path)
        assert len(html) < 8_000_000
        assert "thinned out" in html
        spec = figure_of(html)
        assert max(c["n"] for c in spec["columns"]) <= MOST
        tops = [np.nanmax(unpacked(html, i)) for i in range(len(spec["columns"]))]
        assert any(abs(top - 19.0) < 1e-2 for top in tops)


class TestStretches:
    def test_silent_signal_is_named_with_its_time(self, log, tmp_path):
        speed = log["longitudinal_speed"]
        kept = (speed.time < 20.0) | (speed.time > 22.0)
        holed = log.with_signals(Signal(speed.name, speed.time[kept], speed.values[kept], "m/s", speed.source))
        estimate = run("intent-pedals", holed)
        [(start, stop)] = gaps(estimate)["longitudinal_speed"]
        assert start == pytest.approx(19.99)
        assert stop == pytest.approx(22.01)
        assert re.search(r"Longitudinal speed missing <a [^>]*>20\.0–22\.0 s</a>", written(estimate, tmp_path))

    def test_missing_input_explains_what_is_not_valid(self, log):
        brake = log["brake_pressure"]
        kept = (brake.time < 30.0) | (brake.time > 33.0)
        holed = log.with_signals(Signal(brake.name, brake.time[kept], brake.values[kept], "Pa", brake.source))
        found = [s for s in not_valid(run("intent-pedals", holed)) if s.span[0] > 10]
        assert "brake pressure missing" in found[0].reason
        assert found[0].span[0] == pytest.approx(30.5, abs=0.03)  # held for 0.5 s
        assert 33.0 < found[0].span[1] < 34.0  # and settled again


class TestNumbers:
    @pytest.mark.parametrize(("preset", "lag"), [("bisoffi2017", 0.911), ("bisoffi2015", 0.627)])
    def test_expected_lag(self, preset, lag, log):
        for ell in (1.0, 2.0):
            program = codriver.compile(codriver.build("kinematic", preset=preset, ell=ell))
            assert expected_lag(program.run(log, stop=1.0)) == pytest.approx(lag / ell, rel=2e-3)

    def test_lag_of_one_s_own_noise_is_known_too(self, log):
        own = Preset((1e-2, 1e-4, 1e-1, 1.0), (1.0, 1e-2), 2.0, "that of 2017")
        estimate = codriver.compile(codriver.build("kinematic", preset=own)).run(log, stop=1.0)
        assert estimate.provenance["preset"] == "own"
        assert expected_lag(estimate) == pytest.approx(0.456, abs=1e-3)

    def test_lag_of_the_pedals_is_that_of_their_filter(self, estimates):
        assert expected_lag(estimates["pedals-only"]) == pytest.approx(0.08, abs=1e-3)

    def test_lag_is_what_a_ramp_of_jerk_shows(self):
        time = np.arange(0.0, 40.0, 0.01)
        v, a = 5 + 1e-3 * time**4 / 24, 1e-3 * time**3 / 6
        ramp = Log.of(
            [Signal("longitudinal_speed", time, v, "m/s"), Signal("longitudinal_acceleration", time, a, "m/s^2")]
        )
        # j = 1e-3 t^2 / 2, so a lag of T shows as an error of about 1e-3 t T
        estimate = run("kinematic", ramp)
        late = 1e-3 * 40.0**2 / 2 - estimate.columns["longitudinal_jerk"][-1]
        assert late / (1e-3 * 40.0) == pytest.approx(expected_lag(estimate), rel=0.03)

    def test_errors_against_a_shifted_self(self, estimates):
        estimate = estimates["kinematic"]
        jerk = estimate["longitudinal_jerk"]
        truth = Log.of([Signal("longitudinal_jerk", jerk.time - 0.2, jerk.values, jerk.unit)])
        [error] = errors(estimate, truth)
        assert error.lag == pytest.approx(0.2)
        assert error.rms_shifted < 1e-9 < error.rms

    def test_numbers_as_people_write_them(self):
        assert [number(x) for x in (0.0, 0.2, -2.84, 1234.5, 94.4, float("nan"))] == [
            "0", "0.2", "−2.84", "1234", "94.4", "–",
        ]  # fmt: skip
        assert shown("brake_pressure", [1e5])[0] == pytest.approx(1.0)
        assert shown("road_slope", [np.arctan(0.1)])[0] == pytest.approx(10.0)


class TestPack:
    @pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
    def test_round_trip(self, scale):
        rng = np.random.default_rng(3)
        values = scale * np.cumsum(rng.standard_normal(5000))
        values[100:120] = np.nan
        pack = Pack(0.0, 0.01)
        pack.add(values)
        pack.add(np.full(7, np.nan))
        pack.add(np.array([1.0, 1.0, 2.0, -1.0]))
        back = decoded(gzip.decompress(base64.b64decode(pack.text())), pack.columns)
        np.testing.assert_allclose(back[0], values, atol=2e-4 * np.nanstd(values) * 4)
        assert np.isnan(back[1]).all()
        assert back[2].tolist() == [1.0, 1.0, 2.0, -1.0]

    def test_one_wild_value_does_not_coarsen_the_rest(self):
        values = np.sin(np.linspace(0, 30, 4000))
        values[7] = 1e5
        pack = Pack(0.0, 0.01)
        pack.add(values)
        back = decoded(gzip.decompress(base64.b64decode(pack.text())), pack.columns)[0]
        np.testing.assert_allclose(back, values, atol=2e-4)

    def test_bands_only_widen(self):
        rng = np.random.default_rng(4)
        values = rng.standard_normal(3 * MOST + 11)
        low, size = thin_out(values, "low")
        high, _ = thin_out(values, "high")
        index = np.arange(values.size) // size
        assert np.all(low[index] <= values)
        assert np.all(values <= high[index])
        both, _ = thin_out(values)
        assert (both.min(), both.max()) == (values.min(), values.max())


@pytest.mark.skipif(shutil.which("chromium") is None, reason="no chromium to open the page with")
def test_a_browser_draws_it(estimates, log, tmp_path):
    path = tmp_path / "report.html"
    write_report(estimates["intent-pedals"], path, truth=log)
    command = [
        "chromium", "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync",
        "--disable-background-networking", "--disable-component-update", f"--user-data-dir={tmp_path / 'profile'}",
        "--virtual-time-budget=8000", "--dump-dom", path.as_uri(),
    ]  # fmt: skip
    dom = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True).stdout
    assert 'data-drawn="yes"' in dom
    assert "data-error" not in re.search(r"<body[^>]*>", dom).group()
    assert "main-svg" in dom
    assert dom.count('class="trace scatter') > 15
