"""How likely the recorded rows are under a noise Q, R: the innovations of the Kalman form.

    log L = -1/2 sum over the rows that count of [ log(2 pi f s) + e^2 / (f s) ]

with e the innovation, s its nominal variance and f the common factor of Q and R. The innovations do not depend on f, so its
best value is known: f = mean of e^2 / s. Then log L = -1/2 [ N log(2 pi f) + N + sum of log s ].

The known input, standstills and lost inputs depend on no noise, so the estimator runs once; then the filter's own update
(`jerk_forms.kalman_update`) runs over its rows with Q, R handed in as carried scalars: one machine code for all noises.

Which rows count is fixed beforehand, so that likelihoods can be compared: the vehicle moves faster than 1 m/s with known
inputs since 2 s, and no gear shift goes on or ended less than 1 s ago (u is wrong there for other reasons than noise). The
filter uses the other rows as ever.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from types import SimpleNamespace

import numpy as np
import numpy.typing as npt

from codriver.errors import DesignError, LogError
from codriver.estimate import Estimate
from codriver.kernel import Scalar, negate, select
from codriver.models import intention_model
from codriver.observers.covariance import predict_mean
from codriver.observers.jerk import SLOW
from codriver.observers.jerk_forms import ROWS, STATES, Situation, kalman_update
from codriver.observers.observer import Observer, Output, Scalars
from codriver.observers.riccati import stationary_predicted, tick_map
from codriver.observers.scaled_gain import Preset, scaled_noise
from codriver.program import Program, compile
from codriver.signals import Grid
from codriver.signals.signal import Array

SETTLING, AFTER_SHIFT = 2.0, 1.0  # s
BLOCK = 10.0  # s; longer than innovations lean to one side
LEAST_ROWS = 1000
LEAST_BLOCKS = 10  # for standard errors; see docs/tuning.md
_PAIRS = [(i, j) for i in range(4) for j in range(i, 4)]
_STATE = ["input_before", *(f"x_{s}" for s in STATES), *(f"P_{STATES[i]}_{STATES[j]}" for i, j in _PAIRS)]
_NOISE = [*(f"Qd_{i}{j}" for i, j in _PAIRS), "Rd_0", "Rd_1", *(f"P_{i}" for i in range(4))]
_ROWS = ("known", "y_a", "y_v", "use_a", "use_v", "first", "standing", "lost")


@dataclass(frozen=True, eq=False)
class Evidence:
    """What the rows say of one noise.

    Attributes:
        log_likelihood: of all rows that count, at the best factor.
        factor: the best common factor of Q and R.
        count: of the rows.
        blocks: log likelihood of each block of 10 s, at that factor, shape (m,); they add up to the whole.
    """

    log_likelihood: float
    factor: float
    count: int
    blocks: Array


class Likelihood:
    """The likelihood of recorded drives, for any noise.

    Attributes:
        dt: tick, s.
        seconds: time in which rows count.
    """

    def __init__(self, runs: Sequence[Estimate], *, every_row: bool = False) -> None:
        """Take the rows of drives.

        Args:
            runs: estimates of one estimator of the intention at one tick, in the Kalman form, with any noise.
            every_row: count all rows that were used, also those of shifts, standstills and starts.

        Raises:
            LogError: too few rows count.
        """
        self.dt = runs[0].grid.dt
        self._drives = [_rows(run) for run in runs]
        self._counted = [_counted(run, every_row) for run in runs]
        block = max(round(BLOCK / self.dt), 1)
        self._blocks = [np.arange(0, counted.shape[1], block) for counted in self._counted]
        self.seconds = sum(float(c.any(axis=0).sum()) for c in self._counted) * self.dt
        if not every_row and (rows := sum(int(c.sum()) for c in self._counted)) < LEAST_ROWS:
            raise LogError(
                f"{rows} innovations that count, in {self.seconds:.1f} s", f"at least {LEAST_ROWS}",
                "give longer drives: moving, with all inputs, between gear shifts",
            )  # fmt: skip
        self._program = _program(self.dt)

    @property
    def blocks(self) -> int:
        """How many whole blocks the time that counts makes up."""
        return whole_blocks(self.seconds)

    def at(self, preset: Preset, ell: float) -> Evidence:
        """The evidence for a noise.

        Raises:
            DesignError: there is no stable filter for it.
        """
        terms = self._terms(preset, ell)
        count = sum(int(c.sum()) for c in self._counted)
        factor = sum(float(np.sum(square)) for square, _ in terms) / count
        blocks = [
            np.add.reduceat(
                -0.5 * (self._where(k, square) / factor + self._where(k, logs + np.log(2 * np.pi * factor))), starts
            )
            for k, ((square, logs), starts) in enumerate(zip(terms, self._blocks, strict=True))
        ]
        per_block = np.concatenate(blocks)
        return Evidence(float(per_block.sum()), factor, count, per_block)

    def _where(self, drive: int, values: Array) -> Array:
        """Values of the counted rows, summed by tick, shape (n,)."""
        counted = self._counted[drive]
        laid = np.zeros(counted.shape)
        laid[counted] = values
        return np.asarray(laid.sum(axis=0))

    def _terms(self, preset: Preset, ell: float) -> list[tuple[Array, Array]]:
        """e^2 / s and log s of the rows that count, for each drive."""
        carry = {**dict.fromkeys(_STATE, 0.0), **_noise_of(preset, ell, self.dt)}
        found = []
        for grid, counted in zip(self._drives, self._counted, strict=True):
            _, columns = self._program.advance(grid, carry)
            e, s = (np.vstack([columns[f"{row}_{what}"] for row in ROWS])[counted] for what in ("e", "s"))
            if not np.all(s > 0):
                raise DesignError(
                    f"Q = {preset.Q}, R = {preset.R} at ell = {ell:g} leave an innovation without variance",
                    "a noise whose filter keeps its digits", "choose less extreme ratios of Q and R",
                )  # fmt: skip
            found.append((e * e / s, np.log(s)))
        return found


def whole_blocks(seconds: float) -> int:
    """How many whole blocks so much time makes up."""
    return int(seconds / BLOCK + 1e-9)


def _rows(run: Estimate) -> Grid:
    """What each tick of a drive brings to the update, as columns; see `jerk.jerk_observer` for what each is."""
    columns = run.columns
    standing, use_v = run.flag("standstill"), run.flag("speed_used")
    started = np.logical_or.accumulate(use_v)
    speed = np.where(use_v, run.grid.values["longitudinal_speed"], 0.0)
    made: dict[str, Array | npt.NDArray[np.bool_]] = {
        "known": np.where(standing, 0.0, columns["known_input"]),
        "y_a": np.where(run.flag("acceleration_used"), run.grid.values["longitudinal_acceleration"], 0.0),
        "y_v": np.where(columns["direction"] < 0, -np.abs(speed), speed),
        "use_a": run.flag("acceleration_used"),
        "use_v": use_v,
        "first": started & ~np.append(False, started[:-1]),
        "standing": standing,
        "lost": ~run.flag("inputs_known") & ~standing,
    }
    there = dict.fromkeys(_ROWS, np.ones(len(run.grid), bool))
    return Grid(run.time, run.grid.dt, {name: column.astype(float) for name, column in made.items()}, there, there)


def _counted(run: Estimate, every_row: bool) -> npt.NDArray[np.bool_]:
    """Which innovations count, shape (2, n): accelerometer, speed."""
    used = np.vstack([run.flag(f"{row}_used") for row in ROWS])
    started = np.logical_or.accumulate(run.flag("speed_used"))
    if every_row:
        return used
    moving = started & ~run.flag("standstill") & run.flag("inputs_known")
    quick = np.abs(run[run.estimates[0].name].values) >= SLOW
    return used & quick & ~_soon_after(~moving, SETTLING, run.grid.dt) & ~_soon_after(
        run.flag("gear_shift"), AFTER_SHIFT, run.grid.dt
    )  # fmt: skip


def _soon_after(flag: npt.NDArray[np.bool_], seconds: float, dt: float) -> npt.NDArray[np.bool_]:
    """Where a flag is set, or was less than `seconds` ago, shape (n,)."""
    last = np.maximum.accumulate(np.where(flag, np.arange(flag.size), -(10**9)))
    return np.asarray(np.arange(flag.size) - last <= seconds / dt)


def _noise_of(preset: Preset, ell: float, dt: float) -> dict[str, float]:
    """The carried scalars that hold a noise: what `design_scaled_gain` says of it, without its proofs."""
    model = intention_model()
    Q, R = scaled_noise(preset, ell)
    F, Qd, Rd = model.transition(dt), model.process_noise(Q, dt), np.diag(R) / dt
    predicted = stationary_predicted([tick_map(F, Qd, model.C, Rd)])
    S = model.C @ predicted @ model.C.T + np.diag(Rd)
    P = predicted - predicted @ model.C.T @ np.linalg.solve(S, model.C @ predicted)
    if not np.all(np.diag(P) > 0):
        raise DesignError(
            f"Q = {preset.Q}, R = {preset.R} at ell = {ell:g} leave a state without variance",
            "a noise whose filter keeps its digits", "choose less extreme ratios of Q and R",
        )  # fmt: skip
    values = [*(Qd[i, j] for i, j in _PAIRS), *Rd, *np.diag(P)]
    return dict(zip(_NOISE, (float(value) for value in values), strict=True))


@cache
def _program(dt: float) -> Program:
    """The recursion, compiled: one machine code for all drives and noises."""
    return compile(_recursion(dt))


def _recursion(dt: float) -> Observer:
    """The Kalman form's recursion with its noise among the carried scalars, which it leaves as they are."""
    F = intention_model().transition(dt)

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        x = predict_mean([carry[f"x_{state}"] for state in STATES], F)
        x[0] = x[0] + (0.5 * dt) * (carry["input_before"] + u["known"])
        begin = [u["y_v"], 0.0, select(u["use_a"], u["y_a"] - u["known"], 0.0), 0.0]
        x = [select(u["first"], new, old) for new, old in zip(begin, x, strict=True)]
        now = Situation(
            u["known"], u["y_a"], u["y_v"], u["use_a"], u["use_v"], 1.0, u["first"], u["standing"], u["lost"]
        )
        done = kalman_update(_noise_as_design(carry, F), carry, x, now)  # type: ignore[arg-type]
        moving = negate(u["standing"])
        x = [done.x[0], select(moving, done.x[1], 0.0), done.x[2], select(moving, done.x[3], 0.0)]
        new = {
            "input_before": u["known"], **{f"x_{s}": value for s, value in zip(STATES, x, strict=True)},
            **done.memory, **{name: carry[name] for name in _NOISE},
        }  # fmt: skip
        out = {f"{row}_e": e for row, (e, _, _) in done.innovations.items()}
        return new, out | {f"{row}_s": s for row, (_, s, _) in done.innovations.items()}

    outputs = tuple(Output(f"{row}_{what}", "", "innovation") for what in ("e", "s") for row in ROWS)
    return Observer("likelihood", dt, _ROWS, (), dict.fromkeys([*_STATE, *_NOISE], 0.0), outputs, step)


def _noise_as_design(carry: Mapping[str, Scalar], F: Array) -> SimpleNamespace:
    """The parts of a design that the update looks at, from the carried scalars."""
    Qd, Rd, P = (np.zeros((n, n), object) for n in (4, 2, 4))
    for i, j in _PAIRS:
        Qd[i, j] = Qd[j, i] = carry[f"Qd_{i}{j}"]
    for i in range(2):
        Rd[i, i] = carry[f"Rd_{i}"]
    for i in range(4):
        P[i, i] = carry[f"P_{i}"]
    return SimpleNamespace(F=F, Qd=Qd, Rd=Rd, P=P)
