"""A sensor of a two-wheeler that hangs, or is driven into its end stop, while the machine moves.

* One value all the time.
* One value for a stretch far longer than its others: longer than `HANGING`, and `TIMES` as long as all but the longest 1 % of them.
  A sensor that repeats values (coarse steps, a rate below the log's) has long stretches everywhere, and is judged by those. A steer
  angle may rest while the machine goes straight: it hangs where the roll rate does not.
* Single samples far from both neighbours.
* Its largest or smallest value again and again, without a break: an end stop. Sensors of few different values are not judged.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from codriver.finding import Finding
from codriver.signals import Signal
from codriver.signals.grid import Flags
from codriver.signals.signal import Array

HANGING, TIMES = 1.0, 10.0  # s
USUAL, RESTING = 0.99, 0.9  # quantiles of the stretches; of a steer angle's
SLOWLY = {"steer_angle": 2.0, "longitudinal_speed": 5.0}  # s, of those that may well stay for a while
LEAST = 300  # samples
STRAIGHT = 0.06  # rad/s, sd of the roll rate while the steer angle rests
VALUES, AT_STOP, MANY, ROW = 50, 0.005, 0.03, 5  # different values; shares of the samples; samples in a row
SPIKE = 20.0  # times the usual distance of a sample from the mean of its neighbours
SPEED = "longitudinal_speed"


def still_findings(signals: Mapping[str, Signal], speed: Signal, moving: float, used: set[str]) -> list[Finding]:
    """Look for sensors that hang or are at their stop.

    Args:
        signals: of the log, by name.
        speed: longitudinal_speed.
        moving: m/s above which it moves.
        used: names of those that the estimate uses; the others are warned of.
    """
    findings = []
    for name, signal in signals.items():
        there = np.isfinite(signal.values)
        time, values = signal.time[there], signal.values[there]
        going = (values if name == SPEED else np.interp(time, speed.time, np.nan_to_num(speed.values))) > moving
        if going.sum() < LEAST:
            continue
        severity = "bad" if name in used else "warn"
        if np.ptp(values[going]) == 0:
            if name != SPEED:  # a treadmill's may well be constant
                findings.append(
                    Finding(
                        severity, f"{name} is {values[going][0]:.3g} all the time while it moves: a sensor that hangs?"
                    )
                )
            continue
        hangs = _hangs(name, time, values, going, severity)
        if hangs and name == "steer_angle" and "roll_rate" in signals:
            rate, (start, stop) = signals["roll_rate"], hangs[0].spans[0]
            if not np.nanstd(rate.values[(rate.time >= start) & (rate.time <= stop)]) > STRAIGHT:
                hangs = []
        findings += hangs
        if name != SPEED:
            findings += _stop(name, values, going, severity)
            findings += _spikes(name, values, going)
    return findings


def _hangs(name: str, time: Array, values: Array, going: Flags, severity: str) -> list[Finding]:
    """The longest stretch of one value beside the others."""
    tick = float(np.median(np.diff(time)))
    # A stretch ends with another value, a gap, or standing.
    ends = np.flatnonzero((np.diff(values) != 0) | (np.diff(time) > 3 * tick) | ~going[1:] | ~going[:-1]) + 1
    starts = np.concatenate([[0], ends])
    lengths = time[np.concatenate([ends, [time.size]]) - 1] - time[starts]
    where = int(np.argmax(lengths))
    share = RESTING if name == "steer_angle" else USUAL
    usual = float(np.quantile(np.delete(lengths, where), share)) + tick if lengths.size > 1 else tick
    if lengths[where] < max(SLOWLY.get(name, HANGING), TIMES * usual):
        return []
    start = float(time[starts[where]])
    return [Finding(
        severity, f"{name} is {values[starts[where]]:.3g} for {lengths[where]:.3g} s while it moves, where it stays for "
        f"{usual:.2g} s else: a sensor that hangs?", ((start, start + float(lengths[where])),),
    )]  # fmt: skip


def _stop(name: str, values: Array, going: Flags, severity: str) -> list[Finding]:
    """The largest or smallest value, in a row and often."""
    shown = values[going]
    if np.unique(shown).size < VALUES:
        return []
    for stop in (float(shown.max()), float(shown.min())):
        at = (shown == stop).astype(np.int8)
        edges = np.flatnonzero(np.diff(np.concatenate([[0], at, [0]])))
        longest = int(np.diff(edges)[::2].max())
        if longest >= ROW and at.mean() > AT_STOP:
            return [Finding(
                "bad" if severity == "bad" and at.mean() > MANY else "warn",
                f"{name} is at {stop:.3g} for {at.mean():.0%} of the time while it moves, and never beyond: the end of the "
                "sensor's range? What it should have shown there is missing in the estimate",
            )]  # fmt: skip
    return []


def _spikes(name: str, values: Array, going: Flags) -> list[Finding]:
    """Samples that stand out from their neighbours; of the speed the reader tells."""
    out = np.where(going[1:-1], values[1:-1] - 0.5 * (values[:-2] + values[2:]), 0.0)
    usual = 1.4826 * float(np.median(np.abs(out[going[1:-1]])))
    # A spike is half as far from its neighbours' means, on the other side; a coarse sensor's steps are no spikes.
    least = max(SPIKE * usual, float(values[going].std()))
    spikes = (np.abs(out) > least) & (np.abs(out) > 1.5 * np.maximum(np.abs(np.roll(out, 1)), np.abs(np.roll(out, -1))))
    count = int(spikes.sum())
    if usual == 0 or not 3 <= count < 0.05 * values.size:
        return []
    return [Finding(
        "warn", f"{name}: {count} single samples stand out from their neighbours by more than {SPIKE:g} times what is usual: "
        "spikes? They are used as they are",
    )]  # fmt: skip
