"""tau / M of a vehicle with one gear, from a drive.

With the brake released (2017 eq. 19, per unit of mass)

    [y1]_F = (tau/M) [T_e]_F - k_1 - k_2 [v^2]_F

is linear in tau/M (1/(kg m)), k_1 (m/s^2; holds the accelerometer's bias too) and k_2 (1/m). All signals pass the same
first-order low-pass of 5 Hz. k_2 is only fitted where the drive covers enough speeds to tell it. Residuals of neighbouring
samples are alike, so the standard error comes from a bootstrap of whole blocks of time and not from the residuals' count.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, pi

import numpy as np

from codriver.errors import LogError
from codriver.signals import Log
from codriver.signals.signal import Array

LOW_PASS = 5.0  # Hz, 2017 section IV-A
MOVING = 2.0  # m/s
AFTER_BRAKING = 1.0  # s left out around braking: pressure and regeneration fade
LEAST_TORQUE_SPREAD = 10.0  # N m, standard deviation
LEAST_SECONDS = 5.0
BLOCK = 1.0  # s
DRAWS = 400


@dataclass(frozen=True)
class RatioFit:
    """What was found.

    Attributes:
        ratio: tau/M, 1/(kg m).
        sd: its standard error, from the block bootstrap.
        residual: RMS of the fit, m/s^2.
        seconds: how much of the drive was used.
    """

    ratio: float
    sd: float
    residual: float
    seconds: float


def identify_ratio(log: Log, *, dt: float = 0.01, seed: int = 0) -> RatioFit:
    """tau/M by least squares on a drive with the brake released.

    Args:
        log: with longitudinal_speed, longitudinal_acceleration, engine_torque, and brake_switch or brake_pressure if there.
        dt: tick, s.
        seed: of the bootstrap.

    Raises:
        MissingSignal: a signal is missing.
        LogError: the drive does not excite the ratio: too short, or the torque hardly changes.
    """
    names = ["longitudinal_acceleration", "longitudinal_speed", "engine_torque"]
    start = max(float(log[name].time[0]) for name in names)
    grid = log.sample([*names, "brake_switch", "brake_pressure"], dt, start=start)
    y, v, torque = (_low_pass(grid.values[name], dt) for name in names)
    braking = (grid.values["brake_switch"] > 0.5) | (grid.values["brake_pressure"] > 0.7e5)
    around = max(round(AFTER_BRAKING / dt), 1)
    near = np.convolve(braking.astype(float), np.ones(2 * around + 1), "same") > 0
    keep = (np.abs(v) > MOVING) & ~near & np.all([grid.held[name] for name in names], axis=0)
    seconds = float(keep.sum() * dt)
    spread = float(torque[keep].std()) if keep.any() else 0.0
    if seconds < LEAST_SECONDS or spread < LEAST_TORQUE_SPREAD:
        raise LogError(
            f"{log.source}: {seconds:.1f} s of moving with the brake released, in which the torque varies by {spread:.1f} N m",
            f"at least {LEAST_SECONDS:g} s and {LEAST_TORQUE_SPREAD:g} N m (standard deviation)",
            "record a drive with stronger and weaker accelerations",
        )
    columns = [torque, -np.ones_like(v)]
    if float((v[keep] ** 2).std()) > 100.0:  # below some 10 m/s of range drag cannot be told from k_1
        columns.append(-(v**2))
    X, target = np.column_stack(columns)[keep], y[keep]
    solution = np.linalg.lstsq(X, target, rcond=None)[0]
    blocks = np.array_split(np.arange(keep.sum()), max(int(seconds / BLOCK), 2))
    rng = np.random.default_rng(seed)
    draws = []
    for _ in range(DRAWS):
        index = np.concatenate([blocks[k] for k in rng.integers(0, len(blocks), len(blocks))])
        draws.append(np.linalg.lstsq(X[index], target[index], rcond=None)[0][0])
    residual = float(np.sqrt(np.mean((target - X @ solution) ** 2)))
    return RatioFit(float(solution[0]), float(np.std(draws)), residual, seconds)


def _low_pass(x: Array, dt: float) -> Array:
    """First-order low-pass of LOW_PASS Hz, causal, started at the first value."""
    from scipy.signal import lfilter

    a = exp(-2 * pi * LOW_PASS * dt)
    filtered, _ = lfilter([1 - a], [1, -a], x, zi=[a * x[0]])
    return np.asarray(filtered)
