"""Eq. (20) of the 2017 paper as rows of a regression.

    M [y1]_F = [tau T_e]_F - c_b [p_b]_F - kappa_1 - kappa_2 [v^2]_F + gamma M [dv/dt]_F        (20), gamma added

    y1   accelerometer, m/s^2          tau T_e   force of the engine at the wheels, N      c_b      N/Pa
    p_b  brake pressure, Pa            v         speed, m/s                                kappa_1  N, kappa_2 kg/m

gamma is the accelerometer's gain error on the car's own acceleration. A body that pitches by theta per m/s^2 shows g theta
more: 0.0015 rad s^2/m makes gamma 1.5 %, which unmodelled moves c_b by 2 % and kappa_2 by 3 %. dv/dt comes from the wheels.
The slope is in y1 and in the forces alike and drops out. M that is wrong shows in gamma, since (1 - gamma) M is what the
forces accelerate.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from codriver.errors import MissingSignal
from codriver.finding import Finding
from codriver.identify.low_pass import centred, low_pass, rate
from codriver.identify.saturation import told
from codriver.identify.standard_errors import Index
from codriver.identify.usable import BRAKING, filled, inside, usable
from codriver.signals import Log
from codriver.signals.grid import Flags
from codriver.signals.signal import Array

SIGNALS = ("longitudinal_acceleration", "longitudinal_speed", "engine_torque", "brake_pressure")
STATES = ("gear", "clutch", "brake_switch")


@dataclass(frozen=True, eq=False)
class DriveRows:
    """Filtered signals of one or several logs, one after the other.

    Attributes:
        dt: tick, s.
        pieces: first rows of the logs, and n, shape (logs + 1,).
        time: shape (n,), s, each log's own clock.
        y, torque, pressure, square, rate: [y1]_F, [T_e]_F of each gear by columns (n, gears), [p_b]_F, [v^2]_F, [dv/dt]_F.
        gear: engaged gear, shape (n,).
        keep: usable ticks.
        share: of the ticks that were left out, by reason.
        pressed: ticks with the brake pressed.
        shifting: ticks around gear shifts.
        clipped: what is to say about sensors at the end of their range.
    """

    dt: float
    pieces: Index
    time: Array
    y: Array
    torque: Array
    pressure: Array
    square: Array
    rate: Array
    gear: Array
    keep: Flags
    share: Mapping[str, float]
    pressed: Flags
    shifting: Flags
    clipped: tuple[Finding, ...]

    @property
    def log_of(self) -> Index:
        """The number of each row's log, shape (n,)."""
        return np.repeat(np.arange(self.pieces.size - 1), np.diff(self.pieces))


def drive_rows(
    logs: Sequence[Log],
    gears: int,
    dt: float,
    *,
    known_gears: bool,
    pressure: bool = True,
    without_braking: bool = False,
) -> DriveRows:
    """Sample, mask and filter.

    Args:
        logs: the drives.
        gears: forward gears.
        dt: tick, s.
        known_gears: other gears are left out, and a car of several gears needs the signal `gear`.
        pressure: the brake pressure is needed.
        without_braking: leave braking out.

    Raises:
        MissingSignal: a log lacks a signal.
    """
    parts = [_one(log, gears, dt, known_gears, pressure, without_braking) for log in logs]
    sizes = [part.time.size for part in parts]
    joined = {
        name: np.concatenate([getattr(part, name) for part in parts])
        for name in ("time", "y", "torque", "pressure", "square", "rate", "gear", "keep", "pressed", "shifting")
    }
    total = max(sum(sizes), 1)
    share = {
        reason: sum(part.share[reason] * size for part, size in zip(parts, sizes, strict=True)) / total
        for reason in parts[0].share
    }
    clipped = tuple(finding for part in parts for finding in part.clipped)
    return DriveRows(dt, np.concatenate([[0], np.cumsum(sizes)]), share=share, clipped=clipped, **joined)


def _one(log: Log, gears: int, dt: float, known_gears: bool, pressure: bool, without_braking: bool) -> DriveRows:
    """The rows of one log."""
    needed = SIGNALS if pressure else SIGNALS[:-1]
    for name in needed:
        log[name]  # tells what is missing
    if gears > 1 and "gear" not in log:
        raise MissingSignal(
            f"{log.source or 'the log'} has no signal 'gear', and the vehicle has {gears} gears",
            "gear, for tau is another in each",
            "map it in a names file",
        )
    start = max(float(log[name].time[0]) if len(log[name]) else 0.0 for name in needed)
    stop = min(float(log[name].time[-1]) if len(log[name]) else start for name in needed)
    grid = centred(log, SIGNALS).sample((*SIGNALS, *STATES), dt, start=start, stop=max(stop, start))
    judged = usable(grid, needed, gears if known_gears else None, without_braking=without_braking)
    values = {name: filled(grid.values[name], grid.held[name] & inside(name, grid.values[name])) for name in SIGNALS}
    v = values["longitudinal_speed"]
    gear = filled(grid.values["gear"], np.isfinite(grid.values["gear"])) if "gear" in log else np.ones(len(grid))
    by_gear = np.where(gear[:, None] == np.arange(1, gears + 1), values["engine_torque"][:, None], 0.0)
    filtered = low_pass(
        np.column_stack([values["longitudinal_acceleration"], values["brake_pressure"], v * v, by_gear]), dt
    )
    switch = np.nan_to_num(grid.values["brake_switch"]) > 0.5
    return DriveRows(
        dt, np.array([0, len(grid)]), grid.time, filtered[:, 0], filtered[:, 3:], filtered[:, 1], filtered[:, 2],
        rate(v, dt), gear, judged.keep, judged.share, switch | (values["brake_pressure"] > BRAKING), judged.left_out["shift"],
        tuple(told(judged.plateaus, short_name(log))),
    )  # fmt: skip


def halves(keep: Flags, pieces: Index) -> tuple[Flags, Flags]:
    """The usable ticks of each log's first half, and of its second, by their count."""
    first = np.zeros_like(keep)
    for i, k in pairwise(pieces):
        rows = i + np.flatnonzero(keep[i:k])
        first[rows[: rows.size // 2]] = True
    return first, keep & ~first


def short_name(log: Log) -> str:
    """The log's name, without its folder."""
    return log.source.replace("\\", "/").rstrip("/").rsplit("/", 1)[-1] or "a log in memory"
