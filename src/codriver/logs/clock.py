"""Clocks that do not run forward, mended.

A recorder whose clock starts anew (two drives in one file), or leaps, does so for all its channels at one place. Where the
channels share a clock, as the columns of a table and the frames of a bus do, `one_run` therefore looks at that clock, and
all channels keep the same stretch. Looked at one by one, a channel with few samples would keep another stretch than its
neighbours: a gear of the second drive beside a speed of the first. `mend_clock` does the rest, channel by channel, and all
of it where each has a clock of its own.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from codriver.logs.wording import counted
from codriver.signals.grid import Flags
from codriver.signals.signal import Array

# A clock that steps back by more than this began anew; by less, samples merely swapped places. s.
RESTART = 1.0
# And one that leaps ahead by more than this is another clock, or another day. s.
LEAP = 3 * 3600.0


def mend_clock(time: Array, values: Array) -> tuple[Array, Array, list[str]]:
    """Make a clock run forward.

    Samples without a finite stamp are left out. Where time runs backwards a little (two threads writing one file) the
    samples are sorted. Where it runs backwards by more than `RESTART` the clock began anew (two drives in one file):
    the run that lasts longest is kept, since sorting would mix the drives. A single stamp that far off is no new clock;
    its sample is left out. Of several values with one stamp the last is kept.

    Returns:
        time, values, and a sentence for each kind of fault mended.
    """
    notes = []
    finite = np.isfinite(time)
    if not finite.all():
        notes.append(f"{counted(int((~finite).sum()), 'sample')} without a time stamp left out")
        time, values = time[finite], values[finite]
    kept, told = one_run(time)
    notes += told
    if told:
        time, values = time[kept], values[kept]
    backwards = np.flatnonzero(np.diff(time) < 0)
    if backwards.size:
        worst = float((time[backwards] - time[backwards + 1]).max())
        often = "once, by" if backwards.size == 1 else f"{backwards.size} times, by up to"
        notes.append(f"time runs backwards {often} {worst:.3g} s; samples sorted by time")
        order = np.argsort(time, kind="stable")
        time, values = time[order], values[order]
    last = np.append(np.diff(time) > 0, True) if time.size else np.zeros(0, bool)
    if not last.all():
        double = counted(int((~last).sum()), "sample", "shares", "share")
        notes.append(f"{double} a time stamp with the next; the last of each is kept")
        time, values = time[last], values[last]
    return time, values, notes


def shared_run(time: Array, channels: Iterable[Flags | npt.NDArray[np.signedinteger]]) -> tuple[Flags, list[str]]:
    """Which stamps of a clock that several channels share belong to the run that is kept.

    Channels that follow each other in a file, each from its own beginning, make the clock start anew too, and none of
    them does so itself: then all is kept.

    Args:
        time: in the order of the file, shape (n,); those that are not finite are kept, for `mend_clock` to tell.
        channels: for each channel the places in `time` where it has a sample.

    Returns:
        flags of shape (n,), and sentences as of `one_run`.
    """
    finite = np.isfinite(time)
    if not breaks(time[finite]).size or not any(breaks(time[rows][finite[rows]]).size for rows in channels):
        return np.ones(time.size, bool), []
    kept = ~finite
    kept[finite], notes = one_run(time[finite])
    return kept, notes


def one_run(time: Array) -> tuple[Flags, list[str]]:
    """Which stamps belong to the run of a clock that is kept, and sentences on those that do not.

    Args:
        time: finite, in the order of the file, shape (n,).

    Returns:
        flags of shape (n,), all True where there are no sentences.
    """
    notes = []
    kept = np.ones(time.size, bool)
    if (np.diff(time) < -RESTART).any():
        astray = _astray(time)
        if astray.any():
            shown = ", ".join(f"{stamp:.10g}" for stamp in time[astray][:3]) + (", ..." if astray.sum() > 3 else "")
            notes.append(
                f"{counted(int(astray.sum()), 'sample')} with a stamp far from its neighbours' left out ({shown} s)"
            )
            kept[astray] = False
    places = np.flatnonzero(kept)
    time = time[kept]
    if breaks(time).size:
        runs = np.split(np.arange(time.size), breaks(time) + 1)
        joined = _joined(time, runs)
        left = [_span(time[run]) for run in runs if not np.isin(run[0], joined)]
        notes.append(
            f"the clock starts anew or leaps {counted(len(runs) - 1, 'time')}, as where drives are joined in one "
            f"file: the longest run, {_span(time[joined])}, is kept; left out: {', '.join(left[:4])}"
            + (f" and {len(left) - 4} more" if len(left) > 4 else "")
        )
        kept[:] = False
        kept[places[joined]] = True
    return kept, notes


def breaks(time: Array) -> npt.NDArray[np.intp]:
    """Indices after which the clock starts anew or leaps."""
    steps = np.diff(time)
    return np.flatnonzero((steps < -RESTART) | (steps > LEAP))


def _joined(time: Array, runs: list[npt.NDArray[np.intp]]) -> npt.NDArray[np.intp]:
    """The longest run, with those before and after it that its clock goes on from (a stretch between had another clock)."""
    longest = max(range(len(runs)), key=lambda k: float(np.ptp(time[runs[k]])))
    kept = [runs[longest]]
    for run in runs[longest + 1 :]:
        if 0 < time[run[0]] - time[kept[-1][-1]] < LEAP:
            kept.append(run)
    for run in reversed(runs[:longest]):
        if 0 < time[kept[0][0]] - time[run[-1]] < LEAP:
            kept.insert(0, run)
    return np.concatenate(kept)


def _astray(time: Array) -> Flags:
    """Single stamps more than `RESTART` before or after both neighbours, which are themselves in order."""
    astray = np.zeros(time.size, bool)
    before, it, after = time[:-2], time[1:-1], time[2:]
    astray[1:-1] = (after >= before) & ((it < before - RESTART) | (it > after + RESTART))
    return astray


def _span(time: Array) -> str:
    """From the first to the last stamp, for messages."""
    return f"{time.min():.10g} to {time.max():.10g} s"
