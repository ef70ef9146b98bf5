"""How a CSV file is laid out, from its first lines: encoding, separator, decimal sign, header, units, kinds of columns.

Loggers agree on little: comment lines on top, semicolons with decimal commas, a row of units below the header, an extra
separator at the end of each row. All of it shows in the first few hundred kilobytes, so no more is read here.
"""

from __future__ import annotations

import codecs
import csv
import re
import zlib
from dataclasses import dataclass
from pathlib import Path

from codriver.errors import FormatError, LogError
from codriver.logs.table_clock import TIME_UNITS, split_unit

HEAD = 1 << 18  # bytes that are looked at
_ROWS = 2000  # rows whose cells decide a column's kind
_NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)([eE][+-]?\d+)?|[+-]?inf|nan", re.IGNORECASE)
_COMMENT = ("#", "%", "//")
EMPTY_CELLS = ["", "NA", "N/A", "#N/A", "null", "NULL", "None", "-", "--"]
_WORDS = {"true", "false"}


@dataclass(frozen=True)
class CsvLayout:
    """The layout of a CSV file.

    Attributes:
        encoding: as Python names it.
        delimiter: one character.
        decimal: "." or ",".
        skip: lines before the first row of data.
        headers: the column headers as the file has them, made unique.
        units: for each column, from the header or from a row of units; "" where the file does not say.
        kinds: for each column "number", "integer", "bool", "text" or "empty", from the rows looked at.
        rows: rows of data among the lines looked at.
    """

    encoding: str
    delimiter: str
    decimal: str
    skip: int
    headers: tuple[str, ...]
    units: tuple[str, ...]
    kinds: tuple[str, ...]
    rows: int


def inflate(path: Path, limit: int | None = None) -> tuple[bytes, str]:
    """The bytes of a gzip file, as far as they can be had, and a sentence on what is wrong with it ("" if nothing).

    Args:
        path: the file.
        limit: stop after about so many bytes.

    Raises:
        FormatError: it is not gzip at all.
    """
    parts: list[bytes] = []
    size = 0
    unpack, whole = zlib.decompressobj(31), False
    with path.open("rb") as file:
        while block := file.read(1 << 16):
            while block:
                try:
                    parts.append(unpack.decompress(block))
                except zlib.error as error:
                    if not size:
                        raise FormatError(
                            f"{path} is not gzip ({error})",
                            "a gzip file",
                            "check the suffix, or compress the file anew",
                        ) from None
                    return b"".join(parts), "the compressed file is damaged; rows after the damage are lost"
                size += len(parts[-1])
                whole, block = unpack.eof, unpack.unused_data
                if whole:  # perhaps another one is joined behind it
                    unpack = zlib.decompressobj(31)
            if limit is not None and size >= limit:
                return b"".join(parts), ""
    return b"".join(parts), "" if whole else "the compressed file is cut off; rows after the cut are lost"


def look(path: Path) -> CsvLayout:
    """The layout of a CSV file.

    Raises:
        FormatError: the file is empty, or is not text.
        LogError: it has no header, or no rows.
    """
    if path.suffix.lower() == ".gz":
        raw, _ = inflate(path, HEAD)
        cut = len(raw) >= HEAD
        raw = raw[:HEAD]
    else:
        with path.open("rb") as file:
            raw = file.read(HEAD)
        cut = len(raw) == HEAD
    encoding, text = _decode(raw, path)
    lines = re.split(r"\r\n|\n|\r", text)
    if cut and len(lines) > 1:
        lines.pop()
    first, header_line = _find_header(lines, path)
    body = [line for line in lines[first:] if line.strip()]
    delimiter = _find_delimiter(header_line, body)
    headers = [_clean(cell) for cell in _split(header_line, delimiter)]
    if headers and all(_NUMBER.fullmatch(cell) for cell in headers if cell):
        raise LogError(
            f"{path}: the first row is numbers ({header_line[:60]})",
            "a first row with the names of the columns, one of them 'time'",
            "add a header line to the file",
        )
    rows = [_split(line, delimiter) for line in body[:_ROWS]]
    units = [split_unit(cell)[1] for cell in headers]
    if rows and _is_units_row(headers, rows[0]):
        below = [cell.strip().strip("[]()") for cell in rows[0]]
        units = [cell or unit for cell, unit in zip(below, units, strict=False)] + units[len(below) :]
        # Physical lines: blank ones between header and units count too.
        first += next(i for i, line in enumerate(lines[first:]) if line.strip()) + 1
        rows = rows[1:]
    if not rows:
        raise LogError(f"{path} has a header and no rows", "rows of data below the header", "check how it was recorded")
    width = _width(rows, len(headers))
    headers = (headers + [""] * width)[: max(width, 1)]
    units = (units + [""] * width)[: len(headers)]
    cells = [[row[i].strip() for row in rows if i < len(row)] for i in range(len(headers))]
    decimal = "," if delimiter != "," and _decimal_comma(cells) else "."
    kinds = tuple(_kind(column, decimal) for column in cells)
    return CsvLayout(encoding, delimiter, decimal, first, unique(headers), tuple(units), kinds, len(rows))


def unique(headers: list[str]) -> tuple[str, ...]:
    """Names that differ: an empty one becomes "column 3", a second "speed" becomes "speed#2"."""
    taken = set(headers)
    names: list[str] = []
    for index, header in enumerate(headers):
        name, count = header or f"column {index + 1}", 1
        if name in names:
            while f"{name}#{count}" in taken or count == 1:
                count += 1
            name = f"{name}#{count}"
            taken.add(name)
        names.append(name)
    return tuple(names)


def _decode(raw: bytes, path: Path) -> tuple[str, str]:
    """The encoding and the text of the first bytes."""
    if not raw.strip():
        raise FormatError(f"{path} is empty", "a header line and rows of numbers", "check how it was recorded")
    if raw.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16", raw[: len(raw) // 2 * 2].decode("utf-16", "replace")
    if b"\0" in raw:
        raise FormatError(f"{path} holds binary data, no text", "CSV text", "check that the suffix fits the format")
    try:
        return "utf-8", codecs.getincrementaldecoder("utf-8-sig")().decode(raw)
    except UnicodeDecodeError:
        return "latin-1", raw.decode("latin-1")


def _find_header(lines: list[str], path: Path) -> tuple[int, str]:
    """The index of the line after the header, and the header line itself."""
    comment = ""
    for index, line in enumerate(lines):
        bare = line.strip()
        if not bare or re.fullmatch(r'"?sep=.;?"?', bare):
            continue
        if bare.startswith(_COMMENT):
            comment = bare.lstrip("#%/ ")
            continue
        # numpy.savetxt writes the names of the columns as the last comment.
        here = [cell.strip() for cell in re.split(r"[,;\t ]", bare) if cell.strip()]
        alike = len(re.split(r"[,;\t]", comment)) == len(re.split(r"[,;\t]", bare)) > 1
        if alike and here and all(_NUMBER.fullmatch(cell) for cell in here):
            return index, comment
        return index + 1, line
    raise LogError(f"{path} has comment lines only", "a header line and rows of numbers", "check how it was recorded")


def _split(line: str, delimiter: str) -> list[str]:
    """The cells of one line, quotes taken off."""
    return next(csv.reader([line], delimiter=delimiter), [])


def _find_delimiter(header: str, body: list[str]) -> str:
    """The separator: the one that cuts the header and most rows into equally many cells."""
    best, most = ",", 0
    for delimiter in ("\t", ";", ",", "|", " "):
        if delimiter == " " and most:
            break  # blanks occur inside names
        count = len(_split(header, delimiter))
        alike = sum(abs(len(_split(line, delimiter)) - count) <= 1 for line in body[:50])
        if count > 1 and count > most and alike * 2 >= min(len(body), 50):
            best, most = delimiter, count
    return best


def _clean(header: str) -> str:
    """A header without blanks around it, and with a degree sign that was encoded twice put right."""
    return header.replace("Â°", "°").replace("\ufeff", "").strip()


def _is_units_row(headers: list[str], row: list[str]) -> bool:
    """Whether the row below the header gives units: the cell below a time column is a unit of time."""
    clocks = ("time", "t", "timestamp", "zeit")
    return any(
        split_unit(header)[0].lower() in clocks and cell.strip().strip("[]()") in TIME_UNITS
        for header, cell in zip(headers, row, strict=False)
    )


def _width(rows: list[list[str]], headers: int) -> int:
    """Cells to a row: the header's, unless most rows have more or none has as many."""
    counts = [len(row) for row in rows]
    most = max(set(counts), key=counts.count)
    return most if most > headers else min(headers, max(counts))


def _decimal_comma(columns: list[list[str]]) -> bool:
    """Whether numbers are written 3,14."""
    cells = [cell for column in columns for cell in column[:200]]
    comma = sum(re.fullmatch(r"[+-]?\d*,\d+([eE][+-]?\d+)?", cell) is not None for cell in cells)
    point = sum(re.fullmatch(r"[+-]?\d*\.\d+([eE][+-]?\d+)?", cell) is not None for cell in cells)
    return comma > point


def _kind(cells: list[str], decimal: str) -> str:
    """The kind of a column, from its cells."""
    full = [cell for cell in cells if cell not in EMPTY_CELLS]
    if not full:
        return "empty"
    numbers = [cell for cell in full if _NUMBER.fullmatch(cell)]
    # A few bad cells do not make a column of text; the reader leaves them out and says so.
    if len(numbers) * 2 > len(full):
        if decimal == "." and all(re.fullmatch(r"[+-]?\d{1,18}|[+-]?\d{19}", cell) for cell in full):
            return "integer"
        return "number"
    return "bool" if all(cell.lower() in _WORDS for cell in full) else "text"
