"""Whole numbers, signs, extremes, remainders and the hypotenuse: exact, but for hypot.

    floor(x) = fl((|x| + 2^(bits - 1)) - 2^(bits - 1)) with x's sign, less 1 where that is above x
    fmod(x, y) = x - trunc(x/y) y,   remainder(x, y) = x - round(x/y) y      for |x/y| < 2^25 (float 2^11), else NaN

The quotient, a whole number n, may be off by one, since x/y is rounded; the remainder, whose parts n y_high and n y_low are
exact, tells and is put right. A zero has no sign here: copysign(1, -0) is 1. min and max give the other where one is NaN, as
C99 does.
"""

from __future__ import annotations

from math import inf, nan

from codriver.kernel.reals import Real, exact_sum, halves
from codriver.kernel.terms import Term, both, either, pick, root, unequal, where


def floor(real: Real, x: Term) -> Term:
    """The largest whole number not above x."""
    rounded = _round(real, x)
    return pick(abs(x) < 2.0 ** (real.bits - 1), rounded - where(rounded > x, 1.0), x)


def ceiling(real: Real, x: Term) -> Term:
    """The smallest whole number not below x."""
    rounded = _round(real, x)
    return pick(abs(x) < 2.0 ** (real.bits - 1), rounded + where(rounded < x, 1.0), x)


def sign(real: Real, x: Term) -> Term:
    """-1, 0 or 1."""
    return pick(x > 0.0, 1.0, pick(x < 0.0, -1.0, x))


def with_sign(real: Real, x: Term, y: Term) -> Term:
    """|x| with the sign of y; y = -0 counts as positive."""
    return pick(y < 0.0, -abs(x), abs(x))


def smaller(real: Real, x: Term, y: Term) -> Term:
    """The smaller; of a number and a NaN the number."""
    return pick(either(x <= y, unequal(y, y)), x, y)


def larger(real: Real, x: Term, y: Term) -> Term:
    """The larger; of a number and a NaN the number."""
    return pick(either(x >= y, unequal(y, y)), x, y)


def fmod(real: Real, x: Term, y: Term) -> Term:
    """What is left of x after taking off whole y's, with the sign of x."""
    over, under = abs(x), abs(y)
    n = floor(real, over / under)
    left = _left(real, over, under, n)
    left = pick(left < 0.0, left + under, left)
    left = pick(over < under, over, _known(real, n, under, left))
    return pick(x < 0.0, -left, left)


def remainder(real: Real, x: Term, y: Term) -> Term:
    """x less the nearest whole multiple of y; at half way less the even one."""
    over, under = abs(x), abs(y)
    n = _round(real, over / under)
    left = _left(real, over, under, n)
    half = 0.5 * under
    left = pick(left > half, left - under, pick(left < -half, left + under, left))
    left = pick(both(over <= half, over < under), over, _known(real, n, under, left))
    return pick(x < 0.0, -left, left)


def hypotenuse(real: Real, x: Term, y: Term) -> Term:
    """sqrt(x^2 + y^2) without overflow on the way; infinite where one of them is."""
    far, near = abs(x), abs(y)
    size = larger(real, far, near)
    stride = 2.0 ** (real.top // 2 + real.bits + 2)
    big, small = size > 2.0 ** (real.top // 2 - 2), size < 2.0 ** -(real.top // 2 - real.bits)
    scale = pick(big, 1.0 / stride, pick(small, stride, 1.0))
    back = pick(big, stride, pick(small, 1.0 / stride, 1.0))
    a, b = far * scale, near * scale
    return pick(either(far >= inf, near >= inf), inf, root(a * a + b * b) * back)


def _round(real: Real, x: Term) -> Term:
    """The nearest whole number, ties to even; for |x| below 2^(bits - 1)."""
    shift = 2.0 ** (real.bits - 1)
    size = (abs(x) + shift) - shift
    return pick(x < 0.0, -size, size)


def _left(real: Real, x: Term, y: Term, n: Term) -> Term:
    """x - n y without error, where the result is below 2 y."""
    high, low = halves(y, real)
    left, error = exact_sum(x, -(n * high))
    return (left - n * low) + error


def _known(real: Real, n: Term, y: Term, value: Term) -> Term:
    """The value where its parts are exact, else NaN: few whole y's, and y neither huge nor nearly subnormal."""
    limit = 2.0 ** (real.bits // 2 - 1)
    low, high = 2.0 ** (2 * real.bits + 2 - real.top), 2.0 ** (real.top - real.bits)
    return pick(both(n < limit, both(y > low, y < high)), value, nan)
