"""What an assist does for a drive: how well the car keeps to the path, and what that costs the driver.

    effort              rms of T_dr;   mean of T_dr^2;   mean of |T_dr delta_s'|
    conflict            T_dr T_a < 0, both larger than FELT: share of the time, and mean of min(|T_dr|, |T_a|), 0 elsewhere
    reversals           turns of the angle, low-passed at 0.6 Hz, by GAP or more, up or down, a minute

Reversals of the steering wheel by a gap: Markkula, Engstrom 2006, "A steering wheel reversal rate metric for assessing effects of
visual and cognitive secondary task load" (13th ITS World Congress, London); the filter runs both ways here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from math import isfinite, nan, pi

import numpy as np

from codriver.finding import Finding
from codriver.program import Program
from codriver.signals.signal import Array
from codriver.simulate.assist import Assist
from codriver.simulate.circuit import CircuitSetting
from codriver.simulate.shared_control import SharedDrive, SharedSetting, simulate_shared

FELT = 0.1  # N m
GAP = 3 * pi / 180
_CUTOFF = 0.6  # Hz
SETTLED = 5.0  # s at the start that do not count
# Figure of an outcome, what it is called, unit as shown, factor from SI.
FIGURES = (
    ("offset", "off the path, rms", "m", 1.0), ("largest", "off the path, at most", "m", 1.0),
    ("heading", "off the course, rms", "mrad", 1e3), ("torque", "driver's torque, rms", "N m", 1.0),
    ("squared", "driver's torque squared", "N² m²", 1.0), ("power", "driver's power", "W", 1.0),
    ("assist", "motor's torque, rms", "N m", 1.0), ("opposed_share", "time against each other", "%", 100.0),
    ("opposed", "torque against each other", "N m", 1.0), ("reversals", "reversals of the wheel", "1/min", 1.0),
    ("authority", "authority", "", 1.0), ("foretold", "error of what is foretold", "N m", 1.0),
)  # fmt: skip


@dataclass(frozen=True)
class Outcome:
    """Of a drive, or the mean of several.

    Attributes:
        offset, largest: rms and largest distance off the path, m.
        heading: rms of the course's error, psi + beta, rad.
        torque: rms, N m; squared: mean of its square, N^2 m^2; power: mean of the driver's mechanical power's size, W.
        assist: rms of the motor's torque, N m.
        opposed_share, opposed: of the time, and mean torque, N m.
        reversals: 1/min.
        authority: mean.
        foretold: RMSE of the driver model in the loop, N m; NaN without one.
    """

    offset: float
    largest: float
    heading: float
    torque: float
    squared: float
    power: float
    assist: float
    opposed_share: float
    opposed: float
    reversals: float
    authority: float
    foretold: float


def outcome(shared: SharedDrive) -> Outcome:
    """Of one drive."""
    d = shared.drive
    late = d.time >= SETTLED
    T, motor, y = d.driver_torque[late], d.motor_torque[late], d.offset[late]
    course = d.heading[late] + d.sideslip[late]
    against = (T * motor < 0) & (np.minimum(np.abs(T), np.abs(motor)) > FELT)
    return Outcome(
        _rms(y), float(np.abs(y).max()), _rms(course), _rms(T), float(np.mean(T**2)), float(np.mean(np.abs(T * d.rate[late]))),
        _rms(motor), float(against.mean()), float(np.mean(np.where(against, np.minimum(np.abs(T), np.abs(motor)), 0.0))),
        reversal_rate(d.angle[late], d.setting.dt), float(shared.authority[late].mean()), shared.foretold_error(),
    )  # fmt: skip


def compare_assists(
    circuit: CircuitSetting, assists: Mapping[str, Assist], model: Program | None = None, seeds: Sequence[int] = (0,),
    used_to_it: float = 1.0,
) -> dict[str, list[Outcome]]:  # fmt: skip
    """The same drives with several assists.

    Args:
        circuit: driver, car, laps.
        assists: by name.
        model: driver model, for "predicted".
        seeds: a drive each.
        used_to_it: see `SharedSetting`.

    Raises:
        UsageError: as `simulate_shared`.
    """
    return {
        name: [outcome(simulate_shared(SharedSetting(circuit, one, used_to_it), model, seed=seed)) for seed in seeds]
        for name, one in assists.items()
    }


def mean_outcome(found: Sequence[Outcome]) -> tuple[Outcome, Outcome]:
    """Mean and standard deviation over drives; of one drive the latter is NaN.

    Raises:
        ValueError: there is no drive.
    """
    if not found:
        raise ValueError("no drive")
    table = np.array([[getattr(one, f.name) for f in fields(Outcome)] for one in found])
    spread = table.std(axis=0, ddof=1) if len(found) > 1 else np.full(table.shape[1], nan)
    return Outcome(*table.mean(axis=0).tolist()), Outcome(*spread.tolist())


def change_of(with_it: Sequence[Outcome], without: Sequence[Outcome], figure: str) -> tuple[float, float]:
    """By how much a figure changes, as a share of what it was, in pairs of the same driver and seed: mean and standard error.

    Args:
        with_it, without: drive by drive.
        figure: of Outcome.
    """
    change = np.array([getattr(a, figure) / getattr(b, figure) - 1 for a, b in zip(with_it, without, strict=True)])
    spread = float(change.std(ddof=1) / np.sqrt(change.size)) if change.size > 1 else nan
    return float(change.mean()), spread


def verdict(found: Mapping[str, Sequence[Outcome]]) -> list[Finding]:
    """What can be said of assists beside no assist, and of a foretold torque beside power steering at the same gain.

    Args:
        found: by kind of assist, outcomes of the same drives; "none" among them.
    """
    said = []
    for kind, each in found.items():
        if kind == "none":
            continue
        shaking = sum(a.power > b.power for a, b in zip(each, found["none"], strict=True))
        if shaking:
            text = (
                f"{kind}: in {shaking} of {len(each)} drives the driver works more than alone, as when the wheel shakes"
            )
            said.append(Finding("bad", f"{text}; take a smaller gain"))
        for figure, words in (("offset", "off the path"), ("power", "driver's power")):
            said.append(_compared(f"{kind} against no assist, {words}", each, found["none"], figure))
    if {"present", "predicted"} <= set(found):
        for figure, words in (("offset", "off the path"), ("torque", "driver's torque"), ("power", "driver's power")):
            text = f"predicted against present, {words}"
            said.append(_compared(text, found["predicted"], found["present"], figure))
    return said


def _compared(text: str, one: Sequence[Outcome], other: Sequence[Outcome], figure: str) -> Finding:
    """A change in words; it counts where it is larger than two standard errors."""
    change, error = change_of(one, other, figure)
    if not isfinite(error):
        return Finding("warn", f"{text}: {change:+.1%} in one drive, which tells little")
    severity = "ok" if change < -2 * error else "bad" if change > 2 * error else "warn"
    return Finding(
        severity, f"{text}: {change:+.1%} ± {error:.1%}" + (", not told apart" if severity == "warn" else "")
    )


def reversal_rate(angle: Array, dt: float, gap: float = GAP) -> float:
    """Reversals a minute.

    Args:
        angle: of the wheel, rad, shape (n,).
        dt: s.
        gap: least turn, rad.
    """
    from scipy.signal import butter, sosfiltfilt

    if angle.size < 2 or not isfinite(float(np.sum(angle))):
        return nan
    smooth = sosfiltfilt(butter(2, _CUTOFF, fs=1 / dt, output="sos"), angle)
    count, low, high, up = 0, smooth[0], smooth[0], 0
    for value in smooth[np.r_[True, np.diff(np.sign(np.diff(smooth))) != 0, True]].tolist():
        low, high = min(low, value), max(high, value)
        if up >= 0 and high - value >= gap:
            count, up, low = count + (up > 0), -1, value
        elif up <= 0 and value - low >= gap:
            count, up, high = count + (up < 0), 1, value
    return 60 * count / ((angle.size - 1) * dt)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
