"""All observers on all rides through ideal sensors, noisy ones, and noisy ones with biases."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from codriver.estimate import Estimate
from codriver.papers.motorcycle2018.methods import METHODS, program
from codriver.papers.motorcycle2018.rides import JUDGED, NOISE, Errors, Scene, judged, sizes
from codriver.papers.reproduction import Tell
from codriver.report.document import Mark, Table

COUNTS = 4096
# By name: the sensors of `Scene.log`.
SENSORS: dict[str, dict[str, float]] = {
    "ideal": {}, "noise": {"noise": NOISE, "counts": COUNTS}, "bias": {"noise": NOISE, "counts": COUNTS, "bias": 1.0},
}  # fmt: skip
SAID = {"ideal": "ideal", "noise": "noisy", "bias": "biased"}
SHORT = {"track": "track", "slalom": "slalom", "double-lane-change": "lane change"}
QUANTITY = {
    "roll_angle": "Roll angle", "rider_torque": "Rider's torque", "front_lateral_force": "Front tyre's lateral force",
    "rear_lateral_force": "Rear tyre's lateral force", "lateral_velocity": "Lateral velocity",
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Compared:
    """What all observers err by.

    Attributes:
        errors: by method, ride and sensors.
        zero: of answering zero, by ride.
    """

    errors: Mapping[tuple[str, str, str], Errors]
    zero: Mapping[str, Errors]

    def roll(self, method: str, ride: str, sensors: str) -> float:
        """RMSE of the roll angle, degrees."""
        return self.errors[method, ride, sensors]["roll_angle"]

    def best(self, ride: str, sensors: str, name: str = "roll_angle") -> str:
        """The method that errs least, of those that have sensors."""
        return min(
            (m for m in METHODS if not METHODS[m].fed and np.isfinite(self.errors[m, ride, sensors][name])),
            key=lambda m: self.errors[m, ride, sensors][name],
        )

    def table(self, name: str) -> Table:
        """RMSE of a quantity, a row an observer.

        Args:
            name: of JUDGED.
        """
        columns = [(ride, kind) for ride in self.zero for kind in SENSORS]
        rows: list[tuple[str | float | Mark | None, ...]] = [
            (METHODS[m].short, *(None if (e := self.errors[m, *c][name]) != e else e for c in columns)) for m in METHODS
        ]
        size: tuple[str | float | Mark | None, ...] = (
            "answering zero",
            *(self.zero[ride][name] for ride, _ in columns),
        )
        head = (
            "observer",
            *(f"{SHORT[ride]}, {SAID[kind]}" if kind == "ideal" else SAID[kind] for ride, kind in columns),
        )
        return Table(head, (*rows, size), f"{QUANTITY[name]}: RMSE, {JUDGED[name][0]}.")


def compare(rides: Iterable[Scene], seeds: int, tell: Tell) -> Compared:
    """Judge.

    Args:
        rides: one a scenario.
        seeds: readings of noisy sensors.
        tell: is told each method.
    """
    rides, found = list(rides), {}
    for method in METHODS:
        tell(f"estimating: {METHODS[method].label}")
        for ride in rides:
            for kind in SENSORS:
                found[method, ride.name, kind] = _one(method, ride, kind, seeds)
    return Compared(found, {ride.name: sizes(ride) for ride in rides})


def _one(method: str, ride: Scene, kind: str, seeds: int) -> Errors:
    """Of one method on one ride; NaN where it takes no sensors, and these are biased."""
    fed, sensors = METHODS[method].fed, SENSORS[kind]
    if fed and "bias" in sensors:
        return dict.fromkeys(JUDGED, float("nan"))
    return judged(program(method), ride, seeds if sensors else 1, sensors, fed)


def estimate(method: str, ride: Scene, kind: str = "ideal") -> Estimate:
    """One method on a ride, first reading of its sensors.

    Args:
        method: of METHODS.
        ride: the ride.
        kind: of SENSORS.
    """
    sensors = SENSORS[kind]
    log = ride.measures(1, sensors.get("noise", 0.0)) if METHODS[method].fed else ride.log(1, **sensors)
    return program(method).run(log)


def legend() -> Table:
    """What the short names of the tables stand for."""
    return Table(("observer", "what it is"), tuple((m.short, m.label) for m in METHODS.values()))
