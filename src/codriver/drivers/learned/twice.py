"""One recording given twice: held out and learnt from at once, it would make any model look good.

a, b the same:  torques equal at 99 % of the common moments at which a's changes, these half of the shorter one's or more
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations

import numpy as np

from codriver.drivers.learned.features import target_of
from codriver.errors import UsageError
from codriver.signals import Log, Signal

_EQUAL, _COMMON, _LEAST = 0.99, 0.5, 50
_SINCE_1970 = 1e8  # s; clocks that begin with a recording do not count so far


def refuse_twice(drives: Mapping[str, Log]) -> None:
    """Raise if two drives are one recording, or one a part of the other.

    Args:
        drives: by name.

    Raises:
        MissingSignal: a drive has no torque.
        UsageError: two are the same.
    """
    name = target_of(list(drives.values()))
    for one, other in combinations(drives, 2):
        if _same(drives[one][name], drives[other][name]):
            raise UsageError(
                f"{one} and {other} are the same recording, or parts of it", "drives that share no moment",
                "leave one out: what is learnt from must not be judged",
            )  # fmt: skip


def _same(a: Signal, b: Signal) -> bool:
    """Whether two torques are of one recording."""
    if min(a.time.size, b.time.size) == 0:
        return False
    shared = min(a.time[-1], b.time[-1]) - max(a.time[0], b.time[0])
    shorter = min(a.time[-1] - a.time[0], b.time[-1] - b.time[0])
    if min(a.time[0], b.time[0]) > _SINCE_1970 and shared > _COMMON * shorter:
        return True
    _, mine, its = np.intersect1d(np.round(a.time, 6), np.round(b.time, 6), return_indices=True)
    if mine.size < max(_COMMON * min(a.time.size, b.time.size), 2):
        return False
    x, y = a.values[mine], b.values[its]
    moving = np.flatnonzero(np.diff(x) != 0) + 1
    moving = moving[np.isfinite(x[moving])]
    return bool(moving.size >= _LEAST and np.mean(x[moving] == y[moving]) >= _EQUAL)
