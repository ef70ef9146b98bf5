"""c_r from the requested torque over the accelerator pedal (2017, eq. 8b and figure 3).

    T_r = c_r p_r          T_r  requested torque, N m      p_r  pedal, 0 to 1      c_r  N m at the full pedal

Both are low-passed at 5 Hz. What is not the driver's foot is left out: a pedal that is nearly released (idle control, engine
drag, cruise control), gear shifts, a pedal that moves quickly (a control unit that delays the request), and outliers of a
robust fit (rev limiter, interventions). First half to fit, second half to validate.

Whether a straight line through the origin will do is looked at on the rows of the fit: a line with an offset and a parabola are
fitted beside it, and R2 is that of the line through the origin about the mean request. The line is refused where they say that
T_r is no multiple of p_r.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from codriver.errors import LogError
from codriver.finding import Finding
from codriver.identify.brake_rows import halves, short_name
from codriver.identify.brake_verdict import HARDLY
from codriver.identify.low_pass import centred, low_pass, rate
from codriver.identify.plausible import far_from_old, within_file_bounds
from codriver.identify.regression import regress, rms, solve
from codriver.identify.sound import refuse_unsound
from codriver.identify.usable import AFTER_SHIFT, BEFORE_SHIFT, OPEN_CLUTCH, filled, inside, widened
from codriver.signals import Grid, Log
from codriver.signals.grid import Flags
from codriver.signals.signal import Array
from codriver.trust.sensors_agree import sensors_agree
from codriver.vehicles import Vehicle

SIGNALS = ("accelerator_pedal", "engine_torque_request")
RELEASED, FULL = 0.06, 0.98  # of the pedal: below it idle and drag take part; above it the sensor ends
QUICK = 1.0  # 1/s, pedal rate
LEAST_RANGE = 0.1  # of the pedal, between the 2.5 and 97.5 % points
LEAST_R2, GOOD_R2 = 0.8, 0.95
CURVED, BENT = 0.15, 0.05  # greatest distance of parabola and line, as a share of the torque at the greatest pedal
PEDAL_SD = 0.05
REASONS = {
    "missing": "a signal missing or too old",
    "absurd": "values that no vehicle shows",
    "released": "pedal below 6 %: idle control, engine drag, cruise control",
    "full": "pedal at its end",
    "quick": "pedal moving faster than 100 % a second",
    "shift": "gear shifts, clutch not closed, neutral",
    "reverse": "driving in reverse",
}


@dataclass(frozen=True, eq=False)
class PedalFit:
    """What was found.

    Attributes:
        c_r: N m at the full pedal.
        sd, sd_hac: its standard error, from the block bootstrap and from Newey and West's formula.
        low, high: 95 % interval.
        r2: of the line through the origin.
        offset: N m at the released pedal, of a line with an offset.
        curvature: greatest distance of a parabola from the line, as a share of the torque at the greatest pedal.
        findings: what is to say about the line.
        rmse, rmse_old, rmse_constant: of the validation half, N m; with the old c_r (None without one), and of its mean.
        minutes_fit, minutes_validation: used time of the halves.
        share: of all ticks left out, by reason; `used_share` of those that were not, `trimmed` as outliers of the rest.
        block: s, length of a block of the bootstrap; `blocks` how many.
        pedal, request: filtered, all ticks.
        fitted, validated: ticks of the halves.
        sources: of the logs.
    """

    c_r: float
    sd: float
    sd_hac: float
    low: float
    high: float
    r2: float
    offset: float
    curvature: float
    findings: tuple[Finding, ...]
    rmse: float
    rmse_old: float | None
    rmse_constant: float
    minutes_fit: float
    minutes_validation: float
    share: dict[str, float]
    used_share: float
    trimmed: float
    block: float
    blocks: int
    pedal: Array = field(repr=False)
    request: Array = field(repr=False)
    fitted: Flags = field(repr=False)
    validated: Flags = field(repr=False)
    sources: tuple[str, ...] = ()

    def vehicle(self, old: Vehicle) -> Vehicle:
        """The old vehicle with this c_r.

        Raises:
            LogError: it explains the validation half hardly better than a constant, or no vehicle has such a c_r.
        """
        if not self.rmse < HARDLY * self.rmse_constant:
            raise LogError(
                f"{', '.join(self.sources)}: validation RMSE {self.rmse:.3g} N m, and {self.rmse_constant:.3g} for a constant",
                "a request that follows the pedal in both halves of the drive",
                "check pedal and request; nothing was written",
            )
        within_file_bounds("pedal_coefficient", [self.c_r], "the unit of accelerator_pedal or of engine_torque_request")
        text = (
            f"c_r identified from {', '.join(self.sources)}; 2017 eq. (8b), {self.minutes_fit:.1f} usable minutes, R2 "
            f"{self.r2:.4f}, validation RMSE {self.rmse:.3g} N m on another {self.minutes_validation:.1f}"
        )
        return old.with_parameter("pedal_coefficient", self.c_r, self.sd, text)


def identify_pedal(
    logs: Log | Sequence[Log], vehicle: Vehicle | None = None, *, dt: float = 0.01, seed: int = 0
) -> PedalFit:
    """Torque request per accelerator pedal from drives.

    Args:
        logs: with accelerator_pedal and engine_torque_request; gear and clutch if there.
        vehicle: its old c_r, for comparison.
        dt: tick, s.
        seed: of the bootstrap.

    Raises:
        MissingSignal: a log lacks a signal.
        LogError: too little pedal, or a request that is no multiple of the pedal; the message says which.
    """
    logs = [logs] if isinstance(logs, Log) else list(logs)
    refuse_unsound(logs, SIGNALS)
    odd = [f for log in logs for f in sensors_agree(log) if f.severity == "bad"]
    parts = [pedal_rows(log, dt) for log in logs]
    pedal, request = (np.concatenate([part[k] for part in parts]) for k in (0, 1))
    keep = np.concatenate([part[2] for part in parts])
    sizes = [part[2].size for part in parts]
    share = {
        reason: sum(part[3][reason] * n for part, n in zip(parts, sizes, strict=True)) / max(sum(sizes), 1)
        for reason in REASONS
    }
    pieces = np.concatenate([[0], np.cumsum(sizes)])
    first, second = halves(keep, pieces)
    named = ", ".join(short_name(log) for log in logs)
    span = float(np.ptp(np.quantile(pedal[first], [0.025, 0.975]))) if first.any() else 0.0
    if first.sum() * dt < 1.0 or span < LEAST_RANGE:
        raise LogError(
            f"{named}: the pedal covers {span:.0%} of its range in {first.sum() * dt:.1f} s that can be fitted",
            f"at least {LEAST_RANGE:.0%} in some minutes",
            "record a drive with weaker and stronger accelerations",
        )
    fit = regress(pedal[:, None], request, first, pieces, seed=seed)
    c_r, sd = float(fit.solution[0]), float(fit.sd[0])
    r2, offset, curvature = _straight(pedal[fit.used], request[fit.used], c_r)
    _refuse(named, c_r, sd, r2, offset, curvature, fit.freedom)
    old = vehicle.number("pedal_coefficient") if vehicle is not None and "pedal_coefficient" in vehicle else None
    e = request - c_r * pedal
    half = fit.interval_factor * sd
    findings = [*_findings(c_r, r2, offset, curvature, fit.trimmed), *(replace(
        f, severity="warn", text=f"{f.text}; c_r does not need it, brake and ratio do"
    ) for f in odd)]  # fmt: skip
    if vehicle is not None:
        cause = "the unit of the pedal or of the request is wrong, or it is another driving mode"
        findings += far_from_old("c_r", c_r, sd, vehicle, "pedal_coefficient", cause)
    return PedalFit(
        c_r, sd, float(fit.sd_hac[0]), c_r - half, c_r + half, r2, offset, curvature,
        tuple(findings), rms(e[second]),
        None if old is None else rms((request - old * pedal)[second]),
        rms(request[second] - request[first].mean()), float(first.sum()) * dt / 60, float(second.sum()) * dt / 60, share,
        float(keep.mean()), fit.trimmed, fit.length * dt, fit.blocks, pedal, request, first, second,
        tuple(short_name(log) for log in logs),
    )  # fmt: skip


def pedal_rows(log: Log, dt: float) -> tuple[Array, Array, Flags, dict[str, float]]:
    """Filtered pedal and request of one log on ticks of dt, which ticks may be used, and the shares left out by reason."""
    start = max(float(log[name].time[0]) if len(log[name]) else 0.0 for name in SIGNALS)
    stop = min(float(log[name].time[-1]) if len(log[name]) else start for name in SIGNALS)
    grid = centred(log, SIGNALS).sample((*SIGNALS, "gear", "clutch"), dt, start=start, stop=max(stop, start))
    good = {name: grid.held[name] & inside(name, grid.values[name]) for name in SIGNALS}
    values = np.column_stack([filled(grid.values[name], good[name]) for name in SIGNALS])
    pedal, request = low_pass(values, dt).T
    left_out = _left_out(grid, values[:, 0], pedal)
    share = {reason: float(mask.mean()) if mask.size else 0.0 for reason, mask in left_out.items()}
    return pedal, request, ~np.any(list(left_out.values()), axis=0), share


def _left_out(grid: Grid, raw: Array, pedal: Array) -> dict[str, Flags]:
    """Ticks that are left out, by reason."""
    dt = grid.dt
    there = np.all([grid.held[name] for name in SIGNALS], axis=0)
    fine = np.all([inside(name, grid.values[name]) for name in SIGNALS], axis=0)
    gear = np.where(np.isfinite(grid.values["gear"]), grid.values["gear"], 1.0)
    clutch = np.where(grid.held["clutch"], np.nan_to_num(grid.values["clutch"]), 0.0)
    changed = np.diff(gear, prepend=gear[:1]) != 0
    return {
        "missing": widened(~there, 0.0, 0.2, dt),
        "absurd": widened(there & ~fine, 0.0, 0.2, dt),
        "released": widened(raw < RELEASED, 0.0, 0.2, dt),
        "full": widened(raw > FULL, 0.0, 0.2, dt),
        "quick": np.abs(rate(raw, dt)) > QUICK,
        "shift": widened(changed | (clutch > OPEN_CLUTCH) | (gear == 0), BEFORE_SHIFT, AFTER_SHIFT, dt),
        "reverse": gear < 0,
    }


def _straight(p: Array, T: Array, c_r: float) -> tuple[float, float, float]:
    """R2 of the line, offset of a line with one, and distance of a parabola as a share of the greatest torque."""
    spread = float(np.sum((T - T.mean()) ** 2))
    r2 = 1.0 - float(np.sum((T - c_r * p) ** 2)) / spread if spread > 0 else 0.0
    offset = float(solve(np.column_stack([np.ones_like(p), p]), T)[0])
    a, b, c = solve(np.column_stack([np.ones_like(p), p, p * p]), T)
    low, high = np.quantile(p, [0.025, 0.975])
    at = np.linspace(low, high, 50)
    greatest = c_r * at[-1]
    return r2, offset, float(np.abs(a + b * at + c * at * at - c_r * at).max() / greatest) if greatest > 0 else np.inf


def _refuse(named: str, c_r: float, sd: float, r2: float, offset: float, curvature: float, freedom: int) -> None:
    """Raises LogError where T_r = c_r p_r does not hold, or c_r cannot be told."""
    said = f"c_r = {c_r:.4g} N m, R2 {r2:.2f}, offset {offset:.3g} N m, parabola {curvature:.0%} from the line"
    if c_r <= 0 or r2 < LEAST_R2 or curvature > CURVED:
        raise LogError(
            f"{named}: the requested torque is no multiple of the pedal ({said})",
            f"R2 of at least {LEAST_R2:g} and at most {CURVED:.0%} between parabola and line",
            "check units and signals; if the pedal map is curved or depends on engine speed, use intent-torque, which needs no c_r",
        )
    if freedom < 4 or not sd <= PEDAL_SD * c_r:
        raise LogError(
            f"{named}: c_r = {c_r:.4g} N m with a standard error of {sd:.2g} from {freedom + 1} stretches that count",
            f"a standard error of at most {PEDAL_SD:.0%}, from 5 stretches or more",
            "record a longer drive with weaker and stronger accelerations",
        )


def _findings(c_r: float, r2: float, offset: float, curvature: float, trimmed: float) -> tuple[Finding, ...]:
    """What is to say about the line."""
    said = f"R2 {r2:.4f}, offset {offset:.3g} N m, a parabola lies {curvature:.1%} of the greatest torque from it"
    bent = r2 < GOOD_R2 or curvature > BENT
    found = [Finding("warn" if bent else "ok", f"the line T_r = c_r p_r: {said}" + (
        "; it is a rough description of this pedal map, and intent-torque does without it" if bent else ""
    ))]  # fmt: skip
    if trimmed > 0.05:
        found.append(Finding(
            "warn", f"{trimmed:.0%} of the moments do not fit and were left out: cruise control, a rev limiter, another controller?"
        ))  # fmt: skip
    return tuple(found)
