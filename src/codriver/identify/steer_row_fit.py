"""The steer equation of a bicycle from recordings in which the torque on the fork is known.

    by acceleration   delta'' = a (T - sum fixed theta_i x_i) - sum free b_i x_i,      M_dd = 1 / a,  theta_i = b_i / a
    by torque         T - sum fixed theta_i x_i = M_dd delta'' + sum free theta_i x_i

with theta_i and x_i the coefficients and columns of `codriver.models.steer_row`. Where a controller makes the torque from what
the bicycle does (T = k phi'), least squares of the torque finds the controller, with a perfect fit; the acceleration does
better there as long as something else makes torque too. Where a rider's arms move with the handlebar and the torque is noisy, the
acceleration does not tell M_dd, and is refused (not positive, or not known to half of itself); the torque predicts itself well
then, with coefficients that are the rider's as much as the bicycle's.

All signals go through the same low-pass forwards and backwards (Butterworth, second order, `band` Hz), which keeps an equation
that is linear in them true and shifts nothing; derivatives are central differences of the filtered. Standard errors: Newey and
West (`standard_errors`), and the delta method for the ratios. By torque is the canonical identification of Moore 2012, Human
control of a bicycle, PhD thesis, UC Davis, chapter 12.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from codriver.errors import LogError, MissingSignal, UsageError
from codriver.finding import Finding
from codriver.identify.standard_errors import block_length, newey_west
from codriver.identify.steering_record import mend_angle
from codriver.models.bicycle import GRAVITY
from codriver.models.steer_row import SteerMotion, SteerRow, sliding
from codriver.signals import Log, Signal
from codriver.signals.grid import Flags
from codriver.signals.signal import Array

BAND = 5.0  # Hz
SIGNALS = ("roll_angle", "roll_rate", "steer_angle", "longitudinal_speed", "rider_torque")
COEFFICIENTS = ("M_dphi", "C1_dphi", "C1_dd", "K0_dphi", "K0_dd", "K2_dd", "friction", "offset")
SETTLES = 1.0  # s at both ends of a record, where the low-pass is not itself
SLOWEST = 0.5  # m/s: below it a bicycle is pushed or lies
WORST = 0.5  # greatest standard error of M_dd, of itself
FASTEST = 10.0  # rad/s: a fork that turns quicker is an encoder that jumps; a fall showed 5.4
QUICKER = 4.0  # the rate that friction looks at passes so many times `band`
TOO_ALIKE = 1e6  # condition of the columns, each scaled to 1
WAYS = ("acceleration", "torque")


@dataclass(frozen=True, eq=False)
class SteerRecord:
    """One record, filtered.

    Attributes:
        dt: tick, s.
        motion: what the bicycle did.
        torque: T, N m, filtered; NaN where the log has none.
        used: rows that count, shape (n,).
        findings: what was wrong with the steer angle, and what was done about it.
    """

    dt: float
    motion: SteerMotion
    torque: Array
    used: Flags
    findings: tuple[Finding, ...] = ()


@dataclass(frozen=True, eq=False)
class SteerRowFit:
    """The row found.

    Attributes:
        row: the coefficients.
        sd: standard errors by name; 0 for those that were given.
        r2: share of the variance of the left side that is explained.
        rows: how many rows counted.
        by: "acceleration" or "torque".
    """

    row: SteerRow
    sd: Mapping[str, float]
    r2: float
    rows: int
    by: str


def steer_record(
    log: Log, dt: float, *, band: float = BAND, delay: float = 0.0, known_torque: bool = True
) -> SteerRecord:
    """A log filtered for the fit.

    Args:
        log: with `SIGNALS`.
        dt: tick, s.
        band: of the low-pass, Hz.
        delay: the torque acts so many seconds after its stamp.
        known_torque: whether the log must have the torque.

    Raises:
        MissingSignal: a signal is not there.
    """
    from scipy.signal import butter, sosfiltfilt

    wanted = SIGNALS if known_torque else SIGNALS[:-1]
    absent = [name for name in wanted if name not in log]
    if absent:
        raise MissingSignal(f"the log lacks {', '.join(absent)}", f"{', '.join(wanted)}", "map them in the names file")
    angle, jumps, findings = mend_angle(log["steer_angle"])
    angle, told = _longest_run(angle)
    if jumps.size:
        findings = findings[:-1]  # that of the jumps, which is told below with what is done about it
    log = log.with_signals(angle)
    grid = log.sample(wanted, dt)
    there = np.all([grid.held[name] for name in wanted], axis=0)
    sos = butter(2, band, fs=1 / dt, output="sos")
    values = {name: np.nan_to_num(grid.values[name]) for name in wanted}
    soft = {name: sosfiltfilt(sos, x) for name, x in values.items()}
    steer_rate = np.gradient(soft["steer_angle"], dt)
    quick = sosfiltfilt(butter(2, min(QUICKER * band, 0.4 / dt), fs=1 / dt, output="sos"), values["steer_angle"])
    slides = sosfiltfilt(sos, sliding(np.gradient(quick, dt)))
    speed = values["longitudinal_speed"]
    motion = SteerMotion(
        roll=soft["roll_angle"], roll_rate=soft["roll_rate"], roll_acceleration=np.gradient(soft["roll_rate"], dt),
        steer=soft["steer_angle"], steer_rate=steer_rate, steer_acceleration=np.gradient(steer_rate, dt),
        sliding=slides, speed=speed,
    )  # fmt: skip
    torque = np.full(speed.size, np.nan)
    if known_torque:
        torque = np.interp(grid.time - delay, grid.time, soft["rider_torque"])
    inside = (grid.time >= angle.time[0] + SETTLES + delay) & (grid.time <= angle.time[-1] - SETTLES)
    return SteerRecord(dt, motion, torque, there & inside & (speed > SLOWEST), (*findings, *told))


def _longest_run(angle: Signal) -> tuple[Signal, list[Finding]]:
    """The longest part of an angle in which the encoder does not jump: what it showed before or after is another zero."""
    steps = np.abs(np.diff(angle.values))
    jumps = np.flatnonzero(steps > FASTEST * np.maximum(np.diff(angle.time), 1e-3))
    if not jumps.size:
        return angle, []
    edges = np.array([0, *(jumps + 1), len(angle)])
    k = int(np.diff(edges).argmax())
    part = slice(edges[k], edges[k + 1])
    said = f"the encoder of the steer angle jumps {jumps.size} times, by up to {steps[jumps].max():.3g} rad"
    said += f"; from {angle.time[part][0]:.2f} to {angle.time[part][-1]:.2f} s is used"
    return Signal(angle.name, angle.time[part], angle.values[part], angle.unit, angle.source), [Finding("warn", said)]


def fit_steer_row(
    records: Sequence[SteerRecord], fixed: Mapping[str, float] | None = None, *, by: str = WAYS[0], g: float = GRAVITY
) -> SteerRowFit:
    """The row that fits records best.

    Args:
        records: by `steer_record`, all with a known torque.
        fixed: coefficients that are known, by name. At one speed K0_dd and K2_dd cannot be told apart: give one of them.
        by: what is explained, "acceleration" or "torque"; see the module's docstring.
        g: m/s^2.

    Raises:
        UsageError: a name that is no coefficient, or no such way.
        LogError: the records do not tell the coefficients.
    """
    fixed = dict(fixed or {})
    names = COEFFICIENTS if by == WAYS[0] else ("M_dd", *COEFFICIENTS)
    wrong = sorted(set(fixed) - set(names))
    if wrong or by not in WAYS:
        raise UsageError(
            f"by '{by}', fixed: {', '.join(wrong) or 'nothing wrong'}",
            f"{' or '.join(WAYS)}, names among {', '.join(names)}",
            "correct them",
        )
    free = [name for name in names if name not in fixed]
    columns = [record.motion.columns(g) for record in records]
    left = [r.torque - sum(v * c[n] for n, v in fixed.items()) for r, c in zip(records, columns, strict=True)]
    pushed, shown = np.concatenate(left), np.vstack([np.column_stack([c[n] for n in free]) for c in columns])
    X, y = shown, pushed
    if by == WAYS[0]:
        X = np.column_stack([pushed, -shown])
        y = np.concatenate([record.motion.steer_acceleration for record in records])
    used = np.concatenate([record.used for record in records])
    if used.sum() <= 10 * X.shape[1]:
        raise LogError(f"{int(used.sum())} usable rows", "some minutes of riding with a known torque", "record more")
    X = np.where(used[:, None], X, 0.0)
    scale = np.sqrt((X[used] ** 2).mean(axis=0))
    if not (scale > 0).all() or np.linalg.cond(X[used] / scale) > TOO_ALIKE:
        raise LogError(
            f"the records cannot tell M_dd, {', '.join(n for n in free if n != 'M_dd')} apart",
            "motion in which no column is made of the others: several speeds, or K0_dd or K2_dd given",
            "give what is known of the bicycle as fixed",
        )
    found = np.linalg.lstsq(X[used] / scale, y[used], rcond=None)[0] / scale
    e = np.where(used, y - X @ found, 0.0)
    pieces = np.concatenate([[0], np.cumsum([record.used.size for record in records])])
    covariance = newey_west(X, e, used, pieces, block_length(X, e, used, pieces))
    if by == WAYS[0]:
        free, found, covariance = ["M_dd", *free], *_ratios(found, covariance)
    values, sd = dict(zip(free, found.tolist(), strict=True)), np.sqrt(np.diag(covariance))
    errors = {**dict.fromkeys(fixed, 0.0), **dict(zip(free, sd.tolist(), strict=True))}
    if by == WAYS[0] and not errors["M_dd"] < WORST * values["M_dd"]:
        raise LogError(
            f"M_dd comes out as {values['M_dd']:.3g} kg m^2 with a standard error of {errors['M_dd']:.2g}",
            "a positive inertia, known to half of itself",
            "the torque must not be made from the motion alone; check its sign and its delay, or fit by torque",
        )
    r2 = float(1 - e[used].var() / max(y[used].var(), 1e-300))
    return SteerRowFit(SteerRow(**{**values, **fixed}, g=g), errors, r2, int(used.sum()), by)


def _ratios(found: Array, covariance: Array) -> tuple[Array, Array]:
    """(1 / a, b / a) of (a, b), and their covariance by the delta method."""
    a, b = found[0], found[1:]
    turn = np.zeros((found.size, found.size))
    turn[0, 0], turn[1:, 0] = -1 / a**2, -b / a**2
    turn[1:, 1:] = np.eye(b.size) / a
    return np.concatenate([[1 / a], b / a]), turn @ covariance @ turn.T
