"""A learned driver as an Observer: sample by sample, live and as C.

    every tick:        values held, filtered, and put into delay lines of (ell - 1) substeps ticks
                       z from the lines      T(t + h) foretold      sd

The road ahead comes in as inputs `road_curvature_ahead_1`, ..., the curvature at the places reached in dt, 2 dt, ... at the
present speed, since a bus cannot know it from the past. `valid` is 1 once the lines are full of fresh values, and the vehicle
moves. A model with memory has one state for each of the `substeps` interleaved rows dt apart, as in training; after a hole it
starts anew.
"""

from __future__ import annotations

from codriver.drivers.learned.learned_driver import LearnedDriver
from codriver.errors import DesignError
from codriver.kernel import Scalar, both, select
from codriver.observers.observer import Observer, Output, Scalars


def observer_of(driver: LearnedDriver) -> Observer:
    """The driver as an observer at his tick.

    Raises:
        DesignError: the model has no step, or its features need the future.
    """
    setting = driver.protocol.features
    if not driver.regressor.has_step:
        raise DesignError(
            f"a driver of kind '{driver.kind}' cannot run sample by sample", "a kind with a step: all but gp",
            "fit another --model",
        )  # fmt: skip
    if setting.current or setting.smoothing == "paper2019":
        raise DesignError(
            f"the features of {driver.protocol.name} need values of the future", "features of the past and the road ahead",
            "fit under the honest protocol",
        )  # fmt: skip
    lines = tuple(dict.fromkeys(f.signal for f in driver.features if f.kind in ("past", "slow")))
    previews = tuple(f for f in driver.features if f.kind == "preview")
    ahead = tuple(f"road_curvature_ahead_{k + 1}" for k in range(len(previews)))
    inputs = (*lines, *(() if "longitudinal_speed" in lines else _speed(driver)), *ahead)
    depth = (setting.history - 1) * setting.substeps
    carry = {f"{name}_{k}": 0.0 for name in lines for k in range(depth + 1)}
    carry |= {"filled": 0.0, "phase": 0.0}
    memory = driver.regressor.initial()
    # A model with memory has one state for each of the interleaved rows dt apart.
    carry |= {f"m{p}_{key}": value for p in range(setting.substeps) for key, value in memory.items()}
    gain = _gain(setting.smoothing, setting.cutoff, setting.tick)

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        """Shift the lines, gather z, foretell."""
        fine: Scalar = 1.0
        for name in inputs:
            fine = both(fine, ok[name] > 0.5)
        new: Scalars = {}
        for name in lines:
            before = carry[f"{name}_0"]
            started = carry["filled"] > 0.5
            value = u[name] if gain == 1.0 else select(started, before + gain * (u[name] - before), u[name])
            # What is not fresh is never looked at; `filled` then starts anew.
            new[f"{name}_0"] = select(ok[name] > 0.5, value, 0.0)
            for k in range(1, depth + 1):
                new[f"{name}_{k}"] = carry[f"{name}_{k - 1}"]
        new["filled"] = select(fine, select(carry["filled"] < depth + 1, carry["filled"] + 1, carry["filled"]), 0.0)
        z = []
        for j, feature in enumerate(driver.features):
            if feature.kind == "preview":
                name = ahead[previews.index(feature)]
                value = select(ok[name] > 0.5, u[name], 0.0)
            else:
                value = new[f"{feature.signal}_{-round(feature.when / setting.tick)}"]
            z.append((value - float(driver.scaling.mean[j])) / float(driver.scaling.size[j]))
        valid = new["filled"] > depth + 0.5
        if "longitudinal_speed" in inputs and setting.slowest > 0:
            speed = select(ok["longitudinal_speed"] > 0.5, u["longitudinal_speed"], 0.0)
            valid = both(valid, speed * speed >= setting.slowest**2)
        phase = carry["phase"]
        here = {key: _chosen([carry[f"m{p}_{key}"] for p in range(setting.substeps)], phase) for key in memory}
        moved, mean, sd = driver.regressor.step(here, z)
        for key, value in memory.items():
            for p in range(setting.substeps):
                mine = both(phase > p - 0.5, phase < p + 0.5)
                new[f"m{p}_{key}"] = select(mine, select(valid, moved[key], float(value)), carry[f"m{p}_{key}"])
        new["phase"] = select(phase > setting.substeps - 1.5, 0.0, phase + 1)
        torque = driver.scaling.torque_mean + driver.scaling.torque_size * mean
        size = driver.scaling.torque_size * sd
        factor = float(driver.calibration.sd(1.0))  # type: ignore[arg-type]
        return {key: new[key] for key in carry}, {
            "driver_torque_ahead": select(valid, torque, 0.0),
            "driver_torque_ahead_sd": select(valid, factor * size, 0.0),
            "valid": select(valid, 1.0, 0.0),
        }

    outputs = (
        Output("driver_torque_ahead", "N*m", "estimate", f"the driver's torque {setting.horizon:g} s ahead"),
        Output("driver_torque_ahead_sd", "N*m", "sd", "its standard deviation"),
        Output("valid", "1", "flag", "all signals have been there long enough, and the vehicle moves"),
    )
    settings: dict[str, str | float] = {
        "driver": driver.name, "model": driver.kind, "horizon": setting.horizon, "road_step": setting.dt,
    }  # fmt: skip
    return Observer(f"driver-{driver.kind}", setting.tick, inputs, (), carry, outputs, step, settings=settings)


def _speed(driver: LearnedDriver) -> tuple[str, ...]:
    """The speed, where the features do not hold it and a preview or the least speed needs it."""
    return ("longitudinal_speed",) if "longitudinal_speed" in driver.signals else ()


def _gain(smoothing: str, cutoff: float, dt: float) -> float:
    from math import expm1

    return 1.0 if smoothing == "none" else -expm1(-cutoff * dt)


def _chosen(values: list[Scalar], index: Scalar) -> Scalar:
    """values[index] for an index that is a whole number."""
    found = values[0]
    for k, value in enumerate(values[1:], 1):
        found = select(index > k - 0.5, value, found)
    return found
