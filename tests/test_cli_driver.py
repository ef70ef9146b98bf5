"""codriver driver: fit, evaluate, compare, predict and export, as a user meets them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

from codriver.cli.app import app
from codriver.cli.driver_words import evaluation_told
from codriver.drivers.learned.driver_file import load_driver
from codriver.drivers.learned.evaluate import evaluate as judge
from codriver.drivers.learned.protocol import Protocol
from codriver.errors import CodriverError
from codriver.report.document import Table
from codriver.report.drivers import FULL, evaluation_document
from codriver.simulate.circuit import CircuitSetting
from codriver.simulate.circuit_drivers import circuit_driver
from codriver.simulate.circuit_files import write_circuit
from codriver.simulate.variability import Variability
from driven import driven


@pytest.fixture(scope="module")
def laps(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A lap each of two drivers, and a second lap of the first."""
    folder = tmp_path_factory.mktemp("laps")
    for name, driver, seed in (("anna", "anna", 1), ("anna2", "anna", 2), ("carla", "carla", 3)):
        setting = CircuitSetting(driver=circuit_driver(driver), variability=Variability(), laps=1, direction="left")
        write_circuit(folder / name, setting, seed=seed)
        (folder / name / "drive.csv").rename(folder / f"{name}.csv")
    return folder


def ran(*words: object) -> str:
    """What a command says; it must end well."""
    done = CliRunner().invoke(app, [str(word) for word in words], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return done.output


def names(laps: Path) -> tuple[str, Path]:
    """The names file's option."""
    return "--names", laps / "anna" / "names.toml"


def test_from_drives_to_a_driver_to_torques_foretold(laps: Path, tmp_path: Path) -> None:
    driver, report = tmp_path / "anna.driver", tmp_path / "anna.html"
    said = ran("driver", "fit", laps / "anna.csv", *names(laps), "--model", "ridge", "-o", driver, "--report", report)
    assert "anna: ridge learnt from anna" in said
    assert "left out, since the drives lack it: lateral_acceleration" in said
    page = report.read_text()
    assert "How anna steers" in page
    assert "learnt from" in page
    out = tmp_path / "foretold.parquet"
    own = json.loads(ran("driver", "predict", driver, laps / "anna.csv", *names(laps), "-o", out, "--json"))
    assert ["one that anna learnt from" in found["text"] for found in own["findings"]] == [True]
    told = json.loads(ran("driver", "predict", driver, laps / "anna2.csv", *names(laps), "-o", out, "--json"))
    assert told["findings"] == []
    table = pq.read_table(out)
    assert table.num_rows == told["rows"]
    mean, then = (table[name].to_numpy() for name in ("driver_torque_ahead", "driver_torque_then"))
    assert np.sqrt(np.nanmean((mean - then) ** 2)) == pytest.approx(told["rmse_Nm"])
    assert told["rmse_Nm"] < 0.9 * told["stays_rmse_Nm"]
    assert 0.85 < told["inside95"] < 1


def test_signals_of_ones_own_choice(laps: Path, tmp_path: Path) -> None:
    driver = tmp_path / "anna.driver"
    command = ("driver", "fit", laps / "anna.csv", *names(laps), "--model", "ridge", "-o", driver)
    told = json.loads(ran(*command, "--signals", "steering_wheel_angle,road_curvature", "--json"))
    assert told["signals"] == ["steering_wheel_angle", "road_curvature", "longitudinal_speed"]
    assert told["left_out"] == []
    done = CliRunner().invoke(app, [str(word) for word in (*command, "--overwrite", "--signals", "steering_angel")])
    assert isinstance(done.exception, CodriverError)
    assert "standard names" in str(done.exception)


def test_a_driver_is_replaced_only_if_one_says_so(laps: Path, tmp_path: Path) -> None:
    driver, report = tmp_path / "anna.driver", tmp_path / "anna.html"
    command = ("driver", "fit", laps / "anna.csv", *names(laps), "--model", "pwc", "-o", driver)
    ran(*command)
    first = driver.read_bytes()
    with pytest.raises(CodriverError, match=r"is there already[^$]*--overwrite"):
        ran(*command, "--name", "another", "--report", report)
    assert driver.read_bytes() == first
    assert not report.exists()
    ran(*command, "--name", "another", "--overwrite")
    assert load_driver(driver).name == "another"
    driver.write_text("{}")
    with pytest.raises(CodriverError, match="driver file"):
        ran(*command, "--overwrite")
    assert driver.read_text() == "{}"


def test_a_gp_is_told_to_have_no_step(laps: Path, tmp_path: Path) -> None:
    few = ("--set", "inducing=20", "--set", "searched=100")
    said = "a gp cannot run sample by sample"
    for model, options, noted in (("gp", few, True), ("ridge", (), False)):
        command = ("driver", "fit", laps / "anna.csv", *names(laps), "--model", model, *options)
        told = json.loads(ran(*command, "-o", tmp_path / f"{model}.driver", "--json"))
        assert any(said in note for note in told["notes"]) is noted
    gp = ("driver", "fit", laps / "anna.csv", *names(laps), "--model", "gp", *few)
    assert said in ran(*gp, "-o", tmp_path / "gp.driver", "--overwrite")


def test_evaluate_holds_drives_out_and_says_who_wins(laps: Path, tmp_path: Path) -> None:
    report = tmp_path / "judged.html"
    command = ("driver", "evaluate", laps / "anna.csv", laps / "anna2.csv", *names(laps), "--model", "ridge", "--both")
    told = json.loads(ran(*command, "--report", report, "--json"))
    assert told["protocols"]["honest"]["folds"] == ["anna", "anna2"]
    assert told["protocols"]["paper2019"]["folds"] == ["A", "B", "C", "D"]
    honest, paper = (told["protocols"][n]["models"]["ridge"]["ratio_to_pwc"] for n in ("honest", "paper2019"))
    assert paper < 0.5 * honest < 0.5
    assert any("beats pwc" in f["text"] for f in told["findings"])
    page = report.read_text()
    assert "What the leak is worth" in page
    assert "inverse dynamics" in page
    assert (told["lead"], told["protocols"]["honest"]["models"]["ridge"]["against"]["pwc"]) == ("ridge", "better")
    assert {f["severity"] for f in told["findings"] if "leak" in f["text"]} == {"bad"}
    said = ran("driver", "evaluate", laps / "anna.csv", *names(laps), "--model", "ridge", "--folds", "2")
    assert "held out in turn: A, B" in said
    assert "verdict" in said


def test_a_verdict_on_many_models_is_on_one_and_a_table() -> None:
    options = {"boosting": {"trees": 5}, "guarded": {"trees": 5}}
    protocol = Protocol(folds=2).with_features(dense=False)
    judged = judge({"anna": driven()}, tuple(options), protocol=protocol, options=options, calibrate=False)
    told = evaluation_told([judged], ["anna"], [], None)
    assert told["lead"] == "guarded"
    assert any("guarded beats pwc" in f["text"] for f in told["findings"])
    assert not any("boosting" in f["text"] for f in told["findings"])
    assert told["protocols"]["honest"]["models"]["boosting"]["against"]["pwc"] == "better"
    first = evaluation_document([judged], ["anna"], []).sections[0]
    assert first.title == "Verdict on guarded"
    table = next(part for part in first.parts if isinstance(part, Table))
    assert [row[0] for row in table.rows] == [FULL[kind] for kind in judged.kinds]


def test_error_against_horizon(laps: Path, tmp_path: Path) -> None:
    report, vehicle = tmp_path / "horizon.html", laps / "anna" / "vehicle.toml"
    command = ("driver", "horizon", laps / "anna.csv", laps / "anna2.csv", *names(laps), "--model", "ridge")
    told = json.loads(ran(*command, "--horizons", "0.2,1", "--vehicle", vehicle, "--report", report, "--json"))
    made = {(row["model"], row["form"]): row["rmse_Nm"] for row in told["models"]}
    assert list(made) == [("pwc", "direct"), ("pwl", "direct"), ("ridge", "direct"), ("ridge", "iterated")]
    assert made["ridge", "direct"][1] < 0.5 * made["pwc", "direct"][1]
    assert told["held_out"] == ["anna", "anna2"]
    bands = {(row["model"], row["form"]): row["inside95"] for row in told["models"]}
    assert bands.pop(("ridge", "iterated")) is None
    assert all(len(shares) == 2 and 0.5 < min(shares) <= max(shares) <= 1 for shares in bands.values())
    assert "in the 95 % band of" in report.read_text()
    assert "Forecasts, one a second" in report.read_text()
    said = ran(*command, "--horizons", "0.5", "--vehicle", "okamoto2019-simulator")
    assert "not iterated: " in said
    assert "0.5 s" in said
    assert "in the 95 % band" in said
    done = CliRunner().invoke(app, ["driver", "horizon", str(laps / "anna.csv"), "--horizons", "0.2,later"])
    assert isinstance(done.exception, CodriverError)
    assert "positive numbers" in str(done.exception)


def test_compare_names_the_driver(laps: Path, tmp_path: Path) -> None:
    for name in ("anna", "carla"):
        ran("driver", "fit", laps / f"{name}.csv", *names(laps), "--model", "ridge", "-o", tmp_path / f"{name}.driver")
    stored = (tmp_path / "carla.driver", tmp_path / "anna.driver")
    told = json.loads(ran("driver", "compare", laps / "anna2.csv", *stored, *names(laps), "--json"))
    assert [one["name"] for one in told["drivers"]] == ["anna", "carla"]
    assert sum(one["share"] for one in told["drivers"]) == pytest.approx(1)
    assert told["findings"] == []
    assert "anna" in ran("driver", "compare", laps / "anna2.csv", *stored, *names(laps)).splitlines()[0]
    assert "one that anna learnt from" in ran("driver", "compare", laps / "anna.csv", *stored, *names(laps)).replace(
        "\n", " "
    )


def test_export_writes_c(laps: Path, tmp_path: Path) -> None:
    driver = tmp_path / "anna.driver"
    ran("driver", "fit", laps / "anna.csv", *names(laps), "--model", "ann", "--set", "restarts=1", "-o", driver)
    assert "wrote" in ran("driver", "export", driver, "-o", tmp_path / "c")
    assert {p.suffix for p in (tmp_path / "c").iterdir()} >= {".c", ".h"}


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--model", "deep"), "kind 'deep'"), (("--protocol", "mine"), "--protocol mine"), (("--set", "alpha"), "NAME=VALUE"),
        (("--set", "layers=3"), "no parameter layers"), (("--horizon", "0.15"), "whole number of ticks"),
        (("-o", "anna.txt"), "ending in .driver"), (("--names", "none.toml"), "does not exist"),
        (("--set", "alpha=-1"), "ridge with alpha = -1"), (("--model", "guarded", "--set", "trees=0"), "guarded with trees = 0"),
    ],
)  # fmt: skip
def test_misuse_is_said_before_anything_is_written(laps: Path, tmp_path: Path, words, said: str) -> None:
    fit = ["driver", "fit", str(laps / "anna.csv"), "-o", str(tmp_path / "a.driver"), *map(str, names(laps))]
    model = () if "--model" in words else ("--model", "ridge")
    with pytest.raises(CodriverError, match=said):
        CliRunner().invoke(app, [*fit, *words, *model], catch_exceptions=False)
    assert not list(tmp_path.iterdir())


def test_a_drive_without_torque_says_what_to_do(laps: Path, tmp_path: Path) -> None:
    bare = tmp_path / "bare.csv"
    bare.write_text("t,longitudinal_speed\n" + "".join(f"{k / 10},10\n" for k in range(300)))
    with pytest.raises(CodriverError, match="no torque of the driver") as refused:
        CliRunner().invoke(app, ["driver", "fit", str(bare), "-o", str(tmp_path / "a.driver")], catch_exceptions=False)
    assert "torque sensor" in refused.value.do


def test_a_recording_is_not_replaced_by_what_is_foretold_of_it(laps: Path, tmp_path: Path) -> None:
    driver, drive = tmp_path / "anna.driver", tmp_path / "drive.csv"
    ran("driver", "fit", laps / "anna.csv", *names(laps), "--model", "ridge", "-o", driver)
    drive.write_bytes((laps / "anna2.csv").read_bytes())
    with pytest.raises(CodriverError, match="the recording itself"):
        ran("driver", "predict", driver, drive, *names(laps), "-o", drive)
    assert drive.read_bytes() == (laps / "anna2.csv").read_bytes()


def test_a_wrong_sign_is_told_when_foretelling_and_comparing(laps: Path, tmp_path: Path) -> None:
    known = []
    for who in ("anna", "carla"):
        known.append(tmp_path / f"{who}.driver")
        ran("driver", "fit", laps / f"{who}.csv", *names(laps), "--model", "ridge", "-o", known[-1])
    wrong = tmp_path / "wrong.toml"
    text = (laps / "anna" / "names.toml").read_text()
    wrong.write_text(text.replace('source = "WheelAngle"', 'source = "WheelAngle"\nsign = -1'))
    out = tmp_path / "out.csv"
    for file, doubts in ((wrong, True), (laps / "anna" / "names.toml", False)):
        words = (known[0], laps / "anna2.csv", "--names", file, "-o", out, "--json")
        told = json.loads(ran("driver", "predict", *words))
        assert bool(told["findings"]) == doubts
    assert "none of these" in ran("driver", "compare", laps / "anna2.csv", *known, "--names", wrong)


def test_a_name_is_shown_as_it_is(laps: Path, tmp_path: Path) -> None:
    driver = tmp_path / "anna.driver"
    ran("driver", "fit", laps / "anna.csv", *names(laps), "--model", "pwc", "--name", "anna [/b] [x]", "-o", driver)
    said = ran("driver", "predict", driver, laps / "anna2.csv", *names(laps), "-o", tmp_path / "out.csv")
    assert "anna [/b] [x] (pwc) on" in said


def test_a_driver_of_a_leaking_protocol_says_so_when_he_foretells(laps: Path, tmp_path: Path) -> None:
    driver, words = tmp_path / "anna.driver", ("--model", "ridge", "--protocol", "paper2019")
    ran("driver", "fit", laps / "anna.csv", *names(laps), *words, "-o", driver)
    assert "leak: " in ran("driver", "predict", driver, laps / "anna2.csv", *names(laps), "-o", tmp_path / "out.csv")


def test_both_protocols_are_asked_for_the_same_horizon(laps: Path) -> None:
    words = (laps / "anna.csv", *names(laps), "--model", "ridge", "--json", "--both")
    near, far = (json.loads(ran("driver", "evaluate", *words, "--horizon", h)) for h in ("0.2", "1"))
    for name in ("honest", "paper2019"):
        stays = [told["protocols"][name]["models"]["pwc"]["rmse_Nm"] for told in (near, far)]
        assert stays[1] > 1.5 * stays[0]


def test_a_part_whose_torque_never_changes_is_told_and_does_not_stop_the_rest(laps: Path, tmp_path: Path) -> None:
    still = tmp_path / "still.csv"
    header, *rows = (laps / "anna.csv").read_text().splitlines()
    place = header.split(",").index("WheelTorque")
    quarter = range(len(rows) // 4 - 50, len(rows) // 2 + 50)
    cells = [row.split(",") for row in rows]
    for k in quarter:
        cells[k][place] = "0"
    still.write_text("\n".join([header, *(",".join(row) for row in cells)]) + "\n")
    told = json.loads(ran("driver", "evaluate", still, *names(laps), "--model", "ridge", "--json"))
    assert any("never changes in C" in finding["text"] for finding in told["findings"])


def test_a_recording_given_twice_is_refused(laps: Path, tmp_path: Path) -> None:
    copy = tmp_path / "copy.csv"
    lines = (laps / "anna.csv").read_text().splitlines(keepends=True)
    copy.write_text("".join(lines[: len(lines) * 3 // 4]))
    for words in (("evaluate",), ("fit", "-o", tmp_path / "a.driver")):
        with pytest.raises(CodriverError, match="are the same recording"):
            ran("driver", *words, laps / "anna.csv", copy, *names(laps), "--model", "ridge")
