"""Recordings of others through every door: estimates finite, plausible and checked, reports written.

The recordings lie beside the project and are no part of it; each test skips where its own is missing.
"""

from __future__ import annotations

import importlib.util
import json
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import codriver as cd
from codriver.cli import main
from codriver.identify import identify_ratio
from codriver.report import write_report
from conftest import ROOT, recording

NAMES = ROOT / "tests" / "names"


def estimate(name: str, log: cd.Log, vehicle: str | Path | None = None, **options) -> cd.Estimate:
    car = cd.load_vehicle(vehicle) if vehicle is not None else None
    return cd.compile(cd.build(name, car, **{"dt": 0.01, **options})).run(log)


def sound(result: cd.Estimate, least_valid: float, folder: Path) -> None:
    """What holds for every estimate: finite, mostly valid, checked, and a report can be written."""
    for output in result.outputs:
        assert np.isfinite(result.columns[output.name]).all(), output.name
    assert least_valid <= result.valid.mean() <= 1
    check = result.check()
    assert check.findings
    assert check.verdict
    write_report(result, folder / "report.html")
    assert "</html>" in (folder / "report.html").read_text()


def told(check: cd.Check, words: str) -> bool:
    return any(words in f.text for f in check.findings)


def alike(a: np.ndarray, b: np.ndarray) -> float:
    """Correlation, where both are there."""
    good = np.isfinite(a) & np.isfinite(b)
    return float(np.corrcoef(a[good], b[good])[0, 1])


def slope_of_speed(signal: cd.Signal, time: np.ndarray, over: float = 0.5) -> np.ndarray:
    """Change of speed over `over` seconds around each time: a derivative that knows nothing of observers."""
    ahead, behind = (np.interp(time + shift, signal.time, signal.values) for shift in (over / 2, -over / 2))
    return (ahead - behind) / over


@pytest.fixture
def info(monkeypatch, capsys):
    """`codriver info ...` in this process: exit code, standard output and error."""

    def call(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["codriver", "info", *map(str, arguments)])
        try:
            main()
        except SystemExit as end:
            code = end.code
        else:
            code = 0
        out, err = capsys.readouterr()
        assert "Traceback" not in out + err
        assert "should not have happened" not in err
        return code, out, err

    return call


class TestZoe:
    @pytest.fixture
    def folder(self) -> Path:
        return recording("nuscenes-zoe-scene-0103")

    @pytest.fixture
    def log(self, folder) -> cd.Log:
        return cd.read(folder)

    @pytest.fixture
    def example(self):
        spec = importlib.util.spec_from_file_location("zoe", ROOT / "examples" / "zoe_regeneration.py")
        module = importlib.util.module_from_spec(spec)
        sys.modules["zoe"] = module  # dataclasses look there
        spec.loader.exec_module(module)
        return module

    def test_ratio(self, log):
        """tau/M as written in the vehicle file, from the recording."""
        found = identify_ratio(log)
        car = cd.load_vehicle("renault-zoe")
        written = car.numbers("transmission")[0] / car.number("mass")
        assert abs(found.ratio - written) < 2 * found.sd
        assert found.sd < 0.05 * found.ratio
        assert found.seconds > 10

    @pytest.mark.parametrize(("name", "vehicle"), [("intent-torque", "renault-zoe"), ("kinematic", None)])
    def test_estimates(self, log, tmp_path, name, vehicle):
        result = estimate(name, log, vehicle)
        sound(result, 0.95, tmp_path)
        assert result.check().trusted

    def test_acceleration_is_that_of_the_wheels(self, log):
        result = estimate("kinematic", log)
        rate = slope_of_speed(log["longitudinal_speed"], result.time - 0.25)  # the observer lags by about that
        assert alike(result["longitudinal_acceleration"].values[100:-100], rate[100:-100]) > 0.97

    @pytest.mark.parametrize("ell", [1.4, 2.0, 3.0])
    def test_regeneration_is_not_the_drivers(self, folder, example, ell):
        """Where the motor brakes beyond the request, the car's jerk jumps; the intended one does so much less.

        At ell = 2: peaks 2.70 -> 1.51 at the onset and 2.49 -> 1.68 at the release, rms 1.37 -> 0.84. The rest is the
        friction brake, which the driver presses and no signal shows.
        """
        found = example.compare(*example.estimate(folder, ell))
        assert found.start == pytest.approx(3.9, abs=0.1)
        assert found.stop == pytest.approx(7.8, abs=0.2)
        assert found.intentional_onset < 0.7 * found.kinematic_onset
        assert found.intentional_release < 0.77 * found.kinematic_release
        assert found.intentional_rms < 0.73 * found.kinematic_rms
        assert found.intentional_elsewhere == pytest.approx(found.kinematic_elsewhere, rel=0.2)
        if ell == 2.0:
            assert found.kinematic_onset == pytest.approx(2.70, rel=0.1)
            assert found.intentional_onset == pytest.approx(1.51, rel=0.1)
            assert found.kinematic_release == pytest.approx(2.49, rel=0.1)
            assert found.intentional_release == pytest.approx(1.68, rel=0.1)
            assert found.kinematic_rms == pytest.approx(1.37, rel=0.1)
            assert found.intentional_rms == pytest.approx(0.84, rel=0.1)

    def test_picture(self, folder, example, tmp_path):
        pytest.importorskip("matplotlib")
        intent, kinematic = example.estimate(folder)
        found = example.compare(intent, kinematic)
        example.draw(intent, kinematic, found, tmp_path / "zoe.png")
        assert (tmp_path / "zoe.png").read_bytes().startswith(b"\x89PNG")
        assert "largest at the onset" in example.describe(found)

    def test_info(self, info, folder):
        code, out, _ = info(folder, "--vehicle", "renault-zoe")
        assert code == 0
        assert "best available for intent: intent-torque" in out
        assert "intent-pedals         lacks signals: brake_pressure, gear" in out


class TestComma:
    @pytest.fixture
    def folder(self) -> Path:
        return recording("comma2k19-rav4")

    @pytest.fixture
    def dbc(self, folder) -> Path:
        return folder / "toyota_new_mc_pt_full.dbc"

    @pytest.mark.parametrize("decoded", [True, False])
    def test_kinematic(self, folder, dbc, decoded, tmp_path):
        """Both accelerometers, the car's on the bus and the phone's, go with the change of wheel speed."""
        log = cd.read(folder, dbc=dbc if decoded else None)
        assert ("KINEMATICS" in log["longitudinal_acceleration"].source) == decoded
        result = estimate("kinematic", log)
        sound(result, 0.97, tmp_path)
        assert result.check().trusted
        assert told(result.check(), "correlation 0.8")
        measured = log.sample(["longitudinal_acceleration"], 0.01, start=result.time[0]).values[
            "longitudinal_acceleration"
        ]
        rate = slope_of_speed(log["longitudinal_speed"], result.time, 1.0)
        assert (
            alike(
                result["longitudinal_acceleration"].values,
                slope_of_speed(log["longitudinal_speed"], result.time - 0.25),
            )
            > 0.97
        )
        n = min(measured.size, rate.size)
        smooth = np.convolve(np.nan_to_num(measured[:n]), np.ones(100) / 100, "same")
        assert alike(smooth[100:-100], rate[:n][100:-100]) > 0.8

    def test_sign_of_the_bus_accelerometer(self, folder, dbc):
        """With the sign that the DBC gives, the check says that it is wrong."""
        log = cd.read(folder, dbc=dbc)
        a = log["longitudinal_acceleration"]
        wrong = log.with_signals(cd.Signal(a.name, a.time, -a.values, a.unit, a.source))
        assert not told(estimate("kinematic", log).check(), "sign is wrong")
        assert told(estimate("kinematic", wrong).check(), "sign is wrong")

    def test_both_speeds_are_the_processed_one(self, folder, dbc):
        time, value = (np.load(folder / "processed_log" / "CAN" / "speed" / part) for part in ("t", "value"))
        value = np.ravel(value)
        for log in (cd.read(folder, dbc=dbc), cd.read(folder)):
            speed = log["longitudinal_speed"]
            error = np.interp(time, speed.time, speed.values) - value
            assert np.abs(np.mean(error)) < 0.05
            assert np.sqrt(np.mean(error**2)) < 0.1

    def test_the_two_jerks_agree(self, folder, dbc):
        """Two accelerometers, one car: independent noise, the same jerk."""
        one, two = (estimate("kinematic", cd.read(folder, dbc=file)) for file in (dbc, None))
        time = one.time[200:-200]
        other = np.interp(time, two.time, two["longitudinal_jerk"].values)
        assert alike(one["longitudinal_jerk"].values[200:-200], other) > 0.9


class TestCanEdge:
    @pytest.fixture
    def folder(self) -> Path:
        pytest.importorskip("asammdf")
        return recording("css-canedge-car")

    @pytest.mark.parametrize(
        ("file", "valid", "duration"), [("00000001-60FEB68B.MF4", 0.5, 364.7), ("00000002-60FEB8E3.MF4", 0.95, 600.0)]
    )
    def test_kinematic(self, folder, file, valid, duration, tmp_path):
        """Acceleration at 100 Hz, speed by satellite at 1 Hz; the first log stands for 39 % of its time."""
        log = cd.read(folder / file, dbc=folder / "dbc" / "canmod-gps.dbc", names=NAMES / "canedge.toml")
        result = estimate("kinematic", log)
        sound(result, valid, tmp_path)
        assert result.check().trusted
        assert len(result.grid) * result.grid.dt == pytest.approx(duration, abs=1)
        speed = log["longitudinal_speed"]
        edges = np.searchsorted(result.time, speed.time)
        values = result["longitudinal_acceleration"].values
        means = np.array([values[i:k].mean() for i, k in pairwise(edges)])
        good = (speed.values[1:] > 4) & (np.diff(speed.time) < 1.5)
        assert alike(means[good], np.diff(speed.values)[good]) > 0.8

    def test_info_proposes_the_speed_and_its_flag(self, info, folder):
        code, out, _ = info(folder / "00000001-60FEB68B.MF4", "--dbc", folder / "dbc" / "canmod-gps.dbc", "--json")
        assert code == 0
        begins = json.loads(out)["names_file_begins"]
        assert 'source = "gnss_speed.Speed"  # 252 different values, 0 to 15.86 m/s' in begins
        assert 'valid = "gnss_speed.SpeedValid"' in begins

    def test_axes_are_found_in_the_data(self, folder):
        """Among the three axes and both signs, -Y goes best with the change of speed: the names file is right."""
        file, dbc = folder / "00000002-60FEB8E3.MF4", folder / "dbc" / "canmod-gps.dbc"
        raw = cd.read(file, dbc=dbc, names=NAMES / "canedge.toml")
        speed = raw["longitudinal_speed"]
        rate = np.diff(speed.values) / np.diff(speed.time)
        found = {}
        for axis, name, sign in (
            ("Y", "longitudinal_acceleration", -1), ("Z", "lateral_acceleration", -1), ("X", "vertical_acceleration", 1),
        ):  # fmt: skip
            signal = raw[name]
            edges = np.searchsorted(signal.time, speed.time)
            mean = np.array([np.nanmean(signal.values[i:k]) if k > i else np.nan for i, k in pairwise(edges)])
            found[axis] = alike(sign * mean, rate)
        assert found["Y"] < -0.7
        assert all(abs(found[axis]) < 0.4 for axis in "XZ"), found

    def test_values_of_a_sensor_that_was_not_ready(self, folder):
        """The second log holds +-64 m/s^2 on all axes at once, where ImuValid is 0: left out, and told."""
        log = cd.read(
            folder / "00000002-60FEB8E3.MF4", dbc=folder / "dbc" / "canmod-gps.dbc", names=NAMES / "canedge.toml"
        )
        assert np.nanmax(np.abs(log["longitudinal_acceleration"].values)) < 6
        assert any("values left out, where gnss_imu.ImuValid is 0" in fault for fault in log.faults)
        assert not any("64 m/s^2" in fault for fault in log.faults)


class TestIracing:
    @pytest.fixture
    def log(self) -> cd.Log:
        return cd.read(recording("iracing") / "amg.ibt")

    def test_kinematic(self, log, tmp_path):
        result = estimate("kinematic", log, dt=1 / 60)
        sound(result, 0.8, tmp_path)
        assert result.check().trusted
        rate = slope_of_speed(log["longitudinal_speed"], result.time - 0.25)
        straight = np.abs(np.interp(result.time, log["yaw_rate"].time, log["yaw_rate"].values)) < 0.2
        good = result.valid & straight
        assert alike(result["longitudinal_acceleration"].values[good], rate[good]) > 0.9

    def test_pedals_only(self, log, tmp_path):
        """Pedals and a guessed car against what the simulator's car does."""
        result = estimate("pedals-only", log, ROOT / "tests" / "vehicles" / "amg-gt3.toml", dt=1 / 60)
        sound(result, 0.9, tmp_path)
        assert told(result.check(), "nothing measured is held against it")
        kinematic = estimate("kinematic", log, dt=1 / 60)
        np.testing.assert_allclose(result.time, kinematic.time)
        fast = kinematic.valid & (kinematic["longitudinal_speed"].values > 15)
        asked, done = result["intentional_acceleration"].values, kinematic["longitudinal_acceleration"].values
        assert alike(asked[fast], done[fast]) > 0.85
        assert 0.15 < result.flag("braking").mean() < 0.3
        assert result.flag("gear_shift").any()


class TestUdacity:
    FILES = ("hmb6-steering-50hz.csv", "hmb1-20hz.csv", "hmb2-20hz.csv", "hmb1-with-gps-20hz.csv")

    @pytest.mark.parametrize("file", FILES)
    def test_info_says_what_it_cannot_feed_and_why(self, info, file):
        log = recording("udacity-lincoln-mkz") / file
        code, out, _ = info(log)
        assert code == 0
        assert "no channel has a standard name" in out
        assert 'source = "speed"  # ' in out
        assert 'unit = "km/h"  # the recording says none: which is it?' in out
        assert (
            "no estimator can be fed: kinematic, which needs the least, lacks longitudinal_acceleration and longitudinal_speed"
            in out
        )
        code, out, _ = info(log, "--names", NAMES / "udacity.toml", "--json")
        assert code == 0
        told = json.loads(out)
        assert told["best"]["intent"] is None
        lacks = {e["name"]: e["missing_signals"] for e in told["estimators"]}
        assert lacks["kinematic"] == ["longitudinal_acceleration"]
        assert "accelerator_pedal" in lacks["intent-pedals"]
        assert {s["name"] for s in told["signals"]} == {
            "longitudinal_speed", "steering_wheel_angle", "steering_wheel_torque"
        }  # fmt: skip


class TestOthers:
    """Not required, but they must not crash and the message must help."""

    @pytest.mark.parametrize(
        ("file", "words"),
        [
            ("kit-seat-leon/2017-07-06_Seat_Leon_KA_RT_Normal.csv", 'source = "Vehicle Speed Sensor [km/h]"'),
            ("kit-seat-leon/2017-07-26_Seat_Leon_RT_S_Stau.csv", 'unit = "km/h"'),
            ("kit-seat-leon/2018-02-27_Seat_Leon_KA_RT_Normal.csv", "Accelerator Pedal Position D [%]"),
            ("kia-soul-10-drivers/KU-Driving-Dataset-pre-test.CSV", 'source = "Vehicle_speed"'),
            ("davis-instrumented-bicycle/run-283-first-60s.csv", "T_delta"),
        ],
    )
    def test_tables(self, info, file, words):
        folder, name = file.split("/")
        code, out, _ = info(recording(folder) / name)
        assert code == 0
        assert "CSV table" in out
        assert words in out
        assert "no estimator can be fed" in out

    def test_what_is_no_recording_that_we_know(self, info):
        code, _, err = info(recording("tudelft-steer-by-wire-bicycle") / "bode_normal_4mps_1.2Hz.log")
        assert code == 1
        assert "has no time column" in err
        assert "[time] rate" in err

    def test_a_fleet_folder(self, info):
        code, _, err = info(recording("kit-seat-leon"))
        assert code == 1
        assert "folder of no known layout" in err
