"""Linear models whose matrix A is a polynomial in one measured signal, and their exact Takagi-Sugeno form.

    x' = A(rho) x + B u,   y = C x,   A(rho) = sum_k A_k rho^k        k = 0, 1, 2, ... as they occur; -1 if 1/rho does

Each power z = rho^k with k not 0 is a premise between its bounds z_min and z_max over the range of rho. Its weights are

    mu_min = (z_max - z) / (z_max - z_min),   mu_max = (z - z_min) / (z_max - z_min)          (14)

and with n premises there are 2^n vertices A_i, one for each choice of bounds, whose weight mu_i is the product:

    A(rho) = sum_i mu_i(rho) A_i,   sum_i mu_i = 1,   0 <= mu_i <= 1                           (13), (15)

This is exact, not an approximation, because A is linear in the premises. Only powers that occur make vertices: a model that is
linear in rho has two. Outside the range some weights are negative; the sum (13) still holds there, the bounds (15) do not.

Damon, Ichalal, Arioui 2018 (motorcycle); Tanaka, Wang, Fuzzy Control Systems Design and Analysis, 2001, section 2.2.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np

from codriver.models.state_space import StateSpace
from codriver.signals.signal import Array


@dataclass(frozen=True, eq=False)
class LPV:
    """x' = A(rho) x + B u, y = C x.

    Attributes:
        powers: A_k by k, shape (n, n) each.
        B, C: shapes (n, m), (p, n).
        states, inputs, outputs: standard names, of lengths n, m, p.
        scheduling: standard name of rho.
    """

    powers: Mapping[int, Array]
    B: Array
    C: Array
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    scheduling: str = "longitudinal_speed"

    def __post_init__(self) -> None:
        n, m, p = len(self.states), len(self.inputs), len(self.outputs)
        frozen = {}
        for k, matrix in sorted(self.powers.items()):
            frozen[k] = _fixed(matrix, (n, n), f"A_{k}")
        object.__setattr__(self, "powers", frozen)
        object.__setattr__(self, "B", _fixed(self.B, (n, m), "B"))
        object.__setattr__(self, "C", _fixed(self.C, (p, n), "C"))

    @property
    def premises(self) -> tuple[int, ...]:
        """The powers of rho other than 0 whose matrix is not 0."""
        return tuple(k for k, matrix in self.powers.items() if k and matrix.any())

    def A(self, rho: float) -> Array:
        """A(rho), shape (n, n)."""
        return np.asarray(sum(float(rho) ** k * matrix for k, matrix in self.powers.items()), dtype=float)

    def at(self, rho: float) -> StateSpace:
        """The model at a constant rho."""
        D = np.zeros((len(self.outputs), len(self.inputs)))
        return StateSpace(self.A(rho), self.B, self.C, D, self.states, self.inputs, self.outputs)

    def with_outputs(self, rows: Mapping[str, Array]) -> LPV:
        """The model with other outputs.

        Args:
            rows: rows of C, shape (n,), by standard name.
        """
        C = np.array(list(rows.values()), dtype=float)
        return LPV(self.powers, self.B, C, self.states, self.inputs, tuple(rows), self.scheduling)

    def with_walking_inputs(self) -> LPV:
        """The augmented model (12): the inputs are states, and their rates what drives them.

        The new inputs bear the old names with "_rate" behind them.
        """
        n, m = self.B.shape
        powers = {}
        for k, matrix in {0: np.zeros((n, n)), **self.powers}.items():
            powers[k] = np.zeros((n + m, n + m))
            powers[k][:n, :n] = matrix
        powers[0][:n, n:] = self.B
        return LPV(
            powers, np.vstack([np.zeros((n, m)), np.eye(m)]), np.hstack([self.C, np.zeros((len(self.outputs), m))]),
            (*self.states, *self.inputs), tuple(f"{name}_rate" for name in self.inputs), self.outputs, self.scheduling,
        )  # fmt: skip

    def polytope(self, low: float, high: float) -> Polytope:
        """The exact Takagi-Sugeno form between two values of rho, (13)-(15).

        Args:
            low, high: of rho; low must be at least 0, and above 0 if a negative power occurs.

        Raises:
            ValueError: they are no such range.
        """
        if not (0 <= low < high < np.inf) or (low == 0 and min(self.premises, default=0) < 0):
            raise ValueError(f"from {low:g} to {high:g}; a range from at least 0 (more for negative powers) upwards")
        bounds = {k: tuple(sorted((low**k, high**k))) for k in self.premises}
        vertices = []
        for corner in product(*bounds.values()):
            A = np.array(self.powers.get(0, np.zeros_like(next(iter(self.powers.values())))))
            for k, z in zip(bounds, corner, strict=True):
                A = A + z * self.powers[k]
            A.flags.writeable = False
            vertices.append(A)
        return Polytope(tuple(vertices), {k: (a, b) for k, (a, b) in bounds.items()}, (float(low), float(high)))


@dataclass(frozen=True, eq=False)
class Polytope:
    """The vertices of a Takagi-Sugeno form, and what they weigh.

    Attributes:
        vertices: A_i, shape (n, n) each.
        bounds: z_min and z_max by the premise's power.
        range: of rho.
    """

    vertices: tuple[Array, ...]
    bounds: Mapping[int, tuple[float, float]]
    range: tuple[float, float]

    def weights(self, rho: float) -> Array:
        """mu_i(rho), shape (2^n,); they sum to 1, and lie in [0, 1] where rho lies in the range."""
        each = [((b - rho**k) / (b - a), (rho**k - a) / (b - a)) for k, (a, b) in self.bounds.items()]
        return np.array([np.prod(choice) for choice in product(*each)])

    def A(self, rho: float) -> Array:
        """sum_i mu_i(rho) A_i, shape (n, n)."""
        return np.asarray(np.tensordot(self.weights(rho), np.array(self.vertices), 1))


def _fixed(matrix: Array, shape: tuple[int, ...], name: str) -> Array:
    """A copy that cannot be changed.

    Raises:
        ValueError: it is of another shape.
    """
    copy = np.array(matrix, dtype=float)
    if copy.shape != shape:
        raise ValueError(f"{name} is {copy.shape}; states, inputs and outputs ask for {shape}")
    copy.flags.writeable = False
    return copy
