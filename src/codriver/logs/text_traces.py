"""CAN traces in text: Vector's ASC and PEAK's TRC (candump's log files: `codriver.logs.candump`).

    ASC       0.015991 1  39Bx   Rx   d 8 01 02 03 04 05 06 07 08
              0.016  CANFD  1 Rx  39B  [Name]  1 0 d 32 01 02 ...      (bit rate switch, error state, DLC, bytes)
    TRC 1.1      1)      1059.9  Rx         0300  7  00 00 00 00 04 00 00
    TRC 2.1      1    1059.900 DT  1     0300 Rx -  7    00 00 00 00 04 00 00

Time is in seconds from the start of the measurement. Error and remote frames, statistics and comments are passed over.
A line that looks like a frame and cannot be read as one counts as a fault.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from codriver.logs.frames import Frames
from codriver.logs.text_tokens import Flags, Index, Words, blocks
from codriver.logs.wording import counted

Numbers = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Found:
    """Lines of a block that look like frames, one row a line.

    Attributes:
        lines: their numbers in the block.
        keep: False for error and remote frames.
        good: True where the line could be read.
        frames: what was read; meaningless where not good.
    """

    lines: Index
    keep: Flags
    good: Flags
    frames: Frames


@dataclass
class Trace:
    """What the blocks of a trace gave so far."""

    parts: list[Frames] = field(default_factory=list)
    bad: int = 0
    example: str = ""

    def add(self, words: Words, *kinds: Found) -> None:
        """Take the frames of a block, in the order of its lines, and count the lines that could not be read."""
        frames = Frames.joined([kind.frames.where(kind.keep & kind.good) for kind in kinds])
        if len(kinds) > 1:
            order = np.argsort(np.concatenate([kind.lines[kind.keep & kind.good] for kind in kinds]), kind="stable")
            frames = frames.where(order)
        self.parts.append(frames)
        for kind in kinds:
            bad = kind.lines[kind.keep & ~kind.good]
            if bad.size and not self.bad:
                self.example = words.line(int(bad[0]))[:80]
            self.bad += bad.size

    def result(self) -> tuple[Frames, list[str]]:
        """All frames, and a fault if some lines could not be read."""
        faults = (
            [f"{counted(self.bad, 'line')} could not be read as CAN frames, such as '{self.example}'"]
            if self.bad
            else []
        )
        return Frames.joined(self.parts), faults


def parse_asc(content: bytes) -> tuple[Frames, list[str]]:
    """The data frames of an ASC trace, and its faults.

    The header's base (hex, dec) and its time stamps (absolute: since the start; relative: since the line before) are
    heeded. Channels are numbered as written, from 1.
    """
    header = re.search(rb"^\s*base\s+(hex|dec)(?:\s+timestamps\s+(absolute|relative))?", content[:65536], re.I | re.M)
    base = 10 if header and header[1].lower() == b"dec" else 16
    relative = bool(header and header[2] and header[2].lower() == b"relative")
    trace, clock = Trace(), 0.0
    for block in blocks(content):
        words = Words.of(block)
        lines = np.flatnonzero(words.count >= 5)
        if relative:
            # Every event moves the clock, whatever it is.
            lines = np.flatnonzero(words.count >= 2)
        time, stamped = words.numbers(words.word(lines, 0))
        lines, time = lines[stamped], time[stamped]
        if relative:
            time = clock + np.cumsum(time)
            clock = float(time[-1]) if time.size else clock
            lines, time = lines[words.count[lines] >= 5], time[words.count[lines] >= 5]
        fd = words.equals(words.word(lines, 1), b"CANFD")
        kinds = [_asc_classic(words, lines[~fd], time[~fd], base)]
        if fd.any():
            kinds.append(_asc_fd(words, lines[fd], time[fd], base))
        trace.add(words, *kinds)
    return trace.result()


def _asc_classic(words: Words, lines: Index, time: Numbers, base: int) -> Found:
    """Lines of classic frames: stamp, channel, identifier, Rx or Tx, d, DLC, data."""
    direction = words.word(lines, 3)
    frame = words.begins(direction, b"Rx") | words.begins(direction, b"Tx")
    bus, numbered = words.integers(words.word(lines, 1), 10, most=4)
    frame &= numbered
    lines, time, bus = lines[frame], time[frame], bus[frame]
    kind = words.word(lines, 4)
    keep = ~words.begins(kind, b"r") & ~words.begins(words.word(lines, 2), b"ErrorFrame")
    identifier, extended, good = _asc_identifier(words, words.word(lines, 2), base)
    code, known = words.integers(words.word(lines, 5), base, most=2)
    good &= words.equals(kind, b"d") & (words.count[lines] >= 6) & known & (code < 16)
    length = np.where(good & keep, np.minimum(code, 8), 0)
    data, whole = read_payload(words, lines, 6, length, base, 8)
    frames = Frames(time, bus.astype(np.int16), identifier, extended, length.astype(np.uint8), data)
    return Found(lines, keep, good & whole, frames)


def _asc_fd(words: Words, lines: Index, time: Numbers, base: int) -> Found:
    """Lines of CAN FD: stamp, CANFD, channel, Rx or Tx, identifier, perhaps a name, BRS, ESI, DLC, bytes, data."""
    bus, good = words.integers(words.word(lines, 2), 10, most=4)
    identifier, extended, valid = _asc_identifier(words, words.word(lines, 4), base)
    # Without a symbolic name the next word is the bit rate switch, a digit.
    named = ~words.integers(words.word(lines, 5), 10)[1]
    at: Index = 8 + named.astype(np.int64)
    length, known = words.integers(words.word(lines, at), 10, most=2)
    known &= words.count[lines] > at
    # Zero bytes are those of a remote frame, or carry no signal anyway.
    keep = ~words.begins(words.word(lines, 4), b"ErrorFrame") & ~(known & (length == 0))
    good &= valid & known & (length <= 64)
    length = np.where(good & keep, length, 0)
    data, whole = read_payload(words, lines, at + 1, length, base, 64)
    frames = Frames(time, bus.astype(np.int16), identifier, extended, length.astype(np.uint8), data)
    return Found(lines, keep, good & whole, frames)


def _asc_identifier(words: Words, at: Index, base: int) -> tuple[npt.NDArray[np.uint32], Flags, Flags]:
    """Identifiers, with an x behind those of 29 bits: number, extended, readable."""
    extended = (words.text[words.stop[at] - 1] | 32) == ord("x")
    number, good = words.integers(at, base, cut=extended.astype(np.int64))
    return number.astype(np.uint32), extended, good & (number < np.where(extended, 1 << 29, 1 << 11))


# Places of the words in lines of TRC 1.x, by the letters that version 2 has for its columns: O time offset in ms, d
# type or direction, I identifier, B bus, L data length code, D data. Version 2 tells them in its header.
_TRC_COLUMNS: dict[str, dict[str, int]] = {
    "1.0": {"O": 1, "I": 2, "L": 3, "D": 4},
    "1.1": {"O": 1, "d": 2, "I": 3, "L": 4, "D": 5},
    "1.2": {"O": 1, "B": 2, "d": 3, "I": 4, "L": 5, "D": 6},
    "1.3": {"O": 1, "B": 2, "d": 3, "I": 4, "L": 6, "D": 7},
}
# Bytes for each data length code of CAN FD.
_LENGTHS = np.array([0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64], np.int64)


def parse_trc(content: bytes) -> tuple[Frames, list[str]]:
    """The data frames of a TRC trace of version 1.0 to 1.3, 2.0 or 2.1, and its faults.

    Channels are numbered as written, from 1; versions without a column for them have channel 1.
    """
    version = re.search(rb"^;\$FILEVERSION=([\d.]+)", content[:65536], re.M)
    told = re.search(rb"^;\$COLUMNS=([\w,]+)", content[:65536], re.M)
    if told:
        columns: Mapping[str, int] = {name: k for k, name in enumerate(told[1].decode("latin-1").split(","))}
    else:
        columns = _TRC_COLUMNS.get(version[1].decode("latin-1") if version else "1.0", _TRC_COLUMNS["1.0"])
    if not {"O", "I", "D"} <= set(columns) or not {"L", "l"} & set(columns):
        return Frames.joined([]), [f"the header's columns {told[1].decode('latin-1') if told else ''} hold no frames"]
    trace = Trace()
    for block in blocks(content):
        words = Words.of(block)
        lines = np.flatnonzero(words.count >= columns["D"])
        lines = lines[words.text[words.start[words.first[lines]]] != ord(";")]
        trace.add(words, _trc(words, lines, columns))
    return trace.result()


def _trc(words: Words, lines: Index, columns: Mapping[str, int]) -> Found:
    """Lines of a TRC trace."""
    every = np.ones(lines.size, bool)
    identifier_at = words.word(lines, columns["I"])
    if "T" in columns:
        kind = words.word(lines, columns["T"])
        fd = words.begins(kind, b"F") | words.equals(kind, b"BI")
        keep = words.equals(kind, b"DT") | fd
    else:
        fd = ~every
        # Lines of other types tell of errors and warnings; in version 1.0 they bear an identifier of their own.
        keep = ~words.equals(identifier_at, b"FFFFFFFF")
        if "d" in columns:
            direction = words.word(lines, columns["d"])
            keep &= words.equals(direction, b"Rx") | words.equals(direction, b"Tx")
    keep &= ~words.equals(words.word(lines, columns["D"]), b"RTR") | (words.count[lines] <= columns["D"])
    time, good = words.numbers(words.word(lines, columns["O"]))
    identifier, valid = words.integers(identifier_at, 16, most=8)
    extended = words.stop[identifier_at] - words.start[identifier_at] > 4
    good &= valid & (identifier < np.where(extended, 1 << 29, 1 << 11))
    bus, numbered = (
        words.integers(words.word(lines, columns["B"]), 10, most=4) if "B" in columns else (every * 1, every)
    )
    told, known = words.integers(words.word(lines, columns.get("l", columns.get("L", 0))), 10, most=2)
    good &= numbered & known
    if "l" in columns:
        length, good = told, good & (told <= 64)
    else:
        length, good = np.where(fd, _LENGTHS[np.minimum(told, 15)], np.minimum(told, 8)), good & (told <= 15)
    length = np.where(good & keep, length, 0)
    data, whole = read_payload(words, lines, columns["D"], length, 16, 64 if int(length.max(initial=0)) > 8 else 8)
    frames = Frames(
        time / 1000, bus.astype(np.int16), identifier.astype(np.uint32), extended, length.astype(np.uint8), data
    )
    return Found(lines, keep, good & whole, frames)


def read_payload(
    words: Words, lines: Index, first: Index | int, length: Index, base: int, width: int
) -> tuple[npt.NDArray[np.uint8], Flags]:
    """Payloads written byte by byte as words.

    Args:
        words, lines: where.
        first: which word of each line is the first byte.
        length: bytes to read, shape (n,).
        base: 10 or 16.
        width: columns of the result.

    Returns:
        payload, shape (n, width), and which lines had all their bytes.
    """
    data = np.zeros((lines.size, width), np.uint8)
    good = words.count[lines] >= first + length
    for k in range(int(length.max(initial=0))):
        which = np.flatnonzero(length > k)
        at = words.word(lines[which], (first if isinstance(first, int) else first[which]) + k)
        data[which, k], readable = words.bytes_of(at, base)
        good[which] &= readable
    return data, good
