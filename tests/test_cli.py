"""The command line as a user meets it: results, messages, exit codes; nothing left behind, never a traceback."""

from __future__ import annotations

import gzip
import json
import os
import shutil
import signal
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

import codriver as cd
from codriver.cli import main
from codriver.logs.write import Column, write_table
from conftest import motion_log

KEYS = ("longitudinal_speed", "longitudinal_acceleration")


class Ran:
    """A run: exit code, standard output, standard error."""

    def __init__(self, code: int, out: str, err: str) -> None:
        self.code, self.out, self.err = code, out, err

    def says(self, *words: str) -> None:
        """The message has the three parts and these words."""
        assert "expected:" in self.err, self.err
        assert "to do:" in self.err, self.err
        for word in words:
            assert word in self.err, self.err

    @property
    def summary(self) -> dict:
        return json.loads(self.out)

    @property
    def findings(self) -> str:
        return " | ".join(f"{f['severity']}: {f['text']}" for f in self.summary["findings"])


@pytest.fixture
def run(monkeypatch, capsys):
    """`codriver ...` in this process; a traceback is never right."""

    def call(*arguments: object) -> Ran:
        monkeypatch.setattr(sys, "argv", ["codriver", *map(str, arguments)])
        code = 0
        try:
            main()
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else 0
        out, err = capsys.readouterr()
        assert "Traceback" not in out + err
        assert "should not have happened" not in err, err
        return Ran(code, out, err)

    return call


@pytest.fixture
def estimate(run, tmp_path):
    """`codriver estimate ...` to a folder of its own, which stays empty unless the exit code is 0."""
    folder = tmp_path / "out"
    folder.mkdir()

    def call(estimator: str, log: Path, *options: object) -> Ran:
        ran = run("estimate", estimator, log, *options, "-o", folder / "result.parquet", "--json")
        left = [path.name for path in folder.iterdir()]
        assert left == (["result.parquet"] if ran.code == 0 else []), left
        if ran.code == 0:
            table = pq.read_table(folder / "result.parquet").to_pandas()
            estimates = [c for c in table if not c.startswith("input.")]
            assert np.isfinite(table[estimates].to_numpy(float)).all()
            (folder / "result.parquet").unlink()
        else:
            assert ran.out == ""
        return ran

    return call


def motion(seconds: float = 30.0) -> dict[str, np.ndarray]:
    """Columns of a good drive, by standard name."""
    log, _ = motion_log(seconds)
    return {"time": log[KEYS[0]].time.copy(), **{name: log[name].values.copy() for name in KEYS}}


def csv(path: Path, columns: dict[str, np.ndarray]) -> Path:
    """A CSV file; NaN as "nan"."""
    np.savetxt(path, np.column_stack(list(columns.values())), "%.15g", ",", header=",".join(columns), comments="")
    return path


@pytest.fixture
def good(tmp_path) -> Path:
    return csv(tmp_path / "good.csv", motion())


@pytest.fixture
def can(demo_files):
    """Options that read the demo's CAN trace."""
    return ("--dbc", demo_files.dbc, "--names", demo_files.names)


class TestHelp:
    def test_every_command_has_help(self, run):
        for command in (
            (), ("demo",), ("info",), ("estimate",), ("check",), ("check", "vehicle"), ("check", "names"), ("export",),
            ("export", "c"), ("identify",), ("identify", "brake"), ("identify", "pedal"), ("identify", "ratio"), ("reproduce",),
            ("simulate",), ("simulate", "road-test"), ("simulate", "track"), ("smooth",), ("tune",), ("style",),
        ):  # fmt: skip
            ran = run(*command, "--help")
            assert ran.code == 0
            assert "Usage: codriver" in ran.out

    def test_version(self, run):
        assert run("--version").out == f"codriver {cd.__version__}\n"

    @pytest.mark.parametrize(
        "arguments", [("frobnicate",), ("estimate",), ("estimate", "kinematic"), ("info",), ("info", "--rate"), ()]
    )
    def test_misuse_is_2(self, run, arguments):
        assert run(*arguments).code == 2

    def test_as_a_program(self, good):
        """The installed entry point, once."""
        done = subprocess.run(
            [sys.executable, "-c", "from codriver.cli import main; main()", "info", str(good), "--json"],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == 0
        assert done.stderr == ""
        assert json.loads(done.stdout)["best"]["intent"] == "kinematic"


class TestInfo:
    def test_table(self, run, demo_files, can):
        ran = run("info", demo_files.log, *can, "--vehicle", "bisoffi2017")
        assert ran.code == 0
        assert "BLF, CAN trace, 180.0 s" in ran.out
        assert "best available for intent: intent-pedals" in ran.out
        assert "Brakes.BRK_MasterCylinder" in ran.out
        assert "1 gap, the longest 1.22 s" in ran.out

    def test_json(self, run, demo_files, can):
        ran = run("info", demo_files.log, *can, "--json")
        told = ran.summary
        assert ran.err == ""
        assert told["best"] == {"intent": "kinematic", "driver-torque": None, "motorcycle": None}
        assert told["best_with_a_vehicle"]["intent"] == "intent-pedals"
        assert {s["name"] for s in told["signals"]} >= {*KEYS, "gear", "brake_pressure"}
        pedals = next(e for e in told["estimators"] if e["name"] == "intent-pedals")
        assert pedals["signals_there"]
        assert not pedals["possible"]

    def test_nothing_mapped_begins_a_names_file(self, run, demo_files, tmp_path):
        """What `info` prints for a log without standard names is itself a names file that works."""
        ran = run("info", demo_files.log, "--dbc", demo_files.dbc)
        assert ran.code == 0
        assert "no channel has a standard name" in ran.out
        assert "Dynamics.ESC_AccelX" in ran.out
        start = ran.out.index("  [longitudinal_speed]")
        (tmp_path / "begun.toml").write_text(ran.out[start : ran.out.index("not mapped")])
        assert run("check", "names", tmp_path / "begun.toml").code == 0
        told = run(
            "info", demo_files.log, "--dbc", demo_files.dbc, "--names", tmp_path / "begun.toml", "--json"
        ).summary
        assert [s["name"] for s in told["signals"]] == ["longitudinal_speed", "steering_wheel_angle"]

    def test_a_flag_is_no_speed(self, run, tmp_path):
        """Called a speed, and a flag, a limit, an accuracy: the channel with values is proposed, its flag beside it."""
        n = np.arange(300)
        columns = {
            "time": n / 10, "SpeedValid": n > 20, "SpeedLimit": 50 + 0 * n, "SpeedAccuracy": n % 7 / 7.0, "EngineSpeed": 900.0 + n,
            "CoolingSpeed [rpm]": 10.0 + n, "Speed": 10 + n / 30, "Gear": n % 5,
        }  # fmt: skip
        log = csv(tmp_path / "d.csv", columns)
        text = run("info", log, "--json").summary["names_file_begins"]
        assert 'source = "Speed"  # 300 different values, 10 to 19.97\n' in text
        assert 'unit = "km/h"  # the recording says none: which is it?' in text
        assert 'valid = "SpeedValid"' in text
        (tmp_path / "n.toml").write_text(text)
        told = run("info", log, "--names", tmp_path / "n.toml", "--json").summary
        assert told["signals"][0]["samples"] == 279
        assert "21 of 300 values left out, where SpeedValid is 0" in " ".join(told["faults"])

    def test_no_speed_at_all(self, run, tmp_path):
        columns = {
            "time": np.arange(30.0),
            "Flow [g/s]": np.arange(30.0),
            "Speed": np.arange(30) % 2,
            "a": np.arange(30.0),
        }
        ran = run("info", csv(tmp_path / "d.csv", columns))
        assert "none of the channels looks like the vehicle's speed" in ran.out

    @pytest.mark.parametrize(
        ("gears", "reverse", "severity", "said"),
        [
            ((2, 3, 4, 5), 0, "", ""),
            ((2, 3, 6, 5), 0, "warn", "gear 6, where transmission of the vehicle file has 5 gears: 25."),
            ((2, 3, -1, 0), 0, "warn", "reverse, where the vehicle file has no transmission_reverse: 33."),
            ((2, 3, -1, 0), 30, "", ""),
            ((2, 7, -1, 8), 0, "bad", "gear 7, 8, where transmission of the vehicle file has 5 gears, and reverse"),
        ],
    )
    def test_gears_that_the_vehicle_lacks(self, run, estimate, car, tmp_path, gears, reverse, severity, said):
        columns = motion(40)
        columns["gear"] = np.repeat(np.array(gears, float), 1000)
        columns["engine_torque"] = columns["engine_torque_request"] = 50 + 0 * columns["time"]
        log, vehicle = csv(tmp_path / "gears.csv", columns), tmp_path / "car.toml"
        cd.save_vehicle(car.with_parameter("transmission_reverse", reverse) if reverse else car, vehicle)
        ran = run("info", log, "--vehicle", vehicle, "--json")
        told = ran.summary["findings"]
        assert [f["severity"] for f in told] == [severity] * bool(severity)
        assert all(said in f["text"] for f in told)
        shown = run("info", log, "--vehicle", vehicle).out
        assert (said in shown) if said else ("transmission" not in shown)
        if severity == "warn":
            assert f"{severity}: the log shows {said}" in estimate("intent-torque", log, "--vehicle", vehicle).findings

    def test_a_car_of_one_gear_and_a_log_of_several(self, run, demo_files, can):
        ran = run("info", demo_files.log, *can, "--vehicle", "renault-zoe", "--json")
        assert "has one gear: " in ran.summary["findings"][0]["text"]
        assert ran.summary["findings"][0]["severity"] == "bad"

    def test_a_vehicle_that_lacks_parameters(self, run, demo_files, can):
        ran = run("info", demo_files.log, *can, "--vehicle", "renault-zoe")
        assert "lacks vehicle parameters: pedal_coefficient, brake_coefficient" in ran.out
        assert "best available for intent: intent-torque" in ran.out


class TestEstimate:
    @pytest.mark.parametrize("suffix", [".parquet", ".csv", ".mf4"])
    def test_result_read_back(self, run, demo_files, can, tmp_path, suffix):
        out = tmp_path / f"result{suffix}"
        ran = run("estimate", "intent-pedals", demo_files.log, *can, "--vehicle", "bisoffi2017", "-o", out)
        assert ran.code == 0
        assert "verdict: usable, with 1 warning" in ran.out
        assert "intentional_jerk" in ran.out
        wanted = {
            "intentional_jerk": "m/s^3", "intentional_jerk_sd": "m/s^3", "intentional_acceleration": "m/s^2",
            "input.brake_pressure": "Pa", "input.longitudinal_speed": "m/s",
        }  # fmt: skip
        if suffix == ".parquet":
            table = pq.read_table(out)
            units = {field.name: (field.metadata or {}).get(b"unit", b"").decode() for field in table.schema}
            about = " ".join(f"{k.decode()}={v.decode()}" for k, v in table.schema.metadata.items())
            jerk = table["intentional_jerk"].to_numpy()
        elif suffix == ".csv":
            head = out.read_text().splitlines()[0].replace("]", "").split(",")
            units = dict(column.split(" [") if " [" in column else (column, "") for column in head)
            about = out.with_name(out.name + ".json").read_text()
            index = next(i for i, column in enumerate(head) if column.startswith("intentional_jerk ["))
            jerk = np.genfromtxt(out, delimiter=",", skip_header=1, usecols=index)
        else:
            asammdf = pytest.importorskip("asammdf")
            with asammdf.MDF(out) as file:
                units = {name: file.get(name).unit for name in wanted}
                about = file.header.comment
                jerk = file.get("intentional_jerk").samples
        assert {name: units[name] for name in wanted} == wanted
        for words in ("bisoffi2017", cd.__version__, "intent-pedals", "drive.blf", "verdict"):
            assert words in about
        assert jerk.size == pytest.approx(18000, abs=10)
        assert np.sqrt(np.mean(jerk**2)) == pytest.approx(0.54, abs=0.1)

    def test_results_can_be_read_again_as_logs(self, run, good, tmp_path):
        for suffix in (".parquet", ".csv"):
            out = tmp_path / f"again{suffix}"
            assert run("estimate", "kinematic", good, "-o", out).code == 0
            ran = run("info", out, "--json")
            assert ran.code == 0
            assert "longitudinal_jerk" in {s["name"] for s in ran.summary["signals"]}

    def test_json_is_all_there_is(self, run, good, tmp_path):
        ran = run("estimate", "kinematic", good, "-o", tmp_path / "o.csv", "--json")
        assert ran.err == ""
        assert ran.summary["estimator"] == "kinematic"
        assert ran.summary["verdict"] == "nothing speaks against it"
        assert ran.summary["estimates"]["longitudinal_jerk"]["unit"] == "m/s^3"

    def test_report(self, run, good, tmp_path):
        ran = run("estimate", "kinematic", good, "-o", tmp_path / "o.csv", "--report", tmp_path / "r.html")
        assert ran.code == 0
        assert (tmp_path / "r.html").read_text().lower().startswith("<!doctype html>")
        assert sorted(p.name for p in tmp_path.iterdir()) == ["good.csv", "o.csv", "o.csv.json", "r.html"]

    def test_intent_says_what_it_chose_and_why(self, run, good, demo_files, can, tmp_path):
        ran = run("estimate", "intent", good, "-o", tmp_path / "o.csv")
        assert ran.out.startswith("kinematic on")
        assert "intent-pedals lacks accelerator_pedal, brake_pressure, engine_torque, gear, a vehicle" in ran.out
        ran = run("estimate", "intent", demo_files.log, *can, "-o", tmp_path / "o.csv")
        assert "intent-pedals lacks a vehicle" in ran.out
        ran = run("estimate", "intent", demo_files.log, *can, "--vehicle", "bisoffi2017", "-o", tmp_path / "o.csv")
        assert ran.out.startswith("intent-pedals on")
        assert "chosen as the best this log can feed" in ran.out

    def test_spaces_and_unicode(self, run, demo_files, tmp_path):
        folder = tmp_path / "Fahrt über den Paß 走行"
        folder.mkdir()
        for file in (demo_files.log, demo_files.dbc, demo_files.names):
            shutil.copy(file, folder / f"ein {file.name}")
        ran = run(
            "estimate", "kinematic", folder / "ein drive.blf", "--dbc", folder / "ein car.dbc", "--names",
            folder / "ein names.toml", "-o", folder / "é è.csv", "--report", folder / "berïcht 1.html",
        )  # fmt: skip
        assert ran.code == 0
        assert (folder / "é è.csv").exists()
        assert (folder / "berïcht 1.html").exists()


class TestNothingHalf:
    """With -o, either a whole result appears or none."""

    def left(self, folder: Path) -> list[str]:
        return sorted(p.name for p in folder.iterdir())

    @pytest.mark.parametrize(
        ("out", "report", "words"),
        [
            ("o.xls", None, "'.xls' is no format to write"),
            ("o", None, "no suffix"),
            ("none/o.csv", None, "does not exist"),
            (".", None, "is a folder"),
            ("good.csv", None, "is the recording itself"),
            ("o.csv", "r.pdf", "a name ending in .html"),
            ("o.csv", "none/r.html", "does not exist"),
        ],
    )
    def test_places_that_cannot_be_written(self, run, good, tmp_path, out, report, words):
        before = good.read_bytes()
        more = () if report is None else ("--report", tmp_path / report)
        ran = run("estimate", "kinematic", good, "-o", tmp_path / out, *more)
        assert ran.code == 2
        ran.says(words)
        assert self.left(tmp_path) == ["good.csv"]
        assert good.read_bytes() == before

    @pytest.mark.parametrize("report", [False, True])
    def test_protected_folder(self, run, good, tmp_path, monkeypatch, report):
        """os.access is what is asked; root may write anywhere, so it is told to refuse."""
        kept = tmp_path / "kept"
        kept.mkdir()
        monkeypatch.setattr(os, "access", lambda path, mode: Path(path) != kept)
        out, more = (tmp_path / "o.csv", ("--report", kept / "r.html")) if report else (kept / "o.csv", ())
        ran = run("estimate", "kinematic", good, "-o", out, *more)
        assert ran.code == 2
        assert self.left(tmp_path) == ["good.csv", "kept"]
        assert self.left(kept) == []

    def test_a_folder_that_refuses_late(self, run, good):
        """Linux's /proc says that root may write, and then does not let it."""
        if not Path("/proc/self").exists():
            pytest.skip("no /proc")
        ran = run("estimate", "kinematic", good, "-o", "/proc/o.csv")
        assert ran.code in (1, 2)
        ran.says("/proc")

    @pytest.mark.parametrize(("sent", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
    def test_ended_while_writing(self, run, good, tmp_path, monkeypatch, sent, code):
        write = pq.write_table

        def slow(table, where, **options):
            write(table, where, **options)
            os.kill(os.getpid(), sent)

        monkeypatch.setattr(pq, "write_table", slow)
        ran = run("estimate", "kinematic", good, "-o", tmp_path / "o.parquet", "--report", tmp_path / "r.html")
        assert ran.code == code
        assert "no result was written" in ran.err
        assert self.left(tmp_path) == ["good.csv"]

    def test_a_result_that_fails_takes_its_report_with_it(self, run, good, tmp_path, monkeypatch):
        def full(*arguments, **options):
            raise OSError(28, "No space left on device")

        monkeypatch.setattr(pq, "write_table", full)
        ran = run("estimate", "kinematic", good, "-o", tmp_path / "o.parquet", "--report", tmp_path / "r.html")
        assert ran.code == 1
        ran.says("No space left")
        assert self.left(tmp_path) == ["good.csv"]


class TestMisuse:
    @pytest.mark.parametrize("rate", ["0", "nan", "1e9", "-5", "inf", "abc"])
    def test_rate(self, estimate, good, rate):
        ran = estimate("kinematic", good, "--rate", rate)
        assert ran.code == 2
        assert "--rate" in ran.err

    @pytest.mark.parametrize("ell", ["0", "-1", "nan", "inf", "1e6", "1e-9"])
    def test_ell(self, estimate, good, ell):
        ran = estimate("kinematic", good, "--ell", ell)
        assert ran.code == 2
        ran.says("ell =", "start from 2")

    @pytest.mark.parametrize(
        ("options", "words"),
        [
            (("--preset", "foo"), ("no preset 'foo'", "bisoffi2015")),
            (("--form", "foo"), ("form 'foo'", "'kalman' or 'constant'")),
            (("--vehicle", "bisofi2017"), ("no vehicle is called", "did you mean 'bisoffi2017'")),
            (("--vehicle", "none.toml"), ("cannot read none.toml: No such file", "check the path")),
            (("--dbc", "none.dbc"), ("--dbc none.dbc does not exist",)),
            (("--names", "none.toml"), ("--names none.toml does not exist",)),
        ],
    )
    def test_options(self, estimate, good, options, words):
        ran = estimate("kinematic", good, *options)
        assert ran.code == 2
        ran.says(*words)

    def test_estimator(self, estimate, good):
        ran = estimate("kinematik", good)
        assert ran.code == 2
        ran.says("did you mean 'kinematic'?")

    def test_vehicle_missing(self, estimate, demo_files, can):
        ran = estimate("intent-pedals", demo_files.log, *can)
        assert ran.code == 2
        ran.says("no vehicle", "--vehicle", "kinematic")

    def test_path_that_does_not_exist(self, run, estimate, tmp_path):
        for ran in (estimate("kinematic", tmp_path / "none.blf"), run("info", tmp_path / "none.blf")):
            assert ran.code == 2
            ran.says("none.blf does not exist")

    def test_folder_of_no_known_layout(self, run, estimate, tmp_path):
        for ran in (estimate("kinematic", tmp_path), run("info", tmp_path)):
            assert ran.code == 1
            ran.says("folder of no known layout", "comma2k19", "nuScenes", "convert")

    @pytest.mark.parametrize("name", ["drive.xyz", "drive"])
    def test_no_known_suffix(self, run, tmp_path, name):
        (tmp_path / name).write_text("x")
        ran = run("info", tmp_path / name)
        assert ran.code == 1
        ran.says("suffix", ".blf", ".csv")

    def test_demo_into_a_file(self, run, good):
        ran = run("demo", "--out", good)
        assert ran.code == 2
        ran.says("is a file")


class TestCheck:
    def test_vehicles(self, run):
        ran = run("check", "vehicle", "bisoffi2017")
        assert ran.code == 0
        assert "41, 22, 14, 10, 8" in ran.out
        ran = run("check", "vehicle", "renault-zoe")
        assert "lacks pedal_coefficient, brake_coefficient" in ran.out

    def test_vehicle_with_errors(self, run, tmp_path, estimate, good):
        file = tmp_path / "bad.toml"
        file.write_text('name = "a"\n[mass]\nvalue = 3\nunit = "m"\nsource = "x"\n[mas]\nvalue = 3\n')
        for ran in (run("check", "vehicle", file), estimate("kinematic", good, "--vehicle", file)):
            assert ran.code == 2
            ran.says(
                "'title' is missing", "[mas] is not a parameter (did you mean 'mass' or", "unit 'm' does not measure"
            )

    def test_names(self, run, demo_files):
        ran = run("check", "names", demo_files.names)
        assert ran.code == 0
        assert "Wheels.WHL_SpeedRL + Wheels.WHL_SpeedRR" in ran.out

    def test_names_with_errors(self, run, tmp_path):
        file = tmp_path / "bad.toml"
        file.write_text('[longitudinal_sped]\nsource = "a"\n[gear]\nsource = 3\nscal = 2\n')
        ran = run("check", "names", file)
        assert ran.code == 2
        ran.says("did you mean 'longitudinal_speed'", "unknown key 'scal'", "source must be")

    @pytest.mark.parametrize("kind", ["vehicle", "names"])
    def test_no_toml(self, run, tmp_path, kind):
        (tmp_path / "garbage.toml").write_bytes(bytes(range(256)))
        (tmp_path / "text.toml").write_text("mass: 1500\n")
        (tmp_path / "empty.toml").write_text("")
        for file, words in (
            ("garbage.toml", "is no text"), ("text.toml", "is not TOML"), ("none.toml", "No such file"),
            ("empty.toml", "title' is missing" if kind == "vehicle" else "no signal is mapped"), (".", "directory"),
        ):  # fmt: skip
            ran = run("check", kind, tmp_path / file)
            assert ran.code == 2
            ran.says(words)


class TestExport:
    @pytest.mark.parametrize("real", ["double", "float"])
    def test_compiled_and_checked(self, run, tmp_path, real):
        ran = run("export", "c", "intent-pedals", "--vehicle", "bisoffi2017", "--dt", "0.01", "-o", tmp_path / "c",
                  "--real", real)  # fmt: skip
        assert ran.code == 0
        assert "check it: make" in ran.out
        if not (shutil.which("make") and (shutil.which("cc") or shutil.which("gcc"))):
            pytest.skip("no make or C compiler")
        done = subprocess.run(["make", "-C", tmp_path / "c", "check"], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr

    @pytest.mark.parametrize(
        ("arguments", "words"),
        [
            (("intent", "--dt", "0.01"), "one estimator"),
            (("kinematic", "--dt", "0"), "dt = 0 s"),
            (("kinematic", "--dt", "nan"), "dt = nan"),
            (("kinematic", "--dt", "1e9"), "dt = 1e+09 s"),
            (("pedals-only", "--dt", "0", "--vehicle", "bisoffi2017"), "dt = 0 s"),
            (("pedals-only", "--dt", "nan", "--vehicle", "bisoffi2017"), "dt = nan"),
            (("kinematic", "--dt", "0.01", "--real", "half"), "'double' or 'float'"),
            (("intent-pedals", "--dt", "0.01"), "no vehicle"),
            (("intent-pedals", "--dt", "0.01", "--vehicle", "renault-zoe"), "pedal_coefficient"),
        ],
    )
    def test_misuse(self, run, tmp_path, arguments, words):
        ran = run("export", "c", *arguments, "-o", tmp_path / "c")
        assert ran.code == 2
        ran.says(words)
        assert list(tmp_path.iterdir()) == []

    def test_into_a_file(self, run, good):
        ran = run("export", "c", "kinematic", "--dt", "0.01", "-o", good)
        assert ran.code == 2
        ran.says("is a file")


class TestCanTraces:
    def test_truncated(self, estimate, demo_files, can, tmp_path):
        whole = demo_files.log.read_bytes()
        (tmp_path / "cut.blf").write_bytes(whole[: len(whole) // 2])
        ran = estimate("kinematic", tmp_path / "cut.blf", *can)
        assert ran.code == 0
        assert 60 < ran.summary["duration_s"] < 120
        assert "it was cut off; the frames before the cut are read" in ran.findings

    def test_wrong_database(self, run, estimate, demo_files, tmp_path):
        wrong = tmp_path / "wrong.dbc"
        wrong.write_text('VERSION ""\nBU_: A\nBO_ 1999 Foo: 8 A\n SG_ Bar : 0|8@1+ (1,0) [0|255] "" A\n')
        for ran in (
            estimate("kinematic", demo_files.log, "--dbc", wrong, "--names", demo_files.names),
            run("info", demo_files.log, "--dbc", wrong),
        ):
            assert ran.code == 1
            ran.says("holds none of the messages", "0xC8", "0x7CF", "give the DBC file that belongs to this bus")

    def test_no_database(self, run, estimate, demo_files):
        for ran in (estimate("kinematic", demo_files.log), run("info", demo_files.log)):
            assert ran.code == 1
            ran.says("raw CAN trace of 82350 frames", "give the DBC file of the vehicle with --dbc")

    @pytest.mark.parametrize("content", [bytes(range(256)) * 4, b"", b"VERSION 3\n"])
    def test_no_dbc_at_all(self, estimate, demo_files, tmp_path, content):
        (tmp_path / "bad.dbc").write_bytes(content)
        ran = estimate("kinematic", demo_files.log, "--dbc", tmp_path / "bad.dbc", "--names", demo_files.names)
        assert ran.code == 1
        ran.says("bad.dbc", "a DBC file")
        assert all(c.isprintable() or c == "\n" for c in ran.err)

    def test_names_that_map_nothing_there(self, estimate, demo_files, tmp_path):
        names = tmp_path / "n.toml"
        names.write_text('[longitudinal_speed]\nsource = "Weels.WHL_SpeedRL"\n')
        ran = estimate("kinematic", demo_files.log, "--dbc", demo_files.dbc, "--names", names)
        assert ran.code == 2
        ran.says("no channel 'Weels.WHL_SpeedRL'", "did the names file mean 'Wheels.WHL_SpeedRL'", "codriver info LOG")

    def test_no_names(self, estimate, demo_files):
        ran = estimate("kinematic", demo_files.log, "--dbc", demo_files.dbc)
        assert ran.code == 1
        ran.says("25 channels, none with a standard name", "--names")

    def test_a_bus_that_is_not_there(self, estimate, demo_files, can):
        ran = estimate("kinematic", demo_files.log, *can, "--bus", "7")
        assert ran.code in (1, 2)
        ran.says("7")


class TestEmpty:
    SUFFIXES = (
        "a.blf", "a.asc", "a.trc", "a.log", "a.mf4", "a.mdf", "a.dat", "a.csv", "a.tsv", "a.txt", "a.csv.gz", "a.blf.gz",
        "a.asc.gz", "a.log.gz", "a.trc.gz", "a.parquet", "a.pq", "a.json", "a_pose.json", "a.ibt",
    )  # fmt: skip

    @pytest.mark.parametrize(
        ("name", "content"),
        [(name, b"") for name in SUFFIXES]
        + [(name, gzip.compress(b"", mtime=0)) for name in SUFFIXES if name.endswith(".gz")],
    )
    def test_empty_file(self, run, estimate, demo_files, tmp_path, name, content):
        (tmp_path / name).write_bytes(content)
        for ran in (estimate("kinematic", tmp_path / name, "--dbc", demo_files.dbc), run("info", tmp_path / name)):
            assert ran.code == 1
            ran.says(name)

    @pytest.mark.parametrize(
        "name", ["a.blf", "a.asc", "a.trc", "a.log", "a.mf4", "a.csv", "a.parquet", "a.ibt", "a_pose.json"]
    )
    def test_garbage(self, run, demo_files, tmp_path, name):
        (tmp_path / name).write_bytes(np.random.default_rng(0).bytes(5000))
        ran = run("info", tmp_path / name, "--dbc", demo_files.dbc)
        assert ran.code == 1
        ran.says(name)

    def test_only_a_header(self, estimate, tmp_path):
        (tmp_path / "h.csv").write_text("time," + ",".join(KEYS) + "\n")
        ran = estimate("kinematic", tmp_path / "h.csv")
        assert ran.code == 1
        ran.says("has a header and no rows")

    @pytest.mark.parametrize("rows", [1, 3])
    def test_a_few_rows(self, run, estimate, tmp_path, rows):
        log = csv(tmp_path / "few.csv", {k: v[:rows] for k, v in motion().items()})
        ran = estimate("kinematic", log)
        assert ran.code == 1
        ran.says("no valid moment", "for some seconds at least")
        assert run("info", log).code == 0

    def test_no_time(self, run, estimate, tmp_path):
        columns = motion()
        del columns["time"]
        log = csv(tmp_path / "n.csv", columns)
        for ran in (estimate("kinematic", log), run("info", log)):
            assert ran.code == 1
            ran.says("has no time column", *KEYS, "row number divided by the sampling rate")

    def test_missing_signals(self, estimate, good):
        ran = estimate("intent-pedals", good, "--vehicle", "bisoffi2017")
        assert ran.code == 1
        ran.says("it lacks accelerator_pedal, brake_pressure, engine_torque, gear", "codriver info LOG")


class TestFaultsThatAreFlagged:
    """The rest of the drive is estimated."""

    @pytest.fixture
    def faulty(self, estimate, tmp_path):
        def call(change, *options: object) -> Ran:
            columns = motion()
            change(columns)
            return estimate("kinematic", csv(tmp_path / "f.csv", columns), *options)

        return call

    def test_time_backwards(self, faulty):
        def change(c):
            c["time"][1000:1010] = c["time"][1000:1010][::-1].copy()

        ran = faulty(change)
        assert ran.code == 0
        assert "time runs backwards 9 times, by up to 0.01 s; samples sorted by time" in ran.findings
        assert ran.summary["valid_share"] > 0.97

    def test_duplicate_stamps(self, faulty):
        def change(c):
            c["time"][1000:1100] = c["time"][1000]

        ran = faulty(change)
        assert ran.code == 0
        assert "99 samples share a time stamp" in ran.findings

    def test_some_nan(self, faulty):
        def change(c):
            c["longitudinal_acceleration"][1000:1400] = np.nan

        ran = faulty(change)
        assert ran.code == 0
        assert "400 of 3000 values are not numbers; they are taken as missing" in ran.findings

    @pytest.mark.parametrize("name", KEYS)
    @pytest.mark.parametrize("estimator", ["kinematic", "intent"])
    def test_a_column_of_nan(self, estimate, tmp_path, name, estimator):
        columns = motion()
        columns[name][:] = np.nan
        ran = estimate(estimator, csv(tmp_path / "f.csv", columns))
        assert ran.code == 1
        ran.says(f"{name}: holds no number", "lacks")

    def test_stuck_for_a_while(self, faulty):
        def change(c):
            c["longitudinal_acceleration"][1000:2000] = c["longitudinal_acceleration"][1000]

        ran = faulty(change)
        assert ran.code == 0
        assert "shows one value for 10 s from 10.00 s on; stuck sensor?" in ran.findings

    def test_stuck_all_the_time(self, faulty):
        ran = faulty(lambda c: c["longitudinal_acceleration"].fill(0.3))
        assert "bad: the accelerometer shows 0.3 m/s^2 all the time" in ran.findings

    def test_wrong_sign(self, faulty):
        ran = faulty(lambda c: np.negative(c["longitudinal_acceleration"], out=c["longitudinal_acceleration"]))
        assert "bad: " in ran.findings
        assert "set sign = -1 in the names file" in ran.findings

    @pytest.mark.parametrize(
        ("name", "factor", "words"),
        [
            ("longitudinal_speed", 3.6, "the speed looks like km/h read as m/s"),
            ("longitudinal_speed", 1 / 3.6, "the speed looks like m/s read as km/h"),
            ("longitudinal_acceleration", 1 / 9.80665, "the accelerometer looks like g read as m/s^2"),
        ],
    )
    def test_wrong_unit(self, faulty, name, factor, words):
        ran = faulty(lambda c: np.multiply(c[name], factor, out=c[name]))
        assert ran.code == 0
        assert words in ran.findings
        assert "do not trust it as it is" in ran.summary["verdict"]

    def test_unit_in_the_names_file(self, estimate, tmp_path):
        """The mistake itself: the bus says km/h, the names file m/s."""
        columns = {("v" if k == "longitudinal_speed" else k): v for k, v in motion().items()}
        columns["v"] *= 3.6
        names = tmp_path / "n.toml"
        text = '[longitudinal_acceleration]\nsource = "longitudinal_acceleration"\n[longitudinal_speed]\nsource = "v"\n'
        for unit, found in (("m/s", True), ("km/h", False)):
            names.write_text(f'{text}unit = "{unit}"\n')
            ran = estimate("kinematic", csv(tmp_path / "f.csv", columns), "--names", names)
            assert ("km/h read as m/s" in ran.findings) == found

    def test_speed_comes_late(self, faulty):
        def change(c):
            c["longitudinal_speed"][:900] = np.nan

        ran = faulty(change)
        assert ran.code == 0
        assert "longitudinal_speed: begins 9.0 s after the first of the signals" in ran.findings
        assert "before the first speed or not settled" in ran.findings

    def test_codes_for_not_valid(self, faulty):
        def change(c):
            c["longitudinal_acceleration"][5::500] = 64.0
            c["longitudinal_speed"][7::300] = 182.04

        ran = faulty(change)
        assert "6 of 3000 values are 64 m/s^2, out of -20 to 20 m/s^2" in ran.findings
        assert "values are 182.04 m/s" in ran.findings
        assert ran.summary["estimates"]["longitudinal_jerk"]["rms"] == pytest.approx(0.354, abs=0.02)

    def test_standing_all_the_time(self, estimate, tmp_path):
        columns = motion()
        columns["longitudinal_speed"][:] = 0
        ran = estimate("kinematic", csv(tmp_path / "f.csv", columns))
        assert ran.code == 1
        ran.says("standing 100%", "the vehicle moves")

    def test_time_since_1970(self, faulty):
        ran = faulty(lambda c: np.add(c["time"], 1.7e9, out=c["time"]))
        assert ran.code == 0
        assert ran.summary["duration_s"] == pytest.approx(30, abs=0.05)


class TestClocks:
    """One signal has stamps since 1970, the others since the start."""

    def mixed(self, path: Path, shifted: str, names: tuple[str, ...]) -> Path:
        asammdf = pytest.importorskip("asammdf")
        columns = motion()
        with asammdf.MDF(version="4.10") as file:
            for name in names:
                time = columns["time"] + (1e9 if name == shifted else 0.0)
                values = columns.get(name, np.linspace(0, 0.1, time.size))
                file.append([asammdf.Signal(values, time, name=name)])
            file.save(path, overwrite=True)
        return path

    def test_a_signal_that_is_needed(self, run, estimate, tmp_path):
        log = self.mixed(tmp_path / "m.mf4", KEYS[1], KEYS)
        ran = estimate("kinematic", log)
        assert ran.code == 1
        ran.says("longitudinal_speed ends at 29.99 s", "longitudinal_acceleration begins at 1000000000 s", "two clocks")
        assert run("info", log).out.count("another clock") == 2

    def test_a_signal_that_is_not(self, estimate, tmp_path):
        log = self.mixed(tmp_path / "m.mf4", "yaw_rate", (*KEYS, "yaw_rate"))
        ran = estimate("kinematic", log)
        assert ran.code == 0
        assert ran.summary["duration_s"] == pytest.approx(30, abs=0.05)
        assert "yaw_rate: its stamps go from 1000000000" in ran.findings


class TestField:
    """What goes wrong in the field with pedals and torque, on the demo's signals."""

    @pytest.fixture
    def drive(self, demo, estimate, tmp_path):
        def call(change) -> Ran:
            wanted = ("accelerator_pedal", "brake_pressure", "engine_torque", "gear", *KEYS)
            grid = demo.measured.sample([*wanted, "clutch"], 0.02, start=1.0, stop=100.0)
            columns = {name: grid.values[name].copy() for name in (*wanted, "clutch")}
            change(columns)
            log = tmp_path / "f.parquet"
            write_table(log, grid.time, [Column(name, values) for name, values in columns.items()])
            return estimate("intent-pedals", log, "--vehicle", "bisoffi2017")

        return call

    def test_all_well(self, drive):
        ran = drive(lambda c: None)
        assert ran.code == 0
        assert "bad" not in ran.findings

    def test_pedal_in_counts(self, drive):
        ran = drive(lambda c: np.multiply(c["accelerator_pedal"], 255, out=c["accelerator_pedal"]))
        assert "bad: accelerator_pedal" in ran.findings
        assert "counts?" in ran.findings

    def test_pedal_in_percent(self, drive):
        ran = drive(lambda c: np.multiply(c["accelerator_pedal"], 100, out=c["accelerator_pedal"]))
        assert 'unit = "%" in the names file' in ran.findings

    def test_brake_rests_at_one_bar(self, drive):
        ran = drive(lambda c: np.add(c["brake_pressure"], 1e5, out=c["brake_pressure"]))
        assert "bad: the driver seems to brake for 100% of the valid time" in ran.findings
        assert "subtract it: offset in the names file" in ran.findings

    def test_gear_codes(self, drive):
        def change(c):
            c["gear"][c["clutch"] > 0.05] = 15

        ran = drive(change)
        assert "values are 15, out of -1 to 12" in ran.findings
        assert ran.summary["valid_share"] > 0.8

    def test_torque_ten_times_too_large(self, drive):
        ran = drive(lambda c: np.multiply(c["engine_torque"], 10, out=c["engine_torque"]))
        assert "bad: what the powertrain adds to the driver's request is" in ran.findings


@pytest.mark.slow
def test_demo(run, tmp_path):
    ran = run("demo", "--out", tmp_path / "demo")
    assert ran.code == 0
    names = {"car.dbc", "drive.blf", "estimate.parquet", "logger.csv", "names.toml", "report.html", "truth.parquet"}
    assert {p.name for p in (tmp_path / "demo").iterdir()} == names
    assert "$ codriver estimate intent " in ran.out
    assert "against the simulated truth" in ran.out
    about = pq.read_schema(tmp_path / "demo" / "estimate.parquet").metadata
    assert about[b"command"].startswith(b"codriver estimate intent ")
    line = next(line for line in ran.out.splitlines() if line.startswith("intentional jerk, lag taken out"))
    assert float(line.split()[5]) < 0.2


def test_a_loggers_abbreviation_is_proposed(run, demo_files):
    """The demo's logger calls the speed VehSpd."""
    ran = run("info", demo_files.logger)
    assert 'source = "VehSpd"' in ran.out


SINE = np.sin(np.arange(600) / 50)
NOISE = np.random.default_rng(0).standard_normal(600)


@pytest.mark.parametrize(
    ("columns", "proposed"),
    [
        (
            {"WheelAngle": 30 * SINE, "FFB_Cmd": SINE / 5, "Speed": 20 + 0 * SINE},
            {"longitudinal_speed": ("Speed", "km/h"), "steering_wheel_angle": ("WheelAngle", "deg"),
             "steering_motor_command": ("FFB_Cmd", "1")},
        ),
        (
            {"SteeringWheelAngle": 3 * SINE, "SteerTorque": NOISE, "VehicleSpeed": 20 + SINE, "EPS_Motor_Torque": 2 * NOISE,
             "AlignTorque": 3 * SINE, "SteeringWheelAngleRate": NOISE, "SteerTorqueValid": SINE > 0, "EngineTorque": 30 * SINE},
            {"longitudinal_speed": ("VehicleSpeed", "km/h"), "steering_wheel_angle": ("SteeringWheelAngle", "rad"),
             "steering_wheel_torque": ("SteerTorque", "N*m"), "steering_motor_torque": ("EPS_Motor_Torque", "N*m"),
             "alignment_torque": ("AlignTorque", "N*m")},
        ),
        (
            {"Lenkradwinkel [deg]": 3 * SINE, "Lenkmoment": NOISE, "Geschwindigkeit": 20 + SINE},
            {"longitudinal_speed": ("Geschwindigkeit", "km/h"), "steering_wheel_angle": ("Lenkradwinkel [deg]", "deg"),
             "steering_wheel_torque": ("Lenkmoment", "N*m")},
        ),
        (
            {"steering_angle": 3 * SINE, "torque": NOISE, "speed": 20 + SINE},
            {"longitudinal_speed": ("speed", "km/h"), "steering_wheel_angle": ("steering_angle", "rad"),
             "steering_wheel_torque": ("torque", "N*m")},
        ),
        (  # a torque of the powertrain, a wheel of the car, a target, a flag, a raw count
            {"steering_angle_target": 3 * SINE, "steering_angle": 30 * SINE, "torque": NOISE, "motor_torque": NOISE,
             "engine_rpm": 900 + SINE, "wheel_angle_fl": NOISE, "SteerTorque": SINE > 0, "EPS_Torque": 2000 + 500 * SINE,
             "Speed": 9 + SINE},
            {"longitudinal_speed": ("Speed", "km/h"), "steering_wheel_angle": ("steering_angle", "deg")},
        ),
    ],
)  # fmt: skip
def test_the_steering_is_proposed(run, tmp_path, columns, proposed):
    """By name, unit and values, never a flag; and what is proposed is a names file that works."""
    log = csv(tmp_path / "d.csv", {"time": np.arange(600) / 50, **columns})
    text = run("info", log, "--json").summary["names_file_begins"]
    told = {name: (entry["source"], entry["unit"]) for name, entry in tomllib.loads(text).items()}
    assert told == proposed
    (tmp_path / "n.toml").write_text(text)
    signals = run("info", log, "--names", tmp_path / "n.toml", "--json").summary["signals"]
    assert {s["name"] for s in signals} == set(proposed)
    for line in text.splitlines():
        if line.startswith('unit = "deg"') and "[deg]" not in text:
            assert line.endswith("the recording says none: 30 cannot be rad")
