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
from codriver.offline.conditional import Conditional, applied, chain_of, chosen, given_next, identity, pairs
from codriver.program import compile
from codriver.signals import Grid
from codriver.signals.signal import Array

Columns = Mapping[str, Array]


class Names:
    """The columns of n states: mean x and covariance P of the filter, shift; A, m and S of a chain; moments m and S.

    Attributes:
        x, P, shift, A, m, S: names, the matrices row by row, the symmetric ones by their upper triangle.
        moments: m and S.
        tick: what a tick brings.
    """

    def __init__(self, n: int) -> None:
        self.n = n
        self.x, self.shift, self.m = ([f"{letter}{i}" for i in range(n)] for letter in ("x", "shift", "m"))
        self.P, self.S = ([f"{letter}{i}{j}" for i, j in pairs(n)] for letter in ("P", "S"))
        self.A = [f"A{i}{j}" for i in range(n) for j in range(n)]
        self.moments = [*self.m, *self.S]
        self.tick = (*self.x, *self.P, *self.shift, "wall")


def fixed_interval(filtered: Columns, F: Array, Qd: Array, dt: float) -> dict[str, Array]:
    """Moments given all rows of each stretch.

    Args:
        filtered: columns of shape (n,), by the names of `Names`: filtered means and covariances; what known inputs add to each
            state on the way to the next tick; "wall", 1 where nothing may be learnt from the next tick, such as at the last.
        F, Qd: transition and process covariance.
        dt: tick, s.

    Returns:
        the moments, columns of shape (n,).
    """
    names = Names(F.shape[0])
    return _backward({**filtered, "end": np.zeros(filtered["wall"].size)}, F, Qd, dt, names.moments)


def fixed_lag(filtered: Columns, F: Array, Qd: Array, dt: float, ticks: int) -> dict[str, Array]:
    """Moments of each tick given the rows up to `ticks` (at least 1) later; otherwise as `fixed_interval`."""
    n, names = filtered["wall"].size, Names(F.shape[0])
    block = np.arange(n + ticks) % ticks
    chains = _backward(
        {**filtered, "end": (block[:n] == ticks - 1).astype(float)}, F, Qd, dt, [*names.A, *names.moments]
    )
    after = {name: np.concatenate([column, np.zeros(ticks)]) for name, column in filtered.items()}
    after["wall"][n:] = 1.0
    before = {f"chain_{name}": np.concatenate([np.zeros(ticks), column]) for name, column in chains.items()}
    made = _run(_forward_pass(F, Qd, dt), {**after, **before, "begin": (block == 0).astype(float)}, dt)
    return {name: column[ticks:] for name, column in made.items()}


def _backward(columns: Columns, F: Array, Qd: Array, dt: float, wanted: Sequence[str]) -> dict[str, Array]:
    """The backward pass: the columns go in last tick first, and come out in their order."""
    names = Names(F.shape[0])

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        later = chosen(u["end"], identity(names.n), _read(carry, names))
        now = _written(chain_of(given_next(*_tick(u, names), F, Qd), later), names)
        return now, now

    start = dict.fromkeys([*names.A, *names.moments], 0.0)
    outputs = tuple(Output(name, "", "input") for name in start)
    backward = Observer("backward-pass", dt, (*names.tick, "end"), (), start, outputs, step)
    made = _run(backward, {name: column[::-1] for name, column in columns.items()}, dt, wanted)
    return {name: column[::-1] for name, column in made.items()}


def _forward_pass(F: Array, Qd: Array, dt: float) -> Observer:
    """The forward pass of the fixed lag."""
    names = Names(F.shape[0])

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        so_far = chosen(u["begin"], identity(names.n), _read(carry, names))
        x, covariance, shift, wall = _tick(u, names)
        m, S = applied(_read({name: u[f"chain_{name}"] for name in start}, names), *applied(so_far, x, covariance))
        all_of_it = _written(Conditional(so_far.A, m, S), names)
        out = {name: all_of_it[name] for name in names.moments}
        return _written(chain_of(so_far, given_next(x, covariance, shift, wall, F, Qd)), names), out

    start = dict.fromkeys([*names.A, *names.moments], 0.0)
    inputs = (*names.tick, "begin", *(f"chain_{name}" for name in start))
    return Observer("forward-pass", dt, inputs, (), start, tuple(Output(n, "", "input") for n in names.moments), step)


def _run(observer: Observer, columns: Columns, dt: float, wanted: Sequence[str] | None = None) -> dict[str, Array]:
    """A pass over columns that are all there."""
    n = columns["wall"].size
    there = dict.fromkeys(observer.channels, np.ones(n, bool))
    return compile(observer, wanted).run_grid(
        Grid(dt * np.arange(n, dtype=np.float64), dt, dict(columns), there, there)
    )


def _tick(u: Scalars, names: Names) -> tuple[list[Scalar], Matrix, list[Scalar], Scalar]:
    """Mean, covariance, shift and wall of a tick."""
    P = _symmetric([u[name] for name in names.P], names.n)
    return [u[name] for name in names.x], P, [u[name] for name in names.shift], u["wall"]


def _read(scalars: Scalars, names: Names) -> Conditional:
    """A conditional from its scalars by name."""
    A = [[scalars[f"A{i}{j}"] for j in range(names.n)] for i in range(names.n)]
    return Conditional(A, [scalars[name] for name in names.m], _symmetric([scalars[name] for name in names.S], names.n))


def _written(one: Conditional, names: Names) -> Scalars:
    """Its scalars by name."""
    values = [*(a for row in one.A for a in row), *one.m, *(one.S[i][j] for i, j in pairs(names.n))]
    return dict(zip([*names.A, *names.moments], values, strict=True))


def _symmetric(upper: Sequence[Scalar], n: int) -> Matrix:
    """A symmetric matrix from its upper triangle."""
    by_pair = dict(zip(pairs(n), upper, strict=True))
    return [[by_pair[min(i, j), max(i, j)] for j in range(n)] for i in range(n)]
