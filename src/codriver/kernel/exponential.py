"""exp, expm1 and the hyperbolic functions.

    x = k ln 2 + r,   k = nearest whole number to x/ln 2,   |r| <= (ln 2)/2
    exp(r) - 1 = r + r c/(2 - c),   c = r - r^2 E(r^2)
    exp(x) = 2^k (1 + (exp(r) - 1)),   exp(x) - 1 = (2^k - 1) + 2^k (exp(r) - 1)
    tanh(x) = q/(q + 2),   q = exp(2 x) - 1
    sinh(x) = (q + q/(q + 1))/2,   q = exp(x) - 1;    cosh(x) = (exp(x) + exp(-x))/2

ln 2 is subtracted in two parts, the first so short that its product with k is exact; E is a minimax fit (coefficients.py) to
r coth(r/2). 2^k is made of the binary digits of k. Source of the form: FDLIBM (Sun Microsystems, 1993), e_exp.c.
"""

from __future__ import annotations

from math import ceil

from codriver.kernel.reals import Real, nearest_integer, power_of_two
from codriver.kernel.terms import Term, pick, polynomial

_LN2 = 0.6931471805599453


def exponential(real: Real, x: Term) -> Term:
    """e^x; overflows to infinity, underflows through the subnormal numbers to 0."""
    k, high, rest = reduced(real, limited(real, x))
    return scaled(real, 1.0 + (high + rest), k)


def exponential_less_one(real: Real, x: Term) -> Term:
    """e^x - 1, with all its digits near 0."""
    far = float(real.bits)
    near, _ = _less_one(real, pick(abs(x) < far, x, 0.0), -2 * real.bits)
    return pick(x <= -far, -1.0, pick(x < far, near, exponential(real, x)))


def hyperbolic_tangent(real: Real, x: Term) -> Term:
    """The hyperbolic tangent; never beyond 1, and 1 from where that is nearest."""
    far = float(ceil((real.bits + 3) * _LN2 / 2.0))
    size = abs(x)
    q, q_rest = _less_one(real, 2.0 * pick(size > far, far, size), 0)
    below = q + 2.0
    ratio = q / below
    # Put right by what rounding took from q, above and below the line; 2 - below + q is what it took from the sum.
    value = ratio + (q_rest - ratio * (((2.0 - below) + q) + q_rest)) / below
    return pick(x < 0.0, -value, value)


def hyperbolic_sine(real: Real, x: Term) -> Term:
    """The hyperbolic sine."""
    size = abs(x)
    far = real.bits / 2.0
    q, _ = _less_one(real, pick(size < far, size, 0.0), 0)
    value = pick(size < far, 0.5 * (q + q / (q + 1.0)), _half_exponential(real, size))
    return pick(x < 0.0, -value, value)


def hyperbolic_cosine(real: Real, x: Term) -> Term:
    """The hyperbolic cosine."""
    half = _half_exponential(real, abs(x))
    return half + 0.25 / half


def limited(real: Real, x: Term) -> Term:
    """x, cut where e^x has long overflowed or vanished; NaN stays NaN."""
    high, low = (real.top + 2.0) * _LN2, -(real.top + real.bits + 0.0) * _LN2
    return pick(x > high, high, pick(x < low, low, x))


def reduced(real: Real, x: Term, more: Term | float = 0.0) -> tuple[Term, Term, Term]:
    """k, and e^r - 1 as a sum of two: r as rounded, and the rest; `more` is added to r."""
    k = nearest_integer(x * real.number("one_over_ln2"), real)
    first, second = real.numbers("ln2")
    high = x - k * first
    low = k * second if isinstance(more, float) else k * second - more
    r = high - low
    z = r * r
    c = r - z * polynomial(z, real.numbers("exp"))
    return k, high, r * c / (2.0 - c) - low


def scaled(real: Real, value: Term, k: Term) -> Term:
    """value 2^k with one rounding: beyond half the range of powers in two steps, the first exact."""
    half, stride = real.top // 2, 3 * real.top // 4
    above, below = k >= half, k < -half
    inner = pick(above, k - stride, pick(below, k + stride, k))
    outer = pick(above, 2.0**stride, pick(below, 2.0**-stride, 1.0))
    return value * power_of_two(inner, -half, real.top.bit_length() - 1) * outer


def _less_one(real: Real, x: Term, lowest: int) -> tuple[Term, Term]:
    """e^x - 1 and its last rounding error, where the whole part of x/ln 2 lies between `lowest` and 1.5 bits."""
    k, high, rest = reduced(real, x)
    power = power_of_two(k, lowest, (3 * real.bits // 2 - lowest).bit_length())
    most, little = (power - 1.0) + power * high, power * rest
    q = most + little
    return q, (most - q) + little


def _half_exponential(real: Real, x: Term) -> Term:
    """e^x/2, which overflows later than e^x does."""
    k, high, rest = reduced(real, limited(real, x))
    return scaled(real, 1.0 + (high + rest), k - 1.0)
