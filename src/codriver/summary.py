"""An estimate in figures: what the terminal shows, --json prints and the report tells, so that they say the same."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from codriver.estimate import Estimate
from codriver.signals.signal import Array
from codriver.trust import Check

SPEED = "longitudinal_speed"
SHARES = ("braking", "both_pedals", "standstill")
HANDS = "hands_on"  # a probability; counted where it is above 0.5
MOST_SPANS = 3  # named in a line of text; more are for the report


@dataclass(frozen=True)
class Figures:
    """One estimated signal over the valid ticks, in SI; None where nothing is valid, or there is no band.

    Attributes:
        unit: SI.
        rms: root mean square.
        p5, p95: quantiles.
        mean_sd: mean of the standard deviations.
    """

    unit: str
    rms: float | None
    p5: float | None
    p95: float | None
    mean_sd: float | None


@dataclass(frozen=True)
class Summary:
    """What an estimate says of a drive.

    Attributes:
        duration: of the ticks, s.
        rate: ticks per second.
        distance: travelled, m: of the measured speed; where that is missing, of the estimated one. None without either.
        valid_share: share of the ticks that are valid.
        estimates: figures of each estimate, by its name.
        gear_shifts: their number; None where the estimator has no such flag.
        shares: of the ticks, by flag: those of SHARES that the estimator has; `hands_on` of the valid ticks.
    """

    duration: float
    rate: float
    distance: float | None
    valid_share: float
    estimates: Mapping[str, Figures]
    gear_shifts: int | None
    shares: Mapping[str, float]

    def to_dict(self) -> dict[str, object]:
        """As JSON holds it; what the estimator has no flag for is left out."""
        found: dict[str, object] = {
            "duration_s": round(self.duration, 3),
            "distance_m": round(self.distance, 1) if self.distance is not None else None,
            "rate_hz": round(self.rate, 6),
            "valid_share": round(self.valid_share, 4),
        }
        if self.gear_shifts is not None:
            found["gear_shifts"] = self.gear_shifts
        found |= {f"{flag}_share": round(share, 4) for flag, share in self.shares.items()}
        return found | {"estimates": {name: vars(figures) for name, figures in self.estimates.items()}}


def summarise(estimate: Estimate) -> Summary:
    """The figures of an estimate.

    Raises:
        MissingSignal: the flag `valid` was left out of its outputs.
    """
    valid, n = estimate.valid, len(estimate.grid)
    shifts = None
    if "gear_shift" in estimate:
        # Those that begin within the drive: a clutch that is open at the start is no shift.
        shifts = int(np.sum(np.diff(estimate.flag("gear_shift").astype(int)) == 1))
    shares = {flag: float(estimate.flag(flag).mean()) if n else 0.0 for flag in SHARES if flag in estimate}
    if HANDS in estimate and valid.any():
        # A probability has no size to sum up; how often hands are on is what a reader wants.
        shares[HANDS] = float((estimate.columns[HANDS][valid] > 0.5).mean())
    return Summary(
        n * estimate.grid.dt,
        1 / estimate.grid.dt,
        _distance(estimate),
        float(valid.mean()) if n else 0.0,
        {o.name: _figures(estimate, o.name, o.unit) for o in estimate.estimates if o.name != HANDS},
        shifts,
        shares,
    )


def tell_findings(check: Check) -> list[dict[str, str]]:
    """Severity and text of each finding; with the times of the log that a fault is about, where these are few."""
    told = []
    for finding in check.findings:
        where = ""
        if finding.severity != "ok" and 0 < len(finding.spans) <= MOST_SPANS:
            where = f" ({', '.join(f'{start:.1f}-{stop:.1f}' for start, stop in finding.spans)} s)"
        told.append({"severity": finding.severity, "text": finding.text + where})
    return told


def _figures(estimate: Estimate, name: str, unit: str) -> Figures:
    values, sd = estimate.columns[name][estimate.valid], estimate.sd(name)
    if not values.size:
        return Figures(unit, None, None, None, None)
    low, high = np.quantile(values, [0.05, 0.95])
    mean_sd = None if sd is None else _finite(np.mean(sd[estimate.valid]))
    return Figures(unit, _finite(np.sqrt(np.mean(values**2))), _finite(low), _finite(high), mean_sd)


def _finite(value: np.floating) -> float | None:
    """A number; None for what JSON does not know."""
    return float(value) if np.isfinite(value) else None


def _distance(estimate: Estimate) -> float | None:
    """Distance of the measured speed, bridged by the estimated one, m."""
    grid = estimate.grid
    estimated = estimate.columns.get(SPEED)
    if SPEED not in estimate.log or not len(estimate.log[SPEED]) or not len(grid):
        measured = None
    else:
        measured = measured_on_ticks(estimate, SPEED)
    if measured is None and estimated is None:
        return None
    speed = np.full(len(grid), np.nan) if measured is None else measured
    if estimated is not None:
        speed = np.where(np.isfinite(speed), speed, estimated)
    return float(np.nansum(np.abs(speed)) * grid.dt)


def measured_on_ticks(estimate: Estimate, name: str) -> Array:
    """A signal of the log on the estimate's ticks, NaN where it is missing or too old, shape (n,).

    It need not be among the estimator's inputs.
    """
    grid = estimate.grid
    if name not in grid.values:
        grid = estimate.log.sample([name], grid.dt, start=float(grid.time[0]), stop=float(grid.time[-1]))
    values = np.full(len(estimate.grid), np.nan)
    n = min(len(grid), values.size)
    values[:n] = np.where(grid.held[name], grid.values[name], np.nan)[:n]
    return values
