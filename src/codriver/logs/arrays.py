"""A recording whose channels are arrays that are fetched when asked for: the base of the readers of known layouts."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

from codriver.logs.names_file import Entry, NamesFile
from codriver.logs.recording import RawSignal, Recording, SourceChannel
from codriver.signals.signal import Array

Fetch = Callable[[], tuple[Array, Array]]


class ArrayRecording(Recording):
    """Channels, each with a function that gives its stamps (s) and values, shape (n,) both.

    Args:
        path: the file or folder.
        format: what it is, for people.
    """

    def __init__(self, path: str, format: str) -> None:
        self.path, self.format = path, format
        self.faults: list[str] = []
        self._channels: dict[str, SourceChannel] = {}
        self._fetch: dict[str, Fetch] = {}

    def add(self, name: str, unit: str, comment: str, fetch: Fetch) -> None:
        """Add a channel."""
        self._channels[name] = SourceChannel(name, unit, comment)
        self._fetch[name] = fetch

    def channels(self) -> Mapping[str, SourceChannel]:
        """All channels."""
        return self._channels

    def load(self, names: Iterable[str]) -> dict[str, RawSignal]:
        """The samples of the channels named."""
        return {
            name: RawSignal(*self._fetch[name](), self._channels[name].unit) for name in names if name in self._channels
        }


def choose_names(candidates: Sequence[Entry], channels: Mapping[str, SourceChannel], where: str) -> NamesFile:
    """The mapping of a known layout: for each standard name the first entry whose sources are all there."""
    chosen: dict[str, Entry] = {}
    for entry in candidates:
        if entry.name not in chosen and all(source in channels for source in entry.source):
            chosen[entry.name] = entry
    return NamesFile(chosen, where)
