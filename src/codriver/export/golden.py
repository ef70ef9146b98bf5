"""Golden vectors: inputs that take a step through all its corners, and what it must answer."""

from __future__ import annotations

from math import inf

import numpy as np

from codriver.names import VOCABULARY
from codriver.program import Program
from codriver.signals import Grid
from codriver.signals.signal import Array

ROWS = 400


def golden_inputs(program: Program, rows: int = ROWS, seed: int = 7) -> Grid:
    """A made-up drive: signals that wander through their plausible range, stand still, change on steps, and are missing now
    and then. Values are exact in single precision, so float and double start from the same numbers.

    Args:
        program: whose channels are filled.
        rows: number of ticks.
        seed: of the random numbers.
    """
    rng = np.random.default_rng(seed)
    observer = program.observer
    values: dict[str, Array] = {}
    fresh, held = {}, {}
    t = np.linspace(0, 1, rows)
    speed = np.clip(12 * np.sin(2 * np.pi * t) + 6, 0, None)  # starts, drives, stops, stands, drives again
    for name in observer.channels:
        entry = VOCABULARY.get(name)
        if name == "longitudinal_speed":
            column = speed + 0.02 * rng.standard_normal(rows) * (speed > 0)
        elif name == "longitudinal_acceleration":
            column = np.gradient(speed, observer.dt * 10) + 0.2 + 0.1 * rng.standard_normal(rows)
        elif name == "steering_wheel_angle":
            # As a hand turns it, with an encoder's steps; then the encoder jumps, and later wraps.
            turned = np.round((1.5 * np.sin(6 * np.pi * t) + 0.4 * t) / 0.002) * 0.002
            column = turned + 0.9 * (t > 0.6) - 2 * np.pi * (t > 0.8)
        elif name == "gear":
            column = np.repeat(
                rng.choice([0, 1, 2, 3, 4, 5, -1], rows // 20 + 1, p=[0.1, 0.2, 0.2, 0.2, 0.15, 0.1, 0.05]), 20
            )[:rows]
        elif entry is not None and entry.hold == inf:  # switches and the clutch
            column = np.repeat(rng.choice([0.0, 0.0, 0.0, 0.5, 1.0], rows // 10 + 1), 10)[:rows]
        else:
            low, high = (entry.low, entry.high) if entry is not None and np.isfinite(entry.low) else (-1.0, 1.0)
            top = 0.2 * high
            walk = np.cumsum(rng.standard_normal(rows)) * top / 20
            column = np.clip(np.abs(walk) if low > -0.1 * high else walk, max(low, -top), top)
        values[name] = column.astype(np.float32).astype(np.float64)
        fresh[name] = rng.random(rows) < 0.7
        held[name] = (rng.random(rows) < 0.97) & (np.arange(rows) > 3)
    return Grid(observer.dt * np.arange(rows, dtype=np.float64), observer.dt, values, fresh, held)
