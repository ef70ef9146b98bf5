"""A drive made ready for learning: the torque estimated where no sensor measured it, the yaw rate derived where none is logged.

    T_dr      the best `driver-torque` estimator that log and vehicle can feed, causal
    r         single-track model driven by steering angle and speed (models/single_track)
    beta      atan2(v_y, v_x), where the lateral velocity is logged (simulators)

Both are named in the source of the signal, so whoever judges a model can see that its label or a feature is no measurement.
"""

from __future__ import annotations

import numpy as np

from codriver.drivers.learned.feature_setting import TARGETS
from codriver.drivers.learned.features import ESTIMATED
from codriver.errors import CodriverError, MissingSignal
from codriver.models.single_track import SLOWEST, SingleTrack
from codriver.run import estimate_log
from codriver.signals import Log, Signal
from codriver.vehicles import Vehicle

_TICK = 0.02  # s, of the single-track model


def prepared(log: Log, vehicle: Vehicle | None = None) -> tuple[Log, tuple[str, ...]]:
    """The log with what can be derived, and a sentence on each thing that was.

    Args:
        log: a drive.
        vehicle: of that drive.

    Raises:
        MissingSignal: there is no torque, and none can be estimated.
    """
    said = []
    if not any(name in log for name in TARGETS):
        log, sentence = _with_torque(log, vehicle)
        said.append(sentence)
    if "sideslip_angle" not in log and {"lateral_velocity", "longitudinal_speed"} <= set(log):
        log = log.with_signals(derived_sideslip(log))
        said.append("sideslip_angle is that of lateral velocity and speed")
    if "yaw_rate" not in log and {"steering_wheel_angle", "longitudinal_speed"} <= set(log) and vehicle is not None:
        try:
            car, ratio = SingleTrack.from_vehicle(vehicle), vehicle.number("steering_ratio")
        except CodriverError:
            return log, tuple(said)
        log = log.with_signals(derived_yaw_rate(log, car, ratio))
        said.append("yaw_rate is derived from angle and speed by the vehicle's single track")
    return log, tuple(said)


def derived_yaw_rate(log: Log, car: SingleTrack, ratio: float) -> Signal:
    """Yaw rate of a single track for the angle and speed of a log, rad/s.

    Args:
        log: has steering_wheel_angle and longitudinal_speed.
        car: the single track.
        ratio: of the steering.
    """
    grid = log.sample(["steering_wheel_angle", "longitudinal_speed"], _TICK)
    steer = grid.values["steering_wheel_angle"] / ratio
    speed = grid.values["longitudinal_speed"]
    known = grid.held["steering_wheel_angle"] & grid.held["longitudinal_speed"]
    made = np.full(len(grid), np.nan)
    beta = rate = 0.0
    for k in range(len(grid)):
        if known[k]:
            beta, rate = car.advance(beta, rate, float(steer[k]), max(float(speed[k]), SLOWEST), _TICK)
            made[k] = rate
    return Signal("yaw_rate", grid.time, made, "rad/s", "estimate: single track")


def derived_sideslip(log: Log) -> Signal:
    """Sideslip angle beta = atan2(v_y, v_x), rad; NaN below the single track's least speed, where it means nothing.

    Args:
        log: has lateral_velocity and longitudinal_speed.
    """
    grid = log.sample(["lateral_velocity", "longitudinal_speed"], _TICK)
    across, along = grid.values["lateral_velocity"], grid.values["longitudinal_speed"]
    known = grid.held["lateral_velocity"] & grid.held["longitudinal_speed"] & (along > SLOWEST)
    beta = np.where(known, np.arctan2(across, np.where(known, along, 1.0)), np.nan)
    return Signal("sideslip_angle", grid.time, beta, "rad", "derived: lateral velocity over speed")


def _with_torque(log: Log, vehicle: Vehicle | None) -> tuple[Log, str]:
    """The log with the driver's torque estimated."""
    try:
        estimate = estimate_log("driver-torque", log, vehicle)
    except MissingSignal as error:
        raise MissingSignal(
            f"{log.source or 'the drive'} has no torque of the driver, and none can be estimated: {error.found}",
            f"{' or '.join(TARGETS)}, or what a driver-torque estimator needs", "map the torque sensor, or give --vehicle",
        ) from error  # fmt: skip
    torque = estimate["driver_torque"]
    values = np.where(estimate.valid, torque.values, np.nan)
    signal = Signal("driver_torque", torque.time, values, torque.unit, f"{ESTIMATED}{estimate.observer}")
    return log.with_signals(signal), f"driver_torque is estimated by {estimate.observer}; no sensor measured it"
