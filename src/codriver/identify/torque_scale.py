"""From a motor's command to torque: weights hung on the wheel (2019, eq. 89).

    m g r = torque_scale T_com + torque_offset             T_com  command that holds the wheel at 0      r  radius, m

A weight m, kg, hangs at the rim, its string at the radius r from the axis; a controller finds the command that holds the wheel
straight. Weights on the other side count as negative. Friction holds part of the weight, so commands for one weight differ with
the side from which the wheel came; several of each average it out. Least squares of torque on command, as the paper's line runs;
standard errors are the usual ones with n - 2 degrees of freedom, and 95 % intervals Student's.

A slope that stands below its standard errors, or commands that do not differ, are refused.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from codriver.errors import FormatError, LogError
from codriver.signals.signal import Array
from codriver.vehicles import Vehicle

GRAVITY = 9.81  # m/s^2, the paper's
RADIUS = 0.14  # m, of the paper's wheel
LEAST = 3  # weighings
COLUMNS = ("command", "mass", "radius")
MOST = 100.0  # N m
SURE = 0.1  # greatest standard error, as a share of the scale


@dataclass(frozen=True, eq=False)
class TorqueScale:
    """What was found.

    Attributes:
        scale: N m per unit of the command.
        offset: N m at command 0.
        sd_scale, sd_offset: standard errors.
        low, high: 95 % interval of the scale.
        residual: standard deviation of a weighing from the line, N m.
        r2: of the line.
        curvature: N m by which a parabola parts from the line, at most.
        command, torque: the weighings, shape (n,).
        source: where they come from.
    """

    scale: float
    offset: float
    sd_scale: float
    sd_offset: float
    low: float
    high: float
    residual: float
    r2: float
    curvature: float
    command: Array = field(repr=False)
    torque: Array = field(repr=False)
    source: str = ""

    def vehicle(self, old: Vehicle | None = None, name: str = "wheel") -> Vehicle:
        """A vehicle with scale and offset; everything else is that of the old one, if there is one."""
        new = old or Vehicle(name, f"steering wheel, weighed in {self.source}", "codriver identify torque-scale", {})
        text = f"{self.command.size} weighings in {self.source} (2019 eq. 89), residual {self.residual:.2g} N m"
        new = new.with_parameter("torque_scale", self.scale, self.sd_scale, text)
        return new.with_parameter("torque_offset", self.offset, self.sd_offset, text)


def identify_torque_scale(
    command: Array, mass: Array, *, radius: float | Array = RADIUS, gravity: float = GRAVITY, source: str = "weighings"
) -> TorqueScale:
    """Scale and offset by least squares.

    Args:
        command: T_com that held the wheel, in the device's unit, shape (n,).
        mass: hung on the wheel, kg; negative on the other side, shape (n,).
        radius: of the string, m; one number or shape (n,).
        gravity: m/s^2.
        source: where the weighings come from.

    Raises:
        LogError: too few weighings, commands that do not differ, or no line.
    """
    from scipy.special import stdtrit

    command, mass = np.asarray(command, float), np.asarray(mass, float)
    torque = mass * gravity * np.asarray(radius, float)
    if not (np.isfinite(command).all() and np.isfinite(torque).all()):
        raise LogError(
            f"{source}: numbers that are not finite", "command, mass and radius of every weighing", "fill the gaps"
        )
    if command.size and (most := float(np.abs(torque).max())) > MOST:
        raise LogError(
            f"{source}: a weight that makes {most:.4g} N m", f"at most {MOST:g} N m, by far: nobody hangs more on a steering wheel",
            "give masses in kg and the radius in m",
        )  # fmt: skip
    n = command.size
    if n < LEAST or np.unique(mass).size < 2 or not np.ptp(command) > 1e-9 * np.abs(command).max():
        raise LogError(
            f"{source}: {n} weighings, {np.unique(mass).size} different weights, commands within {np.ptp(command) if n else 0:g}",
            f"at least {LEAST} weighings with different weights and commands", "hang more weights, on both sides",
        )  # fmt: skip
    mean = command.mean()
    X = np.column_stack([np.ones(n), command - mean])
    (middle, scale), *_ = np.linalg.lstsq(X, torque, rcond=None)
    e = torque - X @ [middle, scale]
    spread = float(np.sum((command - mean) ** 2))
    variance = float(e @ e) / (n - 2)
    sd = float(np.sqrt(variance / spread))
    if not sd <= SURE * abs(scale):
        raise LogError(
            f"{source}: {scale:.3g} N m per unit with a standard error of {sd:.2g}: commands and weights are on no line",
            f"a standard error of at most {SURE:.0%}", "check the signs (weights on the other side are negative), and weigh again",
        )  # fmt: skip
    half = float(stdtrit(n - 2, 0.975)) * sd
    total = float(np.sum((torque - torque.mean()) ** 2))
    bent = 0.0
    if n > LEAST and np.unique(command).size > 2:
        u = (command - mean) / np.ptp(command)
        bent = float(np.abs(np.polynomial.Polynomial.fit(u, torque, 2)(u) - (torque - e)).max())
    return TorqueScale(
        float(scale), float(middle - scale * mean), sd, float(np.sqrt(variance * (1 / n + mean**2 / spread))),
        float(scale) - half, float(scale) + half, float(np.sqrt(variance)), 1 - float(e @ e) / total, bent, command, torque, source,
    )  # fmt: skip


def read_weighings(path: str | Path) -> tuple[Array, Array, Array | None]:
    """Weighings from a CSV file: a header with `command`, `mass` (kg) and perhaps `radius` (m), then a row each.

    Returns:
        command, mass, and radius or None.

    Raises:
        FormatError: a column is missing, or a cell is no number.
    """
    name = Path(path).name
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
        rows = list(csv.DictReader(text.splitlines(), skipinitialspace=True))
        columns = {key: [float(row[key]) for row in rows] for key in (rows[0] if rows else {}) if key in COLUMNS}
    except (UnicodeDecodeError, ValueError, TypeError, csv.Error) as error:
        raise FormatError(
            f"{name}: {error}", "a number in every cell", "correct the file; decimals have a point"
        ) from None
    lacking = [key for key in COLUMNS[:2] if key not in columns]
    if lacking:
        raise FormatError(
            f"{name} has no column {' and no '.join(lacking)}, or no rows", "a header command,mass (kg) and perhaps radius (m)",
            "name the columns so, one row a weighing",
        )  # fmt: skip
    command, mass = (np.array(columns[key]) for key in COLUMNS[:2])
    return command, mass, np.array(columns["radius"]) if "radius" in columns else None
