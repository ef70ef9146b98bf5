"""Known layouts, on real recordings: they need no names file, and their signs and units fit each other."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from codriver import errors
from codriver.logs import open_recording, read
from codriver.signals import Log

DATA = Path("../shared/data")
COMMA = DATA / "comma2k19-rav4"
NUSCENES = DATA / "nuscenes-zoe-scene-0103"
IRACING = DATA / "iracing" / "amg.ibt"
UDACITY = DATA / "udacity-lincoln-mkz"


def needs(path: Path) -> pytest.MarkDecorator:
    return pytest.mark.skipif(not path.exists(), reason=f"the recording {path} is not here")


def smooth(values: np.ndarray, count: int) -> np.ndarray:
    return np.convolve(np.pad(values, count // 2, mode="edge"), np.ones(count) / count, "valid")


class Means:
    """The signals of a log as running means on a common tick, with the ends cut off."""

    def __init__(self, log: Log, seconds: float) -> None:
        speed = log["longitudinal_speed"]
        self.time = np.arange(speed.time[0], speed.time[-1], 0.02)
        self.log, self.count = log, 2 * int(seconds / 0.04) + 1

    def __getitem__(self, name: str) -> np.ndarray:
        signal = self.log[name]
        return smooth(np.interp(self.time, signal.time, signal.values), self.count)[50:-50]

    def slope(self, name: str) -> np.ndarray:
        signal = self.log[name]
        values = smooth(np.interp(self.time, signal.time, signal.values), self.count)
        return np.gradient(values, self.time)[50:-50]


def alike(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.corrcoef(a, b)[0, 1])


@needs(COMMA)
@pytest.mark.parametrize("folder", [COMMA, COMMA / "processed_log"])
def test_comma2k19_without_a_database(folder: Path) -> None:
    log = read(folder)
    means = Means(log, 1.0)
    assert alike(means["longitudinal_acceleration"], means.slope("longitudinal_speed")) > 0.7
    assert alike(means["lateral_acceleration"], means["longitudinal_speed"] * means["yaw_rate"]) > 0.7
    assert alike(means["steering_wheel_angle"], means["yaw_rate"]) > 0.8
    assert np.median(log["vertical_acceleration"].values) == pytest.approx(9.7, abs=0.2)
    assert 0.3 < log["accelerator_pedal"].values.max() < 0.5
    assert np.abs(log["steering_wheel_angle"].values).max() == pytest.approx(np.deg2rad(4.6))


@needs(COMMA)
def test_comma2k19_with_a_database() -> None:
    database = COMMA / "toyota_new_mc_pt_full.dbc"
    log = read(COMMA, dbc=database)
    assert log["longitudinal_acceleration"].source == "KINEMATICS.ACCEL_X"
    means = Means(log, 1.0)
    assert alike(means["longitudinal_acceleration"], means.slope("longitudinal_speed")) > 0.7
    assert alike(means["lateral_acceleration"], means["longitudinal_speed"] * means["yaw_rate"]) > 0.7
    assert alike(means["steering_wheel_angle"], means["yaw_rate"]) > 0.8
    assert alike(means["yaw_rate"], -Means(read(COMMA), 1.0)["yaw_rate"]) < -0.9
    recording = open_recording(COMMA, dbc=database, bus=0)
    assert {"KINEMATICS.YAW_RATE", "CAN/speed", "IMU/gyro.z"} <= set(recording.channels())
    wheel, processed = recording.load(["WHEEL_SPEEDS.WHEEL_SPEED_FL", "CAN/wheel_speed.FL"]).values()
    if wheel.unit != "km/h":
        wheel, processed = processed, wheel
    np.testing.assert_allclose(wheel.values / 3.6, processed.values, atol=1e-9)


def test_comma2k19_that_is_damaged(tmp_path: Path) -> None:
    folder = tmp_path / "processed_log" / "CAN" / "speed"
    folder.mkdir(parents=True)
    (folder / "t").write_bytes(b"no array")
    with pytest.raises(errors.FormatError, match="unpack the segment"):
        read(tmp_path)


@needs(NUSCENES)
def test_nuscenes() -> None:
    log = read(NUSCENES)
    assert any("unwrapped" in fault for fault in log.faults)
    means = Means(log, 0.3)
    assert alike(means["longitudinal_acceleration"], means.slope("longitudinal_speed")) > 0.95
    assert alike(means["lateral_acceleration"], means["longitudinal_speed"] * means["yaw_rate"]) > 0.85
    assert alike(means["steering_wheel_angle"] * means["longitudinal_speed"], means["yaw_rate"]) > 0.9
    assert alike(means["engine_torque"], means.slope("longitudinal_speed")) > 0.9
    assert np.median(log["longitudinal_speed"].values) == pytest.approx(6.5, abs=1)
    request, pedal = log["engine_torque_request"], log["accelerator_pedal"]
    assert alike(request.values, pedal.values) > 0.95
    assert np.abs(np.diff(request.values)).max() < 20
    assert np.flatnonzero(np.diff(log["brake_switch"].values)).size == 2


@needs(NUSCENES)
def test_nuscenes_with_several_scenes(tmp_path: Path) -> None:
    for scene in ("scene-0001", "scene-0002"):
        for message in ("zoe_veh_info", "steeranglefeedback"):
            shutil.copy(NUSCENES / f"scene-0103_{message}.json", tmp_path / f"{scene}_{message}.json")
    with pytest.raises(errors.LogError, match="2 scenes: scene-0001, scene-0002"):
        open_recording(tmp_path)
    recording = open_recording(tmp_path / "scene-0002_steeranglefeedback.json")
    assert "scene-0002" in recording.format
    assert "zoe_veh_info.pedal_cc" in recording.channels()


def test_nuscenes_request_beyond_its_bits(tmp_path: Path) -> None:
    pedal = np.concatenate([np.zeros(10), np.linspace(0, 1000, 300), np.linspace(1000, 0, 100), np.zeros(10)])
    request = np.round((pedal * 0.22 - 29) * 2) / 2
    raw = (request + 16.0) % 128.0 - 16.0 - 384.0
    rows = [
        {"utime": 1_500_000_000_000_000 + 10_000 * k, "pedal_cc": p, "requestedTorqueAfterProc": x}
        for k, (p, x) in enumerate(zip(pedal, raw, strict=True))
    ]
    (tmp_path / "scene-9_zoe_veh_info.json").write_text(json.dumps(rows))
    np.testing.assert_allclose(read(tmp_path)["engine_torque_request"].values, request)


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("settings.json", "{}", "not named like"),
        ("scene-1_pose.json", "{}", "no list of"),
        ("scene-1_pose.json", "[{", "no JSON"),
        ("scene-1_pose.json", "[]", "no message"),
    ],
)
def test_nuscenes_that_is_none(tmp_path: Path, name: str, text: str, says: str) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(errors.LogError, match=says):
        open_recording(tmp_path / name)


@needs(IRACING)
def test_iracing() -> None:
    log = read(IRACING)
    names = ("longitudinal_speed", "longitudinal_acceleration", "lateral_acceleration", "yaw_rate", "lateral_velocity")
    speed, along, across, yaw, drift = (log[name].values for name in names)
    time = log["yaw_rate"].time
    moving = (speed > 15) & (np.abs(drift) < 0.06 * speed)
    rate = smooth(np.gradient(speed, time), 9) - yaw * drift
    assert alike(smooth(along, 9)[moving], rate[moving]) > 0.97
    assert alike(smooth(across, 9)[moving], (speed * yaw)[moving]) > 0.9
    assert alike(log["steering_wheel_angle"].values[moving], yaw[moving]) > 0.9
    assert alike(log["steering_wheel_torque"].values[moving], across[moving]) > 0.8
    assert log["accelerator_pedal"].values.min() > -1e-6
    assert log["brake_pressure"].values.max() == pytest.approx(87.8e5, rel=1e-3)
    assert np.median(log["clutch"].values[moving]) == 0
    assert log["clutch"].values[0] == 1  # waiting in neutral
    assert log["engine_speed"].values.max() == pytest.approx(724, rel=1e-2)
    assert not log.faults


@needs(IRACING)
def test_iracing_fast_samples_and_cut_off_files(tmp_path: Path) -> None:
    fast, slow = open_recording(IRACING).load(["SteeringWheelTorque_ST", "SteeringWheelTorque"]).values()
    if fast.values.size < slow.values.size:
        fast, slow = slow, fast
    assert fast.values.size == 6 * slow.values.size
    np.testing.assert_allclose(fast.values[5::6], slow.values)
    np.testing.assert_allclose(fast.time[5::6], slow.time)
    content = IRACING.read_bytes()
    path = tmp_path / "cut.ibt"
    path.write_bytes(content[:-500])
    recording = open_recording(path)
    assert "cut off" in recording.faults[0]
    assert recording.load(["Speed"])["Speed"].values.size == slow.values.size - 1
    for size, says in ((100, "does not begin"), (5000, "within its header"), (52080, "no records")):
        path.write_bytes(content[:size])
        with pytest.raises(errors.LogError, match=says):
            open_recording(path)


@needs(UDACITY)
@pytest.mark.parametrize("file", ["hmb1-20hz.csv", "hmb2-20hz.csv", "hmb6-steering-50hz.csv", "hmb1-with-gps-20hz.csv"])
def test_udacity(file: str) -> None:
    log = read(UDACITY / file, names="tests/names/udacity.toml")
    assert {"longitudinal_speed", "steering_wheel_angle", "steering_wheel_torque"} == set(log)
    assert any("taken as ns" in fault for fault in log.faults)
    angle, torque = log["steering_wheel_angle"], log["steering_wheel_torque"].values
    assert np.ptp(torque) > 1
    if "hmb6" not in file:  # which goes straight
        assert alike(angle.values, torque) > 0.5
