"""The road ahead: its curvature at the places the vehicle reaches at its present speed.

    s(t) = integral of v dt          rho(s) from the record          ahead(t, tau) = rho(s(t) + v(t) tau)

The road is where it is whatever the driver does, so a record of its curvature over distance serves as the map that a navigation
system or a camera would give. Only the present speed is used: how fast the vehicle will go is not known.
"""

from __future__ import annotations

import numpy as np

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
