"""Several recordings of one drive as one: raw CAN beside decoded channels, CAN beside an inertial unit."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from codriver.logs.names_file import NamesFile
from codriver.logs.recording import RawSignal, Recording, SourceChannel


class JoinedRecording(Recording):
    """Recordings on one clock, shown as one; of channels with the same name the first recording's counts.

    Args:
        path: the file or folder they all come from.
        format: what it is, for people.
        parts: the recordings.
        default_names: the mapping of a known layout, or None.
    """

    def __init__(
        self, path: str, format: str, parts: Iterable[Recording], default_names: NamesFile | None = None
    ) -> None:
        self.path, self.format, self.default_names = path, format, default_names
        self._parts = tuple(parts)
        self.faults = [fault for part in self._parts for fault in part.faults]

    def channels(self) -> Mapping[str, SourceChannel]:
        """The channels of all parts."""
        return {name: channel for part in reversed(self._parts) for name, channel in part.channels().items()}

    def load(self, names: Iterable[str]) -> dict[str, RawSignal]:
        """The samples of the channels named, each from the first part that has it."""
        missing, loaded = set(names), {}
        for name in sorted(missing):
            holders = [part.format for part in self._parts if name in part.channels()]
            told = f"'{name}' is there more than once; that of {holders[0]} is taken" if len(holders) > 1 else ""
            if told and told not in self.faults:
                self.faults.append(told)
        for part in self._parts:
            found = part.load(missing & set(part.channels()))
            loaded.update(found)
            missing -= set(found)
            self.faults.extend(fault for fault in part.faults if fault not in self.faults)
        return loaded
