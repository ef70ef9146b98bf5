"""What simulate shared says beside its outcomes: what a model or a speed is not made for, and nothing where there is no assist."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from codriver.cli.app import app
from codriver.drivers.learned import Protocol, fit_driver, observer_of, save_driver
from codriver.errors import CodriverError
from driven import driven


def shared(*words: object) -> str:
    """What simulate shared says of one drive of a lap; it must end well."""
    command = ["simulate", "shared", "--drives", "1", "--direction", "left", "--no-variability", *map(str, words)]
    done = CliRunner().invoke(app, command, catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return done.output


@pytest.fixture(scope="module")
def far_ahead(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A driver model of 50 km/h that foretells half a second."""
    path = tmp_path_factory.mktemp("model") / "anna.driver"
    protocol = Protocol().with_features(horizon=0.5)
    save_driver(fit_driver([driven(direction="left")], "ridge", name="anna", protocol=protocol), path)
    return path


def test_a_model_and_a_speed_that_go_ill_together(far_ahead: Path, tmp_path: Path) -> None:
    words = ("-o", tmp_path / "a", "--model", far_ahead, "--gain", 0.2)
    told = json.loads(shared(*words, "--speed", 66, "--json"))
    said = [f["text"] for f in told["findings"] if f["severity"] == "warn"]
    for part in (
        "learnt at 50 km/h on average, and drives at 66 km/h here", "foretells 0.5 s ahead", "m/s2 sideways at 66 km/h",
    ):  # fmt: skip
        assert any(part in text for text in said), part
    # At the model's own speed only what it foretells is told.
    as_text = shared(*words, "--overwrite", "--speed", 51)
    assert "foretells 0.5 s ahead" in as_text
    assert "learnt at" not in as_text
    assert "sideways" not in as_text


def test_no_assist(tmp_path: Path) -> None:
    out = tmp_path / "alone"
    told = json.loads(shared("-o", out, "--assist", "none", "--json"))
    assert list(told["outcomes"]) == ["none"]
    assert (told["gain"], told["model"]) == (None, None)
    assert told["outcomes"]["none"]["foretold"] == {"mean": None, "sd": None}
    assert "MotorTorque" not in (out / "drive.csv").read_text().splitlines()[0]
    assert not any("model" in f["text"] for f in told["findings"])
    assert "anna, no assist; 1 drive" in shared("-o", out, "--assist", "none", "--overwrite")


def test_a_gp_cannot_assist() -> None:
    driver = fit_driver([driven(direction="left")], "gp", name="anna", options={"inducing": 20, "searched": 100})
    with pytest.raises(CodriverError, match="gp"):
        observer_of(driver)
