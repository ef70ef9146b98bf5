"""The smoother's passes over a record: loops of one compiled step, as the observers are.

Backward, from the last tick on, it carries x_k given the state at the end of its block:

    chain_k = given_next_k o chain_k+1,          begun anew at the last tick of each block

With the whole record as one block the chain ends in a wall (`last`), so its m and S are the smoothed moments themselves:
the fixed interval. With blocks of L ticks it gives x_k given x_e, e the first tick of the next block. Forward, from there
on, the block's beginning is carried, given the state at j = k + L, and both are put together:

    smoothed_k = chain_k o (given_next_e o ... o given_next_j-1)  applied to the filtered moments of j

which is x_k given exactly the rows up to j, whatever L, at two chainings a tick.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from codriver.kernel import Scalar
from codriver.observers.covariance import Matrix
from codriver.observers.observer import Observer, Output, Scalars
from codriver.offline.conditional import PAIRS, Conditional, N, applied, chain_of, chosen, given_next, identity
from codriver.program import compile
from codriver.signals import Grid
from codriver.signals.signal import Array

X = [f"x{i}" for i in range(N)]
P = [f"P{i}{j}" for i, j in PAIRS]
_A = [f"A{i}{j}" for i in range(N) for j in range(N)]
_M = [f"m{i}" for i in range(N)]
_S = [f"S{i}{j}" for i, j in PAIRS]
MOMENTS = [*_M, *_S]
_TICK = (*X, *P, "shift", "wall")
Columns = Mapping[str, Array]


def fixed_interval(filtered: Columns, F: Array, Qd: Array, dt: float) -> dict[str, Array]:
    """Moments given all rows of each stretch.

    Args:
        filtered: columns of shape (n,): filtered means X and covariances P; "shift" of the first state on the way to the next
            tick; "wall", 1 where nothing may be learnt from the next tick, such as at the last.
        F, Qd: transition and process covariance.
        dt: tick, s.

    Returns:
        MOMENTS, columns of shape (n,).
    """
    return _backward({**filtered, "end": np.zeros(filtered["wall"].size)}, F, Qd, dt, MOMENTS)


def fixed_lag(filtered: Columns, F: Array, Qd: Array, dt: float, ticks: int) -> dict[str, Array]:
    """Moments of each tick given the rows up to `ticks` (at least 1) later; otherwise as `fixed_interval`."""
    n = filtered["wall"].size
    block = np.arange(n + ticks) % ticks
    chains = _backward({**filtered, "end": (block[:n] == ticks - 1).astype(float)}, F, Qd, dt, [*_A, *MOMENTS])
    after = {name: np.concatenate([column, np.zeros(ticks)]) for name, column in filtered.items()}
    after["wall"][n:] = 1.0
    before = {f"chain_{name}": np.concatenate([np.zeros(ticks), column]) for name, column in chains.items()}
    made = _run(_forward_pass(F, Qd, dt), {**after, **before, "begin": (block == 0).astype(float)}, dt)
    return {name: column[ticks:] for name, column in made.items()}


def _backward(columns: Columns, F: Array, Qd: Array, dt: float, wanted: Sequence[str]) -> dict[str, Array]:
    """The backward pass: the columns go in last tick first, and come out in their order."""

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        later = chosen(u["end"], identity(), _read(carry))
        now = _written(chain_of(given_next(*_tick(u), F, Qd), later))
        return now, now

    start = dict.fromkeys([*_A, *_M, *_S], 0.0)
    outputs = tuple(Output(name, "", "input") for name in start)
    backward = Observer("backward-pass", dt, (*_TICK, "end"), (), start, outputs, step)
    made = _run(backward, {name: column[::-1] for name, column in columns.items()}, dt, wanted)
    return {name: column[::-1] for name, column in made.items()}


def _forward_pass(F: Array, Qd: Array, dt: float) -> Observer:
    """The forward pass of the fixed lag."""

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        so_far = chosen(u["begin"], identity(), _read(carry))
        x, covariance, shift, wall = _tick(u)
        m, S = applied(_read({name: u[f"chain_{name}"] for name in start}), *applied(so_far, x, covariance))
        out = {name: value for name, value in _written(Conditional(so_far.A, m, S)).items() if name in MOMENTS}
        return _written(chain_of(so_far, given_next(x, covariance, shift, wall, F, Qd))), out

    start = dict.fromkeys([*_A, *_M, *_S], 0.0)
    inputs = (*_TICK, "begin", *(f"chain_{name}" for name in start))
    return Observer("forward-pass", dt, inputs, (), start, tuple(Output(n, "", "input") for n in MOMENTS), step)


def _run(observer: Observer, columns: Columns, dt: float, wanted: Sequence[str] | None = None) -> dict[str, Array]:
    """A pass over columns that are all there."""
    n = columns["wall"].size
    there = dict.fromkeys(observer.channels, np.ones(n, bool))
    return compile(observer, wanted).run_grid(
        Grid(dt * np.arange(n, dtype=np.float64), dt, dict(columns), there, there)
    )


def _tick(u: Scalars) -> tuple[list[Scalar], Matrix, Scalar, Scalar]:
    """Mean, covariance, shift and wall of a tick."""
    return [u[name] for name in X], _symmetric([u[name] for name in P]), u["shift"], u["wall"]


def _read(scalars: Scalars) -> Conditional:
    """A conditional from its scalars by name."""
    A = [[scalars[f"A{i}{j}"] for j in range(N)] for i in range(N)]
    return Conditional(A, [scalars[name] for name in _M], _symmetric([scalars[name] for name in _S]))


def _written(one: Conditional) -> Scalars:
    """Its scalars by name."""
    values = [*(a for row in one.A for a in row), *one.m, *(one.S[i][j] for i, j in PAIRS)]
    return dict(zip([*_A, *_M, *_S], values, strict=True))


def _symmetric(upper: Sequence[Scalar]) -> Matrix:
    """A symmetric matrix from its upper triangle."""
    by_pair = dict(zip(PAIRS, upper, strict=True))
    return [[by_pair[min(i, j), max(i, j)] for j in range(N)] for i in range(N)]
