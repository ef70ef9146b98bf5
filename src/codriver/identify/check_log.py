"""Whether a vehicle file fits a drive: what the log itself says of c_r, c_b, M, tau and gear, beside what the file says.

* pedal: the log's requested torque over c_r p_r, 1 if c_r is right;
* gear: engine speed over v tau, by gear, 1/eta if tau is right (0.8 <= eta <= 1 for the driveline's efficiency);
* forces: with s = 1 and b = c_b the regression

      M y1 = s tau T_e - b p_b - kappa_1 - kappa_2 v^2                (2017 eq. 19, s added)

  has s = (true tau / M) / (file's tau / M), the same in all gears if M is wrong, and b / s is c_b in truth if tau is right.
  Where s differs from gear to gear nothing is said of c_b.

Only what stands out by more than a driver or a road can make of it is told: the margins below, and four standard errors.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import log as ln

import numpy as np

from codriver.errors import LogError
from codriver.finding import Finding
from codriver.identify.brake_rows import DriveRows, drive_rows
from codriver.identify.gear_by_engine import EFFICIENCY, engine_turns, wrong_gears
from codriver.identify.pedal import SIGNALS as PEDAL_SIGNALS
from codriver.identify.pedal import pedal_rows
from codriver.identify.regression import solve, trimmed_rows
from codriver.identify.standard_errors import newey_west
from codriver.signals import Log
from codriver.signals.grid import Flags
from codriver.signals.signal import Array
from codriver.trust.sensors_agree import sensors_agree
from codriver.vehicles import Vehicle

DT = 0.02  # s; for factors, not for per cents
ALIKE = 2.0  # s over which residuals are taken to be alike
WARN, BAD = 0.12, 0.3  # of the natural logarithm of a quotient that should be 1
CLEAR = 4.0  # standard errors
LEAST_SECONDS = 10.0
UNEVEN = 1.2  # s of one gear over that of another
_FACTORS = (
    (1e5, "bar taken for Pa, or Pa for bar"), (1e-5, "bar taken for Pa, or Pa for bar"),
    (1e3, "kPa taken for Pa, or the like"), (1e-3, "kPa taken for Pa, or the like"),
    (100.0, "percent taken for 1, or the like"), (0.01, "percent taken for 1, or the like"),
    (2.0, "a factor of 2"), (0.5, "a factor of 2"),
)  # fmt: skip


def check_vehicle_against_log(log: Log, vehicle: Vehicle) -> tuple[Finding, ...]:
    """Hold a vehicle's parameters against a drive, in well under a second.

    Args:
        log: whatever of pedal, requested and actual torque, pressure, gear, engine speed, accelerometer and speed is there.
        vehicle: what to judge.

    Returns:
        Findings, the worst first; one of severity "ok" for each parameter that fits, none for what cannot be judged.
    """
    sensors = [f for f in sensors_agree(log) if f.severity == "bad"] if "mass" in vehicle else []
    # Forces held against an accelerometer that is wrong would blame mass, tau and torque.
    found = [*sensors, *_pedal(log, vehicle), *([] if sensors else _motion(log, vehicle))]
    return tuple(sorted(found, key=lambda finding: ("bad", "warn", "ok").index(finding.severity)))


def _pedal(log: Log, vehicle: Vehicle) -> list[Finding]:
    """c_r against the log's own request."""
    if "pedal_coefficient" not in vehicle or any(name not in log for name in PEDAL_SIGNALS):
        return []
    pedal, request, keep, _ = pedal_rows(log, DT)
    if keep.sum() * DT < LEAST_SECONDS or not np.ptp(pedal[keep]) > 0.05:
        return []
    c_r, here = vehicle.number("pedal_coefficient"), float(np.median(request[keep] / pedal[keep]))
    return [_judged(
        here / c_r, 0.0, f"the log's request is {here:.4g} N m per full pedal (median), c_r in the vehicle file {c_r:.4g} N m",
        "c_r, the unit of the pedal or of the request is wrong, or a controller makes the request; see `codriver identify pedal`",
    )]  # fmt: skip


def _motion(log: Log, vehicle: Vehicle) -> list[Finding]:
    """tau by gear against engine speed; tau/M and c_b against the motion."""
    if "mass" not in vehicle or "transmission" not in vehicle:
        return []
    taus = vehicle.numbers("transmission")
    needed = ("longitudinal_acceleration", "longitudinal_speed", "engine_torque", *(("gear",) if len(taus) > 1 else ()))
    if any(name not in log or not len(log[name]) for name in needed):
        return []
    pressure = "brake_pressure" in log and len(log["brake_pressure"]) > 0
    rows = drive_rows([log], len(taus), DT, known_gears=True, pressure=pressure, without_braking=not pressure)
    if rows.keep.sum() * DT < LEAST_SECONDS:
        return []
    return [*_engine([log], rows, taus), *_forces(rows, vehicle, taus)]


def _engine(logs: Sequence[Log], rows: DriveRows, taus: tuple[float, ...]) -> list[Finding]:
    """Each gear's tau against the engine's turns per metre."""
    turns = engine_turns(logs, rows, len(taus))
    wrong = []
    for gear, here in turns.items():
        if EFFICIENCY[0] <= taus[gear - 1] / here <= EFFICIENCY[1]:
            continue
        fits = [str(g) for g, tau in enumerate(taus, 1) if EFFICIENCY[0] <= tau / here <= EFFICIENCY[1]]
        wrong.append(
            f"gear {gear}: engine speed over speed is {here:.3g} 1/m, tau {taus[gear - 1]:.3g}"
            + (f" (that of gear {' or '.join(fits)} fits)" if fits else "")
        )
    if wrong:
        cure = "the log's gear numbers or the vehicle file's list are shifted, or another car's" if any(
            "fits" in text for text in wrong
        ) else "tau, the engine speed's unit or the speed's unit is wrong"  # fmt: skip
        return [Finding("bad", f"{'; '.join(wrong)}: tau should be 0.8 to 1 times it; {cure}")]
    if not turns:
        return []
    if often := wrong_gears(logs, rows, taus):
        return often
    shares = [taus[gear - 1] / here for gear, here in turns.items()]
    return [
        Finding(
            "ok", f"tau is {min(shares):.2f} to {max(shares):.2f} times engine speed over speed (0.8 to 1 is right)"
        )
    ]


def _forces(rows: DriveRows, vehicle: Vehicle, taus: tuple[float, ...]) -> list[Finding]:
    """tau/M and c_b against what the car did."""
    M = vehicle.number("mass")
    braking = bool((rows.keep & rows.pressed).sum() * DT > 2.0 and np.ptp(rows.pressure[rows.keep]) > 0)
    force = rows.torque @ np.array(taus)
    columns = [force, *([-rows.pressure] if braking else []), -np.ones_like(force)]
    if float(rows.square[rows.keep].std()) > 100.0:
        columns.append(-rows.square)
    X, y = np.column_stack(columns), M * rows.y
    try:
        used = trimmed_rows(X, y, rows.keep)
        theta = solve(X[used], y[used])
        covariance = newey_west(X, y - X @ theta, used, rows.pieces, round(ALIKE / DT))
    except (LogError, np.linalg.LinAlgError):
        return []  # the drive does not tell: torque or pressure do not vary
    s, sd = float(theta[0]), float(covariance[0, 0] ** 0.5)
    by_gear = _by_gear(rows, X, y, used, taus)
    uneven = bool(by_gear) and max(by_gear.values()) > UNEVEN * min(by_gear.values())
    findings = []
    if sd < 0.1 * abs(s):
        listed = ", ".join(f"{gear}: {own:.2f}" for gear, own in by_gear.items())
        findings.append(_judged(
            s, sd, f"the car accelerates {s:.3g} times as much as tau T_e / M of the vehicle file says"
            + (f" (in gear {listed})" if listed else ""),
            "it differs by gear: the gear is not the one the log names, or tau is wrong" if uneven else
            f"M is too {'large' if s > 1 else 'small'}, tau too {'small' if s > 1 else 'large'}, or the torque's unit is wrong",
        ))  # fmt: skip
    if braking and "brake_coefficient" in vehicle and s > 0 and not uneven:
        c_b, here = vehicle.number("brake_coefficient"), float(theta[1]) / s
        sd_b = float(covariance[1, 1] ** 0.5) / s
        if sd_b < 0.2 * abs(here):
            findings.append(_judged(
                here / c_b, sd_b / c_b, f"the brakes give {here:.3g} N/Pa, c_b in the vehicle file is {c_b:.3g} N/Pa",
                "c_b or the unit of the pressure is wrong; see `codriver identify brake`",
            ))  # fmt: skip
    return findings


def _by_gear(rows: DriveRows, X: Array, y: Array, used: Flags, taus: tuple[float, ...]) -> dict[int, float]:
    """s of each gear that was driven with torque that varies; empty for one gear."""
    found = {}
    for gear, tau in enumerate(taus, 1):
        there = used & (rows.gear == gear)
        if there.sum() * DT < LEAST_SECONDS or rows.torque[there, gear - 1].std() < 10.0:
            continue
        try:
            own = solve(np.column_stack([tau * rows.torque[there, gear - 1], X[there, 1:]]), y[there])
        except LogError:
            continue
        found[gear] = float(own[0])
    return found if len(found) > 1 else {}


def _judged(quotient: float, sd: float, said: str, cure: str) -> Finding:
    """A finding on a quotient that should be 1."""
    if not quotient > 0:
        return Finding("bad", f"{said}: the sign is wrong; {cure}")
    off = abs(ln(quotient))
    if off < WARN or abs(quotient - 1.0) < CLEAR * sd:
        return Finding("ok", said)
    likely = [text for factor, text in _FACTORS if abs(ln(quotient / factor)) < 0.15]
    hint = f" ({likely[0]})" if likely else ""
    return Finding("bad" if off > BAD else "warn", f"{said}: {quotient:.3g} times{hint}; {cure}")
