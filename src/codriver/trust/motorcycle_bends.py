"""What bends say of a two-wheeler's speed and gyroscope: biases that an estimator does not find, scales, a rate that comes late.

Two fits by least squares over blocks of 0.5 s while it moves, phi_m = -asin(v r / g) the lean that speed and yaw rate balance:

    integral of p = c + b_p t + k phi_m + tau p + J p'              b_p bias of the roll rate, k about 1.1 by tyres and wheels,
                                                                    tau lateness of p, J of roll inertia: p' leans as well
    g^2 (1 - g^2 / a_z^2) = c + kappa ((v r)^2 - 2 v^2 r b_r) + n p' + h p^2                b_r bias of the yaw rate

Along z an accelerometer shows all of gravity and turn, whatever the tyres, a_z = g / cos phi and sin phi = v r / g: kappa = 1, and
v r is 1 / sqrt(kappa) times too large. A bias of the yaw rate makes bends to one side seem harder than those to the other. The
pitch rate tells it too, by q = -v r^2 / (g cos phi_m), but an IMU askew about x does the same to it; else the mean of both is
taken, each by its standard error. Errors of two blocks are taken to be one.

Figures, and what they find on rides with faults: docs/motorcycle.md.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from codriver.finding import Finding
from codriver.models.road_frame import GRAVITY
from codriver.signals.grid import Flags
from codriver.signals.signal import Array

DEGREE = np.pi / 180
LEAST = 12  # blocks
SWAYING = 0.1  # rad, sd of phi_m: by less, as where a bicycle is only kept upright, turns are not balanced
CONDITION = 1e6  # beyond, the columns cannot be told apart
STRAIGHT = 0.95  # v r / g at most
HOLD = 2.0  # s over which a bias of the roll rate adds up: 2 deg of roll for 1 deg/s, with motorcycle-kalman and -ts
COSTLY, RUINOUS = 0.8 * DEGREE, 2.0 * DEGREE  # of roll
SURELY, LIKELY, LATELY = 4.0, 3.0, 2.5  # standard errors
BALANCED, APART, FAR = 1.1, 0.3, 0.45  # k, and how far from it
LATE = (-0.06, 0.12)  # s; -0.045 to 0.055 on sound rides
LEFT, LEFT_FAR = 3.0 * DEGREE, 5.0 * DEGREE  # rms of what the lean's fit leaves; up to 1.5 on sound rides
TURNS, TURNS_FAR = (0.87, 1.18), (0.69, 1.56)  # kappa: speed times yaw rate 7 and 20 % too large, 8 and 20 % too small
Values = Mapping[str, Array]


@dataclass(frozen=True, eq=False)
class Fit:
    """Coefficients by least squares, and their standard errors.

    Attributes:
        by: coefficient, by name.
        se: standard error, by name.
        left: rms of what is left.
    """

    by: Mapping[str, float]
    se: Mapping[str, float]
    left: float = 0.0

    def sure(self, name: str, expected: float = 0.0, errors: float = SURELY) -> bool:
        """Whether a coefficient is so many standard errors from what is expected."""
        return abs(self.by[name] - expected) > errors * self.se[name]


@dataclass(frozen=True, eq=False)
class Bends:
    """The fits of a ride; None where it does not tell.

    Attributes:
        sway: bias (b_p, rad/s), lean (k), late (tau, s).
        rise: turn (kappa), bias (b_r, rad/s).
        nod: bias (b_r, rad/s), by the pitch rate.
        speed: median, m/s.
    """

    sway: Fit | None
    rise: Fit | None
    nod: Fit | None
    speed: float


def fit_bends(columns: Values, moving: Flags, dt: float, block: int) -> Bends | None:
    """Fit a ride's bends.

    Args:
        columns: longitudinal_speed, roll_rate, yaw_rate, perhaps vertical_acceleration and pitch_rate, SI, shape (n,) each; NaN
            where missing.
        moving: where it moves, shape (n,).
        dt, block: tick, s, and ticks of a block.

    Returns:
        None where signals are missing, or the ride is too short or too straight.
    """
    if not {"longitudinal_speed", "roll_rate", "yaw_rate"} <= set(columns):
        return None
    v, p, r = (columns[name] for name in ("longitudinal_speed", "roll_rate", "yaw_rate"))
    stretches = _stretches(moving & np.isfinite(v) & np.isfinite(p) & np.isfinite(r), block)
    if sum(stop - start for start, stop in stretches) < LEAST * block:
        return None

    def means(column: Array) -> list[Array]:
        return [column[start:stop].reshape(-1, block).mean(axis=1) for start, stop in stretches]

    lean = np.arcsin(np.clip(-v * r / GRAVITY, -STRAIGHT, STRAIGHT))
    if np.concatenate(means(lean)).std() < SWAYING:
        return None
    rolled = [(np.cumsum(p[start:stop]) * dt).reshape(-1, block).mean(axis=1) for start, stop in stretches]
    time = [np.arange(x.size) * block * dt for x in rolled]
    rate = means(p)
    growing = [np.gradient(x) / (block * dt) if x.size > 1 else 0.0 * x for x in rate]
    sway = _least_squares(rolled, {"bias": time, "lean": means(lean), "late": rate, "inertia": growing})
    upright = np.cos(lean)
    rise = nod = None
    if (up := columns.get("vertical_acceleration")) is not None:
        shown = [GRAVITY**2 * (1 - (GRAVITY / np.maximum(np.abs(x), 1.0)) ** 2) for x in means(up)]
        turn, harder = means((v * r) ** 2), means(-2 * v * v * r)
        rise = _least_squares(shown, {"turn": turn, "bias": harder, "arm": growing, "swing": [x * x for x in rate]})
    if (nodding := columns.get("pitch_rate")) is not None:
        nod = _least_squares(means(nodding), {
            "turn": means(-v * r * r / (GRAVITY * upright)), "bias": means(2 * v * r / (GRAVITY * upright)),
        })  # fmt: skip
    return Bends(sway, rise, nod, float(np.median(np.concatenate(means(v)))))


def bend_findings(bends: Bends, values: Values, valid: Flags, askew: bool) -> list[Finding]:
    """What the fits say against an estimate.

    Args:
        bends: the fits.
        values: columns of the observer's outputs.
        valid: where it is valid.
        askew: whether the IMU is askew about x.
    """
    findings = []
    if bends.rise is not None:
        findings += _turns(bends.rise)
    if bends.sway is not None:
        if not findings:
            findings += _scale(bends.sway)
        findings += _late(bends.sway)
        if apart := _apart(bends.sway):
            return [*findings, *apart]  # no bias that stays
        findings += _bias("roll_rate", bends.sway, HOLD, values, valid)
    told = [fit for fit in (bends.rise, None if askew else bends.nod) if fit is not None and fit.se["bias"] > 0]
    if told:
        share = np.array([fit.se["bias"] ** -2 for fit in told])
        mean = float(share @ [fit.by["bias"] for fit in told] / share.sum())
        findings += _bias(
            "yaw_rate", Fit({"bias": mean}, {"bias": float(share.sum() ** -0.5)}), bends.speed / GRAVITY, values, valid
        )
    return findings


def _stretches(there: Flags, block: int) -> list[tuple[int, int]]:
    """Where nothing is missing, cut to whole blocks; two at least."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], there.astype(np.int8), [0]])))
    whole = [
        (start, start + (stop - start) // block * block) for start, stop in zip(edges[::2], edges[1::2], strict=True)
    ]
    return [(start, stop) for start, stop in whole if stop - start >= 2 * block]


def _least_squares(y: list[Array], columns: dict[str, list[Array]]) -> Fit | None:
    """y of the columns, each stretch with a constant of its own; None where too little is left, or it cannot be told."""
    there = [np.all(np.isfinite([a, *parts]), axis=0) for a, *parts in zip(y, *columns.values(), strict=True)]

    def centred(parts: list[Array]) -> Array:
        kept = [part[good] for part, good in zip(parts, there, strict=True)]
        return np.concatenate([part - part.mean() if part.size else part for part in kept])

    target, X = centred(y), np.column_stack([centred(parts) for parts in columns.values()])
    free = target.size / 2 - len(columns) - sum(bool(good.any()) for good in there)
    if target.size < LEAST or free < 1 or np.ptp(target) == 0 or not np.linalg.norm(X, axis=0).all():
        return None
    if np.linalg.cond(X / np.linalg.norm(X, axis=0)) > CONDITION:
        return None
    normal = np.linalg.inv(X.T @ X)
    found = normal @ X.T @ target
    left = float(np.sum((target - X @ found) ** 2))
    se = np.sqrt(np.diag(normal) * left / free)
    by, errors = (dict(zip(columns, map(float, numbers), strict=True)) for numbers in (found, se))
    return Fit(by, errors, float(np.sqrt(left / target.size)))


def _turns(fit: Fit) -> list[Finding]:
    """Speed times yaw rate beside the vertical accelerometer."""
    kappa = fit.by["turn"]
    if TURNS[0] < kappa < TURNS[1] or not fit.sure("turn", 1.0):
        return []
    times = f"{kappa**-0.5:.2g}" if kappa > 0.04 else "more than 5"
    return [Finding(
        "warn" if TURNS_FAR[0] < kappa < TURNS_FAR[1] else "bad",
        f"speed times yaw rate is {times} times what the vertical accelerometer shows of the same bends: is the speed's or the "
        "gyroscope's unit or scale wrong, or does the wheel slip?",
    )]  # fmt: skip


def _scale(fit: Fit) -> list[Finding]:
    """Roll rate beside speed and yaw rate."""
    k = fit.by["lean"]
    if abs(k - BALANCED) < APART or not fit.sure("lean", BALANCED, LIKELY):
        return []
    return [Finding(
        "bad" if abs(k - BALANCED) > FAR else "warn",
        f"the roll rate adds up to {k:.2g} times the lean that speed and yaw rate balance, where 1 to 1.2 is right: is a unit "
        "or scale of speed or gyroscope wrong?",
    )]  # fmt: skip


def _late(fit: Fit) -> list[Finding]:
    """Roll rate and yaw rate on different clocks."""
    late = fit.by["late"]
    if LATE[0] < late < LATE[1] or not fit.sure("late", errors=LATELY):
        return []
    slow, quick = ("yaw_rate", "roll_rate") if late > 0 else ("roll_rate", "yaw_rate")
    return [Finding(
        "warn", f"{slow} comes about {abs(late):.2g} s later than {quick}: other clocks, another low-pass? A tenth of a second "
        "costs 2 to 3 degrees of roll in quick changes of lean",
    )]  # fmt: skip


def _apart(fit: Fit) -> list[Finding]:
    """A roll rate that adds up to something else."""
    if fit.left < LEFT:
        return []
    return [Finding(
        "warn" if fit.left < LEFT_FAR else "bad",
        f"the roll rate adds up to a lean that departs by {fit.left / DEGREE:.2g} degrees (rms) from that of speed and yaw rate, "
        "biases and scale allowed for: a bias that changes, other clocks, spikes?",
    )]  # fmt: skip


def _bias(name: str, fit: Fit, cost: float, values: Values, valid: Flags) -> list[Finding]:
    """A bias, by what it costs of roll where the estimator does not find it."""
    output = f"{name}_bias"
    finds = output in values and bool(valid.any())
    found = float(np.median(values[output][valid])) if finds else 0.0
    left = abs(fit.by["bias"] - found) * cost
    if left < COSTLY or not fit.sure("bias", found, LIKELY):
        return []
    here = f", where {found / DEGREE:.2g} was found" if finds else ", which is not found here"
    return [Finding(
        "bad" if left > RUINOUS else "warn",
        f"{name} has a bias of about {fit.by['bias'] / DEGREE:.2g} deg/s by the bends{here}: some {left / DEGREE:.1g} degrees of "
        "roll; take it out by offset in the names file",
    )]  # fmt: skip
