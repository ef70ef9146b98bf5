"""What one wrong sample of the speed costs, and what a running median before the estimate leaves of it.

Run: python docs/measure/spikes.py
"""

# ruff: noqa: T201
from __future__ import annotations

import numpy as np
import pandas as pd

import codriver as cd

DT, AT, HIGH = 0.01, 30.0, 5.0


def jerk(speed: np.ndarray, stamps: np.ndarray, acceleration: np.ndarray, time: np.ndarray, ell: float) -> np.ndarray:
    """The estimated jerk, m/s^3."""
    log = cd.Log.of([
        cd.Signal("longitudinal_acceleration", time, acceleration, "m/s^2"),
        cd.Signal("longitudinal_speed", stamps, speed, "m/s"),
    ])  # fmt: skip
    return cd.compile(cd.build("kinematic", dt=DT, ell=ell)).run(log)["longitudinal_jerk"].values


def main() -> None:
    """The table of docs/trust.md."""
    rng = np.random.default_rng(0)
    time = np.arange(6000) * DT
    acceleration = 0.8 * np.sin(0.6 * time) + 0.05 * rng.standard_normal(time.size)
    speed = 20 - 0.8 / 0.6 * np.cos(0.6 * time) + 0.02 * rng.standard_normal(time.size)
    for every in (1, 5):
        stamps, clean = time[::every], speed[::every]
        dirty = clean + HIGH * (stamps == AT)
        column = pd.Series(dirty)
        middle = column.rolling(5, center=True, min_periods=1).median()
        mended = column.where((column - middle).abs() < 1.0).to_numpy()
        for ell in (1.0, 2.0, 3.0):
            sound = jerk(clean, stamps, acceleration, time, ell)
            error = np.abs(jerk(dirty, stamps, acceleration, time, ell) - sound)
            rest = np.abs(jerk(mended, stamps, acceleration, time, ell) - sound).max()
            lasts = (np.flatnonzero(error > 0.1)[-1] + 1) * DT - AT
            print(
                f"speed at {1 / (every * DT):3.0f} Hz, ell {ell:g}: jerk off by up to {error.max():.2f} m/s^3, "
                f"above 0.1 for {lasts:.1f} s; after the median {rest:.3f} m/s^3"
            )


if __name__ == "__main__":
    main()
