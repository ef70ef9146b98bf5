"""Why a drive gives no row of features: which of the conditions on a row it never fulfils.

(ell - 1) dt + h seconds in a row        all signals there, none older than its hold time        faster than the least speed
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from codriver.drivers.learned.feature_setting import FeatureSetting
from codriver.finding import Finding
from codriver.signals import Channel, Log, Signal

if TYPE_CHECKING:
    from codriver.drivers.learned.features import FeatureTable


def needed(setting: FeatureSetting) -> float:
    """How long a drive must go on for a row, s."""
    return (setting.history - 1) * setting.dt + setting.horizon


def rowless(drives: Mapping[str, Log], table: FeatureTable, setting: FeatureSetting) -> list[Finding]:
    """Drives of a table that gave no row, and why.

    Args:
        drives: by name, in the table's order.
        table: rows of the others.
        setting: of its features.
    """
    names = tuple(dict.fromkeys((table.target, *(f.signal for f in table.features))))
    return [
        Finding("bad", f"{name} gives no row to learn from: {why_no_row(log, setting, names)}")
        for k, (name, log) in enumerate(drives.items())
        if not np.any(table.drive == k)
    ]


def why_no_row(log: Log, setting: FeatureSetting, names: Sequence[str]) -> str:
    """What a drive without a row lacks, in words.

    Args:
        log: the drive; has the signals.
        setting: of the features.
        names: of the signals that a row needs.
    """
    silent = [name for name in names if np.isfinite(log[name].values).sum() < 2]
    if silent:
        return f"{', '.join(silent)} has fewer than two values"
    span = max(log[n].time[-1] for n in names) - min(log[n].time[0] for n in names)
    if span < needed(setting):
        return f"it lasts {span:.3g} s by its clock, which a wrong unit of time would explain"
    every = {name: interval(log[name]) for name in names}
    slow = {name: seconds for name, seconds in every.items() if seconds > Channel.named(name).hold}
    if slow and len(slow) == len(names):
        return (
            f"its signals come every {min(slow.values()):.3g} s or less often, which a wrong unit of time would explain"
        )
    if slow:
        told = ", ".join(f"{n} comes every {s:.3g} s" for n, s in slow.items())
        hold = min(Channel.named(name).hold for name in slow)
        return f"{told}: too slow, as a value counts for {hold:g} s"
    grid = log.sample(list(names), setting.tick)
    held = {name: np.asarray(grid.held[name], dtype=bool) for name in names}
    if "longitudinal_speed" in names and setting.slowest > 0:
        fastest = float(np.abs(log["longitudinal_speed"].values[np.isfinite(log["longitudinal_speed"].values)]).max())
        if fastest < setting.slowest:
            return f"the vehicle never goes faster than {fastest:.3g} m/s: standing still, or a wrong unit of speed"
    least = min(held, key=lambda name: float(held[name].mean()))
    longest = _longest(np.all(list(held.values()), axis=0)) * setting.tick
    if longest < needed(setting):
        missing = f"{least} is missing most, in {1 - held[least].mean():.0%}"
        return f"all signals are there for {longest:.3g} s in a row at most; {missing}"
    return "while all signals are there, the vehicle hardly moves or the road ahead ends"


def interval(signal: Signal) -> float:
    """Median time between a signal's values, two or more, s."""
    return float(np.median(np.diff(signal.time[np.isfinite(signal.values)])))


def _longest(good: np.ndarray) -> int:
    """Length of the longest run of True."""
    edges = np.flatnonzero(np.diff(np.r_[0, good.astype(np.int8), 0]))
    return int((edges[1::2] - edges[::2]).max(initial=0))
