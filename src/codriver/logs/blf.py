"""Vector's binary log files (BLF) as columns of CAN frames.

A file is a header ("LOGG") and a row of objects. Nearly all of them are containers, most often compressed by zlib; what
they contain, joined end to end, is another row of objects, which may span two containers:

    offset  base header, 16 bytes        offset  rest of the header, 16 bytes (version 1) or 24 (version 2)
    0       signature "LOBJ"             16      flags: 1 for stamps in units of 10 us, 2 for 1 ns
    4       size of the header, u16      24      stamp, u64, since the start of the measurement
    6       version of the header, u16
    8       size of the object, u32
    12      type of the object, u32

Behind an object lie 0 to 3 bytes of padding. The objects of a block of containers are found all at once: their sizes
must lead from each signature in the block to the next. Where they do not (a payload that spells "LOBJ", damage) the
objects are walked one by one. Stamps come out in seconds since the start of the measurement, as the file has them.

The layout of the objects is that which python-can documents in `can.io.blf`, after the library Vector BLF.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from codriver.errors import FormatError
from codriver.logs.frames import Frames
from codriver.logs.wording import counted

_SIGNATURE = b"LOBJ"
_BASE = struct.Struct("<4sHHLL")
_CONTAINER = struct.Struct("<H6xL4x")
_CONTAINER_TYPE = 10
# Padding at most: the next signature starts no later than this behind an object.
_PADDING = 4
# Contents parsed at a time, bytes: large enough for numpy to pay, small enough for the cache.
_BLOCK = 1 << 21
# No object of a measurement is larger; a size beyond it is damage.
_LARGEST = 1 << 24

_HEADER = np.dtype({
    "names": ["header", "version", "size", "type", "flags", "stamp"],
    "formats": ["<u2", "<u2", "<u4", "<u4", "<u4", "<u8"],
    "offsets": [4, 6, 8, 12, 16, 24],
    "itemsize": 32,
})  # fmt: skip


@dataclass(frozen=True)
class _Kind:
    """A type of object that carries a frame: its fields behind the header, and the bit of `flags` for remote frames."""

    fields: np.dtype[Any]
    remote: int
    data: int  # offset of the payload behind the header
    room: int  # bytes of the payload at most


def _fields(itemsize: int, **fields: tuple[str, int]) -> np.dtype[Any]:
    """A record of named fields, each with its type and offset."""
    formats, offsets = zip(*fields.values(), strict=True)
    return np.dtype({"names": list(fields), "formats": list(formats), "offsets": list(offsets), "itemsize": itemsize})


_CAN = _Kind(_fields(8, channel=("<u2", 0), flags=("u1", 2), length=("u1", 3), id=("<u4", 4)), 0x80, 8, 8)
_FD = _Kind(_fields(20, channel=("<u2", 0), flags=("u1", 2), id=("<u4", 4), length=("u1", 14)), 0x80, 20, 64)
_FD_64 = _Kind(
    _fields(40, channel=("u1", 0), length=("u1", 2), id=("<u4", 4), flags=("<u4", 12), end=("u1", 35)), 0x10, 40, 64
)
# CAN_MESSAGE, CAN_MESSAGE2, CAN_FD_MESSAGE, CAN_FD_MESSAGE_64; error frames and all else are passed over.
_KINDS = {1: _CAN, 86: _CAN, 100: _FD, 101: _FD_64}


def parse_blf(content: bytes) -> tuple[Frames, list[str]]:
    """The data frames of a BLF file, and what was wrong with it.

    A file that was cut off, or never closed, yields the frames before the cut. Channels are numbered from 1, as in the
    file; time is in s since the start of the measurement.

    Raises:
        FormatError: it is no BLF file.
    """
    if len(content) < 8 or content[:4] != b"LOGG":
        raise FormatError(
            f"no BLF file: it starts with {content[:4]!r}",
            "a file that starts with b'LOGG'",
            "check that the suffix fits the format, and that the file was copied whole",
        )
    faults: list[str] = []
    columns: list[Frames] = []
    tail, damaged = b"", 0
    for block in _blocks(content, faults):
        if block is None:  # a gap: what is left of the object before it will not be completed
            damaged += bool(tail)
            tail = b""
            continue
        tail, bad = _parse(tail + block, columns)
        damaged += bad
    if damaged:
        faults.append(f"{counted(damaged, 'damaged place')} between the frames passed over")
    if len(tail) >= _BASE.size and not faults:
        faults.append("the file ends within an object: it was cut off; the frames before are read")
    told = struct.unpack_from("<Q", content, 16)[0] if len(content) >= 24 else 0
    if told != len(content) and not faults:
        faults.append(
            f"the header tells of {told} bytes, the file has {len(content)}: the logger did not close it; "
            "the frames that reached the file are read"
        )
    return Frames.joined(columns), faults


def _blocks(content: bytes, faults: list[str]) -> Iterator[bytes | None]:
    """The contents of the containers in blocks; None where some are missing between two blocks."""
    position = struct.unpack_from("<L", content, 4)[0]
    parts: list[bytes] = []
    gathered = 0
    view = memoryview(content)
    while True:
        found = content.find(_SIGNATURE, position)
        if found < 0 or found + _BASE.size > len(content):
            if len(content) - position >= _BASE.size or found >= 0:
                faults.append(f"no object in the last {counted(len(content) - position, 'byte')}: the file was cut off")
            break
        if found - position > _PADDING:
            faults.append(f"{counted(found - position, 'damaged byte')} at byte {position} passed over")
            yield b"".join(parts)
            yield None
            parts, gathered = [], 0
        _, _, _, size, kind = _BASE.unpack_from(content, found)
        if size < _BASE.size:
            position = found + len(_SIGNATURE)
            continue
        whole = found + size <= len(content)
        if not whole:
            faults.append("the file ends within a container: it was cut off; the frames before the cut are read")
        if kind == _CONTAINER_TYPE:
            part, intact = _unpack(view[found + _BASE.size : found + size])
        else:  # an object outside any container
            part, intact = content[found : found + size], True
        parts.append(part)
        gathered += len(part)
        if not intact and whole:
            faults.append(f"the container at byte {found} is damaged; what could be unpacked of it is read")
        if gathered >= _BLOCK or not intact:
            yield b"".join(parts)
            parts, gathered = [], 0
            if not intact and whole:
                yield None
        position = found + size
    yield b"".join(parts)


def _unpack(body: memoryview) -> tuple[bytes, bool]:
    """What a container holds, and whether that is all of it."""
    if len(body) < _CONTAINER.size:
        return b"", False
    method, size = _CONTAINER.unpack_from(body)
    packed = body[_CONTAINER.size :]
    if method == 0:
        return bytes(packed), len(packed) >= size
    if method != 2:
        return b"", False
    try:
        return zlib.decompress(packed, bufsize=min(max(size, 1), _LARGEST)), True
    except zlib.error:
        return _unpack_some(packed), False


def _unpack_some(packed: memoryview) -> bytes:
    """What can be unpacked of a damaged zlib stream."""
    unpack = zlib.decompressobj()
    parts = []
    try:
        for start in range(0, len(packed), 256):
            parts.append(unpack.decompress(packed[start : start + 256]))
    except zlib.error:
        pass
    return b"".join(parts)


def _parse(block: bytes, columns: list[Frames]) -> tuple[bytes, int]:
    """Add the frames of a block to the columns.

    Returns:
        what is left at the end (the beginning of an object, or nothing), and the number of damaged places.
    """
    # Zeros behind, so that fixed-size windows may reach beyond the end.
    bytes_ = np.frombuffer(block + bytes(128), np.uint8)
    places, rest, damaged = _find_objects(bytes_[: len(block)])
    headers = _windows(bytes_, places, _HEADER)
    for_frames = np.isin(headers["type"], list(_KINDS)) & np.isin(headers["version"], (1, 2))
    for_frames &= (headers["header"] >= _HEADER.itemsize) & (headers["header"] <= headers["size"])
    places, headers = places[for_frames], headers[for_frames]
    if places.size:
        _add_frames(bytes_, places, headers, columns)
    return block[rest:], damaged


def _find_objects(block: npt.NDArray[np.uint8]) -> tuple[npt.NDArray[np.int64], int, int]:
    """The places of all whole objects, the place of what is left behind the last, and the number of damaged places."""
    signature = np.frombuffer(_SIGNATURE, np.uint8)
    places = np.flatnonzero(block[:-15] == signature[0])
    for k in (1, 2, 3):
        places = places[block[places + k] == signature[k]]
    if not places.size:
        return places, max(0, block.size - _BASE.size), int(block.size > _BASE.size)
    sizes = _windows(block, places + 8, np.dtype("<u4")).astype(np.int64)
    ends = places + sizes
    gaps = places[1:] - ends[:-1]
    sane = places[0] <= _PADDING and ((gaps >= 0) & (gaps <= _PADDING)).all() and _BASE.size <= sizes[-1] <= _LARGEST
    if sane:
        if ends[-1] > block.size:
            return places[:-1], int(places[-1]), 0
        return places, int(ends[-1]), 0
    return _walk(places, ends, block.size)


def _walk(
    places: npt.NDArray[np.int64], ends: npt.NDArray[np.int64], size: int
) -> tuple[npt.NDArray[np.int64], int, int]:
    """The same, object by object, for blocks in which a signature is no object or an object is damaged."""
    following = np.searchsorted(places, ends).tolist()
    at, until = places.tolist(), ends.tolist()
    kept: list[int] = []
    damaged, k, rest = int(at[0] > _PADDING), 0, 0
    while k < len(at):
        if not _BASE.size <= until[k] - at[k] <= _LARGEST:
            damaged += 1
            k += 1
            rest = at[k] if k < len(at) else size
        elif until[k] > size:
            rest = at[k]
            break
        else:
            kept.append(at[k])
            rest = until[k]
            after = following[k]
            damaged += after < len(at) and at[after] - until[k] > _PADDING
            k = after
    return np.array(kept, np.int64), rest, damaged


def _add_frames(
    bytes_: npt.NDArray[np.uint8],
    places: npt.NDArray[np.int64],
    headers: npt.NDArray[Any],
    columns: list[Frames],
) -> None:
    """Add the objects at the places, all of them frames, in their order."""
    count = places.size
    bodies = places + headers["header"]
    keep = np.ones(count, bool)
    bus, identifier = np.zeros(count, np.int16), np.zeros(count, np.uint32)
    length = np.zeros(count, np.uint8)
    wide = bool(np.isin(headers["type"], (100, 101)).any())
    data = np.zeros((count, 64 if wide else 8), np.uint8)
    for number, kind in _KINDS.items():
        which = np.flatnonzero(headers["type"] == number)
        if not which.size:
            continue
        fields = _windows(bytes_, bodies[which], kind.fields)
        size = headers["size"][which].astype(np.int64) - headers["header"][which]
        # An object too small for its own fields is damaged.
        keep[which] = ((fields["flags"] & kind.remote) == 0) & (size >= kind.data)
        bus[which], identifier[which] = fields["channel"], fields["id"]
        length[which] = np.minimum(fields["length"], kind.room)
        # Loggers may tell of more bytes than they stored; those missing are zero.
        stored = np.minimum(length[which], np.maximum(size - kind.data, 0))
        if kind is _FD_64:
            end = fields["end"].astype(np.int64)
            stored = np.where(end > 0, np.minimum(stored, np.maximum(end - headers["header"][which] - 40, 0)), stored)
        payload = _windows(bytes_, bodies[which] + kind.data, np.dtype(f"V{kind.room}")).view(np.uint8)
        payload = payload.reshape(-1, kind.room) * (np.arange(kind.room) < stored[:, None])
        data[which, : kind.room] = payload
    stamp = headers["stamp"].astype(np.float64) / np.where(headers["flags"] == 1, 1e5, 1e9)
    extended = (identifier & 0x80000000) != 0
    frames = Frames(stamp, bus, identifier & np.uint32(0x1FFFFFFF), extended, length, data)
    columns.append(frames if keep.all() else frames.where(keep))


def _windows(bytes_: npt.NDArray[np.uint8], places: npt.NDArray[np.int64], dtype: np.dtype[Any]) -> npt.NDArray[Any]:
    """The records that start at the places, copied together, shape (n,)."""
    count = max(0, bytes_.size - dtype.itemsize + 1)
    overlapping = np.lib.stride_tricks.as_strided(
        bytes_[:count].view(np.uint8), shape=(count, dtype.itemsize), strides=(1, 1)
    ).view(f"V{dtype.itemsize}")
    return overlapping[:, 0][places].view(dtype)
