"""A drive as the two-point driver lived it: what he saw, the wheel in his hands, and his torque, on ticks at one speed.

    theta_near, theta_far       of `models.road_sight`, from curvature, offset and heading error along the drive
    delta_s, T_dr               wheel angle, rad, and the driver's torque, N m

The curvature ahead is that which the log holds later, so the last seconds are not used. Offset and heading error are the log's, or,
where it lacks them, sums of yaw rate, sideslip, curvature and speed. Those drift, so then everything goes through a high-pass of
third order at SLOW Hz, which changes nothing in a linear model whose parameters are constant.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from codriver.errors import LogError, MissingSignal
from codriver.identify.driver_holes import LONGEST_HOLE, covered, holes_of, holes_told
from codriver.models.road_sight import PathAhead, path_errors
from codriver.signals import Log, Signal
from codriver.signals.signal import Array

NEEDED = ("steering_wheel_angle", "driver_torque", "longitudinal_speed", "road_curvature")
WHERE = ("lateral_offset", "heading_error")
MOTION = ("sideslip_angle", "yaw_rate")
SETTLED = 10.0  # s from the start that are not used: the model starts from rest
PREVIEW = 2.4  # s to the end that are not used: the road ahead is seen so far
SLOW = 0.02  # Hz
LEAST_SECONDS = 60.0
LEAST_LEFT = 20.0  # s that count
SLOWEST_RATE, FASTEST_RATE = 20.0, 200.0  # Hz
LEAST_SPEED = 3.0  # m/s
MOST_SPREAD = 0.05  # of the speed


@dataclass(frozen=True, eq=False)
class DriverRecord:
    """A drive on ticks; columns of shape (n,).

    Attributes:
        near, far, angle: theta_near, theta_far, delta_s, rad.
        offset, heading: of the car from the path, m, rad.
        torque: T_dr, N m; curvature: rho, 1/m.
        speed: mean, m/s.
        dt: s.
        first, last: rows that count.
        summed: offset and heading error are sums, and everything went through the high-pass.
        source: of the log.
        points: near, m, and far, s, of the two directions; `path` and `place`, where the car was on it, m, give those of others.
        start: of a piece, s from where the drive begins.
    """

    near: Array = field(repr=False)
    far: Array = field(repr=False)
    angle: Array = field(repr=False)
    offset: Array = field(repr=False)
    heading: Array = field(repr=False)
    torque: Array = field(repr=False)
    curvature: Array = field(repr=False)
    speed: float
    dt: float
    first: int
    last: int
    summed: bool
    source: str
    points: tuple[float, float]
    path: PathAhead = field(repr=False)
    place: Array = field(repr=False)
    start: float = 0.0

    def seen(self, near: float, far: float) -> tuple[Array, Array]:
        """Directions of two points, rad: m ahead, and s ahead."""
        if (near, far) == self.points:
            return self.near, self.far
        return self._direction(near), self._direction(far * self.speed)

    def _direction(self, ahead: float) -> Array:
        bend = self.path.bend(self.place, ahead)
        return np.asarray((_quick(bend, self.dt) if self.summed else bend) - self.offset / ahead - self.heading)


def driver_record(log: Log, near: float, far: float) -> DriverRecord:
    """Take a drive.

    Args:
        log: with wheel angle, driver's torque, speed and curvature, and offset and heading error or sideslip and yaw rate.
        near: distance of the near point, m.
        far: the far point is where the car will be after so many s.

    Raises:
        MissingSignal: the log lacks one of them.
        LogError: the drive is too short, has holes (`driver_pieces` cuts it there), stands, or its speed varies.
    """
    name = log.source or "this log"
    used, summed = needed(log)
    known = {n: _known(log[n], name) for n in used}
    time, dt = _ticks({n: t for n, (t, _) in known.items()}, log["driver_torque"].rate, name)
    values = {n: np.interp(time, *known[n]) for n in used}
    v = values["longitudinal_speed"]
    speed = float(v.mean())
    if v.min() < LEAST_SPEED or v.std() > MOST_SPREAD * speed:
        raise LogError(
            f"{name}: a speed of {v.min():.1f} to {v.max():.1f} m/s, {v.std():.2f} m/s of spread",
            f"at least {LEAST_SPEED:g} m/s, with a spread of {100 * MOST_SPREAD:g} % at most: the model is one for each speed",
            "cut the log to a stretch at one speed",
        )
    place = np.concatenate([[0.0], np.cumsum(dt * (v[1:] + v[:-1]) / 2)])
    rho = values["road_curvature"]
    path = PathAhead.of(place, rho)
    if summed:
        y, psi = path_errors(time, v, rho, values["sideslip_angle"], values["yaw_rate"])
    else:
        y, psi = values["lateral_offset"], values["heading_error"]
    ahead = far * speed
    near_angle, far_angle, angle, y, psi, torque, bent = (
        _quick(x, dt) if summed else x
        for x in (
            path.bend(place, near) - y / near - psi, path.bend(place, ahead) - y / ahead - psi,
            values["steering_wheel_angle"], y, psi, values["driver_torque"], rho,
        )
    )  # fmt: skip
    first = round((SETTLED + (0.5 / SLOW if summed else 0.0)) / dt)
    last = int(np.searchsorted(place, place[-1] - max(near, ahead, PREVIEW * speed)))
    left = (last - first) * dt
    if left < LEAST_LEFT:
        unseen = max(near, ahead, PREVIEW * speed)
        raise LogError(
            f"{name}: {max(left, 0):.0f} s count, without {first * dt:.0f} s at the start, where the model settles, and the last "
            f"{unseen:.0f} m, whose road ahead is not in the log",
            f"at least {LEAST_LEFT:g} s",
            "record a longer drive, or give near and far points that are not so far ahead",
        )
    return DriverRecord(
        near_angle,
        far_angle,
        angle,
        y,
        psi,
        torque,
        bent,
        speed,
        dt,
        first,
        last,
        summed,
        name,
        (near, far),
        path,
        place,
    )


def needed(log: Log) -> tuple[tuple[str, ...], bool]:
    """Names of the signals that are used, and whether offset and heading error are sums of others.

    Raises:
        MissingSignal: the log lacks some; the message names all of them.
    """
    where, motion = ([n for n in names if n not in log] for names in (WHERE, MOTION))
    lacking = [n for n in NEEDED if n not in log]
    if where and motion:
        lacking.append(f"{' and '.join(where)} (or else {' and '.join(motion)})")
    if lacking:
        raise MissingSignal(
            f"{log.source or 'this log'} lacks {', '.join(lacking)}",
            f"{', '.join(NEEDED)}, and {' and '.join(WHERE)} or else {' and '.join(MOTION)}",
            "map those that the log has under other names in a names file, names.toml (codriver info LOG lists what it holds), and "
            "add the others to the log: curvature, offset and heading error come from a simulator, or from a map and a lane camera",
        )
    return NEEDED + (MOTION if where else WHERE), bool(where)


def _quick(x: Array, dt: float) -> Array:
    """What the high-pass leaves."""
    from scipy.signal import butter, sosfilt

    return np.asarray(sosfilt(butter(3, SLOW, "highpass", fs=1 / dt, output="sos"), x), float)


def _known(signal: Signal, name: str) -> tuple[Array, Array]:
    """Stamps and values of the samples that are numbers."""
    there = np.isfinite(signal.values)
    if np.count_nonzero(there) < 2:
        raise LogError(f"{name}: {signal.name} has no values", "a signal with numbers", "check how it was recorded")
    return signal.time[there], np.asarray(signal.values[there], float)


def _ticks(stamps: Mapping[str, Array], rate: float, name: str) -> tuple[Array, float]:
    """Ticks of the torque's rate over the stretch that all signals cover."""
    rate = min(rate, FASTEST_RATE)
    start, end = covered(stamps)
    if end - start < LEAST_SECONDS or rate < SLOWEST_RATE:
        raise LogError(
            f"{name}: {max(end - start, 0):.0f} s of all signals, torque at {rate:.3g} Hz",
            f"at least {LEAST_SECONDS:g} s at {SLOWEST_RATE:g} Hz: a driver's delay is 0.1 s",
            "record a longer drive" if rate >= SLOWEST_RATE else "record the torque faster, and a minute of it",
        )
    if holes := holes_of(stamps):
        raise LogError(
            f"{name}: {holes_told(holes)}", f"none above {LONGEST_HOLE:g} s", "cut the log to a stretch without them"
        )
    dt = round(1 / rate, 4)
    return start + dt * np.arange(int((end - start) / dt) + 1, dtype=np.float64), dt
