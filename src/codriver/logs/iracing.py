"""iRacing telemetry (.ibt): one record of some 270 variables at 60 Hz.

Layout, little endian: a header of 112 bytes (version, status, tick rate, session text, variables, buffers), a second
one of 32 bytes (start, times, number of records), descriptions of the variables of 144 bytes each (type, offset, count,
name, description, unit), a text about the session, and the records.

What the variables mean, found on one lap with a car of about 1.5 g (low-passed, above 15 m/s):

* Speed is the length of (VelocityX, VelocityY); VelocityX is the speed along x, negative in reverse.
* YawRate follows the turning of the course over latitude and longitude to the left (+0.97): positive to the left.
  LatAccel follows speed times yaw rate (+0.97): positive to the left. atan(VelocityY / VelocityX) follows course less
  heading (+0.9998): VelocityY is positive to the left.
* LongAccel less the derivative of the speed follows -9.76 sin(Pitch) (-0.995), and Pitch is positive with the nose
  down: it is what an accelerometer shows. Likewise LatAccel with Roll, which is positive with the right side down.
* SteeringWheelAngle follows the yaw rate while the car does not slide (+0.97): positive to the left.
  SteeringWheelTorque is what the shaft does to the wheel, against the lateral acceleration (-0.97); what the driver
  puts against it, positive to the left, is its negative.
* Clutch is 1 with the pedal up and less while pulling away and shifting: codriver's "clutch" is 1 less that.
* All variables in "%" are fractions of 1; their unit is given as "1".

A name that ends in _ST has several samples to a record (360 Hz), the last of them at the record's time.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from codriver.errors import FormatError, LogError
from codriver.logs.arrays import ArrayRecording, choose_names
from codriver.logs.names_file import Entry
from codriver.logs.recording import Recording
from codriver.logs.registry import ReadOptions, reader
from codriver.signals.signal import Array

_HEADER = 144
_VARIABLE = struct.Struct("<iii?3x32s64s32s")
_TYPES = {0: "S1", 1: "?", 2: "<i4", 3: "<u4", 4: "<f4", 5: "<f8"}
_CLOCK = "SessionTime"

_NAMES = (
    Entry("longitudinal_speed", ("VelocityX",)),
    Entry("longitudinal_speed", ("Speed",)),
    Entry("longitudinal_acceleration", ("LongAccel",)),
    Entry("lateral_acceleration", ("LatAccel",)),
    Entry("vertical_acceleration", ("VertAccel",)),
    Entry("lateral_velocity", ("VelocityY",)),
    Entry("yaw_rate", ("YawRate",)),
    Entry("roll_rate", ("RollRate",)),
    Entry("pitch_rate", ("PitchRate",)),
    Entry("roll_angle", ("Roll",)),
    Entry("steering_wheel_angle", ("SteeringWheelAngle",)),
    Entry("steering_wheel_torque", ("SteeringWheelTorque",), sign=-1),
    Entry("accelerator_pedal", ("Throttle",)),
    # The front circuit stands for the master cylinder; its pressure follows the pedal (0.997), 88 bar fully pressed.
    Entry("brake_pressure", ("LFbrakeLinePress", "RFbrakeLinePress")),
    Entry("clutch", ("Clutch",), scale=-1.0, offset=1.0),
    Entry("gear", ("Gear",)),
    Entry("engine_speed", ("RPM",)),
    Entry("distance", ("LapDist",)),
    Entry("latitude", ("Lat",)),
    Entry("longitude", ("Lon",)),
    Entry("altitude", ("Alt",)),
)


@dataclass(frozen=True)
class Variable:
    """A variable of a record: numpy type, offset in bytes, values to a record, and what the file says of it."""

    kind: str
    offset: int
    count: int
    name: str
    unit: str
    comment: str


@reader(".ibt", title="iRacing telemetry")
def read_ibt(path: Path, options: ReadOptions) -> Recording:
    """Open an iRacing telemetry file."""
    variables, length, first = _read_header(path)
    size = path.stat().st_size - first
    count = size // length
    if count < 1:
        raise LogError(f"{path} has a header and no records", "records behind the header", "check how it was recorded")
    layout = {
        "names": [v.name for v in variables],
        "formats": [(v.kind, (v.count,)) if v.count > 1 else v.kind for v in variables],
        "offsets": [v.offset for v in variables],
        "itemsize": length,
    }
    records = np.memmap(path, np.dtype(layout), "r", offset=first, shape=(count,))  # type: ignore[call-overload]
    recording = ArrayRecording(str(path), "iRacing telemetry")
    if size % length:
        recording.faults.append(f"the last record is cut off after {size % length} of {length} bytes; left out")
    for variable in variables:
        if variable.kind == "S1" or variable.name == _CLOCK:
            continue
        unit = "1" if variable.unit == "%" else variable.unit
        if variable.count == 1 or variable.name.endswith("_ST"):
            recording.add(variable.name, unit, variable.comment, partial(_column, records, variable.name))
        else:
            for index in range(variable.count):
                fetch = partial(_column, records, variable.name, index)
                recording.add(f"{variable.name}[{index}]", unit, variable.comment, fetch)
    recording.default_names = choose_names(_NAMES, recording.channels(), "iRacing's own names")
    return recording


def _column(records: npt.NDArray[Any], name: str, index: int | None = None) -> tuple[Array, Array]:
    """Stamps and values of a variable."""
    time = np.asarray(records[_CLOCK], np.float64)
    values = np.asarray(records[name], np.float64)
    if values.ndim == 1:
        return time, values
    if index is not None:
        return time, values[:, index]
    # Samples between two records, evenly spread, the last at the record itself.
    count = values.shape[1]
    step = float(np.median(np.diff(time))) if time.size > 1 else 0.0
    return (time[:, None] + step * (np.arange(count) + 1 - count) / count).ravel(), values.ravel()


def _read_header(path: Path) -> tuple[list[Variable], int, int]:
    """The variables, the bytes of a record, and the offset of the first.

    Raises:
        FormatError: it is no such file, or is cut off within the header.
    """
    with path.open("rb") as file:
        head = file.read(_HEADER)
        wrong = FormatError(
            f"{path} does not begin like iRacing telemetry", "an .ibt file of version 1 or 2", "check the suffix"
        )
        if len(head) < _HEADER:
            raise wrong
        version, _, rate, _, _, _, count, start, _, length = struct.unpack("<10i", head[:40])
        first = struct.unpack("<i", head[52:56])[0]
        plausible = version in (1, 2) and 0 < rate <= 1000 and 0 < count < 10_000 and 0 < length < 1 << 20
        if not plausible or start < _HEADER or first <= start:
            raise wrong
        file.seek(start)
        table = file.read(count * _VARIABLE.size)
    if len(table) < count * _VARIABLE.size:
        raise FormatError(f"{path} is cut off within its header", "a complete file", "copy it again")
    variables = []
    for kind, offset, values, _, name, comment, unit in _VARIABLE.iter_unpack(table):
        if kind not in _TYPES or values < 1 or offset < 0:
            raise wrong
        text = [part.split(b"\0", 1)[0].decode("latin-1") for part in (name, unit, comment)]
        variables.append(Variable(_TYPES[kind], offset, values, *text))
    if _CLOCK not in {variable.name for variable in variables}:
        raise FormatError(f"{path} has no variable {_CLOCK}", "the session's clock", "record with iRacing's defaults")
    return variables, length, first
