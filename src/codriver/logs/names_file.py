"""Names files: TOML that maps a source's channels to standard names.

[longitudinal_speed]
source = "Wheels.FrontLeft"       # or a list, whose mean is taken: ["Wheels.RearLeft", "Wheels.RearRight"]
unit = "km/h"                     # overrides what the source says; where neither says, the SI unit is taken, and that is told
scale = 1.01                      # optional: value * scale + offset, in the source's unit, before the unit is converted
offset = 0.0
sign = -1                         # optional: -1 turns the direction
valid = "Wheels.Ready"            # optional: values count only where this channel, held, is not 0

[time]                            # only for tables that have no time column
rate = 100                        # rows a second
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from codriver.errors import NamesError, UnitError
from codriver.names import VOCABULARY, nearest
from codriver.toml_file import parse_tables, read_text
from codriver.units import to_si

TIME = "time"
_FIELDS = ("source", "unit", "scale", "offset", "sign", "valid")


@dataclass(frozen=True)
class Entry:
    """How one standard signal is made from a source's channels.

    Attributes:
        name: standard name.
        source: the source's own names; the mean is taken of several.
        unit: overrides the source's unit; None keeps it.
        scale, offset: applied in the source's unit, before conversion.
        sign: 1 or -1.
        valid: a channel of the source; values count only where its newest value is not 0. None: all count.
    """

    name: str
    source: tuple[str, ...]
    unit: str | None = None
    scale: float = 1.0
    offset: float = 0.0
    sign: int = 1
    valid: str | None = None

    @property
    def channels(self) -> tuple[str, ...]:
        """All channels of the source that it needs."""
        return self.source if self.valid is None else (*self.source, self.valid)

    def doubts(self, units: Mapping[str, str]) -> list[str]:
        """A sentence for each unit that has to be guessed, or that contradicts another.

        An error would refuse every database without units, of which there are many.

        Args:
            units: what the source says of each of its channels.
        """
        target = VOCABULARY[self.name].unit
        sentences = []
        if self.unit is None and target != "1":
            sentences = [
                f"{self.name} ({source}): neither the source nor the names file gives its unit; taken as {target}: "
                "say so in the names file"
                for source, unit in units.items()
                if not unit
            ]
        told = sorted({unit for unit in units.values() if unit})
        if len(told) > 1 and self.unit is not None:
            sentences.append(
                f"{self.name}: its sources have the units {', '.join(told)}, and the names file takes all in {self.unit}; "
                "leave out unit there, and each is converted from its own"
            )
        if len(told) > 1 and self.unit is None and self.offset:
            sentences.append(
                f"{self.name}: its sources have the units {', '.join(told)}, and offset = {self.offset:g} is taken in each of "
                "them; give sources of one unit"
            )
        return sentences

    def conversion(self, unit: str) -> tuple[float, float]:
        """Gain and shift that take a value of the source to the standard unit: standard = gain * value + shift.

        Args:
            unit: what the source says; used where the entry gives none. Where neither says, the standard unit is taken;
                `doubts` tells that.

        Raises:
            UnitError: the unit is unknown, or of another kind.
        """
        target = VOCABULARY[self.name].unit
        factor, offset = to_si(self.unit if self.unit is not None else unit or target, target)
        return self.scale * factor * self.sign, self.offset * factor * self.sign + offset


@dataclass(frozen=True)
class NamesFile:
    """A mapping from a source's channels to standard names, by standard name.

    Attributes:
        entries: by standard name.
        where: the file.
        rate: rows a second of a table without a time column; None where the file does not say.
    """

    entries: Mapping[str, Entry]
    where: str = ""
    rate: float | None = None

    @classmethod
    def of(cls, *entries: Entry, where: str = "", rate: float | None = None) -> NamesFile:
        """A mapping of the entries given."""
        return cls({entry.name: entry for entry in entries}, where, rate)


def load_names(path: str | Path) -> NamesFile:
    """Read a names file.

    Raises:
        NamesError: it cannot be read, or is wrong; the message lists every fault at once.
    """
    return parse_names(read_text(path, "names file", NamesError), str(path))


def parse_names(text: str, where: str) -> NamesFile:
    """A mapping from the text of a names file.

    Raises:
        NamesError: listing every fault of the file.
    """
    tables = parse_tables(text, where, NamesError)
    faults: list[str] = []
    rate = _rate(tables.pop(TIME), faults) if TIME in tables else None
    entries = [entry for name, table in tables.items() if (entry := _entry(name, table, faults)) is not None]
    if not entries and not faults:
        faults.append("no signal is mapped")
    if faults:
        raise NamesError(
            f"{where}: " + "; ".join(faults),
            "tables named by standard signal names, each with source, and unit, scale, offset, sign, valid where needed",
            "mend the file; docs/names.md lists the names, `codriver info LOG` the channels of a log",
        )
    return NamesFile.of(*entries, where=where, rate=rate)


def _rate(table: Any, faults: list[str]) -> float | None:
    """Rows a second, from the table [time]; what is wrong with it is added to `faults`."""
    rate = table.get("rate") if isinstance(table, dict) and set(table) == {"rate"} else None
    if isinstance(rate, bool) or not isinstance(rate, (int, float)) or not 0 < rate < math.inf:
        faults.append(f"[{TIME}] holds rate alone: rows a second, above 0, of a table without a time column")
        return None
    return float(rate)


def _entry(name: str, table: Any, faults: list[str]) -> Entry | None:
    """One table of the file; what is wrong with it is added to `faults`."""
    if name not in VOCABULARY or not isinstance(table, dict):
        near = nearest(name, VOCABULARY)
        faults.append(f"[{name}] is not a standard signal name" + (f" (did you mean {near}?)" if near else ""))
        return None
    before = len(faults)
    faults.extend(f"[{name}] has an unknown key '{key}'" for key in table if key not in _FIELDS)
    source = table.get("source")
    sources = (source,) if isinstance(source, str) else tuple(source) if isinstance(source, list) else ()
    if not sources or not all(isinstance(s, str) and s for s in sources):
        faults.append(f"[{name}] source must be the name of a channel, or a list of them")
    twice = sorted({str(s) for s in sources if sources.count(s) > 1})
    faults.extend(
        f"[{name}] source lists '{s}' more than once, which would count it so often in the mean" for s in twice
    )
    for key in ("scale", "offset"):
        number = table.get(key, 1.0)
        if isinstance(number, bool) or not isinstance(number, (int, float)) or not math.isfinite(number):
            faults.append(f"[{name}] {key} must be a number")
    if table.get("scale", 1.0) == 0:
        faults.append(f"[{name}] scale must not be 0")
    if table.get("sign", 1) not in (1, -1):
        faults.append(f"[{name}] sign must be 1 or -1")
    valid = table.get("valid")
    if valid is not None and not (isinstance(valid, str) and valid):
        faults.append(f"[{name}] valid must be the name of a channel")
    unit = table.get("unit")
    if unit is not None:
        try:
            to_si(str(unit), VOCABULARY[name].unit)
        except UnitError as error:
            faults.append(f"[{name}] {error.found} (expected {error.expected})")
    if len(faults) > before:
        return None
    return Entry(
        name,
        sources,
        unit,
        float(table.get("scale", 1.0)),
        float(table.get("offset", 0.0)),
        int(table.get("sign", 1)),
        valid,
    )
