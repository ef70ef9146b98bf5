"""The zero of a two-wheeler's steering encoder, from a ride.

The filter is run over the whole ride with the zero as a state that may be anything (`motorcycle-ekf`, `bicycle-kalman`). What it
found where it was surest is the zero. By then bends and changes of speed have told it from the gyroscope's biases, which look the
same at the start: v delta_0 over the wheelbase is a yaw rate. So a second run with the zero taken out is right from the start on,
where the first is not.

The standard error has `MODEL` in it, for what the filter's own, of 0.007 to 0.016 degrees, does not know (docs/motorcycle.md).
"""

from __future__ import annotations

from math import hypot, pi
from pathlib import PurePath

import numpy as np

from codriver.errors import LogError, UsageError
from codriver.observers.steer_zero import OFFSET, SteerZero
from codriver.program import compile
from codriver.run import check_rate, observer_for
from codriver.signals import Log
from codriver.vehicles import Vehicle

DEGREE = pi / 180
WIDE = 3 * DEGREE  # sd of an encoder that somebody put on by eye
MODEL = 0.01 * DEGREE
# What is not good enough: a zero costs v^2 delta_0 / (g w) of roll, so that a bicycle bears more. What is no zero.
UNSURE, MOST = {"motorcycle-ekf": 0.15 * DEGREE, "bicycle-kalman": 0.5 * DEGREE}, 15 * DEGREE


def find_steer_zero(log: Log, vehicle: Vehicle, by: str = "motorcycle-ekf", *, rate: float | None = None) -> SteerZero:
    """Find the zero of the steering encoder.

    Args:
        log: the ride, with all that the filter needs.
        vehicle: the machine; a zero of its own is where the search begins.
        by: "motorcycle-ekf" or "bicycle-kalman".
        rate: ticks per second; None takes that of the quickest measurement.

    Raises:
        MissingSignal: the log lacks a signal.
        VehicleError: the vehicle lacks a parameter.
        LogError: the ride does not tell it.
        UsageError: another estimator, or a rate that cannot be.
    """
    if by not in UNSURE:
        raise UsageError(f"a steering encoder's zero by {by}", " or ".join(UNSURE), "choose one of them")
    check_rate(rate)
    begin = SteerZero(SteerZero.from_vehicle(vehicle).value, WIDE, "to be found")
    observer = observer_for(by, log, begin.of(vehicle), rate=rate)
    found = compile(observer, [OFFSET, f"{OFFSET}_sd", "valid"]).run(log)
    seconds = float(found.valid.sum()) * observer.dt
    expected = f"a ride that tells it to {UNSURE[by] / DEGREE:g} degrees, of some seconds at speed or in bends"
    do = "say the zero yourself (--steer-zero DEGREES), or leave it out"
    if not found.valid.any():
        raise LogError(
            f"{log.source}: the steering encoder's zero cannot be found: {by} has no valid moment in it", expected, do
        )
    sds = np.where(found.valid, found.columns[f"{OFFSET}_sd"], np.inf)
    surest = int(np.argmin(sds))
    value, sd = float(found.columns[OFFSET][surest]), hypot(float(sds[surest]), MODEL)
    if sd > UNSURE[by]:
        raise LogError(
            f"{log.source}: {seconds:.1f} valid seconds tell the steering encoder's zero to {sd / DEGREE:.2g} degrees only",
            expected, do,
        )  # fmt: skip
    if abs(value) > MOST:
        raise LogError(
            f"{log.source}: the steering encoder's zero comes out as {value / DEGREE:.3g} degrees",
            f"one within {MOST / DEGREE:g} degrees", "check unit and sign of steer_angle in the names file",
        )  # fmt: skip
    return SteerZero(value, sd, f"found from {seconds:.1f} s of {PurePath(log.source).name or 'a ride'}")
