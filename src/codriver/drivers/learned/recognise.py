"""Which of several stored drivers is this? By how likely each finds the torques of a drive.

    l_d = mean over the drive of log p(T(t_k + h) | z_k, driver d)          the same rows for all

Neighbouring rows are nearly copies, so confidence is not the product of all densities, which would be certain of anything: blocks
of 10 s are drawn with replacement, and the share of draws in which a driver is the likeliest is what is told. And the likeliest of
several strangers is still a stranger: a driver is "like his own" only if the errors on this drive look like those of his own
held-out blocks (`likeness`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from codriver.drivers.learned.evaluate import block_means
from codriver.drivers.learned.learned_driver import LearnedDriver
from codriver.drivers.learned.likeness import doubts_of
from codriver.errors import LogError, UsageError
from codriver.signals import Log

DRAWS = 2000
LEAST_BLOCKS = 6


@dataclass(frozen=True)
class Likeness:
    """How well a driver explains a drive.

    Attributes:
        name, kind: of the driver.
        log_density: mean a row.
        behind: of the likeliest, less this one, mean a row; with its 95 % interval.
        behind_low, behind_high: of that.
        share: of the draws in which this one is the likeliest.
        rmse: N m.
        inside95: share of the torques in the driver's 95 % band.
        like_own: whether that is what his own drives would give.
    """

    name: str
    kind: str
    log_density: float
    behind: float
    behind_low: float
    behind_high: float
    share: float
    rmse: float
    inside95: float
    like_own: bool


def recognise(log: Log, drivers: Sequence[LearnedDriver], *, seed: int = 0) -> list[Likeness]:
    """Hold a drive against drivers, the likeliest first.

    Args:
        log: the drive.
        drivers: two or more, learnt under the same features.
        seed: of the draws.

    Raises:
        UsageError: fewer than two drivers, two of one name, or drivers that foretell different things.
        MissingSignal: the drive lacks a signal of a driver.
        LogError: the drive is too short.
    """
    _refuse_unlike(drivers)
    tables = [d.table(log) for d in drivers]
    # Drivers may use different signals; only moments that all can tell of are compared.
    common = np.unique(np.round(tables[0].time, 6))
    for table in tables[1:]:
        common = np.intersect1d(common, np.round(table.time, 6))
    density, errors, inside, like = [], [], [], []
    time = common
    for driver, table in zip(drivers, tables, strict=True):
        made = driver.predict_table(table)
        rows = np.isin(np.round(made.time, 6), common)
        density.append(made.log_density[rows])
        errors.append(made.error[rows])
        inside.append(float(np.mean((made.measured >= made.low) & (made.measured <= made.high))))
        like.append(not doubts_of(driver, made))
    drive = np.zeros(time.size, int)
    blocks = np.stack([block_means(d, time, drive) for d in density]) if time.size else np.empty((len(drivers), 0))
    if blocks.shape[1] < LEAST_BLOCKS:
        raise LogError(
            f"{log.source or 'the drive'} holds {blocks.shape[1]} blocks of 10 s that all drivers can tell of",
            f"{LEAST_BLOCKS} or more", "give a longer drive",
        )  # fmt: skip
    rng = np.random.default_rng(seed)
    drawn = blocks[:, rng.integers(0, blocks.shape[1], (DRAWS, blocks.shape[1]))].mean(axis=2)
    shares = np.bincount(drawn.argmax(axis=0), minlength=len(drivers)) / DRAWS
    means = blocks.mean(axis=1)
    best = int(means.argmax())
    found = []
    for k, driver in enumerate(drivers):
        low, high = np.quantile(drawn[best] - drawn[k], [0.025, 0.975])
        found.append(
            Likeness(
                driver.name, driver.kind, float(means[k]), float(means[best] - means[k]), float(low), float(high),
                float(shares[k]), float(np.sqrt(np.mean(errors[k] ** 2))), inside[k], like[k],
            )
        )  # fmt: skip
    return sorted(found, key=lambda one: -one.log_density)


def _refuse_unlike(drivers: Sequence[LearnedDriver]) -> None:
    """Raise unless the drivers can be compared."""
    if len(drivers) < 2:
        raise UsageError(f"{len(drivers)} driver", "two or more", "name more driver files")
    names = [d.name for d in drivers]
    if len(set(names)) < len(names):
        raise UsageError(f"two drivers are named {max(names, key=names.count)}", "names that differ", "fit with --name")
    asked = {
        (d.target, d.protocol.features.horizon, d.protocol.features.tick, d.protocol.features.smooth_target)
        for d in drivers
    }
    if len(asked) > 1:
        what = "; ".join(
            f"{d.name}: {d.target} {d.protocol.features.horizon:g} s ahead, {d.protocol.name}" for d in drivers
        )
        raise UsageError(f"drivers that foretell different things ({what})", "the same for all", "fit them alike")
