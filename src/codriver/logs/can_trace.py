"""Readers of raw CAN traces: BLF, ASC, TRC and candump's log files, each also packed by gzip.

The frames get their signals from a DBC file, which the caller gives. Times are seconds since the start of the
measurement, as the trace has them, in BLF, ASC and TRC; a candump log knows no start: its times are seconds since 1970.
"""

from __future__ import annotations

import gzip
import re
import zlib
from collections.abc import Callable
from pathlib import Path

from codriver.errors import FormatError, LogError
from codriver.logs.blf import parse_blf
from codriver.logs.can_recording import CanRecording
from codriver.logs.candump import parse_candump
from codriver.logs.csv_layout import look
from codriver.logs.frames import Frames
from codriver.logs.recording import Recording
from codriver.logs.registry import ReadOptions, reader
from codriver.logs.text_traces import parse_asc, parse_trc


@reader(".blf", ".blf.gz", title="BLF, CAN trace")
def read_blf(path: Path, options: ReadOptions) -> CanRecording:
    """Vector's binary log; see `codriver.logs.blf`."""
    return _recording(path, options, "BLF, CAN trace", parse_blf, "")


@reader(".asc", ".asc.gz", title="ASC, CAN trace")
def read_asc(path: Path, options: ReadOptions) -> CanRecording:
    """Vector's text log; see `codriver.logs.text_traces`."""
    return _recording(path, options, "ASC, CAN trace", parse_asc, "0.0160 1 39Bx Rx d 8 01 02 03 04 05 06 07 08")


@reader(".trc", ".trc.gz", title="TRC, CAN trace")
def read_trc(path: Path, options: ReadOptions) -> CanRecording:
    """PEAK's text log; see `codriver.logs.text_traces`."""
    return _recording(path, options, "TRC, CAN trace", parse_trc, "1) 1059.9 Rx 0300 7 00 00 00 00 04 00 00")


@reader(".log", ".log.gz", title="candump log, CAN trace; or a table")
def read_candump(path: Path, options: ReadOptions) -> Recording:
    """The log files of candump, see `codriver.logs.candump`; a file of rows of numbers below a header is a table."""
    if _is_table(path):
        from codriver.logs.table import CsvRecording

        return CsvRecording(path, options.rate)
    return _recording(path, options, "candump log, CAN trace", parse_candump, "(1436509052.249713) can0 123#01020304")


def _recording(
    path: Path,
    options: ReadOptions,
    title: str,
    parse: Callable[[bytes], tuple[Frames, list[str]]],
    line: str,
) -> CanRecording:
    """The recording of a trace.

    Args:
        path, options: what to read.
        title: the format, for people.
        parse: the format's parser.
        line: a line as such a trace has it, for the error message; "" for binary formats.

    Raises:
        LogError: the file cannot be read.
        FormatError: nothing in it is a frame.
    """
    content, faults = _content(path)
    try:
        frames, found = parse(content)
    except FormatError as error:
        raise FormatError(f"{path}: {error.found}", error.expected, error.do) from None
    faults.extend(found)
    if not len(frames):
        raise FormatError(
            f"{path} holds no CAN data frames" + "".join(f"; {fault}" for fault in faults),
            f"lines such as '{line}'" if line else f"a {title} with frames",
            "check that the suffix fits the format (a table must end in .csv), and that the recording was made on a running bus",
        )
    return CanRecording(str(path), title, frames, options.dbc, options.bus, faults)


def _is_table(path: Path) -> bool:
    """Whether a text is a table: several columns with names of their own, most of them numbers."""
    try:
        layout = look(path)
    except (LogError, OSError):
        return False
    numbers = sum(kind in ("number", "integer", "bool") for kind in layout.kinds)
    named = all(re.match(r"[A-Za-z_]", header) for header in layout.headers)
    return layout.delimiter != " " and len(layout.headers) > 1 and named and 2 * numbers > len(layout.headers)


def _content(path: Path) -> tuple[bytes, list[str]]:
    """The bytes of a file, unpacked if it is packed, and what was wrong with the packing."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise LogError(
            f"cannot read {path}: {error.strerror}", "a CAN trace", "check the path and its rights"
        ) from None
    if path.suffix.lower() != ".gz":
        return content, []
    try:
        return gzip.decompress(content), []
    except (OSError, EOFError, zlib.error) as error:
        parts = _unpack_some(content)
        if not parts:
            raise FormatError(f"{path} is not gzip ({error})", "a file packed by gzip", "check the suffix") from None
        return parts, ["the packed file is damaged or cut off; what could be unpacked of it is read"]


def _unpack_some(content: bytes) -> bytes:
    """What can be unpacked of a damaged gzip file."""
    unpack = zlib.decompressobj(wbits=31)
    parts = []
    try:
        for start in range(0, len(content), 1 << 12):
            parts.append(unpack.decompress(content[start : start + (1 << 12)]))
    except zlib.error:
        pass
    return b"".join(parts)
