"""Which moments of a drive an identification may use, and why not the others.

Eq. (19) of the 2017 paper holds while the car rolls forward in gear, the clutch closed, the wheels not slipping, and all
signals there. Each reason to leave a moment out comes with margins: the low-pass forgets within 0.1 s, the driveline rings
for up to a second after a shift.

    missing    a signal is older than its hold time, or not there yet
    absurd     a value that no vehicle can show (bounds of the vocabulary), or a sensor that stays at the end of its range
    shift      from 0.2 s before the clutch opens or the gear changes until 1 s after it closed; neutral
    slow       below 2 m/s, and half a second around it
    reverse    reverse gear or negative speed
    slip       accelerometer and change of speed, both below 1.5 Hz, part by more than 1.5 m/s^2 from their usual difference
    gear       a gear that the vehicle file lacks

For ratios, where no brake coefficient is sought, also `braking`, until a second after it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from codriver.identify.low_pass import low_pass, rate, smooth
from codriver.identify.saturation import AT_END, Plateau, plateaus
from codriver.names import VOCABULARY
from codriver.signals import Grid
from codriver.signals.grid import Flags
from codriver.signals.signal import Array

MOVING = 2.0  # m/s
BEFORE_SHIFT, AFTER_SHIFT = 0.2, 1.0  # s
AROUND_SLOW = 0.5  # s
AFTER_BRAKING = 1.0  # s left out around braking: pressure and regeneration fade
OPEN_CLUTCH = 0.05
SLIP, SLIP_MARGIN, USUAL = 1.5, 0.5, 10.0  # m/s^2; s; s over which slope and bias stay alike
BRAKING = 0.7e5  # Pa
REASONS: Mapping[str, str] = {
    "missing": "a signal missing or too old",
    "absurd": "values that no vehicle shows, or a sensor at the end of its range",
    "shift": "gear shifts, clutch not closed, neutral",
    "slow": "standing or slower than 2 m/s",
    "reverse": "driving in reverse",
    "slip": "wheel slip: accelerometer and change of speed disagree",
    "gear": "a gear that the vehicle file lacks",
    "braking": "braking",
}


@dataclass(frozen=True, eq=False)
class Usable:
    """Moments that may be used.

    Attributes:
        keep: shape (n,).
        left_out: by reason, shape (n,); one tick can have several reasons.
        plateaus: ends of a sensor's range at which it stayed.
    """

    keep: Flags
    left_out: Mapping[str, Flags]
    plateaus: tuple[Plateau, ...] = ()

    @property
    def share(self) -> dict[str, float]:
        """Of all ticks, by reason, left out for it."""
        return {reason: float(mask.mean()) if mask.size else 0.0 for reason, mask in self.left_out.items()}


def usable(grid: Grid, needed: tuple[str, ...], known_gears: int | None, *, without_braking: bool = False) -> Usable:
    """Judge the ticks of a drive.

    Args:
        grid: the drive, with `needed`, and gear, clutch, brake_switch, brake_pressure, longitudinal_speed among its channels.
        needed: channels that must be there.
        known_gears: forward gears of the vehicle file; None if they are sought.
        without_braking: leave braking out.
    """
    dt, n = grid.dt, len(grid)
    left_out = {"missing": ~np.all([grid.held[name] for name in needed], axis=0), "absurd": np.zeros(n, bool)}
    ends: list[Plateau] = []
    for name in needed:
        x, good = grid.values[name], inside(name, grid.values[name])
        at_end, found = plateaus(name, x, good, dt)
        left_out["absurd"] |= (np.isfinite(x) & ~good) | widened(at_end, AT_END, AT_END, dt)
        ends += found
    bad = left_out["missing"] | left_out["absurd"]
    speed = np.where(bad, 0.0, np.nan_to_num(grid.values["longitudinal_speed"]))
    gear = grid.values["gear"] if grid.held["gear"].any() else np.ones(n)
    clutch = np.where(grid.held["clutch"], np.nan_to_num(grid.values["clutch"]), 0.0)
    changed = np.diff(gear, prepend=gear[:1]) != 0
    left_out["shift"] = widened(changed | (clutch > OPEN_CLUTCH) | (gear == 0), BEFORE_SHIFT, AFTER_SHIFT, dt)
    left_out["slow"] = widened(np.abs(speed) < MOVING, AROUND_SLOW, AROUND_SLOW, dt)
    left_out["reverse"] = (gear < 0) | (speed < -0.5)
    left_out["slip"] = _slip(grid, bad)
    if known_gears is not None:
        left_out["gear"] = (gear > known_gears) | (gear != np.round(gear))
    if without_braking:
        pressed = np.nan_to_num(grid.values["brake_pressure"]) > BRAKING
        left_out["braking"] = widened(
            pressed | (np.nan_to_num(grid.values["brake_switch"]) > 0.5), AFTER_BRAKING, AFTER_BRAKING, dt
        )
    # What is missing or absurd has gone into the low-pass, too.
    left_out["missing"], left_out["absurd"] = (
        widened(left_out[reason], 0.0, 0.2, dt) for reason in ("missing", "absurd")
    )
    keep = ~np.any(list(left_out.values()), axis=0)
    return Usable(keep, left_out, tuple(ends))


def widened(mask: Flags, before: float, after: float, dt: float) -> Flags:
    """True from `before` seconds before a True until `after` seconds after it."""
    n = mask.size
    total = np.concatenate([[0], np.cumsum(mask)])
    ticks = np.arange(n)
    first, last = ticks - round(after / dt), ticks + round(before / dt) + 1
    return np.asarray(total[np.minimum(last, n)] > total[np.maximum(first, 0)])


def filled(x: Array, good: Flags) -> Array:
    """x with what is not good replaced by the last good value (the first one at the start), so that filters can pass."""
    good = good & np.isfinite(x)
    if not good.any():
        return np.zeros_like(x)
    last = np.maximum.accumulate(np.where(good, np.arange(x.size), -1))
    return np.asarray(x[np.where(last < 0, int(np.argmax(good)), last)])


def inside(name: str, x: Array) -> Flags:
    """Where a signal is within what a vehicle can show."""
    entry = VOCABULARY[name]
    with np.errstate(invalid="ignore"):
        return np.asarray((x >= entry.low) & (x <= entry.high))


def _slip(grid: Grid, bad: Flags) -> Flags:
    """Where accelerometer and change of speed part by far more than slope, bias and pitch can make them."""
    dt = grid.dt
    y = smooth(low_pass(filled(grid.values["longitudinal_acceleration"], ~bad), dt), dt)
    apart = y - rate(filled(grid.values["longitudinal_speed"], ~bad), dt)
    if not apart.size:
        return np.zeros(0, bool)
    half = max(round(USUAL / 2 / dt), 1)
    total = np.concatenate([[0.0], np.cumsum(np.clip(apart, -2 * SLIP, 2 * SLIP))])
    ticks = np.arange(apart.size)
    first, last = np.maximum(ticks - half, 0), np.minimum(ticks + half + 1, apart.size)
    usual = (total[last] - total[first]) / (last - first)
    return widened(np.abs(apart - usual) > SLIP, SLIP_MARGIN, SLIP_MARGIN, dt)
