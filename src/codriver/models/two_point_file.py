"""Files of two-point drivers, in TOML, one table a parameter.

    name = "anna"
    source = "identified from laps/drive.csv, by the road"
    [anticipation]                         # K_p
    value = 4.41
    unit = "1"
    sd = 0.03
    source = "identified"
    [reflex]                               # K_t
    given = 6.0
    unit = "N*m/rad"
    source = "not told: this drive hardly tells it"

A parameter that a drive did not tell has no value, only the one that was given before the drive; who drives with such a file says
by name which of these he takes. Read strictly, as vehicle files are.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any

from codriver.errors import UsageError
from codriver.models.two_point import TwoPointDriver
from codriver.toml_file import parse_tables, quoted, read_text
from codriver.whole_file import write_text

# Attribute of TwoPointDriver: letter, unit.
LETTERS = {
    "anticipation": ("K_p", "1"), "compensation": ("K_c", "m/s"), "lead": ("T_L", "s"), "lag": ("T_I", "s"),
    "delay": ("tau_p", "s"), "column_gain": ("K_r", "N*s/rad"), "reflex": ("K_t", "N*m/rad"), "muscle": ("T_N", "s"),
    "near": ("near", "m"), "far": ("far", "s"),
}  # fmt: skip
_EXPECTED = "a driver file as `codriver identify driver` writes it"


@dataclass(frozen=True)
class FiledParameter:
    """One parameter of a file.

    Attributes:
        value: SI; None where it is not told.
        sd: its standard error; None where it was given.
        given: what was known before the drive, of one that is not told.
        source: where it comes from, or why it is not told.
    """

    value: float | None
    sd: float | None = None
    given: float | None = None
    source: str = ""


@dataclass(frozen=True)
class FiledDriver:
    """A driver as a file holds him.

    Attributes:
        name: whose.
        source: where the numbers come from.
        parameters: by name, all of LETTERS.
    """

    name: str
    source: str
    parameters: Mapping[str, FiledParameter]

    @classmethod
    def of(cls, driver: TwoPointDriver, name: str, source: str) -> FiledDriver:
        """A driver whose every parameter is known."""
        return cls(name, source, {n: FiledParameter(float(getattr(driver, n)), source="given") for n in LETTERS})

    @property
    def untold(self) -> tuple[str, ...]:
        """Names of the parameters without a value."""
        return tuple(n for n, p in self.parameters.items() if p.value is None)

    def driver(self, take: Collection[str] = ()) -> TwoPointDriver:
        """The driver to drive with.

        Args:
            take: names of the parameters that are not told and for which those given before the drive are taken.

        Raises:
            UsageError: a parameter is not told and is not among them; or one of them is told, or no parameter.
        """
        strange = [n for n in take if n not in self.untold]
        if strange:
            raise UsageError(
                f"the given {', '.join(strange)} of '{self.name}'",
                f"some of {', '.join(self.untold)}" if self.untold else "none: his file tells all of them",
                "leave these out",
            )
        lacking = [n for n in self.untold if n not in take]
        if lacking:
            given = ", ".join(f"{n} {self.parameters[n].given:g} {LETTERS[n][1]}" for n in lacking)
            raise UsageError(
                f"the file of '{self.name}' does not tell {', '.join(lacking)}",
                "a driver whose every parameter is told or given",
                f"to drive with what was given for them before the drive ({given}), say --given {','.join(self.untold)}",
            )
        return TwoPointDriver(
            **{n: float(p.given if p.value is None else p.value) for n, p in self.parameters.items()}  # type: ignore[arg-type]
        )


def named(word: str) -> str:
    """A parameter's name, of its name or letter.

    Raises:
        UsageError: there is none.
    """
    for name, (letter, _) in LETTERS.items():
        if word in (name, letter):
            return name
    raise UsageError(
        f"no parameter '{word}' of a driver", ", ".join(f"{n} ({letter})" for n, (letter, _) in LETTERS.items()),
        "choose among these",
    )  # fmt: skip


def load_two_point(path: str | Path) -> FiledDriver:
    """Read a driver file.

    Raises:
        UsageError: it cannot be read, or is none; the message says what is wrong.
    """
    return parse_two_point(read_text(path, "driver file", UsageError), str(path))


def save_two_point(driver: FiledDriver, path: str | Path) -> None:
    """Write a driver file that `load_two_point` reads; it appears under its name only when it is complete.

    Raises:
        UsageError: the name does not end in .toml, the file cannot be written, or it would not be read again.
    """
    target = Path(path)
    if target.suffix != ".toml":
        raise UsageError(f"cannot write a driver to '{target.name}'", "a name ending in .toml", "choose such a name")
    text = two_point_text(driver)
    if parse_two_point(text, f"the file of '{driver.name}'") != driver:
        raise UsageError(f"the file of '{driver.name}' would be read as another", _EXPECTED, "check its numbers")
    try:
        write_text(target, text)
    except OSError as error:
        raise UsageError(
            f"cannot write {path}: {error.strerror or error}", "a folder you may write into", "choose another name"
        ) from error


def two_point_text(driver: FiledDriver) -> str:
    """The text of a driver file."""
    lines = [f"name = {quoted(driver.name)}", f"source = {quoted(driver.source)}"]
    for name, p in driver.parameters.items():
        letter, unit = LETTERS[name]
        lines += ["", f"[{name}]" + (f"  # {letter}" if letter != name else "")]
        lines += [f"{key} = {x!r}" for key, x in (("value", p.value), ("given", p.given)) if x is not None]
        lines.append(f"unit = {quoted(unit)}")
        lines += [f"sd = {p.sd!r}"] if p.sd is not None else []
        lines.append(f"source = {quoted(p.source)}")
    return "\n".join(lines) + "\n"


def parse_two_point(text: str, where: str) -> FiledDriver:
    """A driver from the text of a file.

    Raises:
        UsageError: listing every fault.
    """
    table = parse_tables(text, where, UsageError)
    faults = [f"'{key}' is not known" for key in table if key not in ("name", "source", *LETTERS)]
    faults += [f"'{key}' is missing or no text" for key in ("name", "source") if not isinstance(table.get(key), str)]
    parameters: dict[str, FiledParameter] = {}
    for name, (_, unit) in LETTERS.items():
        part = table.get(name)
        if not isinstance(part, dict):
            faults.append(f"[{name}] is missing")
            continue
        found = _faults(name, part, unit)
        faults += found
        if not found:
            numbers = {key: float(part[key]) for key in ("value", "sd", "given") if key in part}
            parameters[name] = FiledParameter(
                numbers.get("value"), numbers.get("sd"), numbers.get("given"), part["source"]
            )
    if faults:
        raise UsageError(f"{where}: {'; '.join(faults)}", _EXPECTED, "mend the file")
    return FiledDriver(table["name"], table["source"], parameters)


def _faults(name: str, part: Mapping[str, Any], unit: str) -> list[str]:
    """What is wrong with one table."""
    faults = [f"{name}.{key} is not known" for key in part if key not in ("value", "unit", "sd", "given", "source")]
    if ("value" in part) == ("given" in part):
        faults.append(f"{name} needs a value, or else the one given")
    if part.get("unit") != unit:
        faults.append(f"{name}.unit is {part.get('unit')!r}, not '{unit}'")
    if not isinstance(part.get("source"), str):
        faults.append(f"{name}.source is missing or no text")
    for key in ("value", "given", "sd"):
        x = part.get(key, 1.0)
        if isinstance(x, bool) or not isinstance(x, int | float) or not isfinite(x):
            faults.append(f"{name}.{key} is {x!r}")
        elif key == "sd":
            faults += [f"{name}.sd is {x!r}"] if x < 0 else []
        else:
            try:
                TwoPointDriver(**{name: float(x)})
            except ValueError as error:
                faults.append(str(error))
    return faults
