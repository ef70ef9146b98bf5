"""The log files that candump writes on Linux (`candump -l`).

    (1436509052.249713) can0 12345678#0102030405060708
    (1436509052.250012) can1 123##1AABBCCDD                 CAN FD: a second "#" and a digit of flags
    (1436509052.250012) can1 123#R8                         a remote frame: passed over, as error frames are

Stamps are seconds since 1970 and stay so: the file does not tell when the measurement began. A line that looks like a
frame and cannot be read as one counts as a fault.
"""

from __future__ import annotations

import re

import numpy as np
import numpy.typing as npt

from codriver.logs.frames import Frames
from codriver.logs.text_tokens import Index, Words, blocks
from codriver.logs.text_traces import Found, Trace


def parse_candump(content: bytes) -> tuple[Frames, list[str]]:
    """The data frames of a log file that candump wrote, and its faults.

    The channel is the number at the end of the interface's name (can1: 1), or 0. Where two interfaces would so be one
    channel, they are numbered as they appear, and a fault says so.
    """
    trace = Trace()
    names: dict[str, int] = {}
    for block in blocks(content):
        words = Words.of(block)
        lines = np.flatnonzero(words.count >= 3)
        lines = lines[words.text[words.start[words.first[lines]]] == ord("(")]
        trace.add(words, _candump(words, lines, names))
    frames, faults = trace.result()
    numbers = [_channel(name) for name in names]
    if len(set(numbers)) < len(numbers):
        faults.append(f"the interfaces {', '.join(names)} are numbered {', '.join(map(str, range(len(names))))}")
        numbers = list(range(len(names)))
    bus = np.array(numbers or [0], np.int16)[frames.bus]
    return Frames(frames.time, bus, frames.identifier, frames.extended, frames.length, frames.data), faults


def _channel(name: str) -> int:
    """The number at the end of an interface's name."""
    digits = re.search(r"\d{1,4}$", name)
    return int(digits[0]) if digits else 0


def _candump(words: Words, lines: Index, names: dict[str, int]) -> Found:
    """Lines of a candump log; `bus` is the place of the interface's name among `names`, which grow."""
    stamp_at, frame_at = words.word(lines, 0), words.word(lines, 2)
    time, good = words.numbers_between(words.start[stamp_at] + 1, words.stop[stamp_at] - 1)
    start, stop = words.start[frame_at], words.stop[frame_at]
    extended = words.text[start + 3] != ord("#")
    hash_at = start + np.where(extended, 8, 3)
    good &= (words.text[hash_at] == ord("#")) & (hash_at < stop)
    identifier, valid = words.integers_between(start, hash_at, 16, most=8)
    good &= valid
    fd = words.text[hash_at + 1] == ord("#")
    # The flag 0x20000000 marks an error frame, an R behind the hash a remote frame.
    keep = ((identifier & 0x20000000) == 0) & ((words.text[hash_at + 1] | 32) != ord("r"))
    first = hash_at + np.where(fd, 3, 1)
    # Behind the data, "_" and a digit may tell a data length code above 8.
    coded = ~fd & (words.text[stop - 2] == ord("_")) & (stop - 2 >= first)
    characters = np.where(coded, stop - 2, stop) - first
    length = characters // 2
    good &= (characters >= 0) & (characters % 2 == 0) & (length <= np.where(fd, 64, 8))
    length = np.where(good & keep, length, 0)
    data = np.zeros((lines.size, 64 if int(length.max(initial=0)) > 8 else 8), np.uint8)
    for k in range(int(length.max(initial=0))):
        which = np.flatnonzero(length > k)
        data[which, k], readable = words.bytes_at(first[which] + 2 * k)
        good[which] &= readable
    bus = _interfaces(words, words.word(lines, 1), names)
    number = (identifier & 0x1FFFFFFF).astype(np.uint32)
    good &= extended | (number < 1 << 11)
    return Found(lines, keep, good, Frames(time, bus, number, extended, length.astype(np.uint8), data))


def _interfaces(words: Words, at: Index, names: dict[str, int]) -> npt.NDArray[np.int16]:
    """The place of each interface's name among all names so far."""
    # Names are few: a number made of the characters tells them apart, and one of each is read as text.
    length = np.minimum(words.stop[at] - words.start[at], 32)
    code = np.zeros(at.size, np.uint64)
    for k in range(int(length.max(initial=0))):
        code = np.where(k < length, code * np.uint64(257) + words.text[words.start[at] + k], code)
    _, example, which = np.unique(code, return_index=True, return_inverse=True)
    places = np.zeros(example.size, np.int16)
    for k in np.argsort(example).tolist():
        word = at[example[k]]
        name = words.text[words.start[word] : words.stop[word]].tobytes().decode("latin-1")
        places[k] = names.setdefault(name, len(names))
    return places[which]
