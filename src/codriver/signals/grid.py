"""Signals on a common tick."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from codriver.signals.signal import Array

Flags = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Grid:
    """Signals held onto a common tick.

    Attributes:
        time: ticks, s, shape (n,): time[k] = start + k * dt.
        dt: tick, s.
        values: by channel, shape (n,): the newest value at or before the tick; NaN before the first.
        fresh: by channel, shape (n,): True where a value arrived in (time[k] - dt, time[k]].
        held: by channel, shape (n,): True where the newest value is no older than the channel's hold time.
    """

    time: Array
    dt: float
    values: Mapping[str, Array]
    fresh: Mapping[str, Flags]
    held: Mapping[str, Flags]

    def __len__(self) -> int:
        return self.time.size
