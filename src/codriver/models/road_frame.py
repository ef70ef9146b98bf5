"""From a leaning machine's body frame to the road's: what gyroscope and accelerometer show, and what the linear model wants.

A body that leans by phi (positive to the right) and neither pitches nor heaves, in ISO 8855 axes, the accelerometer showing
specific force (f_z = +g at rest); a is the lateral acceleration along the road, W the yaw rate about the vertical:

    f_y = a cos phi + g sin phi,   f_z = -a sin phi + g cos phi                                       (16)
    q   = W sin phi,               r   = W cos phi,               p = phi'                            (18), (20)

**The paper's way** squares away the unknown roll:

    a = sign(f_y) sqrt(f_y^2 + f_z^2 - g^2)                                                           (17)
    W = sign(r) sqrt(q^2 + r^2)                                                                       (19)

The sizes are right, the rest is not. In a balanced turn f_y is nearly 0, so its sign is noise, and with wide tyres the wrong one.
Vertical acceleration makes the radicand of (17) negative, and near a = 0 its root turns an error e into sqrt(2 g e). (19) never
leaves its domain, but cannot be nearer to 0 than the noise of q. Both are told by flags.

**Without root and sign**: in a balanced turn a = v W and sin phi = -v r / g, so

    cos phi = sqrt(1 - (v r / g)^2),   W = r / cos phi,   a = v W                                     turn

odd and smooth in r, with the lean held at `STEEPEST` where v r / g says more. It leaves out v_y' and what wide tyres take.

**With a roll angle** known, such as an observer's: a = f_y cos phi - f_z sin phi, W = q sin phi + r cos phi, exactly.

Damon, Ichalal, Arioui 2018, whose axes are y right, z down: all but roll turned round here. Operations are exact ones.
"""

from __future__ import annotations

from math import cos, sin
from typing import Any, NamedTuple

from codriver.kernel.expressions import either, select, sqrt

# A CasADi SX or a float; CasADi ships no types.
Value = Any
GRAVITY = 9.81  # m/s^2
STEEPEST = 0.9  # sine of the greatest lean that a turn is taken for: 64 degrees


class RoadFrame(NamedTuple):
    """Motion along the road.

    Attributes:
        lateral_acceleration: a, m/s^2.
        yaw_rate: W, rad/s.
        outside: 1 where a root's argument is outside its domain, or a turn steeper than can be, and was cut.
        doubtful_sign: 1 where a sign was taken from a signal within its noise; 0 where none is taken.
    """

    lateral_acceleration: Value
    yaw_rate: Value
    outside: Value
    doubtful_sign: Value


def by_squares(
    f_y: Value, f_z: Value, q: Value, r: Value, *, acceleration_noise: float, rate_noise: float
) -> RoadFrame:
    """The paper's (17) and (19), a negative radicand taken as 0.

    Args:
        f_y, f_z: specific forces along the body's y and z, m/s^2.
        q, r: pitch and yaw rate in the body, rad/s.
        acceleration_noise, rate_noise: what f_y and r show by chance, m/s^2 and rad/s; the sign below twice that is doubtful.
    """
    radicand = f_y * f_y + f_z * f_z - GRAVITY * GRAVITY
    outside = radicand < 0
    size, turning = sqrt(select(outside, 0.0, radicand)), sqrt(q * q + r * r)
    doubtful = either(abs(f_y) < 2 * acceleration_noise, abs(r) < 2 * rate_noise)
    return RoadFrame(_signed(f_y, size), _signed(r, turning), 1.0 * outside, 1.0 * doubtful)


def by_turn(v: Value, r: Value) -> RoadFrame:
    """The balanced turn: no root of a difference, and no sign.

    Args:
        v: speed, m/s.
        r: yaw rate in the body, rad/s.
    """
    lean = v * r / GRAVITY
    outside = either(lean > STEEPEST, lean < -STEEPEST)
    held = select(lean > STEEPEST, STEEPEST, select(lean < -STEEPEST, -STEEPEST, lean))
    W = r / sqrt(1 - held * held)
    return RoadFrame(v * W, W, 1.0 * outside, 0.0 * W)


def by_roll(phi: float, f_y: float, f_z: float, q: float, r: float) -> RoadFrame:
    """The rotation by a roll angle that is known.

    Args:
        phi: rad.
        f_y, f_z: m/s^2.
        q, r: rad/s.
    """
    return RoadFrame(f_y * cos(phi) - f_z * sin(phi), q * sin(phi) + r * cos(phi), 0.0, 0.0)


def body_frame(phi: float, a: float, W: float) -> tuple[float, float, float, float]:
    """f_y, f_z, q, r of (16) and (18) without pitch: what sensors show.

    Args:
        phi: rad.
        a: m/s^2.
        W: rad/s.
    """
    c, s = cos(phi), sin(phi)
    return a * c + GRAVITY * s, -a * s + GRAVITY * c, W * s, W * c


def _signed(sign: Value, size: Value) -> Value:
    """The size with a sign; 0 where there is none."""
    return select(sign > 0, size, select(sign < 0, -size, 0.0 * size))
