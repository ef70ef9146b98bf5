"""The same place for several drives of a road: s from positions, measured along one of them.

The path of a reference drive is a line of points (x, y)(s), its own s along it. Another drive's position p is given the s of the
nearest point of that line,

    s(p) = argmin over s of |p - (x, y)(s)|,

sought from a little behind the s before it to some way ahead, so that a place that is passed twice is not mixed up. Latitude and
longitude become metres about the reference's first point: x = R cos(lat_0) (lon - lon_0), y = R (lat - lat_0), which over
50 km is wrong by some metres in 10 km alike for all drives. Drift of speeds is gone, up to the receivers' error. A drive that is
off the line by more than 50 m in the median is on another road.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from codriver.drivers.course import Course, course_of
from codriver.errors import UsageError
from codriver.estimate import Estimate
from codriver.signals.signal import Array

EARTH = 6_371_000.0  # R, m
OFF = 50.0  # m
BEHIND, AHEAD = 30.0, 300.0  # m sought around the last place
_SPACING = 5.0  # m between points of the reference


@dataclass(frozen=True, eq=False)
class Path:
    """A line to measure along: s (m, rising), x and y (m), shape (n,) each; the point that x and y are about (degrees)."""

    s: Array
    x: Array
    y: Array
    latitude: float
    longitude: float


def has_position(estimate: Estimate) -> bool:
    """Whether its log has a position, ten fixes at least."""
    log = estimate.log
    if "latitude" not in log or "longitude" not in log:
        return False
    return bool(_fixes(estimate)[0].size >= 10)


def path_of(estimate: Estimate) -> Path:
    """The path of a drive, with the s of its own course.

    Raises:
        UsageError: the log has no position.
        MissingSignal: it has no speed and no distance.
    """
    time, lat, lon = _required(estimate)
    course = course_of(estimate)
    s = np.interp(time, estimate.time, course.s)
    x, y = _metres(lat, lon, float(lat[0]), float(lon[0]))
    # Fixes while standing scatter about one place; points a few metres apart do not.
    kept = [0]
    for k in range(1, s.size):
        if s[k] - s[kept[-1]] >= _SPACING:
            kept.append(k)
    return Path(s[kept], x[kept], y[kept], float(lat[0]), float(lon[0]))


def place(estimate: Estimate, path: Path) -> Course:
    """The course of a drive along another drive's path.

    Raises:
        UsageError: the log has no position, or is on another road.
    """
    time, lat, lon = _required(estimate)
    x, y = _metres(lat, lon, path.latitude, path.longitude)
    s, off = project(path, x, y)
    if np.median(off) > OFF:
        raise UsageError(
            f"{estimate.log.source or 'a log'} is {np.median(off):.0f} m off the reference's path",
            f"drives of one road, within {OFF:.0f} m", "compare drives of one road, or align them by their start",
        )  # fmt: skip
    steady = np.maximum.accumulate(s)
    return Course(np.asarray(np.interp(estimate.time, time, steady)), "position")


def project(path: Path, x: Array, y: Array) -> tuple[Array, Array]:
    """s of the nearest points of a path, and the distances to them, m, shape (n,) each.

    Args:
        path: the line.
        x, y: m, in the order they were driven, shape (n,).
    """
    s, off = np.empty(x.size), np.empty(x.size)
    low, high = 0, path.s.size - 1  # the first fix may be anywhere
    for k in range(x.size):
        s[k], off[k] = _nearest(path, low, high, x[k], y[k])
        if off[k] > OFF:  # lost: look everywhere ahead
            s[k], off[k] = min(
                (s[k], off[k]), _nearest(path, low, path.s.size - 1, x[k], y[k]), key=lambda found: found[1]
            )
        low = max(int(np.searchsorted(path.s, s[k] - BEHIND)) - 1, 0)
        high = min(int(np.searchsorted(path.s, s[k] + AHEAD)) + 1, path.s.size - 1)
    return s, off


def _nearest(path: Path, low: int, high: int, x: float, y: float) -> tuple[float, float]:
    """s of the nearest point of the segments between points `low` and `high`, and its distance."""
    part = slice(low, high + 1)
    px, py, ps = path.x[part], path.y[part], path.s[part]
    if ps.size < 2:
        return float(ps[0]), float(np.hypot(px[0] - x, py[0] - y))
    dx, dy = np.diff(px), np.diff(py)
    square = np.maximum(dx * dx + dy * dy, 1e-12)
    share = np.clip(((x - px[:-1]) * dx + (y - py[:-1]) * dy) / square, 0.0, 1.0)
    away = np.hypot(px[:-1] + share * dx - x, py[:-1] + share * dy - y)
    best = int(np.argmin(away))
    return float(ps[best] + share[best] * (ps[best + 1] - ps[best])), float(away[best])


def _fixes(estimate: Estimate) -> tuple[Array, Array, Array]:
    """Times, latitudes and longitudes of the fixes, (0, 0) left out: receivers without a fix say so."""
    lat, lon = estimate.log["latitude"], estimate.log["longitude"]
    if not len(lat) or not len(lon):
        return (np.zeros(0),) * 3
    east = np.interp(lat.time, lon.time, lon.values)
    good = np.isfinite(lat.values) & np.isfinite(east) & ~((lat.values == 0) & (east == 0))
    return lat.time[good], lat.values[good], east[good]


def _required(estimate: Estimate) -> tuple[Array, Array, Array]:
    if not has_position(estimate):
        raise UsageError(
            f"{estimate.log.source or 'a log'} has no position", "latitude and longitude", "align by the start instead"
        )
    return _fixes(estimate)


def _metres(lat: Array, lon: Array, lat_0: float, lon_0: float) -> tuple[Array, Array]:
    """Metres east and north of a point."""
    east = (lon - lon_0 + 180.0) % 360.0 - 180.0
    return EARTH * np.cos(np.radians(lat_0)) * np.radians(east), EARTH * np.radians(lat - lat_0)
