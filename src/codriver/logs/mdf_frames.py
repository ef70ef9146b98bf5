"""Raw bus logging in MDF 4: the groups that hold bus events, and their CAN frames as columns.

ASAM's bus logging standard puts a frame's parts into channels "CAN_DataFrame.ID", ".IDE", ".DLC", ".DataLength",
".DataBytes", ".BusChannel". Loggers differ in what they leave out: the length follows from the DLC where only that is
given, and an extended identifier may show in bit 31 instead of in IDE.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from codriver.logs.frames import Frames

if TYPE_CHECKING:
    from asammdf import MDF

_PLAIN_BUS_EVENT = 4  # flag of a channel group
_EXTENDED = 1 << 31
_IDENTIFIER = (1 << 29) - 1
# Bytes of a CAN FD frame by its DLC.
_LENGTHS = np.array([0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64], np.uint8)


def find_bus_groups(file: MDF) -> tuple[set[int], list[int]]:
    """The groups of raw bus events of any kind, and those of CAN data frames that have samples."""
    raw, can = set(), []
    groups: list[Any] = file.groups
    for number, group in enumerate(groups):
        names = [str(channel.name) for channel in group.channels]
        frames = any(name.startswith("CAN_DataFrame") and name.endswith(".DataBytes") for name in names)
        if frames and group.channel_group.cycles_nr:
            can.append(number)
        if frames or (file.version >= "4" and group.channel_group.flags & _PLAIN_BUS_EVENT):
            raw.add(number)
    return raw, can


def read_frames(file: MDF, groups: list[int]) -> Frames:
    """The CAN data frames of these groups, in the order of time."""
    parts = [_read_group(file, group) for group in groups]
    width = max(part.data.shape[1] for part in parts)
    time = np.concatenate([part.time for part in parts])
    order = np.argsort(time, kind="stable") if len(parts) > 1 else np.arange(time.size)
    data = np.zeros((time.size, width), np.uint8)
    start = 0
    for part in parts:
        data[start : start + len(part), : part.data.shape[1]] = part.data
        start += len(part)
    return Frames(
        time[order],
        np.concatenate([part.bus for part in parts])[order],
        np.concatenate([part.identifier for part in parts])[order],
        np.concatenate([part.extended for part in parts])[order],
        np.concatenate([part.length for part in parts])[order],
        data[order],
    )


def _read_group(file: MDF, group: int) -> Frames:
    """The frames of one group."""
    places: dict[str, int] = {}
    channels: list[Any] = file.groups[group].channels
    for index, channel in enumerate(channels):
        name = str(channel.name)
        if name.startswith("CAN_DataFrame") and "." in name:
            places.setdefault(name.rsplit(".", 1)[1], index)
    wanted = [part for part in ("ID", "IDE", "DataBytes", "DataLength", "DLC", "BusChannel") if part in places]
    signals = file.select([(None, group, places[part]) for part in wanted], raw=True, copy_master=False)
    columns = {part: np.asarray(signal.samples) for part, signal in zip(wanted, signals, strict=True)}
    time = np.asarray(signals[0].timestamps, np.float64)
    identifier: npt.NDArray[np.uint32] = columns["ID"].astype(np.uint32)
    extended = (identifier & _EXTENDED) != 0
    if "IDE" in columns:
        extended |= columns["IDE"].astype(bool)
    payload = _payload(columns["DataBytes"])
    if "DataLength" in columns:
        length = columns["DataLength"].astype(np.uint8)
    elif "DLC" in columns:
        length = _LENGTHS[np.minimum(columns["DLC"], 15)]
    else:
        length = np.full(time.size, payload.shape[1], np.uint8)
    length = np.minimum(length, payload.shape[1]).astype(np.uint8)
    payload[np.arange(payload.shape[1]) >= length[:, None]] = 0
    bus = columns.get("BusChannel", np.zeros(time.size)).astype(np.int16)
    return Frames(time, bus, (identifier & _IDENTIFIER).astype(np.uint32), extended, length, payload)


def _payload(column: npt.NDArray[np.generic]) -> npt.NDArray[np.uint8]:
    """Data bytes of shape (n, 8) or (n, 64); rows of their own length come as objects."""
    if column.dtype == object:
        longest = max((len(row) for row in column), default=0)
        rows = np.zeros((column.size, longest), np.uint8)
        for number, row in enumerate(column):
            rows[number, : len(row)] = np.frombuffer(bytes(row), np.uint8)
    else:
        rows = np.asarray(column, np.uint8).reshape(column.shape[0], -1)
    wide = np.zeros((rows.shape[0], 8 if rows.shape[1] <= 8 else 64), np.uint8)
    wide[:, : min(rows.shape[1], 64)] = rows[:, :64]
    return wide
