"""A smoothed estimate, and an observer made to show what a smoother needs of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from codriver.estimate import Estimate
from codriver.observers.observer import Observer, Output, Scalars
from codriver.signals.signal import Array
from codriver.trust import Check, check_estimate

SECOND = 1.0  # s for which a filter was valid before its innovations are judged; until then they tell of its start


@dataclass(frozen=True, eq=False)
class SmoothedEstimate(Estimate):
    """An estimate that looks ahead. It is not causal, so there is no live form and no C of it.

    Attributes:
        lag: how far ahead it looks, s; None for the whole stretch.
        filter_valid: the flag `valid` of the filter that ran first, shape (n,): where its innovations can be judged.
    """

    lag: float | None
    filter_valid: Array = field(repr=False)

    def check(self) -> Check:
        """Whether to trust it: what the flags say, and the innovations since the filter was valid for a second."""
        ticks = np.arange(len(self.grid))
        unsettled = np.maximum.accumulate(np.where(self.filter_valid > 0.5, -ticks.size, ticks))
        judged = ticks - unsettled > SECOND / self.grid.dt
        columns = dict(self.columns)
        for row in self.innovations:
            columns[f"{row.row}_used"] = (row.used & judged).astype(np.float64)
        return check_estimate(columns, self.outputs, self.grid, self.measured, self.log, self._knob())


def with_memory(observer: Observer, shown: Sequence[str]) -> Observer:
    """The observer with these of its carried scalars among the outputs."""

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        new, out = observer.step(carry, u, y, ok, rho)
        return new, {**out, **{name: new[name] for name in shown}}

    return replace(observer, outputs=(*observer.outputs, *(Output(name, "", "input") for name in shown)), step=step)
