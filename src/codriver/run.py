"""From a log to an estimate in one call: which estimator, at which rate, built, compiled and run."""

from __future__ import annotations

from pathlib import Path

from codriver.errors import UsageError
from codriver.estimate import Estimate
from codriver.observers.feed import best, feeds, suggest_rate
from codriver.observers.registry import build, families, get_estimator
from codriver.observers.scaled_gain import Preset
from codriver.program import compile
from codriver.signals import Log
from codriver.vehicles import Vehicle

RATES = (1.0, 10000.0)  # Hz


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
    preset: str | Path | Preset | None = None,
    form: str = "kalman",
) -> Estimate:
    """Estimate from a log.

    Args:
        name: of an estimator, or of a family: then the best of it that log and vehicle feed.
        log: the signals.
        vehicle: its parameters, where the estimator needs some.
        ell, preset, form: as for `build`.
        rate: ticks per second; None takes that of the quickest measurement (`suggest_rate`).

    Raises:
        UsageError: an option that cannot be.
        MissingSignal: the log lacks a signal.
        VehicleError: the vehicle is missing, or lacks a parameter.
        DesignError: the design fails its certificate.
    """
    check_rate(rate)
    name, _ = choose(name, log, vehicle)
    if rate is None:
        probe = build(name, vehicle, ell=ell, preset=preset, form=form)
        rate = suggest_rate(log, probe.measured or probe.required)
    return compile(build(name, vehicle, dt=1.0 / rate, ell=ell, preset=preset, form=form)).run(log)
