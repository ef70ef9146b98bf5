"""Levenberg's and Marquardt's method with early stopping.

    minimise  E(w) = sum (y - f(w))^2 + sum decay w^2
    w <- w + (J'J + D + mu I)^-1 (J'(y - f) - D w),      J = df/dw,  D = diag(decay)

mu falls where a step lowers E as much as its quadratic model said, and grows where it does not (H. B. Nielsen's rule). With rows
to be judged by, the weights with the least error there are kept, and the search ends after `patience` steps without a
lower one.

D. W. Marquardt 1963, doi 10.1137/0111030; K. Madsen, H. B. Nielsen, O. Tingleff, Methods for Non-Linear Least Squares Problems,
2nd ed., 2004, section 3.2.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from codriver.signals.signal import Array

Rows = tuple[Array, Array]  # X, y
SMALL = 1e-9  # relative fall of E that counts as none
TRIES = 20  # growing mu, before no better weights are expected


class Trained(NamedTuple):
    """Where a search ended.

    Attributes:
        w: the weights kept.
        steps: taken until those.
        judged: rms error on the rows to be judged by, or on the training rows if there are none.
        ended: "settled", "no longer better" or "out of steps".
    """

    w: Array
    steps: int
    judged: float
    ended: str


def train(
    both: Callable[[Array, Array], tuple[Array, Array]],
    output: Callable[[Array, Array], Array],
    w: Array,
    learned: Rows,
    judge: Rows | None,
    decay: Array,
    max_steps: int,
    patience: int,
) -> Trained:
    """Search the weights.

    Args:
        both: (w, X) -> f, df/dw.
        output: (w, X) -> f.
        w: where to start.
        learned: X and y to learn from.
        judge: X and y to be judged by; None: only E counts.
        decay: of each weight.
        max_steps: steps at most.
        patience: steps without a lower error on the rows to be judged by.
    """

    def rms(at: Array, of: Rows) -> float:
        return float(np.sqrt(np.mean((of[1] - output(at, of[0])) ** 2)))

    X, y = learned
    kept = Trained(w, 0, rms(w, judge or learned), "out of steps")
    mu, factor = 0.0, 2.0
    for steps in range(1, max_steps + 1):
        f, J = both(w, X)
        A, g = J.T @ J + np.diag(decay), J.T @ (y - f) - decay * w
        E = float(np.sum((y - f) ** 2) + np.sum(decay * w**2))
        mu = mu or 1e-3 * float(A.diagonal().max())
        for _ in range(TRIES):
            change = _solved(A, mu, g)
            trial = w + change
            E_trial = float(np.sum((y - output(trial, X)) ** 2) + np.sum(decay * trial**2))
            promised = float(change @ (mu * change + g))
            gain = (E - E_trial) / promised if promised > 0 else -1.0
            if gain > 0:
                mu, factor = mu * max(1.0 / 3.0, 1.0 - (2.0 * gain - 1.0) ** 3), 2.0
                break
            mu, factor = mu * factor, 2.0 * factor
        else:
            return kept._replace(ended="settled")
        w = trial
        error = rms(w, judge or learned)
        if error < kept.judged or judge is None:
            kept = Trained(w, steps, error, "out of steps")
        elif steps - kept.steps >= patience:
            return kept._replace(ended="no longer better")
        if E - E_trial < SMALL * E:
            return kept._replace(ended="settled")
    return kept


def _solved(A: Array, mu: float, g: Array) -> Array:
    """(A + mu I)^-1 g; no change where A + mu I is not positive definite to rounding."""
    try:
        return np.asarray(cho_solve(cho_factor(A + mu * np.eye(g.size)), g))
    except LinAlgError:
        return np.zeros_like(g)
