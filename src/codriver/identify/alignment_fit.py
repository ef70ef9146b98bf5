"""The alignment map fitted to drives: least squares with what passenger cars are like as a weak prior.

    minimise  sum over rows of dt / (2 tau) e^2 / s^2  +  sum over coefficients of (log x - log usual)^2 / width^2

    e = T_dr measured - (T_c z + b_s omega_s - T_aln)           N m, see `models.alignment`

What the map leaves out (the road's bank most of all) is alike for seconds, so neighbours do not count as independent: s, N m,
and tau, s, are the standard deviation and the correlation time of e itself, found in turns with the coefficients. T_0's prior is
in N m. A coefficient that the drives alone leave wider than half its prior is not told: it is held at the usual value, and
refused.

The whole load on a column, which no assist takes a share of, has no T_s (WHOLE).

Standard errors are those of the drives alone, by blocks of BLOCK seconds, A^-1 B A^-1: A the curvature of the sum without the
prior, B the sum of the squared scores of the blocks. They need no tau, and count what is alike within a block.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import exp, log
from typing import Any

import numpy as np

from codriver.identify.alignment_drive import Drive
from codriver.identify.standard_errors import autocorrelation
from codriver.models.alignment import GRAVITY, USUAL, AlignmentModel
from codriver.signals.grid import Flags
from codriver.signals.signal import Array

# letter: (attribute of the model, name in a vehicle file, width of the prior's logarithm, unit); T_0's width is N m
LETTERS = {
    "k_a": ("gain", "alignment_gain", 1.0, "kg*m"),
    "T_s": ("bend", "alignment_bend", 0.7, "N*m"),
    "T_0": ("offset", "alignment_offset", 0.3, "N*m"),
    "e_max": ("bank", "road_bank", 0.5, "rad"),
    "q": ("bank_share", "road_bank_share", 0.7, "1"),
    "b_s": ("damping", "steering_damping", 1.0, "N*m*s/rad"),
    "T_c": ("coulomb", "steering_friction", 1.0, "N*m"),
    "w": ("width", "steering_friction_width", 1.0, "rad"),
}
WHOLE = tuple(letter for letter in LETTERS if letter != "T_s")
NO_BEND = 1000.0  # N m, T_s that bends nothing; a vehicle file holds no infinite number
TOLD = 0.5  # of the prior's width
BLOCK, LEAST_BLOCKS = 20.0, 3  # s, and blocks a coefficient that shorten them in a short drive
START = (0.3, 3.0)  # s, N m, and tau, s
ROUNDS = 3
Chosen = Sequence[tuple[Drive, Flags]]


@dataclass(frozen=True, eq=False)
class MapFit:
    """A fit.

    Attributes:
        model: the map.
        free: letters that were fitted.
        x: their values as the search has them: logarithms, T_0 as it is, shape (p,).
        sd_x: standard errors of x from the drives alone, shape (p,); infinite where they tell nothing.
        sd: of e, N m.
        time: correlation time of e, s.
    """

    model: AlignmentModel
    free: tuple[str, ...]
    x: Array = field(repr=False)
    sd_x: Array = field(repr=False)
    sd: float
    time: float

    def worst(self) -> str | None:
        """The letter that the drives tell least, if they do not tell it."""
        doubt = self.sd_x / [LETTERS[letter][2] for letter in self.free]
        # Where nothing is told, the gain is what is least in doubt.
        k = len(self.free) - 1 - int(np.argmax(doubt[::-1]))
        return self.free[k] if not doubt[k] < TOLD else None


def fit_map(rows: Chosen, start: AlignmentModel, free: Sequence[str] = tuple(LETTERS)) -> MapFit:
    """Fit.

    Args:
        rows: drives, and which rows of each count.
        start: what is not fitted; geometry counts.
        free: letters to fit.
    """
    from scipy.optimize import least_squares

    free = tuple(free)
    middle = np.array([_inner(letter, USUAL[LETTERS[letter][1]]) for letter in free])
    width = np.array([LETTERS[letter][2] for letter in free])
    slides = _Slides()
    (sd, time), u = START, np.zeros(len(free))
    for _ in range(ROUNDS):
        weights = [np.sqrt(drive.dt / (2 * time)) / sd for drive, _ in rows]

        def left(u: Array, weights: list[float] = weights) -> Array:
            model = _model(start, free, middle + width * u)
            parts = [w * slides.left(d, model)[keep] for w, (d, keep) in zip(weights, rows, strict=True)]
            return np.concatenate([u, *parts])

        found = least_squares(left, u, diff_step=1e-4, x_scale=1.0, max_nfev=40)
        u = found.x
        model = _model(start, free, middle + width * u)
        errors = [slides.left(d, model) for d, _ in rows]
        used = np.concatenate([e[keep] for e, (_, keep) in zip(errors, rows, strict=True)])
        sd, time = float(np.sqrt(np.mean(used**2))), correlation_time(rows, errors)
    return MapFit(model, free, middle + width * u, width * _standard_errors(rows, found.jac, found.fun), sd, time)


def fit_told(
    rows: Chosen, start: AlignmentModel, letters: Sequence[str] = tuple(LETTERS)
) -> tuple[MapFit, tuple[str, ...]]:
    """The fit of what the drives tell, and the letters that they do not; those are as usual.

    What is told least goes first, since the others can be told better then.

    Args:
        rows: drives, and which rows of each count.
        start: what is not fitted.
        letters: to fit.
    """
    fit, refused = fit_map(rows, start, letters), []
    while (lost := fit.worst()) is not None:
        refused.append(lost)
        if lost == "k_a":
            break
        usual: dict[str, Any] = {LETTERS[letter][0]: USUAL[LETTERS[letter][1]] for letter in refused}
        fit = fit_map(rows, replace(start, **usual), [letter for letter in letters if letter not in refused])
    return fit, tuple(refused)


def modelled(drive: Drive, model: AlignmentModel) -> Array:
    """The driver's torque along a drive, N m: what friction takes, less T_aln."""
    states = {
        "road_curvature": drive.road_curvature,
        "road_speed": drive.road_speed,
        "presliding": drive.presliding(model),
    }
    bank = model.road_bank(drive.road_curvature, drive.road_speed)
    return np.asarray(model.friction(states, drive.rate) - model.felt(drive.lateral - GRAVITY * bank))


def correlation_time(rows: Chosen, errors: Sequence[Array]) -> float:
    """Integral of the autocorrelation of e up to its first value below 0.05, s."""
    total, weight = 0.0, 0.0
    for (drive, keep), e in zip(rows, errors, strict=True):
        most = max(min(round(30.0 / drive.dt), drive.time.size // 4), 1)
        rho = autocorrelation(e, keep, np.array([0, e.size]), most)
        below = np.flatnonzero(rho < 0.05)
        first = int(below[0]) if below.size else rho.size
        total += float(keep.sum()) * drive.dt * (float(rho[:first].sum()) - 0.5) * drive.dt
        weight += float(keep.sum()) * drive.dt
    return max(total / weight, min(drive.dt for drive, _ in rows))


class _Slides:
    """Presliding along the drives, kept for the widths asked last, since it is the slow part."""

    def __init__(self) -> None:
        self._kept: dict[tuple[int, float], Array] = {}

    def left(self, drive: Drive, model: AlignmentModel) -> Array:
        """e along a drive, N m."""
        key = id(drive), model.width
        if key not in self._kept:
            if len(self._kept) > 40:
                self._kept.clear()
            self._kept[key] = drive.presliding(model)
        bank = model.road_bank(drive.road_curvature, drive.road_speed)
        felt = model.felt(drive.lateral - GRAVITY * bank)
        return np.asarray(drive.torque - model.friction({"presliding": self._kept[key]}, drive.rate) + felt)


def _standard_errors(rows: Chosen, jacobian: Array, residual: Array) -> Array:
    """Of the search's unknowns, without the prior, whose rows come first; shape (p,)."""
    p = jacobian.shape[1]
    curvature = jacobian[p:].T @ jacobian[p:]
    size = np.sqrt(np.maximum(np.diag(curvature), 1e-300))
    if np.linalg.cond(curvature / size / size[:, None]) > 1e10:
        return np.full(p, np.inf)
    span = min(BLOCK, sum(drive.dt * keep.sum() for drive, keep in rows) / (LEAST_BLOCKS * p))
    sums, first = [], p
    for drive, keep in rows:
        count = int(keep.sum())
        scores = jacobian[first : first + count] * residual[first : first + count, None]
        length = max(round(span / drive.dt), 1)
        sums.append(np.add.reduceat(scores, np.arange(max(count // length, 1)) * length, axis=0))
        first += count
    blocks = np.vstack(sums)
    if blocks.shape[0] <= p:
        return np.full(p, np.inf)
    inverse = np.linalg.inv(curvature)
    covariance = inverse @ (blocks.T @ blocks) @ inverse * blocks.shape[0] / (blocks.shape[0] - p)
    return np.asarray(np.sqrt(np.diag(covariance)))


def _inner(letter: str, value: float) -> float:
    """As the search has it."""
    return value if letter == "T_0" else log(value)


def _model(start: AlignmentModel, free: Sequence[str], x: Array) -> AlignmentModel:
    """The map with these coefficients; logarithms are kept where exp is a number."""
    values: dict[str, Any] = {
        LETTERS[letter][0]: float(v) if letter == "T_0" else exp(min(max(float(v), -30.0), 30.0))
        for letter, v in zip(free, x, strict=True)
    }
    return replace(start, **values)
