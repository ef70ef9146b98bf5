"""The beginning of a names file for a recording that nobody has mapped: which channel is likely the vehicle's speed.

A channel counts by its name, its unit and its values together: a flag such as "SpeedValid" or a limit is called a speed too,
but shows one or two values. A flag that belongs to the channel chosen is proposed as its `valid`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np

from codriver.errors import UnitError
from codriver.logs.recording import RawSignal, Recording, SourceChannel
from codriver.names import VOCABULARY
from codriver.toml_file import quoted
from codriver.units import to_si

NAME = "longitudinal_speed"
_CALLED = re.compile(r"speed|spd|veloc|geschwindigkeit|vitesse", re.IGNORECASE)
_OTHER = re.compile(
    r"accel|engine|eng_?spd|motor|turbine|fan|wind|accura|limit|cruise|target|desired|setpoint|lateral|valid|turn|yaw|steer",
    re.IGNORECASE,
)
_FLAG = re.compile(r"valid|ready", re.IGNORECASE)
LEAST_VALUES = 10  # different ones; a flag or a limit has fewer
MOST_LOADED = 40  # channels looked into


def propose_names(recording: Recording) -> str:
    """The text of a names file that maps the speed, for people to check and go on from."""
    channels = recording.channels()
    called = sorted((c for c in channels.values() if _rank(c) >= 0), key=_rank, reverse=True)[:MOST_LOADED]
    loaded = recording.load([channel.name for channel in called])
    for channel in called:
        raw = loaded.get(channel.name)
        if raw is not None and _is_value(channel, raw):
            return _entry(channel, raw, _companion(recording, channel))
    return (
        f"# none of the channels looks like the vehicle's speed: which one is it?\n[{NAME}]\n"
        'source = "name of the channel"\nunit = "km/h"\n'
    )


def _rank(channel: SourceChannel) -> int:
    """How likely a channel is the speed, by name and unit; below 0 if it is not."""
    known = _measures_speed(channel.unit)
    if (channel.unit and not known) or _OTHER.search(channel.name) or not (known or _CALLED.search(channel.name)):
        return -1
    name = channel.name.lower()
    return 4 * known + 2 * (_CALLED.search(name) is not None) + ("veh" in name) - ("wheel" in name or "whl" in name)


def _measures_speed(unit: str) -> bool:
    """Whether a unit is one of speed."""
    try:
        to_si(unit, VOCABULARY[NAME].unit)
    except UnitError:
        return False
    return bool(unit)


def _is_value(channel: SourceChannel, raw: RawSignal) -> bool:
    """Whether the samples are those of a measured speed: many different values, nearly all of them in range."""
    finite = raw.values[np.isfinite(raw.values)]
    if np.unique(finite).size < LEAST_VALUES:
        return False
    entry = VOCABULARY[NAME]
    # Without a unit the values may be in km/h.
    factor = to_si(channel.unit or "km/h", entry.unit)[0]
    outside = (factor * finite < entry.low) | (factor * finite > entry.high)
    return bool(np.mean(outside) < 0.01)


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
    finite = raw.values[np.isfinite(raw.values)]
    unit = channel.unit or "km/h"
    doubt = "" if channel.unit else "  # the recording says none: which is it?"
    shown = f"{finite.min():.4g} to {finite.max():.4g} {channel.unit}".rstrip()
    lines = [
        f"[{NAME}]",
        f"source = {quoted(channel.name)}  # {np.unique(finite).size} different values, {shown}",
        f"unit = {quoted(unit)}{doubt}",
    ]
    if valid is not None:
        lines.append(f"valid = {quoted(valid)}  # values count only while it is 1")
    return "\n".join(lines) + "\n"
