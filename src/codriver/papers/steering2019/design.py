"""2019 section 3.1: theorem 1's PI observer and its certificate, remarks 1 to 3."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

import codriver.program as programs
from codriver.errors import DesignError
from codriver.models import StateSpace, steering_model
from codriver.observers.disturbance import disturbance_observer
from codriver.observers.disturbance_design import design_disturbance_filter
from codriver.observers.pi_design import PIDesign, design_pi_observer
from codriver.observers.pi_weights import PI_WEIGHTS, PIWeights, wheel_in_degrees, wheel_pi_design
from codriver.observers.uio_design import design_unknown_input_observer
from codriver.observers.unknown_input import with_unknown
from codriver.papers.item import Item
from codriver.papers.reproduction import Chapter
from codriver.papers.steering2019.runs import B_S, DT, J_S, driven_runs, rmse, run_all
from codriver.report.document import Table
from codriver.signals.signal import Array

PRESET = "okamoto2019"


def design_chapter() -> Chapter:
    """Theorem 1 on the wheel (82) with the weights of section 4.1."""
    design = wheel_pi_design(J_S, B_S, PI_WEIGHTS[PRESET])
    items = (*_theorem(design), *_remarks())
    words = (
        "Observers here are designed on the wheel in degrees, as the paper has it, and every claim is recomputed from the "
        "matrices that come out.",
    )
    return Chapter("The PI observer: theorem 1 and remarks 1 to 3 (3.1)", words, (_matrices(design),), items)


def _theorem(d: PIDesign) -> tuple[Item, ...]:
    A, C, n = d.model.A, d.C, 2
    B_u = d.model.B[:, [d.model.inputs.index(name) for name in d.known]]
    worst = max(
        _off(d.T_1 + d.T_2 @ C, np.eye(n)), _off(d.T_1 @ A - d.F @ d.T_1, (d.L_1 + d.L_2) @ C), _off(d.T_1 @ B_u, d.J),
        _off(d.F, d.T_1 @ A - d.L_2 @ C), _off(d.L_1, d.F @ d.T_2),
    )  # fmt: skip
    values = np.linalg.eigvals(np.block([[d.F, d.T_1 @ d.B_v], [-d.L_3 @ C, np.zeros((1, 1))]]))
    listed = ", ".join(
        f"{v.real:.1f}" + (f" {v.imag:+.1f}i" if abs(v.imag) > 1e-9 else "") for v in np.sort_complex(values)
    )
    residual = _riccati_residual(d, PI_WEIGHTS[PRESET])
    refused = _refused(lambda: wheel_pi_design(J_S, B_S, PIWeights((1.0, 1.0, 0.0), 1.0)))
    left = _eigenvalue_left()
    plain, own = _unscaled(), d.certificate.decay_rate
    return (
        Item("theorem 1: the identities (36), (37), (42)", "hold", f"to {worst:.0e}", "", worst < 1e-9, "greatest relative "
             "difference"),
        Item("(38)-(39): gains from the observer Riccati equation", "solved", f"residual {residual:.0e}", "", residual < 1e-8,
             "of (39), over its greatest term, with Q found again by Hamiltonian and Schur"),
        Item("theorem 1: e and e_v are exponentially stable", "A_obs is Hurwitz", f"eigenvalues {listed} 1/s", "",
             bool(values.real.max() < 0), "of (44), V_1 = diag(1, 1, 1e11), V_2 = 1"),
        Item("theorem 1: any V_1 >= 0, V_2 > 0 will do", "V_1 ⪰ 0, V_2 ≻ 0", "V_1 = diag(1, 1, 0) leaves an eigenvalue at 0 "
             f"({left:.1g} 1/s with V_33 = 1e-6)",
             "", not refused,
             "(A~, V_1^½) must be stabilisable, too: a torque without weight is never corrected. Such weights are refused here"),
        Item("(46): the rank condition over C+", "s in C+", "must be the closed right half-plane", "", None,
             "the constant torque is an eigenvalue at s = 0, on the imaginary axis; the open half-plane would leave it out"),
        Item("V_33 = 1e11 suits the pseudo-inverse (35) and degrees alone", None, f"{-plain:.0f} against {-own:.0f} 1/s", "",
             plain > 3 * own,
             "not in the paper; slowest eigenvalue with the same weights and T_2 = 0, against the paper's: there T_1 is "
             "diag(3e-4, 1). More than three times as quick counts"),
    )  # fmt: skip


def _remarks() -> tuple[Item, ...]:
    plant = steering_model(J_S, B_S)
    augmented = with_unknown(plant, ("driver_torque",))
    rank = int(np.linalg.matrix_rank(_observability(augmented.A, augmented.C)))
    both = StateSpace(plant.A, plant.B, np.eye(2), np.zeros((2, 2)), plant.states, plant.inputs, plant.states)
    refused = _refused(lambda: design_unknown_input_observer(plant, ("driver_torque",), [1, 1], [1], 0.05))
    exists = not _refused(lambda: design_unknown_input_observer(both, ("driver_torque",), [1, 1], [1, 1], 0.05))
    error = _one_measurement()
    return (
        Item("remarks 1, 2: the pair (34) is detectable for the wheel", "detectable", f"even observable: rank {rank} of 3", "",
             rank == 3,
             "so the pole placement of the paper's reference [50] would do as well; the weaker assumption gains nothing here"),
        Item("remark 3: an unknown-input observer does not exist for the angle alone", "rank(C B_v) < rank(B_v)",
             "refused" if refused else "exists", "", refused,
             f"with the wheel's rate measured as well it {'exists' if exists else 'does not exist either'}"),
        Item("remark 3: EKF, UKF need more measurements than unknown inputs", "cannot be used",
             f"one angle, one torque: RMSE {error:.3f} N m without noise", "", error > 1.0,
             "a Kalman filter of the wheel with the torque among its states needs the detectable pair that theorem 1 needs, no "
             "more"),
    )  # fmt: skip


def _one_measurement() -> float:
    """RMSE of the augmented Kalman filter on figure 4's record without noise, from 1 s on, N m."""
    design = design_disturbance_filter(
        steering_model(J_S, B_S), ("driver_torque",), DT, unknown_noise=[1e4], output_noise=[1e-10], order=2
    )
    records = driven_runs("none", 1)
    out = run_all(programs.compile(disturbance_observer(design, [1, 5, 20, 100])), records)
    return float(rmse(out["driver_torque"], records.driver, round(1 / DT))[0])


def _riccati_residual(d: PIDesign, weights: PIWeights) -> float:
    """Of (39): the design's gains against those of Q from the Hamiltonian's stable subspace, and the residual of that Q."""
    from scipy.linalg import schur

    n = 3
    A = np.block([[d.T_1 @ d.model.A, d.T_1 @ d.B_v], [np.zeros((1, n))]])
    C, V_1 = np.hstack([d.C, [[0.0]]]), np.diag(weights.V_1)
    # Scaled: the torque's weight is 1e11 times the others'.
    scale = np.diag([1.0, 1e2, 1e4])
    back = np.linalg.inv(scale)
    a, c, v = back @ A @ scale, C @ scale, back @ V_1 @ back
    hamiltonian = np.block([[a.T, -c.T @ c / weights.V_2], [-v, -a]])
    _, vectors, _ = schur(hamiltonian, sort="lhp")
    Q = scale @ np.real(vectors[n:, :n] @ np.linalg.inv(vectors[:n, :n])) @ scale
    terms = (A @ Q, Q @ A.T, V_1, -Q @ C.T @ C @ Q / weights.V_2)
    gain = Q @ C.T / weights.V_2
    largest = np.max([np.abs(back @ t @ back).max() for t in terms])
    return max(float(np.abs(back @ sum(terms) @ back).max() / largest), _off(np.vstack([d.L_2, d.L_3]), gain))


def _eigenvalue_left() -> float:
    """The eigenvalue of A_obs that a torque of hardly any weight leaves, 1/s, in the limit of none."""
    tiny = wheel_pi_design(J_S, B_S, PIWeights((1.0, 1.0, 1e-6), 1.0))
    return float(tiny.certificate.eigenvalues.real.max())


def _unscaled() -> float:
    """Decay rate with the paper's weights and T_2 = 0, 1/s."""
    weights = PI_WEIGHTS[PRESET]
    plain = design_pi_observer(
        wheel_in_degrees(J_S, B_S), ("driver_torque",), weights.V_1, weights.V_2, np.zeros((2, 1))
    )
    return float(plain.certificate.decay_rate)


def _refused(make: Callable[[], object]) -> bool:
    try:
        make()
    except DesignError:
        return True
    return False


def _observability(A: Array, C: Array) -> Array:
    return np.vstack([C @ np.linalg.matrix_power(A, k) for k in range(A.shape[0])])


def _off(left: Array, right: Array) -> float:
    """Greatest difference, over the greatest entry."""
    return float(np.abs(left - right).max() / max(np.abs(left).max(), np.abs(right).max()))


def _matrices(d: PIDesign) -> Table:
    def told(matrix: Array) -> str:
        return "; ".join(", ".join(f"{x:.4g}" for x in row) for row in matrix)

    rows = tuple((letter, told(getattr(d, letter))) for letter in ("T_1", "T_2", "F", "L_1", "L_2", "L_3", "J"))
    return Table(
        ("matrix", "rows, separated by ;"), rows, "Of theorem 1 for the wheel (82), V_1 = diag(1, 1, 1e11), V_2 = 1."
    )
