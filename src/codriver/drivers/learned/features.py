"""Features and target of drives: rows of z and T on the ticks of a log.

A row stands at a tick t_k (now) and holds what its setting asks for (`feature_setting`). Signals are held causally onto the
ticks, so a row knows nothing that a live bus would not. Rows any of whose values is missing or too old are left out, and rows at
which the vehicle stands; a stretch is a run of rows dt apart without a hole.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import numpy.typing as npt

from codriver.drivers.learned.feature_setting import TARGETS, FeatureSetting
from codriver.drivers.learned.no_row import needed, why_no_row
from codriver.drivers.learned.road_ahead import curvature_ahead
from codriver.drivers.learned.smoothing import local_quadratic, low_pass
from codriver.errors import LogError, MissingSignal
from codriver.signals import Grid, Log
from codriver.signals.signal import Array

Index = npt.NDArray[np.intp]
ESTIMATED = "estimate: "  # begins the source of a torque that `prepare` estimated


@dataclass(frozen=True)
class Feature:
    """A column of z.

    Attributes:
        signal: standard name.
        when: s from now: negative in the past, positive ahead.
        kind: "past", "slow", "current" or "preview".
    """

    signal: str
    when: float
    kind: str

    def __str__(self) -> str:
        return f"{self.signal}({self.when:+.2g} s)" if self.when else f"{self.signal}(now)"


@dataclass(frozen=True, eq=False)
class FeatureTable:
    """Rows of features.

    Attributes:
        X: shape (n, d).
        y: the torque to be foretold, N m, shape (n,); NaN where it is not known (yet).
        time: of each row's now, s, shape (n,).
        features: the d columns.
        lengths: of the stretches that the rows are made of, in their order.
        drive: number of the drive each row is of, shape (n,).
        target: name of the torque.
        left_out: signals that the setting names and the drives lack.
        estimated: whether the torque is an estimate of ours, from the wheel's angle, and not a sensor's.
    """

    X: Array
    y: Array
    time: Array
    features: tuple[Feature, ...]
    lengths: tuple[int, ...]
    drive: Index
    target: str
    left_out: tuple[str, ...] = ()
    estimated: bool = False

    def __len__(self) -> int:
        return self.y.size

    @property
    def names(self) -> tuple[str, ...]:
        """Of the columns."""
        return tuple(str(f) for f in self.features)

    @property
    def torque_columns(self) -> tuple[int, ...]:
        """Columns of the torque's past, the newest first."""
        found = [k for k, f in enumerate(self.features) if f.signal == self.target]
        return tuple(sorted(found, key=lambda k: -self.features[k].when))

    def in_time(self) -> Self:
        """The rows of each drive in the order of time, for models to which rows are independent; a drive is a stretch."""
        order = np.lexsort((self.time, self.drive))
        lengths = tuple(int(k) for k in np.bincount(self.drive) if k)
        return replace(
            self, X=self.X[order], y=self.y[order], time=self.time[order], drive=self.drive[order], lengths=lengths
        )

    def take(self, rows: Index) -> Self:
        """Some of the rows, ascending; a stretch ends where a row is left out."""
        rows = np.asarray(rows)
        stretch = np.repeat(np.arange(len(self.lengths)), self.lengths)[rows]
        new = np.flatnonzero((np.diff(rows) != 1) | (np.diff(stretch) != 0)) + 1
        lengths = np.diff(np.r_[0, new, rows.size]) if rows.size else np.empty(0, int)
        return replace(
            self, X=self.X[rows], y=self.y[rows], time=self.time[rows], drive=self.drive[rows],
            lengths=tuple(int(k) for k in lengths),
        )  # fmt: skip


def target_of(logs: Sequence[Log]) -> str:
    """The torque that all logs have.

    Raises:
        MissingSignal: there is none.
    """
    for name in TARGETS:
        if all(name in log for log in logs):
            return name
    lacking = next(log for log in logs if not any(name in log for name in TARGETS))
    raise MissingSignal(
        f"{lacking.source or 'a drive'} has no torque of the driver", f"{' or '.join(TARGETS)} in every drive",
        "map the torque sensor in the names file, or estimate the torque first: codriver estimate driver-torque",
    )  # fmt: skip


def usable_signals(logs: Sequence[Log], setting: FeatureSetting) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Those signals of a setting that all logs have, and those that some log lacks."""
    wanted = tuple(dict.fromkeys((*setting.past, *setting.slow, *setting.current)))
    there = tuple(name for name in wanted if all(name in log for log in logs))
    return there, tuple(name for name in wanted if name not in there)


def columns_of(setting: FeatureSetting, signals: Sequence[str], target: str) -> tuple[Feature, ...]:
    """The columns of z, in the order of eq. (1): the newest first, the road ahead last."""
    current = [Feature(n, setting.horizon, "current") for n in setting.current if n in signals]
    past = [n for n in setting.past if n in signals]
    lags = [Feature(n, -lag * setting.dt, "past") for lag in range(setting.history) for n in (target, *past)]
    slow = [Feature(n, 0.0, "slow") for n in setting.slow if n in signals and n not in past]
    preview = []
    if "road_curvature" in signals and "longitudinal_speed" in signals:
        preview = [Feature("road_curvature", tau, "preview") for tau in setting.previews]
    return (*current, *lags, *slow, *preview)


def features_of(
    logs: Log | Sequence[Log], setting: FeatureSetting | None = None, *, signals: Sequence[str] | None = None,
    target: str | None = None, with_target: bool = True,
) -> FeatureTable:  # fmt: skip
    """Rows of one or several drives.

    Args:
        logs: drives.
        setting: which features; default: the honest ones.
        signals: those to use; None: all of the setting's that every log has.
        target: the torque's name; None: the first of TARGETS that every log has.
        with_target: leave out rows whose torque to come is not known; False keeps them, with y NaN.

    Raises:
        MissingSignal: a log lacks the torque or one of `signals`.
        LogError: there is no usable row.
    """
    setting = setting or FeatureSetting()
    drives = [logs] if isinstance(logs, Log) else list(logs)
    target = target or target_of(drives)
    there, left_out = usable_signals(drives, setting)
    used = there if signals is None else tuple(signals)
    for log in drives:
        for name in (target, *used):
            log[name]
    columns = columns_of(setting, used, target)
    parts = [_rows(log, setting, columns, used, target, with_target) for log in drives]
    X = np.vstack([p[0] for p in parts])
    if not X.size:
        names = tuple(dict.fromkeys((target, *used)))
        why = "; ".join(f"{log.source or 'a drive'}: {why_no_row(log, setting, names)}" for log in drives)
        raise LogError(
            f"no usable row of features in {why}",
            f"at least {needed(setting):g} s in which {', '.join(names)} are there and the vehicle goes faster than "
            f"{setting.slowest:g} m/s",
            "see with `codriver info` what the log holds; correct units in the names file; leave out signals that are slow or stop",
        )  # fmt: skip
    number = np.concatenate([np.full(p[1].size, k) for k, p in enumerate(parts)])
    lengths = tuple(length for p in parts for length in p[3])
    return FeatureTable(
        X, np.concatenate([p[1] for p in parts]), np.concatenate([p[2] for p in parts]), columns, lengths, number, target,
        left_out if signals is None else (), any(log[target].source.startswith(ESTIMATED) for log in drives),
    )  # fmt: skip


def grid_of(log: Log, setting: FeatureSetting, names: Sequence[str]) -> tuple[Grid, dict[str, Array]]:
    """Signals on the ticks, and the same smoothed; NaN where too old."""
    grid = log.sample(names, setting.tick)
    held = {name: np.where(grid.held[name], grid.values[name], np.nan) for name in names}
    if setting.smoothing == "none":
        return grid, held
    made = {}
    for name, values in held.items():
        smooth = low_pass(values, setting.cutoff, setting.tick)
        if setting.smoothing == "paper2019":
            there = np.isfinite(smooth)
            smooth[there] = local_quadratic(smooth[there], setting.span, setting.tick)
        made[name] = np.where(np.isfinite(values), smooth, np.nan)
    return grid, made


def _rows(
    log: Log, setting: FeatureSetting, columns: tuple[Feature, ...], signals: Sequence[str], target: str, with_target: bool
) -> tuple[Array, Array, Array, tuple[int, ...]]:  # fmt: skip
    """X, y, time and lengths of one drive."""
    names = tuple(dict.fromkeys((target, *signals)))
    grid, smooth = grid_of(log, setting, names)
    n, m = len(grid), setting.substeps
    # The raw curve of the road serves as its map.
    raw = {name: np.where(grid.held[name], grid.values[name], np.nan) for name in names}
    ahead: dict[float, Array] = {}
    if any(f.kind == "preview" for f in columns):
        made = curvature_ahead(raw["road_curvature"], raw["longitudinal_speed"], setting.tick, setting.previews)
        ahead = dict(zip(setting.previews, made.T, strict=True))
    X = np.full((n, len(columns)), np.nan)
    for j, feature in enumerate(columns):
        values = ahead[feature.when] if feature.kind == "preview" else smooth[feature.signal]
        shift = 0 if feature.kind == "preview" else -round(feature.when / setting.tick)
        X[:, j] = _shifted(values, shift)
    answer = smooth[target] if setting.smooth_target else raw[target]
    y = _shifted(answer, -setting.ahead)
    good = np.isfinite(X).all(axis=1) & (np.isfinite(y) | (not with_target))
    if "longitudinal_speed" in names and setting.slowest > 0:
        good &= np.abs(np.nan_to_num(raw["longitudinal_speed"])) >= setting.slowest
    order, lengths = _stretches(good, m, setting.dense)
    return X[order], y[order], grid.time[order], lengths


def _shifted(values: Array, by: int) -> Array:
    """values[k - by] at k; NaN beyond the ends."""
    made = np.full(values.shape, np.nan)
    if abs(by) >= values.size:
        return made
    if by >= 0:
        made[by:] = values[: values.size - by]
    else:
        made[:by] = values[-by:]
    return made


def _stretches(good: npt.NDArray[np.bool_], substeps: int, dense: bool) -> tuple[Index, tuple[int, ...]]:
    """Order of the rows so that those dt apart follow each other, and the lengths of the runs."""
    order: list[Index] = []
    lengths: list[int] = []
    for phase in range(substeps if dense else 1):
        rows = np.arange(phase, good.size, substeps)
        edges = np.flatnonzero(np.diff(np.r_[0, good[rows].astype(np.int8), 0]))
        for start, stop in zip(edges[::2], edges[1::2], strict=True):
            order.append(rows[start:stop])
            lengths.append(int(stop - start))
    return (np.concatenate(order) if order else np.empty(0, np.intp)), tuple(lengths)
