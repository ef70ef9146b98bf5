"""The table of observers in motorcycle.md: python docs/measure/motorcycle_observers.py. Some minutes."""

# ruff: noqa: T201
from __future__ import annotations

from dataclasses import replace

import numpy as np

import codriver as cd
from codriver.models import MotorcycleParameters
from codriver.names import quantity
from codriver.simulate.motorcycle import (
    IDEAL,
    Machine,
    MachineParameters,
    Ride,
    Rider,
    RideSensors,
    double_lane_change,
    ramp,
    relative_noise,
    ride,
    sense,
    slalom,
)

KMH, DEGREE = 1 / 3.6, np.pi / 180
DT, SHARE, SEEDS, START = 1e-3, 0.075, 4, 1.0
OBSERVERS = (
    ("motorcycle-ekf", "kalman"), ("motorcycle-kalman", "kalman"), ("motorcycle-kalman", "constant"), ("motorcycle-ts", "kalman"),
    ("motorcycle-uio", "kalman"), ("motorcycle-imu", "kalman"),
)  # fmt: skip
NAMES = {
    "body_roll_rate": "roll_rate", "body_pitch_rate": "pitch_rate", "body_yaw_rate": "yaw_rate",
    "force_y": "lateral_acceleration", "force_z": "vertical_acceleration", "steer_angle": "steer_angle",
    "speed": "longitudinal_speed",
}  # fmt: skip
TRUTH = (
    ("roll_angle", "roll", DEGREE),
    ("rider_torque", "rider_torque", 1.0),
    ("front_lateral_force", "front_lateral_force", 1.0),
)


def rides(machine: Machine) -> dict[str, Ride]:
    """Slalom, double lane change, and a steady turn of 36 degrees."""
    steady = ramp(70 * KMH, 70 * KMH, 0.0, 1.0)
    return {
        "slalom": ride(Rider(machine, slalom(1.5, 100.0), ramp(50 * KMH, 100 * KMH, 2.0, 14.0)), 16.0),
        "lane change": ride(
            Rider(machine, double_lane_change(3.5, 70.0, 40.0), ramp(100 * KMH, 100 * KMH, 0.0, 1.0)), 9.0
        ),
        "turn": ride(Rider(machine, slalom(0.0, 100.0), steady, lean=lambda t: 0.55 if t > 1 else 0.0), 10.0),
    }


def kinds(done: Ride) -> dict[str, RideSensors]:
    """Ideal, noisy, and noisy with biases."""
    noisy = relative_noise(done, SHARE)
    bias = {"gyro_bias": (0.5 * DEGREE,) * 3, "accelerometer_bias": (0.2,) * 3}
    return {"ideal": IDEAL, "noise": noisy, "noise and bias": replace(noisy, **bias)}


def errors(program: cd.Program, done: Ride, sensors: RideSensors, seed: int) -> list[float]:
    """Mean squared errors of what the observer estimates, from START on."""
    measured = sense(done, sensors, seed)
    log = cd.Log.of([cd.Signal(name, done.time, measured[key], quantity(name).unit) for key, name in NAMES.items()])
    found = program.run(log)
    made = []
    for name, true, unit in TRUTH:
        if name in found:
            off = found[name].values - np.interp(found.time, done.time, done.of(true))
            made.append(float(np.mean((off[found.time >= START] / unit) ** 2)))
    return made


def main() -> None:
    """Print the table."""
    parameters = MachineParameters(MotorcycleParameters.from_vehicle(cd.load_vehicle("sharp1971")))
    vehicle = cd.load_vehicle("sharp1971")
    for name, value in zip(("imu_forward", "imu_left", "imu_height"), parameters.imu, strict=True):
        vehicle = vehicle.with_parameter(name, value, source="the simulated machine")
    done = rides(Machine(parameters))
    for observer, form in OBSERVERS:
        program = cd.compile(cd.build(observer, vehicle, dt=DT, form=form))
        for name, one in done.items():
            cells = []
            for kind, sensors in kinds(one).items():
                many = [errors(program, one, sensors, seed) for seed in range(1 if kind == "ideal" else SEEDS)]
                cells.append(" / ".join(f"{x:.3g}" for x in np.sqrt(np.mean(many, axis=0))))
            print(f"| {observer} ({form}) | {name} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
