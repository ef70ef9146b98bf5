"""Vehicle files: TOML, one table a parameter.

    name = "my-car"
    title = "My car, winter tyres"
    source = "weighed 2026-03-02; ratios from the workshop manual"

    [mass]
    value = 1550
    unit = "kg"
    sd = 30
    source = "scales"

A file is read strictly: an unknown table, a missing unit or a value out of bounds is an error, because a misspelt
parameter would otherwise be silently left out.
"""

from __future__ import annotations

import math
from importlib import resources
from pathlib import Path
from typing import Any

from codriver.errors import UnitError, VehicleError
from codriver.names import nearest
from codriver.toml_file import parse_tables, read_text
from codriver.units import to_si
from codriver.vehicles.known import KNOWN
from codriver.vehicles.vehicle import Parameter, Vehicle

_HEAD = ("name", "title", "source")
_FIELDS = ("value", "unit", "sd", "source")


def built_in_vehicles() -> list[str]:
    """Names of the vehicles that come with codriver."""
    return sorted(Path(f.name).stem for f in _data().iterdir() if f.name.endswith(".toml"))


def load_vehicle(vehicle: str | Path) -> Vehicle:
    """A built-in vehicle by name, or a vehicle file by path.

    Raises:
        VehicleError: no such vehicle or file, or the file is wrong; the message lists every fault at once.
    """
    path = Path(vehicle)
    if path.suffix != ".toml" and not path.exists():
        file = _data() / f"{vehicle}.toml"
        if not file.is_file():
            near = nearest(str(vehicle), built_in_vehicles())
            raise VehicleError(
                f"no vehicle is called '{vehicle}'",
                f"one of {', '.join(built_in_vehicles())}, or the path of a .toml file",
                f"did you mean {near}?" if near else "write a vehicle file; docs/vehicles.md shows how",
            )
        return parse_vehicle(file.read_text(encoding="utf-8"), f"built-in {vehicle}")
    return parse_vehicle(read_text(path, "vehicle file", VehicleError), str(path))


def parse_vehicle(text: str, where: str) -> Vehicle:
    """A vehicle from the text of a vehicle file.

    Raises:
        VehicleError: listing every fault of the file.
    """
    tables = parse_tables(text, where, VehicleError)
    faults = [f"'{key}' is missing at the top" for key in _HEAD if not isinstance(tables.get(key), str)]
    parameters = {}
    for name, table in tables.items():
        if name in _HEAD:
            continue
        parameter = _parameter(name, table, faults)
        if parameter is not None:
            parameters[name] = parameter
    if faults:
        raise VehicleError(
            f"{where}: " + "; ".join(faults),
            "tables named as in the list of docs/vehicles.md, each with value, unit and source (sd if known)",
            "mend the file; `codriver check vehicle FILE` shows whether all is well",
        )
    return Vehicle(tables["name"], tables["title"], tables["source"], parameters)


def _parameter(name: str, table: Any, faults: list[str]) -> Parameter | None:
    """One table of the file as a parameter; what is wrong with it is added to `faults`."""
    known = KNOWN.get(name)
    if known is None or not isinstance(table, dict):
        near = nearest(name, KNOWN)
        faults.append(f"[{name}] is not a parameter" + (f" (did you mean {near}?)" if near else ""))
        return None
    strange = [key for key in table if key not in _FIELDS]
    absent = [key for key in ("value", "unit", "source") if key not in table]
    if strange or absent:
        faults.extend([f"[{name}] has an unknown key '{key}'" for key in strange])
        faults.extend([f"[{name}] lacks '{key}'" for key in absent])
        return None
    try:
        factor, offset = to_si(str(table["unit"]), known.unit)
    except UnitError as error:
        faults.append(f"[{name}] {error.found} (expected {error.expected})")
        return None
    value = _convert(table["value"], factor, offset)
    sd = _convert(table["sd"], abs(factor), 0.0) if "sd" in table else None
    several = isinstance(value, tuple)
    if value is None or (several and not known.per_gear):
        faults.append(f"[{name}] value must be {'a number or one number per gear' if known.per_gear else 'one number'}")
        return None
    for number in value if isinstance(value, tuple) else (value,):
        if not known.low <= number <= known.high:
            faults.append(
                f"[{name}] value {number:g} {known.unit} is outside {known.low:g} to {known.high:g} {known.unit}"
            )
            return None
    if "sd" in table and (sd is None or min(sd if isinstance(sd, tuple) else (sd,)) < 0):
        faults.append(f"[{name}] sd must be a number that is not negative (or one per gear)")
        return None
    if isinstance(sd, tuple) and (not isinstance(value, tuple) or len(sd) != len(value)):
        count = len(value) if isinstance(value, tuple) else 1
        faults.append(
            f"[{name}] has {count} value{'s' if count > 1 else ''} and {len(sd)} sds; give one sd, or one for each value"
        )
        return None
    return Parameter(name, value, known.unit, sd, str(table["source"]))


def _convert(value: Any, factor: float, offset: float) -> float | tuple[float, ...] | None:
    """A number or list of numbers in SI units; None if it is neither."""

    def one(number: Any) -> float | None:
        good = isinstance(number, (int, float)) and not isinstance(number, bool) and math.isfinite(number)
        return factor * number + offset if good else None

    if isinstance(value, list):
        numbers = [one(number) for number in value]
        return tuple(n for n in numbers if n is not None) if numbers and None not in numbers else None
    return one(value)


def _data() -> Any:
    return resources.files("codriver.vehicles") / "data"
