"""From a log to an estimate in one call: which estimator, at which rate, built, compiled and run."""

from __future__ import annotations

from typing import Any

from codriver.errors import UsageError
from codriver.estimate import Estimate
from codriver.observers.feed import best, feeds, suggest_rate
from codriver.observers.observer import Observer
from codriver.observers.registry import build, families, get_estimator
from codriver.program import compile, refuse_missing
from codriver.signals import Log
from codriver.torque_fit import fit_torque_noise
from codriver.vehicles import Vehicle

RATES = (1.0, 10000.0)  # Hz
LONG = 350  # characters of what better estimators lack; beyond, they are counted


def choose(name: str, log: Log, vehicle: Vehicle | None = None) -> tuple[str, str]:
    """The estimator meant by a name, and why it was taken where the log decided.

    Args:
        name: of an estimator, or of a family: then the best of it that log and vehicle feed.
        log: the signals.
        vehicle: its parameters.

    Raises:
        UsageError: there is no such estimator or family.
        MissingSignal: nothing of the family can be fed.
    """
    if name not in families():
        return get_estimator(name).name, ""
    unusable = [fault for fault in log.faults if fault.endswith("it is left out")]
    feed = best(log, vehicle, log.source + (f" ({'; '.join(unusable)})" if unusable else ""), name)
    better = []
    for other in feeds(log, vehicle, name):
        if other.estimator == feed.estimator:
            break
        better.append(f"{other.estimator} lacks {other.lacks(vehicle)}")
    if sum(map(len, better)) > LONG:
        better = [f"{len(better)} better ones lack signals or vehicle parameters: codriver info says which"]
    return feed.estimator, "the best this log can feed" + (f" ({'; '.join(better)})" if better else "")


def check_rate(rate: float | None) -> None:
    """Whether a rate can be run at, asked before the long work.

    Raises:
        UsageError: it is out of range.
    """
    if rate is not None and not RATES[0] <= rate <= RATES[1]:
        bounds = f"{RATES[0]:g} to {RATES[1]:g} Hz"
        raise UsageError(
            f"a rate (--rate) of {rate:g} Hz", bounds, "choose one near that of the quickest measurement, such as 100"
        )


def estimate_log(
    name: str,
    log: Log,
    vehicle: Vehicle | None = None,
    *,
    ell: float | None = None,
    rate: float | None = None,
    preset: Any = None,
    form: str = "kalman",
) -> Estimate:
    """Estimate from a log.

    Args:
        name: of an estimator, or of a family: then the best of it that log and vehicle feed.
        log: the signals.
        vehicle: its parameters, where the estimator needs some.
        ell, preset, form: as for `build`; without a preset, estimators of the driver's torque fit their noise to the log.
        rate: ticks per second; None takes that of the quickest measurement (`suggest_rate`), or more where the estimator's model
            needs it (`Estimator.least`).

    Raises:
        UsageError: an option that cannot be.
        MissingSignal: the log lacks a signal.
        VehicleError: the vehicle is missing, or lacks a parameter.
        DesignError: the design fails its certificate.
    """
    check_rate(rate)
    name, _ = choose(name, log, vehicle)
    return compile(observer_for(name, log, vehicle, ell=ell, rate=rate, preset=preset, form=form)).run(log)


def observer_for(
    name: str, log: Log, vehicle: Vehicle | None = None, *, ell: float | None = None, rate: float | None = None, preset: Any = None,
    form: str = "kalman",
) -> Observer:  # fmt: skip
    """The observer that a log is run through: its tick from the log, and its noise, where it is one that learns.

    Args:
        name: of an estimator.
        log, vehicle, ell, rate, preset, form: as for `estimate_log`.
    """
    probe = build(name, vehicle, ell=ell, preset=preset, form=form)
    if rate is None:
        rate = max(suggest_rate(log, probe.measured or probe.required), get_estimator(name).least)
    if preset is None and get_estimator(name).learns:
        assert vehicle is not None  # else there would be no probe
        refuse_missing(probe, log)
        preset = fit_torque_noise(name, log, vehicle, rate).noise
    return build(name, vehicle, dt=1.0 / rate, ell=ell, preset=preset, form=form)
