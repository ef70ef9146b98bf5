"""A log: signals by standard name, each on its own clock."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from codriver.errors import MissingSignal
from codriver.names import VOCABULARY, nearest
from codriver.signals.grid import Grid
from codriver.signals.sampler import Channel, sample
from codriver.signals.signal import Signal


@dataclass(frozen=True, eq=False)
class Log(Mapping[str, Signal]):
    """Signals by standard name, each on its own clock. Never changed in place.

    Attributes:
        signals: by standard name.
        source: the file or folder it was read from.
        faults: what was wrong with the recording and could be mended or left out, one sentence each.
        unmapped: names the source has and the log does not, for whoever writes a names file.
    """

    signals: Mapping[str, Signal]
    source: str = ""
    faults: tuple[str, ...] = ()
    unmapped: tuple[str, ...] = field(default=(), repr=False)

    @classmethod
    def of(cls, signals: Iterable[Signal], source: str = "", faults: tuple[str, ...] = ()) -> Log:
        """A log of the signals given, by their names."""
        return cls({signal.name: signal for signal in signals}, source, faults)

    def __getitem__(self, name: str) -> Signal:
        try:
            return self.signals[name]
        except KeyError:
            near = nearest(name, self.signals)
            raise MissingSignal(
                f"the log {self.source or '(in memory)'} has no signal '{name}'",
                f"one of: {', '.join(sorted(self.signals)) or '(none)'}",
                f"did you mean {near}?" if near else "map it in a names file, or use an estimator that does without it",
            ) from None

    def __contains__(self, name: object) -> bool:
        return name in self.signals

    def __iter__(self) -> Iterator[str]:
        return iter(self.signals)

    def __len__(self) -> int:
        return len(self.signals)

    @property
    def start(self) -> float:
        """The first stamp of any signal, s."""
        return min((float(s.time[0]) for s in self.signals.values() if len(s)), default=0.0)

    @property
    def stop(self) -> float:
        """The last stamp of any signal, s."""
        return max((float(s.time[-1]) for s in self.signals.values() if len(s)), default=0.0)

    def with_signals(self, *signals: Signal) -> Log:
        """A log that also has these signals; those of the same name are replaced."""
        return Log({**self.signals, **{s.name: s for s in signals}}, self.source, self.faults, self.unmapped)

    def without(self, *names: str) -> Log:
        """A log that lacks these signals."""
        kept = {name: signal for name, signal in self.signals.items() if name not in names}
        return Log(kept, self.source, self.faults, self.unmapped)

    def between(self, start: float, stop: float) -> Log:
        """The part of every signal with start <= time < stop."""
        return Log(
            {n: s.between(start, stop) for n, s in self.signals.items()}, self.source, self.faults, self.unmapped
        )

    def sample(
        self, channels: Iterable[str | Channel], dt: float, *, start: float | None = None, stop: float | None = None
    ) -> Grid:
        """The signals on a common tick by causal hold; see `codriver.signals.sampler` for the definition.

        Channels that the log lacks are columns of NaN whose flags are all False.

        Args:
            channels: standard names, or `Channel`s with a hold time of their own.
            dt: tick, s.
            start, stop: first and last tick, s; by default the span of the channels that are there.
        """
        chosen = [c if isinstance(c, Channel) else Channel.named(c) for c in channels]
        return sample(self.signals, chosen, dt, start=start, stop=stop)

    def implausible(self) -> list[str]:
        """A sentence for each signal most of which lies outside the range its quantity can have."""
        sentences = []
        for name, signal in self.signals.items():
            entry = VOCABULARY.get(name)
            finite = signal.values[np.isfinite(signal.values)]
            if entry is None or not finite.size:
                continue
            outside = float(np.mean((finite < entry.low) | (finite > entry.high)))
            if outside > 0.01:
                unit = "" if entry.unit == "1" else f" {entry.unit}"
                sentences.append(
                    f"{name}: {outside:.0%} of the samples lie outside {entry.low:g} to {entry.high:g}{unit} "
                    f"(found {finite.min():.4g} to {finite.max():.4g}); {_likely(name, float(finite.max()))}"
                )
        return sentences


def _likely(name: str, highest: float) -> str:
    """What is probably wrong with a signal that reaches `highest` and should not."""
    if name == "gear":
        return "gears are -1, 0, 1, 2, ...; positions of a selector (P, R, N, D) and codes are none"
    if name == "accelerator_pedal" and 95 < highest <= 105:
        return 'percent? then unit = "%" in the names file'
    if name in ("accelerator_pedal", "clutch") and highest > 105:
        return "counts? then scale = 1 / (the count of the pedal fully pressed) in the names file"
    if name == "brake_pressure":
        return 'is its unit right in the names file ("bar", "kPa", "Pa")?'
    return "is its unit right in the names file?"
