"""How far a linear system moves in a tick: Taylor's series, for matrices that are made anew in every tick.

    series(A, r, dt) = (dt + A dt^2/2 + A^2 dt^3/6 + ...) r          x(dt) = x + series(A, f, dt) where x' = f + A (x - x(0))
                                                                    exp(A dt) = 1 + series(A, A, dt)

Forward Euler is its first term, and unstable for a tyre's force at the usual ticks.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from codriver.errors import DesignError
from codriver.kernel import Scalar
from codriver.signals.signal import Array


def series(A: Scalar, rate: Scalar, dt: float, terms: int) -> Scalar:
    """The sum of so many terms.

    Args:
        A: shape (n, n), CasADi or numpy, as `rate`.
        rate: shape (n, m).
        dt: s.
        terms: at least 1.
    """
    term = rate * dt
    total = term
    for k in range(2, terms + 1):
        term = A @ term * (dt / k)
        total = total + term
    return total


def terms_needed(matrices: Sequence[Array], dt: float, close: float, most: int) -> int:
    """The fewest terms that are close to the matrix exponential.

    Args:
        matrices: shape (n, n) each, scaled so that entries compare.
        dt: s.
        close: greatest error in parts of the exponential's largest entry.
        most: terms.

    Raises:
        DesignError: more would be needed.
    """
    from scipy.linalg import expm

    exact = [expm(A * dt) for A in matrices]
    for terms in range(1, most + 1):
        made = [np.eye(len(A)) + series(A, A, dt, terms) for A in matrices]
        if all(np.abs(a - b).max() < close * np.abs(b).max() for a, b in zip(made, exact, strict=True)):
            return terms
    fastest = max(np.abs(np.linalg.eigvals(A)).max() for A in matrices)
    raise DesignError(
        f"a tick of {dt:g} s with poles up to {fastest:.3g} rad/s", f"a transition exact to {close:g} within {most} terms",
        "a shorter tick (a higher --rate)",
    )  # fmt: skip
