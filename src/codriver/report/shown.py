"""How quantities are shown to people: display units, names in words, spans of time.

A report shows the vocabulary's display units (km/h, %, bar); everything before it is SI. The slope is shown as the 2017
paper shows it, 100 tan(alpha).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from codriver.names import VOCABULARY
from codriver.signals.signal import Array
from codriver.units import to_si

_PRETTY = {"m/s^2": "m/s²", "m/s^3": "m/s³", "N*m": "N m", "deg": "°", "deg/s": "°/s", "1": "", "rpm": "1/min"}


def shown(name: str, values: npt.ArrayLike, unit: str | None = None) -> Array:
    """Values of a quantity in its display unit.

    Args:
        name: standard name, or one of its bias; values of other names are shown as they are.
        values: in `unit`.
        unit: by default the vocabulary's SI unit.
    """
    numbers = np.asarray(values, dtype=float)
    entry = VOCABULARY.get(name.removesuffix("_bias"))
    if entry is None:
        return numbers
    if name == "road_slope":
        return 100.0 * np.tan(numbers)
    factor, offset = to_si(unit or entry.unit, entry.display)
    return factor * numbers + offset


def shown_unit(name: str, unit: str = "") -> str:
    """The display unit of a quantity as print has it ("m/s³"); `unit` where the name is no standard name."""
    entry = VOCABULARY.get(name.removesuffix("_bias"))
    text = entry.display if entry else unit
    return _PRETTY.get(text, text)


def words(name: str) -> str:
    """A name as words: "brake_pressure" is "brake pressure"."""
    return name.replace("_", " ")


def number(value: float, digits: int = 3) -> str:
    """A number for a table: `digits` significant at most, no exponent in the usual range, a dash for nothing."""
    if not np.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    size = abs(value)
    if not 1e-4 <= size < 1e6:
        written = f"{value:.{digits - 1}e}"
    else:
        written = f"{value:.0f}" if size >= 10**digits else f"{value:.{digits}g}"
    return written.replace("-", "−")


def clock(seconds: float) -> str:
    """A duration: "42.1 s", "12 min 3 s", "1 h 2 min"."""
    if seconds < 120:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s" if minutes < 60 else f"{minutes // 60} h {minutes % 60} min"
