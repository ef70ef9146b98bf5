"""The unknown-input observer: states that no unknown input reaches, and the input from what is left; where it exists.

    x' = A x + B u + D v,  y = C x,          needs rank(C D) = rank(D)                                (51)
    z' = N z + L y + G u,  x^ = z - E y
    E = -D (C D)^+,  P = I + E C,  G = P B,  N = P A - K C,  L = K (I + C E) - P A E

N is stable if (P A, C) is detectable: no transmission zero of v to y lies in the closed right half plane. The input itself needs
y' = C (A x + B u + D v), which is had only through a low-pass of the time constant tau, the same for every term:

    v^ = (C D)^+ [ s y / (1 + tau s) - (C A x^ + C B u) / (1 + tau s) ]  =  v / (1 + tau s)  once x^ = x

A wheel of which only the angle is measured has C D = 0 (remark 3 of the 2019 paper): refused. With the rate measured, it exists.
Darouach, Zasadzinski, Xu 1994, doi:10.1109/9.280770; Okamoto, Tsiotras 2019 (Robotics and Autonomous Systems), remark 3.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from codriver.errors import DesignError
from codriver.models import StateSpace
from codriver.observers.observer import Certificate
from codriver.observers.unknown_input import RANK, undetectable
from codriver.signals.signal import Array


@dataclass(frozen=True, eq=False)
class UIODesign:
    """The matrices.

    Attributes:
        model: the plant with known and unknown inputs.
        known, unknown: names of the inputs.
        N, L, G, E, K: as in the module's docstring.
        tau: time constant of the input's low-pass, s.
        system: the whole as a linear system: inputs (y, u), outputs (x^, v^).
        certificate: rank condition, decoupling and eigenvalues, recomputed from the matrices.
    """

    model: StateSpace
    known: tuple[str, ...]
    unknown: tuple[str, ...]
    N: Array
    L: Array
    G: Array
    E: Array
    K: Array
    tau: float
    system: StateSpace
    certificate: Certificate


def design_unknown_input_observer(
    model: StateSpace, unknown: Sequence[str], Q: Array | Sequence[float], R: Array | Sequence[float], tau: float
) -> UIODesign:
    """Design.

    Args:
        model: a plant without feedthrough.
        unknown: names of its unknown inputs.
        Q: weight of the states, shape (n, n) or its diagonal: K is the Kalman gain of (P A, C) with Q and R.
        R: weight of the outputs, shape (p, p) or its diagonal.
        tau: time constant with which the input is told, s.

    Raises:
        DesignError: rank(C D) < rank(D), an undetectable pair, or what cannot be.
    """
    from scipy.linalg import solve_continuous_are

    unknown = tuple(unknown)
    strange = [name for name in unknown if name not in model.inputs]
    if strange or not unknown or not tau > 0 or model.D.any():
        raise DesignError(
            f"unknown inputs {list(unknown)}, tau {tau:g} s, feedthrough {bool(model.D.any())}",
            f"some of {', '.join(model.inputs)}, tau above 0, and a plant with D = 0", "correct them",
        )  # fmt: skip
    hidden = [model.inputs.index(name) for name in unknown]
    seen = [i for i, name in enumerate(model.inputs) if name not in unknown]
    A, B, C, D = model.A, model.B[:, seen], model.C, model.B[:, hidden]
    n, p = A.shape[0], C.shape[0]
    rank_CD, rank_D = (int(np.linalg.matrix_rank(M, tol=RANK * np.abs(D).max())) for M in (C @ D, D))
    if rank_CD < rank_D:
        raise DesignError(
            f"no unknown-input observer: rank(C D) = {rank_CD}, rank(D) = {rank_D}: {', '.join(model.outputs)} do not show "
            f"{', '.join(unknown)} in their first derivative",
            "rank(C D) = rank(D), eq. (51)",
            "measure the rate too, or use the PI observer or the Kalman filter, which do not need it",
        )  # fmt: skip
    inverse = np.asarray(np.linalg.pinv(C @ D), dtype=np.float64)
    E = -D @ inverse
    PA = (np.eye(n) + E @ C) @ A
    still = undetectable(PA, C)
    if still.size:
        told = ", ".join(f"{s.real:.3g}" for s in still)
        raise DesignError(
            f"no unknown-input observer: a zero of the unknown input at {told} 1/s is not in the left half plane",
            "a detectable pair (P A, C)", "measure more",
        )  # fmt: skip
    weight = [np.diag(np.asarray(w, float)) if np.ndim(w) == 1 else np.asarray(w, float) for w in (Q, R)]
    sizes = [w.shape == (k, k) and bool(np.isfinite(w).all()) for w, k in zip(weight, (n, p), strict=True)]
    if not all(sizes) or np.linalg.eigvalsh(weight[0])[0] < 0 or np.linalg.eigvalsh(weight[1])[0] <= 0:
        raise DesignError(
            f"weights of shapes {weight[0].shape} and {weight[1].shape} that are not positive",
            f"Q >= 0 of shape ({n}, {n}), R > 0 of shape ({p}, {p}), or their diagonals", "correct them",
        )  # fmt: skip
    K = solve_continuous_are(PA.T, C.T, *weight) @ C.T @ np.linalg.inv(weight[1])
    N, G = PA - K @ C, (np.eye(n) + E @ C) @ B
    L = K @ (np.eye(p) + C @ E) - PA @ E
    system = _system(model, N, L, G, E, inverse, B, tau, unknown, tuple(model.inputs[i] for i in seen))
    certificate = _certify(A, B, C, D, N, L, G, E)
    known = tuple(model.inputs[i] for i in seen)
    return UIODesign(model, known, unknown, N, L, G, E, K, tau, system, certificate)


def _system(
    model: StateSpace, N: Array, L: Array, G: Array, E: Array, inverse: Array, B: Array, tau: float, unknown: tuple[str, ...],
    known: tuple[str, ...],
) -> StateSpace:  # fmt: skip
    """States (z, y_f, g_f), y_f and g_f = low-passed y and C A x^ + C B u; inputs (y, u); outputs (x^, v^)."""
    A, C = model.A, model.C
    n, p, m, k = A.shape[0], C.shape[0], B.shape[1], len(unknown)
    one, zero = np.eye(p), np.zeros
    system_A = np.block([
        [N, zero((n, 2 * p))],
        [zero((p, n)), -one / tau, zero((p, p))],
        [C @ A / tau, zero((p, p)), -one / tau],
    ])  # fmt: skip
    system_B = np.block([[L, G], [one / tau, zero((p, m))], [-C @ A @ E / tau, C @ B / tau]])
    system_C = np.block([[np.eye(n), zero((n, 2 * p))], [zero((k, n)), -inverse / tau, -inverse]])
    system_D = np.block([[-E, zero((n, m))], [inverse / tau, zero((k, m))]])
    names = tuple(f"z_{s}" for s in model.states)
    filtered = tuple(f"{kind}_{o}" for kind in ("low", "drift") for o in model.outputs)
    return StateSpace(
        system_A, system_B, system_C, system_D, (*names, *filtered), (*model.outputs, *known), (*model.states, *unknown)
    )


def _certify(A: Array, B: Array, C: Array, D: Array, N: Array, L: Array, G: Array, E: Array) -> Certificate:
    """What the matrices show: with e = x - x^, e' = N e if P D = 0, P A = N P + L C - ... , G = P B."""
    P = np.eye(A.shape[0]) + E @ C

    def off(*terms: Array) -> float:
        return float(np.abs(sum(terms)).max(initial=0)) / max(*(float(np.abs(t).max(initial=0)) for t in terms), 1e-300)

    decoupled = off(D, E @ C @ D)
    by_state, by_input = off(P @ A, -N @ P, -L @ C), off(G, -P @ B) if B.size else 0.0
    eigenvalues = np.linalg.eigvals(N).astype(complex)
    decay = float(-eigenvalues.real.max())
    claims = (
        "rank(C D) = rank(D), eq. (51)",
        f"the error does not see the unknown input: (I + E C) D = 0 to {decoupled:.1e}",
        f"nor state and known input: to {max(by_state, by_input):.1e}",
        f"the error decays with {decay:.4g} 1/s or quicker",
    )
    if not (decay > 0 and max(decoupled, by_state, by_input) < 1e-9):
        raise DesignError(
            f"the unknown-input observer fails its certificate: {'; '.join(claims)}",
            "a stable one",
            "choose other weights",
        )
    return Certificate(True, claims, eigenvalues, np.empty(0, complex), decay)
