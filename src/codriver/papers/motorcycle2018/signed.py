"""Eq. (17) with the sign of the yaw rate in place of the body's lateral acceleration: the least that mends it.

    a = sign(r) sqrt(f_y^2 + f_z^2 - g^2),   W = sign(r) sqrt(q^2 + r^2)            a negative radicand taken as 0

In a turn the yaw rate has the acceleration's sign; only while the turn changes sides, or v_y' is large, does it not.
"""

from __future__ import annotations

from dataclasses import replace

from codriver.kernel import Scalar, select
from codriver.observers.observer import Observer, Scalars
from codriver.observers.road_frame import road_frame_observer


def signed_frame(dt: float) -> Observer:
    """The conversion as an observer without states, in place of `road_frame_observer(dt, "squares")`.

    Args:
        dt: tick, s.
    """
    squares = road_frame_observer(dt, "squares")

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        new, out = squares.step(carry, u, y, ok, rho)
        a, W = out["lateral_acceleration"], out["yaw_rate"]
        size: Scalar = select(a < 0, -a, a)
        signed = select(W > 0, size, select(W < 0, -size, 0.0 * size))
        return new, {**out, "lateral_acceleration": signed}

    return replace(squares, name="road-frame-signed", step=step, settings={"way": "squares, sign of the yaw rate"})
