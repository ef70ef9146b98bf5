"""A model whose unknown inputs are states: what observers of unknown inputs are designed on, and whether they can be.

    x' = A x + B_u u + B_v v,   y = C x + D_u u                                                       (30)

    order 1   v' = w                    a torque that changes by chance                               (31)-(32)
    order 2   v' = s,  s' = w           a torque that runs straight, its slope changing by chance

The pair (A_a, C_a) of the augmented model must be detectable: by Popov, Belevitch and Hautus, [s I - A; C] has full rank at
every eigenvalue s of A with Re s >= 0. (The paper's (46) prints the open half plane; the closed one is meant: at s = 0 an unknown
constant hides.)  Okamoto, Tsiotras 2019 (Robotics and Autonomous Systems), section 3.1.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from codriver.errors import DesignError
from codriver.models import StateSpace
from codriver.signals.signal import Array

ORDERS = (1, 2)
RANK = 1e-9  # singular values below this share of the largest count as 0


def with_unknown(model: StateSpace, unknown: Sequence[str], order: int = 1) -> StateSpace:
    """The model with some of its inputs among its states.

    Args:
        model: with all inputs, known and unknown.
        unknown: names of the unknown ones.
        order: 1 for random walks, 2 for integrated random walks; their rates are states "<name>_rate".

    Returns:
        a model of the known inputs alone; its last states are the unknown inputs, and then their rates.

    Raises:
        DesignError: an input is not the model's, there is none, no such order, or numbers that are not finite.
    """
    strange = [name for name in unknown if name not in model.inputs]
    if strange or not unknown or order not in ORDERS:
        raise DesignError(
            f"unknown inputs {list(unknown)} of order {order}", f"some of {', '.join(model.inputs)}, of order 1 or 2",
            "name inputs of the model",
        )  # fmt: skip
    if not all(np.isfinite(matrix).all() for matrix in (model.A, model.B, model.C, model.D)):
        raise DesignError("a plant with numbers that are not finite", "finite A, B, C, D", "correct the plant")
    n, k = len(model.states), len(unknown)
    known = [i for i, name in enumerate(model.inputs) if name not in unknown]
    hidden = [model.inputs.index(name) for name in unknown]
    size = n + k * order
    A = np.zeros((size, size))
    A[:n, :n], A[:n, n : n + k] = model.A, model.B[:, hidden]
    if order == 2:
        A[n : n + k, n + k :] = np.eye(k)
    B = np.vstack([model.B[:, known], np.zeros((size - n, len(known)))])
    C = np.hstack([model.C, model.D[:, hidden], np.zeros((len(model.outputs), size - n - k))])
    rates = tuple(f"{name}_rate" for name in unknown) if order == 2 else ()
    return StateSpace(
        A, B, C, model.D[:, known], (*model.states, *unknown, *rates), tuple(model.inputs[i] for i in known),
        model.outputs,
    )  # fmt: skip


def undetectable(A: Array, C: Array) -> npt.NDArray[np.complex128]:
    """Eigenvalues of A with Re >= 0 that C does not see, by the test of Popov, Belevitch and Hautus.

    Args:
        A, C: shapes (n, n), (p, n).
    """
    n = A.shape[0]
    found = []
    for s in np.linalg.eigvals(A).astype(complex):
        if s.real < -RANK * max(1.0, float(np.abs(A).max())):
            continue
        pencil = np.vstack([s * np.eye(n) - A, C])
        # Columns and rows in units of their own size, so that degrees or N m do not decide about the rank.
        pencil = pencil / np.maximum(np.linalg.norm(pencil, axis=0), 1e-300)
        pencil = pencil / np.maximum(np.linalg.norm(pencil, axis=1, keepdims=True), 1e-300)
        values = np.linalg.svd(pencil, compute_uv=False)
        if values[-1] <= RANK * values[0]:
            found.append(s)
    return np.array(found, dtype=complex)


def refuse_undetectable(model: StateSpace, unknown: Sequence[str]) -> None:
    """Refuse an augmented model that no observer can be designed for.

    Raises:
        DesignError: an eigenvalue with Re >= 0 is not seen by the outputs.
    """
    hidden = undetectable(model.A, model.C)
    if hidden.size:
        told = ", ".join(f"{s.real:.3g}{s.imag:+.3g}i" if s.imag else f"{s.real:.3g}" for s in hidden)
        raise DesignError(
            f"the pair (A, C) with {', '.join(unknown)} among the states is not detectable: the outputs "
            f"{', '.join(model.outputs)} do not see the eigenvalue {told} 1/s",
            "outputs that see every mode which does not decay by itself", "measure more, or leave an unknown input out",
        )  # fmt: skip
