"""Faults of a recorded signal: those that can be mended, and those that can only be told; its clock is another matter."""

from __future__ import annotations

from collections.abc import Sequence
from math import isinf

import numpy as np
import numpy.typing as npt

from codriver.logs.wording import counted
from codriver.names import VOCABULARY
from codriver.signals import Signal

# A measured analogue signal that shows one value for this long while others move is called stuck.
STUCK_SECONDS = 5.0
# Values out of range that a bus sends for "not valid" are few different ones; a wrong unit gives many.
CODES_AT_MOST = 3
# A clock that is this far from the others' is another clock, and no pause.
OTHER_CLOCK = 3600.0
LATE = 2.0  # s
ABSURD = 10.0  # times the largest value that the quantity can plausibly have
REST_PRESSURE = 0.3e5  # Pa
# A speed that differs more than this from the samples before and after it, to the same side, is a wrong sample: m/s^2, m/s.
LEAPING, GRAIN = 30.0, 0.5
_ANALOGUE = {"longitudinal_acceleration", "lateral_acceleration", "yaw_rate", "roll_rate", "pitch_rate"}


def drop_codes(signal: Signal) -> tuple[Signal, list[str]]:
    """Take values that mean "not valid" as missing.

    Buses send numbers such as 15 for an unknown gear or the largest one for a sensor that is not ready. Such values lie
    out of the quantity's range and are always the same ones. Different values out of range are a wrong unit or a crash
    instead, and stay; `Log.implausible` tells them where they are many. That takes the whole log to judge; on a live bus
    (`codriver.live.BusDecoder`) every value out of range is left out.

    Returns:
        the signal with NaN in their place, and a sentence if there were any.
    """
    entry = VOCABULARY.get(signal.name)
    if entry is None or not len(signal):
        return signal, []
    outside = (signal.values < entry.low) | (signal.values > entry.high)
    share = float(outside.mean())
    if share == 0:
        return signal, []
    absurd = np.abs(signal.values) > ABSURD * max(abs(entry.low), abs(entry.high))
    if 0 < absurd.mean() < 0.01:
        rest, said = drop_codes(_without(signal, absurd))
        largest = float(np.nanmax(np.abs(signal.values[absurd])))
        often = counted(int(absurd.sum()), "value")
        told = f"{_named(signal)}: {often} of up to {largest:g} {entry.unit}, which no vehicle shows; taken as missing"
        return rest, [told, *said]
    codes = np.unique(signal.values[outside])
    seldom = codes.size > 1 and int(outside.sum()) < 2 * codes.size
    if share >= 0.5 or codes.size > CODES_AT_MOST or seldom:
        return signal, []
    shown = ", ".join(f"{code:g}" for code in codes)
    unit = "" if entry.unit == "1" else f" {entry.unit}"
    sentence = (
        f"{_named(signal)}: {int(outside.sum())} of {len(signal)} values are {shown}{unit}, out of "
        f"{entry.low:g} to {entry.high:g}{unit}: the code for 'not valid'? They are taken as missing"
    )
    return _without(signal, outside), [sentence]


def _without(signal: Signal, where: npt.NDArray[np.bool_]) -> Signal:
    """The signal with NaN in some places."""
    return Signal(signal.name, signal.time, np.where(where, np.nan, signal.values), signal.unit, signal.source)


def compare_clocks(signals: Sequence[Signal]) -> tuple[list[Signal], list[str]]:
    """Look at the signals' clocks together: signals without a number, on another clock, or late.

    A signal that has no number at all, or whose stamps are more than an hour from those of the majority, is left out:
    it cannot be set against the others.

    Returns:
        the signals kept, and a sentence on each that is wrong.
    """
    sentences = [f"{_named(s)}: holds no number; it is left out" for s in signals if not np.isfinite(s.values).any()]
    kept = [s for s in signals if np.isfinite(s.values).any()]
    groups: list[list[Signal]] = []
    end = -np.inf
    for signal in sorted(kept, key=lambda s: float(s.time[0])):
        if not groups or signal.time[0] > end + OTHER_CLOCK:
            groups.append([])
        groups[-1].append(signal)
        end = max(end, float(signal.time[-1])) if len(groups[-1]) > 1 else float(signal.time[-1])
    if len(groups) > 1:
        main = max(groups, key=len)
        tie = sum(len(group) == len(main) for group in groups) > 1
        for signal in (s for group in groups if group is not main or tie for s in group):
            others = min(float(s.time[0]) for group in groups if signal not in group for s in group)
            sentences.append(
                f"{_named(signal)}: its stamps go from {signal.time[0]:.10g} to {signal.time[-1]:.10g} s, others begin at "
                f"{others:.10g} s: another clock" + ("" if tie else "; it is left out")
            )
        if not tie:
            kept = [s for s in kept if s in main]
        else:
            return kept, sentences
    start = min((float(s.time[0]) for s in kept), default=0.0)
    stop = max((float(s.time[-1]) for s in kept), default=0.0)
    for signal in kept:
        if isinf(VOCABULARY[signal.name].hold):
            continue  # sent on change: may come late
        finite = signal.time[np.isfinite(signal.values)]
        if finite[0] - start > LATE:
            sentences.append(f"{_named(signal)}: begins {finite[0] - start:.1f} s after the first of the signals")
        if stop - finite[-1] > LATE:
            sentences.append(f"{_named(signal)}: ends {stop - finite[-1]:.1f} s before the last of the signals")
    return kept, sentences


def _named(signal: Signal) -> str:
    """Standard name and source, for messages."""
    return named(signal.name, signal.source)


def named(name: str, source: str) -> str:
    """A signal for messages: "gear (Gearbox.TCU_Gear)"; the source alone says no more where it is the same."""
    return f"{name} ({source})" if source and source != name else name


def find_faults(signal: Signal) -> list[str]:
    """Sentences on faults that are told but not mended: NaN, gaps, a stuck signal, a pressure that never falls to 0."""
    sentences = []
    name = _named(signal)
    bad = int((~np.isfinite(signal.values)).sum())
    if 0 < bad < len(signal):
        sentences.append(f"{name}: {bad} of {len(signal)} values are not numbers; they are taken as missing")
    if len(signal) > 2 and signal.rate > 2:
        steps = np.diff(signal.time)
        long = np.flatnonzero(steps > max(1.0, 20 / signal.rate))
        if long.size:
            where = float(signal.time[long[np.argmax(steps[long])]])
            sentences.append(
                f"{name}: {counted(long.size, 'gap')}, the longest {steps[long].max():.3g} s at {where:.2f} s"
            )
    if signal.name in _ANALOGUE and len(signal) > 2:
        # A stretch ends a tick after its last sample: a gap after it is told as a gap.
        change = np.flatnonzero(np.diff(signal.values) != 0)
        edges = signal.time[np.concatenate([[0], change + 1])]
        longest = signal.time[np.concatenate([change, [len(signal) - 1]])] - edges + 1 / signal.rate
        if longest.max() > STUCK_SECONDS:
            where = float(edges[np.argmax(longest)])
            sentences.append(f"{name}: shows one value for {longest.max():.3g} s from {where:.2f} s on; stuck sensor?")
    if signal.name == "longitudinal_speed":
        sentences += _leaping(signal)
    finite = signal.values[np.isfinite(signal.values)]
    if (
        signal.name == "brake_pressure"
        and signal.duration > 20
        and (rest := float(np.quantile(finite, 0.02))) > REST_PRESSURE
    ):
        sentences.append(
            f"{name}: never falls below {rest / 1e5:.2g} bar, so the brake seems pressed all the time; if that is the sensor's "
            "rest value, subtract it: offset in the names file, in the source's unit"
        )
    return sentences


def _leaping(signal: Signal) -> list[str]:
    """A sentence if single samples of a speed stand out from both neighbours by more than any vehicle changes it."""
    there = np.isfinite(signal.values)
    time, values = signal.time[there], signal.values[there]
    steps, allowed = np.diff(values), LEAPING * np.diff(time) + GRAIN
    single = (np.abs(steps[:-1]) > allowed[:-1]) & (np.abs(steps[1:]) > allowed[1:]) & (steps[:-1] * steps[1:] < 0)
    count = int(single.sum())
    if not count:
        return []
    worst = int(np.argmax(np.where(single, np.abs(steps[:-1]), 0.0)))
    return [
        f"{_named(signal)}: {counted(count, 'single sample', 'stands', 'stand')} out from the neighbours, by up to "
        f"{abs(steps[worst]):.3g} m/s at {time[worst + 1]:.2f} s, as no vehicle does; used as they are: take them out of the "
        "recording before (docs/trust.md shows how)"
    ]
