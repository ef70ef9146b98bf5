"""Tables: CSV and Parquet with a time column or a known rate, one channel a column.

Columns may be of different rates: an empty cell is no sample of its column. NaN is a sample that says "no number",
except in a column of which a third or more is NaN; that is how tables of several rates look when a tool fills them up.
"""

from __future__ import annotations

import io
from abc import abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from codriver.errors import FormatError, LogError
from codriver.logs.clock import shared_run
from codriver.logs.csv_layout import EMPTY_CELLS, inflate, look, unique
from codriver.logs.recording import RawSignal, Recording, SourceChannel
from codriver.logs.registry import ReadOptions, reader
from codriver.logs.table_clock import clock_or_rate, seconds, split_unit
from codriver.logs.wording import counted
from codriver.signals.signal import Array

if TYPE_CHECKING:
    import pyarrow as pa

_MOSTLY_EMPTY = 1 / 3


class TableRecording(Recording):
    """A table: a clock and columns beside it."""

    def __init__(
        self, path: Path, form: str, clock: str, unit: str, channels: Sequence[SourceChannel], rate: float | None = None
    ) -> None:
        self.path, self.format = str(path), form
        self.faults: list[str] = []
        self._clock, self._clock_unit, self._rate = clock, unit, rate
        if rate is not None and clock:
            self._tell(f"the names file gives {rate:g} rows a second, which is not used: time is the column '{clock}'")
        self._channels = {channel.name: channel for channel in channels}

    def channels(self) -> Mapping[str, SourceChannel]:
        """The columns of numbers, by header; the time column is not among them."""
        return self._channels

    def load(self, names: Iterable[str]) -> dict[str, RawSignal]:
        """The columns named; a header's unit may be left out where it is unambiguous: "speed" for "speed [km/h]"."""
        bare: dict[str, list[str]] = {}
        for header in self._channels:
            bare.setdefault(split_unit(header)[0], []).append(header)
        wanted = {}
        for name in names:
            if name in self._channels:
                wanted[name] = name
            elif len(bare.get(name, ())) == 1:
                wanted[name] = bare[name][0]
        if not wanted:
            return {}
        columns = self._read(sorted({*wanted.values(), *([self._clock] if self._clock else [])}))
        notes: list[str] = []
        if self._clock:
            stamps = seconds(columns[self._clock], self._clock_unit, self._clock, notes)
        else:
            stamps = np.arange(len(next(iter(columns.values())))) / (self._rate or 1.0)
        for note in notes:
            self._tell(note)
        headers = set(wanted.values())
        kept, notes = shared_run(stamps, (columns[header].is_valid().to_numpy() for header in headers))
        if notes:
            stamps, columns = stamps[kept], {header: columns[header].filter(kept) for header in headers}
        for note in notes:
            self._tell(f"time column '{self._clock}': {note}" if self._clock else note)
        made = {header: _samples(stamps, columns[header]) for header in headers}
        return {name: RawSignal(*made[header], self._channels[header].unit) for name, header in wanted.items()}

    @abstractmethod
    def _read(self, headers: list[str]) -> dict[str, pa.ChunkedArray]:
        """The columns with these headers."""

    def _tell(self, fault: str) -> None:
        """Add a fault once."""
        if fault not in self.faults:
            self.faults.append(fault)


def _samples(stamps: Array, column: pa.ChunkedArray) -> tuple[Array, Array]:
    """Stamps and values of a column's cells that are filled."""
    import pyarrow as pa
    import pyarrow.compute as pc

    there = pc.is_valid(column).to_numpy()
    numbers = pc.drop_null(column)
    if pa.types.is_boolean(column.type):
        numbers = numbers.cast(pa.uint8())
    values = np.asarray(numbers.cast(pa.float64(), safe=False).to_numpy(), np.float64)
    if not there.all():
        stamps = stamps[there]
    none = np.isnan(values)
    if _MOSTLY_EMPTY <= none.mean() < 1 if none.size else False:
        return stamps[~none], values[~none]
    return stamps, values


class CsvRecording(TableRecording):
    """A CSV file; only its head is read until columns are asked for."""

    def __init__(self, path: Path, rate: float | None = None) -> None:
        layout = look(path)
        self._file, self._layout = path, layout
        dates = [kind == "text" for kind in layout.kinds]
        index, unit = clock_or_rate(layout.headers, dates, str(path), rate)
        channels = [
            SourceChannel(header, own)
            for i, (header, own, kind) in enumerate(zip(layout.headers, layout.units, layout.kinds, strict=True))
            if kind != "text" and i != index
        ]
        clock = layout.headers[index] if index is not None else ""
        kind = layout.kinds[index] if index is not None else ""
        unit = unit or (layout.units[index] if index is not None else "")
        super().__init__(path, "CSV table", clock, unit, channels, rate)
        self._integer_clock, self._text_clock = kind == "integer", kind == "text"
        numbers = {channel.name for channel in channels} | {clock}
        skipped = [header for header in layout.headers if header not in numbers]
        if skipped:
            self._tell(
                f"{counted(len(skipped), 'column', 'is', 'are')} not numeric and left out: {', '.join(skipped[:8])}"
            )

    def _read(self, headers: list[str]) -> dict[str, pa.ChunkedArray]:
        import pyarrow as pa

        kinds = dict(zip(self._layout.headers, self._layout.kinds, strict=True))
        types = {h: pa.bool_() if kinds[h] == "bool" else pa.float64() for h in headers}
        if self._integer_clock:
            types[self._clock] = pa.int64()  # nanoseconds since 1970 do not fit a double
        if self._text_clock:
            types[self._clock] = pa.string()
        try:
            table = self._parse(headers, types)
        except pa.ArrowInvalid:
            # A cell further down is no number: take the columns as text and sort out cell by cell.
            table = self._parse(headers, dict.fromkeys(headers, pa.string()))
            return {h: self._tolerant(table[h], h, types[h]) for h in headers}
        return {h: table[h] for h in headers}

    def _parse(self, headers: list[str], types: Mapping[str, pa.DataType]) -> pa.Table:
        """The file through Arrow's CSV parser."""
        import pyarrow as pa
        import pyarrow.csv as arrow_csv

        layout = self._layout
        source: Any = str(self._file)
        if self._file.suffix.lower() == ".gz":
            raw, fault = inflate(self._file)
            if fault:
                self._tell(fault)
                raw = raw[: raw.rfind(b"\n") + 1]
            source = io.BytesIO(raw)
        bad: list[str] = []

        def skip(row: Any) -> str:
            bad.append(str(row.text))
            return "skip"

        try:
            table = arrow_csv.read_csv(
                source,
                read_options=arrow_csv.ReadOptions(
                    skip_rows=layout.skip,
                    column_names=list(layout.headers),
                    encoding=layout.encoding,
                    block_size=1 << 22,
                    use_threads=False,  # skip is Python: no other thread may call it
                ),
                parse_options=arrow_csv.ParseOptions(delimiter=layout.delimiter, invalid_row_handler=skip),
                convert_options=arrow_csv.ConvertOptions(
                    column_types=dict(types),
                    include_columns=headers,
                    null_values=EMPTY_CELLS,
                    strings_can_be_null=True,
                    decimal_point=layout.decimal,
                    check_utf8=False,
                ),
            )
        except (pa.ArrowInvalid, UnicodeError) as error:
            if "conversion error" in str(error):
                raise
            expected = f"a table with {len(layout.headers)} columns"
            raise FormatError(f"{self._file}: {error}", expected, "check the file near the place named") from None
        if bad:
            self._tell(
                f"{counted(len(bad), 'row', 'has', 'have')} too few or too many cells; left out, the first: '{bad[0][:60]}'"
                + (
                    ""
                    if self._clock
                    else f"; without a time column all rows behind come {1 / (self._rate or 1):g} s early for each"
                )
            )
        return table

    def _tolerant(self, column: pa.ChunkedArray, header: str, kind: pa.DataType) -> pa.ChunkedArray:
        """A text column as numbers; cells that are none become empty, and it is told."""
        import pyarrow as pa
        import pyarrow.compute as pc

        if pa.types.is_string(kind):
            return column
        column = pc.utf8_trim_whitespace(column)
        if self._layout.decimal == ",":
            column = pc.replace_substring(column, ",", ".")
        if pa.types.is_boolean(kind):
            column = pc.replace_substring_regex(pc.utf8_lower(column), "^(true)$", "1")
            column = pc.replace_substring_regex(column, "^(false)$", "0")
        # Several patterns by the library's own rule for numbers; "nan" and "inf" count as such.
        number = r"^[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?$|^[+-]?(nan|inf|NaN|Inf)$"
        whole = r"^-?\d{1,19}$" if pa.types.is_integer(kind) else number
        fits = pc.match_substring_regex(column, whole)
        numbers = pc.match_substring_regex(column, number)
        if not pc.equal(pc.sum(fits), pc.sum(numbers)).as_py():
            kind, fits = pa.float64(), numbers
        wrong = pc.filter(column, pc.invert(fits))
        wrong = [cell for cell in wrong.to_pylist() if cell not in (None, "")]
        if wrong:
            cells = counted(len(wrong), "cell", "is no number", "are no numbers")
            self._tell(f"column '{header}': {cells}; left out, the first: '{wrong[0][:40]}'")
        return pc.if_else(fits, column, None).cast(pa.float64() if pa.types.is_boolean(kind) else kind)


class ParquetRecording(TableRecording):
    """A Parquet file; columns are read when asked for. Units and comments come from the fields' metadata."""

    def __init__(self, path: Path, rate: float | None = None) -> None:
        import pyarrow as pa
        import pyarrow.parquet as pq

        try:
            self._table = pq.ParquetFile(path, memory_map=True)
        except (pa.ArrowInvalid, pa.ArrowException, OSError) as error:
            raise FormatError(
                f"{path} is no Parquet file ({str(error)[:120]})",
                "a complete Parquet file",
                "a file whose writer was stopped lacks its end and is lost; write it anew",
            ) from None
        schema = self._table.schema_arrow
        if not self._table.metadata.num_rows:
            raise LogError(f"{path} has {len(schema)} columns and no rows", "rows of data", "check how it was written")
        dates = [pa.types.is_temporal(field.type) for field in schema]
        index, unit = clock_or_rate(schema.names, dates, str(path), rate)
        headers = unique(schema.names)
        self._place = {
            header: (name, schema.names[:i].count(name))
            for i, (header, name) in enumerate(zip(headers, schema.names, strict=True))
        }
        channels, skipped = [], []
        numeric = (pa.types.is_integer, pa.types.is_floating, pa.types.is_boolean, pa.types.is_decimal)
        for i, field in enumerate(schema):
            if i == index:
                unit = unit or _note(field, "unit")
            elif any(test(field.type) for test in numeric):
                own = _note(field, "unit") or split_unit(field.name)[1]
                channels.append(SourceChannel(headers[i], own, _note(field, "comment")))
            elif not field.name.startswith("__index_level"):
                skipped.append(field.name)
        super().__init__(path, "Parquet table", headers[index] if index is not None else "", unit, channels, rate)
        if skipped:
            self._tell(
                f"{counted(len(skipped), 'column', 'is', 'are')} not numeric and left out: {', '.join(skipped[:8])}"
            )

    def _read(self, headers: list[str]) -> dict[str, pa.ChunkedArray]:
        import pyarrow as pa

        try:
            table = self._table.read(columns=sorted({self._place[header][0] for header in headers}))
        except (pa.ArrowException, OSError) as error:
            raise FormatError(
                f"{self.path}: {str(error)[:160]}", "a readable Parquet file", "the file is damaged; write it anew"
            ) from None
        places = {header: self._place[header] for header in headers}
        return {
            header: table.column(table.schema.get_all_field_indices(name)[nth])
            for header, (name, nth) in places.items()
        }


def _note(field: pa.Field, key: str) -> str:
    """A text from a field's metadata."""
    return (field.metadata or {}).get(key.encode(), b"").decode("utf-8", "replace")


@reader(".csv", ".csv.gz", ".tsv", ".txt", title="CSV table")
def read_csv(path: Path, options: ReadOptions) -> Recording:
    """Open a CSV file."""
    return CsvRecording(path, options.rate)


@reader(".parquet", ".pq", title="Parquet table")
def read_parquet(path: Path, options: ReadOptions) -> Recording:
    """Open a Parquet file."""
    return ParquetRecording(path, options.rate)
