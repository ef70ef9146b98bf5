"""Error against horizon: how far ahead can a driver's torque be foretold?

    direct      T(t + h) = f_h(z(t))                                     one model a horizon
    iterated    T(t + dt) = f(z(t)), and on through column and car       one model of one step (`rollout`)
    pwc         T(t + h) = T(t)

All forms are judged on the same moments, by models that have not seen them, and know the road up to the same place: a direct model
for h looks h - dt further than the one-step model does.

Okamoto, Tsiotras 2019 (Robotics and Autonomous Systems), section 5.3 and figure 11, which iterates.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from codriver.drivers.learned.features import FeatureTable, features_of
from codriver.drivers.learned.kinds import DEFAULT, class_of
from codriver.drivers.learned.learned_driver import fit_table, predicted
from codriver.drivers.learned.protocol import Protocol, folds_of
from codriver.drivers.learned.rollout import NEEDED, WIDE, ColumnAndCar, roll_out, wheel_rates
from codriver.errors import MissingSignal, UsageError
from codriver.finding import Finding
from codriver.signals import Log
from codriver.signals.signal import Array
from codriver.vehicles import Vehicle

HORIZONS = (0.2, 0.4, 0.6, 0.8, 1.0, 1.4, 2.0)  # s


@dataclass(frozen=True, eq=False)
class HorizonErrors:
    """Root mean square errors.

    Attributes:
        horizons: s, shape (m,).
        direct: by kind, "pwc" among them, N m, shape (m,).
        iterated: by kind, N m, shape (m,); empty without a vehicle.
        diverged: by kind, share of the rollouts that have passed a bound by then, shape (m,); they count in `iterated`.
        rows: moments judged.
        folds: parts held out in turn.
        road: how far ahead the road is known at the last horizon, s at the present speed; 0 without a road.
        target: the torque's name.
        left_out: signals that the drives lack.
        estimated: whether the torque is an estimate.
    """

    horizons: Array
    direct: Mapping[str, Array]
    iterated: Mapping[str, Array]
    diverged: Mapping[str, Array]
    rows: int
    folds: tuple[str, ...]
    road: float
    target: str
    left_out: tuple[str, ...] = ()
    estimated: bool = False

    def verdict(self) -> list[Finding]:
        """What can be said at the last horizon."""
        h, stays = self.horizons[-1], self.direct["pwc"][-1]
        found = [Finding("warn", "the torque is itself an estimate from the wheel's angle")] if self.estimated else []
        for kind, errors in self.direct.items():
            if kind != "pwc":
                found.append(_against(f"{kind}, {h:g} s ahead directly", errors[-1], stays))
        for kind, errors in self.iterated.items():
            found.append(_against(f"{kind}, iterated to {h:g} s", errors[-1], stays))
            if self.diverged[kind][-1] > 0:
                text = (
                    f"{self.diverged[kind][-1]:.1%} of {kind}'s rollouts diverge within {h:g} s and are held at a bound"
                )
                found.append(Finding("warn", text))
        return found


def error_against_horizon(
    drives: Mapping[str, Log], kinds: Sequence[str] = ("ridge", DEFAULT), horizons: Sequence[float] = HORIZONS,
    vehicle: Vehicle | None = None, *, protocol: Protocol | None = None, progress: Callable[[str], None] | None = None,
) -> HorizonErrors:  # fmt: skip
    """Judge models by horizon, on drives or blocks held out in turn.

    Args:
        drives: of one driver, by name.
        kinds: of models; "pwc" is added.
        horizons: s, whole steps of the protocol's dt.
        vehicle: to iterate through; None: direct only.
        protocol: default: the honest one; its horizon does not count.
        progress: told what is going on.

    Raises:
        UsageError: a horizon is no whole number of steps or needs the road too far ahead; a model cannot be iterated.
        MissingSignal: a drive lacks the torque, or what the motion starts from.
        VehicleError: the vehicle lacks a parameter.
        LogError: there are too few usable rows.
    """
    protocol = protocol or Protocol()
    dt = protocol.features.dt
    kinds = tuple(k for k in dict.fromkeys(kinds) if k != "pwc")
    steps = _steps(horizons, dt)
    logs = list(drives.values())
    plant = ColumnAndCar.from_vehicle(vehicle) if vehicle is not None else None
    if plant is not None:
        _check(logs, kinds)
    asked = sorted({1, *steps})
    protocols = {k: protocol.with_features(horizon=k * dt, preview=_preview(protocol, k)) for k in asked}
    tables = _same_moments({k: features_of(logs, protocols[k].features) for k in asked}, protocol.features.tick)
    whole, last = tables[asked[-1]], protocols[asked[-1]]
    rates = np.empty(len(whole))
    for number, log in enumerate(logs if plant is not None else []):
        mine = whole.drive == number
        rates[mine] = wheel_rates(log, whole.time[mine], protocol.features.tick)
    folds = folds_of(whole, last, tuple(drives))
    squares = {("direct", kind): np.zeros(len(steps)) for kind in ("pwc", *kinds)}
    squares |= {("iterated", kind): np.zeros(len(steps)) for kind in (kinds if plant is not None else ())}
    lost = {kind: np.zeros(len(steps)) for kind in (kinds if plant is not None else ())}
    for fold in folds:
        for i, k in enumerate(steps):
            train, test = tables[k].take(fold.train), tables[k].take(fold.test)
            squares["direct", "pwc"][i] += np.sum((test.y - test.X[:, test.torque_columns[0]]) ** 2)
            for kind in kinds:
                _tell(progress, f"{kind}, {k * dt:g} s ahead, fold {fold.name}")
                driver = fit_table(train, kind, protocol=protocols[k], calibrate=False)
                squares["direct", kind][i] += np.sum(
                    (test.y - predicted(driver.regressor, driver.scaling, test)[0]) ** 2
                )
        if plant is None:
            continue
        train, test = tables[1].take(fold.train), whole.take(fold.test)
        for kind in kinds:
            _tell(progress, f"{kind} iterated, fold {fold.name}")
            driver = fit_table(train, kind, protocol=protocols[1], calibrate=False)
            made = roll_out(driver, test, plant, rates[fold.test], steps[-1], _bounds(train))
            for i, k in enumerate(steps):
                squares["iterated", kind][i] += np.sum((tables[k].y[fold.test] - made.torque[:, k - 1]) ** 2)
                lost[kind][i] += np.sum(made.diverged[:, k - 1])
    rows = sum(fold.test.size for fold in folds)
    root = {key: np.sqrt(value / rows) for key, value in squares.items()}
    return HorizonErrors(
        dt * np.array(steps, dtype=float), {k: v for (form, k), v in root.items() if form == "direct"},
        {k: v for (form, k), v in root.items() if form == "iterated"}, {k: v / rows for k, v in lost.items()},
        rows, tuple(f.name for f in folds), max((f.when for f in whole.features if f.kind == "preview"), default=0.0),
        whole.target, whole.left_out, whole.estimated,
    )  # fmt: skip


def _steps(horizons: Sequence[float], dt: float) -> list[int]:
    """Horizons in steps, ascending."""
    found = sorted({round(h / dt) for h in horizons})
    if not found or found[0] < 1 or any(abs(h / dt - round(h / dt)) > 1e-6 for h in horizons):
        raise UsageError(
            f"horizons {', '.join(f'{h:g}' for h in horizons) or 'none'} s",
            f"whole multiples of {dt:g} s",
            "choose others",
        )
    return found


def _preview(protocol: Protocol, steps: int) -> float:
    """How far a direct model may look, s: as far as an iterated one gets to."""
    setting = protocol.features
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
    """The rows whose moments are in all tables; they come in the same order."""
    keys = {k: t.drive * 10**9 + np.round(t.time / tick).astype(np.int64) for k, t in tables.items()}
    common = next(iter(keys.values()))
    for own in keys.values():
        common = np.intersect1d(common, own)
    return {k: t.take(np.flatnonzero(np.isin(keys[k], common))) for k, t in tables.items()}


def _bounds(table: FeatureTable) -> dict[str, float]:
    """Largest values that are believed: WIDE times those of the training rows."""
    now = {f.signal: k for k, f in enumerate(table.features) if f.when == 0 and f.kind == "past"}
    return {name: WIDE * float(np.abs(table.X[:, k]).max()) for name, k in now.items()}


def _against(who: str, error: float, stays: float) -> Finding:
    said = f"{who}: RMSE {error:.3f} N m, {error / stays:.2f} times that of the torque that stays"
    return Finding("ok" if error < stays else "bad", said)


def _tell(progress: Callable[[str], None] | None, text: str) -> None:
    if progress is not None:
        progress(text)
