"""Writers: columns on one clock to Parquet, CSV or MF4.

A file appears under its name only when it is complete: it is written beside it and renamed. CSV begins with its
header, so that spreadsheets and pandas open it without being told anything; what there is to say about the whole goes
into a small JSON file beside it ("drive.csv.json"). Parquet and MF4 carry it inside. Values that are not numbers are
written as empty cells (null), since that is how tables say "no sample"; in MF4 they stay NaN.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any
from uuid import uuid4

import numpy as np
import numpy.typing as npt

from codriver.errors import LogError, UsageError
from codriver.signals.signal import Array

if TYPE_CHECKING:
    from collections.abc import Iterator

    import pyarrow as pa

SUFFIXES = (".parquet", ".pq", ".csv", ".mf4")


@dataclass(frozen=True, eq=False)
class Column:
    """A column to write.

    Attributes:
        name: its name.
        values: shape (n,), numbers or booleans.
        unit: as it is to stand in the file; "" for none.
        comment: what it is, for people.
    """

    name: str
    values: npt.NDArray[Any]
    unit: str = ""
    comment: str = ""


def check_output(path: str | Path) -> Path:
    """Whether a table can be written here, to be asked before long work.

    Raises:
        UsageError: the suffix is unknown, the folder does not exist or may not be written, or asammdf is missing.
    """
    path = Path(path)
    if path.is_dir():
        raise UsageError(f"{path} is a folder", "the name of a file", "give a file name inside the folder")
    if path.suffix.lower() not in SUFFIXES:
        raise UsageError(
            f"cannot write '{path.name}': "
            + (f"'{path.suffix}' is no format to write" if path.suffix else "no suffix"),
            f"a name ending in {', '.join(SUFFIXES)}",
            "choose one of these suffixes",
        )
    folder = path.parent
    if not folder.is_dir():
        raise UsageError(
            f"the folder {folder} does not exist", "a folder to write into", "create it, or check the path"
        )
    if not os.access(folder, os.W_OK):
        raise UsageError(
            f"the folder {folder} is write-protected", "a folder you may write into", "choose another folder"
        )
    if path.suffix.lower() == ".mf4" and find_spec("asammdf") is None:
        raise UsageError("writing MF4 needs asammdf, which is not installed", "asammdf", "pip install 'codriver[mdf]'")
    return path


def write_table(
    path: str | Path,
    time: Array,
    columns: Sequence[Column],
    metadata: Mapping[str, str] | None = None,
) -> Path:
    """Write columns on one clock; the suffix says the format.

    Args:
        path: .parquet, .pq, .csv or .mf4; a file of that name is replaced.
        time: s, shape (n,).
        columns: each of shape (n,), with names that differ.
        metadata: what to say about the whole.

    Raises:
        UsageError: see `check_output`; or columns do not fit the clock or each other.
        LogError: the file cannot be written (disk full, ...); nothing is left behind.
    """
    path = check_output(path)
    time = np.asarray(time, np.float64)
    names = [column.name for column in columns]
    double = sorted({name for name in names if names.count(name) > 1 or name == "time"})
    if double:
        raise UsageError(
            f"columns named twice: {', '.join(double)}", "names that differ; 'time' is taken", "rename them"
        )
    for column in columns:
        if np.shape(column.values) != time.shape:
            raise UsageError(
                f"column '{column.name}' has shape {np.shape(column.values)}, the clock {time.shape}",
                "one value for each stamp",
                "put all columns onto one clock first",
            )
    write = _WRITERS[path.suffix.lower()]
    write(path, time, columns, dict(metadata or {}))
    return path


@contextmanager
def complete_or_nothing(path: Path) -> Iterator[Path]:
    """A temporary name beside `path`, renamed to it at the end; gone if anything fails.

    Raises:
        LogError: the operating system refuses.
    """
    # The suffix stays: asammdf insists on its own.
    draft = path.with_name(f".{path.stem}-{uuid4().hex[:8]}{path.suffix}")
    try:
        yield draft
        draft.replace(path)
    except OSError as error:
        found = f"cannot write {path}: {error.strerror or error}"
        raise LogError(found, "room on the disk and the right to write", "remove the cause and write again") from error
    finally:
        with suppress(OSError):
            draft.unlink(missing_ok=True)


def _table(time: Array, columns: Sequence[Column], metadata: Mapping[str, str]) -> pa.Table:
    """The columns as an Arrow table; NaN becomes null."""
    import pyarrow as pa

    fields = [pa.field("time", pa.float64(), metadata={"unit": "s"})]
    arrays = [_arrow(time)]
    for column in columns:
        array = _arrow(np.asarray(column.values))
        notes = {key: text for key, text in (("unit", column.unit), ("comment", column.comment)) if text}
        fields.append(pa.field(column.name, array.type, metadata=notes or None))
        arrays.append(array)
    return pa.Table.from_arrays(arrays, schema=pa.schema(fields, metadata=dict(metadata) or None))


def _arrow(values: npt.NDArray[Any]) -> pa.Array:
    """Numbers or booleans as an Arrow array; NaN becomes null.

    Made from the bytes where it can be: pa.array imports pandas wherever that is installed, which costs half a second.
    """
    import pyarrow as pa

    if values.dtype == np.bool_:
        return pa.Array.from_buffers(pa.bool_(), values.size, [None, _bits(values)])
    if values.dtype != np.float64:
        return pa.array(values, from_pandas=True)
    there = ~np.isnan(values)
    data = pa.py_buffer(np.ascontiguousarray(values))
    return pa.Array.from_buffers(pa.float64(), values.size, [None if there.all() else _bits(there), data])


def _bits(flags: npt.NDArray[np.bool_]) -> pa.Buffer:
    """Booleans as Arrow packs them."""
    import pyarrow as pa

    return pa.py_buffer(np.packbits(flags, bitorder="little"))


def _write_parquet(path: Path, time: Array, columns: Sequence[Column], metadata: Mapping[str, str]) -> None:
    """Parquet; units and comments in the fields' metadata, the rest in the schema's."""
    import pyarrow.parquet as pq

    with complete_or_nothing(path) as draft:
        pq.write_table(_table(time, columns, metadata), draft, compression="zstd")


def _write_csv(path: Path, time: Array, columns: Sequence[Column], metadata: Mapping[str, str]) -> None:
    """CSV with headers "name [unit]"; what else there is to say goes into "<path>.json"."""
    import csv
    import io

    import pyarrow.csv as arrow_csv

    headers = ["time [s]", *(f"{column.name} [{column.unit}]" if column.unit else column.name for column in columns)]
    line = io.StringIO()
    csv.writer(line, lineterminator="\n").writerow(headers)
    comments = {column.name: column.comment for column in columns if column.comment}
    beside = path.with_name(path.name + ".json")
    with complete_or_nothing(path) as draft:
        with draft.open("wb") as file:
            file.write(line.getvalue().encode())
            arrow_csv.write_csv(_table(time, columns, {}), file, arrow_csv.WriteOptions(include_header=False))
        if metadata or comments:
            with complete_or_nothing(beside) as note:
                about = {"metadata": dict(metadata), "comments": comments}
                note.write_text(json.dumps(about, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")


def _write_mf4(path: Path, time: Array, columns: Sequence[Column], metadata: Mapping[str, str]) -> None:
    """MF4: one channel group; units and comments at the channels, the rest in the header's comment."""
    from asammdf import MDF, Signal

    signals = []
    for column in columns:
        values = np.asarray(column.values)
        if values.dtype == np.bool_:
            values = values.astype(np.uint8)
        signals.append(Signal(values, time, unit=column.unit, name=column.name, comment=column.comment))
    with complete_or_nothing(path) as draft, MDF(version="4.10") as file:
        if signals:
            file.append(signals, comment="codriver", common_timebase=True)
        if metadata:
            file.header.comment = "\n".join(f"{key}: {text}" for key, text in metadata.items())
        file.save(draft, overwrite=True, compression=2)


_WRITERS: dict[str, Callable[..., None]] = {
    ".parquet": _write_parquet, ".pq": _write_parquet, ".csv": _write_csv, ".mf4": _write_mf4,
}  # fmt: skip
