"""Made features and torque of known noise, and a learned model as an observer."""

import json

import numpy as np

from codriver.observers import Observer, Output
from codriver.signals import Grid

NOISE = 0.1


def made(n=600, d=4, seed=0, bend=1.0):
    """Features that change slowly, and a torque of a line, a bend and white noise of NOISE; X (n, d), y (n,)."""
    rng = np.random.default_rng(seed)
    X = rng.standard_normal((n, d))
    for k in range(1, n):
        X[k] = 0.8 * X[k - 1] + 0.6 * X[k]
    slope = np.linspace(0.5, -0.3, d)
    return X, X @ slope + bend * 0.4 * np.tanh(2 * X[:, 0]) + NOISE * rng.standard_normal(n)


def through_json(state):
    """A state as it comes back from a file."""
    return json.loads(json.dumps(state, default=lambda array: array.tolist()))


def as_observer(model, d):
    """A learned model as an observer of features z0, z1, ..."""
    names = tuple(f"z{i}" for i in range(d))

    def step(carry, u, y, ok, rho):
        new, mean, sd = model.step(carry, [u[name] for name in names])
        return new, {"driver_torque": mean, "driver_torque_sd": sd}

    outputs = (Output("driver_torque", "N*m", "estimate"), Output("driver_torque_sd", "N*m", "sd"))
    return Observer(f"learned-{model.kind}", 0.2, names, (), model.initial(), outputs, step)


def as_grid(X):
    """Rows as a grid of such features."""
    columns = {f"z{i}": np.ascontiguousarray(X[:, i]) for i in range(X.shape[1])}
    flags = {name: np.ones(len(X), dtype=bool) for name in columns}
    return Grid(0.2 * np.arange(len(X)), 0.2, columns, flags, flags)
