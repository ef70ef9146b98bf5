"""The figures of a report: what the drive was like, how sure the estimate is, how far it is from a reference."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from codriver.estimate import Estimate
from codriver.measured_torque import compare_with_sensor
from codriver.report.panels import SIGMAS, on_ticks
from codriver.report.shown import clock, number, shown, shown_unit, words
from codriver.report.torque_panels import DRAWN, of_our_own
from codriver.signals import Log
from codriver.signals.signal import Array
from codriver.summary import Summary

ACCELERATIONS = ("intentional_acceleration", "longitudinal_acceleration")
JERKS = ("intentional_jerk", "longitudinal_jerk")
LESS = ("longitudinal_speed", "acceleration_offset")  # their figures say little of the driver
SHARED = {"both_pedals": "both pedals pressed", "standstill": "standing still", "hands_on": "hands on the wheel"}
LONGEST_LAG = 2.0  # s


@dataclass(frozen=True)
class Row:
    """One line of the table of figures."""

    name: str
    value: str
    note: str = ""


def figures(estimate: Estimate, told: Summary) -> list[Row]:
    """The summary as people read it."""
    rows = [
        Row("duration", clock(told.duration)),
        Row("distance", _distance(told.distance)),
        Row(
            "valid",
            f"{told.valid_share:.1%}" if told.duration else "–",
            "share of the duration; estimates are of this part",
        ),
    ]
    first = [name for name in (*JERKS, *ACCELERATIONS) if name in told.estimates]
    less = (*LESS, *(DRAWN[1:] if of_our_own(estimate) else ()))
    for name in (*first, *(other for other in told.estimates if other not in (*first, *less))):
        found, unit = told.estimates[name], shown_unit(name, told.estimates[name].unit)
        if found.rms is None or found.p5 is None or found.p95 is None:
            rows.append(Row(words(name), "–", "nothing valid"))
            continue
        low, high = shown(name, [found.p5, found.p95])
        rows.append(Row(f"{words(name)}, RMS", f"{number(_size(name, found.rms))} {unit}"))
        rows.append(Row(f"{words(name)}, 5% to 95%", f"{number(low)} to {number(high)} {unit}", "quantiles"))
        if found.mean_sd is not None:
            rows.append(Row(f"{words(name)}, mean standard deviation", f"{number(_size(name, found.mean_sd))} {unit}"))
    lag = expected_lag(estimate)
    if lag is not None:
        what = "expected delay of the jerk" if any(name in estimate for name in JERKS) else "expected delay"
        rows.append(Row(what, f"{number(lag)} s", "slow changes show up about this much late"))
    if told.gear_shifts is not None:
        rows.append(Row("gear shifts", str(told.gear_shifts)))
    for flag, share in told.shares.items():
        note = (
            "share of the valid time in which it is likelier than not"
            if flag == "hands_on"
            else "share of the duration"
        )
        rows.append(Row(SHARED.get(flag, words(flag)), f"{share:.1%}", note))
    sensor = compare_with_sensor(estimate)
    if sensor is not None:
        name = words(sensor.sensor)
        rows.append(
            Row(f"against the measured {name}, RMSE", f"{number(sensor.rmse)} N m", "where the estimate is valid")
        )
        rows.append(Row(f"against the measured {name}, R²", number(sensor.r2), "1 is perfect; 0 is answering the mean"))
        if sensor.covered is not None:
            rows.append(Row(f"measured {name} inside the 95% band", f"{sensor.covered:.0%}"))
    return rows


def _size(name: str, value: float) -> float:
    """A size (rms, standard deviation) in the display unit: its factor without its offset."""
    return float(np.abs(shown(name, value) - shown(name, 0.0)))


def _distance(metres: float | None) -> str:
    if metres is None:
        return "unknown: there is no speed"
    return f"{metres / 1000:.2f} km" if metres >= 1000 else f"{metres:.0f} m"


def expected_lag(estimate: Estimate) -> float | None:
    """By how much the estimate lags slow changes of the true one, s; None where its design does not say.

    The design knows it (`observers/response.py`): it is the setting delay_s. For the pedals alone it is that of the
    differentiating filter, whose corner frequency is the setting f_D.
    """
    settings = estimate.provenance
    try:
        if "delay_s" in settings:
            return float(settings["delay_s"])
        return 1 / (2 * np.pi * float(settings["f_D"])) if "f_D" in settings else None
    except (ValueError, ZeroDivisionError):  # a setting of another observer that happens to be called so
        return None


@dataclass(frozen=True)
class Error:
    """An estimate against a reference, in display units, over the valid ticks.

    Attributes:
        name, against: of the estimate and of the reference's signal.
        unit: display unit.
        rms, mean: of estimate less reference.
        lag: shift of the estimate that fits the reference best, s.
        rms_shifted: RMS after the best shift, by that lag.
        covered: share of the reference inside the 95% band; None without a band.
    """

    name: str
    against: str
    unit: str
    rms: float
    mean: float
    lag: float
    rms_shifted: float
    covered: float | None


def errors(estimate: Estimate, truth: Log | None) -> list[Error]:
    """How far the estimate is from a reference, for each signal that both have."""
    pairs = [(o.name, o.name) for o in estimate.estimates]
    for planned, candidates in (("planned_acceleration", ACCELERATIONS[:1]), ("planned_jerk", JERKS[:1])):
        pairs += [(name, planned) for name in candidates if name in estimate]
    found = []
    for name, against in pairs:
        reference = on_ticks(truth, against, estimate.time)
        if reference is None:
            continue
        value, right = shown(name, estimate.columns[name]), shown(name, reference)
        used = estimate.valid & np.isfinite(right) & np.isfinite(value)
        if used.sum() < 2:
            continue
        difference = (value - right)[used]
        lag, rms_shifted = _best_lag(value, right, used, estimate.grid.dt)
        sd = estimate.sd(name)
        covered = None
        if sd is not None:
            half = SIGMAS * np.abs(shown(name, sd) - shown(name, np.zeros_like(sd)))
            covered = float(np.mean(np.abs(difference) <= half[used]))
        rms = float(np.sqrt(np.mean(difference**2)))
        found.append(Error(name, against, shown_unit(name), rms, float(difference.mean()), lag, rms_shifted, covered))
    return found


def _best_lag(value: Array, right: Array, used: np.ndarray, dt: float) -> tuple[float, float]:
    """The lag with the least RMS, among 40 up to LONGEST_LAG, and that RMS."""
    best = (0.0, float("inf"))
    for ticks in sorted({round(lag / dt) for lag in np.linspace(0.0, LONGEST_LAG, 41)}):
        if ticks >= value.size:
            break
        both = used[ticks:] & np.isfinite(right[: value.size - ticks])
        if both.sum() < 0.5 * used.sum():
            break
        difference = (value[ticks:] - right[: value.size - ticks])[both]
        rms = float(np.sqrt(np.mean(difference**2)))
        if rms < best[1]:
            best = (ticks * dt, rms)
    return best
