"""Linear time-invariant models with named states, inputs and outputs."""

from __future__ import annotations

from dataclasses import dataclass
from math import factorial

import numpy as np

from codriver.signals.signal import Array


@dataclass(frozen=True, eq=False)
class StateSpace:
    """x' = A x + B u, y = C x + D u.

    Attributes:
        A, B, C, D: shapes (n, n), (n, m), (p, n), (p, m).
        states, inputs, outputs: standard names, of lengths n, m, p; their units are the vocabulary's.
    """

    A: Array
    B: Array
    C: Array
    D: Array
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]

    def __post_init__(self) -> None:
        n, m, p = len(self.states), len(self.inputs), len(self.outputs)
        for name, shape in {"A": (n, n), "B": (n, m), "C": (p, n), "D": (p, m)}.items():
            matrix = np.array(getattr(self, name), dtype=float)
            if matrix.shape != shape:
                raise ValueError(f"{name} is {matrix.shape}; states, inputs and outputs ask for {shape}")
            matrix.flags.writeable = False
            object.__setattr__(self, name, matrix)

    def transition(self, dt: float) -> Array:
        """exp(A dt), shape (n, n)."""
        return matrix_exponential(self.A * dt)

    def input_maps(self, dt: float) -> tuple[Array, Array]:
        """What inputs do over a tick if they run straight between ticks: x_k = F x_{k-1} + G0 u_{k-1} + G1 u_k.

        Of exp of [[A, B, 0], [0, 0, I / dt], [0, 0, 0]] dt, the first row is [F, G0 + G1, G1]. An input that is held over the
        tick does (G0 + G1) u_{k-1}.

        Returns:
            G0 and G1, shape (n, m) each.
        """
        n, m = self.B.shape
        block = np.zeros((n + 2 * m, n + 2 * m))
        block[:n, :n], block[:n, n : n + m] = self.A * dt, self.B * dt
        block[n : n + m, n + m :] = np.eye(m)
        exponential = matrix_exponential(block)
        held, late = exponential[:n, n : n + m], exponential[:n, n + m :]
        return held - late, late

    def process_noise(self, Q: Array, dt: float) -> Array:
        """Covariance that white process noise of intensity Q gathers in dt: the integral of exp(A s) Q exp(A' s) ds.

        Van Loan (1978), doi:10.1109/TAC.1978.1101743. Exact where A is nilpotent: the series then ends.

        Args:
            Q: intensity, shape (n, n), units of state^2 per second.
            dt: s.
        """
        n = self.A.shape[0]
        block = np.block([[-self.A, Q], [np.zeros((n, n)), self.A.T]]) * dt
        exponential = matrix_exponential(block)
        transition = exponential[n:, n:].T
        noise = transition @ exponential[:n, n:]
        return (noise + noise.T) / 2

    def observability(self) -> int:
        """Rank of the observability matrix [C; C A; ...]; n means every state can be told from the outputs."""
        n = self.A.shape[0]
        rows = [self.C]
        for _ in range(n - 1):
            rows.append(rows[-1] @ self.A)
        return int(np.linalg.matrix_rank(np.vstack(rows)))


def matrix_exponential(M: Array) -> Array:
    """exp(M). The power series where M is nilpotent (it ends, so the result is exact but for rounding), else scipy's."""
    n = M.shape[0]
    terms = [np.eye(n)]
    for k in range(1, n + 1):
        power = np.linalg.matrix_power(M, k)
        if not power.any():
            return np.asarray(sum(terms), dtype=float)
        terms.append(power / factorial(k))
    from scipy.linalg import expm

    return np.asarray(expm(M), dtype=float)
