"""A live session: values in as they arrive, an estimate out at every tick.

It is the batch's own Sampler and the batch's own machine code, so a drive played back through it gives the bits of
`Program.run` over the same drive.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from codriver.program import Program
from codriver.signals import Channel, Sampler
from codriver.signals.sampler import TOLERANCE


@dataclass(frozen=True)
class Tick:
    """What the observer says at one tick.

    Attributes:
        time: of the tick, s.
        values: outputs by name.
    """

    time: float
    values: dict[str, float]


class Live:
    """A running observer.

        live = Live(program)
        live.push("longitudinal_speed", stamp, 13.2)      # standard names, SI units
        for tick in live.advance(now): ...

    The first tick is at the first measurement pushed, as in a batch run.

    Attributes:
        stepper: the program's stepper; `stepper.save()` keeps the state.
    """

    def __init__(self, program: Program) -> None:
        observer = program.observer
        self.stepper = program.live()
        self._channels, self._flags = observer.channels, observer.flags
        self._starts = frozenset(observer.measured or observer.required)
        self._dt = observer.dt
        self._sampler = Sampler([Channel.named(name) for name in observer.channels], observer.dt)
        self._start: float | None = None
        self._count = 0

    def push(self, name: str, time: float, value: float) -> None:
        """Take one value. Values of signals that the observer does not use, and NaN, are ignored.

        Args:
            name: standard name.
            time: stamp, s; of one signal not decreasing.
            value: in SI units.
        """
        if self._start is None and name in self._starts:
            self._start = time
        self._sampler.push(name, time, value)

    def advance(self, now: float) -> Iterator[Tick]:
        """All ticks that are due: those at or before `now`, s. Values stamped later wait for their tick."""
        while (tick := self._next()) is not None and tick <= now:
            yield self._step(tick)

    def advance_before(self, stamp: float) -> Iterator[Tick]:
        """All ticks to which a value with this stamp, s, comes too late; call it before pushing the value."""
        while (tick := self._next()) is not None and tick + TOLERANCE < stamp:
            yield self._step(tick)

    def _next(self) -> float | None:
        return None if self._start is None else self._start + self._dt * self._count

    def _step(self, tick: float) -> Tick:
        row, fresh, held = self._sampler.row(tick)
        ok = [(fresh if flag.kind == "fresh" else held)[flag.channel] for flag in self._flags]
        out = self.stepper([*[row[name] for name in self._channels], *ok])
        self._count += 1
        return Tick(tick, dict(zip(self.stepper.outputs, out, strict=True)))
