"""Which channels of a recording that nobody has mapped are likely the steering wheel's angle and the column's torques.

A channel counts by its name, its unit and its values together. A torque is the motor's or the tyres' where its name says so; what a
motor is told counts as a command. "Torque" and "MotorTorque" alone say nothing of the steering: they count only beside an angle, in
a recording that holds nothing of an engine or of pedals.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping

import numpy as np

from codriver.logs.proposed import MOST_LOADED, is_value, measures, table_of
from codriver.logs.recording import RawSignal, Recording, SourceChannel

ANGLE, TORQUE = "steering_wheel_angle", "steering_wheel_torque"
MOTOR, COMMAND, ALIGNMENT = "steering_motor_torque", "steering_motor_command", "alignment_torque"
MOST_RADIANS = 20.0  # no steering wheel turns further
SIGN = "positive to the left? else sign = -1"

_STEERING = re.compile(
    r"steer|lenk|(?<![a-z])epa?s|ffb|force_?feedback|column|hand_?wheel|wheel_?(torque|moment)|align|volant"
)
_ANGLE_OF = re.compile(r"steer|lenk|hand_?wheel|volant|(^|[._])wheel_?angle$")
_TORQUE = re.compile(r"torque|moment|trq")
_COMMAND = re.compile(r"cmd|command|request|demand|target|soll|(^|_)com$")
_MOTOR = re.compile(r"ffb|force_?feedback|motor|assist|(?<![a-z])epa?s|servo")
_HANDS = re.compile(r"driver|sensor|torsion|hand|fahrer")
_ALIGN = re.compile(r"align|ruckstell|rueckstell|rückstell")
_PLAIN = re.compile(r"^(motor_?)?(torque|moment)$")
_POWERTRAIN = re.compile(r"engine|rpm|gear|throttle|accelerator|pedal|battery|brake|clutch")
_OTHER = re.compile(
    r"rate|speed|veloc|geschw|accel|valid|ready|status|quality|offset|limit|max|min|error|count|slip|yaw|roll|pitch|camber"
    r"|front|rear|road|tyre|tire|engine|gear|brake|drive_?shaft|(^|_)(fl|fr|rl|rr)(_|$)|counter|checksum|temp"
)
_TOLD = re.compile(r"cmd|command|request|target|desired|demand|soll|setpoint")


def propose_steering(recording: Recording) -> list[str]:
    """The tables of a names file for the steering, one text each; none where nothing looks like it."""
    channels = list(recording.channels().values())
    angle = _first(recording, channels, ANGLE, {c.name: _rank_angle(c) for c in channels}, _angle_unit)
    if angle is None:
        return []
    channel, raw = angle
    tables = [_angle_table(channel, raw)]
    beside = not any(_POWERTRAIN.search(_words(c.name)) for c in channels)
    for name in (TORQUE, MOTOR, COMMAND, ALIGNMENT):
        ranked = {c.name: _rank_torque(c, name, beside) for c in channels}
        found = _first(recording, channels, name, ranked, _command_unit if name == COMMAND else _torque_unit)
        if found is not None:
            unit, doubt = ("1", "the device's own") if name == COMMAND else ("N*m", "which is it?")
            tables.append("\n".join(table_of(name, *found, found[0].unit or unit, doubt, SIGN)) + "\n")
    return tables


def _words(name: str) -> str:
    """A channel's name in small letters with _ between its words, without a unit in brackets."""
    stem = re.sub(r"\W*[\[(].*", "", name)
    parted = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", stem)
    return re.sub(r"[\s_-]+", "_", parted).lower()


def _first(
    recording: Recording,
    channels: list[SourceChannel],
    name: str,
    ranked: Mapping[str, int],
    unit: Callable[[SourceChannel, RawSignal], str],
) -> tuple[SourceChannel, RawSignal] | None:
    """The likeliest channel whose samples are those of the quantity."""
    called = sorted((c for c in channels if ranked[c.name] >= 0), key=lambda c: ranked[c.name], reverse=True)[
        :MOST_LOADED
    ]
    loaded = recording.load([channel.name for channel in called])
    for channel in called:
        raw = loaded.get(channel.name)
        if raw is not None and is_value(name, unit(channel, raw), raw):
            return channel, raw
    return None


def _rank_angle(channel: SourceChannel) -> int:
    """How likely a channel is the steering wheel's angle; below 0 if it is not."""
    known, words = measures(channel.unit, ANGLE), _words(channel.name)
    signal = words.rpartition(".")[2]
    if (channel.unit and not known) or _OTHER.search(signal) or _TOLD.search(signal):
        return -1
    if not (re.search(r"angle|winkel", signal) and _ANGLE_OF.search(signal)):
        return -1
    return 4 * known + 2 * ("wheel" in signal or "lenkrad" in signal) + bool(re.search(r"(angle|winkel)$", signal))


def _rank_torque(channel: SourceChannel, name: str, beside: bool) -> int:
    """How likely a channel is that torque or command; below 0 if it is not."""
    unit = channel.unit
    words = _words(channel.name).rpartition(".")[2]
    if (unit and not measures(unit, name)) or _OTHER.search(words) or _kind(words, beside) != name:
        return -1
    return 4 * measures(unit, name) + 2 * bool(_HANDS.search(words)) + bool(_TORQUE.search(words))


def _kind(words: str, beside: bool) -> str | None:
    """The standard name that a channel's name speaks of."""
    steering, torque = _STEERING.search(words), _TORQUE.search(words)
    if not steering and not (beside and _PLAIN.search(words)):
        return None
    if torque and _ALIGN.search(words):
        return ALIGNMENT
    if _MOTOR.search(words) and not _HANDS.search(words):
        if _COMMAND.search(words) or (re.search(r"ffb|force_?feedback", words) and not torque):
            return COMMAND
        return MOTOR if torque else None
    return TORQUE if torque and not _TOLD.search(words) else None


def _angle_unit(channel: SourceChannel, raw: RawSignal) -> str:
    """The angle's unit, by its range where the recording says none."""
    return channel.unit or ("deg" if float(np.nanmax(np.abs(raw.values))) > MOST_RADIANS else "rad")


def _torque_unit(channel: SourceChannel, raw: RawSignal) -> str:
    return channel.unit or "N*m"


def _command_unit(channel: SourceChannel, raw: RawSignal) -> str:
    return channel.unit or "1"


def _angle_table(channel: SourceChannel, raw: RawSignal) -> str:
    """The table of the angle, with a hint at the unit."""
    unit = _angle_unit(channel, raw)
    most = float(np.nanmax(np.abs(raw.values)))
    doubt = f"{most:.4g} cannot be rad" if unit == "deg" else "rad by its range, or deg if the wheel hardly turned"
    return "\n".join(table_of(ANGLE, channel, raw, unit, doubt, SIGN)) + "\n"
