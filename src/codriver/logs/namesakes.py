"""Channels of one name: which one is taken, and whether the others say the same.

A table may have two columns of one header ("speed", and "speed#2" as the reader then calls the second), an MDF file a name in
several groups ("speed", "speed@engine"), a CAN database a standard name in several messages. The first is taken. That is
told where another one shows other values, for then nobody but the reader of the log can know which is meant.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np

from codriver.errors import UnitError
from codriver.logs.names_file import Entry, NamesFile
from codriver.logs.recording import RawSignal, Recording
from codriver.logs.table_clock import split_unit

_SUFFIX = re.compile(r"(#\d+|@[^@]+)$")


def own_name(channel: str) -> str:
    """What a channel calls itself, without the unit of a header, the message of a frame, or the group of an MDF channel."""
    # A unit may hold a point: "[N.m]".
    return re.split(r"[\[(@]", _SUFFIX.sub("", channel))[0].strip().rsplit(".", 1)[-1]


def tell_namesakes(recording: Recording, mapping: NamesFile, raw: Mapping[str, RawSignal], own: bool) -> list[str]:
    """A sentence for each source of a mapping beside which the recording has others of that name with other values.

    Args:
        recording: the channels.
        mapping: what is taken.
        raw: the samples of its sources, as loaded.
        own: whether the mapping is made of the channels' own names, so that units and messages do not tell them apart.
    """
    alike: dict[str, list[str]] = {}
    for channel in recording.channels():
        alike.setdefault(own_name(channel) if own else _SUFFIX.sub("", channel), []).append(channel)
    bare: dict[str, list[str]] = {}
    for stem in alike:
        bare.setdefault(split_unit(stem)[0], []).append(stem)
    sentences = []
    for entry in mapping.entries.values():
        for source in entry.source:
            if source not in raw or (not own and _SUFFIX.search(source)):
                continue  # a names file that says which one means it
            stem = own_name(source) if own else source
            stem = stem if stem in alike else next(iter(bare.get(stem, ())), stem)
            taken = source if source in recording.channels() else stem
            others = recording.load([channel for channel in alike.get(stem, ()) if channel != taken])
            different = [channel for channel, other in others.items() if not _same(entry, raw[source], other)]
            if different:
                listed = ", ".join(f"'{channel}'" for channel in different[:4]) + (
                    ", ..." if len(different) > 4 else ""
                )
                sentences.append(
                    f"{entry.name}: '{taken}' is taken, and the recording has {listed} of the same name with other values; "
                    "say in a names file which is meant"
                )
    return sentences


def _same(entry: Entry, one: RawSignal, other: RawSignal) -> bool:
    """Whether two channels show the same, each in its own unit."""
    if one.values.shape != other.values.shape or not np.array_equal(one.time, other.time, equal_nan=True):
        return False
    try:
        (gain, shift), (gain_2, shift_2) = entry.conversion(one.unit), entry.conversion(other.unit)
    except UnitError:
        return False
    return bool(np.allclose(gain * one.values + shift, gain_2 * other.values + shift_2, rtol=1e-6, equal_nan=True))
