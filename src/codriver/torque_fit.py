"""The noise of a driver-torque filter from a record, by maximum likelihood: what walks and how, and four sizes.

    log L = -1/2 sum [ log(2 pi f s) + e^2 / (f s) ],   f = max(mean of e^2 / s, floor / r)

e, s: innovation of the angle and its variance by a filter with encoder variance r = 1. One factor f of all noises leaves e
alone, so its best value is known, and three ratios are searched (Nelder, Mead), from several starts, for either order and
balance of the walk. All kinds have as many parameters, so the likeliest is taken. The floor is an encoder's: a twelfth of its
squared step.

Rows count that have a second of known torque behind them, without a jump. At most LONGEST seconds are looked at, taken in equal
parts from all over the record.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np

from codriver.errors import LogError
from codriver.kernel import Scalar, negate, select
from codriver.models.steering import steering_model
from codriver.observers.augmented_kalman import Filter, carried, chosen, pack, predict, started, unpack, update
from codriver.observers.disturbance import forget
from codriver.observers.driver_torque import ANGLE, RATE_SD, SLOPE_SD, TORQUE_SD
from codriver.observers.observer import Observer, Output, Scalars
from codriver.observers.registry import build
from codriver.observers.torque_noise import TorqueNoise
from codriver.observers.unknown_input import ORDERS, with_unknown
from codriver.program import Program, compile
from codriver.signals import Grid, Log
from codriver.signals.grid import Flags
from codriver.signals.signal import Array
from codriver.vehicles import Vehicle

SETTLING = 1.0  # s
LONGEST, PIECE = 1200.0, 60.0  # s
LEAST_ROWS = 300
# Decades of intensity over the encoder's variance: of the angle, of the rate, and of the torque over J_s. To start from.
SLIP_STARTS, RATE_STARTS, TORQUE_STARTS = (-3.0, 1.0), (-2.0, 3.0), (5.0, 9.0)
RATIOS = (-6.0, 16.0)  # bounds of all
# For the run that only mends the angle: so wide that nothing but what no wheel does counts as a jump.
_CAUTIOUS = TorqueNoise(1, 0.02, 0.0, 1.0, 100.0)
_NOISES = ("q_slip", "q_rate", "q_torque")
_STATE_VARIANCES = (1e-6, RATE_SD**2, TORQUE_SD**2, SLOPE_SD**2)


@dataclass(frozen=True)
class TorqueFit:
    """What was found.

    Attributes:
        noise: the likelier order's.
        log_likelihood: of each kind: order of the walk, and balance.
        rows: innovations that counted.
        seconds: of the record that was looked at.
    """

    noise: TorqueNoise
    log_likelihood: Mapping[tuple[int, int], float]
    rows: int
    seconds: float


def fit_torque_noise(
    name: str, logs: Log | Sequence[Log], vehicle: Vehicle, rate: float, label: str = "fitted"
) -> TorqueFit:
    """Fit the noise of an estimator of the family driver-torque.

    Args:
        name: of the estimator.
        logs: one record or several of one wheel; hands may be on or off.
        vehicle: its parameters.
        rate: ticks per second.
        label: name of the noise.

    Raises:
        LogError: too few rows count.
        MissingSignal: a log lacks a signal.
    """
    dt, several = 1.0 / rate, [logs] if isinstance(logs, Log) else list(logs)
    observer = build(name, vehicle, dt=dt, preset=_CAUTIOUS)
    wanted = ("column_torque", "inputs_known", "angle_turns", "restarted", f"{ANGLE}_used")
    program = compile(observer, wanted)
    runs = [program.run(log) for log in several]
    rows = _joined([_rows(run.columns, run.grid, LONGEST / len(runs)) for run in runs])
    J, b = float(observer.settings["J_s"]), float(observer.settings["b_s"])
    counted, source = rows.counted, ", ".join(log.source for log in several if log.source) or "a record"
    if counted.sum() < LEAST_ROWS:
        raise LogError(
            f"{source}: {int(counted.sum())} angles with a known torque on the column for {SETTLING:g} s before"
            + _why_so_few([run.columns for run in runs]),
            f"at least {LEAST_ROWS} to fit the noise to", "correct what is named, or give a longer record or a preset (--preset)",
        )  # fmt: skip
    steps = [_step_of(run.grid.values[ANGLE][run.grid.fresh[ANGLE]]) for run in runs]
    floor = min(steps) ** 2 / 12
    best: dict[tuple[int, int], tuple[float, TorqueNoise]] = {}
    for order in ORDERS:
        program = _likelihood(J, b, dt, order)
        for balance in (0, 1):
            seen = rows.turned_by(1.0 - balance)
            found = _search(partial(_evidence, program, seen, J, floor))
            value, factor = _evidence(program, seen, J, floor, found)
            angle, slip, rate_noise, torque = (float(np.sqrt(factor * q)) for q in (1.0, *_intensities(found, J)))
            origin = f"maximum likelihood on {source}"
            noise = TorqueNoise(order, angle, slip, rate_noise, torque, origin, label, balance)
            best[order, balance] = value, noise
    likeliest = max(best, key=lambda kind: best[kind][0])
    return TorqueFit(
        best[likeliest][1], {kind: value for kind, (value, _) in best.items()}, int(counted.sum()), rows.seconds
    )


def _why_so_few(runs: Sequence[Mapping[str, Array]]) -> str:
    """What keeps the rows from counting, for people."""
    used = sum(float(c[f"{ANGLE}_used"].sum()) for c in runs)
    anew = sum(float(c["restarted"].sum()) for c in runs)
    known = float(np.mean(np.concatenate([c["inputs_known"] for c in runs]) > 0.5))
    if anew > 0.05 * max(used + anew, 1.0):
        return (
            f"; the angle leaps or has gaps at {anew:.0f} of {used + anew:.0f} samples: degrees taken for radians, stamps in "
            "another unit, or a slow sensor?"
        )
    if known < 0.5:
        return f"; the torque on the column is known for {known:.0%} of the time: it is missing, or comes too rarely"
    return ""


@dataclass(frozen=True, eq=False)
class _Rows:
    """A record as the likelihood takes it: columns of the grid, and which rows count."""

    grid: Grid
    counted: Flags
    seconds: float

    def turned_by(self, share: float) -> _Rows:
        """The same with a share of the column's torque turning the wheel."""
        values = {**self.grid.values, "torque": share * self.grid.values["torque"]}
        return replace(self, grid=replace(self.grid, values=values))


def _rows(columns: Mapping[str, Array], grid: Grid, longest: float) -> _Rows:
    """Column torque, unwrapped angle and resets, with the ticks that count; at most so many seconds of it."""
    known, anew, fresh = columns["inputs_known"] > 0.5, columns["restarted"] > 0.5, grid.fresh[ANGLE]
    angle = np.where(fresh, grid.values[ANGLE] + columns["angle_turns"], 0.0)
    chosen = _chosen(fresh.size, grid.dt, longest)
    # Each piece begins anew with its first angle.
    reset = anew.copy()
    for start in np.flatnonzero(chosen & ~np.r_[False, chosen[:-1]]):
        later = np.flatnonzero(fresh[start:])
        reset[start : start + (int(later[0]) if later.size else fresh.size) + 1] = True
    settled = max(round(SETTLING / grid.dt), 1)
    recent = np.convolve(~known | reset, np.ones(settled), "full")[: reset.size] > 0.5
    counted = (columns[f"{ANGLE}_used"] > 0.5) & ~recent & ~reset
    made = {
        "torque": columns["column_torque"], "angle": angle, "reset": reset, "known": known, "fresh": fresh,
    }  # fmt: skip
    return _of({name: np.asarray(column[chosen], float) for name, column in made.items()}, counted[chosen], grid.dt)


def _joined(parts: Sequence[_Rows]) -> _Rows:
    """Records one after the other."""
    columns = {name: np.concatenate([part.grid.values[name] for part in parts]) for name in parts[0].grid.values}
    return _of(columns, np.concatenate([part.counted for part in parts]), parts[0].grid.dt)


def _of(columns: dict[str, Array], counted: Flags, dt: float) -> _Rows:
    """Columns that are all there, as a grid."""
    n = counted.size
    there = dict.fromkeys(columns, np.ones(n, bool))
    return _Rows(Grid(dt * np.arange(n, dtype=np.float64), dt, columns, there, there), counted, n * dt)


def _chosen(n: int, dt: float, longest: float) -> Flags:
    """Ticks to look at: all of a short record, equal pieces from all over a long one."""
    if n * dt <= longest:
        return np.ones(n, bool)
    pieces, length = max(round(longest / PIECE), 1), round(min(PIECE, longest) / dt)
    mask = np.zeros(n, bool)
    for start in np.linspace(0, n - length, pieces).astype(int):
        mask[start : start + length] = True
    return mask


def _step_of(angle: Array) -> float:
    """The encoder's step: the least difference that comes back, rad; 0 for a fine one."""
    steps = np.abs(np.diff(angle))
    steps = steps[steps > 1e-9]
    if steps.size < 20:
        return float(steps.min()) if steps.size else 0.0
    low = float(np.quantile(steps, 0.05))
    return low if float(np.mean(np.abs(steps / low - np.round(steps / low)) < 0.05)) > 0.8 else 0.0


def _search(evidence: Callable[[Array], tuple[float, float]]) -> Array:
    """The ratios, in decades, that make the record likeliest."""
    from scipy.optimize import minimize

    def cost(ratios: Array) -> float:
        if not all(RATIOS[0] <= r <= RATIOS[1] for r in ratios):
            return 1e300
        return -evidence(ratios)[0]

    starts = [np.array([a, r, t]) for a in SLIP_STARTS for r in RATE_STARTS for t in TORQUE_STARTS]
    costs = [cost(start) for start in starts]
    ends = []
    for k in np.argsort(costs)[:2]:
        simplex = starts[k] + np.array([[0, 0, 0], [1.5, 0, 0], [0, 1.5, 0], [0, 0, 1.5]])
        ends.append(
            minimize(
                cost, starts[k], method="Nelder-Mead",
                options={"initial_simplex": simplex, "xatol": 0.02, "fatol": 0.05, "maxfev": 250},
            )
        )  # fmt: skip
    return np.asarray(min(ends, key=lambda end: float(end.fun)).x)


def _evidence(program: Program, rows: _Rows, J: float, floor: float, ratios: Array) -> tuple[float, float]:
    """log L at the best factor, and that factor: the encoder's variance, rad^2."""
    noise = dict(zip(_NOISES, _intensities(ratios, J), strict=True))
    _, columns = program.advance(rows.grid, {**program.observer.carry, **noise})
    e, s = columns["e"][rows.counted], columns["s"][rows.counted]
    if not (np.isfinite(e).all() and (s > 0).all()):
        return -1e300, floor
    square = float(np.mean(e * e / s))
    factor = max(square, floor, 1e-16)
    n = e.size
    value = -0.5 * (n * np.log(2 * np.pi * factor) + float(np.log(s).sum()) + n * square / factor)
    return float(value), factor


def _intensities(ratios: Array, J: float) -> tuple[float, float, float]:
    """Of angle, rate and torque, over the encoder's variance."""
    return 10.0 ** float(ratios[0]), 10.0 ** float(ratios[1]), 10.0 ** float(ratios[2]) * J**2


@cache
def _likelihood(J: float, b: float, dt: float, order: int) -> Program:
    """The filter with r = 1 and its other noises in the carry, compiled."""
    plant = steering_model(J, b, ("column_torque", "driver_torque"))
    model = with_unknown(plant, ("driver_torque",), order)
    n = len(model.states)
    F, (G_0, G_1) = model.transition(dt), model.input_maps(dt)
    unit = [np.diag(np.eye(n)[i]) for i in (0, 1, n - 1)]
    parts = [model.process_noise(Q, dt) for Q in unit]
    # Variances over the encoder's; 0.1 degree stands for it, since only the first second depends on it.
    wide = [v / 3e-6 for v in _STATE_VARIANCES[:n]]

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        noise = {name: carry[name] for name in _NOISES}
        Q = [[_mixed(parts, noise, i, j) for j in range(n)] for i in range(n)]
        kalman = Filter(F, G_0, G_1, model.C, model.D, Q, [1.0], wide)
        now = predict(kalman, unpack(carry, n), [carry["torque_before"]], [u["torque"]])
        use = u["fresh"] * negate(u["reset"])
        x_before = now.x
        now, (row,) = update(kalman, now, [u["angle"]], [use], [u["torque"]])
        angle = select(u["fresh"], u["angle"], x_before[0])
        now = chosen(u["reset"], started(kalman, [angle, *x_before[1:]]), now)
        now = forget(now, negate(u["known"]), wide, range(2, n))
        return {**pack(now), "torque_before": u["torque"], **noise}, {"e": row.e, "s": row.s}

    carry = {**carried(n), "torque_before": 0.0, **dict.fromkeys(_NOISES, 0.0)}
    outputs = (Output("e", "", "innovation"), Output("s", "", "innovation"))
    names = ("torque", "angle", "reset", "known", "fresh")
    return compile(Observer(f"torque-likelihood-{order}", dt, names, (), carry, outputs, step))


def _mixed(parts: list[Array], noise: Mapping[str, Scalar], i: int, j: int) -> Scalar:
    """An entry of Q_d."""
    total: Scalar = 0.0
    for part, intensity in zip(parts, noise.values(), strict=True):
        total = total + float(part[i, j]) * intensity if part[i, j] != 0 else total
    return total
