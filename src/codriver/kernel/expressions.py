"""What a step may use beside + - * /, comparisons and CasADi's functions: exact operations.

A step is written once and runs twice: on CasADi's symbols, where it is recorded, and on plain floats, where it can be
followed with a debugger. Flags are numbers, 0.0 or 1.0. Everything here is exact in IEEE 754 arithmetic, so every printer
gives the same bits. CasADi's own sin, exp, tanh, ... may be used too: when the step is recorded they become exact operations
(`lower`); on plain floats they are the C library's, whose last bit may differ.

`select` never looks at the value it does not choose: a NaN in the branch not taken does no harm.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

# A CasADi SX or a float; CasADi ships no types.
Scalar = Any


def select(condition: Scalar, yes: Scalar, no: Scalar) -> Scalar:
    """`yes` where the condition is not 0, else `no`."""
    if _plain(condition):
        return yes if condition else no
    import casadi

    return casadi.if_else(condition, yes, no)


def both(first: Scalar, second: Scalar) -> Scalar:
    """1 where both are not 0, else 0."""
    if _plain(first) and _plain(second):
        return float(bool(first) and bool(second))
    import casadi

    return casadi.logic_and(first, second)


def either(first: Scalar, second: Scalar) -> Scalar:
    """1 where at least one is not 0, else 0."""
    if _plain(first) and _plain(second):
        return float(bool(first) or bool(second))
    import casadi

    return casadi.logic_or(first, second)


def negate(flag: Scalar) -> Scalar:
    """1 where the flag is 0, else 0."""
    if _plain(flag):
        return float(not flag)
    import casadi

    return casadi.logic_not(flag)


def sqrt(x: Scalar) -> Scalar:
    """The square root, correctly rounded; NaN below 0."""
    if _plain(x):
        return math.sqrt(x) if x >= 0 else math.nan
    import casadi

    return casadi.sqrt(x)


def minimum(first: Scalar, second: Scalar) -> Scalar:
    """The smaller; by comparison and selection, since the libraries' fmin differ on NaN."""
    return select(first < second, first, second)


def _plain(x: Scalar) -> bool:
    """Whether it is a Python or numpy number, not a symbol."""
    return isinstance(x, (bool, int, float, np.bool_, np.number))
