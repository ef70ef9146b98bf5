"""c_b, kappa_1 and kappa_2 by least squares (2017, section IV-A, eq. 19-20).

    tau T_e - M y1 = c_b p_b + kappa_1 + kappa_2 v^2 - gamma M dv/dt          each signal low-passed at 5 Hz

The first half of each log's usable moments gives the coefficients, the second half judges them. Several logs share c_b,
kappa_2 and gamma; each has an offset of its own, for the accelerometer's bias d_a may differ from drive to drive. An offset is
kappa_1 - M d_a: least squares cannot tell the two apart, unless the bias is known and given.

A coefficient is refused where the drive does not tell it: its standard error is too large, or it cannot be told from
another. kappa_2 then keeps the vehicle's old value in the fit (0 without one), gamma is 0, and c_b is fitted all the same.

The theta of this fit is linear in M and tau, theta = M theta_y - sum over gears of tau_g theta_g, which gives exactly how far
their own standard deviations carry.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from codriver.errors import LogError
from codriver.identify.brake_fit import PARAMETERS, BrakeFit, Coefficient, Refusal
from codriver.identify.brake_rows import SIGNALS, DriveRows, drive_rows, halves, short_name
from codriver.identify.brake_verdict import remarks
from codriver.identify.gear_by_engine import wrong_gears
from codriver.identify.learning import learning_curve
from codriver.identify.plausible import BRAKE_PER_MASS, check_bias
from codriver.identify.regression import Regression, regress, rms, solve
from codriver.identify.sound import refuse_unsound
from codriver.identify.standard_errors import autocorrelation
from codriver.signals import Log
from codriver.signals.grid import Flags
from codriver.signals.signal import Array
from codriver.vehicles import Vehicle

# Greatest standard error: of the value, or in a unit of its own, whichever is larger.
BRAKE_SD, DRAG_SD, GAIN_SD, OFFSET_SD = 0.1, 0.25, 0.02, 0.05  # share, share, absolute, m/s^2
LEAST_FREEDOM = 4
# What counts as no signal at all: m/s^2, m^2/s^2, Pa, RMS.
_NOTHING = {"gamma": 1e-4, "kappa_2": 1e-3, "c_b": 1.0}


def identify_brake(
    logs: Log | Sequence[Log],
    vehicle: Vehicle,
    *,
    bias: float | None = None,
    pitch: bool = True,
    dt: float = 0.01,
    seed: int = 0,
) -> BrakeFit:
    """Brake coefficient, rolling resistance and drag from drives.

    Args:
        logs: with longitudinal_acceleration, longitudinal_speed, engine_torque, brake_pressure, gear (not with one gear);
            clutch and brake_switch if there.
        vehicle: its mass and transmission; the rest for comparison.
        bias: of the accelerometer, m/s^2, if known: kappa_1 is then free of it.
        pitch: fit gamma, the accelerometer's gain error.
        dt: tick, s.
        seed: of the bootstrap.

    Raises:
        MissingSignal: a log lacks a signal.
        VehicleError: the vehicle lacks mass or transmission.
        LogError: the drives tell none of the coefficients; the message says why.
    """
    logs = [logs] if isinstance(logs, Log) else list(logs)
    M, taus = vehicle.number("mass"), vehicle.numbers("transmission")
    check_bias(bias)
    odd = refuse_unsound(logs, SIGNALS)
    rows = drive_rows(logs, len(taus), dt, known_gears=True)
    first, second = halves(rows.keep, rows.pieces)
    _enough(first, rows, logs)
    fit, names, refused = _fit(rows, first, vehicle, M, np.array(taus), pitch, seed)
    X, force = _columns(rows, names), rows.torque @ np.array(taus)
    fixed = _fixed_drag(rows, names, vehicle)
    model = (force - fixed - X @ fit.solution) / M
    coefficients, offsets = _coefficients(rows, fit, names, vehicle, M, bias)
    refused = [*refused, *_refuse_values(coefficients, fit, M, names)]
    for refusal in refused:
        coefficients.pop(refusal.name, None)
    if not set(coefficients) & set(PARAMETERS):
        raise LogError(
            f"{_named(logs)}: nothing can be told; " + "; ".join(f"{r.name}: {r.reason}" for r in refused),
            "a drive that brakes, speeds up, and covers slow and fast roads",
            "record a longer or more varied drive, or give several logs",
        )
    e = rows.y - model
    most = max(min(round(4 * fit.length), 2000), 10)
    curve = learning_curve(X, force - M * rows.y - fixed, rows.y, force - fixed, fit, rows, second, M, names)
    found = BrakeFit(
        coefficients, tuple(refused), tuple(offsets), bias is not None, _minutes(first, dt), _minutes(second, dt),
        _minutes(first & rows.pressed, dt), rows.share, float(rows.keep.mean()), fit.trimmed,
        rms(e[second]), _old(rows, force, vehicle, M, first, second),
        rms(rows.y[second] - rows.y[first].mean()), fit.length * dt, fit.blocks, curve, rows, model, fit.used, second,
        np.arange(most + 1, dtype=float) * dt, autocorrelation(e, fit.used, rows.pieces, most), M,
        sources=tuple(short_name(log) for log in logs),
    )  # fmt: skip
    said = (*odd, *rows.clipped, *wrong_gears(logs, rows, taus), *remarks(found, vehicle, np.array(taus)))
    return replace(found, remarks=said)


def _enough(first: Flags, rows: DriveRows, logs: Sequence[Log]) -> None:
    """Raises LogError where hardly a moment can be used; which of the reasons takes most is told."""
    if first.sum() * rows.dt >= 1.0:
        return
    from codriver.identify.usable import REASONS

    worst = max(rows.share, key=lambda reason: rows.share[reason])
    raise LogError(
        f"{_named(logs)}: only {rows.keep.sum() * rows.dt:.1f} s can be used; {rows.share[worst]:.0%} is {REASONS[worst]}",
        "minutes of driving forward with all signals there",
        "record a longer drive, or see with `codriver info LOG` what it holds",
    )


def _fit(
    rows: DriveRows, first: Flags, vehicle: Vehicle, M: float, taus: Array, pitch: bool, seed: int
) -> tuple[Regression, list[str], list[Refusal]]:
    """Fit with all columns, then without those that the drive does not tell."""
    refused: list[Refusal] = []
    names = [f"offset {k}" for k in range(rows.pieces.size - 1) if first[rows.pieces[k] : rows.pieces[k + 1]].any()]
    names = ["c_b", *names, "kappa_2", *(["gamma"] if pitch else [])]
    if not (first & rows.pressed).any():
        names.remove("c_b")
        refused.append(Refusal("c_b", "the driver does not brake in the half that is fitted"))
    while True:
        X = _columns(rows, names)
        told = _told_apart(X[first], names)
        if told is not None:
            name, reason = told
        else:
            target = rows.torque @ taus - M * rows.y - _fixed_drag(rows, names, vehicle)
            fit = regress(X, target, first, rows.pieces, seed=seed)
            if fit.freedom < LEAST_FREEDOM and "gamma" not in names and "kappa_2" not in names:
                raise LogError(
                    f"too short: {first.sum() * rows.dt:.0f} usable seconds to fit, whose residuals are alike over stretches of "
                    f"{fit.length * rows.dt:.1f} s, so that {fit.blocks} count",
                    f"at least {X.shape[1] + LEAST_FREEDOM} such stretches",
                    "record a longer drive, or give several logs",
                )
            name, reason = _badly_told(fit, names, M)
        if not name:
            return fit, names, refused
        names.remove(name)
        refused.append(Refusal(name, reason))


def _badly_told(fit: Regression, names: list[str], M: float) -> tuple[str, str]:
    """Which column the drive does not tell, and why; empty if it tells all. gamma goes first, for it widens the others."""
    if "gamma" in names:
        sd = fit.sd[names.index("gamma")] / M
        left = "the accelerometer's gain cannot be told here; pitch of 1 to 2 % would be in c_b and kappa_2"
        if fit.freedom < LEAST_FREEDOM:
            return "gamma", f"too short: {_stretches(fit)}; {left}"
        if not sd <= GAIN_SD:
            return "gamma", f"standard error {sd:.2g}, more than {GAIN_SD:g}: {left}"
    if "kappa_2" in names:
        k = names.index("kappa_2")
        value, sd = float(fit.solution[k]), float(fit.sd[k])
        if fit.freedom < LEAST_FREEDOM:
            return "kappa_2", f"too short: {_stretches(fit)}"
        if not sd <= DRAG_SD * abs(value):
            return (
                "kappa_2",
                f"{value:.3g} kg/m with a standard error of {sd:.2g}: too few different speeds to tell drag from kappa_1",
            )
    return "", ""


def _stretches(fit: Regression) -> str:
    """How many blocks count, and how many should."""
    needed = fit.blocks - fit.freedom + LEAST_FREEDOM
    return f"{fit.blocks} stretches that do not resemble one another count, and {needed} are needed"


def _told_apart(X: Array, names: list[str]) -> tuple[str, str] | None:
    """A column that the others make up, if there is one: then no least squares is possible."""
    for name in ("gamma", "kappa_2", "c_b"):
        if name not in names:
            continue
        k = names.index(name)
        others = np.delete(X, k, axis=1)
        size, rest = rms(X[:, k]), 0.0
        if size > _NOTHING[name]:
            try:
                rest = rms(X[:, k] - others @ solve(others, X[:, k]))
            except LogError:
                continue  # one of the others is at fault
        if not rest > 1e-5 * size:
            reason = {
                "kappa_2": "one speed: v^2 does not vary, so drag and kappa_1 cannot be told apart",
                "gamma": "the acceleration does not vary, or follows the other columns",
                "c_b": "the brake pressure does not vary",
            }[name]
            return name, reason
    return None


def _columns(rows: DriveRows, names: list[str]) -> Array:
    """X such that tau T_e - M y1 = X theta."""
    log = rows.log_of
    columns = {"c_b": rows.pressure, "kappa_2": rows.square, "gamma": -rows.rate}
    return np.column_stack(
        [columns[name] if name in columns else (log == int(name.split()[1])).astype(float) for name in names]
    )


def _fixed_drag(rows: DriveRows, names: list[str], vehicle: Vehicle) -> Array:
    """The drag taken as known where it is not fitted, N."""
    known = vehicle.number("drag") if "kappa_2" not in names and "drag" in vehicle else 0.0
    return known * rows.square


def _coefficients(
    rows: DriveRows, fit: Regression, names: list[str], vehicle: Vehicle, M: float, bias: float | None
) -> tuple[dict[str, Coefficient], list[float]]:
    """Values with their errors, and the offsets of the logs. kappa_1 is the mean of the offsets, by usable time."""
    X = _columns(rows, names)[fit.used]
    parts = solve(X, np.column_stack([-rows.y, rows.torque])[fit.used])  # theta_y, theta of each gear
    offsets = [k for k, name in enumerate(names) if name.startswith("offset")]
    weights = X[:, offsets].sum(axis=0)
    weights = weights / weights.sum()
    to_values = {name: np.eye(len(names))[k] for k, name in enumerate(names) if name in ("c_b", "kappa_2")}
    mean = np.zeros(len(names))
    mean[offsets] = weights
    to_values["kappa_1"] = mean
    if "gamma" in names:
        to_values["gamma"] = np.eye(len(names))[names.index("gamma")] / M
    sd_mass, sd_taus = _sds(vehicle, "mass", 1)[0], _sds(vehicle, "transmission", rows.torque.shape[1])
    units = {"c_b": "N/Pa", "kappa_1": "N", "kappa_2": "kg/m", "gamma": "1"}
    shift = {"kappa_1": M * (bias or 0.0)}
    found = {}
    for name, row in to_values.items():
        value = float(row @ fit.solution) + shift.get(name, 0.0)
        sd, hac = (float(np.sqrt(((row * s) ** 2).sum())) for s in (fit.sd, fit.sd_hac))
        by_mass = float(row @ parts[:, 0]) + (bias or 0.0 if name == "kappa_1" else 0.0)
        if name == "gamma":
            by_mass -= value / M
        total = float(np.sqrt(sd**2 + (by_mass * sd_mass) ** 2 + (((row @ parts[:, 1:]) * sd_taus) ** 2).sum()))
        half = fit.interval_factor * total
        found[name] = Coefficient(name, value, sd, hac, total, value - half, value + half, units[name])
    return found, [float(fit.solution[k]) for k in offsets]


def _refuse_values(found: Mapping[str, Coefficient], fit: Regression, M: float, names: list[str]) -> list[Refusal]:
    """What was fitted and still says too little."""
    refused = []
    if (c := found.get("c_b")) is not None and (c.value <= 0 or c.sd > BRAKE_SD * c.value):
        why = (
            "negative: is the pressure's sign right?" if c.value < -4 * c.sd else "too little braking that can be used"
        )
        refused.append(Refusal("c_b", f"{c.value:.3g} N/Pa with a standard error of {c.sd:.2g}: {why}"))
    elif c is not None and not BRAKE_PER_MASS[0] <= c.value / M <= BRAKE_PER_MASS[1]:
        refused.append(Refusal(
            "c_b", f"{c.value:.3g} N/Pa, where {BRAKE_PER_MASS[0] * M:.2g} to {BRAKE_PER_MASS[1] * M:.2g} can be for {M:.0f} kg: "
            "the unit of brake_pressure is suspect",
        ))  # fmt: skip
    k1 = found["kappa_1"]
    if k1.sd > max(OFFSET_SD * M, 0.25 * abs(k1.value)):
        refused.append(Refusal("kappa_1", f"{k1.value:.3g} N with a standard error of {k1.sd:.2g}"))
    elif "kappa_2" not in names:
        refused.append(Refusal("kappa_1", "it cannot be told from the drag at these speeds"))
    return refused


def _old(rows: DriveRows, force: Array, vehicle: Vehicle, M: float, first: Flags, second: Flags) -> float | None:
    """Validation RMSE with the old coefficients, each log's offset fitted, so that the bias is not held against them."""
    if "brake_coefficient" not in vehicle or "drag" not in vehicle:
        return None
    c_b, drag = vehicle.number("brake_coefficient"), vehicle.number("drag")
    e = rows.y - (force - c_b * rows.pressure - drag * rows.square) / M
    log, count = rows.log_of, rows.pieces.size - 1
    mean = np.bincount(log[first], e[first], count) / np.maximum(np.bincount(log[first], minlength=count), 1)
    return rms(e[second] - mean[log[second]])


def _sds(vehicle: Vehicle, name: str, count: int) -> Array:
    sd = vehicle.parameters[name].sd
    return np.broadcast_to(np.array(0.0 if sd is None else sd, dtype=float), (count,))


def _minutes(mask: Flags, dt: float) -> float:
    return float(mask.sum()) * dt / 60


def _named(logs: Sequence[Log]) -> str:
    return ", ".join(short_name(log) for log in logs)
