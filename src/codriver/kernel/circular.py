"""sin, cos and tan.

    x = n pi/2 + r + t,   n = nearest whole number to 2 x/pi,   |r| <= pi/4,  t the rounding error of r
    sin(r + t) = r + (r^3 S(r^2) + t (1 - r^2/2)),   cos(r + t) = 1 - r^2/2 + (r^4 C(r^2) - r t)

pi/2 is subtracted in four parts, three of them so short that their products with n are exact; S and C are minimax fits
(coefficients.py). The quadrant, n modulo 4, chooses between sine and cosine and their signs. Beyond `Real.circle` (100,000
rad in double) the answer is NaN: there the parts are too short for a right one. Source of the reduction: W. J. Cody and W. Waite,
Software Manual for the Elementary Functions, 1980; of the two sums: FDLIBM (Sun Microsystems, 1993), k_sin.c and k_cos.c.
"""

from __future__ import annotations

from math import nan

from codriver.kernel.reals import Real, exact_sum, nearest_integer
from codriver.kernel.terms import Term, either, equal, pick, polynomial


def sine(real: Real, x: Term) -> Term:
    """The sine."""
    quadrant, (s, _), (c, _) = _reduced(real, x)
    value = pick(equal(abs(quadrant), 1.0), c, s)
    turned = either(equal(quadrant, -1.0), equal(abs(quadrant), 2.0))
    return _known(real, x, pick(turned, -value, value))


def cosine(real: Real, x: Term) -> Term:
    """The cosine."""
    quadrant, (s, _), (c, _) = _reduced(real, x)
    value = pick(equal(abs(quadrant), 1.0), s, c)
    turned = either(equal(quadrant, 1.0), equal(abs(quadrant), 2.0))
    return _known(real, x, pick(turned, -value, value))


def tangent(real: Real, x: Term) -> Term:
    """The tangent: sine over cosine, put right by what rounding took from both."""
    quadrant, (s, s_rest), (c, c_rest) = _reduced(real, x)
    odd = equal(abs(quadrant), 1.0)
    top, top_rest = pick(odd, -c, s), pick(odd, -c_rest, s_rest)
    bottom, bottom_rest = pick(odd, s, c), pick(odd, s_rest, c_rest)
    ratio = top / bottom
    return _known(real, x, ratio + (top_rest - ratio * bottom_rest) / bottom)


def _known(real: Real, x: Term, value: Term) -> Term:
    """The value where the reduction holds, else NaN."""
    return pick(abs(x) <= real.circle, value, nan)


def _reduced(real: Real, x: Term) -> tuple[Term, tuple[Term, Term], tuple[Term, Term]]:
    """n modulo 4 as one of -2..2; sine and cosine of what is left of the angle, each with its rounding error."""
    n = nearest_integer(x * real.number("two_over_pi"), real)
    quadrant = n - 4.0 * nearest_integer(0.25 * n, real)
    first, second, third, fourth = real.numbers("half_pi_parts")
    left = x - n * first  # no rounding: near n pi/2 the two agree in their first digits
    left, error2 = exact_sum(left, -(n * second))
    left, error3 = exact_sum(left, -(n * third))
    r, t = exact_sum(left, error2 + (error3 - n * fourth))
    z = r * r
    half = 0.5 * z
    one = 1.0 - half
    bend = r * z * polynomial(z, real.numbers("sin")) + t * one
    s = r + bend
    curve = ((1.0 - one) - half) + (z * z * polynomial(z, real.numbers("cos")) - r * t)
    c = one + curve
    return quadrant, (s, (r - s) + bend), (c, (one - c) + curve)
