"""The tables of observers in motorcycle.md: python docs/measure/motorcycle_observers.py. Some minutes."""

# ruff: noqa: T201
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

import codriver as cd
from codriver.names import quantity
from codriver.simulate.motorcycle import (
    IDEAL,
    SCENARIOS,
    Ride,
    RideSensors,
    RideSetting,
    relative_noise,
    sense,
    simulate_ride,
)
from codriver.simulate.motorcycle.files import nominal_vehicle
from codriver.simulate.motorcycle.paths import LAP, closed, double_lane_change, for_bends, ramp, slalom
from codriver.simulate.motorcycle.scenarios import Scenario

DEGREE = np.pi / 180
RATE, SHARE, SEEDS, START = 1000, 0.075, 4, 1.0
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


def kinds(done: Ride) -> dict[str, RideSensors]:
    """Ideal, noisy, and noisy with biases; all with the front wheel's speed."""
    noisy = replace(relative_noise(done, SHARE), wheel=True)
    bias = {"gyro_bias": (0.5 * DEGREE,) * 3, "accelerometer_bias": (0.2,) * 3}
    return {"ideal": replace(IDEAL, wheel=True), "noise": noisy, "noise and bias": replace(noisy, **bias)}


# Rides on another machine, road or speed than the filter is told of; and what is not told to the filter.
WRONG = {
    "as told": {}, "tyres of 70 %": {"tyre_stiffness": 0.7}, "rider of 60 kg": {"rider_mass": 60.0},
    "rider of 110 kg": {"rider_mass": 110.0}, "speed 2 % high": {"speed_error": 0.02},
    "road banks by 3 degrees": {"bank": 3 * DEGREE},
}  # fmt: skip
UNTOLD = {
    "no crowns": ("front_crown_radius", "rear_crown_radius"), "no trail": ("pneumatic_trail",), "no drag": ("drag",),
}  # fmt: skip


# Other rides than the scenarios, made after everything was chosen.
FRESH = {
    "another lap": lambda: _lap(),
    "another slalom": lambda: Scenario(slalom(1.5, 80.0), ramp(60 / 3.6, 110 / 3.6, 1.0, 15.0), 16.0),
    "another lane change": lambda: Scenario(double_lane_change(3.0, 60.0, 50.0), ramp(25.0, 25.0, 0.0, 1.0), 9.0),
}


def _lap() -> Scenario:
    course = closed([(1.2 * length if angle else length, -angle) for length, angle in LAP])
    return Scenario(course, for_bends(course, 30 / 3.6, 110 / 3.6, 6.5, start=60 / 3.6), 80.0)


def errors(
    program: cd.Program,
    done: Ride,
    sensors: RideSensors,
    seed: int,
    left_out: tuple[str, ...] = (),
    vertical: bool = False,
) -> tuple[list[float], float]:
    """Mean squared errors of what the observer estimates, from START on, and the share of it within the roll's 95 % band.

    The roll is held against that from the road's normal, or from the vertical.
    """
    measured = sense(done, sensors, seed)
    kept = {key: name for key, name in NAMES.items() if name not in left_out}
    log = cd.Log.of([cd.Signal(name, done.time, measured[key], quantity(name).unit) for key, name in kept.items()])
    found = program.run(log)
    made, late, inside = [], found.time >= START, np.nan
    for name, true, unit in TRUTH:
        if name in found:
            truth = done.of(true) + (done.of("bank") if vertical and name == "roll_angle" else 0.0)
            off = found[name].values - np.interp(found.time, done.time, truth)
            made.append(float(np.mean((off[late] / unit) ** 2)))
            sd = found.sd(name)
            if name == "roll_angle" and sd is not None:
                inside = float(np.mean(np.abs(off) < 1.96 * sd, where=late))
    return made, inside


def main(scenarios: Sequence[str] = tuple(SCENARIOS), seed: int = 1) -> None:
    """Print the table."""
    done = {name: simulate_ride(RideSetting(name, rate=RATE), seed=seed).ride for name in scenarios}
    for observer, form in OBSERVERS:
        program = cd.compile(cd.build(observer, nominal_vehicle(), dt=1 / RATE, form=form))
        for name, one in done.items():
            cells, covered = [], []
            for kind, sensors in kinds(one).items():
                many = [errors(program, one, sensors, seed) for seed in range(1 if kind == "ideal" else SEEDS)]
                cells.append(" / ".join(f"{x:.3g}" for x in np.sqrt(np.mean([m for m, _ in many], axis=0))))
                covered.append(f"{np.mean([c for _, c in many]):.2f}")
            print(f"| {observer} ({form}) | {name} | {' | '.join(cells)} | {' '.join(covered)} |", flush=True)


def wrong() -> None:
    """Print what is told wrong costs the default."""

    def told(vehicle: cd.Vehicle) -> cd.Program:
        return cd.compile(cd.build("motorcycle-ekf", vehicle, dt=1 / RATE))

    def say(
        what: str, program: cd.Program, setting: RideSetting, left_out: tuple[str, ...] = (), vertical: bool = False
    ) -> None:
        done = simulate_ride(setting, seed=1).ride
        sensors = replace(relative_noise(done, SHARE), wheel=True, speed_scale=1 + setting.speed_error)
        squares, inside = errors(program, done, sensors, 0, left_out, vertical)
        print(
            f"| {what} | {setting.scenario} | {' / '.join(f'{x:.3g}' for x in np.sqrt(squares))} | {inside:.2f} |",
            flush=True,
        )

    program, vehicle = told(nominal_vehicle()), nominal_vehicle()
    for what, changed in WRONG.items():
        for scenario in ("slalom", "track"):
            say(what, program, RideSetting(scenario, rate=RATE, **changed))
            if "bank" in changed:
                say(
                    "the same, roll from the vertical",
                    program,
                    RideSetting(scenario, rate=RATE, **changed),
                    vertical=True,
                )
    for what, names in UNTOLD.items():
        less = vehicle
        for name in names:
            less = less.with_parameter(name, 0.0, source="not told")
        say(what, told(less), RideSetting("track", rate=RATE))
    say("no pitch rate, vertical", program, RideSetting("track", rate=RATE), ("pitch_rate", "vertical_acceleration"))


if __name__ == "__main__":
    main()
    wrong()
    SCENARIOS.update(FRESH)
    main(tuple(FRESH), seed=7)
