"""atan, atan2, asin and acos.

    atan(x) = atan(c) + atan((x - c)/(1 + c x)),   c one of 0, 1/2, 1, 3/2, infinity;   atan(t) = t + t^3 A(t^2),  |t| <= 7/16
    asin(x) = x + x^3 B(x^2)                       |x| <= 1/2
    asin(x) = pi/2 - 2 asin(sqrt((1 - x)/2))       1/2 < x <= 1

atan(c) and pi are sums of two numbers, A and B minimax fits (coefficients.py). A zero has no sign here: atan2(-0, -1) is pi,
not -pi. Source of the breakpoints and of the square root in two parts: FDLIBM (Sun Microsystems, 1993), e_asin.c, s_atan.c.
"""

from __future__ import annotations

from math import inf

from codriver.kernel.reals import Real, halves
from codriver.kernel.terms import Term, both, equal, pick, polynomial, root, where


def arctangent(real: Real, x: Term) -> Term:
    """The arc tangent, from -pi/2 to pi/2."""
    value = _of_positive(real, abs(x))
    return pick(x < 0.0, -value, value)


def arctangent2(real: Real, y: Term, x: Term) -> Term:
    """The angle of the point (x, y), from -pi to pi; 0 or pi where y is zero, 0 where both are."""
    up, along = abs(y), abs(x)
    ratio = pick(both(equal(up, inf), equal(along, inf)), 1.0, up / along)
    ratio = pick(both(equal(up, 0.0), equal(x, 0.0)), 0.0, ratio)
    value = _mirrored(real, x, _of_positive(real, ratio))
    return pick(y < 0.0, -value, value)


def arcsine(real: Real, x: Term) -> Term:
    """The arc sine; NaN where |x| > 1."""
    size = abs(x)
    root_, tail, head, rest = _half_angle(real, size)
    high, low = real.numbers("half_pi")
    # pi/2 - 2 (head + rest + root tail) in an order that keeps low; pi/4 - 2 head has hardly an error.
    bent = 0.5 * high - ((2.0 * (root_ * tail) - (low - 2.0 * rest)) - (0.5 * high - 2.0 * head))
    value = pick(size < 0.5, size + size * tail, bent)
    return pick(x < 0.0, -value, value)


def arccosine(real: Real, x: Term) -> Term:
    """The arc cosine, from 0 to pi; NaN where |x| > 1."""
    size = abs(x)
    root_, tail, head, rest = _half_angle(real, size)
    high, low = real.numbers("half_pi")
    flat = high - (size - (low - size * tail))
    return _mirrored(real, x, pick(size < 0.5, flat, 2.0 * (head + (root_ * tail + rest))))


def _mirrored(real: Real, x: Term, angle: Term) -> Term:
    """pi less the angle where x < 0."""
    high, low = (2.0 * part for part in real.numbers("half_pi"))
    return pick(x < 0.0, high - (angle - low), angle)


def _of_positive(real: Real, a: Term) -> Term:
    """The arc tangent of a >= 0."""
    above = [a >= limit / 16.0 for limit in (39, 19, 11, 7)]
    centres = [
        (a.listing.term(-1.0), a, real.numbers("half_pi")),
        (a - 1.5, 1.0 + 1.5 * a, real.numbers("atan_three_halves")),
        (a - 1.0, a + 1.0, real.numbers("atan_one")),
        (2.0 * a - 1.0, 2.0 + a, real.numbers("atan_half")),
    ]
    top, bottom, high, low = a, a.listing.term(1.0), a.listing.term(0.0), a.listing.term(0.0)
    for there, (over, under, parts) in zip(above[::-1], centres[::-1], strict=True):
        top, bottom = pick(there, over, top), pick(there, under, bottom)
        high, low = pick(there, parts[0], high), pick(there, parts[1], low)
    t = top / bottom
    z = t * t
    return high + (t + (low + t * z * polynomial(z, real.numbers("atan"))))


def _half_angle(real: Real, size: Term) -> tuple[Term, Term, Term, Term]:
    """s = sqrt((1 - |x|)/2); the tail of asin(v) = v + v tail, v the smaller of |x| and s; and s as a sum head + rest.

    The head has half the bits, so its square is exact and tells the rest.
    """
    half = 0.5 * (1.0 - size)
    z = pick(size < 0.5, size * size, half)
    s = root(half)
    head, _ = halves(s, real)
    rest = (half - head * head) / (s + head + where(equal(s, 0.0), 1.0))
    return s, z * polynomial(z, real.numbers("asin")), head, rest
