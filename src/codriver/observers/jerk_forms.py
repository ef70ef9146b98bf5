"""The two forms of the jerk observer's update: what `jerk` leaves open.

Kalman form: the covariance is carried, predicted and updated row by row, and the gain follows from it. Constant form: the
stationary gain, an innovation after n ticks without its row counting n times. Both say what variances the states have, what
they carry, and whether they have settled.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from codriver.kernel import Scalar, either, minimum, negate, select
from codriver.models import intention_model
from codriver.observers.covariance import Matrix, plain, predict_covariance, update_row
from codriver.observers.observer import Scalars
from codriver.observers.scaled_gain import ScaledGain

STATES = ("speed", "acceleration", "offset", "jerk")
ROWS = ("acceleration", "speed")
WIDE_START = 25.0  # the covariance starts this many times the stationary one
GAP = 0.5  # s without a row after which the constant form is not trusted
LARGEST_GAIN = 0.77  # bound of n K_vv in the constant form
SETTLED = 2.25  # valid while the jerk's variance is at most this many times the stationary one
_PAIRS = [(i, j) for i in range(4) for j in range(i, 4)]


@dataclass(frozen=True)
class Situation:
    """What a tick brings to the update; scalars, flags 0 or 1.

    Attributes:
        known: known input u, m/s^2.
        y_a, y_v: accelerometer and signed speed; 0 where there is none.
        use_a, use_v: whether they are there and the observer has started.
        started, first: whether it has started, and whether just now.
        standing: whether the vehicle stands.
        lost: whether it moves with its inputs unknown.
    """

    known: Scalar
    y_a: Scalar
    y_v: Scalar
    use_a: Scalar
    use_v: Scalar
    started: Scalar
    first: Scalar
    standing: Scalar
    lost: Scalar


@dataclass(frozen=True)
class Update:
    """What an update gives.

    Attributes:
        x: the states after it.
        innovations: by row: innovation, its nominal variance, whether it was used.
        variances: of the states, in units of the noise scale.
        memory: the form's own carried scalars.
        settled: 1 where the estimate can be trusted.
    """

    x: list[Scalar]
    innovations: dict[str, tuple[Scalar, Scalar, Scalar]]
    variances: list[Scalar]
    memory: Scalars
    settled: Scalar


def initial(design: ScaledGain, form: str) -> dict[str, float]:
    """The form's own carried scalars at the start."""
    if form == "kalman":
        return {f"P_{STATES[i]}_{STATES[j]}": float(design.P[i, j]) for i, j in _PAIRS}
    return {**{f"ticks_{row}": 0.0 for row in ROWS}, "since_start": 0.0}


def kalman_update(design: ScaledGain, carry: Scalars, x: list[Scalar], now: Situation) -> Update:
    """Predict the covariance and update with the rows that are there.

    Args:
        design: gains at one ell and tick; F, Qd, Rd and P may hold symbols.
        carry: with the scalars of `initial`.
        x: predicted states.
        now: the tick.
    """
    C, P_stationary = intention_model().C, design.P
    wide = [[WIDE_START * plain(P_stationary[i, j]) if i == j else 0.0 for j in range(4)] for i in range(4)]
    P: Matrix = [[0.0] * 4 for _ in range(4)]
    for i, j in _PAIRS:
        P[i][j] = P[j][i] = carry[f"P_{STATES[i]}_{STATES[j]}"]
    P = predict_covariance(P, design.F, design.Qd)
    P = [[select(now.first, wide[i][j], P[i][j]) for j in range(4)] for i in range(4)]

    e_a = select(now.use_a, now.y_a - (x[1] + x[2] + now.known), 0.0)
    x, P, s_a = update_row(x, P, C[0], e_a, design.Rd[0, 0], now.use_a)
    e_v = select(now.use_v, now.y_v - x[0], 0.0)
    x, P, s_v = update_row(x, P, C[1], e_v, design.Rd[1, 1], now.use_v)

    P = _forget_motion(P, now.standing, np.diag(np.diag(P_stationary)).tolist())
    P = _forget_motion(P, now.lost, wide)
    return Update(
        x,
        {"acceleration": (e_a, s_a, now.use_a), "speed": (e_v, s_v, now.use_v)},
        [P[i][i] for i in range(4)],
        {f"P_{STATES[i]}_{STATES[j]}": P[i][j] for i, j in _PAIRS},
        P[3][3] <= SETTLED * plain(P_stationary[3, 3]),
    )


def constant_update(design: ScaledGain, carry: Scalars, x: list[Scalar], now: Situation) -> Update:
    """Update with the stationary gain; like `kalman_update`."""
    C, K = intention_model().C, design.K
    # How long until the slowest error is down to 5 %, and how many ticks one innovation may stand for.
    settle = 3.0 / design.certificate.decay_rate
    most = max(int(LARGEST_GAIN / float(K[0, 1])), 1)
    e_a = select(now.use_a, now.y_a - (x[1] + x[2] + now.known), 0.0)
    e_v = select(now.use_v, now.y_v - x[0], 0.0)
    times_a, times_v = (minimum(carry[f"ticks_{row}"] + 1.0, float(most)) for row in ROWS)
    x = [x[i] + (float(K[i, 0]) * (times_a * e_a) + float(K[i, 1]) * (times_v * e_v)) for i in range(4)]
    S = C @ design.P_predicted @ C.T + design.Rd

    memory = {
        f"ticks_{row}": select(use, 0.0, carry[f"ticks_{row}"] + 1.0)
        for row, use in zip(ROWS, (now.use_a, now.use_v), strict=True)
    }
    gap = either(*(memory[f"ticks_{row}"] > GAP / design.dt for row in ROWS))
    anew = either(negate(now.started), either(now.lost, gap))
    memory["since_start"] = select(anew, 0.0, carry["since_start"] + design.dt)
    return Update(
        x,
        {"acceleration": (e_a, float(S[0, 0]), now.use_a), "speed": (e_v, float(S[1, 1]), now.use_v)},
        [float(design.P[i, i]) for i in range(4)],
        memory,
        memory["since_start"] >= settle,
    )


def _forget_motion(P: Matrix, when: Scalar, fresh: Matrix) -> Matrix:
    """What is known of acceleration and jerk is forgotten: their entries are those of `fresh`, the others stay."""

    def entry(i: int, j: int) -> Scalar:
        return select(when, fresh[i][j], P[i][j]) if i in (1, 3) or j in (1, 3) else P[i][j]

    return [[entry(i, j) for j in range(4)] for i in range(4)]
