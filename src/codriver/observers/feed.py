"""Which estimators a set of signals can feed, with a vehicle or without."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from codriver.errors import MissingSignal, UsageError, VehicleError
from codriver.observers.registry import ESTIMATORS, families, needed_signals
from codriver.signals import Log
from codriver.vehicles import Vehicle

MANY = 3  # parameters of a vehicle that are named one by one
NICE_RATES = (20.0, 25.0, 50.0, 100.0, 200.0)


@dataclass(frozen=True)
class Feed:
    """Whether one estimator can be fed.

    Attributes:
        estimator: its name.
        missing: standard signals it needs and the log lacks.
        lacking: parameters it needs and the vehicle lacks; all of them where no vehicle was given; "no <parameter>" for those it is
            not for.
        meaning: what it estimates.
        family: the estimators it is compared with.
    """

    estimator: str
    missing: tuple[str, ...]
    lacking: tuple[str, ...]
    meaning: str
    family: str

    @property
    def possible(self) -> bool:
        """Whether log and vehicle together feed it."""
        return not self.missing and not self.lacking

    def lacks(self, vehicle: Vehicle | None) -> str:
        """What stands in its way, for people."""
        wants = [f"[{p}] of the vehicle" for p in self.lacking] if vehicle is not None else []
        if len(wants) > MANY:
            wants = [*wants[:1], f"{len(wants) - 1} more parameters of it"]
        return ", ".join([*self.missing, *wants, *(["a vehicle"] if self.lacking and vehicle is None else [])])


def feeds(signals: Collection[str], vehicle: Vehicle | None, family: str | None = None) -> list[Feed]:
    """Every estimator, or those of one family, in order of preference, with what stands in its way.

    Raises:
        UsageError: there is no such family.
    """
    if family is not None and family not in families():
        raise UsageError(
            f"no family of estimators is called '{family}'", f"one of {', '.join(families())}", "choose one"
        )
    return [
        Feed(
            name,
            tuple(s for s in needed_signals(name, vehicle) if s not in signals),
            (
                *(p for p in estimator.parameters if vehicle is None or p not in vehicle),
                *(f"no {p}" for p in estimator.forbids if vehicle is not None and p in vehicle),
            ),
            estimator.meaning,
            estimator.family,
        )
        for name, estimator in ESTIMATORS.items()
        if family is None or estimator.family == family
    ]


def best(signals: Collection[str], vehicle: Vehicle | None, where: str = "the log", family: str = "intent") -> Feed:
    """The best estimator of a family that can be fed.

    Raises:
        MissingSignal: none can; the message says what each lacks.
        VehicleError: the log has what one needs, and the vehicle lacks a parameter.
        UsageError: there is no such family.
    """
    found = feeds(signals, vehicle, family)
    for feed in found:
        if feed.possible:
            return feed
    lacks = "; ".join(f"{f.estimator} lacks {f.lacks(vehicle)}" for f in found)
    # Those that lack little: a whole single track is no hint, nor is a parameter that stands in the way.
    fed = [f for f in found if not f.missing and len(f.lacking) <= MANY and not any(p[:3] == "no " for p in f.lacking)]
    if fed and vehicle is not None:
        nearest_one = min(fed, key=lambda f: len(f.lacking))
        raise VehicleError(
            f"{where} feeds no estimator with vehicle '{vehicle.name}': {lacks}",
            f"{', '.join(nearest_one.lacking)} in the vehicle file, for {nearest_one.estimator}",
            "find them with `codriver identify`, or add them to the file: docs/vehicles.md",
        )
    least = least_demanding(family)
    raise MissingSignal(
        f"{where} feeds no estimator: {lacks}",
        f"at least {' and '.join(ESTIMATORS[least].signals)} ({least})",
        "map more signals in a names file; `codriver info LOG` lists the channels of the log",
    )


def least_demanding(family: str) -> str:
    """The estimator of a family that needs the fewest vehicle parameters, and then the fewest signals."""
    members = [estimator for estimator in ESTIMATORS.values() if estimator.family == family]
    return min(members, key=lambda e: (len(e.parameters), len(e.signals))).name


def suggest_rate(log: Log, names: Collection[str]) -> float:
    """The rate at which to run, Hz: the quickest of the signals named, rounded up to a usual rate, from 20 to 200 Hz.

    Each value is used on the tick it arrives, but its noise is that of one sample a tick: a rate above those of the signals
    makes the Kalman form more cautious, so that it lags more (docs/sampling.md).
    """
    rates = [log[name].rate for name in names if name in log and len(log[name]) > 1]
    quickest = max((rate for rate in rates if rate == rate), default=NICE_RATES[0])
    return next((rate for rate in NICE_RATES if rate >= 0.95 * quickest), NICE_RATES[-1])
