"""One drive: road, driver and car together, step by step, recorded.

The motion is integrated in steps of 2 ms (the fastest part, a slipping clutch, has a time constant of about 6 ms);
the driver decides every 20 ms. Plain floats: a drive of 3 minutes takes a third of a second, one of 42 minutes four or
five. Should that ever be too slow, `Car`, `Powertrain` and `Feet` use only + - * /, comparisons, tanh, a cube root and
sin, and can be recorded and compiled as the observers are.
"""

from __future__ import annotations

from array import array
from dataclasses import dataclass, field

import numpy as np

from codriver.signals.signal import Array
from codriver.simulate.car import Car
from codriver.simulate.car_parameters import CarParameters
from codriver.simulate.driver import Driver
from codriver.simulate.powertrain import T_MAX
from codriver.simulate.road import Road
from codriver.simulate.styles import STYLES, Style

STEP = 0.002  # s
DECISION = 10  # steps between decisions of the driver
BRAKING = 0.1e5  # brake pressure above which the driver is braking, Pa

COLUMNS = (
    "time",  # s
    "distance",  # m
    "speed",  # v, m/s
    "acceleration",  # v', m/s^2
    "slope",  # alpha, rad
    "pedal",  # p_r, 0..1
    "pedal_rate",  # 1/s
    "brake",  # p_b, Pa
    "brake_rate",  # Pa/s
    "request",  # T_r, N m
    "torque",  # T_e, N m
    "passed",  # T_c, torque through the clutch, N m
    "engine_speed",  # rad/s
    "gear",
    "clutch",  # travel, 0 closed, 1 open
    "shifting",  # 1 up, -1 down, 0 no shift
    "planned_acceleration",  # m/s^2
    "planned_jerk",  # m/s^3
)


@dataclass(frozen=True, eq=False)
class Trace:
    """What happened in a drive, at every recorded step; all of it true.

    Attributes:
        columns: by the names of COLUMNS, each of shape (n,).
        road, car, style: what was driven, with what, by whom.
    """

    columns: dict[str, Array] = field(repr=False)
    road: Road
    car: CarParameters
    style: Style

    def __getitem__(self, name: str) -> Array:
        return self.columns[name]

    def __len__(self) -> int:
        return self.columns["time"].size

    @property
    def dt(self) -> float:
        """Recorded step, s."""
        time = self.columns["time"]
        return float(time[1] - time[0])

    @property
    def tau(self) -> Array:
        """Transmission coefficient of the engaged gear, 1/m."""
        return np.array(self.car.transmission)[self.columns["gear"].astype(int) - 1]

    @property
    def clutch_share(self) -> Array:
        """Share of the engine's torque that the clutch could not pass: 0 all passes, 1 none does.

        The `clutch` column is the travel of the release bearing, which is not the same: at half travel the clutch still
        passes all of a small torque.
        """
        capacity = T_MAX * (1.0 - self.columns["clutch"]) ** 3
        return 1.0 - np.minimum(1.0, capacity / np.maximum(np.abs(self.columns["torque"]), 20.0))

    @property
    def braking(self) -> Array:
        """sigma: 1 while the driver is braking."""
        return (self.columns["brake"] > BRAKING).astype(float)


def drive(
    road: Road,
    duration: float,
    *,
    style: Style | None = None,
    car: CarParameters | None = None,
    seed: int = 1,
    distance: float = 0.0,
    speed: float = 0.0,
    record_every: int = 1,
) -> Trace:
    """Drive along a road.

    Args:
        road: the road.
        duration: s; the drive also ends where the road does.
        style: who drives; "ordinary" if not given.
        car: the car's true parameters; those of the 2017 paper if not given.
        seed: of the driver's scatter and of his idea of the car.
        distance, speed: at the start, m and m/s; time begins at 0 wherever that is.
        record_every: steps of 2 ms between recorded rows; 5 (100 Hz) saves memory on long drives.
    """
    style, parameters = style or STYLES["ordinary"], car or CarParameters()
    driver = Driver(style, road, parameters, seed, distance, speed)
    body = Car(parameters, distance, speed)
    train, feet, plan = body.powertrain, driver.feet, driver.plan
    slopes = road.slope.tolist()
    slopes.append(slopes[-1])
    length = road.length
    rows = array("d")
    for k in range(round(duration / STEP) + 1):
        time = k * STEP
        if k % DECISION == 0:
            if body.distance > length - 1.0:
                break
            driver.decide(DECISION * STEP, time, body.distance, body.speed, train.gear, train.direction != 0)
        feet.move(STEP)
        train.step(STEP, feet.accelerator, feet.brake > BRAKING, body.speed)
        s = body.distance if body.distance > 0.0 else 0.0
        metre = int(s)
        slope = slopes[metre] + (s - metre) * (slopes[metre + 1] - slopes[metre])
        body.evaluate(feet.brake, slope)
        if k % record_every == 0:
            planned, jerk = plan.at(time)
            rows.extend((
                time, body.distance, body.speed, body.acceleration, slope, feet.accelerator, feet.accelerator_rate,
                feet.brake, feet.brake_rate, train.request, train.torque, train.passed, train.speed, train.gear,
                train.clutch, train.direction, planned, jerk,
            ))  # fmt: skip
        body.move(STEP)
    table = np.frombuffer(rows, dtype=float).reshape(-1, len(COLUMNS))
    return Trace({name: np.ascontiguousarray(table[:, i]) for i, name in enumerate(COLUMNS)}, road, parameters, style)
