"""The streams of a CAN trace: the frames of one identifier on one bus, found in one pass over the whole trace.

A trace mixes some dozens of streams. Comparing every frame with every identifier costs a pass a message; sorting the
identifiers costs more than decoding them. Instead a multiplicative hash sends the few distinct keys to 16 bits, where
a table checks that no two meet, and numpy's radix sort of 16-bit numbers gathers the frames of each, in the order of
the trace.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from codriver.logs.frames import Frames

# Odd 64-bit multipliers; with n distinct keys one of them fails with a chance of about n^2 / 131072, so all rarely do.
_MULTIPLIERS = (0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9, 0xD6E8FEB86659FD93, 0xA0761D6478BD642F)


@dataclass(frozen=True, eq=False)
class Stream:
    """The frames of one identifier on one bus.

    Attributes:
        bus: channel number as the trace has it.
        identifier: 11 or 29 bits.
        extended: True for a 29-bit identifier.
        rows: their places in the trace, ascending, shape (n,).
    """

    bus: int
    identifier: int
    extended: bool
    rows: npt.NDArray[np.int64]

    def __len__(self) -> int:
        return self.rows.size


def find_streams(frames: Frames) -> list[Stream]:
    """The streams of a trace, by bus and identifier; 11-bit identifiers before 29-bit ones."""
    if not len(frames):
        return []
    key = frames.identifier.astype(np.uint64)
    key |= frames.extended.astype(np.uint64) << np.uint64(32)
    # The bus above the flag, by its bits, so that a channel number below zero is one too.
    key |= frames.bus.astype(np.uint16).astype(np.uint64) << np.uint64(33)
    code = _codes(key)
    order = np.argsort(code, kind="stable")
    edges = np.concatenate([[0], np.cumsum(np.bincount(code))])
    streams = []
    for start, stop in pairwise(edges.tolist()):
        if stop > start:
            row = int(order[start])
            identifier, extended = int(frames.identifier[row]), bool(frames.extended[row])
            streams.append(Stream(int(frames.bus[row]), identifier, extended, order[start:stop]))
    return sorted(streams, key=lambda stream: (stream.extended, stream.identifier, stream.bus))


def _codes(key: npt.NDArray[np.uint64]) -> npt.NDArray[np.integer]:
    """A small number for each key, the same for equal keys only."""
    table = np.zeros(1 << 16, np.uint64)
    for multiplier in _MULTIPLIERS:
        code = ((key * np.uint64(multiplier)) >> np.uint64(48)).astype(np.uint16)
        table[code] = key
        if np.array_equal(table[code], key):
            return code
    return np.unique(key, return_inverse=True)[1]


def name_identifier(identifier: int, extended: bool) -> str:
    """An identifier as people write it: "0x1A4", or "0x18FEF100x" for 29 bits."""
    return f"0x{identifier:08X}x" if extended else f"0x{identifier:X}"


def list_streams(streams: list[Stream], most: int = 8) -> str:
    """The streams with the most frames, as text for an error message: "0x1A4 (1200 frames), ..."."""
    ranked = sorted(streams, key=len, reverse=True)
    several = len({stream.bus for stream in streams}) > 1
    shown = [
        f"{name_identifier(s.identifier, s.extended)} ({len(s)} frames{f' on bus {s.bus}' if several else ''})"
        for s in ranked[:most]
    ]
    return ", ".join(shown) + (f", and {len(ranked) - most} more" if len(ranked) > most else "")
