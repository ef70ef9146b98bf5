"""An estimated driver's torque held against what the log itself shows: a torque sensor, and the angle.

    RMSE = sqrt(mean (T^ - T)^2),   R^2 = 1 - sum (T^ - T)^2 / sum (T - mean T)^2            over the valid ticks

A sensor on the column measures the torque in the torsion bar: the driver's, less what turns the rim above it.
The angle is reproduced as figure 10 of the 2019 paper does: the wheel, turned by the estimated torque and what else acts on it,
without any measured angle. Two integrations make drift of the smallest error, so it starts anew from the estimate every
RESTART seconds.
Okamoto, Tsiotras 2019 (Robotics and Autonomous Systems), section 4.2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from codriver.estimate import Estimate
from codriver.finding import Finding
from codriver.models.steering import tick_of
from codriver.signals.grid import Flags
from codriver.signals.signal import Array

SENSORS = ("driver_torque", "steering_wheel_torque")  # the first there is
RESTART = 10.0  # s
LEAST = 50  # ticks
SIGMAS = 1.96
BAD_SHARE, GOOD_SHARE = 0.65, 0.85  # of the sensor's values in the 95 % band


@dataclass(frozen=True)
class SensorComparison:
    """The estimate against a torque sensor.

    Attributes:
        sensor: standard name of the sensor's signal.
        ticks: that count.
        rmse, bias: root mean square and mean of estimate less sensor, N m.
        r2: NaN where the sensor shows a constant.
        correlation: of the two; NaN likewise.
        covered: share of the sensor's values in the 95 % band; None without a band.
        sensor_rms: of the sensor about its mean, N m: what answering its mean would be off by.
    """

    sensor: str
    ticks: int
    rmse: float
    bias: float
    r2: float
    correlation: float
    covered: float | None
    sensor_rms: float

    def told(self) -> str:
        """A line."""
        band = "" if self.covered is None else f", {self.covered:.0%} in the 95 % band"
        found = f"RMSE {self.rmse:.3f} N m, R2 {self.r2:.3f}, mean error {self.bias:+.3f} N m"
        return f"against the measured {self.sensor}: {found}{band}"


def compare_with_sensor(estimate: Estimate) -> SensorComparison | None:
    """Hold an estimate of driver_torque against the log's torque sensor; None where there is none, or too little of it.

    The sensor's values are read straight between its samples, and not at all in gaps of over 0.25 s.
    """
    sensor = next((s for s in SENSORS if s in estimate.log and len(estimate.log[s])), None)
    if sensor is None or "driver_torque" not in estimate:
        return None
    truth = on_ticks(estimate, sensor)
    value = estimate.columns["driver_torque"]
    use = estimate.valid & np.isfinite(truth) & np.isfinite(value)
    if use.sum() < LEAST:
        return None
    error = (value - truth)[use]
    spread = truth[use] - truth[use].mean()
    total, square = float(spread @ spread), float(error @ error)
    moved = value[use] - value[use].mean()
    size = float(np.sqrt((moved @ moved) * total))
    sd = estimate.sd("driver_torque")
    return SensorComparison(
        sensor, int(use.sum()), float(np.sqrt(np.mean(error**2))), float(error.mean()),
        1 - square / total if total > 0 else float("nan"), float(moved @ spread) / size if size > 0 else float("nan"),
        None if sd is None else float(np.mean(np.abs(error) <= SIGMAS * sd[use])), float(np.sqrt(total / use.sum())),
    )  # fmt: skip


def sensor_findings(estimate: Estimate) -> list[Finding]:
    """What a torque sensor in the log says of the estimate; nothing where there is none."""
    found = compare_with_sensor(estimate)
    if found is None:
        return []
    if found.correlation < -0.2:
        return [
            Finding(
                "bad",
                f"{found.told()}: they go against each other (correlation {found.correlation:.2f}); a wrong sign?",
            )
        ]
    if found.covered is None:
        return [Finding("bad" if found.r2 < 0 else "ok", found.told())]
    severity = "bad" if found.covered < BAD_SHARE else "warn" if found.covered < GOOD_SHARE else "ok"
    return [Finding(severity, found.told())]


def on_ticks(estimate: Estimate, name: str, longest: float = 0.25) -> Array:
    """A signal of the log on the estimate's ticks, straight between samples, NaN in gaps of over `longest` s and outside."""
    signal = estimate.log[name]
    finite = np.isfinite(signal.values)
    time, values = signal.time[finite], signal.values[finite]
    if not time.size:
        return np.full(len(estimate.grid), np.nan)
    ticks = estimate.time
    straight = np.interp(ticks, time, values, left=np.nan, right=np.nan)
    after = np.clip(np.searchsorted(time, ticks), 0, time.size - 1)
    before = np.maximum(after - 1, 0)
    return np.where(time[after] - time[before] <= longest, straight, np.nan)


@dataclass(frozen=True, eq=False)
class ReproducedAngle:
    """The angle from the torques alone.

    Attributes:
        angle: rad, shape (n,); NaN where the estimate is not valid.
        rmse: against the measured angle, rad.
    """

    angle: Array
    rmse: float


def reproduce_angle(estimate: Estimate, restart: float = RESTART) -> ReproducedAngle | None:
    """The angle that the estimated torque and the known one make of the wheel; None where the estimate does not say its wheel.

    Args:
        estimate: of driver_torque, with column_torque and the settings J_s and b_s.
        restart: s, after which it starts anew from the estimated angle and rate; infinite for never.
    """
    try:
        J, b = float(estimate.provenance["J_s"]), float(estimate.provenance["b_s"])
    except (KeyError, ValueError):
        return None
    names = ("driver_torque", "column_torque", "steering_wheel_angle", "steering_wheel_rate")
    if any(name not in estimate.columns for name in names):
        return None
    torque, known, angle, rate = (estimate.columns[name] for name in names)
    dt, n = estimate.grid.dt, len(estimate.grid)
    tick = tick_of(J, b, dt)
    total = torque + known
    # Straight between ticks to second order: the mean of both ends is held.
    held = 0.5 * (total[:-1] + total[1:])
    made = np.full(n, np.nan)
    every = n if restart == float("inf") else max(round(restart / dt), 2)
    for start, stop in _pieces(estimate.valid & ~estimate.flag("angle_jump"), every):
        state = float(angle[start]), float(rate[start])
        for k in range(start, stop):
            made[k] = state[0]
            if k + 1 < stop:
                state = tick.advance(state[0], state[1], float(held[k]))
    there = np.isfinite(made)
    if not there.any():
        return None
    measured = _unwrapped(estimate)
    use = there & np.isfinite(measured)
    return ReproducedAngle(made, float(np.sqrt(np.mean((made - measured)[use] ** 2))) if use.any() else float("nan"))


def _unwrapped(estimate: Estimate) -> Array:
    """The measured angle with the turns that the estimator took out, NaN where no sample arrived."""
    name = "steering_wheel_angle"
    turns = estimate.columns.get("angle_turns", np.zeros(len(estimate.grid)))
    return np.where(estimate.grid.fresh[name], estimate.grid.values[name] + turns, np.nan)


def _pieces(good: Flags, every: int) -> list[tuple[int, int]]:
    """Runs of True cut into pieces of at most `every`, as (first, one after the last)."""
    edges = np.flatnonzero(np.diff(np.r_[0, good.astype(np.int8), 0]))
    return [
        (int(k), int(min(k + every, b)))
        for a, b in zip(edges[::2], edges[1::2], strict=True)
        for k in range(int(a), int(b), every)
    ]
