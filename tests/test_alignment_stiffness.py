"""K_aln of eq. (92): from a simulator's log, from a torque sensor, and the estimate that takes it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import codriver as cd
from codriver.cli import main
from codriver.errors import LogError, MissingSignal, VehicleError
from codriver.identify import identify_alignment_stiffness
from codriver.logs.write import Column, write_table
from codriver.run import estimate_log
from codriver.simulate.rig import RigDrive, RigSetting, simulate_rig
from codriver.vehicles import Vehicle, save_vehicle

SETTING = replace(RigSetting(), seconds=90.0)
CAR = SETTING.car


@pytest.fixture(scope="module")
def drive() -> RigDrive:
    return simulate_rig(SETTING, seed=5)


@pytest.fixture(scope="module")
def car() -> Vehicle:
    made = Vehicle("rig", "rig", "test", {})
    for name, value in {
        "mass": CAR.mass, "yaw_inertia": CAR.inertia, "wheelbase": CAR.front + CAR.rear, "front_axle_distance": CAR.front,
        "front_cornering_stiffness": CAR.front_stiffness, "rear_cornering_stiffness": CAR.rear_stiffness,
        "steering_ratio": CAR.ratio, "steering_inertia": SETTING.wheel.inertia, "steering_damping": SETTING.wheel.damping,
        "steering_friction": SETTING.wheel.friction,
    }.items():  # fmt: skip
        made = made.with_parameter(name, value)
    return made


def without(log: cd.Log, *names: str) -> cd.Log:
    return cd.Log.of([s for s in log.values() if s.name not in names], source=log.source)


def test_from_the_simulators_own_motion(drive, car):
    """The log's sideslip and yaw rate make (92) exact but for the encoder's steps."""
    fit = identify_alignment_stiffness([drive.log()], car)
    assert fit.slip_from == "log"
    assert fit.stiffness == pytest.approx(CAR.alignment, rel=2e-3)
    assert fit.low < CAR.alignment < fit.high or abs(fit.stiffness / CAR.alignment - 1) < 1e-3
    assert fit.held_r2 > 0.9999
    assert fit.findings[0].severity == "ok"


def test_from_angle_and_speed_by_the_single_track(drive, car):
    fit = identify_alignment_stiffness([without(drive.log(), "sideslip_angle", "yaw_rate")], car)
    assert fit.slip_from == "single track"
    assert fit.stiffness == pytest.approx(CAR.alignment, rel=0.01)
    less = Vehicle("x", "x", "x", {k: v for k, v in car.parameters.items() if k != "yaw_inertia"})
    with pytest.raises(VehicleError, match="yaw_inertia"):
        identify_alignment_stiffness([without(drive.log(), "sideslip_angle")], less)


def test_from_a_torque_sensor(drive, car):
    """The driver's torque beside damping and friction of a wheel that nobody identified."""
    sensor = cd.Signal("steering_wheel_torque", drive.time, drive.driver_torque, "N*m", "sensor")
    fit = identify_alignment_stiffness([without(drive.log(), "alignment_torque").with_signals(sensor)], car)
    assert fit.torque_from == "steering_wheel_torque"
    assert fit.stiffness == pytest.approx(CAR.alignment, rel=0.05)
    assert fit.held_r2 > 0.95


def test_the_estimate_that_takes_it(drive, car):
    """Torque from angle and speed alone: nearly as good as with the alignment torque logged."""
    fit = identify_alignment_stiffness([drive.log()], car)
    known = fit.vehicle(car)
    alone = without(drive.log(), "alignment_torque", "steering_motor_command", "sideslip_angle", "yaw_rate")
    errors = {}
    for name, log in (("driver-torque-logged", drive.log()), ("driver-torque-single-track", alone)):
        run = estimate_log(name, log, known)
        e = run.columns["driver_torque"] - drive.driver_torque[: len(run.grid)]
        errors[name] = float(np.sqrt(np.mean(e[100:] ** 2)))
        assert np.mean(np.abs(e[100:]) < 1.96 * run.sd("driver_torque")[100:]) > 0.9
    assert errors["driver-torque-single-track"] < 1.1 * errors["driver-torque-logged"]
    assert estimate_log("driver-torque", alone, known).observer == "driver-torque-single-track"


def test_a_trail_that_shrinks_is_told(drive, car):
    """A torque that saturates over the slip angle is no line."""
    log = drive.log()
    torque = log["alignment_torque"].values
    bent = 1.5 * np.tanh(torque / 1.5)
    found = identify_alignment_stiffness([log.with_signals(replace(log["alignment_torque"], values=bent))], car)
    assert any("falls short of a line" in f.text for f in found.findings)


def test_refusals(drive, car):
    log = drive.log()
    away = replace(log["alignment_torque"], values=-log["alignment_torque"].values)
    with pytest.raises(LogError, match="away from where the car goes"):
        identify_alignment_stiffness([log.with_signals(away)], car)
    with pytest.raises(MissingSignal, match="longitudinal_speed"):
        identify_alignment_stiffness([without(log, "longitudinal_speed")], car)
    slow = replace(log["longitudinal_speed"], values=np.full(drive.time.size, 1.0))
    with pytest.raises(LogError, match="faster than 3 m/s"):
        identify_alignment_stiffness([log.with_signals(slow)], car)
    rng = np.random.default_rng(0)
    noise = replace(log["alignment_torque"], values=rng.standard_normal(drive.time.size))
    with pytest.raises(LogError):
        identify_alignment_stiffness([log.with_signals(noise)], car)


def test_command(drive, car, tmp_path, monkeypatch, capsys):
    log = drive.log()
    write_table(tmp_path / "d.parquet", drive.time, [Column(s.name, s.values, s.unit) for s in log.values()])
    save_vehicle(car, tmp_path / "car.toml")
    words = [
        "identify",
        "alignment-stiffness",
        "d.parquet",
        "--vehicle",
        "car.toml",
        "-o",
        "new.toml",
        "--report",
        "r.html",
    ]
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", ["codriver", *words])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code in (0, None)
    assert "K_aln" in capsys.readouterr().out
    assert cd.load_vehicle(tmp_path / "new.toml").number("alignment_stiffness") == pytest.approx(
        CAR.alignment, rel=2e-3
    )
    assert "Torque over the front slip angle" in (tmp_path / "r.html").read_text()
