"""A channel that may be a quantity: whether its samples and its unit bear that out, and its table in a names file."""

from __future__ import annotations

import numpy as np

from codriver.errors import UnitError
from codriver.logs.recording import RawSignal, SourceChannel
from codriver.names import VOCABULARY
from codriver.toml_file import quoted
from codriver.units import to_si

LEAST_VALUES = 10  # different ones; a flag or a limit has fewer
MOST_LOADED = 40  # channels looked into


def measures(unit: str, name: str) -> bool:
    """Whether a unit is one of a standard name's quantity; none is not."""
    try:
        to_si(unit, VOCABULARY[name].unit)
    except UnitError:
        return False
    return bool(unit)


def is_value(name: str, unit: str, raw: RawSignal) -> bool:
    """Whether the samples are those of a measured quantity: many different values, nearly all of them in range."""
    finite = raw.values[np.isfinite(raw.values)]
    return np.unique(finite).size >= LEAST_VALUES and in_range(name, unit, raw)


def in_range(name: str, unit: str, raw: RawSignal) -> bool:
    """Whether nearly all samples are in the range of a standard name, in the unit given."""
    finite = raw.values[np.isfinite(raw.values)]
    entry = VOCABULARY[name]
    factor = to_si(unit, entry.unit)[0]
    outside = (factor * finite < entry.low) | (factor * finite > entry.high)
    return bool(finite.size) and bool(np.mean(outside) < 0.01)


def table_of(name: str, channel: SourceChannel, raw: RawSignal, unit: str, doubt: str, hint: str = "") -> list[str]:
    """The lines of a names file's table, with what the channel shows.

    Args:
        name: standard name.
        channel: proposed as its source.
        raw: its samples.
        unit: proposed; the channel's own where it has one.
        doubt: said beside the unit where the channel has none.
        hint: said beside the source.
    """
    finite = raw.values[np.isfinite(raw.values)]
    shown = f"{finite.min():.4g} to {finite.max():.4g} {channel.unit}".rstrip()
    count = np.unique(finite).size
    different = f"{count} different values" if count > 1 else "one value"
    return [
        f"[{name}]",
        f"source = {quoted(channel.name)}  # {different}, {shown}" + (f"; {hint}" if hint else ""),
        f"unit = {quoted(unit)}" + ("" if channel.unit else f"  # the recording says none: {doubt}"),
    ]
