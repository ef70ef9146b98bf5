"""A learned driver: from drives to a value that foretells the torque, with a band.

    fit_driver(drives) -> LearnedDriver          driver.predict(log) -> TorquePrediction

What it was learnt from, and how it did on blocks it had not seen, goes with it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from codriver.drivers.learned.calibration import Calibration
from codriver.drivers.learned.features import Feature, FeatureTable, Index, features_of
from codriver.drivers.learned.kinds import DEFAULT, regressor_of
from codriver.drivers.learned.protocol import Fold, Protocol, time_blocks
from codriver.drivers.learned.regressor import TorqueRegressor
from codriver.drivers.learned.scaling import Scaling
from codriver.drivers.learned.twice import refuse_twice
from codriver.errors import LogError, UsageError
from codriver.signals import Log
from codriver.signals.signal import Array

CALIBRATION_FOLDS = 3
LEAST_ROWS = 150  # at dt .2 s half a minute


@dataclass(frozen=True, eq=False)
class TorquePrediction:
    """What a driver foretells on one drive.

    Attributes:
        time: of each row's now, s, shape (n,).
        drive: number of the drive each row is of, shape (n,).
        horizon: the torque is that of time + horizon, s.
        mean, sd: N m, shape (n,).
        low, high: 95 % band, N m, shape (n,).
        measured: torque at time + horizon, N m, shape (n,); NaN where not known.
        last: torque now, N m, shape (n,).
        log_density: of the measured torque, shape (n,).
    """

    time: Array
    drive: Index
    horizon: float
    mean: Array
    sd: Array
    low: Array
    high: Array
    measured: Array
    last: Array
    log_density: Array

    @property
    def error(self) -> Array:
        """Measured less foretold, N m."""
        return self.measured - self.mean


@dataclass(frozen=True, eq=False)
class LearnedDriver:
    """A driver that has been learnt.

    Attributes:
        name: whose it is.
        kind: of model.
        protocol: features and scaling.
        signals: used beside the torque.
        target: the torque's name.
        features: the columns of z.
        scaling: of features and torque.
        regressor: what was learnt.
        calibration: of its bands.
        training: what it was learnt from: drives, rows, seconds, spread of the torque; RMSE and coverage on held-out blocks.
        left_out: signals that the drives lack.
        held: what was foretold on blocks held out in turn, each by a model that had not seen it; not kept in a file.
    """

    name: str
    kind: str
    protocol: Protocol
    signals: tuple[str, ...]
    target: str
    features: tuple[Feature, ...]
    scaling: Scaling
    regressor: TorqueRegressor
    calibration: Calibration = field(default_factory=Calibration)
    training: Mapping[str, Any] = field(default_factory=dict)
    left_out: tuple[str, ...] = ()
    held: TorquePrediction | None = field(default=None, repr=False)

    def table(self, log: Log | Sequence[Log], with_target: bool = True) -> FeatureTable:
        """Features of drives as this driver wants them.

        Raises:
            MissingSignal: a drive lacks one of its signals.
            LogError: there is no usable row.
        """
        return features_of(
            log, self.protocol.features, signals=self.signals, target=self.target, with_target=with_target
        )

    def predict(self, log: Log, *, with_target: bool = True) -> TorquePrediction:
        """Foretell the torque of a drive, row by row.

        Args:
            log: the drive.
            with_target: only rows whose torque to come is known; False goes on to the end of the drive.

        Raises:
            MissingSignal: the drive lacks one of the driver's signals.
            LogError: there is no usable row.
        """
        return self.predict_table(self.table(log, with_target))

    def predict_table(self, table: FeatureTable) -> TorquePrediction:
        """Foretell the rows of a table, given in the order of time."""
        mean, own_sd = predicted(self.regressor, self.scaling, table)
        return _foretold(table, mean, own_sd, self.calibration, self.protocol.features.horizon)


def _foretold(
    table: FeatureTable, mean: Array, own_sd: Array, calibration: Calibration, horizon: float
) -> TorquePrediction:
    """A prediction with its band, in the order of time."""
    half = calibration.half_width(own_sd)
    made = TorquePrediction(
        table.time, table.drive, horizon, mean, calibration.sd(own_sd), mean - half, mean + half, table.y,
        table.X[:, table.torque_columns[0]], calibration.log_density(table.y - mean, own_sd),
    )  # fmt: skip
    order = np.lexsort((table.time, table.drive))
    ordered: dict[str, Any] = {n: v[order] for n, v in vars(made).items() if isinstance(v, np.ndarray)}
    return replace(made, **ordered)


def fit_driver(
    drives: Log | Sequence[Log], kind: str = DEFAULT, *, name: str = "driver", protocol: Protocol | None = None,
    options: Mapping[str, Any] | None = None,
) -> LearnedDriver:  # fmt: skip
    """Learn a driver from drives.

    Args:
        drives: of this driver.
        kind: of model.
        name: whose.
        protocol: features and scaling; default: the honest one.
        options: parameters of the model.

    Raises:
        MissingSignal: a drive lacks the torque.
        LogError: there are too few usable rows.
        UsageError: there is no such kind or parameter, a parameter's value cannot be, or two drives are the same recording.
    """
    protocol = protocol or Protocol()
    logs = [drives] if isinstance(drives, Log) else list(drives)
    refuse_twice({f"drive {k + 1} ({log.source or 'no source'})": log for k, log in enumerate(logs)})
    return fit_table(features_of(logs, protocol.features), kind, name=name, protocol=protocol, options=options)


def fit_table(
    table: FeatureTable, kind: str = DEFAULT, *, name: str = "driver", protocol: Protocol | None = None,
    options: Mapping[str, Any] | None = None, scaling: Scaling | None = None, calibrate: bool = True,
) -> LearnedDriver:  # fmt: skip
    """Learn a driver from rows.

    Args:
        table, kind, name, protocol, options: as for `fit_driver`.
        scaling: default: from the rows.
        calibrate: learn the bands from blocks left out in turn, for which the model is fitted as many times again.

    Raises:
        LogError: there are too few rows.
    """
    protocol = protocol or Protocol()
    if len(table) < LEAST_ROWS or not table.y.std() > 0:
        why = f"{len(table)} usable rows" if len(table) < LEAST_ROWS else "a torque that never changes"
        raise LogError(
            f"{why} to learn a driver from", f"{LEAST_ROWS} rows or more, of a torque that changes", "add drives"
        )
    scaling = scaling or Scaling.of(table)
    with _blaming(kind, options):
        regressor = fitted(regressor_of(kind, table, protocol.features, options), scaling, table)
    folds = _calibration_folds(table, protocol)
    rows, means, sds = [], [], []
    for fold in folds if calibrate else []:
        with _blaming(kind, options):
            mean, sd = held_out(table, fold, kind, protocol, options)
        rows.append(fold.test)
        means.append(mean)
        sds.append(sd)
    calibration, held = Calibration(), None
    if rows:
        judged, mean, sd = table.take(np.concatenate(rows)), np.concatenate(means), np.concatenate(sds)
        calibration = Calibration.of((judged.y - mean) / sd)
        held = _foretold(judged, mean, sd, calibration, protocol.features.horizon)
    tick = protocol.features.tick if protocol.features.dense else protocol.features.dt
    training = {
        "drives": int(np.unique(table.drive).size), "rows": len(table), "minutes": len(table) * tick / 60,
        "torque_rms": float(np.sqrt(np.mean(table.y**2))),
    }  # fmt: skip
    if held is not None:
        inside = (held.measured >= held.low) & (held.measured <= held.high)
        training |= {
            "held_out_rmse": float(np.sqrt(np.mean(held.error**2))), "held_out_inside95": float(np.mean(inside)),
            "held_out_stays_rmse": float(np.sqrt(np.mean((held.measured - held.last) ** 2))),
        }  # fmt: skip
    signals = tuple(dict.fromkeys(f.signal for f in table.features if f.signal != table.target))
    return LearnedDriver(
        name, kind, protocol, signals, table.target, table.features, scaling, regressor, calibration, training,
        table.left_out, held,
    )  # fmt: skip


@contextmanager
def _blaming(kind: str, options: Mapping[str, Any] | None) -> Iterator[None]:
    """Values of parameters that a model refuses, as an error of the caller.

    Raises:
        UsageError: the model refuses.
    """
    try:
        yield
    except (ValueError, TypeError) as error:
        if not options:
            raise
        given = ", ".join(f"{name} = {value}" for name, value in options.items())
        raise UsageError(f"{kind} with {given}: {error}", "values that the model can take", "choose others") from error


def _calibration_folds(table: FeatureTable, protocol: Protocol) -> list[Fold]:
    """Drives where there are three or more, since a new drive is what a band has to hold for; else blocks."""
    drives = np.unique(table.drive)
    if drives.size < CALIBRATION_FOLDS or protocol.hold_out == "blocks":
        return time_blocks(table, CALIBRATION_FOLDS, protocol.gap or protocol.features.horizon, protocol.features)
    group = np.searchsorted(drives, table.drive) % CALIBRATION_FOLDS
    return [Fold(str(k), np.flatnonzero(group != k), np.flatnonzero(group == k)) for k in range(CALIBRATION_FOLDS)]


def held_out(
    table: FeatureTable, fold: Fold, kind: str, protocol: Protocol, options: Mapping[str, Any] | None = None
) -> tuple[Array, Array]:
    """Mean and own sd for the judged rows of a fold, N m, by a model of its training rows alone."""
    train, test = table.take(fold.train), table.take(fold.test)
    scaling = Scaling.of(table if protocol.scaling == "record" else train)
    model = fitted(regressor_of(kind, table, protocol.features, options), scaling, train)
    return predicted(model, scaling, test)


def fitted(regressor: TorqueRegressor, scaling: Scaling, table: FeatureTable) -> TorqueRegressor:
    """A regressor that has learnt a table; one without memory gets the rows in the order of time."""
    table = table if regressor.has_memory else table.in_time()
    return regressor.fit(scaling.features(table.X), scaling.torque(table.y), table.lengths)


def predicted(regressor: TorqueRegressor, scaling: Scaling, table: FeatureTable) -> tuple[Array, Array]:
    """Mean and own sd for the rows of a table, N m."""
    mean, sd = regressor.predict(scaling.features(table.X), return_std=True, lengths=table.lengths)
    return scaling.in_newton_metres(mean, sd)
