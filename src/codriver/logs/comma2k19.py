"""comma2k19: a segment of one minute as a folder of numpy arrays without suffix.

    segment/processed_log/CAN/raw_can/{t,src,address,data}    all CAN frames; src is the bus, 128 and above were sent
    segment/processed_log/CAN/{speed,steering_angle,wheel_speed}/{t,value}
    segment/processed_log/IMU/{accelerometer,gyro}/{t,value}

Channels are called "CAN/speed", "CAN/wheel_speed.FL", "IMU/accelerometer.x"; with a DBC file, those of the raw frames
("KINEMATICS.ACCEL_X") are added. "GAS_PEDAL.GAS_PEDAL" is taken from address 705, byte 6, in steps of 0.005, since the
DBC files made for these cars lack it.

What the numbers mean, found on the segment of a Toyota RAV4 (means over a second; dv/dt of the wheels):

* wheel_speed is m/s: its columns equal the DBC's WHEEL_SPEED_FL, FR, RL, RR in km/h divided by 3.6, to the last digit;
  speed is their mean. The rear pair is taken as the vehicle's speed: the front wheels are driven. (SPEED.SPEED, for
  the dashboard, shows 2% more.)
* steering_angle is deg: it equals STEER_ANGLE + STEER_FRACTION of the DBC, to the last digit. It is positive to the
  left: its product with the speed follows KINEMATICS.YAW_RATE (+0.92), which follows the phone's gyroscope (-0.98 with
  z, which points down).
* The phone's accelerometer looks x forward, y right, z down: x against dv/dt +0.84, y against speed times yaw rate to
  the left -0.81, z is -9.68 on average. ISO 8855's y and z are its negatives.
* KINEMATICS.ACCEL_X against dv/dt is -0.83, ACCEL_Y against speed times yaw rate -0.87: both have the opposite sign of
  ISO 8855. GAS_PEDAL follows dv/dt (+0.76).
* STEER_TORQUE_SENSOR and BRAKE_MODULE.BRAKE_PRESSURE count in no known unit and are not mapped.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from codriver.errors import FormatError, LogError
from codriver.logs.arrays import ArrayRecording, choose_names
from codriver.logs.frames import Frames
from codriver.logs.joined import JoinedRecording
from codriver.logs.names_file import Entry
from codriver.logs.recording import Recording
from codriver.logs.registry import ReadOptions, reader
from codriver.signals.signal import Array

# Folder, unit, names of the columns (none for a single one), comment.
_ARRAYS = (
    ("CAN/speed", "m/s", "", "mean of the wheels"),
    ("CAN/steering_angle", "deg", "", "positive to the left"),
    ("CAN/wheel_speed", "m/s", ("FL", "FR", "RL", "RR"), ""),
    ("IMU/accelerometer", "m/s^2", ("x", "y", "z"), "x forward, y right, z down"),
    ("IMU/gyro", "rad/s", ("x", "y", "z"), "about x forward, y right, z down"),
)
_PEDAL_ADDRESS = 705
_NAMES = (
    Entry("longitudinal_speed", ("WHEEL_SPEEDS.WHEEL_SPEED_RL", "WHEEL_SPEEDS.WHEEL_SPEED_RR")),
    Entry("longitudinal_speed", ("CAN/wheel_speed.RL", "CAN/wheel_speed.RR")),
    Entry("longitudinal_speed", ("CAN/speed",)),
    Entry("longitudinal_acceleration", ("KINEMATICS.ACCEL_X",), sign=-1),
    Entry("longitudinal_acceleration", ("IMU/accelerometer.x",)),
    Entry("lateral_acceleration", ("KINEMATICS.ACCEL_Y",), sign=-1),
    Entry("lateral_acceleration", ("IMU/accelerometer.y",), sign=-1),
    Entry("vertical_acceleration", ("IMU/accelerometer.z",), sign=-1),
    Entry("roll_rate", ("IMU/gyro.x",)),
    Entry("pitch_rate", ("IMU/gyro.y",), sign=-1),
    Entry("yaw_rate", ("KINEMATICS.YAW_RATE",)),
    Entry("yaw_rate", ("IMU/gyro.z",), sign=-1),
    Entry("steering_wheel_angle", ("CAN/steering_angle",)),
    Entry("steering_wheel_angle", ("STEER_ANGLE_SENSOR.STEER_ANGLE",)),
    Entry("steering_wheel_rate", ("STEER_ANGLE_SENSOR.STEER_RATE",)),
    Entry("accelerator_pedal", ("GAS_PEDAL.GAS_PEDAL",), "1"),
    Entry("brake_switch", ("BRAKE_MODULE.BRAKE_PRESSED",)),
    Entry("engine_speed", ("ENGINE_RPM.RPM",)),
)


def _log_folder(folder: Path) -> Path:
    """The folder that holds CAN/ and IMU/: a segment's processed_log, or the folder itself."""
    inner = folder / "processed_log"
    return inner if inner.is_dir() else folder


def is_segment(folder: Path) -> bool:
    """Whether a folder is a segment, or its processed_log."""
    log = _log_folder(folder)
    return (log / "CAN" / "raw_can" / "t").is_file() or (log / "CAN" / "speed" / "t").is_file()


@reader(title="comma2k19 segment: processed_log/CAN/...", folder=is_segment)
def read_segment(path: Path, options: ReadOptions) -> Recording:
    """Open a segment: its arrays, and its raw frames where a database is given."""
    from codriver.logs.can_recording import CanRecording

    log = _log_folder(path)
    arrays = ArrayRecording(str(path), "comma2k19 segment")
    for name, unit, columns, comment in _ARRAYS:
        if (log / name / "t").is_file():
            for index, column in enumerate(columns) if columns else [(None, "")]:
                channel = f"{name}.{column}" if columns else name
                arrays.add(channel, unit, comment, partial(_column, log / name, index))
    raw = log / "CAN" / "raw_can"
    if (raw / "t").is_file():
        arrays.add("GAS_PEDAL.GAS_PEDAL", "1", "0 released to 1; address 705, byte 6", partial(_pedal, raw))
    if not arrays.channels():
        raise LogError(f"{path} holds no arrays", "processed_log/CAN and processed_log/IMU", "unpack the segment anew")
    parts: list[Recording] = [arrays]
    form = "comma2k19 segment"
    if options.dbc is not None:
        frames = _frames(raw)
        parts.insert(0, CanRecording(str(path), form, frames, options.dbc, options.bus, []))
        form = "comma2k19 segment, raw CAN"
    joined = JoinedRecording(str(path), form, parts)
    joined.default_names = choose_names(_NAMES, joined.channels(), "comma2k19's own names")
    return joined


def _load(file: Path) -> npt.NDArray[Any]:
    """One array.

    Raises:
        FormatError: it is missing, or no numpy array.
    """
    try:
        loaded: npt.NDArray[Any] = np.load(file, allow_pickle=False)
    except (OSError, ValueError, EOFError) as error:
        raise FormatError(f"{file}: {error}", "a numpy array", "unpack the segment anew") from None
    return loaded


def _column(folder: Path, index: int | None) -> tuple[Array, Array]:
    """Stamps and values of one column of a folder with t and value; a stamp or row too many at the end is left out."""
    time, values = _load(folder / "t").astype(np.float64), _load(folder / "value").astype(np.float64)
    count = min(len(time), len(values))
    values = values.reshape(len(values), -1)[:count, index or 0]
    return time[:count], values


def _frames(raw: Path) -> Frames:
    """All frames. Their length is not recorded: payloads are padded with zeros to 8 bytes."""
    time, source, address, data = (_load(raw / name) for name in ("t", "src", "address", "data"))
    if not len(time) == len(source) == len(address) == len(data) or data.dtype.kind != "S" or data.dtype.itemsize > 8:
        raise FormatError(
            f"{raw}: {len(time)}, {len(source)}, {len(address)}, {len(data)} entries, data of type {data.dtype}",
            "arrays of one length, data of at most 8 bytes",
            "unpack the segment anew",
        )
    payload = np.ascontiguousarray(data.astype("S8")).view(np.uint8).reshape(-1, 8)
    return Frames(
        time.astype(np.float64),
        source.astype(np.int16),
        address.astype(np.uint32),
        address > 0x7FF,
        np.full(len(time), 8, np.uint8),
        payload,
    )


def _pedal(raw: Path) -> tuple[Array, Array]:
    """The accelerator pedal, 0 to 1, on bus 0."""
    frames = _frames(raw)
    chosen = (frames.identifier == _PEDAL_ADDRESS) & (frames.bus == 0)
    return frames.time[chosen], frames.data[chosen, 6] * 0.005
