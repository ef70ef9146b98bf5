"""A preset of one's own from recorded drives: by maximum likelihood, by a requested delay, or both.

    likelihood   Q and R are those under which the rows are most likely, for the ell of the preset begun with
    delay        ell is that at which slow changes of the jerk are so late
    both         first the one, then, with the noise found, the other

The likelihood judges how well the next row is foreseen, some 10 ms ahead. That is not what one wants of an estimate of the
intention, so look at the delay that comes out before you use it (docs/tuning.md has figures).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
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
from codriver.trust import Check
from codriver.tune.curve import ELLS, Point, calm_jerk, point, sensor_noise, ticks_between
from codriver.tune.drives_fit import refuse_doubtful, refuse_short, refuse_stuck
from codriver.tune.knob import KnobProfile, ell_for_delay, likely_ell
from codriver.tune.likelihood import Evidence, Likelihood, whole_blocks
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

    @property
    def blocks(self) -> int:
        """Whole blocks that the time that counts makes up; standard errors need LEAST_BLOCKS."""
        return whole_blocks(self.seconds)


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
    judge: Callable[[Estimate], Check] = Estimate.check,
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
        judge: the verdict on an estimate; by default what it says of itself (`check()`).

    Raises:
        UsageError: an option that cannot be, or an estimator without noise to tune.
        MissingSignal: a log lacks a signal.
        VehicleError: the vehicle is missing, or lacks a parameter.
        LogError: too little of the drives counts, their data contradict themselves, or a sensor is stuck.
        DesignError: there is no filter for the preset begun with.
    """
    fit = _asked(logs, delay, likelihood, rate)
    if isinstance(vehicle, (str, Path)):
        vehicle = load_vehicle(vehicle)
    chosen_name, measured = _chosen(estimator, logs[0], vehicle)
    begun = find_preset(preset if preset is not None else _DEFAULT)
    dt = 1.0 / (rate or max(suggest_rate(log, measured) for log in logs))

    def runs(noise: Preset, ell: float) -> list[Estimate]:
        program = compile(build(chosen_name, vehicle, dt=dt, ell=ell, preset=noise))
        return [program.run(log) for log in logs]

    first = runs(begun, begun.ell)
    refuse_stuck(first)
    rows = Likelihood(first)
    profile = likely_ell(rows, begun)
    refuse_doubtful(first, lambda: runs(begun, profile.best), judge)
    fitted = None
    if fit:
        refuse_short(rows)
        fitted = fit_noise(rows, begun, name, "by maximum likelihood", profile.best)
    noise = _named(fitted.preset if fitted is not None else begun, name, begun, delay, logs, fit)
    last = runs(noise, noise.ell)
    return Tuning(
        chosen_name, vehicle.name if vehicle is not None else "", tuple(_short(log) for log in logs), rows.seconds, dt,
        ticks_between(first), sensor_noise(first), begun, noise, delay, fitted, profile, rows.at(noise, noise.ell),
        *_place(begun, first, noise, last, runs), whiteness(first), whiteness(last),
    )  # fmt: skip


def _asked(logs: Sequence[Log], delay: float | None, likelihood: bool | None, rate: float | None) -> bool:
    """Whether Q and R are to be fitted.

    Raises:
        UsageError: nothing is asked for, or what cannot be.
    """
    if not logs:
        raise UsageError("no drives", "at least one", "give a recording")
    if delay is None and likelihood is False:
        raise UsageError("neither a delay nor the likelihood", "one of them at least", "say what to tune by")
    check_rate(rate)
    return bool(likelihood) or (likelihood is None and delay is None)


def _chosen(estimator: str, log: Log, vehicle: Vehicle | None) -> tuple[str, tuple[str, ...]]:
    """The estimator meant, and what it measures.

    Raises:
        UsageError: there is none of that name, or it has no noise to tune.
        MissingSignal: the log feeds none.
        VehicleError: the vehicle is missing, or lacks a parameter.
    """
    name, _ = choose(estimator, log, vehicle)
    probe = build(name, vehicle)
    # A fused estimator carries these states by other names: its ell is that of another filter.
    if not {f"x_{state}" for state in STATES} <= set(probe.carry):
        raise UsageError(
            f"{name} has no noise that could be tuned so",
            "intent-pedals, intent-torque or kinematic",
            "choose one",
        )
    return name, probe.measured


def _named(noise: Preset, name: str, begun: Preset, delay: float | None, logs: Sequence[Log], fitted: bool) -> Preset:
    """The preset with its name, where it comes from, and the ell for the delay asked for.

    Raises:
        UsageError: no ell has that delay.
    """
    source = f"tuned on {', '.join(_short(log) for log in logs)}, from {begun.name}"
    source += ", by maximum likelihood" if fitted else ""
    if delay is None:
        return replace(noise, name=name, source=source)
    source += f", ell for a delay of {delay:g} s"
    return replace(noise, name=name, source=source, ell=ell_for_delay(noise, delay))


def _place(
    begun: Preset, first: Sequence[Estimate], noise: Preset, last: Sequence[Estimate],
    runs: Callable[[Preset, float], list[Estimate]],
) -> tuple[tuple[Point, ...], tuple[Point, ...], tuple[Point, ...], Point]:  # fmt: skip
    """The curves of the noise found and of that begun with, the usual settings and the one chosen."""
    dt, every, sensors = first[0].grid.dt, ticks_between(first), sensor_noise(first)

    def at(preset: Preset, ell: float, measured: Sequence[Estimate] | None = None) -> Point:
        return point(preset, ell, dt, every, sensors, calm_jerk(measured) if measured is not None else None)

    marks = tuple(at(begun, ell, first if ell == begun.ell else runs(begun, ell)) for ell in USUAL)
    own = at(noise, noise.ell, last)
    # The curve goes through the same delays for either noise.
    per_ell = own.slow_delay * noise.ell / (marks[0].slow_delay * marks[0].ell)
    curve = tuple(at(noise, min(ell * per_ell, 100.0)) for ell in ELLS)
    return curve, tuple(at(begun, ell) for ell in ELLS), marks, own


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
