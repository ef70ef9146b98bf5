"""The beginning of a names file for a recording that nobody has mapped: the vehicle's speed, and what is seen of the steering.

A channel counts by its name, its unit and its values together: a flag such as "SpeedValid" or a limit is called a speed too,
but shows one or two values. One that is called "Speed" and nothing else may rest, as a driving simulator's does. A flag
that belongs to the channel chosen is proposed as its `valid`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np

from codriver.logs.propose_steering import propose_steering
from codriver.logs.proposed import MOST_LOADED, in_range, is_value, measures, table_of
from codriver.logs.recording import RawSignal, Recording, SourceChannel
from codriver.toml_file import quoted

NAME = "longitudinal_speed"
_CALLED = re.compile(r"speed|spd|veloc|geschwindigkeit|vitesse", re.IGNORECASE)
_OTHER = re.compile(
    r"accel|engine|eng_?spd|motor|turbine|fan|(?<!sch)wind|accura|limit|cruise|target|desired|setpoint|lateral|valid|turn|yaw|steer",
    re.IGNORECASE,
)
_FLAG = re.compile(r"valid|ready", re.IGNORECASE)
_PLAIN = re.compile(r"^((vehicle|car)[_ ]?)?(speed|velocity|geschwindigkeit)(?=$|\W)", re.IGNORECASE)


def propose_names(recording: Recording) -> str:
    """The text of a names file that maps speed and steering, for people to check and go on from."""
    return "\n".join((_propose_speed(recording), *propose_steering(recording)))


def _propose_speed(recording: Recording) -> str:
    """The speed's table, or one to fill in."""
    channels = recording.channels()
    called = sorted((c for c in channels.values() if _rank(c) >= 0), key=_rank, reverse=True)[:MOST_LOADED]
    loaded = recording.load([channel.name for channel in called])
    there = [(channel, loaded[channel.name]) for channel in called if channel.name in loaded]
    for accepted in (_varies, _rests):
        for channel, raw in there:
            if accepted(channel, raw):
                return _entry(channel, raw, _companion(recording, channel))
    return (
        f"# none of the channels looks like the vehicle's speed: which one is it?\n[{NAME}]\n"
        'source = "name of the channel"\nunit = "km/h"\n'
    )


def _rank(channel: SourceChannel) -> int:
    """How likely a channel is the speed, by name and unit; below 0 if it is not."""
    known = measures(channel.unit, NAME)
    if (channel.unit and not known) or _OTHER.search(channel.name) or not (known or _CALLED.search(channel.name)):
        return -1
    name = channel.name.lower()
    return 4 * known + 2 * (_CALLED.search(name) is not None) + ("veh" in name) - ("wheel" in name or "whl" in name)


def _varies(channel: SourceChannel, raw: RawSignal) -> bool:
    """Whether the samples are those of a measured speed. Without a unit the values may be in km/h."""
    return is_value(NAME, channel.unit or "km/h", raw)


def _rests(channel: SourceChannel, raw: RawSignal) -> bool:
    """Whether a channel that is called a speed and nothing else holds few values, and others than a flag's."""
    values = np.unique(raw.values[np.isfinite(raw.values)])
    plain = _PLAIN.search(channel.name.rpartition(".")[2])
    return plain is not None and bool(np.any(values > 1.0)) and in_range(NAME, channel.unit or "km/h", raw)


def _companion(recording: Recording, channel: SourceChannel) -> str | None:
    """The flag that says when a channel counts: beside it, called like it, 0 and 1 only, and 1 at times."""
    stem = re.sub(r"\W*[\[(].*", "", channel.name)
    message = stem.rpartition(".")[0]
    beside = [
        name
        for name in recording.channels()
        if _FLAG.search(name) and name != channel.name
        and (name.lower().startswith(stem.lower()) or (message and name.rpartition(".")[0] == message))
    ]  # fmt: skip
    flags: Mapping[str, RawSignal] = recording.load(beside)
    found = [name for name in beside if name in flags and set(np.unique(flags[name].values)) in ({0.0, 1.0}, {1.0})]
    return min(found, key=lambda name: (not name.lower().startswith(stem.lower()), len(name)), default=None)


def _entry(channel: SourceChannel, raw: RawSignal, valid: str | None) -> str:
    """The table of the names file, with what the channel shows."""
    lines = table_of(NAME, channel, raw, channel.unit or "km/h", "which is it?")
    if valid is not None:
        lines.append(f"valid = {quoted(valid)}  # values count only while it is 1")
    return "\n".join(lines) + "\n"
