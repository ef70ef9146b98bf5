"""A sensor at the end of its range: plateaus of a signal.

A signal that is cut off shows its greatest (or least) value again and again, for many ticks on end, while the car goes on
moving. An honest one is there for a moment. So ticks that stay at an end for 0.3 s are left out, and where that happens
three times in a drive, it is told: the sensor's range, the scale in the DBC file, or an engine at full load.

Of the brake pressure and of the torque the lower end is no sign: released brakes rest, and so does an engine that is dragged.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from codriver.finding import Finding
from codriver.signals.grid import Flags
from codriver.signals.signal import Array

AT_END = 0.3  # s
ENDS: Mapping[str, tuple[int, ...]] = {
    "longitudinal_acceleration": (1, -1), "engine_torque": (1,), "brake_pressure": (1,),
}  # fmt: skip
# An end nearer to nothing than that is no end: m/s^2, N m, Pa.
LEAST_END: Mapping[str, float] = {
    "longitudinal_acceleration": 0.5, "engine_torque": 20.0, "brake_pressure": 1e5,
}  # fmt: skip
LEAST_PLATEAUS, LEAST_SECONDS = 3, 1.5
_UNITS = {"longitudinal_acceleration": ("m/s^2", 1.0), "brake_pressure": ("bar", 1e-5)}


@dataclass(frozen=True)
class Plateau:
    """An end at which a signal stayed.

    Attributes:
        name: of the signal.
        value: the end, SI.
        count: how often it stayed there.
        seconds: for how long in all.
    """

    name: str
    value: float
    count: int
    seconds: float


def plateaus(name: str, x: Array, good: Flags, dt: float) -> tuple[Flags, list[Plateau]]:
    """Where a signal stays at an end.

    Args:
        name: of the signal; one that is not among ENDS has no plateaus.
        x: its held samples, shape (n,).
        good: which of them are there and no nonsense, shape (n,).
        dt: tick, s.

    Returns:
        The ticks, shape (n,), and one entry for each end with plateaus.
    """
    mask, found = np.zeros(x.size, bool), []
    ticks = max(round(AT_END / dt), 2)
    for side in ENDS.get(name, ()) if good.any() and np.ptp(x[good]) > 0 else ():
        end = float(side * (side * x[good]).max())
        if side * end < LEAST_END[name]:
            continue
        edges = np.flatnonzero(np.diff(np.concatenate([[0], (x == end).astype(np.int8), [0]])))
        long = [(i, k) for i, k in zip(edges[::2], edges[1::2], strict=True) if k - i >= ticks]
        for i, k in long:
            mask[i:k] = True
        if len(long) >= LEAST_PLATEAUS:  # it is cut off there; noise breaks plateaus up
            mask |= x == end
        if long:
            found.append(Plateau(name, end, len(long), sum(int(k - i) for i, k in long) * dt))
    return mask, found


def told(found: Iterable[Plateau], source: str) -> list[Finding]:
    """What is to say about the plateaus of a drive."""
    said = []
    for one in found:
        if one.count < LEAST_PLATEAUS or one.seconds < LEAST_SECONDS:
            continue
        unit, factor = _UNITS.get(one.name, ("N m", 1.0))
        full = ", or the engine at full load" if one.name == "engine_torque" else ""
        said.append(Finding(
            "warn", f"{source}: {one.name} stays at {one.value * factor:.4g} {unit}, its {'least' if one.value < 0 else 'greatest'}"
            f" value, {one.count} times for {one.seconds:.3g} s in all: cut off at the end of its range{full}; these moments are "
            "left out",
        ))  # fmt: skip
    return said
