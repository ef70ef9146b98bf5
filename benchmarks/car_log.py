"""A long CAN log to measure with: the demo drive again and again, on a bus that carries 2,000 frames/s.

The simulated car sends 460 frames/s; messages of other control units fill the bus up. BLF is written here a column at a
time, since python-can's writer would need minutes.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from codriver.logs.frames import Frames
from codriver.simulate import demo_drive
from codriver.simulate.can_layout import Field, Message, dbc_text
from codriver.simulate.demo import DURATION
from codriver.simulate.network import MESSAGES, names_text

FRAMES_PER_SECOND = 2000
_OTHERS = tuple(
    Message(f"Other{k}", 0x400 + k, 44.0, 8, (Field(f"OTH_Value{k}", "", 0, 16, 0.1),), "GW") for k in range(35)
)
# A CAN_MESSAGE object: header, flags (2: stamps in ns), stamp, channel, flags, length, identifier, payload.
_OBJECT = np.dtype([
    ("signature", "S4"), ("header", "<u2"), ("version", "<u2"), ("size", "<u4"), ("type", "<u4"), ("units", "<u4"),
    ("client", "<u2"), ("object_version", "<u2"), ("stamp", "<u8"), ("channel", "<u2"), ("flags", "u1"),
    ("length", "u1"), ("identifier", "<u4"), ("data", "u1", 8),
])  # fmt: skip
_PER_CONTAINER = 2730  # 128 KiB, as Vector's tools do


@dataclass(frozen=True)
class CarLog:
    """A written log: its files, how many frames it holds and how long it is, s."""

    blf: Path
    dbc: Path
    names: Path
    frames: int
    seconds: float


def write_car_log(folder: Path, seconds: float) -> CarLog:
    """Write car.blf, car.dbc and names.toml into a folder."""
    log = CarLog(folder / "car.blf", folder / "car.dbc", folder / "names.toml", 0, seconds)
    log.dbc.write_text(dbc_text((*MESSAGES, *_OTHERS), "simulated car"), encoding="utf-8")
    log.names.write_text(names_text(), encoding="utf-8")
    round_ = _with_others(demo_drive(1).frames)
    laps = int(np.ceil(seconds / DURATION))
    count = 0
    with log.blf.open("wb") as file:
        file.write(bytes(144))
        for lap in range(laps):
            left = seconds - lap * DURATION
            part = round_ if left >= DURATION else round_.where(round_.time < left)
            _write_containers(file, part, lap * DURATION)
            count += len(part)
        size = file.tell()
        file.seek(0)
        file.write(_file_header(size, count))
    return CarLog(log.blf, log.dbc, log.names, count, seconds)


def _with_others(frames: Frames) -> Frames:
    """The frames with those of other control units, `FRAMES_PER_SECOND` in all, sorted by time."""
    random = np.random.default_rng(5)
    count = int(FRAMES_PER_SECOND * DURATION) - len(frames)
    which = np.arange(count) % len(_OTHERS)
    data = np.zeros((count, 8), np.uint8)
    data[:, :2] = random.integers(0, 256, (count, 2))
    data[:, 7] = np.arange(count) // len(_OTHERS) % 16
    others = Frames(
        np.round(np.arange(count) * (DURATION / count), 6),
        np.zeros(count, np.int16),
        np.array([m.identifier for m in _OTHERS], np.uint32)[which],
        np.zeros(count, bool),
        np.full(count, 8, np.uint8),
        data,
    )
    both = Frames.joined([frames, others])
    return both.where(np.argsort(both.time, kind="stable"))


def _write_containers(file, frames: Frames, shift: float) -> None:
    """The frames as compressed containers, their stamps shifted."""
    objects = np.zeros(len(frames), _OBJECT)
    objects["signature"], objects["header"], objects["version"] = b"LOBJ", 32, 1
    objects["size"], objects["type"], objects["units"] = _OBJECT.itemsize, 1, 2
    objects["stamp"] = np.rint((frames.time + shift) * 1e6).astype(np.uint64) * 1000
    objects["channel"] = frames.bus + 1
    objects["length"], objects["identifier"], objects["data"] = frames.length, frames.identifier, frames.data
    for start in range(0, objects.size, _PER_CONTAINER):
        part = objects[start : start + _PER_CONTAINER].tobytes()
        packed = zlib.compress(part, 1)
        size = 32 + len(packed)
        file.write(struct.pack("<4sHHLL", b"LOBJ", 16, 1, size, 10) + struct.pack("<H6xL4x", 2, len(part)))
        file.write(packed + bytes(size % 4))


def _file_header(size: int, count: int) -> bytes:
    """The header of a BLF file: sizes, count of objects, start and stop of the measurement (here: 1 January 2024)."""
    day = struct.pack("<8H", 2024, 1, 1, 1, 0, 0, 0, 0)
    head = struct.pack("<4sLBBBBBBBBQQLL", b"LOGG", 144, 5, 0, 0, 0, 2, 6, 8, 1, size, size, count, 0)
    return (head + day + day).ljust(144, b"\0")
