"""log, log1p and powers.

    x = 2^e m,   sqrt(1/2) <= m < sqrt(2);   s = (m - 1)/(m + 1)
    log(m) = f - (f^2/2 - s (f^2/2 + s^2 L(s^2))),   f = m - 1
    x^y = exp(y log(x)),   log(m) = 2 s (1 + s^2/3 + s^4 T(s^2))

L and T are minimax fits (coefficients.py). A power multiplies the logarithm's error by y log(x), up to 745 in double, so it
takes a logarithm in two numbers of together about twice the bits. The exponent e is found by comparison with powers of two.
Source of the first form: FDLIBM (Sun Microsystems, 1993), e_log.c.
"""

from __future__ import annotations

from math import inf, isfinite, nan

from codriver.kernel.exponential import limited, reduced, scaled
from codriver.kernel.reals import Real, exact_product, exact_sum
from codriver.kernel.rounding import floor
from codriver.kernel.terms import Term, both, either, equal, pick, polynomial, unequal, where


def logarithm(real: Real, x: Term) -> Term:
    """The natural logarithm; -infinity at 0, NaN below."""
    return _edges(x, _log(real, x, 0.0))


def logarithm_of_one_more(real: Real, x: Term) -> Term:
    """log(1 + x), with all its digits near 0."""
    y = 1.0 + x
    lost = pick(x < 1.0, x - (y - 1.0), 1.0 - (y - x))
    value = _log(real, y, lost / y)
    return pick(abs(x) < 2.0**-real.bits, x, _edges(y, value))


def power(real: Real, x: Term, y: Term) -> Term:
    """x^y; a negative x has powers with whole y only; x^0 and 1^y are 1. A constant y takes fewer operations."""
    size, known = abs(x), y.constant()
    value = _power(real, size, y)
    if known is not None and isfinite(known):
        grows, ends = known > 0.0, (inf, 0.0)
        value = pick(equal(size, 0.0), ends[grows], pick(equal(size, inf), ends[not grows], value))
        if not known.is_integer():
            return pick(x >= 0.0, value, nan)
        return pick(x < 0.0, -value, value) if known % 2.0 else value
    up = y > 0.0
    value = pick(equal(size, 0.0), pick(up, 0.0, inf), pick(equal(size, inf), pick(up, inf, 0.0), value))
    whole, odd = equal(floor(real, y), y), unequal(floor(real, 0.5 * y), 0.5 * y)
    value = pick(x >= 0.0, value, pick(both(x < 0.0, whole), pick(odd, -value, value), nan))
    return pick(either(equal(y, 0.0), equal(x, 1.0)), 1.0, pick(equal(y, y), value, y))


def _edges(x: Term, value: Term) -> Term:
    """A logarithm's value at and beyond the ends of its domain."""
    return pick(x > 0.0, pick(x < inf, value, inf), pick(equal(x, 0.0), -inf, nan))


def _split(real: Real, x: Term) -> tuple[Term, Term]:
    """e and m of x > 0: the exponent's binary digits are found from the highest down."""
    half, stride = real.top // 2, 3 * real.top // 4
    tiny = x < 2.0**-half
    m = pick(tiny, x * 2.0**stride, x)
    small = m < 1.0
    m = pick(small, m * 2.0**half, m)
    e = pick(small, -float(half), 0.0) - where(tiny, float(stride))
    for digit in range(real.top.bit_length() - 2, -1, -1):
        step = 2**digit
        there = m >= 2.0**step
        m = pick(there, m * 2.0**-step, m)
        e = e + where(there, float(step))
    above = m > real.number("root_two")
    return e + where(above, 1.0), pick(above, 0.5 * m, m)


def _log(real: Real, x: Term, more: Term | float) -> Term:
    """log(x) + more for x > 0 and a tiny `more`."""
    e, m = _split(real, x)
    f = m - 1.0
    s = f / (m + 1.0)
    z = s * s
    square = 0.5 * f * f
    first, second = real.numbers("ln2")
    bent = square - (s * (square + z * polynomial(z, real.numbers("log"))) + (e * second + more))
    return e * first - (bent - f)


def _power(real: Real, x: Term, y: Term) -> Term:
    """x^y for x > 0."""
    e, m = _split(real, x)
    # s and its rounding error: the remainder of the division, over the divisor.
    f = m - 1.0
    g, g_error = exact_sum(m, f.listing.term(1.0))
    s = f / g
    back, back_error = exact_product(s, g, real)
    s_error = (((f - back) - back_error) - s * g_error) / g
    # v = s^2 (1/3 + s^2 T) as a sum of two.
    z, z_error = exact_product(s, s, real)
    z_error = z_error + 2.0 * s * s_error
    third, third_error = real.numbers("third")
    t, t_error = exact_sum(f.listing.term(third), z * polynomial(z, real.numbers("log_tail")))
    t_error = t_error + third_error
    v, v_error = exact_product(z, t, real)
    v_error = v_error + (z * t_error + z_error * t)
    # log(x) = e ln 2 + 2 (s + s v)
    w, w_error = exact_product(s, v, real)
    w_error = w_error + (s * v_error + s_error * v)
    log, log_error = exact_sum(2.0 * s, 2.0 * w)
    log_error = log_error + 2.0 * (s_error + w_error)
    first, second = real.numbers("ln2")
    log, sum_error = exact_sum(e * first, log)
    log, last_error = exact_sum(log, log_error + (sum_error + e * second))
    # A huge y would overflow in the product's halves; from 2^(top/2) on the power is 0, 1 or infinity anyway.
    most = 2.0 ** (real.top // 2)
    y = pick(y > most, most, pick(y < -most, -most, y))
    product, product_error = exact_product(y, log, real)
    product_error = product_error + y * last_error
    cut = limited(real, product)
    more = pick(equal(cut, product), product_error, 0.0)
    k, high, rest = reduced(real, cut, more)
    return scaled(real, 1.0 + (high + rest), k)
