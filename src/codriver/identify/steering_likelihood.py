"""How likely a recording is under a wheel: innovations of a Kalman filter whose parameters are handed in.

    log L = -1/2 sum over the ticks that count of [ log(2 pi s_k) + e_k^2 / s_k ]

    theta = (ln J_s, ln b_s, T_c, T_0, ln q_delta, ln q_omega, ln r)

T_c, N m, is Coulomb friction, T_0, N m, a constant torque (imbalance, offset of the motor). q_delta and q_omega are variances that
angle and rate gather each tick, r that of the encoder, rad^2. The filter moves as `models.steering` does, with friction in steps
of at most 2.5 ms: in longer ones a wheel that turns round is held too long, and J_s comes out more than 1 % too small at 100 Hz.
Friction is taken in the mean over the rate's own uncertainty sigma, by the algebraic sigmoid; so log L is smooth in T_c, and the
covariance knows that where friction holds the wheel, the rate before has no effect on the rate after. With x the rate without
friction, d = push T_c:

    mean of the rate after = x + [sqrt((x - d)^2 + sigma^2) - sqrt((x + d)^2 + sigma^2)] / 2

A tick marked `reset` (an end stop, a jump of the encoder, lost torque) counts for nothing: there the filter starts anew from
the measured angle and an unknown rate. So does the first. theta is carried, not compiled in: one machine code for all.
Derivatives by theta are central differences of e_k and s_k; the filters of both sides run abreast.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, partial
from math import ceil

import numpy as np

from codriver.kernel import Scalar, both, negate, select, sqrt
from codriver.models.steering import Tick, tick_of
from codriver.observers.observer import Observer, Output, Scalars
from codriver.program import Program, compile
from codriver.signals import Grid
from codriver.signals.grid import Flags
from codriver.signals.signal import Array

NAMES = ("ln_J", "ln_b", "T_c", "T_0", "ln_q_delta", "ln_q_omega", "ln_r")
STEPS = (1e-4, 1e-4, 1e-4, 1e-4, 1e-3, 1e-3, 1e-3)  # of the differences
FINE = 2.5e-3  # s, longest step with friction
LEAST_SPREAD = 1e-8  # (rad/s)^2, that friction's corner is rounded by at least
RATE_VARIANCE = 25.0  # (rad/s)^2, where nothing is known of the rate
_TICK = ("keep", "reach", "lift", "push", "friction", "constant", "q_delta", "q_omega", "r")
_STATE = ("angle", "rate", "P_00", "P_01", "P_11")
_CARRY = (*_TICK, *_STATE, "started", "torque_before")
_COLUMNS = ("angle", "rate", "e", "s", "counts")


@dataclass(frozen=True, eq=False)
class Rows:
    """A recording on ticks.

    Attributes:
        dt: s.
        time: s, shape (n,).
        torque: N m, held until the next tick, shape (n,).
        angle: rad, shape (n,).
        fresh: where an angle arrived.
        reset: where the filter starts anew.
        form: of the tick, "exact" or "euler".
    """

    dt: float
    time: Array
    torque: Array
    angle: Array
    fresh: Flags
    reset: Flags
    form: str = "exact"


@dataclass(frozen=True, eq=False)
class Run:
    """The filter over a recording.

    Attributes:
        angle, rate: filtered, rad and rad/s, shape (n,).
        e, s: innovations and their variances, rad and rad^2, shape (n,).
        counts: ticks whose innovation counts.
        log_likelihood: of those.
    """

    angle: Array
    rate: Array
    e: Array
    s: Array
    counts: Flags
    log_likelihood: float

    @property
    def nis(self) -> float:
        """Mean squared normalised innovation; 1 if the noise is as large as assumed."""
        return float(np.mean(self.e[self.counts] ** 2 / self.s[self.counts]))


def run_wheel(rows: Rows, theta: Array) -> Run:
    """The filter over a recording; its log likelihood is minus infinity where it breaks down.

    Args:
        rows: the recording.
        theta: see the module's docstring, shape (7,).
    """
    with np.errstate(over="ignore"):
        program = _program(rows.dt, _steps(rows, theta))
        out = program.advance(_grid(rows), _carry(rows, theta))[1]
        counts = out["counts"] > 0.5
        e, s = out["e"], out["s"]
        value = -0.5 * float(np.sum(np.log(2 * np.pi * s[counts]) + e[counts] ** 2 / s[counts]))
    return Run(out["angle"], out["rate"], e, s, counts, value if np.isfinite(value) else -np.inf)


def derivatives(rows: Rows, theta: Array, free: list[int]) -> tuple[Array, Array]:
    """de/dtheta and ds/dtheta, shapes (n, p), of the parameters in `free`."""
    by_e, by_s, grid = [], [], _grid(rows)
    for i in free:
        step = np.zeros(theta.size)
        step[i] = STEPS[i]
        sides = theta + step, theta - step
        carry = {f"{name}_{k}": value for k in (0, 1) for name, value in _carry(rows, sides[k]).items()}
        with np.errstate(over="ignore"):
            out = _pair(rows.dt, _steps(rows, sides[0])).advance(grid, carry)[1]
        by_e.append((out["e_0"] - out["e_1"]) / (2 * STEPS[i]))
        by_s.append((out["s_0"] - out["s_1"]) / (2 * STEPS[i]))
    return np.column_stack(by_e), np.column_stack(by_s)


def simulate(rows: Rows, theta: Array, start: int, state: tuple[float, float], count: int | None = None) -> Array:
    """The angle of a wheel that only its torque turns, rad, shape (count,): no measurement corrects it.

    Args:
        rows: the recording, for its torque.
        theta: the wheel.
        start: first tick.
        state: angle and rate there.
        count: of ticks; all that follow by default.
    """
    tick, steps = _tick(rows, theta), _steps(rows, theta)
    constant, friction = float(theta[3]), float(theta[2])
    angle = np.empty(rows.time.size - start if count is None else count)
    x = state
    for k in range(angle.size):
        angle[k] = x[0]
        torque = float(rows.torque[start + k]) + constant
        for _ in range(steps):
            x = tick.advance(*x, torque, friction)
    return angle


def _grid(rows: Rows) -> Grid:
    """The recording as the filter takes it."""
    there = np.ones(rows.time.size, bool)
    return Grid(
        rows.time, rows.dt, {"torque": rows.torque, "reset": rows.reset.astype(float), "angle": rows.angle},
        {"angle": rows.fresh}, {"torque": there, "reset": there},
    )  # fmt: skip


def _tick(rows: Rows, theta: Array) -> Tick:
    return tick_of(float(np.exp(theta[0])), float(np.exp(theta[1])), rows.dt / _steps(rows, theta), rows.form)


def _steps(rows: Rows, theta: Array) -> int:
    """Steps of a tick: with friction, fine enough that it does not matter when in a tick the wheel turns round."""
    return 1 if theta[2] == 0 or rows.form == "euler" else ceil(rows.dt / FINE - 1e-9)


def _carry(rows: Rows, theta: Array) -> dict[str, float]:
    """Parameters and state at the start."""
    tick = _tick(rows, theta)
    noise = np.exp(theta[4:])
    numbers = (tick.keep, tick.reach, tick.lift, tick.push, theta[2], theta[3], *noise)
    state = dict.fromkeys(_STATE, 0.0) | {"started": 0.0, "torque_before": 0.0}
    return {**dict(zip(_TICK, map(float, numbers), strict=True)), **state}


@cache
def _program(dt: float, steps: int) -> Program:
    """The filter, compiled."""
    outputs = tuple(Output(name, "1", "estimate") for name in _COLUMNS)
    carry = dict.fromkeys(_CARRY, 0.0)
    return compile(
        Observer("wheel-likelihood", dt, ("torque", "reset"), ("angle",), carry, outputs, partial(_step, steps))
    )


@cache
def _pair(dt: float, steps: int) -> Program:
    """Two filters abreast, compiled: quicker than one after the other, for neither waits for the other's roots and quotients."""
    outputs = tuple(Output(name, "1", "estimate") for name in ("e_0", "s_0", "e_1", "s_1"))
    carry = dict.fromkeys((f"{name}_{k}" for k in (0, 1) for name in _CARRY), 0.0)
    return compile(
        Observer("wheel-derivative", dt, ("torque", "reset"), ("angle",), carry, outputs, partial(_two_steps, steps))
    )


def _two_steps(steps: int, c: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
    """One tick of both; "name_k" is what filter k calls "name"."""
    new: dict[str, Scalar] = {}
    out: dict[str, Scalar] = {}
    for k in (0, 1):
        after, told = _step(steps, {name: c[f"{name}_{k}"] for name in _CARRY}, u, y, ok, rho)
        new |= {f"{name}_{k}": value for name, value in after.items()}
        out |= {f"e_{k}": told["e"], f"s_{k}": told["s"]}
    return new, out


def _step(steps: int, c: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
    """One tick: move in so many steps, then take the angle or start anew from it."""
    for _ in range(steps):
        c = _moved(c)
    angle, rate = c["angle"], c["rate"]
    P = {"P_00": c["P_00"] + c["q_delta"], "P_01": c["P_01"], "P_11": c["P_11"] + c["q_omega"]}
    s = P["P_00"] + c["r"]
    fresh = ok["angle"]
    e = select(fresh, y["angle"] - angle, 0.0)
    gain = {"P_00": P["P_00"] / s, "P_01": P["P_01"] / s}
    taken = {
        "angle": angle + gain["P_00"] * e, "rate": rate + gain["P_01"] * e,
        "P_00": select(fresh, gain["P_00"] * c["r"], P["P_00"]),
        "P_01": select(fresh, gain["P_01"] * c["r"], P["P_01"]),
        "P_11": P["P_11"] - select(fresh, gain["P_01"] * P["P_01"], 0.0),
    }  # fmt: skip
    follows = both(c["started"], negate(u["reset"]))
    measured: Scalar = select(fresh, y["angle"], angle)
    anew = {"angle": measured, "rate": 0.0, "P_00": c["r"], "P_01": 0.0, "P_11": RATE_VARIANCE}
    state = {name: select(follows, taken[name], anew[name]) for name in _STATE}
    # Before the first angle there is nothing to start from.
    started = select(c["started"], 1.0, fresh)
    new = {**c, **state, "started": started, "torque_before": u["torque"]}
    out = {"angle": state["angle"], "rate": state["rate"], "e": e, "s": s, "counts": both(follows, fresh)}
    return new, out


def _moved(c: Scalars) -> Scalars:
    """The carry with the state moved by one step of the wheel."""
    torque = c["torque_before"] + c["constant"]
    free = c["keep"] * c["rate"] + c["push"] * torque
    limit = c["push"] * c["friction"]
    spread = c["keep"] * c["keep"] * c["P_11"] + LEAST_SPREAD
    above, below = sqrt((free - limit) * (free - limit) + spread), sqrt((free + limit) * (free + limit) + spread)
    rate = free + (above - below) / 2
    by_rate = c["keep"] * (1 + ((free - limit) / above - (free + limit) / below) / 2)
    angle = c["angle"] + c["reach"] * c["rate"] + c["lift"] * torque - c["lift"] / c["push"] * (free - rate)
    reach = c["reach"] - c["lift"] / c["push"] * (c["keep"] - by_rate)
    a, b, d = c["P_00"], c["P_01"], c["P_11"]
    return {
        **c, "angle": angle, "rate": rate, "P_00": a + 2 * reach * b + reach * reach * d, "P_01": by_rate * (b + reach * d),
        "P_11": by_rate * by_rate * d,
    }  # fmt: skip
