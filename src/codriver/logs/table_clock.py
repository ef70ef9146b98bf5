"""The time column of a table: which one it is, and its values in seconds.

A column is the clock if its name says so (time, timestamp, t, ...). Its unit is, in this order: what the header says
("time [ms]", "t_us"); what the type says (dates); seconds. Integers alone are looked at twice, because loggers count
milliseconds, microseconds or nanoseconds without saying so: there the median step decides, and the reader tells it.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from codriver.errors import LogError
from codriver.logs.wording import counted
from codriver.signals.signal import Array

TIME_UNITS = {
    "s": 1.0, "sec": 1.0, "secs": 1.0, "second": 1.0, "seconds": 1.0, "S": 1.0,
    "ms": 1e-3, "msec": 1e-3, "millis": 1e-3, "milliseconds": 1e-3,
    "us": 1e-6, "usec": 1e-6, "µs": 1e-6, "μs": 1e-6, "micros": 1e-6, "microseconds": 1e-6,
    "ns": 1e-9, "nsec": 1e-9, "nanos": 1e-9, "nanoseconds": 1e-9, "min": 60.0, "h": 3600.0,
}  # fmt: skip
# In order of preference. The last two count only if they hold dates.
_NAMES = (
    "time", "timestamp", "t", "time_stamp", "timestamps", "times", "ts", "utime", "datetime", "date_time",
    "elapsed_time", "elapsed", "time_abs", "time_rel", "abs_time", "rel_time", "zeit", "seconds", "sec",
    "__index_level_0__", "date", "index",
)  # fmt: skip
_DATES_ONLY = ("date", "index")
_SUFFIX = re.compile(r"^(?P<name>.+?)_(?P<unit>s|sec|secs|seconds|ms|msec|us|usec|ns|nsec)$")


def split_unit(header: str) -> tuple[str, str]:
    """Name and unit of a header such as "speed [km/h]", "speed (km/h)"; the unit is "" where there is none.

    What stands in round brackets counts as a unit only if it is one: "torque (after intervention)" has none.
    """
    found = re.fullmatch(r"(?P<name>.*?)\s*(?P<bracket>[\[(])(?P<unit>[^\[\]()]*)[\])]", header.strip())
    if not found or not found["name"]:
        return header.strip(), ""
    unit = found["unit"].strip()
    if found["bracket"] == "(" and unit not in TIME_UNITS:
        from codriver.units import is_known

        if not unit or not is_known(unit):
            return header.strip(), ""
    return found["name"], unit


def find_clock(headers: Sequence[str], dates: Sequence[bool], where: str) -> tuple[int, str]:
    """The index of the time column, and the unit its header gives ("" if none).

    Args:
        headers: names of the columns.
        dates: which columns hold dates or times of day.
        where: the file, for the error.

    Raises:
        LogError: there is none; the message lists the columns.
    """
    best: tuple[int, int, str] | None = None
    for index, header in enumerate(headers):
        name, unit = split_unit(header)
        name = re.sub(r"[\s.-]+", "_", name.strip().lower())
        if name not in _NAMES and (parts := _SUFFIX.match(name)):
            name, unit = parts["name"], unit or parts["unit"]
        if name not in _NAMES or (name in _DATES_ONLY and not dates[index]) or (unit and unit not in TIME_UNITS):
            continue
        rank = _NAMES.index(name)
        if best is None or rank < best[0]:
            best = rank, index, unit
    if best is None:
        listed = ", ".join(headers[:20]) + (", ..." if len(headers) > 20 else "")
        raise LogError(
            f"{where} has no time column; its columns are: {listed}",
            "a column named time, timestamp or t, such as 'time [s]'",
            "name the time column 'time', or add one: row number divided by the sampling rate; or say the rate in the names "
            "file: [time] rate = 100",
        )
    return best[1], best[2]


def clock_or_rate(
    headers: Sequence[str], dates: Sequence[bool], where: str, rate: float | None
) -> tuple[int | None, str]:
    """As `find_clock`; a table without a time column that has a known rate gives None and "".

    Args:
        headers, dates, where: as for `find_clock`.
        rate: rows a second, or None.

    Raises:
        LogError: there is neither.
    """
    try:
        return find_clock(headers, dates, where)
    except LogError:
        if rate is None:
            raise
        return None, ""


def seconds(column: Any, unit: str, name: str, faults: list[str]) -> Array:
    """The clock in seconds; cells that hold no time become NaN.

    Args:
        column: pyarrow chunked array of numbers, dates, times of day, or text of dates.
        unit: as `find_clock` gives it.
        name: of the column, for the faults.
        faults: what was guessed is added here.
    """
    import pyarrow as pa
    import pyarrow.compute as pc

    kind = column.type
    if pa.types.is_string(kind) or pa.types.is_large_string(kind):
        column = _parse(column, name, faults)
        kind = column.type
    if pa.types.is_date(kind):
        column, kind = column.cast(pa.timestamp("s")), pa.timestamp("s")
    there = pc.is_valid(column).to_numpy()
    if pa.types.is_timestamp(kind) or pa.types.is_duration(kind) or pa.types.is_time(kind):
        whole = pc.fill_null(column.cast(pa.int32() if kind.bit_width == 32 else pa.int64()), 0).to_numpy()
        stamps = _scaled(whole.astype(np.int64), TIME_UNITS[kind.unit])
        if pa.types.is_time(kind):  # a clock on the wall starts anew at midnight
            midnights = np.cumsum(np.diff(stamps[there], prepend=0.0) < -43200.0)
            stamps[there] += 86400.0 * midnights
    elif pa.types.is_integer(kind):
        whole = pc.fill_null(column.cast(pa.int64(), safe=False), 0).to_numpy()
        stamps = _scaled(whole, TIME_UNITS[unit] if unit else _guess(whole[there], name, faults))
    else:
        stamps = pc.fill_null(column.cast(pa.float64()), float("nan")).to_numpy()
        finite = stamps[there & np.isfinite(stamps)]
        if not unit and finite.size > 2 and np.array_equal(finite, np.round(finite)):
            stamps = stamps * _guess(finite, name, faults)
        elif unit:
            stamps = stamps * TIME_UNITS[unit]
    return np.asarray(np.where(there, stamps, np.nan), np.float64)


def _scaled(whole: npt.NDArray[np.int64], factor: float) -> Array:
    """Integer counts in seconds, without rounding twice: nanoseconds since 1970 exceed a double's digits."""
    if factor >= 1.0:
        return np.asarray(whole * factor, np.float64)
    count = round(1.0 / factor)
    return np.asarray(whole // count + (whole % count) / count, np.float64)


def _guess(whole: npt.NDArray[Any], name: str, faults: list[str]) -> float:
    """Seconds per count of an integer clock, from its median step; what is guessed is told."""
    steps = np.diff(whole)
    steps = steps[steps > 0]
    step = float(np.median(steps)) if steps.size else 1.0
    if step <= 1:
        return 1.0  # seconds, as for all clocks that do not say otherwise
    # A vehicle log has between one and a few thousand rows a second.
    unit = "ms" if step <= 1e3 else "us" if step <= 1e6 else "ns"
    faults.append(
        f"time column '{name}' gives no unit; its integers step by {step:g}, so they are taken as {unit} "
        f"({step * TIME_UNITS[unit]:.3g} s a row)"
    )
    return TIME_UNITS[unit]


def _parse(column: Any, name: str, faults: list[str]) -> Any:
    """Text of dates or times of day as such; cells that are neither become empty, and it is told.

    Raises:
        LogError: most are neither.
    """
    import pyarrow as pa
    import pyarrow.compute as pc

    column = pc.utf8_trim_whitespace(column)
    column = pc.if_else(pc.equal(column, ""), None, column)
    fits = pc.match_substring_regex(column, r"^(\d{4}-\d\d-\d\d([T ]|$).*|\d?\d:\d\d(:\d\d(\.\d{1,9})?)?|[\d.eE+-]+)$")
    good, all_ = pc.sum(fits).as_py() or 0, pc.count(column).as_py()
    if all_ > good > all_ / 2:
        faults.append(
            f"time column '{name}': {counted(all_ - good, 'cell', 'holds', 'hold')} no time; left out with the row"
        )
        column = pc.if_else(fits, column, None)
    if pc.all(pc.match_substring_regex(column, r"^\d?\d:")).as_py():  # times of day
        clock = pc.replace_substring_regex(column, r"^(\d:)", r"0\1")
        column = pc.binary_join_element_wise("1970-01-01", clock, " ")
        return column.cast(pa.timestamp("ns")).cast(pa.time64("ns"))
    for kind in (pa.timestamp("ns"), pa.timestamp("ns", "UTC"), pa.float64()):
        try:
            return column.cast(kind)
        except pa.ArrowInvalid:
            continue
    sample = next((str(cell) for cell in column.to_pylist() if cell), "")
    raise LogError(
        f"time column '{name}' holds '{sample}' and perhaps others that are no time",
        "seconds, dates such as 2024-05-17 13:05:12.250, or times of day such as 13:05:12.250",
        "write the column as seconds",
    )
