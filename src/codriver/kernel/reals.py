"""The two kinds of numbers a step is printed in, and products without rounding error.

    x y = p + e,    p = fl(x y),    e from the halves of x and y         (T. J. Dekker, doi 10.1007/BF01397083)
    x + y = s + e,  s = fl(x + y)                                        (D. E. Knuth, The Art of Computer Programming 2, 4.2.2)

A number of `bits` bits is split into halves by a product with 2^h + 1, h = bits/2 rounded up (G. W. Veltkamp).
"""

from __future__ import annotations

from dataclasses import dataclass

from codriver.kernel.coefficients import NUMBERS
from codriver.kernel.terms import Term, pick, where


@dataclass(frozen=True)
class Real:
    """An IEEE 754 binary format.

    Attributes:
        name: of the type in C.
        bits: of the significand, the hidden one included.
        top: every finite number lies below 2^top.
        circle: rad; largest argument of sin, cos and tan.
    """

    name: str
    bits: int
    top: int
    circle: float

    def numbers(self, name: str) -> tuple[float, ...]:
        """A polynomial or the parts of a constant."""
        return NUMBERS[self.name][name]

    def number(self, name: str) -> float:
        """A constant of one part."""
        return NUMBERS[self.name][name][0]


DOUBLE = Real("double", 53, 1024, 1e5)
FLOAT = Real("float", 24, 128, 5000.0)
REALS = {real.name: real for real in (DOUBLE, FLOAT)}


def nearest_integer(x: Term, real: Real) -> Term:
    """The nearest whole number, ties to even; for |x| below 2^(bits - 2)."""
    shift = 1.5 * 2.0 ** (real.bits - 1)
    return (x + shift) - shift


def power_of_two(n: Term, lowest: int, digits: int) -> Term:
    """2^n without error, for whole n from `lowest` to lowest + 2^digits - 1: the binary digits of n - lowest one by one."""
    left = n - float(lowest) if lowest else n
    result = n.listing.term(2.0**lowest)
    for digit in range(digits - 1, -1, -1):
        there = left >= 2.0**digit
        result = pick(there, result * 2.0 ** (2**digit), result)
        if digit:
            left = left - where(there, 2.0**digit)
    return result


def exact_sum(x: Term, y: Term) -> tuple[Term, Term]:
    """x + y as rounded, and its rounding error."""
    total = x + y
    part = total - x
    return total, (x - (total - part)) + (y - part)


def halves(x: Term, real: Real) -> tuple[Term, Term]:
    """x as a sum of two numbers of half the bits; |x| below 2^(top - bits/2 - 2)."""
    scaled = x * (2.0 ** ((real.bits + 1) // 2) + 1.0)
    high = scaled - (scaled - x)
    return high, x - high


def exact_product(x: Term, y: Term, real: Real) -> tuple[Term, Term]:
    """x y as rounded, and its rounding error; neither may be huge or subnormal."""
    product = x * y
    (a, b), (c, d) = halves(x, real), halves(y, real)
    return product, (((a * c - product) + a * d) + b * c) + b * d
