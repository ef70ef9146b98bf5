"""What is to say about an identification of the brake, and when it must not become a vehicle file.

A fit is condemned, and nothing of it is written, where

* it explains the half of the data that it was not fitted to hardly better than a constant, or worse than the old coefficients;
* gamma is no pitch, kappa_1 no rolling resistance with any bias, kappa_2 no drag of such a vehicle;
* many moments do not fit, or the engine turns as in another gear than the log names.

A coefficient far from the vehicle's old value is told with the likely cause.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from codriver.errors import LogError
from codriver.finding import Finding
from codriver.identify.brake_rows import DriveRows
from codriver.identify.plausible import ODD_BIAS, ROLLING, drag_bounds, far_from_old
from codriver.identify.regression import solve
from codriver.signals.signal import Array
from codriver.vehicles import Vehicle

if TYPE_CHECKING:
    from codriver.identify.brake_fit import BrakeFit

ODD_GAIN, WRONG_GAIN = 0.06, 0.1  # gamma beyond them is no pitch alone (5 % of M are enough), and is no pitch at all
EXPLAINS, HARDLY = 0.5, 0.9  # of the RMSE of a constant
WORSE = 1.05  # times the old coefficients' RMSE
SOME_OUTLIERS, MANY_OUTLIERS = 0.02, 0.08
UNEVEN, LEAST_SECONDS, LEAST_TORQUE = 0.1, 30.0, 10.0  # share of the force; s; N m, standard deviation
_CAUSES = {
    "c_b": "the unit of the pressure, the mass or the gear is wrong",
    "kappa_2": "the unit or scale of the speed, the mass or the gear is wrong, or the car carries something else",
}


def brake_findings(fit: BrakeFit) -> list[Finding]:
    """What is to say about the fit, the worst first."""
    said = condemned(fit)
    said += [Finding("bad", f"{r.name} is refused: {r.reason}") for r in fit.refused if r.name != "gamma"]
    said += [Finding("warn", f"gamma is left out: {r.reason}") for r in fit.refused if r.name == "gamma"]
    for found in fit.coefficients.values():
        if not 0.5 < found.sd_hac / found.sd < 2.0:
            said.append(Finding(
                "warn", f"{found.name}: the two standard errors differ, {found.sd:.3g} (bootstrap) and {found.sd_hac:.3g} "
                f"(Newey-West) {found.unit}: a few moments decide; a longer drive would help",
            ))  # fmt: skip
    gamma, kappa_1 = (fit.coefficients.get(name) for name in ("gamma", "kappa_1"))
    if gamma is not None and ODD_GAIN < abs(gamma.value) <= WRONG_GAIN:
        said.append(Finding(
            "warn", f"the accelerometer's gain error comes out as {gamma.value:.1%}, where pitch makes 1 to 2 %: is the mass that "
            "of the drive? c_b is hardly touched, kappa_1 and kappa_2 are",
        ))  # fmt: skip
    if kappa_1 is not None and kappa_1.value < 0:
        said.append(Finding(
            "warn", "kappa_1 - M d_a is negative: the accelerometer's bias is larger than the rolling resistance; not written"
        ))  # fmt: skip
    said += [f for f in fit.remarks if f.severity != "bad"]
    if SOME_OUTLIERS < fit.trimmed <= MANY_OUTLIERS:
        said.append(
            Finding("warn", f"{fit.trimmed:.1%} of the moments do not fit and were left out as outliers: gear, clutch?")
        )
    if fit.rmse >= EXPLAINS * fit.rmse_constant:
        said.append(Finding("warn", "the validation half is hardly explained: check units, mass and gear of the log"))
    elif not any(f.severity == "bad" for f in said) and fit.trimmed <= SOME_OUTLIERS:
        said.append(Finding("ok", "the coefficients explain the half of the data that they were not fitted to"))
    return sorted(said, key=lambda one: ("bad", "warn", "ok").index(one.severity))


def condemned(fit: BrakeFit) -> list[Finding]:
    """Why the fit must not become a vehicle file; empty if it may."""
    said = [f for f in fit.remarks if f.severity == "bad"]
    if not fit.rmse < HARDLY * fit.rmse_constant:
        said.append(Finding(
            "bad", f"validation RMSE {fit.rmse:.3g} m/s^2, and {fit.rmse_constant:.3g} for a constant: torque, gear and pressure do"
            " not explain the motion; is the torque's sign right?",
        ))  # fmt: skip
    elif fit.rmse_old is not None and fit.rmse > WORSE * fit.rmse_old:
        said.append(Finding(
            "bad", "the old coefficients fit the validation half better: keep them, or record a longer drive"
        ))  # fmt: skip
    gamma = fit.coefficients.get("gamma")
    if gamma is not None and abs(gamma.value) > WRONG_GAIN:
        said.append(Finding(
            "bad", f"the accelerometer's gain error comes out as {gamma.value:.1%}, which is no pitch: mass or tau of the vehicle "
            "file is wrong, or the scale of torque, accelerometer or speed; c_b goes with tau",
        ))  # fmt: skip
    kappa_1, kappa_2 = (fit.coefficients.get(name) for name in ("kappa_1", "kappa_2"))
    least, most = ROLLING if fit.bias_known else (-ODD_BIAS, ROLLING[1] + ODD_BIAS)
    if kappa_1 is not None and not least <= kappa_1.value / fit.mass <= most:
        said.append(Finding(
            "bad", f"{'kappa_1' if fit.bias_known else 'kappa_1 - M d_a'} is {kappa_1.value:.4g} N, {kappa_1.value / fit.mass:.2g} "
            f"m/s^2 of the mass, where {least:g} to {most:.2g} can be: gear, torque, mass or the accelerometer's zero is wrong",
        ))  # fmt: skip
    least, most = drag_bounds(fit.mass)
    if kappa_2 is not None and (kappa_2.value + 2 * kappa_2.sd < least or kappa_2.value - 2 * kappa_2.sd > most):
        said.append(Finding(
            "bad", f"kappa_2 is {kappa_2.value:.3g} kg/m, where a vehicle of {fit.mass:.0f} kg has {least:g} to {most:g}: gear, "
            "mass, tau, or the unit of torque or speed is wrong",
        ))  # fmt: skip
    if fit.trimmed > MANY_OUTLIERS:
        said.append(Finding(
            "bad", f"{fit.trimmed:.1%} of the moments do not fit at all: is the log's gear the engaged one, and the torque right?"
        ))  # fmt: skip
    return said


def refuse_condemned(fit: BrakeFit) -> None:
    """Raises LogError where the fit is condemned, with all the reasons."""
    if condemned(fit):
        reasons = [f.text for f in brake_findings(fit) if f.severity == "bad" or f in fit.rows.clipped]
        raise LogError(
            f"{', '.join(fit.sources)}: {'; '.join(reasons)}", "coefficients that their own validation bears out",
            "mend what is named; nothing was written",
        )  # fmt: skip


def remarks(fit: BrakeFit, old: Vehicle, taus: Array) -> list[Finding]:
    """What gears and the old vehicle say: uneven gears, and factors from the old values."""
    found = uneven_gears(fit.rows, fit.model, taus, fit.mass)
    for letter, name in (("c_b", "brake_coefficient"), ("kappa_2", "drag")):
        if (c := fit.coefficients.get(letter)) is not None:
            found += far_from_old(letter, c.value, c.sd_total, old, name, _CAUSES[letter])
    return found


def uneven_gears(rows: DriveRows, model: Array, taus: Array, M: float) -> list[Finding]:
    """A warning where in some gear the car accelerates by another share of tau T_e than the fit says."""
    odd = []
    for k, tau in enumerate(taus):
        there = rows.keep & (rows.gear == k + 1)
        torque = rows.torque[there, k]
        if there.sum() * rows.dt < LEAST_SECONDS or torque.std() < LEAST_TORQUE:
            continue
        try:
            share = float(solve(np.column_stack([tau / M * torque, np.ones_like(torque)]), (rows.y - model)[there])[0])
        except LogError:
            continue
        if abs(share) > UNEVEN:
            odd.append(f"{1 + share:.2f} times in gear {k + 1}")
    if not odd:
        return []
    return [
        Finding(
            "warn", f"the car accelerates with tau T_e / M not as the fit says ({', '.join(odd)}): gear or tau wrong?"
        )
    ]
