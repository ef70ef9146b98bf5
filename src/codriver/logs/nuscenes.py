"""nuScenes' CAN bus expansion: a Renault Zoe, one JSON file a message and scene, stamps "utime" in microseconds.

A folder holds files such as scene-0103_zoe_veh_info.json; channels are called "zoe_veh_info.pedal_cc",
"ms_imu.rotation_rate.2". A folder with several scenes needs the path of one of its files.

What the numbers mean, found on scene-0103 (19 s; means over 0.3 s):

* Wheel speeds in rpm: 0.0315 m/s per rpm against "vehicle_monitor" (0.999). The mean of all four is taken: the rear
  right wheel alone reads 1.7% more than the rear left, so the rear pair would be off by half of that; slip of the
  driven front wheels does not show (front by rear against acceleration: correlation -0.17, in 0.4%).
* "zoe_veh_info.longitudinal_accel" is m/s^2, positive when speeding up (0.989, slope 1.07 against the wheels' dv/dt).
  "transversal_accel" is in g with an offset of half a g; lateral acceleration is taken from "ms_imu" instead.
* "ms_imu" looks x forward, y left, z up: rotation_rate.2 against the turning of the course to the left +0.96,
  linear_accel.1 against speed times yaw rate +0.92, linear_accel.2 is +9.78 on average.
* "steeranglefeedback.value" is the steering wheel's angle in rad, positive to the left (its product with the speed
  follows the yaw rate by 0.994).
* "pedal_cc" goes from 0 to 1000; "meanEffTorque" is N m (0.95 against dv/dt).
* "requestedTorqueAfterProc" is an 8-bit number in steps of 0.5 N m, so it repeats every 128 N m. The reader adds
  "requestedTorqueAfterProc.unwrapped": (x + 400) - 16, less 128 where that is above 96. While the pedal is pressed it
  is followed from sample to sample, so that requests beyond 96 N m stay whole. It then follows the pedal (0.964),
  jumps by 16.5 N m at most, and leaves out what braking regenerates (-29 N m at the least, where -96 are given).
* "zoesensors.brake_sensor" has no known unit. It rests at 0.185 within 0.001 and rises to 0.42; "brake_pressed" is
  added: above 0.20, which happens once, in agreement with the slow "vehicle_monitor.brake_switch".
"""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from codriver.errors import FormatError, LogError
from codriver.logs.arrays import ArrayRecording, choose_names
from codriver.logs.names_file import Entry
from codriver.logs.recording import Recording
from codriver.logs.registry import ReadOptions, reader
from codriver.signals.signal import Array

_MESSAGES = ("zoe_veh_info", "zoesensors", "ms_imu", "pose", "vehicle_monitor", "steeranglefeedback")
_WHEEL = 0.0315  # m/s per rpm
_REQUEST = "zoe_veh_info.requestedTorqueAfterProc.unwrapped"
_PRESSED = 0.20  # brake_sensor above this is a pressed pedal
_UNITS = {
    "zoe_veh_info": {
        "FL_wheel_speed": "rpm", "FR_wheel_speed": "rpm", "RL_wheel_speed": "rpm", "RR_wheel_speed": "rpm",
        "longitudinal_accel": "m/s^2", "meanEffTorque": "N*m", "odom_speed": "km/h", "steer_corrected": "deg",
    },
    "ms_imu": {"linear_accel": "m/s^2", "rotation_rate": "rad/s"},
    "pose": {"vel": "m/s", "accel": "m/s^2", "rotation_rate": "rad/s", "pos": "m"},
    "vehicle_monitor": {
        "vehicle_speed": "km/h", "rear_left_rpm": "rpm", "rear_right_rpm": "rpm", "steering": "deg",
        "yaw_rate": "deg/s",
    },
    "steeranglefeedback": {"value": "rad"},
}  # fmt: skip

_WHEELS = tuple(f"zoe_veh_info.{wheel}_wheel_speed" for wheel in ("FL", "FR", "RL", "RR"))
_NAMES = (
    Entry("longitudinal_speed", _WHEELS, "m/s", _WHEEL),
    Entry("longitudinal_speed", ("pose.vel.0",)),
    Entry("longitudinal_acceleration", ("zoe_veh_info.longitudinal_accel",)),
    Entry("longitudinal_acceleration", ("ms_imu.linear_accel.0",)),
    Entry("lateral_acceleration", ("ms_imu.linear_accel.1",)),
    Entry("vertical_acceleration", ("ms_imu.linear_accel.2",)),
    Entry("roll_rate", ("ms_imu.rotation_rate.0",)),
    Entry("pitch_rate", ("ms_imu.rotation_rate.1",)),
    Entry("yaw_rate", ("ms_imu.rotation_rate.2",)),
    Entry("steering_wheel_angle", ("steeranglefeedback.value",)),
    Entry("steering_wheel_angle", ("zoe_veh_info.steer_corrected",)),
    Entry("accelerator_pedal", ("zoe_veh_info.pedal_cc",), "1", 1e-3),
    Entry("brake_switch", ("zoesensors.brake_pressed",)),
    Entry("engine_torque", ("zoe_veh_info.meanEffTorque",)),
    Entry("engine_torque_request", (_REQUEST,)),
)


def is_nuscenes(folder: Path) -> bool:
    """Whether a folder holds messages of the expansion."""
    return any(next(folder.glob(f"*_{message}.json"), None) for message in _MESSAGES)


@reader(".json", title="nuScenes CAN bus: <scene>_zoe_veh_info.json and others", folder=is_nuscenes)
def read_nuscenes(path: Path, options: ReadOptions) -> Recording:
    """Open a scene: a folder that holds one, or one of its files."""
    folder, scene = (path, _only_scene(path)) if path.is_dir() else (path.parent, _scene_of(path))
    recording = ArrayRecording(str(path), f"nuScenes CAN bus, {scene}")
    for message in _MESSAGES:
        file = folder / f"{scene}_{message}.json"
        if file.exists():
            _add_message(recording, message, _rows(file))
    channels = recording.channels()
    if not channels:
        raise LogError(f"{path}: {scene} holds no message", "a message at least", "unpack the expansion anew")
    recording.default_names = choose_names(_NAMES, channels, "nuScenes' own names")
    return recording


def _scene_of(path: Path) -> str:
    """The scene a file belongs to.

    Raises:
        FormatError: its name is not that of a message.
    """
    for message in (*_MESSAGES, "meta", "route"):
        if path.stem.endswith("_" + message):
            return path.stem.removesuffix("_" + message)
    raise FormatError(
        f"{path.name} is not named like a file of nuScenes' CAN bus expansion",
        "<scene>_<message>.json with one of the messages " + ", ".join(_MESSAGES),
        "give such a file or its folder; JSON of other kinds must be converted to CSV or Parquet",
    )


def _only_scene(folder: Path) -> str:
    """The scene of a folder.

    Raises:
        LogError: there are several; the message lists them.
    """
    files = [file for message in _MESSAGES for file in folder.glob(f"*_{message}.json")]
    scenes = sorted({_scene_of(file) for file in files})
    if len(scenes) > 1:
        raise LogError(
            f"{folder} holds {len(scenes)} scenes: {', '.join(scenes[:10])}" + (", ..." if len(scenes) > 10 else ""),
            "one scene",
            f"give the path of one of its files, such as {folder / scenes[0]}_{_MESSAGES[0]}.json",
        )
    return scenes[0]


def _add_message(recording: ArrayRecording, message: str, rows: list[dict[str, Any]]) -> None:
    """The channels of one message, and those that are made from them."""
    if not rows:
        recording.faults.append(f"message {message} is empty")
        return
    for key, value in rows[0].items():
        unit = _UNITS.get(message, {}).get(key, "")
        if key == "utime":
            continue
        if isinstance(value, list):
            for index in range(len(value)):
                recording.add(f"{message}.{key}.{index}", unit, "", partial(_column, rows, key, index))
        elif isinstance(value, (int, float)):
            recording.add(f"{message}.{key}", unit, "", partial(_column, rows, key))
    if "requestedTorqueAfterProc" in rows[0]:
        recording.add(_REQUEST, "N*m", "torque request, its 8 bits put together again", partial(_unwrapped, rows))
        recording.faults.append(
            "requestedTorqueAfterProc repeats every 128 N m; it is unwrapped by a rule that was found on one scene"
        )
    if "brake_sensor" in rows[0]:
        recording.add(f"{message}.brake_pressed", "1", f"brake_sensor above {_PRESSED}", partial(_brake_pressed, rows))


def _rows(file: Path) -> list[dict[str, Any]]:
    """The rows of a file.

    Raises:
        FormatError: it is no list of messages.
    """
    try:
        rows = json.loads(file.read_text(encoding="utf-8"))
    except (ValueError, OSError) as error:
        raise FormatError(f"{file} is no JSON: {error}", "a list of messages", "unpack the expansion anew") from None
    if not isinstance(rows, list) or not all(isinstance(row, dict) and "utime" in row for row in rows):
        raise FormatError(f"{file} is no list of rows with 'utime'", "a list of messages", "unpack the expansion anew")
    return rows


def _column(rows: list[dict[str, Any]], key: str, index: int | None = None) -> tuple[Array, Array]:
    """Stamps and values of one field; rows that lack it are left out."""
    there = [row for row in rows if row.get(key) is not None]
    values = [row[key] if index is None else row[key][index] for row in there]
    return np.array([row["utime"] for row in there], np.float64) / 1e6, np.array(values, np.float64)


def _unwrapped(rows: list[dict[str, Any]]) -> tuple[Array, Array]:
    """The torque request, N m; see the module's docstring."""
    time, raw = _column(rows, "requestedTorqueAfterProc")
    low = raw + 400.0 - 16.0
    anchored = np.where(low > 96.0, low - 128.0, low)
    pedal_time, pedal = _column(rows, "pedal_cc")
    if not pedal.size or not time.size:
        return time, anchored
    # Steps are taken as the smaller way round; with the foot off the pedal the request is small, and known.
    path = np.cumsum((np.diff(low, prepend=low[0]) + 64.0) % 128.0 - 64.0)
    known = np.interp(time, pedal_time, pedal) <= 0.0
    known[0] = True
    last = np.maximum.accumulate(np.where(known, np.arange(time.size), 0))
    return time, anchored[last] + path - path[last]


def _brake_pressed(rows: list[dict[str, Any]]) -> tuple[Array, Array]:
    """1 where the brake pedal is pressed, else 0."""
    time, sensor = _column(rows, "brake_sensor")
    return time, (sensor > _PRESSED).astype(np.float64)
