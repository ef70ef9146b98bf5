"""Error against horizon: how far ahead can a driver's torque be foretold?

    direct      T(t + h) = f_h(z(t))                                     one model a horizon
    iterated    T(t + dt) = f(z(t)), and on through column and car       one model of one step (`rollout`)
    pwc, pwl    T(t + h) = T(t);  T(t) + h (T(t) - T(t - dt)) / dt

All forms are judged on the same moments, by models that have not seen them, and know the road up to the same place: a direct model
for h looks as much further than the one-step model as the iteration gets. Between steps the iterated torque runs straight.

Okamoto, Tsiotras 2019 (Robotics and Autonomous Systems), section 5.3 and figure 11, which iterates.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import ceil

import numpy as np

from codriver.drivers.learned.feature_setting import FeatureSetting
from codriver.drivers.learned.features import FeatureTable, features_of
from codriver.drivers.learned.horizon_errors import NAIVE, HorizonErrors
from codriver.drivers.learned.kinds import DEFAULT, class_of
from codriver.drivers.learned.learned_driver import fit_table, predicted
from codriver.drivers.learned.protocol import Fold, Protocol, folds_of
from codriver.drivers.learned.rollout import NEEDED, WIDE, ColumnAndCar, roll_out, wheel_rates
from codriver.errors import MissingSignal, UsageError
from codriver.names import AHEAD
from codriver.signals import Log
from codriver.signals.grid import Flags
from codriver.signals.signal import Array
from codriver.vehicles import Vehicle

HORIZONS = (0.2, 0.4, 0.6, 0.8, 1.0, 1.4, 2.0)  # s


def error_against_horizon(
    drives: Mapping[str, Log], kinds: Sequence[str] = ("ridge", DEFAULT), horizons: Sequence[float] = HORIZONS,
    vehicle: Vehicle | None = None, *, protocol: Protocol | None = None, progress: Callable[[str], None] | None = None,
) -> HorizonErrors:  # fmt: skip
    """Judge models by horizon, on drives or blocks held out in turn.

    Args:
        drives: of one driver, by name.
        kinds: of models; NAIVE are added.
        horizons: s, whole ticks of the protocol's features.
        vehicle: to iterate through; None: direct only.
        protocol: default: the honest one; its horizon does not count.
        progress: told what is going on.

    Raises:
        UsageError: a horizon is no whole number of ticks or needs the road too far ahead; a model cannot be iterated.
        MissingSignal: a drive lacks the torque, or what the motion starts from.
        VehicleError: the vehicle lacks a parameter.
        LogError: there are too few usable rows.
    """
    protocol = protocol or Protocol()
    setting = protocol.features
    kinds = tuple(k for k in dict.fromkeys(kinds) if k not in NAIVE)
    ticks = _ticks(horizons, setting)
    logs = list(drives.values())
    plant = ColumnAndCar.from_vehicle(vehicle) if vehicle is not None else None
    if plant is not None:
        _check(logs, kinds)
    one = setting.substeps
    protocols = {
        k: protocol.with_features(horizon=k * setting.tick, preview=_preview(setting, k)) for k in sorted({one, *ticks})
    }
    tables = _same_moments({k: features_of(logs, p.features) for k, p in protocols.items()}, setting.tick)
    last = max(protocols)
    folds = folds_of(tables[last], protocols[last], tuple(drives))
    judged = {fold.name: tables[last].take(fold.test) for fold in folds}
    made: dict[tuple[str, str], list[Array]] = {}
    beyond: dict[str, list[Flags]] = {}
    inside: dict[str, list[Flags]] = {}
    for fold in folds:
        for kind in (*NAIVE, *kinds):
            columns, held = [], []
            for k in ticks:
                _tell(progress, f"{kind}, {k * setting.tick:g} s ahead, fold {fold.name}")
                driver = fit_table(tables[k].take(fold.train), kind, protocol=protocols[k])
                test = tables[k].take(fold.test)
                mean, sd = predicted(driver.regressor, driver.scaling, test)
                columns.append(mean)
                held.append(np.abs(test.y - mean) <= driver.calibration.half_width(sd))
            made.setdefault(("direct", kind), []).append(np.stack(columns, axis=1))
            inside.setdefault(kind, []).append(np.stack(held, axis=1))
        for kind in kinds if plant is not None else ():
            _tell(progress, f"{kind} iterated, fold {fold.name}")
            train = tables[one].take(fold.train)
            driver = fit_table(train, kind, protocol=protocols[one], calibrate=False)
            rates = _rates(logs, judged[fold.name], setting.tick)
            assert plant is not None
            rolled = roll_out(driver, judged[fold.name], plant, rates, ceil(ticks[-1] / one), _bounds(train))
            torque, flags = _at(rolled.torque, rolled.diverged, _now(judged[fold.name]), np.array(ticks) / one)
            made.setdefault(("iterated", kind), []).append(torque)
            beyond.setdefault(kind, []).append(flags)
    return HorizonErrors(
        setting.tick * np.array(ticks, dtype=float), np.concatenate([t.time for t in judged.values()]),
        np.concatenate([t.drive for t in judged.values()]), np.repeat(np.arange(len(folds)), [f.test.size for f in folds]),
        np.concatenate([_now(t) for t in judged.values()]), _truth(tables, ticks, folds),
        {key: np.concatenate(parts) for key, parts in made.items()},
        {kind: np.concatenate(parts) for kind, parts in beyond.items()},
        {kind: np.concatenate(parts) for kind, parts in inside.items()}, tuple(f.name for f in folds),
        max((f.when for f in tables[last].features if f.kind == "preview"), default=0.0), tables[last].target,
        tables[last].left_out, tables[last].estimated,
    )  # fmt: skip


def _ticks(horizons: Sequence[float], setting: FeatureSetting) -> list[int]:
    """Horizons in ticks, ascending."""
    tick = setting.tick
    found = sorted({round(h / tick) for h in horizons})
    if not found or found[0] < 1 or any(abs(h / tick - round(h / tick)) > 1e-6 for h in horizons):
        raise UsageError(
            f"horizons {', '.join(f'{h:g}' for h in horizons) or 'none'} s", f"whole multiples of {tick:g} s", "choose others"
        )  # fmt: skip
    return found


def _preview(setting: FeatureSetting, ticks: int) -> float:
    """How far a direct model may look, s: as far as an iterated one gets to."""
    steps = ceil(ticks / setting.substeps)
    farthest = AHEAD * setting.dt - setting.preview + setting.dt
    if setting.preview > 0 and steps * setting.dt > farthest + 1e-9:
        raise UsageError(
            f"a horizon of {ticks * setting.tick:g} s", f"{farthest:g} s at most, for the road is looked at beyond it",
            "choose a shorter one, or a protocol that looks less far along the road",
        )  # fmt: skip
    return setting.preview + (steps - 1) * setting.dt if setting.preview > 0 else 0.0


def _check(logs: Sequence[Log], kinds: Sequence[str]) -> None:
    """Whether the drives can be iterated through a vehicle, and the kinds."""
    for log in logs:
        lacking = [name for name in NEEDED if name not in log]
        if lacking:
            raise MissingSignal(
                f"{log.source or 'a drive'} has no {', '.join(lacking)}", f"{', '.join(NEEDED)}, where the motion starts",
                "map them in the names file, or leave out the vehicle: then each horizon is foretold directly only",
            )  # fmt: skip
    for kind in kinds:
        if class_of(kind).has_memory:
            raise UsageError(
                f"a driver of kind '{kind}', which has a memory, to be iterated",
                "a kind without",
                "leave it or the vehicle out",
            )


def _same_moments(tables: Mapping[int, FeatureTable], tick: float) -> dict[int, FeatureTable]:
    """The rows whose moments are in all tables; they come in the same order, since a drive has one grid for all of them."""
    every = list(tables.values())
    first = np.full(max(int(t.drive.max()) for t in every) + 1, np.inf)
    for table in every:
        np.minimum.at(first, table.drive, table.time)
    keys = {k: np.stack([t.drive, np.round((t.time - first[t.drive]) / tick)], axis=1) for k, t in tables.items()}
    common = set.intersection(*(set(map(tuple, own.tolist())) for own in keys.values()))
    return {
        k: t.take(np.flatnonzero([moment in common for moment in map(tuple, keys[k].tolist())]))
        for k, t in tables.items()
    }


def _truth(tables: Mapping[int, FeatureTable], ticks: Sequence[int], folds: Sequence[Fold]) -> Array:
    """The torque at each horizon, fold after fold, N m, shape (n, m)."""
    return np.concatenate([np.stack([tables[k].y[fold.test] for k in ticks], axis=1) for fold in folds])


def _now(table: FeatureTable) -> Array:
    """The torque now, N m."""
    return table.X[:, table.torque_columns[0]]


def _rates(logs: Sequence[Log], table: FeatureTable, tick: float) -> Array:
    """Rate of the wheel at the rows of a table, rad/s."""
    rates = np.empty(len(table))
    for number in np.unique(table.drive):
        mine = table.drive == number
        rates[mine] = wheel_rates(logs[number], table.time[mine], tick)
    return rates


def _at(torque: Array, beyond: Flags, now: Array, steps: Array) -> tuple[Array, Flags]:
    """A rollout after so many steps, which need not be whole: straight in between; shapes (n, m)."""
    whole = np.concatenate([now[:, None], torque], axis=1)
    lower = np.ceil(steps - 1e-9).astype(int) - 1
    part = steps - lower
    return (1 - part) * whole[:, lower] + part * whole[:, lower + 1], beyond[:, lower]


def _bounds(table: FeatureTable) -> dict[str, float]:
    """Largest values that are believed: WIDE times those of the training rows."""
    now = {f.signal: k for k, f in enumerate(table.features) if f.when == 0 and f.kind == "past"}
    return {name: WIDE * float(np.abs(table.X[:, k]).max()) for name, k in now.items()}


def _tell(progress: Callable[[str], None] | None, text: str) -> None:
    if progress is not None:
        progress(text)
