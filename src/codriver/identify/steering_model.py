"""Which wheel the recording asks for: friction, a constant torque, a delay, end stops.

Each of T_c, T_0 and the delay (in whole ticks) is in the model if it raises log L by more than half of ln n (Schwarz 1978,
doi:10.1214/aos/1176344136). They are asked in turn until none is wanted any more, for one can hide another: a late torque looks
like friction, friction like damping.

An end stop turns a fit over all ticks into nonsense, so innovations do not show it. Therefore the wheel is fitted without the
greatest and least angles, too, 1 to 24 degrees of them; an end stop is there if this makes the *other* ticks clearly likelier.
Other moments at which something else than the motor turned the wheel (a jump of the encoder, a knock) have |e_k| > 6 sqrt(s_k). The
filter starts anew there. Its noise shrinks when they are gone, so the search is repeated until there are no more.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import pi

import numpy as np

from codriver.errors import LogError
from codriver.identify.steering_fit import Best, fit_wheel, resume
from codriver.identify.steering_likelihood import Rows, Run, run_wheel
from codriver.signals.grid import Flags

MOST_DELAY = 0.15  # s
ROUNDS = 4
MARGINS = (pi / 180, 4 * pi / 180, 12 * pi / 180, 24 * pi / 180)  # rad
STOP_GAIN = 0.05  # of log L a tick, for an end stop to be there
MOST_OF_GAIN = 0.9  # the least margin that gains so much of the most is taken
ALIKE = 0.1  # autocorrelation of innovations from which a fit is doubtful
FAR = 6.0  # standard deviations
MOST_LEFT_OUT = 0.7


@dataclass(frozen=True)
class Asked:
    """What is wanted in the model: True, False, or None where the recording decides. The delay in s."""

    friction: bool | None = None
    constant: bool | None = None
    delay: float | None = None


@dataclass(frozen=True, eq=False)
class Chosen:
    """What came out.

    Attributes:
        best: the fit.
        rows: the recording it saw: torque delayed, filter starting anew where it must.
        delay: s.
        stops: angles of end stops, rad.
        elsewhere: how many other moments were left out.
    """

    best: Best
    rows: Rows
    delay: float
    stops: tuple[float, ...]
    elsewhere: int


def choose_model(rows: Rows, guess: tuple[float, float] | None, asked: Asked) -> Chosen:
    """Fit, and grow the model as the recording asks.

    Args:
        rows: the recording, torque as recorded.
        guess: J_s and b_s to start from.
        asked: what is wanted.

    Raises:
        LogError: no filter runs, or most of the recording has to be left out.
    """
    ticks = round((asked.delay or 0.0) / rows.dt)
    best, ticks = _grown(rows, fit_wheel(_late(rows, ticks), guess), ticks, asked)
    stops: tuple[float, ...] = ()
    if _doubtful(best):
        rows, best, ticks, stops = _without_stops(rows, best, ticks, guess, asked)
    elsewhere = 0
    for _ in range(ROUNDS):
        far = _far(best.run)
        if not far.any():
            break
        rows = replace(rows, reset=rows.reset | far)
        elsewhere += int(far.sum())
        _refuse_rest(rows)
        best, ticks = _grown(rows, resume(_late(rows, ticks), best), ticks, asked)
    return Chosen(best, _late(rows, ticks), ticks * rows.dt, stops, elsewhere)


def _grown(rows: Rows, best: Best, ticks: int, asked: Asked) -> tuple[Best, int]:
    """The fit with all that is wanted, and the delay in ticks."""
    price = float(np.log(max(float(best.run.counts.sum()), 2.0))) / 2
    for _ in range(ROUNDS):
        before = best.run.log_likelihood
        late = _late(rows, ticks)
        if asked.friction is not False and 2 not in best.free:
            best = _larger(late, best, "friction", asked.friction, price)
        if asked.constant is not False and 3 not in best.free:
            best = _larger(late, best, "constant", asked.constant, price)
        if asked.delay is None:
            best, ticks = _delayed(rows, best, ticks, price)
        if best.run.log_likelihood <= before:
            break
    return best, ticks


def _larger(rows: Rows, best: Best, what: str, wanted: bool | None, price: float) -> Best:
    """The fit with friction or a constant torque, too, if it is wanted or worth its price."""
    more = resume(rows, best, friction=what == "friction", constant=what == "constant")
    worth = more.run.log_likelihood > best.run.log_likelihood + price and (what == "constant" or more.theta[2] > 0)
    return more if worth or wanted else best


def _delayed(rows: Rows, best: Best, ticks: int, price: float) -> tuple[Best, int]:
    """The delay that is likeliest among its neighbours; leaving 0 has its price."""
    here, at = best, ticks
    for step in (1, -1):
        while 0 <= at + step <= MOST_DELAY / rows.dt:
            later = resume(_late(rows, at + step), here)
            if later.run.log_likelihood <= here.run.log_likelihood + (price if at == 0 else 0.0):
                break
            here, at = later, at + step
        if at != ticks:
            break
    return here, at


def _without_stops(
    rows: Rows, best: Best, ticks: int, guess: tuple[float, float] | None, asked: Asked
) -> tuple[Rows, Best, int, tuple[float, ...]]:
    """The recording without its end stops, the fit, and where they are."""
    used = rows.fresh & ~rows.reset
    high, low = float(rows.angle[used].max()), float(rows.angle[used].min())
    tried = []
    for margin in MARGINS:
        sides = rows.angle > high - margin, rows.angle < low + margin
        inner = replace(rows, reset=rows.reset | sides[0] | sides[1])
        if inner.reset.mean() > MOST_LEFT_OUT or margin > (high - low) / 3:
            break
        other, other_ticks = _grown(inner, fit_wheel(_late(inner, ticks), guess), ticks, asked)
        tried.append((_gain(other.run, best.run), sides, other, other_ticks))
    most = max((gain for gain, *_ in tried), default=0.0)
    if most < STOP_GAIN:
        return rows, best, ticks, ()
    _, sides, other, other_ticks = next(t for t in tried if t[0] > MOST_OF_GAIN * most)
    # A side at which the better wheel is not surprised is none.
    there = [_surprised(_late(rows, other_ticks), other, side) for side in sides]
    left = [side for side, stop in zip(sides, there, strict=True) if stop]
    kept = replace(rows, reset=np.any([rows.reset, *left], axis=0))
    stops = tuple(angle for angle, stop in zip((high, low), there, strict=True) if stop)
    return kept, resume(_late(kept, other_ticks), other), other_ticks, stops


def _doubtful(best: Best) -> bool:
    """Whether the fit leaves something to explain: outliers, innovations that are alike, or no rest."""
    e = np.where(best.run.counts, best.run.e / np.sqrt(best.run.s), 0.0)
    alike = max(abs(float(np.mean(e[lag:] * e[:-lag]))) for lag in (1, 2, 3))
    return bool(not best.converged or _far(best.run).any() or alike > ALIKE)


def _gain(run: Run, before: Run) -> float:
    """How much likelier the ticks that count in both have become, a tick."""
    both = run.counts & before.counts
    terms = [np.log(r.s[both]) + r.e[both] ** 2 / r.s[both] for r in (before, run)]
    return float(np.mean(terms[0] - terms[1])) / 2 if both.any() else 0.0


def _surprised(rows: Rows, best: Best, side: Flags) -> bool:
    """Whether a wheel without end stops meets outliers in these ticks, or on leaving them."""
    return bool(_far(run_wheel(rows, best.theta))[side | np.r_[False, side[:-1]]].any())


def _far(run: Run) -> Flags:
    """Ticks whose innovation no noise explains."""
    return run.counts & (np.abs(run.e) > FAR * np.sqrt(run.s))


def _late(rows: Rows, ticks: int) -> Rows:
    """The torque so many ticks later."""
    if ticks == 0:
        return rows
    return replace(rows, torque=np.r_[np.full(ticks, rows.torque[0]), rows.torque[:-ticks]])


def _refuse_rest(rows: Rows) -> None:
    """Whether enough is left.

    Raises:
        LogError: it is not.
    """
    if rows.reset.mean() > MOST_LEFT_OUT:
        raise LogError(
            f"{rows.reset.mean():.0%} of the recording fits no motion of a wheel: end stops, jumps of the encoder, missing torque",
            "a wheel that turns freely most of the time", "turn it by less, and look at the angle's sensor",
        )  # fmt: skip
