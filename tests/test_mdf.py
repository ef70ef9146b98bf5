"""MDF: decoded channels, raw bus logging, and files that are damaged."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from codriver import errors
from codriver.logs import open_recording, read

asammdf = pytest.importorskip("asammdf")

CANEDGE = Path("../shared/data/css-canedge-car")
TIME = np.arange(10) * 0.1
needs_canedge = pytest.mark.skipif(not CANEDGE.exists(), reason=f"the recordings in {CANEDGE} are not here")


def signal(name: str, values: object, time: np.ndarray = TIME, **more: object) -> "asammdf.Signal":
    return asammdf.Signal(np.asarray(values), time, name=name, **more)


def write(path: Path, *groups: list, version: str = "4.10") -> Path:
    with asammdf.MDF(version=version) as file:
        for number, group in enumerate(groups):
            file.append(group, acq_name=f"task {number}")
        saved = file.save(path.with_suffix(".mf4" if version >= "4" else ".mdf"), overwrite=True)
    return Path(saved).rename(path)


@pytest.mark.parametrize(("version", "suffix"), [("4.10", ".mf4"), ("3.30", ".mdf"), ("3.30", ".dat")])
def test_decoded_channels(tmp_path: Path, version: str, suffix: str) -> None:
    gears = {"val_0": 0, "text_0": b"P", "val_1": 1, "text_1": b"R", "default": b"?"}
    pressure = signal("pressure", np.arange(10, dtype="i2"), unit="bar", conversion={"a": 0.5, "b": 1.0})
    group = [
        signal("v", np.arange(10.0), unit="km/h", comment="wheel speed"),
        pressure,
        signal("gear", np.arange(10, dtype="u1") % 2, conversion=gears),
    ]
    path = write(tmp_path / f"drive{suffix}", group, version=version)
    recording = open_recording(path)
    channels = recording.channels()
    assert set(channels) == {"v", "pressure", "gear"}
    assert (channels["v"].unit, channels["pressure"].unit) == ("km/h", "bar")
    loaded = recording.load(["v", "pressure", "gear", "nothing"])
    np.testing.assert_allclose(loaded["pressure"].values, 0.5 * np.arange(10) + 1)
    np.testing.assert_allclose(loaded["gear"].values, np.arange(10) % 2)
    np.testing.assert_allclose(loaded["v"].time, TIME)
    assert set(loaded) == {"v", "pressure", "gear"}


def test_groups_text_arrays_and_invalid_samples(tmp_path: Path) -> None:
    invalid = np.zeros(10, bool)
    invalid[3] = True
    first = [
        signal("v", np.arange(10.0), invalidation_bits=invalid),
        signal("text", [b"abc"] * 10, encoding="utf-8"),
        signal("map", np.zeros((10, 4), "u1")),
    ]
    second = [signal("v", np.arange(5.0) * 2, TIME[:5], unit="m/s")]
    path = write(tmp_path / "drive.mf4", first, second)
    recording = open_recording(path)
    assert set(recording.channels()) == {"v", "v@task 1"}
    loaded = recording.load(recording.channels())
    np.testing.assert_allclose(loaded["v"].time, np.delete(TIME, 3))
    np.testing.assert_allclose(loaded["v@task 1"].values, np.arange(5) * 2)


def test_channels_by_standard_names(tmp_path: Path) -> None:
    group = [signal("longitudinal_speed", np.full(10, 36.0), unit="km/h")]
    log = read(write(tmp_path / "drive.mf4", group))
    np.testing.assert_allclose(log["longitudinal_speed"].values, 10.0)


@pytest.mark.parametrize(("unit", "told"), [("m/s", 1), ("km/h", 0)])
def test_a_name_in_two_groups(tmp_path: Path, unit: str, told: int) -> None:
    first = [signal("longitudinal_speed", np.full(10, 10.0), unit="m/s")]
    second = [signal("longitudinal_speed", np.full(10, 36.0), unit=unit)]
    log = read(write(tmp_path / "drive.mf4", first, second))
    np.testing.assert_allclose(log["longitudinal_speed"].values, 10.0)
    faults = [
        fault for fault in log.faults if "'longitudinal_speed@task 1' of the same name with other values" in fault
    ]
    assert len(faults) == told


def test_a_name_among_frames_and_decoded_channels(tmp_path: Path) -> None:
    parts = {"ID": np.full(10, 0x100, "u4"), "DLC": np.full(10, 8, "u1"), "DataBytes": np.ones((10, 8), "u1")}
    frames = [signal(f"CAN_DataFrame.{name}", values) for name, values in parts.items()]
    (tmp_path / "car.dbc").write_text(DBC)
    path = write(tmp_path / "drive.mf4", frames, [signal("Speed.V", np.zeros(10), unit="km/h")])
    recording = open_recording(path, dbc=tmp_path / "car.dbc")
    np.testing.assert_allclose(recording.load(["Speed.V"])["Speed.V"].values, 2.57)
    assert f"'Speed.V' is there more than once; that of {recording.format} is taken" in recording.faults


DBC = """VERSION ""
NS_ :
BS_:
BU_: A
BO_ 256 Speed: 8 A
 SG_ V : 0|16@1+ (0.01,0) [0|655] "km/h" A
BO_ 2566844693 Wide: 8 A
 SG_ X : 0|8@1+ (1,0) [0|255] "" A
"""


@pytest.mark.parametrize("lacking", [(), ("DataLength",), ("IDE",), ("BusChannel", "DataLength")])
def test_raw_frames(tmp_path: Path, lacking: tuple[str, ...]) -> None:
    payload = np.zeros((10, 8), "u1")
    payload[:, 0] = np.arange(10)
    identifier = np.where(np.arange(10) % 2, 0x100, 0x18FEF115 | (0x80000000 if "IDE" in lacking else 0)).astype("u4")
    parts = {
        "BusChannel": np.full(10, 2, "u1"),
        "ID": identifier,
        "IDE": (np.arange(10) % 2 == 0).astype("u1"),
        "DLC": np.full(10, 8, "u1"),
        "DataLength": np.full(10, 8, "u1"),
        "DataBytes": payload,
    }
    frames = [signal(f"CAN_DataFrame.{name}", values) for name, values in parts.items() if name not in lacking]
    decoded = [signal("engine", np.arange(10.0), unit="rpm")]
    database = tmp_path / "car.dbc"
    database.write_text(DBC)
    path = write(tmp_path / "drive.mf4", frames, decoded)
    recording = open_recording(path, dbc=database)
    assert {"Speed.V", "Wide.X", "engine"} <= set(recording.channels())
    loaded = recording.load(["Speed.V", "Wide.X", "engine"])
    np.testing.assert_allclose(loaded["Speed.V"].values, np.arange(1, 10, 2) * 0.01)
    np.testing.assert_allclose(loaded["Wide.X"].values, np.arange(0, 10, 2))
    np.testing.assert_allclose(loaded["Wide.X"].time, TIME[::2])
    assert loaded["engine"].values.size == 10
    if "BusChannel" not in lacking:
        with pytest.raises(errors.LogError, match="bus 7"):
            open_recording(path, dbc=database, bus=7)
    without = open_recording(path)
    assert set(without.channels()) == {"engine"}
    assert "raw CAN frames are left out" in without.faults[0]


def test_nothing_to_read(tmp_path: Path) -> None:
    path = tmp_path / "drive.mf4"
    for content in (b"", b"MDF ", b"time,x\n1,2\n" * 20):
        path.write_bytes(content)
        with pytest.raises(errors.FormatError, match="begins with"):
            open_recording(path)
    write(path, [signal("text", [b"abc"] * 10, encoding="utf-8")])
    with pytest.raises(errors.LogError, match="no numeric channel"):
        open_recording(path)


def test_cut_off_files_are_told_quietly(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    whole = write(tmp_path / "whole.mf4", [signal("v", np.arange(10.0))]).read_bytes()
    path = tmp_path / "cut.mf4"
    for size in (len(whole) - 50, len(whole) // 2, 100):
        path.write_bytes(whole[:size])
        with pytest.raises(errors.FormatError, match="damaged"):
            open_recording(path)
    assert "Traceback" not in capsys.readouterr().err


def test_damaged_data_are_told(tmp_path: Path) -> None:
    noise = np.random.default_rng(1).normal(size=20_000)
    path = tmp_path / "drive.mf4"
    with asammdf.MDF() as file:
        file.append([signal("v", noise, np.arange(20_000) * 0.01)])
        file.save(path, overwrite=True, compression=2)
    content = bytearray(path.read_bytes())
    middle = len(content) // 2
    content[middle : middle + 2000] = bytes(2000)
    path.write_bytes(content)
    recording = open_recording(path)
    assert recording.load(["v"]) == {}
    assert "'v' cannot be read" in recording.faults[0]


@needs_canedge
def test_canedge_needs_a_database() -> None:
    with pytest.raises(errors.LogError, match="45096 frames"):
        open_recording(CANEDGE / "00000001-60FEB68B.MF4")


@needs_canedge
@pytest.mark.parametrize("file", ["00000001-60FEB68B.MF4", "00000002-60FEB8E3.MF4"])
def test_canedge_axes(file: str) -> None:
    log = read(CANEDGE / file, dbc=CANEDGE / "dbc" / "canmod-gps.dbc", names="tests/names/canedge.toml")
    speed, acceleration, yaw, lateral = (
        log[name] for name in ("longitudinal_speed", "longitudinal_acceleration", "yaw_rate", "lateral_acceleration")
    )
    assert acceleration.rate == pytest.approx(100, rel=0.05)

    def means(signal: object) -> np.ndarray:
        edges = np.searchsorted(signal.time, speed.time)
        return np.array([signal.values[i:k].mean() if k > i else np.nan for i, k in pairwise(edges)])

    slope = np.diff(speed.values) / np.diff(speed.time)
    middle = (speed.values[1:] + speed.values[:-1]) / 2
    good = (np.diff(speed.time) < 1.5) & np.isfinite(means(acceleration)) & (middle > 4)
    assert np.corrcoef(means(acceleration)[good], slope[good])[0, 1] > 0.7
    assert np.corrcoef(means(lateral)[good], (middle * means(yaw))[good])[0, 1] > 0.8
    assert np.nanmedian(log["vertical_acceleration"].values) == pytest.approx(9.75, abs=0.2)
