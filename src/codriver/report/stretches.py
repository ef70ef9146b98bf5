"""Stretches of time a reader should know of: where an estimate is not valid and why, where a signal is missing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from codriver.estimate import Estimate
from codriver.names import VOCABULARY
from codriver.report.shown import words

Span = tuple[float, float]


@dataclass(frozen=True)
class Stretch:
    """A stretch of time, (start, stop) in s, and what is the matter."""

    span: Span
    reason: str


def spans(mask: npt.NDArray[np.bool_], estimate: Estimate) -> list[Span]:
    """Stretches of time where a mask on the estimate's ticks holds."""
    return [_span(run, estimate) for run in _runs(mask)]


def _runs(mask: npt.NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Runs of True as (first, one after the last)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    return [(int(i), int(k)) for i, k in zip(edges[::2], edges[1::2], strict=True)]


def _span(run: tuple[int, int], estimate: Estimate) -> Span:
    return float(estimate.time[run[0]]), float(estimate.time[run[1] - 1] + estimate.grid.dt)


def braking(estimate: Estimate) -> npt.NDArray[np.bool_]:
    """Where the driver brakes: as the estimator found, or as the log's brake switch says where the estimator does not."""
    if "braking" in estimate or "brake_switch" not in estimate.log or not len(estimate.grid):
        return estimate.flag("braking")
    grid = estimate.grid
    on = estimate.log.sample(["brake_switch"], grid.dt, start=float(grid.time[0]), stop=float(grid.time[-1]))
    pressed = np.zeros(len(grid), bool)
    n = min(len(on), len(grid))
    pressed[:n] = (on.values["brake_switch"] > 0.5)[:n]
    return pressed


def gaps(estimate: Estimate) -> dict[str, list[Span]]:
    """Where the signals the estimator takes are silent for longer than they may be held, by name.

    From the signals' own stamps: from the last value before the silence to the first after it.
    """
    found: dict[str, list[Span]] = {}
    if not len(estimate.grid):
        return found
    first, last = float(estimate.time[0]), float(estimate.time[-1])
    for name in estimate.grid.values:
        hold = VOCABULARY[name].hold if name in VOCABULARY else 0.5
        if name not in estimate.log or not np.isfinite(hold):
            continue
        signal = estimate.log[name]
        stamps = signal.time[np.isfinite(signal.values)]
        stamps = stamps[(stamps >= first - hold) & (stamps <= last)]
        edges = np.concatenate([[first], stamps, [last]])
        silent = np.flatnonzero(np.diff(edges) > hold)
        if silent.size:
            found[name] = [(float(edges[i]), float(edges[i + 1])) for i in silent]
    return found


def not_valid(estimate: Estimate) -> list[Stretch]:
    """Where the estimate is not valid, and why."""
    n = len(estimate.grid)
    silent = gaps(estimate)
    unknown = ~estimate.flag("inputs_known") if "inputs_known" in estimate else np.zeros(n, bool)
    standing = estimate.flag("standstill")
    slow = np.zeros(n, bool)
    if "longitudinal_speed" in estimate:
        slow = np.abs(estimate.columns["longitudinal_speed"]) < 1.0
    slow &= ~standing
    stopped = estimate.flag("at_end_stop")
    rest = ~(unknown | standing | slow | stopped)
    stretches = []
    for run in _runs(~estimate.valid):
        (start, stop), inside = _span(run, estimate), slice(*run)
        reasons = []
        if standing[inside].mean() > 0.02:
            reasons.append("standing still")
        if slow[inside].mean() > 0.02:
            reasons.append("slower than 1 m/s")
        missing = [words(name) for name, holes in silent.items() if any(a < stop and b > start for a, b in holes)]
        if missing:
            reasons.append(f"{' and '.join(missing)} missing")
        elif unknown[inside].mean() > 0.02:
            reasons.append("inputs unknown (no value yet, or no gear engaged)")
        if stopped[inside].mean() > 0.02:
            reasons.append("the wheel is at its end stop")
        if rest[inside].mean() > 0.02 and not missing:
            reasons.append("the estimate has not settled yet")
        stretches.append(Stretch((start, stop), ", ".join(reasons) or "not valid"))
    return stretches
