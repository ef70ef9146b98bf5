"""The intention with hindsight: the Kalman form's model, given the rows that came after, too.

    fixed interval   x_k | all rows of the stretch         Rauch, Tung, Striebel 1965, doi:10.2514/3.3166
    fixed lag        x_k | the rows up to k + lag

The compiled observer runs first and as it is, so known input, shifts, sigma, missing and slower rows are those of the
filter, and so is the last sample. Then the passes go over its means and covariances (`passes`). What it does not look across:

* stretches: moving with known inputs is one stretch, until the car stands or an input is lost. There a_i and j_i begin anew
  (see `observers.jerk`), and rows taken on the other side hold things the model does not know: the road meeting the brake
  force, a u that nobody knows. A stretch ends in its filtered value and nothing behind that reaches back. Where the
  vehicle stands or inputs are lost, the filter's values stay.
* standard deviations: the filter's noise scale of the same tick, times the smoothed variance.
* `valid`: moving faster than 1 m/s, inputs known, and the jerk's variance at most what a settled filter's may be. So the
  first seconds of a stretch, of which the filter knows little, may be valid here.

Innovations and the other flags are the filter's; `check()` judges them where the filter has been valid for a second.
"""

from __future__ import annotations

import numpy as np

from codriver.models import intention_model
from codriver.observers.jerk import SLOW
from codriver.observers.jerk_forms import SETTLED, STATES
from codriver.observers.observer import Observer
from codriver.offline.conditional import pairs
from codriver.offline.passes import Names, fixed_interval, fixed_lag
from codriver.offline.smoothed import SmoothedEstimate, with_memory
from codriver.program import compile, provenance
from codriver.signals import Log
from codriver.signals.signal import Array

_MEANS = [f"x_{state}" for state in STATES]
_COVARIANCES = [f"P_{STATES[i]}_{STATES[j]}" for i, j in pairs(len(STATES))]


def is_intent(observer: Observer) -> bool:
    """Whether it is the Kalman filter of speed, acceleration, offset and jerk, and nothing more."""
    there = [key for key in observer.carry if key in _MEANS or key in _COVARIANCES]
    return there == [*_MEANS, *_COVARIANCES] and sum(key.startswith("x_") for key in observer.carry) == len(_MEANS)


def smooth_intent(observer: Observer, log: Log, lag: float | None) -> SmoothedEstimate:
    """The intention with hindsight.

    Args:
        observer: one that `is_intent` says yes to.
        log: the signals.
        lag: how far ahead to look, s; None for the whole stretch.
    """
    run = compile(with_memory(observer, [*_MEANS, *_COVARIANCES])).run(log)
    columns, n, dt = dict(run.columns), len(run.grid), run.grid.dt
    memory = {name: columns.pop(name) for name in (*_MEANS, *_COVARIANCES)}
    standing, lost = run.flag("standstill"), ~run.flag("inputs_known")
    started = np.logical_or.accumulate(run.flag("speed_used"))
    moving = started & ~standing & ~lost
    known = np.where(standing, 0.0, columns["known_input"])
    names = Names(len(STATES))
    filtered: dict[str, Array] = dict(zip([*names.x, *names.P], memory.values(), strict=True))
    filtered |= dict.fromkeys(names.shift, np.zeros(n))
    filtered[names.shift[0]] = 0.5 * dt * (known + np.append(known[1:], 0.0))
    filtered["wall"] = 1.0 - (moving & np.append(moving[1:], False))

    ticks = n if lag is None else round(lag / dt)
    if ticks:
        plant = intention_model()
        model = plant.transition(dt), plant.process_noise(observer.gains["Q_ell"], dt), dt
        moments = fixed_lag(filtered, *model, ticks) if ticks < n else fixed_interval(filtered, *model)
        estimates = [output.name for output in observer.outputs if output.role == "estimate"]
        scale = columns[f"{estimates[3]}_sd"] ** 2 / memory["P_jerk_jerk"]
        for i, name in enumerate(estimates):
            columns[name] = np.where(moving, moments[f"m{i}"], columns[name])
            # Rounding may leave a variance of 0 a hair below it.
            spread = np.sqrt(scale * np.maximum(moments[f"S{i}{i}"], 0.0))
            columns[f"{name}_sd"] = np.where(moving, spread, columns[f"{name}_sd"])
        sure = moments["S33"] <= SETTLED * float(observer.gains["P"][3, 3])
        columns["valid"] = (moving & sure & (np.abs(columns[estimates[0]]) >= SLOW)).astype(float)
    said = {key: value for key, value in provenance(observer).items() if key != "delay_s"}
    said["smoother"] = "fixed interval" if lag is None else f"fixed lag of {ticks * dt:g} s"
    return SmoothedEstimate(
        f"{observer.name}, smoothed", run.grid, columns, observer.outputs, observer.measured, said, run.log,
        None if lag is None else ticks * dt, run.columns["valid"],
    )  # fmt: skip
