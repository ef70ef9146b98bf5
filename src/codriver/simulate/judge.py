"""How far an estimate is from a simulated truth.

A causal observer lags, so its error against the truth of the moment is mostly lag: always answering zero can look better.
The fair reference is delay-matched: the same observer fed with ideal signals of the truth, which lags alike and has no
noise and no model error. It gets each measurement when the log has it: how far the Kalman form lags depends on the rates
of its rows (docs/sampling.md), and a reference with both rows on every tick would lag less. Both are given, beside the
answer zero and the kinematic model on the same log; and the share of time in which the truth of the moment lies in the
95 % band.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from codriver.errors import UsageError
from codriver.estimate import Estimate
from codriver.names import VOCABULARY
from codriver.observers import build, design_scaled_gain
from codriver.observers.intent import INTENTION
from codriver.observers.jerk import jerk_observer
from codriver.observers.preset_file import preset_of
from codriver.program import compile
from codriver.signals import Log, Signal
from codriver.signals.signal import Array


@dataclass(frozen=True)
class Judgement:
    """One comparison, over the ticks where the estimate is valid.

    Attributes:
        what: the quantity, and against what.
        unit: SI.
        error: root mean square error.
        zero: that of answering zero.
        kinematic: that of the kinematic model's acceleration or jerk.
        coverage: share of ticks whose truth lies within 1.96 standard deviations; None where that is not the question.
    """

    what: str
    unit: str
    error: float
    zero: float
    kinematic: float | None
    coverage: float | None


def judge(estimate: Estimate, truth: Log) -> list[Judgement]:
    """Hold an estimate of the intention against a simulated truth (`truth_log`).

    Args:
        estimate: of intent-pedals or intent-torque.
        truth: with intentional_acceleration, intentional_jerk, planned_jerk, longitudinal_speed,
            longitudinal_acceleration (dv/dt), acceleration_offset and known_input.

    Raises:
        UsageError: see `delay_matched`.
    """
    settings = estimate.provenance
    ell, dt, preset = float(settings["ell"]), estimate.grid.dt, preset_of(settings)
    other = compile(build("kinematic", dt=dt, ell=ell, preset=preset, form=settings["form"])).run(
        estimate.log, start=float(estimate.time[0]), stop=float(estimate.time[-1])
    )
    valid = estimate.valid
    rivals = {"intentional_acceleration": "longitudinal_acceleration", "intentional_jerk": "longitudinal_jerk"}
    rows = []
    for name, unit, label in (
        ("intentional_acceleration", "m/s^2", "intentional acceleration, the moment's"),
        ("intentional_jerk", "m/s^3", "intentional jerk, the moment's"),
    ):
        rows.append(
            _row(estimate, other, name, unit, label, at(truth, name, estimate.time), rivals[name], valid, banded=True)
        )
    for of, label in (("model", "intentional jerk, lag taken out"), ("plan", "driver's planned jerk, lag taken out")):
        wanted = "intentional_acceleration" if of == "model" else "planned_acceleration"
        lagged = delay_matched(estimate, truth, wanted).columns["intentional_jerk"]
        rows.append(
            _row(estimate, other, "intentional_jerk", "m/s^3", label, lagged, "longitudinal_jerk", valid, banded=False)
        )
    offset = at(truth, "acceleration_offset", estimate.time)
    rows.append(
        _row(estimate, None, "acceleration_offset", "m/s^2", "accelerometer offset", offset, "", valid, banded=True)
    )
    return rows


def delay_matched(estimate: Estimate, truth: Log, intention: str) -> Estimate:
    """The observer's answer to ideal signals whose intention is the truth's signal `intention`, on the estimate's ticks.

    The ideal signals are v and v' + o_a, at the stamps that the estimate's log has for them, and u = v' - intention. Where the
    estimate's inputs were missing the ideal observer is told so: it then opens its gains and lags as little as the estimate
    does, but it has the true u, so what the missing inputs do to the estimate stays an error.

    Raises:
        UsageError: the estimate is one of intent-fused, whose lag follows the noise of the pedals; ideal signals have none.
    """
    settings = estimate.provenance
    if "rest_ell" in settings:
        raise UsageError(
            f"an estimate of {settings['estimator']}, which is quicker the less noise its pedals have",
            "an estimate of intent-pedals or intent-torque, for no ideal signals lag as the fused one does",
            "judge it by its best correlation with the truth and the lag of that, as docs/fused.md does",
        )
    stamps = {name: estimate.log[name].time for name in ("longitudinal_speed", "longitudinal_acceleration")}
    made = {name: at(truth, name, time) for name, time in stamps.items()}
    made["longitudinal_acceleration"] += at(truth, "acceleration_offset", stamps["longitudinal_acceleration"])
    signals = [Signal(name, time, made[name], VOCABULARY[name].unit) for name, time in stamps.items()]
    clock = truth["longitudinal_speed"].time
    known = truth["longitudinal_acceleration"].values - truth[intention].values
    signals += [Signal("known_input", clock, known, ""), Signal("direction", clock, 1.0 + 0 * known, "")]
    there = estimate.columns.get("inputs_known", np.ones(len(estimate.grid)))
    signals.append(Signal("inputs_known", estimate.time, there, ""))
    design = design_scaled_gain(preset_of(settings), estimate.grid.dt, float(settings["ell"]))
    program = compile(jerk_observer(design, settings["form"], INTENTION, "ideal"))
    grid = Log.of(signals, "ideal signals").sample(
        program.observer.channels, estimate.grid.dt, start=float(estimate.time[0]), stop=float(estimate.time[-1])
    )
    return Estimate("ideal", grid, program.run_grid(grid), INTENTION, program.observer.measured, settings, estimate.log)


def at(log: Log, name: str, time: Array) -> Array:
    """A signal of the log at other times, straight between samples."""
    return np.interp(time, log[name].time, log[name].values)


def _row(
    estimate: Estimate, other: Estimate | None, name: str, unit: str, label: str, truth: Array, rival: str,
    valid: npt.NDArray[np.bool_], *, banded: bool,
) -> Judgement:  # fmt: skip
    error = estimate.columns[name] - truth
    sd = estimate.sd(name) if banded else None
    inside = float(np.mean(np.abs(error[valid]) <= 1.96 * sd[valid])) if sd is not None and valid.any() else None
    n = min(len(truth), len(other.grid)) if other is not None else 0
    against = rms((other.columns[rival][:n] - truth[:n])[valid[:n]]) if other is not None else None
    return Judgement(label, unit, rms(error[valid]), rms(truth[valid]), against, inside)


def rms(x: Array) -> float:
    """Root mean square; NaN of nothing."""
    return float(np.sqrt(np.mean(x**2))) if x.size else float("nan")
