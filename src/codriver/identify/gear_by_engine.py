"""Whether the log's gear is the engaged one: engine speed over road speed.

    tau_g = eta omega / v,  0.8 <= eta <= 1          omega  engine speed, rad/s      v  speed, m/s      eta  driveline's efficiency

The median of a gear judges tau; how often single moments fall out of the band judges the gear: a gear signal that is stuck, or
another car's numbering.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from codriver.finding import Finding
from codriver.identify.brake_rows import DriveRows
from codriver.signals import Log
from codriver.signals.signal import Array

EFFICIENCY = (0.8, 1.02)
LEAST_SECONDS = 1.0
STANDS = 0.01  # 1/m: an engine that does not turn while the car moves is a signal that is not there
MOST_WRONG = 0.05  # share of the moments


def turns(logs: Sequence[Log], rows: DriveRows) -> Array:
    """omega / v on the ticks of rows, 1/m; NaN where a log has no engine speed or hardly moves."""
    parts = []
    for number, log in enumerate(logs):
        time: Array = rows.time[rows.pieces[number] : rows.pieces[number + 1]]
        if "engine_speed" not in log or not len(log["engine_speed"]) or not time.size:
            parts.append(np.full(time.size, np.nan))
            continue
        grid = log.sample(["engine_speed", "longitudinal_speed"], rows.dt, start=float(time[0]), stop=float(time[-1]))
        held = grid.held["engine_speed"] & grid.held["longitudinal_speed"]
        v = grid.values["longitudinal_speed"]
        quotient = np.where(held & (v > 1.0), grid.values["engine_speed"] / np.where(v > 1.0, v, 1.0), np.nan)
        parts.append(np.resize(quotient, time.size) if quotient.size != time.size else quotient)
    return np.concatenate(parts)


def engine_turns(logs: Sequence[Log], rows: DriveRows, gears: int) -> dict[int, float]:
    """omega / v by gear, 1/m, the median over usable ticks; empty where no log has an engine speed."""
    here, found = turns(logs, rows), {}
    for gear in range(1, gears + 1):
        there = rows.keep & (rows.gear == gear) & np.isfinite(here)
        if there.sum() * rows.dt >= LEAST_SECONDS and abs(middle := float(np.median(here[there]))) > STANDS:
            found[gear] = middle
    return found


def wrong_gears(logs: Sequence[Log], rows: DriveRows, taus: Sequence[float]) -> list[Finding]:
    """A finding where the engine often turns as in another gear than the log names.

    Args:
        logs: the drives.
        rows: theirs.
        taus: of the gears, 1/m.
    """
    here, tau = turns(logs, rows), np.array(taus)
    gear = np.where(rows.keep, rows.gear, 0.0)
    there = np.isfinite(here) & (here > STANDS) & (gear >= 1) & (gear <= tau.size)
    if there.sum() * rows.dt < 10 * LEAST_SECONDS:
        return []
    quotients = tau[None, :] / here[there, None]
    fits = (quotients >= EFFICIENCY[0]) & (quotients <= EFFICIENCY[1])
    named = gear[there].astype(int) - 1
    other = ~fits[np.arange(named.size), named] & fits.any(axis=1)
    if other.mean() <= MOST_WRONG:
        return []
    worst = int(np.bincount(named[other]).argmax())
    shown = int(np.argmax(fits[other & (named == worst)].sum(axis=0))) + 1
    return [Finding(
        "bad", f"in {other.mean():.0%} of the moments engine speed over speed is that of another gear than the log names (gear "
        f"{worst + 1} of the log: mostly gear {shown}): is the gear stuck, late or numbered in another way?",
    )]  # fmt: skip
