"""Certificate of an LPV observer's gains, recomputed from the Lyapunov matrix X and the gains L_i, never taken from the solver.

    e' = (A(v) - L(v) C) e + P p - L(v) D d,   L(v) = sum_i mu_i(v) L_i,   V = e' X e
    M_i' X + X M_i + I + g^-2 X S_i S_i' X < 0,   M_i = A_i - L_i C,   S_i = [P, -L_i D]                 (33)

By plain eigenvalues: X > 0; the least g that (33) then holds with at every vertex; the pole region there; poles on a grid of
speeds; and, at the tick dt, that V falls over a tick of the exact discretisation at every speed of the grid, so that the
sampled observer is stable at any change of speed from tick to tick. What fails is refused: solvers call unstable results
optimal.

Damon, Ichalal, Arioui 2018, section IV; the region: Chilali, Gahinet 1996, doi:10.1109/9.486637.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from codriver.errors import DesignError
from codriver.models.lpv import LPV, Polytope
from codriver.models.state_space import matrix_exponential
from codriver.observers.observer import Certificate
from codriver.signals.signal import Array

GRID = 41  # speeds


@dataclass(frozen=True, eq=False)
class Scaling:
    """Units in which the inequalities are balanced.

    Attributes:
        errors: of the states, shape (n,), in their units.
        noise: D of the outputs, shape (p,): sd / sqrt(rate).
        driven: of the inputs, shape (m,): torque rate, N m/s.
        time: s.
    """

    errors: Array
    noise: Array
    driven: Array
    time: float

    def of(self, A: Array, B: Array, C: Array) -> tuple[Array, Array, Array]:
        """A, P and C in these units."""
        W = self.errors
        return self.time * A * W / W[:, None], self.time * B * self.driven / W[:, None], C * W / self.noise[:, None]

    def gain(self, scaled: Array) -> Array:
        """A gain in the states' own units from one in these."""
        return np.asarray(scaled * self.errors[:, None] / self.noise / self.time)

    def scaled_gain(self, L: Array) -> Array:
        """The other way round."""
        return np.asarray(L / self.errors[:, None] * self.noise * self.time)


def certify_gains(
    model: LPV, polytope: Polytope, L: tuple[Array, ...], X: Array, scaling: Scaling, dt: float, *, slowest: float = 0.0,
    fastest: float | None = None, gamma: float | None = None,
) -> tuple[float, Certificate]:  # fmt: skip
    """The least gamma that X and the gains prove, and what else they do.

    Args:
        model, polytope, L, X, scaling, dt, slowest, fastest: see `MotorcycleLMI`.
        gamma: that must be reached.

    Raises:
        DesignError: something does not hold; the message says all that does not.
    """
    failed = []
    least = float(np.linalg.eigvalsh(X).min()) if np.allclose(X, X.T, rtol=1e-9) and np.isfinite(X).all() else -np.inf
    if not least > 0:
        failed.append(f"X is not positive definite (least eigenvalue {least:.3g})")
    reached, slow, fast = 0.0, -np.inf, 0.0
    for A, gain in zip(polytope.vertices, L, strict=True):
        a, P, C = scaling.of(A, model.B, model.C)
        l_scaled = scaling.scaled_gain(gain)
        reached = max(reached, _proven(a - l_scaled @ C, np.hstack([P, -l_scaled]), X))
        slow = max(slow, _decay(a - l_scaled @ C, X) / scaling.time if least > 0 else np.inf)
        fast = max(fast, _radius(a - l_scaled @ C, X) / scaling.time if least > 0 else np.inf)
    if not np.isfinite(reached):
        failed.append("a vertex's inequality (33) does not hold with any gamma")
    elif gamma is not None and reached > gamma * (1 + 1e-6):
        failed.append(f"gamma is {reached:.4g}, not {gamma:.4g}")
    if not slow < -slowest * (1 - 1e-6):
        failed.append(f"V decays with {-slow:.3g} 1/s at the slowest vertex, not with {slowest:.3g}")
    if fastest is not None and not fast < fastest * (1 + 1e-6):
        failed.append(f"the disc of the poles has a radius of {fast:.4g} rad/s, not {fastest:.4g}")
    speeds = np.linspace(*polytope.range, GRID)
    poles, discrete, falls, euler = [], [], -np.inf, 0.0
    W = scaling.errors
    for v in speeds:
        gain = np.tensordot(polytope.weights(v), np.array(L), 1)
        closed = model.A(v) - gain @ model.C
        poles.append(np.linalg.eigvals(closed))
        F = matrix_exponential(closed * dt)
        discrete.append(np.linalg.eigvals(F))
        Fs = F * W / W[:, None]
        falls = max(falls, float(np.linalg.eigvalsh(Fs.T @ X @ Fs - X).max()) / max(float(np.abs(X).max()), 1e-300))
        euler = max(euler, float(np.abs(1 + dt * poles[-1]).max()))
    every, sampled = np.concatenate(poles).astype(complex), np.concatenate(discrete).astype(complex)
    if not every.real.max() < 0:
        failed.append(f"a pole at {every.real.max():+.3g} 1/s between {speeds[0]:g} and {speeds[-1]:g} m/s")
    if not falls < 0:
        failed.append(f"V does not fall over a tick of {dt:g} s")
    if failed:
        raise DesignError(
            f"the observer's certificate fails: {'; '.join(failed)}",
            "a stable observer from X and the gains as they are",
            "a narrower range of speed, a wider pole region, or a larger gamma",
        )
    low, high = polytope.range
    claims = (
        f"X > 0, and (33) holds at {len(L)} vertices: from {low:g} to {high:g} m/s, at any change of speed, the L2 gain from "
        f"torque rate and noise to the weighted error is at most {reached:.4g}",
        f"sqrt(e' X e) decays with {-slow:.3g} 1/s or quicker, and all poles lie within {fast:.4g} rad/s",
        f"at {GRID} speeds: Re s <= {every.real.max():.3g} 1/s, |s| <= {np.abs(every).max():.4g} rad/s",
        f"sampled at {dt:g} s by the exact discretisation V falls over every tick, at any change of speed from tick to tick: "
        f"|poles| <= {np.abs(sampled).max():.4g}",
        f"by the forward Euler rule {'it would be stable' if euler < 1 else 'it would be unstable'}: |poles| up to {euler:.3g}",
    )
    return reached, Certificate(True, claims, every, sampled, float(-every.real.max()))


def _proven(closed: Array, S: Array, X: Array) -> float:
    """The least gamma with which (33) holds; infinite if none."""
    Q = closed.T @ X + X @ closed + np.eye(X.shape[0])
    if not np.isfinite(Q).all() or np.linalg.eigvalsh((Q + Q.T) / 2).max() >= 0:
        return np.inf
    return float(np.sqrt(max(np.linalg.eigvalsh(S.T @ X @ np.linalg.solve(-Q, X @ S)).max(), 0.0)))


def _decay(closed: Array, X: Array) -> float:
    """The least a with closed' X + X closed <= 2 a X."""
    root = np.linalg.inv(np.linalg.cholesky(X))
    M = root @ (X @ closed) @ root.T
    return float(np.linalg.eigvalsh((M + M.T) / 2).max())


def _radius(closed: Array, X: Array) -> float:
    """The least r with closed' X closed <= r^2 X."""
    root = np.linalg.cholesky(X).T
    return float(np.linalg.norm(root @ closed @ np.linalg.inv(root), 2))
