"""The rides that everything is judged on: one of a scenario, its sensors read as often as is wanted.

Truth by name of the output that should have it. Errors are over the ride from `SETTLE` s on, by when observers that began at
nothing have arrived; the 2018 paper does not say from when it counts.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np

from codriver.estimate import Estimate
from codriver.names import quantity
from codriver.program import Program
from codriver.signals import Log, Signal
from codriver.signals.signal import Array
from codriver.simulate.motorcycle import Machine, RideRecord, RideSetting, sense, simulate_ride
from codriver.simulate.motorcycle.scenarios import sensors_of

RATE = 200  # of sensors and observers, Hz
DT = 1 / RATE
SETTLE = 3.0  # s
NOISE = 0.075  # of the rms, amid the paper's 5 to 10 % of the largest value
WORDS = {"track": "track", "slalom": "slalom", "double-lane-change": "double lane change"}
# What is judged; unit and factor of what is shown.
JUDGED = {
    "roll_angle": ("deg", 180 / np.pi), "rider_torque": ("N m", 1.0), "front_lateral_force": ("N", 1.0),
    "rear_lateral_force": ("N", 1.0), "lateral_velocity": ("m/s", 1.0),
}  # fmt: skip
Errors = Mapping[str, float]


@dataclass(frozen=True, eq=False)
class Scene:
    """A ride and its truth.

    Attributes:
        record: as simulated, with ideal sensors.
        truth: of it.
    """

    record: RideRecord
    truth: Log
    _logs: dict[tuple[RideSetting, int], Log] = field(default_factory=dict, repr=False)

    @property
    def name(self) -> str:
        """Of the scenario."""
        return self.record.setting.scenario

    def log(self, seed: int = 1, **sensors: float) -> Log:
        """The ride through other sensors.

        Args:
            seed: of the noise and of the biases' signs.
            sensors: noise, bias, speed_error, counts of `RideSetting`.
        """
        setting = replace(self.record.setting, **sensors)  # type: ignore[arg-type]
        key = setting, seed
        if key not in self._logs:
            done = self.record.ride
            measured = sense(done, sensors_of(setting, done, seed), seed)
            self._logs[key] = RideRecord(setting, seed, done, measured).log()
        return self._logs[key]

    def measures(self, seed: int = 1, noise: float = 0.0) -> Log:
        """The measurements of (21) themselves, along the road, as if sensors showed them.

        Args:
            seed: of the noise.
            noise: white, on each, uniform within this part of its largest value, as the paper has it; none on the speed.
        """
        rng, t = np.random.default_rng([seed, 21]), self.truth
        mass = self.record.ride.rider.machine.parameters.sharp.mass
        force = t["front_lateral_force"].values + t["rear_lateral_force"].values
        columns = {
            "steer_angle": t["steer_angle"].values, "yaw_rate": t["heading_rate"].values, "roll_rate": t["roll_rate"].values,
            "steer_rate": t["steer_rate"].values, "lateral_acceleration": force / mass,
        }  # fmt: skip
        time = t["roll_angle"].time
        made = [
            Signal(n, time, x + noise * np.abs(x).max() * rng.uniform(-1, 1, x.size), quantity(n).unit)
            for n, x in columns.items()
        ]
        speed = "longitudinal_speed"
        return Log.of([*made, Signal(speed, time, t[speed].values, "m/s")], source="measurements of (21)")

    def of(self, name: str, time: Array) -> Array:
        """The truth at some times."""
        return np.interp(time, self.truth[name].time, self.truth[name].values)


@cache
def scene(scenario: str, seconds: float | None = None, **machine: float) -> Scene:
    """Ride.

    Args:
        scenario: its name.
        seconds: end after so many.
        machine: bank, rider_mass, tyre_stiffness of `RideSetting`.
    """
    setting = RideSetting(scenario, counts=0, rate=RATE, seconds=seconds, **machine)  # type: ignore[arg-type]
    record = simulate_ride(setting, 1)
    return Scene(record, record.truth())


def with_imu(ride: Scene, place: tuple[float, float, float]) -> Scene:
    """The same ride with the IMU elsewhere.

    Args:
        ride: the ride.
        place: in the rear frame, forward, left, up of the road point below its mass centre, m.
    """
    d, setting = ride.record.ride, ride.record.setting
    machine = Machine(replace(setting.machine(), imu=place))
    outputs = np.array([machine.output(x, u) for x, u in zip(d.states, d.inputs, strict=True)])
    moved = replace(d, outputs=outputs)
    seed = ride.record.seed
    return Scene(RideRecord(setting, seed, moved, sense(moved, sensors_of(setting, moved, seed), seed)), ride.truth)


def errors(estimate: Estimate, ride: Scene, after: float = SETTLE) -> Errors:
    """RMS of what an estimate errs by, by output, in the units of `JUDGED`; NaN where it says nothing of it.

    Args:
        estimate: of the ride.
        ride: with the truth.
        after: from so many seconds after the estimate's start on.
    """
    late = estimate.time >= estimate.time[0] + after
    found = {}
    for name, (_, factor) in JUDGED.items():
        off = (
            estimate.columns[name] - ride.of(name, estimate.time)
            if name in estimate.columns
            else np.full(late.size, np.nan)
        )
        found[name] = factor * float(np.sqrt(np.mean(off[late] ** 2)))
    return found


def sizes(ride: Scene, after: float = SETTLE) -> Errors:
    """RMS of the truth, by output: the error of answering zero."""
    late = ride.truth["roll_angle"].time >= after
    return {
        name: factor * float(np.sqrt(np.mean(ride.truth[name].values[late] ** 2)))
        for name, (_, factor) in JUDGED.items()
    }


def judged(program: Program, ride: Scene, seeds: int, sensors: Mapping[str, float], fed: bool = False) -> Errors:
    """Errors over several readings of the sensors, RMS over all.

    Args:
        program: the observer.
        ride: to judge on.
        seeds: how many readings.
        sensors: see `Scene.log`; of `Scene.measures` the noise alone.
        fed: it takes the measurements of (21), `Scene.measures`.
    """
    each = []
    for seed in range(1, seeds + 1):
        log = ride.measures(seed, sensors.get("noise", 0.0)) if fed else ride.log(seed, **sensors)
        each.append(errors(program.run(log), ride))
    return {name: float(np.sqrt(np.mean([e[name] ** 2 for e in each]))) for name in JUDGED}
