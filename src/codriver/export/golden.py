"""Golden vectors: inputs that take a step through all its corners, and what it must answer."""

from __future__ import annotations

from math import inf

import numpy as np

from codriver.models.road_frame import GRAVITY
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
        values[name] = column
        fresh[name] = rng.random(rows) < 0.7
        held[name] = (rng.random(rows) < 0.97) & (np.arange(rows) > 3)
    if "roll_rate" in values:
        values |= {name: column for name, column in _leaning(speed, observer.dt, rng).items() if name in values}
    values = {name: column.astype(np.float32).astype(np.float64) for name, column in values.items()}
    return Grid(observer.dt * np.arange(rows, dtype=np.float64), observer.dt, values, fresh, held)


def _leaning(speed: Array, dt: float, rng: np.random.Generator) -> dict[str, Array]:
    """What a two-wheeler shows that leans to either side and turns as it leans.

    Signals that wander on their own would lay it down, where a filter of its lean is at its bounds and float and double part.
    """
    t = dt * np.arange(speed.size)
    lean, rolling = 0.4 * np.sin(np.pi * t), 0.4 * np.pi * np.cos(np.pi * t)
    turn = -GRAVITY * np.tan(lean) / np.maximum(speed, 4.0)
    noise = 0.005 * rng.standard_normal((6, speed.size))
    return {
        "roll_rate": rolling + noise[0], "pitch_rate": turn * np.sin(lean) + noise[1], "yaw_rate": turn * np.cos(lean) + noise[2],
        "lateral_acceleration": 5 * noise[3], "vertical_acceleration": GRAVITY / np.cos(lean) + 5 * noise[4],
        "steer_angle": 1.5 * turn / np.maximum(speed, 4.0) + 0.1 * noise[5],
    }  # fmt: skip
