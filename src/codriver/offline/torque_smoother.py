"""The driver's torque with hindsight: the filter's model, given the angles that came after, too.

    fixed interval   x_k | all angles of the stretch        Rauch, Tung, Striebel 1965, doi:10.2514/3.3166
    fixed lag        x_k | the angles up to k + lag

The compiled observer runs first and as it is; then the passes go over its means and covariances (`passes`). They do not look
across a jump of the encoder or a gap after which the filter began anew, nor across a stretch in which the torque on the column is
missing: there the filter's values stay. What the vehicle file and the column leave open is added to the variance as the filter
adds it; hindsight tells nothing of it. Innovations and other flags are the filter's.
"""

from __future__ import annotations

import numpy as np

from codriver.observers.augmented_kalman import pairs
from codriver.observers.driver_torque import ANGLE, settled_variance
from codriver.observers.observer import Observer
from codriver.offline.passes import Names, fixed_interval, fixed_lag
from codriver.offline.smoothed import SmoothedEstimate, with_memory
from codriver.program import compile, provenance
from codriver.signals import Log
from codriver.signals.signal import Array

_ESTIMATES = (ANGLE, "steering_wheel_rate", "driver_torque")


def is_torque(observer: Observer) -> bool:
    """Whether it is the Kalman filter of a wheel's angle, rate and driver's torque."""
    names = [output.name for output in observer.outputs]
    return "driver_torque_sd" in names and "x_0" in observer.carry and "column_torque" in names


def smooth_torque(observer: Observer, log: Log, lag: float | None) -> SmoothedEstimate:
    """The driver's torque with hindsight.

    Args:
        observer: one that `is_torque` says yes to.
        log: the signals.
        lag: how far ahead to look, s; None for the whole stretch.
    """
    size = sum(key.startswith("x_") for key in observer.carry)
    means, covariances = [f"x_{i}" for i in range(size)], [f"P_{i}{j}" for i, j in pairs(size)]
    run = compile(with_memory(observer, [*means, *covariances, "angle_begun"])).run(log)
    columns, n, dt = dict(run.columns), len(run.grid), run.grid.dt
    begun = columns.pop("angle_begun") > 0.5
    known = run.flag("inputs_known") & begun
    names = Names(size)
    memory = {name: columns.pop(name) for name in (*means, *covariances)}
    filtered: dict[str, Array] = dict(zip([*names.x, *names.P], memory.values(), strict=True))
    column, balance = columns["column_torque"], float(observer.settings["balance"])
    torque = (1.0 - balance) * column
    after = np.append(torque[1:], torque[-1:])
    F, G_0, G_1, Q_d = (observer.gains[letter] for letter in ("F", "G_0", "G_1", "Q_d"))
    filtered |= {name: G_0[i, 0] * torque + G_1[i, 0] * after for i, name in enumerate(names.shift)}
    follows = np.append(known[1:] & ~run.flag("restarted")[1:], False)
    filtered["wall"] = 1.0 - (known & follows)
    ticks = n if lag is None else round(lag / dt)
    if ticks:
        moments = fixed_lag(filtered, F, Q_d, dt, ticks) if ticks < n else fixed_interval(filtered, F, Q_d, dt)
        for i, name in enumerate(_ESTIMATES):
            left_open = columns[f"{name}_sd"] ** 2 - memory[f"P_{i}{i}"]
            # Rounding may leave a variance of 0 a hair below it.
            spread = np.sqrt(np.maximum(moments[f"S{i}{i}"] + left_open, 0.0))
            found = moments[f"m{i}"] - (balance * column if name == "driver_torque" else 0.0)
            columns[name] = np.where(known, found, columns[name])
            columns[f"{name}_sd"] = np.where(known, spread, columns[f"{name}_sd"])
        sure = moments["S22"] <= settled_variance(float(observer.gains["P"][2, 2]))
        columns["valid"] = (known & sure & ~run.flag("at_end_stop")).astype(float)
    said = {**provenance(observer), "smoother": "fixed interval" if lag is None else f"fixed lag of {ticks * dt:g} s"}
    return SmoothedEstimate(
        f"{observer.name}, smoothed", run.grid, columns, observer.outputs, observer.measured, said, run.log,
        None if lag is None else ticks * dt, run.columns["valid"],
    )  # fmt: skip
