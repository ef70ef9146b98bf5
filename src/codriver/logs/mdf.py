"""MDF: measurement files of versions 3 and 4, decoded channels and raw bus logging alike.

A file shows one or both of two faces. *Decoded channels* are read by name with the file's own conversion and unit;
samples that its invalidation bits call invalid are left out, and enumerations give their numbers. *Raw bus logging*
(ASAM's groups "CAN_DataFrame") gives CAN frames, for which a DBC file is needed.

Only the file's structure is read until channels are asked for. Time counts from the file's start of measurement.
"""

from __future__ import annotations

import gc
import sys
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from codriver.errors import FormatError, LogError
from codriver.logs.joined import JoinedRecording
from codriver.logs.mdf_frames import find_bus_groups, read_frames
from codriver.logs.recording import RawSignal, Recording, SourceChannel
from codriver.logs.registry import ReadOptions, reader
from codriver.logs.wording import counted

if TYPE_CHECKING:
    from asammdf import MDF

_TIME = (0, 1)  # kinds of master: none given, time; others are angle, distance, index


class MdfRecording(Recording):
    """The decoded channels of an MDF file.

    A name that occurs in several groups stays bare for the first and is "name@group" for the others; a group without a
    name of its own goes by its number.

    Args:
        path: the file.
        file: the opened file.
        left_out: groups of raw bus events, by number.
    """

    def __init__(self, path: Path, file: MDF, left_out: set[int]) -> None:
        self.path, self.format = str(path), f"MDF {file.version}"
        self.faults: list[str] = []
        self._file = file
        self._channels: dict[str, SourceChannel] = {}
        self._places: dict[str, tuple[int, int]] = {}
        other = set()
        for group, index, channel in _numeric(file, left_out):
            if not _on_time(file, group):
                other.add(_group_name(file, group))
                continue
            name = self._free_name(str(channel.name), _group_name(file, group))
            self._channels[name] = SourceChannel(name, _unit(channel), _plain(channel.comment))
            self._places[name] = group, index
        if other:
            self.faults.append(
                f"groups over angle, distance or index, no time, are left out: {', '.join(sorted(other))}"
            )

    def channels(self) -> Mapping[str, SourceChannel]:
        """The numeric channels that have samples."""
        return self._channels

    def load(self, names: Iterable[str]) -> dict[str, RawSignal]:
        """The channels named; one that cannot be read is left out and told."""
        wanted: dict[int, list[str]] = {}
        for name in names:
            if name in self._places:
                wanted.setdefault(self._places[name][0], []).append(name)
        loaded: dict[str, RawSignal] = {}
        for members in wanted.values():
            try:  # a group at once, whose records are then read once
                signals = self._select(members)
            except Exception:  # a damaged block shows as any of a dozen errors of the library
                signals = [signal for name in members for signal in self._select_alone(name)]
            for name, signal in signals:
                time, values = np.asarray(signal.timestamps, np.float64), np.asarray(signal.samples)
                if values.ndim != 1 or values.dtype.kind not in "uifb" or values.shape != time.shape:
                    self._tell(f"channel '{name}' holds {values.dtype} of shape {values.shape}, no numbers; left out")
                    continue
                loaded[name] = RawSignal(time, values.astype(np.float64, copy=False), self._channels[name].unit)
        return loaded

    def _select(self, names: list[str]) -> list[tuple[str, Any]]:
        """The library's signals of these names, invalid samples taken out, enumerations as numbers."""
        places = [(None, *self._places[name]) for name in names]
        signals = self._file.select(places, ignore_value2text_conversions=True, validate=True)
        return list(zip(names, signals, strict=True))

    def _select_alone(self, name: str) -> list[tuple[str, Any]]:
        """One signal, or none if it cannot be read, which is told."""
        try:
            return self._select([name])
        except Exception as error:
            self._tell(f"channel '{name}' cannot be read, its data are damaged ({type(error).__name__}); left out")
            return []

    def _free_name(self, name: str, group: str) -> str:
        """The name, or one that says the group too where it is taken."""
        if name not in self._channels:
            return name
        name = longer = f"{name}@{group}"
        count = 1
        while longer in self._channels:
            count += 1
            longer = f"{name}#{count}"
        return longer

    def _tell(self, fault: str) -> None:
        """Add a fault once."""
        if fault not in self.faults:
            self.faults.append(fault)


def _numeric(file: MDF, left_out: set[int]) -> Iterator[tuple[int, int, Any]]:
    """Group, index and description of the channels that hold numbers and have samples; masters left out."""
    groups: list[Any] = file.groups
    for number, group in enumerate(groups):
        if number in left_out or not group.channel_group.cycles_nr:
            continue
        for index, channel in enumerate(group.channels):
            if index == file.masters_db.get(number):
                continue
            kind = getattr(channel, "dtype_fmt", None)
            # In version 4, data types beyond 5 are text, bytes and dates, whatever their samples look like.
            if kind is None or (file.version >= "4" and channel.data_type > 5):
                continue
            kind = np.dtype(kind)
            if kind.shape == () and kind.kind in "uifb":
                yield number, index, channel


def _on_time(file: MDF, group: int) -> bool:
    """Whether a group has a master channel, and it is time."""
    master = file.masters_db.get(group)
    if master is None:
        return False
    return getattr(file.groups[group].channels[master], "sync_type", 1) in _TIME


def _group_name(file: MDF, group: int) -> str:
    """A group's name, or its number."""
    return getattr(file.groups[group].channel_group, "acq_name", None) or str(group)


def _unit(channel: Any) -> str:
    """A channel's unit, which may stand at its conversion."""
    return str(channel.unit or getattr(channel.conversion, "unit", "") or "")


def _plain(comment: Any) -> str:
    """A comment without its XML."""
    text = str(comment or "")
    if "<TX>" in text:
        text = text.split("<TX>", 1)[1].split("</TX>", 1)[0]
    return "" if text.startswith("<") else text.strip()


def open_mdf(path: Path) -> MDF:
    """Open an MDF file.

    Raises:
        LogError: asammdf is not installed.
        FormatError: it is no MDF file, or is damaged.
    """
    with path.open("rb") as file:
        head = file.read(64)
    if not head.startswith((b"MDF ", b"UnFinMF ")) or len(head) < 64:
        raise FormatError(
            f"{path} begins with {head[:8]!r}",
            "an MDF file, which begins with 'MDF'",
            "check that the suffix fits the format",
        )
    try:
        from asammdf import MDF
    except ImportError:
        raise LogError(
            f"{path} is an MDF file, and the package asammdf, which reads them, is not installed",
            "asammdf 7.4 or newer",
            "pip install 'codriver[mdf]'",
        ) from None
    opened, cause = _try(MDF, path)
    if opened is None:
        raise FormatError(
            f"{path} is damaged: {cause[:160]}",
            "a complete MDF file",
            "copy it again; a file whose writer was stopped can often be finalised by the tool that recorded it",
        )
    return opened


def _try(opener: type[MDF], path: Path) -> tuple[MDF | None, str]:
    """The opened file, or why it cannot be opened."""
    hook = sys.unraisablehook
    # The library's half-made object stumbles over itself when it is given up, and Python would print that.
    sys.unraisablehook = lambda _: None
    try:
        try:
            return opener(path), ""
        except Exception as error:  # see MdfRecording.load
            cause = str(error)
        gc.collect()
        return None, cause
    finally:
        sys.unraisablehook = hook


@reader(".mf4", ".mdf", ".dat", title="MDF measurement file")
def read_mdf(path: Path, options: ReadOptions) -> Recording:
    """Open an MDF file: its frames by the database given, its decoded channels, or both."""
    from codriver.logs.can_recording import CanRecording

    file = open_mdf(path)
    raw, can = find_bus_groups(file)
    decoded = MdfRecording(path, file, raw)
    if not can:
        if not decoded.channels():
            raise LogError(
                f"{path} (MDF {file.version}) has {len(file.groups)} groups and no numeric channel with samples",
                "decoded channels, or raw CAN frames",
                "check how it was recorded",
            )
        return decoded
    frames = sum(file.groups[group].channel_group.cycles_nr for group in can)
    if options.dbc is None and decoded.channels():
        decoded.faults.append(
            f"{counted(frames, 'raw CAN frame', 'is', 'are')} left out; a DBC file (--dbc) would decode them"
        )
        return decoded
    form = f"MDF {file.version}, raw CAN frames"
    traced = CanRecording(str(path), form, read_frames(file, can), options.dbc, options.bus, [])
    return JoinedRecording(str(path), form, [traced, decoded]) if decoded.channels() else traced
