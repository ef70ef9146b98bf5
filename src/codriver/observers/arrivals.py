"""Which measurements have come lately, on scalars: for filters that start once all are there, and start anew after a gap.

Sensors on a bus seldom come on the same tick. Each is remembered with the time since it came.
"""

from __future__ import annotations

from collections.abc import Sequence

from codriver.kernel import Scalar, both, minimum, select
from codriver.observers.observer import Scalars

NEVER = 1e3  # s


def arrivals_carry(names: Sequence[str]) -> dict[str, float]:
    """The carried scalars.

    Args:
        names: of the measurements.
    """
    return {**{f"latest_{name}": 0.0 for name in names}, **{f"since_{name}": NEVER for name in names}}


def note_arrivals(carry: Scalars, names: Sequence[str], values: Scalars, ok: Scalars, dt: float) -> Scalars:
    """The carry a tick later: `latest_<name>`, and `since_<name>`, s since it came, 0 where it is fresh.

    Args:
        carry: of the tick before.
        names: of the measurements.
        values, ok: what came, and 1 where it did.
        dt: tick, s.
    """
    new: Scalars = {}
    for name in names:
        new[f"latest_{name}"] = select(ok[name], values[name], carry[f"latest_{name}"])
        new[f"since_{name}"] = select(ok[name], 0.0, minimum(carry[f"since_{name}"] + dt, NEVER))
    return new


def all_came(noted: Scalars, names: Sequence[str], within: float) -> Scalar:
    """1 where each came within so many seconds.

    Args:
        noted: by `note_arrivals`.
        names: of the measurements.
        within: s.
    """
    total: Scalar = 1.0
    for name in names:
        total = both(total, noted[f"since_{name}"] < within)
    return total
