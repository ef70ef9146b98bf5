"""What a road vehicle's coefficients can be, and how far a new value may be from the old one.

Bounds per mass hold for cars and trucks alike: a brake that gives 1 g at 50 bar has c_b = 2e-6 M N/Pa, one that gives it at
8 bar of air 1.2e-5 M. Bounds of the drag follow from c_d A: kappa_2 = rho c_d A / 2, with 0.2 to 1.2 m^2 for cars, to 2.2
for vans, to 10 for trucks, rho = 1.2 kg/m^3. An accelerometer's bias of 0.3 m/s^2 is a bad one (4 % of road slope look alike).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from codriver.errors import LogError, UsageError
from codriver.finding import Finding
from codriver.vehicles import Vehicle
from codriver.vehicles.known import KNOWN

BRAKE_PER_MASS = (8e-8, 2e-5)  # c_b / M, 1/(m s^2 Pa) m/s^2
DRAGS = ((2500.0, 0.72), (5000.0, 1.3), (np.inf, 6.0))  # up to so many kg, kg/m
LEAST_DRAG = 0.08  # kg/m
ODD_BIAS = 0.3  # m/s^2
ROLLING = (-0.05, 0.3)  # kappa_1 / M with a known bias, m/s^2
MOST_BIAS = 2.0  # m/s^2, that a caller may give
FAR, CLEAR, LEAST_FAR = 0.2, 4.0, 0.05  # share; standard errors of both; share that is told at all
"""A factor beyond FAR is told, or one beyond CLEAR standard errors and LEAST_FAR."""


def check_bias(bias: float | None) -> None:
    """Whether a bias can be one.

    Raises:
        UsageError: it cannot.
    """
    if bias is not None and not abs(bias) <= MOST_BIAS:
        raise UsageError(
            f"an accelerometer's bias of {bias:g} m/s^2", f"a number between {-MOST_BIAS:g} and {MOST_BIAS:g}",
            "measure it where the car stands on level ground, in m/s^2",
        )  # fmt: skip


def drag_bounds(M: float) -> tuple[float, float]:
    """Least and greatest kappa_2 of a vehicle of so many kg, kg/m."""
    return LEAST_DRAG, next(most for mass, most in DRAGS if mass >= M)


def within_file_bounds(name: str, values: Sequence[float], suspect: str) -> None:
    """Whether a vehicle file could hold what was found.

    Args:
        name: of the parameter.
        values: found, SI.
        suspect: what is likely wrong otherwise.

    Raises:
        LogError: it could not.
    """
    known = KNOWN[name]
    odd = [value for value in values if not known.low <= value <= known.high]
    if odd:
        raise LogError(
            f"{name} comes out as {odd[0]:.3g} {known.unit}, which no vehicle has; nothing was written",
            f"{known.low:g} to {known.high:g} {known.unit}", f"likely wrong: {suspect}; check it in the names file",
        )  # fmt: skip


def far_from_old(letter: str, value: float, sd: float, old: Vehicle, name: str, cause: str) -> list[Finding]:
    """A warning where a coefficient is far from the vehicle's old value.

    Args:
        letter: the paper's letter.
        value, sd: found, and its standard error.
        old: the vehicle.
        name: of the parameter.
        cause: what is likely wrong if the old value is right.
    """
    if name not in old or not (before := old.number(name)) > 0:
        return []
    known = old.parameters[name].sd
    factor, off = value / before, abs(value - before) / np.hypot(sd, known if isinstance(known, float) else 0.0)
    far = not 1 / (1 + FAR) <= factor <= 1 + FAR and off > 2
    if not far and not (known is not None and off > CLEAR and abs(factor - 1) > LEAST_FAR):
        return []
    return [Finding("warn", f"{letter} is {factor:.3g} times the vehicle's old value: if that was right, then {cause}")]
