"""What a motorcycle's vehicle file says that cannot be, and a file that was not used."""

from __future__ import annotations

from dataclasses import replace

import pytest
from typer.testing import CliRunner

import codriver as cd
from codriver.cli.app import app
from codriver.models import MotorcycleParameters
from codriver.observers.motorcycle_vehicle import motorcycle_vehicle_findings, static_front_load


def changed(name: str, value: float) -> cd.Vehicle:
    sharp = cd.load_vehicle("sharp1971")
    return replace(sharp, parameters={**sharp.parameters, name: replace(sharp.parameters[name], value=value)})


def test_load_by_masses_and_places():
    """As printed to 0.2 %, and that of the nonlinear machine's load (docs/motorcycle.md)."""
    p = MotorcycleParameters.from_vehicle(cd.load_vehicle("sharp1971"))
    assert abs(static_front_load(p) - 1007.0) < 0.1
    assert abs(static_front_load(p) / p.load - 1) < 0.002
    # All of the front mass at the front contact and none elsewhere: it carries all.
    alone = replace(p, Mr=0.0, e=(p.a - p.t) - p.a, eps=0.0, f=0.0)
    assert abs(static_front_load(alone) - p.g * p.Mf) < 1e-9


@pytest.mark.parametrize(("name", "value", "severity", "said"), [
    ("front_wheel_load", 102.5, "bad", "masses and places give 1007 N"),
    ("rear_frame_mass", 245.0, "warn", "front_wheel_load is 1005 N"),
    ("normal_trail", -0.1, "warn", "normal_trail is -0.1 m"), ("rear_axle_distance", 1.2, "bad", "front_wheel_load"),
])  # fmt: skip
def test_what_cannot_be(name, value, severity, said):
    findings = motorcycle_vehicle_findings(changed(name, value), {"vehicle": "x"})
    assert any(f.severity == severity and said in f.text for f in findings)


def test_sound_files():
    for name in ("sharp1971", "bisoffi2017", "pasma2024"):
        assert motorcycle_vehicle_findings(cd.load_vehicle(name), {}) == []


def test_a_file_that_was_not_used():
    (car,) = motorcycle_vehicle_findings(cd.load_vehicle("bisoffi2017"), {"form": "kalman"})
    assert "was not used: it is no motorcycle's" in car.text
    sharp = cd.load_vehicle("sharp1971")
    short = replace(sharp, parameters={k: p for k, p in sharp.parameters.items() if k != "normal_trail"})
    (lacks,) = motorcycle_vehicle_findings(short, {"form": "kalman"})
    assert "lacks normal_trail of a motorcycle's parameters" in lacks.text
    assert motorcycle_vehicle_findings(cd.load_vehicle("pasma2024"), {"vehicle": "pasma2024"}) == []


def test_lists_of_another_kind_of_vehicle_are_short():
    ran = CliRunner().invoke(app, ["check", "vehicle", "bisoffi2017"])
    assert ran.exit_code == 0
    line = next(line for line in ran.output.splitlines() if "motorcycle-kalman" in line)
    assert "23 more: another kind of vehicle?" in " ".join(ran.output.split())
    assert len(line) < 160


def test_a_vehicle_in_the_place_of_a_log():
    ran = CliRunner().invoke(app, ["info", "sharp1971"])
    assert ran.exit_code != 0
    assert "sharp1971 is a built-in vehicle" in str(ran.output) + str(ran.exception)
