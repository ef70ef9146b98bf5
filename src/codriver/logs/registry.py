"""The registry of readers: by suffix, or by the look of a folder."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Protocol

from codriver.errors import FormatError, LogError
from codriver.logs.recording import Recording


@dataclass(frozen=True)
class ReadOptions:
    """What a reader may need beside the path.

    Attributes:
        dbc: path of the CAN database; None where the caller gave none.
        bus: CAN channel to keep; None keeps all.
        rate: rows a second of a table without a time column; None where nobody said.
    """

    dbc: Path | None = None
    bus: int | None = None
    rate: float | None = None


class ReaderFunction(Protocol):
    """A reader: path and options in, recording out. Raises LogError."""

    def __call__(self, path: Path, options: ReadOptions) -> Recording:
        """Open a recording."""
        ...


@dataclass(frozen=True)
class Reader:
    """A registered reader: the function, the suffixes it reads, and a test for folders."""

    function: ReaderFunction
    suffixes: tuple[str, ...]
    folder: Callable[[Path], bool] | None
    title: str


_READERS: list[Reader] = []
# Modules that register readers when they are imported; imported on first use only, since some wake heavy libraries.
_BUILT_IN = ("can_trace", "mdf", "table", "comma2k19", "nuscenes", "iracing")


def reader(
    *suffixes: str, title: str, folder: Callable[[Path], bool] | None = None
) -> Callable[[ReaderFunction], ReaderFunction]:
    """Register a function as the reader of files with these suffixes, or of folders for which `folder` is true.

    A later registration of a suffix takes precedence, so users can replace a reader.
    """

    def register(function: ReaderFunction) -> ReaderFunction:
        entry = Reader(function, tuple(s.lower() for s in suffixes), folder, title)
        if function.__module__.startswith("codriver.logs."):
            _READERS.append(entry)  # imported on first use, perhaps after a user's own: that one stays ahead
        else:
            _READERS.insert(0, entry)
        return function

    return register


def formats() -> list[Reader]:
    """All readers, the one that takes precedence first."""
    for module in _BUILT_IN:
        import_module(f"codriver.logs.{module}")
    return list(_READERS)


def find_reader(path: Path) -> Reader:
    """The reader for a path.

    Raises:
        LogError: the path does not exist.
        FormatError: no reader knows it.
    """
    if not path.exists():
        raise LogError(f"{path} does not exist", "a recording: a file or a folder of a known layout", "check the path")
    for candidate in formats():
        if path.is_dir():
            if candidate.folder is not None and candidate.folder(path):
                return candidate
        elif path.name.lower().endswith(candidate.suffixes):  # ".csv.gz" is one suffix
            return candidate
    known = sorted({suffix for candidate in formats() for suffix in candidate.suffixes})
    folders = sorted(candidate.title for candidate in formats() if candidate.folder)
    raise FormatError(
        f"{path} is a folder of no known layout"
        if path.is_dir()
        else f"{path} has no suffix"
        if not path.suffix
        else f"'{path.suffix}' is no known suffix ({path})",
        f"a file ending in {', '.join(known)}, or a folder: {'; '.join(folders)}",
        "convert the recording to one of these, such as CSV or Parquet with a column 'time'",
    )
