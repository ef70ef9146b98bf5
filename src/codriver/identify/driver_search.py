"""Parameters at which instruments are orthogonal to what a driver's torque leaves unexplained, with what is known beforehand.

    minimise  g' S^-1 g + |theta - theta_0|^2 / spread^2,     g = Z' e(theta),   Z = dv^/dtheta whitened like e

theta, logarithms of the parameters; v^, the residual (`driver_residual`) of what the road makes of what the driver saw
(`driver_road`), or v itself: then g = 0 is least squares. S, Newey-West's covariance of g, since gains that drift make errors
that are alike for long. theta_0 and spread: what is known before the drive, as a normal distribution. With G = dg/dtheta

    covariance = (G' S^-1 G + 1 / spread^2)^-1

holds what the drive tells and what was known. Generalised method of moments (Hansen 1982, doi:10.2307/1912775) as a posterior
(Chernozhukov, Hong 2003, doi:10.1016/S0304-4076(03)00100-3). Levenberg-Marquardt; Z, S and the whitening are renewed between
rounds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from codriver.identify.driver_residual import Residual, jacobian, whitened, whitening
from codriver.identify.standard_errors import Index, block_length, newey_west
from codriver.signals.signal import Array

_ROUNDS, _STEPS, _TRIES = 20, 6, 8
_SETTLED = 0.02  # of a standard error: rounds end
_LONGEST = 0.5  # step


@dataclass(frozen=True, eq=False)
class Found:
    """The end of a search.

    Attributes:
        theta: logarithms.
        settled: the rounds ended by themselves.
        plain, robust: covariances of theta, for white errors and for such that are alike over time.
        errors: e, one drive after the other.
        pieces: first rows of the drives in it, and its length.
    """

    theta: Array
    settled: bool
    plain: Array
    robust: Array
    errors: Array
    pieces: Index


def search(residual: Residual, instrument: Residual, start: Array, spread: float) -> Found:
    """Search.

    Args:
        residual: v of what the driver saw.
        instrument: v^.
        start: theta_0.
        spread: of what is known, 1.
    """
    theta = start
    for _ in range(_ROUNDS):
        filter_ = whitening(residual(theta))
        v = residual(theta)
        Z, e, pieces = (
            whitened(filter_, jacobian(instrument, theta)),
            whitened(filter_, v),
            _pieces(v, filter_.size - 1),
        )
        before, theta = theta, _round(residual, filter_, Z, _meat(Z, e, pieces), theta, start, spread)
        plain, robust, errors = _covariances(residual, instrument, theta, spread)
        settled = bool((np.abs(theta - before) < _SETTLED * np.sqrt(robust.diagonal())).all())
        if settled:
            break
    return Found(theta, settled, plain, robust, errors, pieces)


def _round(residual: Residual, filter_: Array, Z: Array, S: Array, theta: Array, known: Array, spread: float) -> Array:
    """theta with Z, S and whitening held."""
    weight, damping = np.linalg.inv(S), 1e-3

    def cost(x: Array) -> tuple[float, Array]:
        g = Z.T @ whitened(filter_, residual(x))
        return float(g @ weight @ g + ((x - known) ** 2).sum() / spread**2), g

    now, g = cost(theta)
    for _ in range(_STEPS):
        G = Z.T @ whitened(filter_, jacobian(residual, theta))
        H = G.T @ weight @ G + np.eye(theta.size) / spread**2
        slope = G.T @ weight @ g + (theta - known) / spread**2
        moved = 0.0
        for _ in range(_TRIES):
            step = -np.linalg.solve(H + damping * np.diag(H.diagonal()), slope)
            step *= min(1.0, _LONGEST / max(float(np.abs(step).max()), 1e-300))
            ahead, g_ahead = cost(theta + step)
            if ahead <= now:
                theta, now, g, damping, moved = theta + step, ahead, g_ahead, damping / 10, float(np.abs(step).max())
                break
            damping *= 10
        if moved < 1e-5:
            break
    return theta


def _pieces(drives: tuple[Array, ...], p: int) -> Index:
    """First rows of the drives in e, and its length."""
    return np.cumsum([0, *(v.size - p for v in drives)])


def _meat(Z: Array, e: Array, pieces: Index) -> Array:
    """Newey-West's covariance of Z'e."""
    used = np.ones(e.size, bool)
    ZZ = Z.T @ Z
    return np.asarray(ZZ @ newey_west(Z, e, used, pieces, block_length(Z, e, used, pieces)) @ ZZ)


def _covariances(residual: Residual, instrument: Residual, theta: Array, spread: float) -> tuple[Array, Array, Array]:
    """Plain and robust covariance at theta, and e."""
    v = residual(theta)
    filter_ = whitening(v)
    Z, J = (whitened(filter_, jacobian(r, theta)) for r in (instrument, residual))
    e, pieces = whitened(filter_, v), _pieces(v, filter_.size - 1)
    G, before = Z.T @ J, np.eye(theta.size) / spread**2
    plain, robust = (
        np.asarray(np.linalg.inv(G.T @ np.linalg.solve(S, G) + before), float)
        for S in (Z.T @ Z * (e @ e) / e.size, _meat(Z, e, pieces))
    )
    return plain, robust, e
