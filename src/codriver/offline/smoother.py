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

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from codriver.errors import UsageError
from codriver.estimate import Estimate
from codriver.models import intention_model
from codriver.observers import build
from codriver.observers.feed import suggest_rate
from codriver.observers.jerk import SLOW
from codriver.observers.jerk_forms import ROWS, SETTLED, STATES
from codriver.observers.observer import Observer, Output, Scalars
from codriver.observers.scaled_gain import Preset
from codriver.offline.conditional import PAIRS
from codriver.offline.passes import P, X, fixed_interval, fixed_lag
from codriver.program import compile, provenance
from codriver.run import choose
from codriver.signals import Log
from codriver.signals.signal import Array
from codriver.trust import Check, check_estimate
from codriver.vehicles import Vehicle, load_vehicle

SECOND = 1.0  # s for which a filter was valid before its innovations are judged; until then they tell of its start
_MEANS = [f"x_{state}" for state in STATES]
_COVARIANCES = [f"P_{STATES[i]}_{STATES[j]}" for i, j in PAIRS]


@dataclass(frozen=True, eq=False)
class SmoothedEstimate(Estimate):
    """An estimate that looks ahead. It is not causal, so there is no live form and no C of it.

    Attributes:
        lag: how far ahead it looks, s; None for the whole stretch.
        filter_valid: the flag `valid` of the filter that ran first, shape (n,): where its innovations can be judged.
    """

    lag: float | None
    filter_valid: Array = field(repr=False)

    def check(self) -> Check:
        """Whether to trust it: what the flags say, and the innovations since the filter was valid for a second."""
        ticks = np.arange(len(self.grid))
        unsettled = np.maximum.accumulate(np.where(self.filter_valid > 0.5, -ticks.size, ticks))
        judged = ticks - unsettled > SECOND / self.grid.dt
        columns = dict(self.columns)
        for row in ROWS:
            columns[f"{row}_used"] = columns[f"{row}_used"] * judged
        return check_estimate(columns, self.outputs, self.grid, self.measured, self.log, self._knob())


def smooth(
    log: Log,
    estimator: str = "intent-pedals",
    vehicle: Vehicle | str | Path | None = None,
    *,
    dt: float | None = None,
    ell: float | None = None,
    preset: str | Path | Preset | None = None,
    lag: float | None = None,
) -> SmoothedEstimate:
    """Estimate from a log with hindsight.

    Args:
        log: the signals.
        estimator: one with the observer of the intention, or a family: then the best of it that log and vehicle feed.
        vehicle: its parameters, where the estimator needs some.
        dt: tick, s; None takes that of the quickest measurement.
        ell, preset: as for `build`. Without a lag to fear, ell is how quick the intention itself changes.
        lag: how far ahead to look, s, rounded to ticks; 0 is the filter, None the whole stretch.

    Raises:
        UsageError: an option that cannot be, or an estimator without this observer.
        MissingSignal: the log lacks a signal.
        VehicleError: the vehicle is missing, or lacks a parameter.
        DesignError: the design fails its certificate.
    """
    if lag is not None and not 0 <= lag < float("inf"):
        raise UsageError(
            f"a lag of {lag:g} s", "a number of seconds, 0 or more", "leave it out to look at the whole drive"
        )
    if isinstance(vehicle, (str, Path)):
        vehicle = load_vehicle(vehicle)
    name, _ = choose(estimator, log, vehicle)
    observer = build(name, vehicle, dt=dt if dt is not None else 0.01, ell=ell, preset=preset)
    if [key for key in observer.carry if key in _MEANS or key in _COVARIANCES] != [*_MEANS, *_COVARIANCES] or (
        sum(key.startswith("x_") for key in observer.carry) != len(_MEANS)
    ):
        raise UsageError(
            f"{name} cannot be smoothed: it has no Kalman filter of {', '.join(STATES)}",
            "intent-pedals, intent-torque or kinematic", "choose one of these",
        )  # fmt: skip
    tick = dt if dt is not None else 1.0 / suggest_rate(log, observer.measured)
    if tick != observer.dt:
        observer = build(name, vehicle, dt=tick, ell=ell, preset=preset)
    return _smoothed(compile(_with_memory(observer)).run(log), observer, lag)


def _with_memory(observer: Observer) -> Observer:
    """The observer with its carried means and covariances among the outputs."""

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        new, out = observer.step(carry, u, y, ok, rho)
        return new, {**out, **{name: new[name] for name in shown}}

    shown = [*_MEANS, *_COVARIANCES]
    return replace(observer, outputs=(*observer.outputs, *(Output(name, "", "input") for name in shown)), step=step)


def _smoothed(run: Estimate, observer: Observer, lag: float | None) -> SmoothedEstimate:
    """The smoothed estimate, from the filter's run with its memory shown."""
    columns, n, dt = dict(run.columns), len(run.grid), run.grid.dt
    memory = {name: columns.pop(name) for name in (*_MEANS, *_COVARIANCES)}
    standing, lost = run.flag("standstill"), ~run.flag("inputs_known")
    started = np.logical_or.accumulate(run.flag("speed_used"))
    moving = started & ~standing & ~lost
    known = np.where(standing, 0.0, columns["known_input"])
    filtered: dict[str, Array] = dict(zip([*X, *P], memory.values(), strict=True))
    filtered["shift"] = 0.5 * dt * (known + np.append(known[1:], 0.0))
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
