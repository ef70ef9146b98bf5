"""The steer equation of a bicycle from recordings in which the torque on the fork is known.

    delta'' = a (T - sum fixed theta_i x_i) - sum free b_i x_i,      M_dd = 1 / a,  theta_i = b_i / a

with theta_i and x_i the coefficients and columns of `codriver.models.steer_row`. The acceleration stands on the left, not the
torque: where a rider or a controller makes the torque from what the bicycle does (T = k phi'), least squares of the torque on
the motion finds the controller, with a perfect fit. A record in which nothing else makes the torque tells nothing either way:
M_dd that is not positive, or not known to half of itself, is refused.

All signals go through the same low-pass forwards and backwards (Butterworth, second order, `band` Hz), which keeps an equation
that is linear in them true and shifts nothing; derivatives are central differences of the filtered. Standard errors: Newey and
West (`standard_errors`), and the delta method for the ratios. Canonical identification of a bicycle: Moore 2012, Human control of
a bicycle, PhD thesis, UC Davis, chapter 12 (there with the torque on the left).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from codriver.errors import LogError, MissingSignal, UsageError
from codriver.identify.standard_errors import block_length, newey_west
from codriver.models.bicycle import GRAVITY
from codriver.models.steer_row import SteerMotion, SteerRow
from codriver.signals import Log
from codriver.signals.grid import Flags
from codriver.signals.signal import Array

BAND = 5.0  # Hz
SIGNALS = ("roll_angle", "roll_rate", "steer_angle", "longitudinal_speed", "rider_torque")
COEFFICIENTS = ("M_dphi", "C1_dphi", "C1_dd", "K0_dphi", "K0_dd", "K2_dd", "friction", "offset")
SETTLES = 1.0  # s at both ends of a record, where the low-pass is not itself
SLOWEST = 0.5  # m/s: below it a bicycle is pushed or lies
WORST = 0.5  # greatest standard error of M_dd, of itself


@dataclass(frozen=True, eq=False)
class SteerRecord:
    """One record, filtered.

    Attributes:
        dt: tick, s.
        motion: what the bicycle did.
        torque: T, N m, filtered; NaN where the log has none.
        used: rows that count, shape (n,).
    """

    dt: float
    motion: SteerMotion
    torque: Array
    used: Flags


@dataclass(frozen=True, eq=False)
class SteerRowFit:
    """The row found.

    Attributes:
        row: the coefficients.
        sd: standard errors by name; 0 for those that were given.
        r2: share of the steer acceleration's variance that is explained.
        rows: how many rows counted.
    """

    row: SteerRow
    sd: Mapping[str, float]
    r2: float
    rows: int


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
    grid = log.sample(wanted, dt)
    there = np.all([grid.held[name] for name in wanted], axis=0)
    sos = butter(2, band, fs=1 / dt, output="sos")
    values = {name: np.nan_to_num(grid.values[name]) for name in wanted}
    soft = {name: sosfiltfilt(sos, x) for name, x in values.items()}
    steer_rate = np.gradient(soft["steer_angle"], dt)
    speed = values["longitudinal_speed"]
    motion = SteerMotion(
        roll=soft["roll_angle"], roll_rate=soft["roll_rate"], roll_acceleration=np.gradient(soft["roll_rate"], dt),
        steer=soft["steer_angle"], steer_rate=steer_rate, steer_acceleration=np.gradient(steer_rate, dt), speed=speed,
    )  # fmt: skip
    torque = np.full(speed.size, np.nan)
    if known_torque:
        torque = np.interp(grid.time - delay, grid.time, soft["rider_torque"])
    since = grid.time - grid.time[0]
    inside = (since >= SETTLES + delay) & (since <= since[-1] - SETTLES)
    return SteerRecord(dt, motion, torque, there & inside & (speed > SLOWEST))


def fit_steer_row(
    records: Sequence[SteerRecord], fixed: Mapping[str, float] | None = None, g: float = GRAVITY
) -> SteerRowFit:
    """The row that explains the steer acceleration of records best.

    Args:
        records: by `steer_record`, all with a known torque.
        fixed: coefficients that are known, by name. At one speed K0_dd and K2_dd cannot be told apart: give one of them.
        g: m/s^2.

    Raises:
        UsageError: a name that is no coefficient.
        LogError: the records do not tell M_dd.
    """
    fixed = dict(fixed or {})
    wrong = sorted(set(fixed) - set(COEFFICIENTS))
    if wrong:
        raise UsageError(f"fixed: {', '.join(wrong)}", f"names among {', '.join(COEFFICIENTS)}", "correct them")
    free = [name for name in COEFFICIENTS if name not in fixed]
    columns = [record.motion.columns(g) for record in records]
    pushed = [r.torque - sum(v * c[name] for name, v in fixed.items()) for r, c in zip(records, columns, strict=True)]
    X = np.vstack([np.column_stack([p, *(-c[n] for n in free)]) for p, c in zip(pushed, columns, strict=True)])
    y = np.concatenate([record.motion.steer_acceleration for record in records])
    used = np.concatenate([record.used for record in records])
    if used.sum() <= 10 * X.shape[1]:
        raise LogError(f"{int(used.sum())} usable rows", "some minutes of riding with a known torque", "record more")
    X = np.where(used[:, None], X, 0.0)
    scale = np.sqrt((X[used] ** 2).mean(axis=0))
    if not (scale > 0).all() or np.linalg.cond(X[used] / scale) > 1e8:
        raise LogError(
            f"the records cannot tell {', '.join(['M_dd', *free])} apart",
            "a torque that is not a multiple of another column, and several speeds or K0_dd or K2_dd given",
            "give what is known of the bicycle as fixed",
        )
    found = np.linalg.lstsq(X[used] / scale, y[used], rcond=None)[0] / scale
    e = np.where(used, y - X @ found, 0.0)
    pieces = np.concatenate([[0], np.cumsum([record.used.size for record in records])])
    covariance = newey_west(X, e, used, pieces, block_length(X, e, used, pieces))
    a, b = found[0], found[1:]
    turn = np.zeros((found.size, found.size))  # derivatives of (1 / a, b / a) by (a, b)
    turn[0, 0], turn[1:, 0] = -1 / a**2, -b / a**2
    turn[1:, 1:] = np.eye(b.size) / a
    sd = np.sqrt(np.diag(turn @ covariance @ turn.T))
    if not (a > 0 and sd[0] * a < WORST):
        raise LogError(
            f"M_dd comes out as {1 / a:.3g} kg m^2 with a standard error of {sd[0]:.2g}",
            "a positive inertia, known to half of itself",
            "the torque must not be made from the motion alone; check its sign and its delay",
        )
    row = SteerRow(**{"M_dd": 1 / a, **dict(zip(free, b / a, strict=True)), **fixed}, g=g)
    errors = {**dict.fromkeys(fixed, 0.0), **dict(zip(["M_dd", *free], sd.tolist(), strict=True))}
    spread = y[used].var()
    return SteerRowFit(row, errors, float(1 - e[used].var() / spread) if spread > 0 else 0.0, int(used.sum()))
