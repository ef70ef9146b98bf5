"""What a reader gives: a recording, whose channels are loaded only when asked for."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from codriver.signals.signal import Array

if TYPE_CHECKING:
    from codriver.logs.names_file import NamesFile


@dataclass(frozen=True)
class SourceChannel:
    """A channel of a recording, by the source's own name.

    Attributes:
        name: as the source calls it: "Message.Signal" for CAN, the column's header for tables.
        unit: as the source spells it; "" where it does not say.
        comment: what the source says of it.
    """

    name: str
    unit: str = ""
    comment: str = ""


@dataclass(frozen=True, eq=False)
class RawSignal:
    """A channel's samples as the source has them: unit not converted, time not mended."""

    time: Array
    values: Array
    unit: str = ""


class Recording(ABC):
    """An opened recording.

    A reader returns one; `codriver.logs.read` turns it into a Log. `default_names` is set for layouts we know, so that
    they need no names file.

    Attributes:
        path: the file or folder.
        format: what it is, for people ("BLF, CAN trace").
        faults: what was wrong and could be got round, one sentence each; readers may add to it while loading.
        default_names: the mapping of a known layout, or None.
    """

    path: str
    format: str
    faults: list[str]
    default_names: NamesFile | None = None

    @abstractmethod
    def channels(self) -> Mapping[str, SourceChannel]:
        """All channels that have samples, by the source's own name."""

    @abstractmethod
    def load(self, names: Iterable[str]) -> dict[str, RawSignal]:
        """The samples of the channels named; names that are not channels are left out."""
