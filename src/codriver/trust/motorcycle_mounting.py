"""How a two-wheeler's IMU sits, by its accelerometer: tilted, turned about the vertical, or with a large bias.

In balance, blocks of 0.5 s while it moves, phi_m = -asin(v r / g), by least squares:

    a_y = c_y + m v' + k phi_m + n p'           c_y: askew about x (g sin), or a bias;  m: turned about z;  k: tyres' width
    a_x - v' = c_x                              c_x: askew about y (g sin), a bias, or a road that goes up or down all the while

A gyroscope in the same box is askew too: with roll rate in its yaw rate the lean errs.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from codriver.finding import Finding
from codriver.models.road_frame import GRAVITY
from codriver.signals.grid import Flags
from codriver.signals.signal import Array

LEAST = 12  # blocks
ASKEW, FAR = 0.6, 2.0  # m/s^2, as 3.5 and 12 degrees would show
TURNED = 0.1  # tangent
SPEEDING = 0.3  # m/s^2, sd of v'; below nothing is said of m
SURELY = 4.0  # standard errors, of blocks two of which err as one
DEGREE = np.pi / 180


def mounting_findings(
    columns: Mapping[str, Array], moving: Flags, dt: float, block: int, used: set[str]
) -> tuple[list[Finding], bool]:
    """Look at the accelerometer's level.

    Args:
        columns: longitudinal_speed, and what there is of yaw_rate, roll_rate, longitudinal_acceleration and lateral_acceleration,
            SI, shape (n,) each; NaN where missing.
        moving: where it moves, shape (n,).
        dt, block: tick, s, and ticks of a block.
        used: names of the signals that the estimate uses.

    Returns:
        The findings, and whether the IMU is askew about x.
    """
    whole = moving.size // block * block

    def means(name: str) -> Array:
        column = np.where(moving, columns[name], np.nan)[:whole]
        return column.reshape(-1, block).mean(axis=1)

    def growth(column: Array) -> Array:
        return np.gradient(column) / (block * dt) if column.size > 1 else np.zeros(column.size)

    v = means("longitudinal_speed")
    gains = growth(v)
    findings = _forward(means("longitudinal_acceleration") - gains) if "longitudinal_acceleration" in columns else []
    if not {"lateral_acceleration", "roll_rate", "yaw_rate"} <= set(columns):
        return findings, False
    lean = np.arcsin(np.clip(-v * means("yaw_rate") / GRAVITY, -0.95, 0.95))
    level, turned = _sideways(means("lateral_acceleration"), gains, lean, growth(means("roll_rate")))
    if level:
        findings.append(Finding(
            "bad" if "lateral_acceleration" in used and abs(level) > FAR else "warn",
            f"lateral_acceleration shows {level:.2g} m/s^2 in balance, where 0 is right: an IMU askew about x by {_angle(level)} "
            "degrees, or a bias? Take it out by offset in the names file, or level the IMU",
        ))  # fmt: skip
    if turned:
        findings.append(Finding(
            "warn", f"lateral_acceleration shows {turned:.2g} of what the speed gains: the IMU is turned by some "
            f"{np.arctan(turned) / DEGREE:.2g} degrees about z? Its roll and pitch rates are mixed then",
        ))  # fmt: skip
    return findings, level != 0


def _forward(level: Array) -> list[Finding]:
    """The forward accelerometer less the speed's gains."""
    level = level[np.isfinite(level)]
    if level.size < LEAST:
        return []
    mean = float(level.mean())
    if abs(mean) < max(ASKEW, SURELY * float(level.std()) * (2 / level.size) ** 0.5):
        return []
    return [Finding(
        "warn", f"longitudinal_acceleration shows {mean:.2g} m/s^2 more than the speed gains: an IMU askew about y by "
        f"{_angle(mean)} degrees, a bias, or a road that goes up or down? An IMU that is askew costs degrees of roll",
    )]  # fmt: skip


def _sideways(side: Array, gains: Array, lean: Array, growing: Array) -> tuple[float, float]:
    """The lateral accelerometer's constant and its share of the speed's gains; 0 where there is nothing to tell."""
    X = np.column_stack([np.ones(side.size), gains, lean, growing])
    there = np.isfinite(side) & np.isfinite(X).all(axis=1)
    y, X = side[there], X[there]
    if y.size < LEAST:
        return 0.0, 0.0
    if not (speeding := bool(X[:, 1].std() > SPEEDING)):
        X = X[:, [0, 2, 3]]
    normal = np.linalg.pinv(X.T @ X)
    fitted = normal @ X.T @ y
    se = np.sqrt(np.diag(normal) * np.sum((y - X @ fitted) ** 2) / max(y.size / 2 - X.shape[1], 1))
    level = float(fitted[0]) if abs(fitted[0]) > max(ASKEW, SURELY * se[0]) else 0.0
    turned = float(fitted[1]) if speeding and abs(fitted[1]) > max(TURNED, SURELY * se[1]) else 0.0
    return level, turned


def _angle(shown: float) -> str:
    """Degrees of tilt that show so much of gravity."""
    return f"{np.arcsin(np.clip(shown / GRAVITY, -1, 1)) / DEGREE:.2g}"
