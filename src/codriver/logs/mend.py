"""Faults of a recorded signal: those that can be mended, and those that can only be told."""

from __future__ import annotations

import numpy as np

from codriver.signals import Signal
from codriver.signals.signal import Array

# A measured analogue signal that shows one value for this long while others move is called stuck.
STUCK_SECONDS = 5.0
_ANALOGUE = {"longitudinal_acceleration", "lateral_acceleration", "yaw_rate", "roll_rate", "pitch_rate"}


def mend_clock(time: Array, values: Array) -> tuple[Array, Array, list[str]]:
    """Make a clock run forward.

    Samples without a finite stamp are left out. Where time runs backwards for a few samples (two threads writing one
    file) they are sorted. Of several values with one stamp the last is kept.

    Returns:
        time, values, and a sentence for each kind of fault mended.
    """
    notes = []
    finite = np.isfinite(time)
    if not finite.all():
        notes.append(f"{int((~finite).sum())} samples without a time stamp left out")
        time, values = time[finite], values[finite]
    backwards = np.flatnonzero(np.diff(time) < 0)
    if backwards.size:
        worst = float((time[backwards] - time[backwards + 1]).max())
        notes.append(f"time runs backwards {backwards.size} times, by up to {worst:.3g} s; samples sorted by time")
        order = np.argsort(time, kind="stable")
        time, values = time[order], values[order]
    last = np.append(np.diff(time) > 0, True) if time.size else np.zeros(0, bool)
    if not last.all():
        notes.append(f"{int((~last).sum())} samples share a time stamp with the next; the last of each is kept")
        time, values = time[last], values[last]
    return time, values, notes


def find_faults(signal: Signal) -> list[str]:
    """Sentences on faults that are told but not mended: NaN, gaps, a stuck signal."""
    sentences = []
    name = f"{signal.name} ({signal.source})" if signal.source else signal.name
    bad = int((~np.isfinite(signal.values)).sum())
    if bad:
        sentences.append(f"{name}: {bad} of {len(signal)} values are not numbers; they are taken as missing")
    if len(signal) > 2 and signal.rate > 2:
        steps = np.diff(signal.time)
        long = np.flatnonzero(steps > max(1.0, 20 / signal.rate))
        if long.size:
            where = float(signal.time[long[np.argmax(steps[long])]])
            sentences.append(f"{name}: {long.size} gaps, the longest {steps[long].max():.3g} s at {where:.2f} s")
    if signal.name in _ANALOGUE and len(signal) > 2:
        change = np.flatnonzero(np.diff(signal.values) != 0)
        edges = np.concatenate([[signal.time[0]], signal.time[change + 1], [signal.time[-1]]])
        longest = np.diff(edges)
        if longest.max() > STUCK_SECONDS:
            where = float(edges[np.argmax(longest)])
            sentences.append(f"{name}: shows one value for {longest.max():.3g} s from {where:.2f} s on; stuck sensor?")
    return sentences
