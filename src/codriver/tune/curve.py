"""Delay against noise: what each ell costs, from the transfer functions and from a drive.

    computed   delay and jerk noise of the running filter at the drive's rates (`running_response`), with the sensors' noise
    measured   scatter of the jerk in calm stretches: 5 s in which, and for 2 s before, no pedal and no request moved

The noise of a sensor is what its neighbouring samples differ by: white noise of standard deviation s has third differences
of standard deviation sqrt(20) s, and a drive's motion hardly any. The 90 % quantile is taken, so that spikes do not count and
coarse steps do. In a calm stretch the driver intends nothing new, so what the jerk does there is noise, and what the road adds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from codriver.estimate import Estimate
from codriver.observers.jerk_forms import ROWS
from codriver.observers.response import bandwidth, delay
from codriver.observers.running_response import running_response
from codriver.observers.scaled_gain import Preset, design_scaled_gain
from codriver.signals.signal import Array

ELLS = tuple(float(x) for x in np.geomspace(0.5, 8.0, 9))
WINDOW, LEAD = 5.0, 2.0  # s
STILL = 0.02  # of a signal's range in the drive
FEWEST_WINDOWS = 3
_ASKED = ("accelerator_pedal", "engine_torque_request", "brake_pressure")
_NORMAL_90 = 1.645  # 90 % quantile of the absolute value of a standard normal


@dataclass(frozen=True)
class Point:
    """One setting on the curve.

    Attributes:
        ell: the knob.
        slow_delay: of slow changes of the jerk, both rows on every tick, s: 0.911/ell for 2017's noise.
        delay: the same at the drive's rates, s.
        bandwidth: -3 dB, Hz.
        gains: jerk noise per unit of sample noise of accelerometer and speed.
        noise: of the jerk with the drive's sensors, m/s^3.
        calm: measured scatter of the jerk in calm stretches, m/s^3; None where it was not measured.
    """

    ell: float
    slow_delay: float
    delay: float
    bandwidth: float
    gains: tuple[float, float]
    noise: float
    calm: float | None = None


def point(
    preset: Preset, ell: float, dt: float, every: tuple[int, int], sensors: tuple[float, float], calm: float | None = None
) -> Point:  # fmt: skip
    """A setting on the curve.

    Args:
        preset, ell, dt: the design.
        every: the ticks from row to row, of accelerometer and speed.
        sensors: standard deviations of their samples, m/s^2 and m/s.
        calm: what was measured.
    """
    design = design_scaled_gain(preset, dt, ell)
    running = running_response(design, every)
    return Point(ell, delay(design), running.delay, bandwidth(design), running.noise, running.jerk_noise(sensors), calm)


def ticks_between(runs: Sequence[Estimate]) -> tuple[int, int]:
    """The usual number of ticks from row to row, of accelerometer and speed."""
    found = []
    for row in ROWS:
        steps = np.concatenate([np.diff(np.flatnonzero(run.flag(f"{row}_used"))) for run in runs])
        found.append(max(round(float(np.median(steps))), 1) if steps.size else 1)
    return found[0], found[1]


def sensor_noise(runs: Sequence[Estimate]) -> tuple[float, float]:
    """Standard deviation of the samples of accelerometer (m/s^2) and speed (m/s), where the runs are valid."""
    found = []
    for row in ROWS:
        pieces = []
        for run in runs:
            used = run.flag(f"{row}_used")
            valid, values = run.valid[used], run.grid.values[f"longitudinal_{row}"][used]
            whole = valid[3:] & valid[2:-1] & valid[1:-2] & valid[:-3]
            pieces.append(np.abs(np.diff(values, 3))[whole])
        all_of = np.concatenate(pieces)
        found.append(float(np.quantile(all_of, 0.9)) / _NORMAL_90 / 20**0.5 if all_of.size else float("nan"))
    return found[0], found[1]


def calm_jerk(runs: Sequence[Estimate]) -> float | None:
    """Scatter of the jerk in calm stretches, m/s^3; None where there are too few, or no signal says what the driver asks."""
    variances = []
    for run in runs:
        jerk = run.columns[run.estimates[3].name]
        variances += [float(np.var(jerk[part])) for part in _calm_parts(run)]
    return float(np.sqrt(np.mean(variances))) if len(variances) >= FEWEST_WINDOWS else None


def _calm_parts(run: Estimate) -> list[slice]:
    """Stretches of 5 s in which the estimate is valid and nothing that the driver asks with moved."""
    names = [name for name in _ASKED if name in run.log and len(run.log[name])]
    if not names or not len(run.grid):
        return []
    dt, n = run.grid.dt, len(run.grid)
    grid = run.log.sample(names, dt, start=float(run.time[0]), stop=float(run.time[-1]))
    window, lead = round(WINDOW / dt), round(LEAD / dt)
    held = {name: np.where(grid.held[name], grid.values[name], np.nan)[:n] for name in names}
    parts, k = [], lead
    moved = run.flag("gear_shift") | ~run.valid
    while k + window <= n:
        part = slice(k - lead, k + window)
        if not moved[part].any() and all(_still(values, part) for values in held.values()):
            parts.append(slice(k, k + window))
        k += window
    return parts


def _still(values: Array, part: slice) -> bool:
    """Whether a signal keeps within a small share of its range over a stretch."""
    here: npt.NDArray[np.float64] = values[part]
    if not np.isfinite(here).all():
        return False
    return bool(np.ptp(here) <= STILL * (np.nanmax(values) - np.nanmin(values)))
