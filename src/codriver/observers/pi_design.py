"""The PI observer of unknown inputs: theorem 1 of the 2019 paper as a design function with its certificate.

    z'  = F z + (L_1 + L_2) y + J u + T_1 B_v v^                                                      (33)
    v^' = L_3 (y - y^),   x^ = z + T_2 y,   y^ = C x^

    [T_1 T_2] = [I; C]^+,   F = T_1 A - L_2 C,   L_1 = F T_2,   J = T_1 B_u                           (35), (37)
    [L_2; L_3] = Q C~' V_2^-1,   0 = A~ Q + Q A~' + V_1 - Q C~' V_2^-1 C~ Q                           (38)-(39)
    A~ = [T_1 A, T_1 B_v; 0, 0],   C~ = [C, 0]                                                        (40)

(37b) prints L_1 without what it multiplies: it is y. The pseudo-inverse makes T_2 depend on the unit of y (degrees in the
paper); any T_2 does, with T_1 = I - T_2 C, and T_2 = 0 gives the plain observer of the augmented state. The theorem also needs
(A~, V_1^(1/2)) stabilisable: with V_1 = diag(1, 1, 0) the Riccati equation leaves an eigenvalue at 0. Here it is refused.

Okamoto, Tsiotras 2019 (Robotics and Autonomous Systems).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from codriver.errors import DesignError
from codriver.models import StateSpace
from codriver.observers.observer import Certificate
from codriver.observers.unknown_input import refuse_undetectable, undetectable, with_unknown
from codriver.signals.signal import Array

CLOSE = 1e-9  # to which identities must hold, relative


@dataclass(frozen=True, eq=False)
class PIDesign:
    """The matrices of (33).

    Attributes:
        model: the plant with known and unknown inputs.
        known, unknown: names of the inputs.
        F, L_1, L_2, L_3, J, T_1, T_2: by the paper's letters.
        B_v, C: of the plant.
        certificate: detectability, the identities and the eigenvalues, recomputed from the matrices.
    """

    model: StateSpace
    known: tuple[str, ...]
    unknown: tuple[str, ...]
    F: Array
    L_1: Array
    L_2: Array
    L_3: Array
    J: Array
    T_1: Array
    T_2: Array
    B_v: Array
    C: Array
    certificate: Certificate

    @property
    def system(self) -> StateSpace:
        """The observer itself as a linear system: states (z, v^), inputs (y, u), outputs (x^, v^)."""
        n, k = self.F.shape[0], self.L_3.shape[0]
        p, m = self.C.shape[0], self.J.shape[1]
        A = np.block([[self.F, self.T_1 @ self.B_v], [-self.L_3 @ self.C, np.zeros((k, k))]])
        B = np.block([
            [self.L_1 + self.L_2, self.J],
            [self.L_3 @ (np.eye(p) - self.C @ self.T_2), np.zeros((k, m))],
        ])  # fmt: skip
        D = np.block([[self.T_2, np.zeros((n, m))], [np.zeros((k, p + m))]])
        names = tuple(f"z_{name}" for name in self.model.states)
        return StateSpace(
            A, B, np.eye(n + k), D, (*names, *self.unknown), (*self.model.outputs, *self.known),
            (*self.model.states, *self.unknown),
        )  # fmt: skip


def design_pi_observer(
    model: StateSpace, unknown: Sequence[str], V_1: Array | Sequence[float], V_2: Array | Sequence[float] | float,
    T_2: Array | None = None,
) -> PIDesign:  # fmt: skip
    """Theorem 1.

    Args:
        model: any linear time-invariant plant without feedthrough; its inputs are known but for those named.
        unknown: names of the unknown inputs.
        V_1: weight of states and unknown inputs: a matrix of shape (n + k, n + k), or its diagonal.
        V_2: weight of the outputs: a matrix of shape (p, p), its diagonal, or one number.
        T_2: shape (n, p); None takes the paper's pseudo-inverse (35).

    Raises:
        DesignError: the plant has feedthrough, the pair (34) is not detectable, weights that cannot be, or an observer that is
            not stable.
    """
    from scipy.linalg import solve_continuous_are

    unknown = tuple(unknown)
    augmented = with_unknown(model, unknown)
    refuse_undetectable(augmented, unknown)
    if model.D.any():
        raise DesignError(
            "a plant whose outputs hold an input directly (D is not 0)",
            "D = 0, as in eq. (30)",
            "use the Kalman filter",
        )
    n, k, p = len(model.states), len(unknown), len(model.outputs)
    B_v = augmented.A[:n, n:]
    C = model.C
    first, second = _weight(V_1, n + k, "V_1"), _weight(V_2, p, "V_2")
    if T_2 is None:
        both = np.linalg.pinv(np.vstack([np.eye(n), C]))
        T_1, T_2 = both[:, :n], both[:, n:]
    else:
        T_2 = np.asarray(T_2, float).reshape(n, p)
        T_1 = np.eye(n) - T_2 @ C
    A_tilde = np.block([[T_1 @ model.A, T_1 @ B_v], [np.zeros((k, n + k))]])
    C_tilde = np.hstack([C, np.zeros((p, k))])
    _refuse_weights(A_tilde, C_tilde, first, second)
    Q = solve_continuous_are(A_tilde.T, C_tilde.T, first, second)
    gain = Q @ C_tilde.T @ np.linalg.inv(second)
    L_2, L_3 = gain[:n], gain[n:]
    F = T_1 @ model.A - L_2 @ C
    made = (F, F @ T_2, L_2, L_3, T_1 @ augmented.B[:n], T_1, T_2)
    return PIDesign(model, augmented.inputs, unknown, *made, B_v, C, _certify(model, B_v, augmented.B[:n], *made))


def _weight(given: Array | Sequence[float] | float, size: int, letter: str) -> Array:
    """A symmetric matrix from a matrix, its diagonal or one number.

    Raises:
        DesignError: of another size, or not symmetric.
    """
    matrix = np.asarray(given, float)
    if matrix.ndim == 0:
        matrix = np.eye(size) * matrix
    elif matrix.ndim == 1:
        matrix = np.diag(matrix)
    if matrix.shape != (size, size) or not np.allclose(matrix, matrix.T) or not np.isfinite(matrix).all():
        raise DesignError(
            f"{letter} of shape {matrix.shape}", f"a symmetric matrix of shape ({size}, {size}), or its diagonal",
            f"correct {letter}",
        )  # fmt: skip
    return matrix


def _refuse_weights(A: Array, C: Array, V_1: Array, V_2: Array) -> None:
    """Weights with which the Riccati equation has no stabilising solution.

    Raises:
        DesignError: see there.
    """
    if np.linalg.eigvalsh(V_2)[0] <= 0 or np.linalg.eigvalsh(V_1)[0] < -1e-12 * np.abs(V_1).max():
        raise DesignError(
            "weights that are negative, or a V_2 that is 0 somewhere", "V_1 >= 0 and V_2 > 0", "correct the weights"
        )
    values, vectors = np.linalg.eigh(V_1)
    root = vectors @ np.diag(np.sqrt(np.maximum(values, 0))) @ vectors.T
    still = undetectable(A.T, root)
    if still.size:
        told = ", ".join(f"{s:.3g}" for s in still.real)
        raise DesignError(
            f"(A~, V_1^(1/2)) is not stabilisable at the eigenvalue {told} 1/s: the observer would keep it",
            "a V_1 that weighs every unknown input", "give the last entries of V_1 positive numbers",
        )  # fmt: skip


def _certify(
    model: StateSpace, B_v: Array, B_u: Array, F: Array, L_1: Array, L_2: Array, L_3: Array, J: Array, T_1: Array, T_2: Array
) -> Certificate:  # fmt: skip
    """What the matrices themselves show: the identities of the proof, and the eigenvalues of (44)."""
    A, C = model.A, model.C
    k = L_3.shape[0]

    def off(*terms: Array) -> float:
        """How far terms are from adding up to 0, as a share of the largest number among them."""
        return float(np.abs(sum(terms)).max(initial=0)) / max(*(float(np.abs(t).max(initial=0)) for t in terms), 1e-300)

    identity = off(T_1, T_2 @ C, -np.eye(A.shape[0]))
    # (42): the error does not see x or u.
    by_state, by_input = off(T_1 @ A, -F @ T_1, -(L_1 + L_2) @ C), off(J, -T_1 @ B_u)
    eigenvalues = np.linalg.eigvals(np.block([[F, T_1 @ B_v], [-L_3 @ C, np.zeros((k, k))]])).astype(complex)
    decay = float(-eigenvalues.real.max())
    claims = (
        "(A, C) with the unknown inputs among the states is detectable (PBH)",
        f"T_1 + T_2 C = I to {identity:.1e}",
        f"the error does not depend on state and known input: (42) to {max(by_state, by_input):.1e}",
        f"the error decays with {decay:.4g} 1/s or quicker; eigenvalues "
        + ", ".join(f"{s.real:.4g}{s.imag:+.4g}i" if s.imag else f"{s.real:.4g}" for s in eigenvalues),
    )
    if not (decay > 0 and max(identity, by_state, by_input) < CLOSE):
        raise DesignError(
            f"the PI observer fails its certificate: {'; '.join(claims)}", "a stable observer", "choose other weights"
        )
    return Certificate(True, claims, eigenvalues, np.empty(0, complex), decay)
