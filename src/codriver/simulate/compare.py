"""Estimators of the intention side by side on one simulated drive, with all that speaks for and against each.

Root mean square errors of the jerk, each beside that of always answering zero:

    moment   against the truth of the moment; a lag counts as error
    matched  against the same observer fed ideal signals of the truth (`judge.delay_matched`); the lag is taken out
    shifts   `matched`, inside gear shifts
    around   `matched`, inside gear shifts and in the second after each, in which the observer still answers to it

and the best correlation with the truth over lags from 0 to 2 s, with the lag where it is reached. Each against two truths:
the intention as the model defines it ("model"), and the driver's plan ("plan"), which knows nothing of gears and pedals. All
estimators are judged on the same ticks: those where every one of them is valid.

`pedals-only` has no observer, and no ideal signals lag as the fused estimators do, so nothing is there to match; they are
judged by moment and correlation alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from codriver.estimate import Estimate
from codriver.observers import build
from codriver.program import compile
from codriver.signals import Log
from codriver.signals.grid import Flags
from codriver.signals.signal import Array
from codriver.simulate.judge import at, delay_matched, rms
from codriver.vehicles import Vehicle

Truth = Literal["model", "plan"]
TRUTHS: Mapping[Truth, tuple[str, str]] = {
    "model": ("intentional_acceleration", "intentional_jerk"),
    "plan": ("planned_acceleration", "planned_jerk"),
}
AFTER = 1.0  # a shift counts from its start to this many seconds after its end
LONGEST_LAG, LAG_STEP = 2.0, 0.02  # s
FLAT = 1e-10  # share of a sum of squares below which its spread is rounding
KNOBLESS = "pedals-only"
UNMATCHED = (KNOBLESS, "intent-fused", "fused-torque")


@dataclass(frozen=True)
class Score:
    """One estimator at one ell against one truth; errors in m/s^3, rms.

    Attributes:
        estimator, ell, truth: what was judged against what; ell None where there is no knob.
        moment, zero: error against the truth of the moment, and that of answering zero.
        correlation, lag: the best correlation with the truth, and the lag where it is reached, s.
        matched, matched_zero: with the lag taken out, and that of answering zero; None where nothing can be matched.
        shifts, shifts_zero: the same inside gear shifts.
        around, around_zero: the same inside gear shifts and in the second after each.
    """

    estimator: str
    ell: float | None
    truth: Truth
    moment: float
    zero: float
    correlation: float
    lag: float
    matched: float | None = None
    matched_zero: float | None = None
    shifts: float | None = None
    shifts_zero: float | None = None
    around: float | None = None
    around_zero: float | None = None


def run_estimators(
    log: Log,
    vehicle: Vehicle,
    names: Sequence[str],
    ells: Sequence[float],
    *,
    dt: float = 0.01,
    preset: str | None = None,
) -> dict[tuple[str, float | None], Estimate]:
    """Estimates of several estimators at several ell, all on the same ticks; by (name, ell).

    Args:
        log: the drive.
        vehicle: for those that need one.
        names: of estimators; `pedals-only` is run once, with ell None.
        ells: the knob.
        dt: tick, s.
        preset: noise; None takes each estimator's own.
    """
    main = ("longitudinal_acceleration", "longitudinal_speed")
    start = min(float(log[name].time[0]) for name in main)
    stop = min(float(log[name].time[-1]) for name in main)
    made = {}
    for name in names:
        for ell in (None,) if name == KNOBLESS else ells:
            observer = build(name, vehicle, dt=dt, ell=ell, preset=None if name == KNOBLESS else preset)
            made[name, ell] = compile(observer).run(log, start=start, stop=stop)
    return made


def compare(estimates: Mapping[tuple[str, float | None], Estimate], truth: Log) -> list[Score]:
    """Judge estimates of `run_estimators` against a truth (`truth_log`)."""
    first = next(iter(estimates.values()))
    use = np.logical_and.reduce([estimate.valid for estimate in estimates.values()])
    inside, around = (use & shifting(truth, first.time, after) for after in (0.0, AFTER))
    scores = []
    for of, (acceleration, jerk) in TRUTHS.items():
        moment = at(truth, jerk, first.time)
        # Observers of one ell that miss their inputs on the same ticks have the same reference.
        matched: dict[tuple[float | None, bytes], Array] = {}
        for (name, ell), estimate in estimates.items():
            ours = jerk_of(estimate)
            correlation, lag = best_lag(ours, moment, use, first.grid.dt)
            score = Score(name, ell, of, rms((ours - moment)[use]), rms(moment[use]), correlation, lag)
            if name not in UNMATCHED:
                key = ell, estimate.columns.get("inputs_known", np.ones(0)).tobytes()
                if key not in matched:
                    matched[key] = delay_matched(estimate, truth, acceleration).columns["intentional_jerk"]
                wanted = matched[key]
                score = Score(
                    name, ell, of, score.moment, score.zero, correlation, lag,
                    *(f for part in (use, inside, around) for f in (rms((ours - wanted)[part]), rms(wanted[part]))),
                )  # fmt: skip
            scores.append(score)
    return scores


def jerk_of(estimate: Estimate) -> Array:
    """The jerk an estimate gives, be it the driver's or the vehicle's; m/s^3, shape (n,)."""
    name = "intentional_jerk" if "intentional_jerk" in estimate else "longitudinal_jerk"
    return estimate.columns[name]


def shifting(truth: Log, time: Array, after: float = AFTER) -> Flags:
    """Where a gear shift goes on or was over less than `after` seconds ago; at times (s, shape (n,))."""
    active = truth["shift"].time[truth["shift"].values != 0]
    if not active.size:
        return np.zeros(time.size, bool)
    newest = np.searchsorted(active, time, side="right") - 1
    # A sample of the truth stands for the hundredth of a second after it.
    return np.asarray((newest >= 0) & (time - active[np.maximum(newest, 0)] < max(after, 0.01)))


def best_lag(estimate: Array, truth: Array, use: Flags, dt: float) -> tuple[float, float]:
    """The best correlation of an estimate with an earlier truth over the lags, and the lag, s; over the ticks of `use`.

    At lag l, over the n ticks k >= l of `use`, from sums of x_k = estimate_k and y_k = truth_{k-l}, each less its mean over
    the drive, so that little cancels:

        r = (n S_xy - S_x S_y) / sqrt((n S_xx - S_x^2) (n S_yy - S_y^2))
    """
    best = (-1.0, 0.0)
    if not use.any():
        return best
    counted = use.astype(float)
    x = np.where(use, estimate - estimate[use].mean(), 0.0)
    y = truth - truth.mean()
    squares = y * y
    later = [np.cumsum(part[::-1])[::-1] for part in (counted, x, x * x)]  # sums over the ticks from l on
    step = max(1, round(LAG_STEP / dt))
    for lag in range(0, min(round(LONGEST_LAG / dt), truth.size - 2) + 1, step):
        n, s_x, s_xx = (float(part[lag]) for part in later)
        earlier, chosen = slice(0, truth.size - lag), counted[lag:]
        s_y, s_yy, s_xy = chosen @ y[earlier], chosen @ squares[earlier], x[lag:] @ y[earlier]
        spread_x, spread_y = n * s_xx - s_x * s_x, n * s_yy - s_y * s_y
        # What rounding leaves of a signal that does not vary is no spread.
        if n > 2 and spread_x > FLAT * n * s_xx and spread_y > FLAT * n * s_yy:
            best = max(best, (float((n * s_xy - s_x * s_y) / np.sqrt(spread_x * spread_y)), lag * dt))
    return best
