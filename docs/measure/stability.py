"""Figure of docs/sampling.md: from which spacing of the rows on the constant form is unstable. In closed form.

Over the period after which the rows' pattern repeats, the error of the constant form passes through the product of
(I - K S_k C) F, with S_k = diag(accelerometer there, speed there) at tick k. It dies out if all eigenvalues of the product
are smaller than 1.
"""

# ruff: noqa: T201
from __future__ import annotations

from itertools import count

import numpy as np
from drives import table

from codriver.observers import PRESETS, design_scaled_gain


def growth(preset: str, ell: float, dt: float, every_a: int, every_v: int) -> float:
    """Growth of the error in a second, accelerometer and speed on every n-th tick."""
    d, n = design_scaled_gain(preset, dt, ell), int(np.lcm(every_a, every_v))
    C, product = np.array([[0, 1, 1, 0], [1, 0, 0, 0]], float), np.eye(4)
    for k in range(n):
        S = np.diag([k % every_a == 0, k % every_v == 0]).astype(float)
        product = (np.eye(4) - d.K @ S @ C) @ d.F @ product
    return float(max(abs(np.linalg.eigvals(product))) ** (1 / (n * dt)))


def main() -> None:
    """Work out and print."""
    rows = []
    for preset in PRESETS:
        for ell in (1.0, 2.0, 3.0):
            for dt in (0.01, 0.02):
                speed = next(n for n in count(2) if growth(preset, ell, dt, 1, n) >= 1)
                both = next(n for n in count(2) if growth(preset, ell, dt, n, n) >= 1)
                rows.append([preset, f"{ell:g}", f"{dt:g}", str(speed), str(both)])
    print(
        table(["preset", "ell", "tick, s", "speed on every n-th tick: unstable from n", "both: unstable from n"], rows)
    )


if __name__ == "__main__":
    main()
