"""The steering encoder's zero: told, found while riding, found from the whole ride; in the verdict, the command line and C."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from contextlib import suppress

import numpy as np
import pytest

import codriver as cd
from codriver.cli import main
from codriver.cli.steer_zero import parse_steer_zero, with_steer_zero
from codriver.errors import LogError, UsageError, VehicleError
from codriver.export import export_c
from codriver.identify import find_steer_zero
from codriver.observers import build
from codriver.observers.steer_zero import SteerZero
from codriver.simulate.motorcycle import RideSetting, simulate_ride
from codriver.simulate.motorcycle.files import nominal_vehicle, write_ride
from codriver.testing import check_observer
from codriver.vehicles import load_vehicle, save_vehicle

DEGREE = np.pi / 180


@pytest.fixture(scope="module")
def vehicle() -> cd.Vehicle:
    return nominal_vehicle()


@pytest.fixture(scope="module")
def slalom():
    """With noise and biases; a seed that nothing was chosen on."""
    return simulate_ride(RideSetting("slalom", noise=0.075, bias=1.0), seed=9)


@pytest.fixture(scope="module")
def sound(slalom, vehicle) -> cd.Estimate:
    """Of the encoder as it is, with nothing said of a zero."""
    return cd.estimate_log("motorcycle-ekf", slalom.log(), vehicle)


def turned(log: cd.Log, degrees: float) -> cd.Log:
    d = log["steer_angle"]
    return log.with_signals(cd.Signal("steer_angle", d.time, d.values + degrees * DEGREE, d.unit))


def told(vehicle: cd.Vehicle, degrees: float, sd: float = 0.0) -> cd.Vehicle:
    return SteerZero(degrees * DEGREE, sd * DEGREE, "of the test").of(vehicle)


def roll_error(found: cd.Estimate, record) -> float:
    """Degrees rms, from 1 s on."""
    true = record.truth()["roll_angle"]
    off = found["roll_angle"].values - np.interp(found.time, true.time, true.values)
    return float(np.sqrt(np.mean(off[found.time >= found.time[0] + 1] ** 2))) / DEGREE


class TestTold:
    def test_nothing_is_as_before(self, vehicle):
        """A zero of 0 that is known is no part of the filter: as many operations, the same outputs."""
        plain, zero = build("motorcycle-ekf", vehicle), build("motorcycle-ekf", told(vehicle, 0.0))
        assert zero.outputs == plain.outputs
        assert zero.settings == plain.settings
        assert list(zero.carry) == list(plain.carry)
        assert zero.record().operations() == plain.record().operations()
        assert "steer_offset" not in {o.name for o in plain.outputs}

    @pytest.mark.parametrize("name", ["motorcycle-ekf", "motorcycle-kalman", "motorcycle-uio"])
    def test_value_is_taken_out(self, slalom, vehicle, name):
        log = slalom.log().between(0, 4)
        right = cd.estimate_log(name, log, vehicle)
        found = cd.estimate_log(name, turned(log, 1.0), told(vehicle, 1.0))
        for output in right:
            np.testing.assert_allclose(
                found.columns[output], right.columns[output], rtol=1e-6, atol=1e-6, err_msg=output
            )
        assert found["steer_offset"].values == pytest.approx(1.0 * DEGREE)
        assert found.provenance["steer_zero_source"] == "of the test"

    def test_bicycle_begins_there(self):
        bicycle = load_vehicle("meijaard2007")
        observer = build("bicycle-kalman", told(bicycle, 1.0, 0.1))
        assert [o.name for o in observer.outputs].count("steer_offset") == 1
        assert observer.settings["steer_zero_sd"] == pytest.approx(0.1 * DEGREE)
        t = np.arange(0, 1, 0.01)
        values = {"steer_angle": 0 * t + DEGREE, "roll_rate": 0 * t, "yaw_rate": 0 * t, "longitudinal_speed": 5 + 0 * t}
        log = cd.Log.of([cd.Signal(name, t, x, "") for name, x in values.items()])
        found = cd.compile(observer).run(log)
        assert found["steer_offset"].values == pytest.approx(DEGREE, abs=1e-9)
        assert found["steer_angle"].values == pytest.approx(0.0, abs=1e-9)
        assert found["steer_offset_sd"].values[0] == pytest.approx(0.1 * DEGREE, rel=0.01)

    def test_vehicle_file_keeps_it(self, vehicle, tmp_path):
        save_vehicle(told(vehicle, 0.3, 0.02), tmp_path / "machine.toml")
        again = SteerZero.from_vehicle(load_vehicle(tmp_path / "machine.toml"))
        assert (again.value, again.sd) == pytest.approx((0.3 * DEGREE, 0.02 * DEGREE))
        (tmp_path / "wrong.toml").write_text(
            (tmp_path / "machine.toml").read_text().replace("[steer_zero]\n", "[steer_zero]\nvalu = 1\n")
        )
        with pytest.raises(VehicleError, match="valu"):
            load_vehicle(tmp_path / "wrong.toml")


class TestFound:
    @pytest.mark.parametrize("zero", [0.3, -3.0])
    def test_while_it_rides(self, slalom, vehicle, zero):
        """A state: 0.87 to 0.94 degrees of roll with biases on two other seeds, where 0.3 of zero cost 3.4 without it."""
        found = cd.estimate_log("motorcycle-ekf", turned(slalom.log(), zero), told(vehicle, 0.0, 3.0))
        assert roll_error(found, slalom) < 1.1
        assert found["steer_offset"].values[-1] == pytest.approx(zero * DEGREE, abs=0.03 * DEGREE)

    @pytest.mark.parametrize("zero", [0.0, 1.0])
    def test_from_the_whole_ride(self, slalom, vehicle, sound, zero):
        """With biases: 0.04 to 0.08 degrees more than with the zero known, on two other seeds."""
        log = turned(slalom.log(), zero)
        found = find_steer_zero(log, vehicle)
        assert abs(found.value - zero * DEGREE) < 3 * found.sd < 0.1 * DEGREE
        second = cd.estimate_log("motorcycle-ekf", log, found.of(vehicle))
        assert roll_error(second, slalom) < roll_error(sound, slalom) + 0.15
        assert second.check().trusted
        assert any("encoder's zero" in f.text for f in second.check().findings)

    def test_a_ride_that_does_not_tell(self, slalom, vehicle):
        log = slalom.log()
        v = log["longitudinal_speed"]
        standing = log.with_signals(cd.Signal(v.name, v.time, 0 * v.values, v.unit)).between(0, 3)
        with pytest.raises(LogError, match="no valid moment"):
            find_steer_zero(standing, vehicle)
        with pytest.raises(LogError, match="comes out as"):
            find_steer_zero(turned(log.between(0, 5), 18.0), vehicle)
        with pytest.raises(UsageError, match="motorcycle-imu"):
            find_steer_zero(log, vehicle, "motorcycle-imu")

    def test_without_a_yaw_rate_a_bicycle_tells_little(self):
        t = np.arange(0, 8, 0.01)
        values = {"steer_angle": 0 * t, "roll_rate": 0 * t, "longitudinal_speed": 5 + 0 * t}
        log = cd.Log.of([cd.Signal(name, t, x, "") for name, x in values.items()])
        with pytest.raises(LogError, match="degrees only"):
            find_steer_zero(log, load_vehicle("meijaard2007"), "bicycle-kalman")


class TestVerdict:
    def test_a_right_value_is_said(self, slalom, vehicle):
        found = cd.estimate_log("motorcycle-kalman", turned(slalom.log(), 1.0), told(vehicle, 1.0))
        said = [f.text for f in found.check().findings if "zero" in f.text]
        assert said == ["the steering encoder's zero, 1.00 deg as told, is taken out"]

    def test_a_wrong_value_is_told(self, slalom, vehicle):
        found = cd.estimate_log("motorcycle-ekf", turned(slalom.log(), 1.0), told(vehicle, -0.5))
        said = [f.text for f in found.check().findings if "off its zero" in f.text]
        assert "where -0.5 was told" in said[0]
        assert "--steer-zero auto" in said[0]


class TestCommandLine:
    @pytest.mark.parametrize(("text", "value", "sd"), [("0.3", 0.3, 0.0), ("-1:0.2", -1.0, 0.2), ("0:1", 0.0, 1.0)])
    def test_values(self, text, value, sd):
        zero = parse_steer_zero(text)
        assert (zero.value, zero.sd) == pytest.approx((value * DEGREE, sd * DEGREE))

    @pytest.mark.parametrize("text", ["", "x", "nan", "21", "1:", "1:-1", "1:11", "Auto"])
    def test_no_values(self, text):
        with pytest.raises(UsageError, match="--steer-zero"):
            parse_steer_zero(text)

    def test_refusals(self, vehicle):
        for name, machine in (("motorcycle-imu", vehicle), ("kinematic", vehicle), ("motorcycle-ekf", None)):
            with pytest.raises(UsageError, match=f"--steer-zero 1 with {name}"):
                with_steer_zero("1", name, None, machine)
        with pytest.raises(UsageError, match="without a ride"):
            with_steer_zero("auto", "motorcycle-ekf", None, vehicle)

    def test_verdict_names_the_command_that_mends(self, tmp_path, monkeypatch, capsys):
        """Run as it is, then as the verdict says."""
        write_ride(tmp_path / "ride", RideSetting("slalom", noise=0.075, zero=1.0 * DEGREE), seed=9)
        folder = tmp_path / "ride"
        words = [
            "estimate",
            "motorcycle",
            folder / "ride.csv",
            "--names",
            folder / "names.toml",
            "--vehicle",
            folder / "vehicle.toml",
        ]
        words += ["-o", tmp_path / "lean.parquet", "--json", "--steer-zero", "0"]

        def run(arguments: list[object]) -> dict:
            monkeypatch.setattr(sys, "argv", ["codriver", *map(str, arguments)])
            with suppress(SystemExit):
                main()
            return json.loads(capsys.readouterr().out)

        first = run(words)
        assert first["mend"] == "codriver " + " ".join(map(str, words[:-1])) + " auto"
        assert "steer_zero" not in first
        second = run(first["mend"].split()[1:])
        assert "mend" not in second
        assert second["steer_zero"]["degrees"] == pytest.approx(1.0, abs=0.05)
        assert 0.01 < second["steer_zero"]["sd_degrees"] < 0.05
        assert "usable" in second["verdict"] or "nothing speaks against" in second["verdict"]
        machine = folder / "vehicle.toml"
        machine.write_text(f"{machine.read_text()}\n{second['vehicle_file']}\n")
        assert SteerZero.from_vehicle(load_vehicle(machine)).value == pytest.approx(
            second["steer_zero"]["degrees"] * DEGREE, rel=1e-3
        )


@pytest.mark.slow
def test_checklist(vehicle):
    """Live as batch, with a zero taken out and the rest as a state."""
    check_observer(build("motorcycle-ekf", told(vehicle, 0.5, 0.5)), rows=40)


@pytest.mark.slow
def test_in_c_as_float(vehicle, tmp_path):
    """With the state, at 5 ms: within the README's tolerance."""
    if shutil.which("gcc") is None:
        pytest.skip("gcc is not installed")
    export_c(cd.compile(build("motorcycle-ekf", told(vehicle, 0.5, 1.0), dt=0.005)), tmp_path, "float")
    strict = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-ffp-contract=off"]
    sources = sorted(map(str, tmp_path.glob("*.c")))
    subprocess.run(["gcc", *strict, *sources, "-o", tmp_path / "check", "-lm"], check=True)
    ran = subprocess.run([tmp_path / "check"], capture_output=True, text=True)
    assert ran.stdout.startswith("ok: 400 rows"), ran.stdout
