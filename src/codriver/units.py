"""Conversion of units, at the edge only: what comes in is made SI here, and nothing inside converts again.

pint knows the units; this module knows how automotive files spell them.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from codriver.errors import UnitError

if TYPE_CHECKING:
    import pint

# Spellings met in DBC files, MDF channels and CSV headers that pint does not take, or takes for something else.
_SPELLINGS = {
    "": "dimensionless", "-": "dimensionless", "1": "dimensionless", "n/a": "dimensionless", "bool": "dimensionless",
    "%": "percent", "Percent": "percent", "g": "standard_gravity", "G": "standard_gravity",
    "kph": "km/h", "kmh": "km/h", "KPH": "km/h", "km/hr": "km/h", "MPH": "mph",
    "m/s2": "m/s^2", "m/s²": "m/s^2", "m/s/s": "m/s^2", "m/ss": "m/s^2", "m/s^^2": "m/s^2", "m/s3": "m/s^3", "m/s³": "m/s^3",
    "°": "degree", "Deg": "degree", "degrees": "degree", "°/s": "degree/s", "deg/sec": "degree/s", "Deg/s": "degree/s",
    "dps": "degree/s", "Nm": "N*m", "NM": "N*m", "nm": "N*m", "N-m": "N*m", "N.m": "N*m", "Newton-meter": "N*m",
    "1/min": "rpm", "U/min": "rpm", "RPM": "rpm", "revs/min": "rpm", "Bar": "bar", "mBar": "mbar", "C": "degC", "°C": "degC",
    "sec": "s", "S": "s", "msec": "ms", "usec": "us", "µs": "us",
}  # fmt: skip
# Unit spellings that mean the plain SI unit asked for: no need to wake pint, whose start costs a third of a second.
_SAME = {"m/s^2": {"m/s2", "m/s²", "m/s^2"}, "N*m": {"Nm", "N*m"}, "1": {"", "-", "1"}}


@cache
def _registry() -> pint.UnitRegistry:
    import pint

    return pint.UnitRegistry(autoconvert_offset_to_baseunit=True)


@cache
def to_si(unit: str, target: str) -> tuple[float, float]:
    """Factor and offset that take a number in `unit` to `target`: x_target = factor * x + offset.

    Args:
        unit: the unit as the file spells it ("km/h", "%", "Nm", "deg/s", "degC").
        target: the unit wanted, usually the vocabulary's SI unit.

    Raises:
        UnitError: the unit is unknown, or measures another kind of quantity.
    """
    if unit == target or unit in _SAME.get(target, ()):
        return 1.0, 0.0
    known = _FAST.get((unit, target))
    if known is not None:
        return known, 0.0
    import pint

    registry = _registry()
    try:
        source = registry.Unit(_SPELLINGS.get(unit.strip(), unit.strip()))
        wanted = registry.Unit(_SPELLINGS.get(target, target))
        zero = registry.Quantity(0.0, source).to(wanted).magnitude
        one = registry.Quantity(1.0, source).to(wanted).magnitude
    except pint.DimensionalityError:
        raise UnitError(
            f"unit '{unit}' does not measure the same kind of quantity as '{target}'",
            f"a unit convertible to '{target}'",
            "correct the unit in the names file or vehicle file",
        ) from None
    except (pint.UndefinedUnitError, pint.DefinitionSyntaxError, AttributeError, ValueError, TypeError, AssertionError):
        raise UnitError(
            f"unit '{unit}' is not known",
            f"a unit convertible to '{target}', such as '{target}'",
            "give the unit in the names file or vehicle file, in a spelling that pint understands",
        ) from None
    return float(one - zero), float(zero)


_DEG = 0.017453292519943295
_FAST = {
    ("km/h", "m/s"): 1 / 3.6, ("kph", "m/s"): 1 / 3.6, ("%", "1"): 0.01, ("bar", "Pa"): 1e5, ("deg", "rad"): _DEG,
    ("deg/s", "rad/s"): _DEG, ("rpm", "rad/s"): 0.10471975511965977, ("1/min", "rad/s"): 0.10471975511965977,
    ("g", "m/s^2"): 9.80665, ("m/s", "km/h"): 3.6, ("Pa", "bar"): 1e-5, ("1", "%"): 100.0, ("rad", "deg"): 1 / _DEG,
    ("rad/s", "deg/s"): 1 / _DEG, ("rad/s", "rpm"): 9.549296585513721, ("rad", "%"): 100.0,
    ("N/bar", "N/Pa"): 1e-5, ("N*m/percent", "N*m"): 100.0,
}  # fmt: skip


def is_known(unit: str) -> bool:
    """Whether the unit can be read at all, whatever it measures."""
    import pint

    try:
        _registry().Unit(_SPELLINGS.get(unit.strip(), unit.strip()))
    except (pint.errors.PintError, AttributeError, ValueError, TypeError, AssertionError):
        return False
    return True
