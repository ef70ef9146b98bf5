"""By how much a sensor's samples scatter, learnt while running, on scalars.

    var = var + ((y_k - 2 y_(k-1) + y_(k-2))^2 / 6 - var) / min(k + PRIOR, time / dt)

White noise of variance s^2 has second differences of 6 s^2; a signal that bends slowly against its sampling has next to none. A row
that comes rarely looks noisier than it is, which is the safe side. What is taken at the start counts for `PRIOR` samples.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from codriver.kernel import both, minimum, select
from codriver.observers.observer import Scalars

PRIOR = 10.0  # samples


def scatter_carry(start: Mapping[str, float]) -> dict[str, float]:
    """The carried scalars.

    Args:
        start: by row, the standard deviation taken until samples say another.
    """
    return {
        **{f"{kind}_{row}": 0.0 for row in start for kind in ("last", "older", "run")},
        **{f"scatter_{row}": sd * sd for row, sd in start.items()},
    }


def learn_scatter(carry: Scalars, rows: Sequence[str], y: Scalars, ok: Scalars, time: float, dt: float) -> Scalars:
    """The carry a tick later; `scatter_<row>` is the variance.

    Args:
        carry: of the tick before.
        rows: names of the rows.
        y, ok: measured values, and 1 where they are fresh.
        time: over which the mean goes, s.
        dt: tick, s.
    """
    new: Scalars = {}
    for row in rows:
        last, older, run, old = (carry[f"{kind}_{row}"] for kind in ("last", "older", "run", "scatter"))
        value = select(ok[row], y[row], last)
        bend = value - 2 * last + older
        full = both(ok[row], run > 1.5)
        weight = minimum(run + PRIOR, max(time / dt, 2.0 + PRIOR))
        new[f"scatter_{row}"] = select(full, old + (bend * bend * (1 / 6) - old) / weight, old)
        new[f"last_{row}"], new[f"older_{row}"] = value, select(ok[row], last, older)
        new[f"run_{row}"] = select(ok[row], minimum(run + 1.0, max(time / dt, 2.0)), run)
    return new
