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
# What no key is: they have 49 bits.
_FREE = np.uint64(2**64 - 1)
# Frames hashed at a time: what is worked on stays in the cache.
_BLOCK = 1 << 16


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
    code = _codes(frames)
    order = np.argsort(code, kind="stable")
    edges = np.concatenate([[0], np.cumsum(np.bincount(code))])
    streams = []
    for start, stop in pairwise(edges.tolist()):
        if stop > start:
            row = int(order[start])
            identifier, extended = int(frames.identifier[row]), bool(frames.extended[row])
            streams.append(Stream(int(frames.bus[row]), identifier, extended, order[start:stop]))
    return sorted(streams, key=lambda stream: (stream.extended, stream.identifier, stream.bus))


def _codes(frames: Frames) -> npt.NDArray[np.integer]:
    """A small number for each frame, the same for frames of one identifier on one bus and for those only."""
    for multiplier in _MULTIPLIERS:
        code = _hash(frames, multiplier)
        if code is not None:
            return code
    return np.unique(_keys(frames, slice(None)), return_inverse=True)[1]


def _hash(frames: Frames, multiplier: int) -> npt.NDArray[np.uint16] | None:
    """The keys' 16-bit hashes; None if two keys share one."""
    code = np.empty(len(frames), np.uint16)
    table = np.full(1 << 16, _FREE, np.uint64)
    for start in range(0, len(frames), _BLOCK):
        part = slice(start, start + _BLOCK)
        key = _keys(frames, part)
        code[part] = (key * np.uint64(multiplier)) >> np.uint64(48)
        there = table[code[part]]
        if np.array_equal(there, key):
            continue
        # Keys not met before, which is rare after the first block.
        table[code[part]] = key
        if not ((there == _FREE) | (there == key)).all() or not np.array_equal(table[code[part]], key):
            return None
    return code


def _keys(frames: Frames, part: slice) -> npt.NDArray[np.uint64]:
    """Identifier, flag for 29 bits and bus as one number, for a part of the frames."""
    key = frames.identifier[part].astype(np.uint64)
    key |= frames.extended[part].astype(np.uint64) << np.uint64(32)
    # The bus by its bits, so that a channel number below zero is one too.
    return key | (frames.bus[part].astype(np.uint16).astype(np.uint64) << np.uint64(33))


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
