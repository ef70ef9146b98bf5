"""A driver who wants to be beside the path for a while, as round something that stands there.

y_wanted(t) = offset sin^2(pi (t - start) / length)
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np

from codriver.signals.signal import Array


@dataclass(frozen=True)
class Detour:
    """A way out and back.

    Attributes:
        start, length: s.
        offset: farthest, m, positive to the left.
    """

    start: float
    length: float
    offset: float


def wanted_offset(detours: tuple[Detour, ...], time: Array) -> Array:
    """How far beside the path the driver wants to be, m.

    Args:
        detours: their offsets add.
        time: s, shape (n,).
    """
    wanted = np.zeros(time.size)
    for one in detours:
        part = (time - one.start) / one.length
        wanted += np.where((part > 0) & (part < 1), one.offset * np.sin(pi * part) ** 2, 0.0)
    return wanted
