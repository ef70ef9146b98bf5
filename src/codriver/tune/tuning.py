"""A preset of one's own from recorded drives: by maximum likelihood, by a requested delay, or both.

    likelihood   Q and R are those under which the rows are most likely, for the ell of the preset begun with
    delay        ell is that at which slow changes of the jerk are so late
    both         first the one, then, with the noise found, the other

The likelihood judges how well the next row is foreseen, some 10 ms ahead. That is not what one wants of an estimate of the
intention, so look at the delay that comes out before you use it (docs/tuning.md has figures).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePath

import numpy as np

from codriver.errors import UsageError
from codriver.estimate import Estimate
from codriver.observers import build, find_preset
from codriver.observers.feed import suggest_rate
from codriver.observers.jerk_forms import ROWS, STATES
from codriver.observers.scaled_gain import Preset
from codriver.program import compile
from codriver.run import check_rate, choose
from codriver.signals import Log
from codriver.signals.signal import Array
from codriver.tune.curve import ELLS, Point, calm_jerk, point, sensor_noise, ticks_between
from codriver.tune.knob import KnobProfile, ell_for_delay, likely_ell
from codriver.tune.likelihood import Evidence, Likelihood
from codriver.tune.noise import NoiseFit, fit_noise
from codriver.vehicles import Vehicle, load_vehicle

USUAL = (1.0, 2.0, 3.0)  # ells that the curve is marked at
LONGEST_LAG = 1.0  # s, of the innovations' autocorrelation
_DEFAULT = "bisoffi2017"


@dataclass(frozen=True, eq=False)
class Whiteness:
    """How the normalised innovations of a row scatter and follow one another, where the estimate is valid.

    Attributes:
        row: its name.
        scatter: their root mean square; 1 where they are as large as the filter says.
        lag: s, shape (m,).
        correlation: with those so much later, shape (m,); 0 where they are white.
    """

    row: str
    scatter: float
    lag: Array
    correlation: Array


@dataclass(frozen=True, eq=False)
class Tuning:
    """What was tuned, and where it lies.

    Attributes:
        estimator, vehicle: names; vehicle "" where none was given.
        logs: where the drives came from.
        seconds: in which rows counted.
        dt: tick, s.
        every: ticks from row to row, of accelerometer and speed.
        sensors: standard deviation of their samples, m/s^2 and m/s.
        begun: the preset begun with.
        preset: the result; its ell is the chosen one.
        delay: the delay that was asked for, s; None where none was.
        noise: the fit of Q and R; None where they were left as they are.
        profile: the likelihood along ell with the Q and R of the preset begun with.
        evidence: for the result.
        curve, begun_curve: delay against noise for the result's noise and that begun with.
        marks: the settings of USUAL of the preset begun with, with their measured noise.
        chosen: the result's, likewise.
        before, after: the innovations, by row.
    """

    estimator: str
    vehicle: str
    logs: tuple[str, ...]
    seconds: float
    dt: float
    every: tuple[int, int]
    sensors: tuple[float, float]
    begun: Preset
    preset: Preset
    delay: float | None
    noise: NoiseFit | None
    profile: KnobProfile
    evidence: Evidence
    curve: tuple[Point, ...]
    begun_curve: tuple[Point, ...]
    marks: tuple[Point, ...]
    chosen: Point
    before: tuple[Whiteness, ...]
    after: tuple[Whiteness, ...]


def tune(
    logs: Sequence[Log],
    estimator: str = "intent",
    vehicle: Vehicle | str | Path | None = None,
    *,
    preset: str | Path | Preset | None = None,
    delay: float | None = None,
    likelihood: bool | None = None,
    rate: float | None = None,
    name: str = "own",
) -> Tuning:
    """Tune the noise and the knob of an estimator of the intention.

    Args:
        logs: recorded drives of one vehicle.
        estimator: intent-pedals, intent-torque or kinematic, or a family: then the best that the first log feeds.
        vehicle: its parameters, where the estimator needs some.
        preset: to begin with; None takes "bisoffi2017".
        delay: wanted of slow changes of the jerk, s.
        likelihood: whether to fit Q and R; by default where no delay is asked for.
        rate: ticks per second; None takes that of the quickest measurement.
        name: of the preset made.

    Raises:
        UsageError: an option that cannot be, or an estimator without noise to tune.
        MissingSignal: a log lacks a signal.
        VehicleError: the vehicle is missing, or lacks a parameter.
        LogError: too little of the drives counts.
        DesignError: there is no filter for the preset begun with.
    """
    if not logs:
        raise UsageError("no drives", "at least one", "give a recording")
    if delay is None and likelihood is False:
        raise UsageError("neither a delay nor the likelihood", "one of them at least", "say what to tune by")
    check_rate(rate)
    if isinstance(vehicle, (str, Path)):
        vehicle = load_vehicle(vehicle)
    chosen_name, _ = choose(estimator, logs[0], vehicle)
    begun = find_preset(preset if preset is not None else _DEFAULT)
    probe = build(chosen_name, vehicle, preset=begun)
    # A fused estimator carries these states by other names: its ell is that of another filter.
    if not {f"x_{state}" for state in STATES} <= set(probe.carry):
        raise UsageError(
            f"{chosen_name} has no noise that could be tuned so",
            "intent-pedals, intent-torque or kinematic",
            "choose one",
        )
    dt = 1.0 / (rate or max(suggest_rate(log, probe.measured) for log in logs))

    def runs(noise: Preset, ell: float) -> list[Estimate]:
        program = compile(build(chosen_name, vehicle, dt=dt, ell=ell, preset=noise))
        return [program.run(log) for log in logs]

    first = runs(begun, begun.ell)
    rows, every, sensors = Likelihood(first), ticks_between(first), sensor_noise(first)
    profile = likely_ell(rows, begun)
    source = f"tuned on {', '.join(_short(log) for log in logs)}, from {begun.name}"
    fitted = None
    if likelihood or (likelihood is None and delay is None):
        fitted = fit_noise(rows, begun, name, f"{source}, by maximum likelihood", profile.best)
    noise = fitted.preset if fitted is not None else replace(begun, name=name, source=source)
    ell = begun.ell if delay is None else ell_for_delay(noise, delay)
    if delay is not None:
        noise = replace(noise, ell=ell, source=f"{noise.source}, ell for a delay of {delay:g} s")
    last = runs(noise, ell)
    at = lambda p, e, r=None: point(p, e, dt, every, sensors, calm_jerk(r) if r is not None else None)  # noqa: E731
    marks = tuple(at(begun, e, first if e == begun.ell else runs(begun, e)) for e in USUAL)
    own = at(noise, ell, last)
    # The curve goes through the same delays for either noise.
    per_ell = own.slow_delay * ell / (marks[0].slow_delay * marks[0].ell)
    return Tuning(
        chosen_name, vehicle.name if vehicle is not None else "", tuple(_short(log) for log in logs), rows.seconds, dt, every,
        sensors, begun, noise, delay, fitted, profile, rows.at(noise, ell),
        tuple(at(noise, min(e * per_ell, 100.0)) for e in ELLS), tuple(at(begun, e) for e in ELLS), marks, own,
        whiteness(first), whiteness(last),
    )  # fmt: skip


def whiteness(runs: Sequence[Estimate]) -> tuple[Whiteness, ...]:
    """Scatter and autocorrelation of the normalised innovations, row by row, over all runs."""
    found = []
    for k, row in enumerate(ROWS):
        pieces, step = [], 1.0
        for run in runs:
            one = run.innovations[k]
            counted = one.sound & run.valid
            pieces.append(one.normalised()[counted])
            ticks = np.diff(np.flatnonzero(counted))
            step = float(np.median(ticks)) * run.grid.dt if ticks.size else run.grid.dt
        most = max(round(LONGEST_LAG / step), 1)
        power = sum(float(np.sum(p**2)) for p in pieces)
        count = sum(p.size for p in pieces)
        lags = np.arange(1, most + 1)
        together = [sum(float(np.sum(p[lag:] * p[:-lag])) for p in pieces if p.size > lag) for lag in lags]
        scale = power if power > 0 else 1.0
        found.append(
            Whiteness(
                row,
                float(np.sqrt(power / max(count, 1))),
                np.asarray(lags * step, dtype=np.float64),
                np.array(together) / scale,
            )
        )
    return tuple(found)


def _short(log: Log) -> str:
    """A recording's name without its folders."""
    return PurePath(log.source.replace("\\", "/")).name or "a recording in memory"
