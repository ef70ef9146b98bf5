"""Files of two-point drivers, and codriver identify driver from a simulated drive's files to a drive with what was found."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

import codriver as cd
from codriver.cli.app import app
from codriver.cli.identify_driver import parse_known
from codriver.errors import UsageError
from codriver.models.two_point import TwoPointDriver
from codriver.models.two_point_file import (
    LETTERS,
    FiledDriver,
    FiledParameter,
    load_two_point,
    parse_two_point,
    save_two_point,
    two_point_text,
)


def ran(*words: object) -> str:
    """What a command says; it must end well."""
    done = CliRunner().invoke(app, [str(word) for word in words], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return done.output


def refused(*words: object) -> UsageError:
    """The error that a command ends with."""
    done = CliRunner().invoke(app, [str(word) for word in words])
    assert isinstance(done.exception, UsageError), done.output
    return done.exception


WHOLE = FiledDriver.of(TwoPointDriver(anticipation=4.25, far=1.1), "ann", "made up")
PART = replace(
    WHOLE,
    parameters={
        **WHOLE.parameters,
        "reflex": FiledParameter(None, given=5.0, source='not told: "hardly"'),
        "anticipation": FiledParameter(4.1, 0.2, source="identified"),
    },
)


class TestFile:
    @pytest.mark.parametrize("filed", [WHOLE, PART])
    def test_round_trip(self, tmp_path, filed):
        save_two_point(filed, tmp_path / "x.toml")
        assert load_two_point(tmp_path / "x.toml") == filed

    def test_every_parameter_of_the_driver(self):
        assert set(LETTERS) == set(vars(TwoPointDriver()))
        assert WHOLE.driver() == TwoPointDriver(anticipation=4.25, far=1.1)

    def test_untold_are_taken_by_name_only(self):
        with pytest.raises(UsageError, match="does not tell reflex") as error:
            PART.driver()
        assert "--given reflex" in str(error.value)
        assert PART.driver(["reflex"]) == TwoPointDriver(anticipation=4.1, reflex=5.0, far=1.1)
        with pytest.raises(UsageError, match="the given delay"):
            PART.driver(["reflex", "delay"])
        with pytest.raises(UsageError, match="tells all of them"):
            WHOLE.driver(["reflex"])

    @pytest.mark.parametrize(
        ("old", "new", "said"),
        [
            ("value = 4.1\n", "", "anticipation needs a value"),
            ("value = 4.1\n", "value = -4.1\n", "anticipation is -4.1"),
            ("value = 4.1\n", "value = nan\n", "anticipation.value is nan"),
            ("value = 4.1\n", "value = true\n", "anticipation.value is True"),
            ("value = 4.1\n", "value = 4.1\nhigh = 3\n", "anticipation.high is not known"),
            ("sd = 0.2\n", "sd = -0.2\n", "anticipation.sd is -0.2"),
            ('unit = "m/s"', 'unit = "km/h"', "compensation.unit is 'km/h'"),
            ("[muscle]", "[muscles]", "'muscles' is not known; [muscle] is missing"),
            ('name = "ann"', "name = 3", "'name' is missing"),
            ("[muscle]", "[muscle", "is not TOML"),
        ],
    )
    def test_faults(self, old, new, said):
        text = two_point_text(PART)
        assert old in text
        with pytest.raises(UsageError) as error:
            parse_two_point(text.replace(old, new, 1), "ann.toml")
        assert said in error.value.found

    def test_name(self, tmp_path):
        with pytest.raises(UsageError, match="ending in"):
            save_two_point(WHOLE, tmp_path / "x.driver")


class TestKnown:
    def test_letters_and_names(self):
        driver, names = parse_known("K_r=0.2, far = 1.2,muscle=0.08")
        assert driver == TwoPointDriver(column_gain=0.2, far=1.2, muscle=0.08)
        assert names == ("column_gain", "far", "muscle")
        assert parse_known("") == (TwoPointDriver(), ())

    @pytest.mark.parametrize("text", ["K_q=1", "K_r", "K_r=x", "K_r=-1", "T_N=0", "K_p=inf"])
    def test_refusals(self, text):
        with pytest.raises(UsageError):
            parse_known(text)


@pytest.fixture(scope="module")
def laps(tmp_path_factory):
    """A lap each way of a driver who is always the same."""
    folder = tmp_path_factory.mktemp("laps") / "ben"
    ran("simulate", "circuit", "-o", folder, "--driver", "ben", "--laps", 1, "--no-variability", "--seed", 4)
    return folder


class TestFromFilesToADrive:
    def test_found_again_and_driven(self, laps, tmp_path):
        found, report = tmp_path / "found.toml", tmp_path / "found.html"
        words = ("identify", "driver", laps / "drive.csv", "--names", laps / "names.toml", "--known", "far=1.2")
        said = ran(*words, "-o", found, "--report", report, "--beside", laps / "truth.toml")
        assert "tells all that was asked for" in said
        assert "always the same" in said
        truth, mine = load_two_point(laps / "truth.toml").driver(), load_two_point(found)
        assert truth.compensation == 6.0
        for name, within in (("anticipation", 0.02), ("reflex", 0.04), ("delay", 0.1)):
            p = mine.parameters[name]
            assert p.value == pytest.approx(getattr(truth, name), rel=within)
            assert abs(p.value - getattr(truth, name)) < 4 * p.sd
        page = report.read_text(encoding="utf-8")
        for title in ("Values with 95 % intervals", "Autocorrelation of the errors", "What the drives do not tell"):
            assert title in page
        # He drives as the one who drove: the same torque, metre by metre.
        ran("simulate", "circuit", "-o", tmp_path / "again", "--driver", found, "--laps", 1, "--no-variability")
        one, other = (cd.read(f / "truth.parquet")["driver_torque"].values for f in (laps, tmp_path / "again"))
        assert np.sqrt(np.mean((one - other) ** 2)) < 0.02 * one.std()
        assert "is there already" in refused(*words, "-o", found).found

    def test_a_drive_with_holes_is_cut(self, laps, tmp_path):
        header, *rows = (laps / "drive.csv").read_text().splitlines()
        kept = [r for r in rows if not 65 < float(r.split(",")[0]) < 85 and not 100 < float(r.split(",")[0]) < 120]
        drive, report = tmp_path / "holed.csv", tmp_path / "holed.html"
        drive.write_text("\n".join([header, *kept]) + "\n")
        known = "K_c=6, T_L=1.2, T_I=0.4, tau_p=0.16, K_t=5, T_N=0.1, far=1.2"
        words = ("identify", "driver", drive, "--names", laps / "names.toml", "--known", known)
        said = ran(*words, "-o", tmp_path / "a.toml", "--report", report)
        assert "heading_error have 2 holes, the longest 20.0 s at 65.0 s" in said
        assert "left out 85.0-100.0 s: shorter than 60 s" in said
        assert "min at 50 km/h" in said
        told = json.loads(ran(*words, "-o", tmp_path / "b.toml", "--json"))
        assert told["parameters"]["anticipation"]["value"] == pytest.approx(5.0, rel=0.02)
        assert {h["signal"] for h in told["holes"]} >= {"driver_torque", "road_curvature"}
        assert [(round(p["start"]), round(p["stop"])) for p in told["left_out"]] == [(85, 100)]
        assert len(told["speeds_m_s"]) == 2
        page = report.read_text(encoding="utf-8")
        assert "each piece settles anew" in page
        assert "no: shorter than 60 s" in page
        assert load_two_point(tmp_path / "a.toml").source == f"identified from {drive}, by the road"

    def test_what_is_not_told_must_be_given(self, laps, tmp_path):
        found = tmp_path / "ekf.toml"
        words = ("identify", "driver", laps / "drive.csv", "--names", laps / "names.toml", "--known", "near=6, far=1.2")
        told = json.loads(ran(*words, "--by", "dual-ekf", "-o", found, "--json"))
        assert "muscle" in told["refused"]
        assert told["given"] == {"column_gain": 0.15, "near": 6.0, "far": 1.2}
        drive = ("simulate", "circuit", "-o", tmp_path / "again", "--driver", found, "--laps", 1, "--direction", "left")
        assert "does not tell" in refused(*drive).found
        assert not (tmp_path / "again").exists()
        ran(*drive, "--given", ",".join(told["refused"]), "--no-variability")
        drove = load_two_point(tmp_path / "again" / "truth.toml")
        assert drove.name == "ekf"
        taken = drove.driver()
        assert taken.muscle == 0.1
        assert taken.anticipation == told["parameters"]["anticipation"]["value"]
        assert "all known" in refused(*drive[:3], tmp_path / "x", "--driver", "anna", "--given", "muscle").do

    def test_refusals(self, laps, tmp_path):
        words = ("identify", "driver", laps / "drive.csv", "--names", laps / "names.toml", "-o", tmp_path / "x.toml")
        for more, said in (
            (("--by", "magic"), "magic"),
            (("--known", "K_q=1"), "K_q"),
            (("--beside", "no.toml"), "no.toml"),
            (("--seek", "far", "--by", "dual-ekf"), "far by 'dual-ekf'"),
        ):
            assert said in refused(*words, *more).found
        # No file but a driver's is replaced.
        other = tmp_path / "other.toml"
        other.write_text("[x]\n", encoding="utf-8")
        assert "'x' is not known" in refused(*words[:-1], other, "--overwrite").found
        assert other.read_text(encoding="utf-8") == "[x]\n"
