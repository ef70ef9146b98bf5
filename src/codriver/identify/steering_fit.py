"""The wheel that makes a recording most likely, by scoring, with standard errors.

    I = sum [ e' e'^T / s + s' s'^T / (2 s^2) ],   g = -sum [ e' e / s + s' (1 - e^2 / s) / (2 s) ]      (' = d/d theta)
    theta <- theta + (I + mu diag I)^-1 g,   mu smaller while log L grows, larger where it does not

I is Fisher's information of Gaussian innovations; it needs first derivatives only and is never negative. At the end I^-1 is
the covariance if the model is right; I^-1 M I^-1, with M the sum of the scores over neighbouring ticks (Newey, West 1987,
doi:10.2307/1913610), holds when innovations are alike from tick to tick, too.

The search starts from a guess, or where there is none from least squares on the twice integrated equation, which needs no
derivative of the angle:  J_s delta + b_s int delta = int int T + c_0 + c_1 t.  Several noises are tried, the likeliest is taken.
Aastroem 1980, doi:10.1016/0005-1098(80)90078-3 (prediction error methods); Harvey 1989 (scoring).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from codriver.errors import LogError
from codriver.identify.steering_likelihood import NAMES, Rows, Run, derivatives, run_wheel
from codriver.signals.grid import Flags
from codriver.signals.signal import Array

ROUNDS = 60
FIRST_ROUNDS = 4  # with each shape of the noise
ENOUGH = 1e-3  # of log L in a round that is hardly damped, below which the search ends
LONGEST_STEP = 1.5  # of a logarithm, or N m, in one round
ALIKE = 0.5  # s, over which scores are summed
WIDEST = 25.0  # q and r differ by no more than this, in natural logarithms
NOISE = (4, 5, 6)  # where theta holds the noises
RATE_LEVELS, ANGLE_LEVELS = (1e-6, 1e-3, 1.0), (1e-3, 1.0, 100.0)  # q_omega dt^2 / r and q_delta / r, to start from
INERTIAS, DAMPINGS = (1e-4, 10.0), (1e-5, 50.0)


@dataclass(frozen=True, eq=False)
class Best:
    """Where the search ended.

    Attributes:
        theta: see `steering_likelihood`, shape (7,).
        free: which of it were searched.
        covariance: of those if the model is right, shape (p, p).
        robust: of those if innovations are alike from tick to tick, shape (p, p).
        run: the filter with theta.
        rounds: of the search.
        converged: whether it came to rest.
    """

    theta: Array
    free: tuple[int, ...]
    covariance: Array
    robust: Array
    run: Run
    rounds: int
    converged: bool

    def sd(self, name: str) -> float:
        """Standard error of one of `NAMES`: the larger of the two; infinite for one that was not searched."""
        i = NAMES.index(name)
        if i not in self.free:
            return float("inf")
        k = self.free.index(i)
        with np.errstate(invalid="ignore"):
            return float(np.sqrt(max(self.covariance[k, k], self.robust[k, k])))


def fit_wheel(
    rows: Rows, guess: tuple[float, float] | None = None, *, friction: bool = False, constant: bool = False
) -> Best:
    """Search.

    Args:
        rows: the recording.
        guess: J_s and b_s to start from; None finds them.
        friction, constant: whether T_c and T_0 are searched, too; else they are 0.

    Raises:
        LogError: no start leads to a filter that works.
    """
    wheel = [0, 1, *([2] if friction else []), *([3] if constant else [])]
    starts = _starts(rows, guess or guess_by_integrals(rows), wheel)
    return max((_search(rows, theta, [*wheel, *NOISE], ROUNDS) for theta in starts), key=lambda b: b.run.log_likelihood)


def resume(rows: Rows, best: Best, *, friction: bool = False, constant: bool = False) -> Best:
    """Search on from where a search ended, on the same or another recording, with further coefficients if asked.

    Args:
        rows: the recording.
        best: where to start; what it searched is searched again.
        friction, constant: whether T_c and T_0 are searched, too.
    """
    free = sorted({*best.free, *([2] if friction else []), *([3] if constant else [])})
    starts = [best.theta]
    if friction and 2 not in best.free:
        # Without friction b_s stands for it, too: start from less of the one and some of the other.
        torque = float(np.sqrt(np.mean(rows.torque**2)))
        starts += [best.theta + np.array([0, np.log(share), (1 - share) * torque, 0, 0, 0, 0]) for share in (0.7, 0.4)]
    return max((_search(rows, theta, free, ROUNDS) for theta in starts), key=lambda b: b.run.log_likelihood)


def guess_by_integrals(rows: Rows) -> tuple[float, float]:
    """J_s and b_s by least squares on the twice integrated equation, kept within what wheels can have."""
    there = rows.fresh & ~rows.reset
    angle = np.interp(rows.time, rows.time[there], rows.angle[there])
    impulse = np.cumsum(rows.torque) * rows.dt
    twice = (np.cumsum(impulse) - impulse / 2) * rows.dt
    swept = (np.cumsum(angle) - angle / 2) * rows.dt
    clock = rows.time - rows.time[0]
    columns = np.column_stack([angle, swept, np.ones_like(clock), clock])
    # Differences over a stretch, so that what drifts within the record does not decide.
    lag = max(min(round(1.0 / rows.dt), clock.size // 4), 1)
    rest = lambda x: x[2 * lag :] - 2 * x[lag:-lag] + x[: -2 * lag]  # noqa: E731
    solution = np.linalg.lstsq(np.column_stack([rest(columns[:, 0]), rest(columns[:, 1])]), rest(twice), rcond=None)[0]
    J, b = float(solution[0]), float(solution[1])
    J = J if J > 0 else 0.05
    b = b if b > 0 else 0.3
    return float(np.clip(J, *INERTIAS)), float(np.clip(b, *DAMPINGS))


def _starts(rows: Rows, guess: tuple[float, float], wheel: list[int]) -> list[Array]:
    """theta to search from: for each level of q_omega the best of some q_delta, the wheel searched with the noise's shape held.

    A large q_omega hides the wheel: with a wrong guess it is likelier at first, and the search would stay there.
    """
    found = []
    for rate in RATE_LEVELS:
        tried = []
        for angle in ANGLE_LEVELS:
            theta = np.array([*np.log(guess), 0.0, 0.0, *np.log([angle, rate / rows.dt**2, 1.0])])
            tried.append(_search(rows, _scaled(rows, theta)[0], wheel, FIRST_ROUNDS))
        found.append(max(tried, key=lambda best: best.run.log_likelihood))
    if not any(np.isfinite(best.run.log_likelihood) for best in found):
        raise LogError(
            f"no filter runs with J_s = {guess[0]:g} kg m^2 and b_s = {guess[1]:g} N m s/rad",
            "a recording and a guess that belong together", "give another guess, or none",
        )  # fmt: skip
    return [best.theta for best in found if np.isfinite(best.run.log_likelihood)]


def _scaled(rows: Rows, theta: Array) -> tuple[Array, Run]:
    """theta with the common factor of its noises such that innovations are as large as promised, and its run."""
    run = run_wheel(rows, theta)
    if not (np.isfinite(run.log_likelihood) and run.nis > 0):
        return theta, run
    theta = theta + np.log(run.nis) * np.isin(np.arange(theta.size), NOISE)
    return theta, run_wheel(rows, theta)


def _search(rows: Rows, theta: Array, free: list[int], most: int) -> Best:
    """Scoring with a damped step, of at most so many rounds."""
    run, mu, done, rounds = run_wheel(rows, theta), 1e-3, False, 0
    if not np.isfinite(run.log_likelihood):
        nothing = np.full((len(free), len(free)), np.inf)
        return Best(theta, tuple(free), nothing, nothing, run, 0, False)
    information, gradient, scores = _information(rows, theta, free, run)
    while rounds < most and not done:
        rounds += 1
        step = _step(information, gradient, mu, _held(theta, free, gradient))
        trial = theta.copy()
        trial[free] += step
        trial, taken = _scaled(rows, _bounded(trial))
        gained = taken.log_likelihood - run.log_likelihood
        if gained > 0:
            theta, run, mu = trial, taken, mu / 5
            information, gradient, scores = _information(rows, theta, free, run)
            done = gained < ENOUGH and mu < 0.1
        else:
            mu *= 5
            done = mu > 1e8
    inverse = _inverse(information, ~_held(theta, free, gradient))
    robust = inverse @ _meat(scores, max(round(ALIKE / rows.dt), 1)) @ inverse
    return Best(theta, tuple(free), inverse, robust, run, rounds, done)


def _step(information: Array, gradient: Array, mu: float, held: Flags) -> Array:
    """The damped step of the parameters that are not held at their bounds; each of at most LONGEST_STEP."""
    move = np.flatnonzero(~held)
    part = information[np.ix_(move, move)]
    scale = np.maximum(np.diag(part), 1e-9 * np.diag(part).max(initial=1e-9))
    step = np.zeros(gradient.size)
    step[move] = np.linalg.solve(part + np.diag(mu * scale), gradient[move])
    return np.clip(step, -LONGEST_STEP, LONGEST_STEP)


def _held(theta: Array, free: list[int], gradient: Array) -> Flags:
    """Noises at their lower bound that would go lower still: the recording shows none of them."""
    low = theta[4:].max() - WIDEST
    return np.array([i in NOISE and theta[i] <= low + 1e-9 and g <= 0 for i, g in zip(free, gradient, strict=True)])


def _inverse(information: Array, told: Flags) -> Array:
    """Covariance of the parameters that are told; those held at a bound take no part in it."""
    inverse = np.zeros_like(information)
    k = np.flatnonzero(told)
    inverse[np.ix_(k, k)] = np.linalg.pinv(information[np.ix_(k, k)], rcond=1e-14, hermitian=True)
    return inverse


def _bounded(theta: Array) -> Array:
    """theta with parameters and noises within what can be computed: no noise so small beside the largest that rounding decides."""
    theta[0] = np.clip(theta[0], *np.log(INERTIAS))
    theta[1] = np.clip(theta[1], *np.log(DAMPINGS))
    theta[4:] = np.maximum(theta[4:], theta[4:].max() - WIDEST)
    return theta


def _information(rows: Rows, theta: Array, free: list[int], run: Run) -> tuple[Array, Array, Array]:
    """Information, gradient, and the scores of the ticks that count, shape (m, p)."""
    by_e, by_s = derivatives(rows, theta, free)
    c = run.counts
    e, s = run.e[c, None], run.s[c, None]
    de, ds = by_e[c], by_s[c]
    half = ds / s / np.sqrt(2)
    information = (de / s).T @ de + half.T @ half
    scores = -(de * e / s + ds / (2 * s) * (1 - e * e / s))
    return information, scores.sum(axis=0), scores


def _meat(scores: Array, lag: int) -> Array:
    """Sum over lags |j| < lag of (1 - |j| / lag) sum_k g_k g_{k+j}'."""
    total = np.vstack([np.zeros((1, scores.shape[1])), np.cumsum(scores, axis=0)])
    n = scores.shape[0]
    ends = np.arange(1, n + lag)
    moving = total[np.minimum(ends, n)] - total[np.maximum(ends - lag, 0)]
    return np.asarray(moving.T @ moving / lag)
