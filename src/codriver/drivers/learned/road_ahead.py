"""The road ahead: its curvature at the places the vehicle reaches at its present speed.

    s(t) = integral of v dt          rho(s) from the record          ahead(t, tau) = rho(s(t) + v(t) tau)

The road is where it is whatever the driver does, so a record of its curvature over distance serves as the map that a navigation
system or a camera would give. Only the present speed is used: how fast the vehicle will go is not known.
"""

from __future__ import annotations

import numpy as np

from codriver.drivers.learned.feature_setting import HONEST, FeatureSetting
from codriver.signals import Log, Signal
from codriver.signals.signal import Array


def curvature_ahead(curvature: Array, speed: Array, dt: float, times: tuple[float, ...]) -> Array:
    """Curvature ahead.

    Args:
        curvature: where the vehicle is, 1/m, shape (n,); NaN where unknown.
        speed: m/s, shape (n,); NaN where unknown.
        dt: tick, s.
        times: tau, s ahead of now at the present speed.

    Returns:
        shape (n, len(times)); NaN where the record does not reach so far, or the speed is not known.
    """
    known = np.isfinite(curvature)
    if not known.any():
        return np.full((curvature.size, len(times)), np.nan)
    driven = np.where(np.isfinite(speed), np.maximum(speed, 0.0), 0.0) * dt
    place = np.concatenate([[0.0], np.cumsum((driven[1:] + driven[:-1]) / 2)])
    where = place[:, None] + np.where(np.isfinite(speed), speed, np.nan)[:, None] * np.asarray(times)
    found = np.interp(where, place[known], curvature[known], right=np.nan)
    return np.where(np.isfinite(where), found, np.nan)


def with_road_ahead(log: Log, setting: FeatureSetting = HONEST) -> Log:
    """A drive with the road ahead as a map would give it: what `observer_of` asks for and a recording does not hold.

    Args:
        log: has road_curvature and longitudinal_speed.
        setting: of the driver's features (`driver.protocol.features`), for the tick and how far ahead.

    Returns:
        the log with road_curvature_ahead_1, ..., 1/m, a value a tick from the log's start.

    Raises:
        MissingSignal: the log lacks the curvature or the speed.
    """
    names = ("road_curvature", "longitudinal_speed")
    for name in names:
        log[name]
    grid = log.sample(names, setting.tick, start=log.start)
    curvature, speed = (np.where(grid.held[name], grid.values[name], np.nan) for name in names)
    ahead = curvature_ahead(curvature, speed, setting.tick, setting.previews)
    return log.with_signals(*(
        Signal(f"road_curvature_ahead_{k + 1}", grid.time, column, "1/m", "derived: road curvature over distance")
        for k, column in enumerate(ahead.T)
    ))  # fmt: skip
