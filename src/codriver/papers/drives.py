"""The drives that the jerk papers are made again on: simulated, over a CAN bus, several at once.

Each drive is a process of its own where the machine has more than one core. What comes back is what an engineer would have,
the log decoded from the bus, and beside it the truth, which no estimator sees.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import active_children, get_context

import numpy as np

from codriver.papers.reproduction import Tell
from codriver.signals import Log
from codriver.signals.grid import Flags
from codriver.signals.signal import Array
from codriver.simulate.compare import Score, compare, jerk_of, run_estimators
from codriver.vehicles import Vehicle

SPIKE = 0.5  # s; what is shorter is a spike, and no burst of a driver
ESTIMATORS = ("intent-pedals", "intent-torque", "kinematic", "pedals-only")


@dataclass(frozen=True)
class Job:
    """Who drives, with which seed, and how noisy the pedals' sensors are.

    Attributes:
        driver: style.
        seed: of driver, sensors and bus; the same driver and seed drive alike whatever the sensors.
        pedal_noise, brake_noise: share of the pedal's range, Pa; None takes the road test's own.
    """

    driver: str
    seed: int
    pedal_noise: float | None = None
    brake_noise: float | None = None


@dataclass(frozen=True, eq=False)
class Driven:
    """One drive.

    Attributes:
        job: who drove.
        log: decoded from the bus.
        truth: see `codriver.simulate.truth`.
        scores: the estimators at each ell, judged.
        spikes: by estimator and ell: how far the jerk leaves its mean over half a second, 99.9 % quantile, m/s^3.
    """

    job: Job
    log: Log
    truth: Log
    scores: tuple[Score, ...]
    spikes: Mapping[tuple[str, float | None], float]


@dataclass(frozen=True)
class Order:
    """What to drive and judge.

    Attributes:
        where: the "road" test or the "track".
        vehicle: what the estimators are told of the car.
        preset: their noise; "" for each estimator's own.
        ells: their knob.
        estimators: which.
    """

    where: str
    vehicle: Vehicle
    preset: str
    ells: tuple[float, ...]
    estimators: tuple[str, ...] = ESTIMATORS


def drives(jobs: Sequence[Job], order: Order, tell: Tell) -> list[Driven]:
    """Drives, judged; in the order of the jobs."""
    where = "the road test" if order.where == "road" else "the track"
    tell(f"driving {where} {len(jobs)} times, and judging the estimators")
    workers = min(len(jobs), os.cpu_count() or 1)
    if workers < 2:
        return [_drive(job, order) for job in jobs]
    # "spawn": a forked copy of a process that has threads may lock up.
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=_end_quietly) as pool:
        try:
            return list(pool.map(_drive, jobs, [order] * len(jobs)))
        except BaseException:
            # Else the pool would wait for the drives under way.
            pool.shutdown(wait=False, cancel_futures=True)
            for process in active_children():
                process.terminate()
            raise


def _end_quietly() -> None:
    """In a process of its own: Ctrl-C ends it without a traceback; the main process says what happened."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def _drive(job: Job, order: Order) -> Driven:
    """Simulate a drive and judge the estimators on it."""
    from codriver.simulate import ROAD_TEST_SENSORS, road_test, track_test

    sensors = ROAD_TEST_SENSORS
    if job.pedal_noise is not None:
        sensors = replace(sensors, pedal_noise=job.pedal_noise)
    if job.brake_noise is not None:
        sensors = replace(sensors, brake_noise=job.brake_noise)
    test = (road_test if order.where == "road" else track_test)(job.driver, job.seed, sensors=sensors)
    estimates = run_estimators(test.log, order.vehicle, order.estimators, order.ells, preset=order.preset or None)
    use = np.logical_and.reduce([estimate.valid for estimate in estimates.values()])
    spikes = {key: _spikes(jerk_of(estimate), use, estimate.grid.dt) for key, estimate in estimates.items()}
    return Driven(job, test.log, test.truth, tuple(compare(estimates, test.truth)), spikes)


def _spikes(jerk: Array, use: Flags, dt: float) -> float:
    """See `Driven.spikes`."""
    from scipy.ndimage import uniform_filter1d

    beyond = np.abs(jerk - uniform_filter1d(jerk, round(SPIKE / dt)))
    return float(np.quantile(beyond[use], 0.999))
