"""A road along its distance: slope, speed limits, curves, stops, scenes.

A road is written as a short list of zones, curves, slopes, stops and scenes, and looked up in tables of one entry a metre,
because the simulation asks for the slope at every step and the driver for the speeds of the next few hundred metres.

    alpha(s)   slope, rad, positive uphill; between two levels it changes as x^2 (3 - 2 x), whose rate is bounded
    rho(s)     curvature, 1/m, positive to the left, with linear transitions (clothoids)
    limit(s)   the signed speed, m/s, piecewise constant
    eager(s)   how briskly this place asks to be driven: 1 ordinary, 1.5 joining a fast road, 0.6 a car park
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from codriver.errors import UsageError
from codriver.signals.signal import Array

KMH = 1 / 3.6


@dataclass(frozen=True)
class Zone:
    """From `start` (m) on the signed speed is `speed` (m/s), and drivers are `eager`."""

    start: float
    speed: float
    eager: float = 1.0


@dataclass(frozen=True)
class Curve:
    """A bend from `start` to `stop` (m) of signed `radius` (m, positive to the left)."""

    start: float
    stop: float
    radius: float


@dataclass(frozen=True)
class Grade:
    """From `start` on, over `length` (m), the slope goes over to `slope` (rise over run; 0.05 is 5 %)."""

    start: float
    length: float
    slope: float


@dataclass(frozen=True)
class Stop:
    """A line at `at` (m) where everyone stops, and waits `wait` seconds."""

    at: float
    wait: float


@dataclass(frozen=True)
class Scene:
    """Something seen ahead that goes away again: another car at an intersection.

    From `seen` metres before `at` (m) on, nobody wants to pass `at` faster than `speed` (m/s); `lasts` seconds later the
    way is free.
    """

    at: float
    speed: float
    seen: float
    lasts: float


@dataclass(frozen=True, eq=False)
class Road:
    """A road as tables of one entry a metre, index 0 at s = 0.

    Attributes:
        name: for people.
        slope: alpha, rad, shape (n,).
        curvature: rho, 1/m, shape (n,).
        limit: signed speed, m/s, shape (n,).
        eager: shape (n,).
        stops, scenes: by distance.
    """

    name: str
    slope: Array
    curvature: Array
    limit: Array
    eager: Array
    stops: tuple[Stop, ...]
    scenes: tuple[Scene, ...] = ()

    @property
    def length(self) -> float:
        """Length of the road, m."""
        return float(self.slope.size - 1)

    @property
    def height(self) -> Array:
        """Height over the start, m, shape (n,): the integral of sin(alpha) over the distance driven."""
        rise = np.sin(self.slope)
        return np.concatenate([[0.0], np.cumsum(0.5 * (rise[1:] + rise[:-1]))])

    def at(self, table: Array, s: Array) -> Array:
        """A table looked up at distances s (m), linearly; held beyond the ends."""
        return np.interp(s, np.arange(table.size, dtype=float), table)


def build_road(
    name: str,
    length: float,
    zones: list[Zone],
    *,
    grades: list[Grade] | None = None,
    curves: list[Curve] | None = None,
    stops: list[Stop] | None = None,
    scenes: list[Scene] | None = None,
    transition: float = 20.0,
) -> Road:
    """A road from its parts.

    Args:
        name: for people.
        length: m.
        zones: speed zones; the first starts at 0.
        grades: changes of slope, by distance; level before the first.
        curves: bends; straight between them.
        stops: lines to stop at.
        scenes: what is seen for a while.
        transition: length over which a bend's curvature builds up and fades, m.

    Raises:
        UsageError: the zones do not start at 0, or a part lies beyond the road's end.
    """
    grades, curves, stops, scenes = grades or [], curves or [], stops or [], scenes or []
    if not zones or zones[0].start != 0.0:
        raise UsageError(
            "the first speed zone does not start at 0 m", "zones that cover the road", "start the first zone at 0"
        )
    ends = [z.start for z in zones] + [g.start for g in grades] + [c.stop for c in curves]
    last = max(ends + [p.at for p in stops] + [p.at for p in scenes])
    if last > length:
        raise UsageError(f"a part of the road lies at {last:g} m", f"all within its {length:g} m", "lengthen the road")
    s = np.arange(math.ceil(length) + 1, dtype=float)
    zone = np.searchsorted(np.array([z.start for z in zones]), s, side="right") - 1
    slope = np.zeros_like(s)
    level = 0.0
    for grade in sorted(grades, key=lambda g: g.start):
        x = np.clip((s - grade.start) / grade.length, 0.0, 1.0)
        new = math.atan(grade.slope)
        slope += (new - level) * x * x * (3.0 - 2.0 * x)
        level = new
    curvature = np.zeros_like(s)
    for curve in curves:
        rise = np.clip((s - curve.start + transition) / transition, 0.0, 1.0)
        fall = np.clip((curve.stop + transition - s) / transition, 0.0, 1.0)
        curvature += np.minimum(rise, fall) / curve.radius
    return Road(
        name,
        slope,
        curvature,
        np.array([z.speed for z in zones])[zone],
        np.array([z.eager for z in zones])[zone],
        tuple(sorted(stops, key=lambda p: p.at)),
        tuple(sorted(scenes, key=lambda p: p.at)),
    )


def demo_road() -> Road:
    """Three minutes of varied road: town, climb, bend, descent, give-way line, main road, a last stop."""
    return build_road(
        "demo: town, hill, bend, give way, main road",
        4200.0,
        zones=[
            Zone(0, 50 * KMH, 0.75),
            Zone(330, 90 * KMH),
            Zone(980, 70 * KMH),
            Zone(1330, 50 * KMH),
            Zone(1632, 90 * KMH, 1.45),
            Zone(2130, 50 * KMH, 0.8),
        ],
        grades=[
            Grade(380, 90, 0.05),
            Grade(640, 90, 0.0),
            Grade(1010, 80, -0.035),
            Grade(1250, 70, 0.0),
            Grade(1700, 120, 0.015),
        ],
        curves=[Curve(860, 930, 55), Curve(1760, 1900, -400)],
        stops=[Stop(0, 2.5), Stop(1630, 4.0), Stop(2320, 60.0)],
    )
