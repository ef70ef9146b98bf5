"""Is a drive like those a driver was learnt from? By what his errors on it are beside those on blocks he had not seen."""

from __future__ import annotations

import numpy as np

from codriver.drivers.learned.learned_driver import LearnedDriver, TorquePrediction
from codriver.finding import Finding

_STRANGE = 0.85  # share inside the 95 % band below which a drive does not look like this driver's


def doubts_of(driver: LearnedDriver, made: TorquePrediction) -> list[Finding]:
    """Why a drive is unlike those learnt from; empty where it is like them, or its torque is not known.

    Args:
        driver: who foretold.
        made: what, beside the torques that came.
    """
    there = np.isfinite(made.measured)
    if not there.any():
        return []
    found = []
    inside = float(np.mean(((made.measured >= made.low) & (made.measured <= made.high))[there]))
    if inside < _STRANGE:
        found.append(Finding("bad", f"{inside:.0%} of the torques lie in the 95 % band: {_WHY}"))
    rmse, stays = (float(np.sqrt(np.mean(e[there] ** 2))) for e in (made.error, made.measured - made.last))
    own, own_stays = (driver.training.get(name, np.nan) for name in ("held_out_rmse", "held_out_stays_rmse"))
    # Who was no better than that on his own drives says nothing by it.
    if rmse > stays and not own >= own_stays:
        found.append(Finding("bad", f"worse than 'the torque stays', {rmse:.3f} against {stays:.3f} N m: {_WHY}"))
    return found


_WHY = "the drive is unlike those learnt from (another driver or car, a wrong unit or sign?)"
