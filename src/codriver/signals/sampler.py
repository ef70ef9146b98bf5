"""The only resampler: a causal hold of every channel onto a common tick.

At tick t_k = start + k dt a channel shows its newest finite value with stamp <= t_k. Two flags go with it:

* fresh_k: a finite value arrived in (t_{k-1}, t_k]. A measurement may be used once, on the tick it is fresh.
* held_k: the newest finite value is no older than the channel's hold time. An input may be used while it is held.

Of several values within one tick the newest counts. Values that are not finite do not exist. `sample` does this for whole
columns, `Sampler` value by value as they arrive on a bus; both give the same numbers, so batch equals live.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import inf, isfinite, nan

import numpy as np

from codriver.errors import LogError, UsageError
from codriver.names import VOCABULARY
from codriver.signals.grid import Flags, Grid
from codriver.signals.signal import Array, Signal

# Stamps are written in microseconds at best, and as seconds since 1970 a double has a grain of 0.24 us; a value this
# much after its tick belongs to it all the same.
TOLERANCE = 2e-6

# A day at 100 Hz. More is a clock gone wrong, and would fill the memory before anyone could say so.
MOST_TICKS = 10_000_000


@dataclass(frozen=True)
class Channel:
    """A channel of a sampler: its name, and for how many seconds its last value may be held."""

    name: str
    hold: float = 0.5

    @classmethod
    def named(cls, name: str) -> Channel:
        """The channel with the vocabulary's hold time."""
        return cls(name, VOCABULARY[name].hold if name in VOCABULARY else 0.5)


def sample(
    signals: Mapping[str, Signal],
    channels: Iterable[Channel],
    dt: float,
    *,
    start: float | None = None,
    stop: float | None = None,
) -> Grid:
    """Hold signals onto a tick; see the module's docstring.

    Args:
        signals: by name; a channel that is not among them is never fresh and never held.
        channels: what to sample.
        dt: tick, s.
        start, stop: first tick and bound of the last, s; by default the span of the channels that are there.

    Raises:
        UsageError: dt is not positive.
        LogError: the span holds more than MOST_TICKS ticks.
    """
    chosen = list(channels)
    if not (dt > 0 and isfinite(dt)):
        raise UsageError(f"a tick of {dt} s", "a positive number of seconds", "choose dt, such as 0.01")
    stamps = [signals[c.name].time for c in chosen if c.name in signals and len(signals[c.name])]
    first = start if start is not None else min((float(t[0]) for t in stamps), default=0.0)
    last = stop if stop is not None else max((float(t[-1]) for t in stamps), default=first - dt)
    count = int(np.floor((last - first) / dt + TOLERANCE / dt)) + 1 if last >= first else 0
    if count > MOST_TICKS:
        raise LogError(
            f"{count} ticks of {dt:g} s between {first:.10g} s and {last:.10g} s",
            f"at most {MOST_TICKS} ticks",
            "check the stamps of the log (mixed clocks?), cut it with Log.between, or choose a longer tick",
        )
    time: Array = first + dt * np.arange(count, dtype=np.float64)
    values: dict[str, Array] = {}
    fresh: dict[str, Flags] = {}
    held: dict[str, Flags] = {}
    for channel in chosen:
        signal = signals.get(channel.name)
        values[channel.name], fresh[channel.name], held[channel.name] = _hold(signal, channel.hold, time, dt)
    return Grid(time, dt, values, fresh, held)


def _hold(signal: Signal | None, hold: float, time: Array, dt: float) -> tuple[Array, Flags, Flags]:
    """One channel on the ticks: values, fresh, held."""
    nothing = np.full(time.size, nan), np.zeros(time.size, bool), np.zeros(time.size, bool)
    if signal is None or not time.size:
        return nothing
    finite = np.isfinite(signal.values)
    stamps, numbers = (signal.time, signal.values) if finite.all() else (signal.time[finite], signal.values[finite])
    if not stamps.size:
        return nothing
    newest = np.searchsorted(stamps, time + TOLERANCE, side="right") - 1
    there = newest >= 0
    index = np.maximum(newest, 0)
    previous = np.searchsorted(stamps, time[0] - dt + TOLERANCE, side="right") - 1
    fresh = np.diff(newest, prepend=previous) > 0
    held = there & (time - stamps[index] <= hold)
    return np.where(there, numbers[index], nan), fresh, held


class Sampler:
    """The same hold, value by value, for a live bus.

    Push values as they arrive; at each tick take `row`. Values pushed with a stamp after the tick wait for the next one
    (so `row(t)` may be called a little late).
    """

    def __init__(self, channels: Iterable[Channel], dt: float) -> None:
        self.channels = tuple(channels)
        self.dt = dt
        self._value = {c.name: nan for c in self.channels}
        self._stamp = {c.name: -inf for c in self.channels}
        self._taken = {c.name: -inf for c in self.channels}
        self._tick: float | None = None
        self._waiting: dict[str, list[tuple[float, float]]] = {c.name: [] for c in self.channels}

    def push(self, name: str, time: float, value: float) -> None:
        """Take one value of a channel; values that are not finite or of other channels are ignored."""
        if name in self._waiting and isfinite(value):
            self._waiting[name].append((time, value))

    def row(self, tick: float) -> tuple[dict[str, float], dict[str, bool], dict[str, bool]]:
        """Values, fresh flags and held flags at a tick, by channel name."""
        fresh: dict[str, bool] = {}
        held: dict[str, bool] = {}
        # The tick before, as it was given: tick - dt would round otherwise than the batch's own ticks do.
        previous = tick - self.dt if self._tick is None else self._tick
        self._tick = tick
        for channel in self.channels:
            name = channel.name
            later = []
            for stamp, value in self._waiting[name]:
                if stamp > tick + TOLERANCE:
                    later.append((stamp, value))
                elif stamp >= self._stamp[name]:
                    self._stamp[name], self._value[name] = stamp, value
            self._waiting[name] = later
            fresh[name] = self._stamp[name] > max(self._taken[name], previous + TOLERANCE)
            self._taken[name] = max(self._taken[name], self._stamp[name])
            held[name] = tick - self._stamp[name] <= channel.hold and self._stamp[name] > -inf
        return dict(self._value), fresh, held
