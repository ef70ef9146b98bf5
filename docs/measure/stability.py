"""Figure of docs/sampling.md: from which spacing of the rows on the constant form is unstable. In closed form.

Over the period after which the rows' pattern repeats, the error of the constant form passes through the product of
(I - K N_k C) F. N_k is diagonal, with an entry for each row: 0 where it is missing at tick k, else the number of ticks
that its innovation stands for, up to the bound in `observers/jerk.py`. The error dies out if all eigenvalues of the product
are smaller than 1. Without counting, N_k would hold 1 instead.
"""

# ruff: noqa: T201
from __future__ import annotations

import numpy as np
from drives import table

from codriver.observers import PRESETS, design_scaled_gain
from codriver.observers.jerk_forms import GAP, LARGEST_GAIN
from codriver.observers.scaled_gain import ScaledGain


def growth(d: ScaledGain, every_a: int, every_v: int, counting: bool = True) -> float:
    """Growth of the error in a second, accelerometer and speed on every n-th tick."""
    period = int(np.lcm(every_a, every_v))
    most = max(int(LARGEST_GAIN / float(d.K[0, 1])), 1) if counting else 1
    C, product = np.array([[0, 1, 1, 0], [1, 0, 0, 0]], float), np.eye(4)
    for k in range(period):
        N = np.diag([(k % n == 0) * min(n, most) for n in (every_a, every_v)]).astype(float)
        product = (np.eye(4) - d.K @ N @ C) @ d.F @ product
    return float(max(abs(np.linalg.eigvals(product))) ** (1 / (period * d.dt)))


def first(d: ScaledGain, both: bool, counting: bool = True) -> str:
    """The first n that is unstable, among those at which the rows come before the gap that is not valid anyway."""
    last = int(GAP / d.dt) + 1
    ns = (n for n in range(2, last) if growth(d, n if both else 1, n, counting) >= 1)
    found = next(ns, None)
    return f"none below {last}" if found is None else str(found)


def main() -> None:
    """Work out and print."""
    rows = []
    for preset in PRESETS:
        for ell in (1.0, 1.4, 2.0, 3.0):
            for dt in (0.01, 0.02, 0.05):
                d = design_scaled_gain(preset, dt, ell)
                found = [first(d, both, counting) for counting in (True, False) for both in (False, True)]
                rows.append([preset, f"{ell:g}", f"{dt:g}", *found])
    head = ["preset", "ell", "tick, s", "speed on every n-th tick: unstable from n", "both", "speed, not counted"]
    print(table([*head, "both, not counted"], rows))


if __name__ == "__main__":
    main()
