"""Estimate from a log with hindsight: which estimator, built for which tick, smoothed in its family's way.

`intent_smoother` and `torque_smoother` say what each does, and what it does not look across.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from codriver.errors import UsageError
from codriver.offline.intent_smoother import is_intent, smooth_intent
from codriver.offline.smoothed import SmoothedEstimate
from codriver.offline.torque_smoother import is_torque, smooth_torque
from codriver.run import choose, observer_for
from codriver.signals import Log
from codriver.vehicles import Vehicle, load_vehicle


def smooth(
    log: Log,
    estimator: str = "intent-pedals",
    vehicle: Vehicle | str | Path | None = None,
    *,
    dt: float | None = None,
    ell: float | None = None,
    preset: Any = None,
    lag: float | None = None,
) -> SmoothedEstimate:
    """Estimate from a log with hindsight.

    Args:
        log: the signals.
        estimator: one with a Kalman filter of the intention or of the driver's torque, or a family: then the best of it that log
            and vehicle feed.
        vehicle: its parameters, where the estimator needs some.
        dt: tick, s; None takes that of the quickest measurement.
        ell, preset: as for `build`. Without a lag to fear, ell is how quick the intention itself changes.
        lag: how far ahead to look, s, rounded to ticks; 0 is the filter, None the whole stretch.

    Raises:
        UsageError: an option that cannot be, or an estimator without this observer.
        MissingSignal: the log lacks a signal.
        VehicleError: the vehicle is missing, or lacks a parameter.
        DesignError: the design fails its certificate.
    """
    if lag is not None and not 0 <= lag < float("inf"):
        raise UsageError(
            f"a lag of {lag:g} s", "a number of seconds, 0 or more", "leave it out to look at the whole drive"
        )
    if isinstance(vehicle, (str, Path)):
        vehicle = load_vehicle(vehicle)
    name, _ = choose(estimator, log, vehicle)
    observer = observer_for(name, log, vehicle, ell=ell, rate=None if dt is None else 1.0 / dt, preset=preset)
    if is_intent(observer):
        return smooth_intent(observer, log, lag)
    if is_torque(observer):
        return smooth_torque(observer, log, lag)
    raise UsageError(
        f"{name} cannot be smoothed: it has no Kalman filter that the smoothers know",
        "intent-pedals, intent-torque, kinematic or a Kalman filter of the family driver-torque", "choose one of these",
    )  # fmt: skip
