"""Faults of a motorcycle's sensors, one at a time: what each costs of the roll, and whether the verdict tells (docs/motorcycle.md).

A slalom and a lap with 7.5 % noise at 100 Hz. A fault costs where the roll errs by more than 2 degrees, and by a degree more than
on the sound ride. It is told where the verdict has a finding that is not that nothing can be judged.

    python docs/measure/motorcycle_faults.py
"""

# ruff: noqa: T201
from __future__ import annotations

from collections import Counter
from collections.abc import Callable

import numpy as np

import codriver as cd
from codriver.run import observer_for
from codriver.signals.signal import Array
from codriver.simulate.motorcycle import RideSetting, simulate_ride
from codriver.simulate.motorcycle.files import nominal_vehicle

DEGREE = np.pi / 180
ESTIMATORS = ("motorcycle-ekf", "motorcycle-kalman", "motorcycle-ts", "motorcycle-uio", "motorcycle-imu")
GYRO = P, Q, R = ("roll_rate", "pitch_rate", "yaw_rate")
ACCELEROMETER = AX, AY, AZ = ("longitudinal_acceleration", "lateral_acceleration", "vertical_acceleration")
STEER, SPEED = "steer_angle", "longitudinal_speed"
START, COSTS, MORE = 1.0, 2.0, 1.0  # s, degrees, degrees
Fault = Callable[[cd.Log], cd.Log]


def changed(change: Callable[[Array, Array], Array], *names: str) -> Fault:
    """New values from time and values."""
    return lambda log: log.with_signals(
        *(cd.Signal(n, log[n].time, change(log[n].time, log[n].values), log[n].unit) for n in names)
    )


def late(name: str, by: float) -> Fault:
    """A signal that comes so many seconds late."""
    return lambda log: log.with_signals(cd.Signal(name, log[name].time + by, log[name].values, log[name].unit))


def seldom(every: int, *names: str) -> Fault:
    """One sample of so many."""
    return lambda log: log.with_signals(
        *(cd.Signal(n, log[n].time[::every], log[n].values[::every], log[n].unit) for n in names)
    )


def swapped(a: str, b: str) -> Fault:
    """Two columns in each other's place."""
    return lambda log: log.with_signals(
        cd.Signal(a, log[b].time, log[b].values, log[a].unit), cd.Signal(b, log[a].time, log[a].values, log[b].unit)
    )


def turned(axis: int, angle: float) -> Fault:
    """The whole IMU about x, y or z."""
    c, s = np.cos(angle * DEGREE), np.sin(angle * DEGREE)
    i, j = ((1, 2), (2, 0), (0, 1))[axis]

    def turn(log: cd.Log) -> cd.Log:
        made = []
        for names in (GYRO, ACCELEROMETER):
            old = [log[n].values for n in names]
            new = list(old)
            new[i], new[j] = c * old[i] + s * old[j], c * old[j] - s * old[i]
            made += [cd.Signal(n, log[n].time, x, log[n].unit) for n, x in zip(names, new, strict=True)]
        return log.with_signals(*made)

    return turn


def hangs(name: str, start: float, stop: float) -> Fault:
    """From one share of the ride to another."""

    def hang(t: Array, x: Array) -> Array:
        return np.where((t >= start * t[-1]) & (t < stop * t[-1]), x[int(start * t.size)], x)

    return changed(hang, name)


def spikes(name: str, size: float) -> Fault:
    """Twenty wrong samples."""

    def spike(t: Array, x: Array) -> Array:
        rng = np.random.default_rng(0)
        made = x.copy()
        made[rng.choice(t.size, 20, replace=False)] += size * rng.choice([-1.0, 1.0], 20)
        return made

    return changed(spike, name)


def faults() -> dict[str, Fault]:
    """All of them, by name."""
    made: dict[str, Fault] = {}
    biases = {P: (0.5, 1, 2, 5), R: (0.5, 1, 2, 5), Q: (2,), STEER: (0.1, 0.3, 1, 2, 5)}
    for name, sizes in biases.items():
        for b in sizes:
            made[f"{name} + {b:g} deg"] = changed(lambda t, x, b=b: x + b * DEGREE, name)
    for name, b in ((AY, 0.5), (AY, 2.0), (AZ, 2.0)):
        made[f"{name} + {b:g}"] = changed(lambda t, x, b=b: x + b, name)
    scales = [(SPEED, k) for k in (1.02, 1.1, 1.3, 0.9, 0.7, 1 / 3.6, 3.6, 0.447, 0.621)]
    scales += [(name, -1.0) for name in (P, R, STEER, AY, AZ, Q)]
    scales += [(name, k) for name in (P, R, STEER) for k in (1 / DEGREE, DEGREE, 0.5, 0.8, 1.25, 2.0)]
    scales += [(AY, 1 / 9.81)]
    for name, k in scales:
        made[f"{name} * {k:.3g}"] = changed(lambda t, x, k=k: k * x, name)
    for label, k, names in (
        ("gyro * 57", 1 / DEGREE, GYRO),
        ("gyro / 57", DEGREE, GYRO),
        ("accelerometer / g", 1 / 9.81, (AY, AZ)),
    ):
        made[label] = changed(lambda t, x, k=k: k * x, *names)
    for name in (P, R, STEER, AY, SPEED, AZ, Q):
        made[f"{name} = 0"] = changed(lambda t, x: 0 * x, name)
        made[f"{name} hangs"], made[f"{name} hangs for a fifth"] = hangs(name, 0.4, 2.0), hangs(name, 0.4, 0.6)
    made["speed = 20 m/s"] = changed(lambda t, x: 0 * x + 20, SPEED)
    for pair in ((P, Q), (P, R), (Q, R), (AY, AZ), (STEER, P), (STEER, R)):
        made[" for ".join(pair)] = swapped(*pair)
    for name, c in ((P, 0.3), (P, 0.15), (R, 0.1), (STEER, 0.01)):
        made[f"{name} clips at {c:g}"] = changed(lambda t, x, c=c: np.clip(x, -c, c), name)
    for name in (P, R, STEER, SPEED, AY):
        for by in (0.05, 0.1, 0.2, 0.5):
            made[f"{name} late by {by:g} s"] = late(name, by)
    for name, size in ((P, 3.0), (R, 3.0), (STEER, 0.3), (SPEED, 20.0)):
        made[f"{name} spikes"] = spikes(name, size)
    rates = {
        "speed 1 Hz": (100, (SPEED,)),
        "speed 5 Hz": (20, (SPEED,)),
        "steer 10 Hz": (10, (STEER,)),
        "gyro 20 Hz": (5, GYRO),
    }
    rates |= {"gyro 10 Hz": (10, GYRO), "all 20 Hz": (5, (*GYRO, AY, AZ, SPEED, STEER))}
    for label, (every, names) in rates.items():
        made[label] = seldom(every, *names)
    for name in (P, R):
        made[f"{name} drifts"] = changed(lambda t, x: x + 0.1 * DEGREE * t, name)
    for name, size in ((P, 3.0), (R, 3.0), (STEER, 1.0)):
        made[f"{name} jumps"] = changed(lambda t, x, size=size: x + size * DEGREE * (t > t[-1] / 2), name)
    for axis, angles in enumerate(((5, 15, -15, 90), (5, 15), (10, -10, 20, 90, 180))):
        for angle in angles:
            made[f"IMU turned about {'xyz'[axis]} by {angle}"] = turned(axis, angle)
    return made


def main(scenarios: tuple[str, ...] = ("slalom", "track")) -> None:
    """Print how many faults cost, and how many of them are told."""
    vehicle, programs, made = nominal_vehicle(), {}, {"sound": lambda log: log, **faults()}
    counts: Counter[tuple[str, str]] = Counter()
    missed = []
    for scenario in scenarios:
        record = simulate_ride(RideSetting(scenario, noise=0.075))
        truth = record.truth()["roll_angle"]
        sound: dict[str, float] = {}
        for label, fault in made.items():
            log = fault(record.log())
            for name in ESTIMATORS:
                rate = round(1 / float(np.median(np.diff(log["roll_rate"].time))))
                if (name, rate) not in programs:
                    programs[name, rate] = cd.compile(observer_for(name, log, vehicle))
                estimate = programs[name, rate].run(log)
                judged = estimate.valid & (estimate.time > START)
                if not judged.any():
                    continue
                error = (estimate["roll_angle"].values - np.interp(estimate.time, truth.time, truth.values))[
                    judged
                ] / DEGREE
                rms = float(np.sqrt(np.mean(error**2)))
                base = sound.setdefault(name, rms)
                if rms < max(COSTS, base + MORE):
                    continue
                said = [f for f in estimate.check().findings if f.severity != "ok" and "no innovations" not in f.text]
                bad = any(f.severity == "bad" for f in said)
                counts.update({(name, "cost"): 1, (name, "told"): int(bool(said)), (name, "bad"): int(bad)})
                if not said:
                    missed.append(f"{name} {scenario}: {label}, {rms:.1f} degrees")
    print(f"{len(made) - 1} faults in each of two rides")
    for name in ESTIMATORS:
        print(f"{name:18} cost {counts[name, 'cost']}, told {counts[name, 'told']}, bad {counts[name, 'bad']}")
    print("not told:", *missed, sep="\n  ")


if __name__ == "__main__":
    main()
