"""Gains of the motorcycle's Takagi-Sugeno observer by linear matrix inequalities.

    x^' = A(v) x^ + L(v) (y - C x^),   L(v) = sum_i mu_i(v) L_i,   L_i = X^-1 Lbar_i                  (23), (35)
    [ A_i' X + X A_i - Lbar_i C - C' Lbar_i' + I    X P    -Lbar_i D ]
    [ P' X                                         -g^2 I     0      ]  < 0,   X > 0,  i = 1..r       (34)
    [ -D' Lbar_i'                                     0     -g^2 I   ]

Then the error e is stable at any change of speed, and its L2 norm is at most g times that of (p, d): p the rate of the rider's
torque, d the sensors' noise. (28) prints g^2 for g; g^2 is the paper's gamma-bar.

**What g weighs.** e, p and d are numbers of unlike units; a g says nothing without them. Here e is in units of ERRORS, p in
units of `torque_rate`, and D = sd of a sensor / sqrt(its rate), so that d is white noise of intensity 1. States, outputs and time
are scaled that way before the solver sees them; unscaled, solvers call results optimal that are not, or that are unstable.

**Poles.** The least g alone puts poles at 1e5 rad/s and beyond. The region Re s < -slowest, |s| < fastest is two more
inequalities a vertex:

    M_i + M_i' + 2 slowest X < 0,   [-fastest X, M_i; M_i', -fastest X] < 0,   M_i = X A_i - Lbar_i C

What comes out is believed only with its certificate (`lmi_certificate`).

Damon, Ichalal, Arioui 2018, section IV; the region: Chilali, Gahinet 1996, doi:10.1109/9.486637.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np

from codriver.errors import DesignError, UsageError
from codriver.models.lpv import LPV, Polytope
from codriver.observers.lmi_certificate import Scaling, certify_gains
from codriver.observers.observer import Certificate
from codriver.signals.signal import Array

DEGREE = np.pi / 180
# Error that is worth 1, by state: rad, m/s, rad/s, N, N m.
ERRORS = {
    "roll_angle": DEGREE, "steer_angle": 0.1 * DEGREE, "lateral_velocity": 0.05, "yaw_rate": 2 * DEGREE,
    "roll_rate": 2 * DEGREE, "steer_rate": 2 * DEGREE, "front_lateral_force": 100.0, "rear_lateral_force": 100.0,
    "rider_torque": 5.0,
}  # fmt: skip
# Standard deviation of a sample: encoder and gyroscope, a slope over 80 ms, v times yaw rate; rad, rad/s, m/s^2.
SENSORS = {
    "steer_angle": 0.05 * DEGREE, "yaw_rate": 0.3 * DEGREE, "roll_rate": 0.3 * DEGREE, "steer_rate": 1.0 * DEGREE,
    "lateral_acceleration": 0.2,
}  # fmt: skip
TORQUE_RATE = 80.0  # N m/s rms


@dataclass(frozen=True, eq=False)
class MotorcycleLMI:
    """A design.

    Attributes:
        model: the augmented motorcycle (9 states).
        polytope: its vertices between the two speeds.
        L: gains L_i, shape (9, p) each.
        X: Lyapunov matrix in scaled states.
        gamma: certified gain from (p, d) to e in the units of `scaling`.
        scaling: those units.
        slowest, fastest: the pole region, 1/s.
        dt: tick, s.
        certificate: recomputed.
    """

    model: LPV
    polytope: Polytope
    L: tuple[Array, ...]
    X: Array
    gamma: float
    scaling: Scaling
    slowest: float
    fastest: float
    dt: float
    certificate: Certificate

    def gain(self, v: float) -> Array:
        """L(v), v clipped to the range of the design: shape (9, p)."""
        held = min(max(v, self.polytope.range[0]), self.polytope.range[1])
        return np.asarray(np.tensordot(self.polytope.weights(held), np.array(self.L), 1))

    def error_matrix(self, v: float) -> Array:
        """A(v) - L(v) C; A is that of the speed itself, clipped nowhere."""
        return np.asarray(self.model.A(v) - self.gain(v) @ self.model.C)


def design_motorcycle_lmi(
    model: LPV, low: float, high: float, dt: float = 0.01, *, gamma: float | None = None, slowest: float = 1.0,
    fastest: float | None = 300.0, errors: dict[str, float] | None = None, sensors: dict[str, float] | None = None,
    torque_rate: float = TORQUE_RATE, rate: float | None = None, scheduled: bool = True,
) -> MotorcycleLMI:  # fmt: skip
    """Design and certify.

    Args:
        model: the motorcycle with the rider's torque among its states: `motorcycle_model(p).with_walking_inputs()`.
        low, high: range of speed, m/s.
        dt: tick, s.
        gamma: gain to be reached, in the units chosen; None for the least.
        slowest: all poles have Re < -slowest, 1/s.
        fastest: and |s| < fastest, rad/s; None for no bound, which no tick can follow.
        errors: error worth 1, by state; what is not named is that of ERRORS.
        sensors: sd of a sample, by output; what is not named is that of SENSORS.
        torque_rate: of the rider, N m/s.
        rate: samples of a sensor per second; by default 1/dt.
        scheduled: False for one gain at all speeds.

    Raises:
        DesignError: no such observer, or its certificate fails.
        UsageError: cvxpy is not installed.
    """
    scaling = _scaling(model, errors or {}, sensors or {}, torque_rate, rate or 1 / dt, fastest)
    polytope = model.polytope(low, high)
    X, scaled = _solve(model, polytope, scaling, gamma, slowest, fastest, scheduled)
    L = tuple(scaling.gain(gain) for gain in scaled)
    found, certificate = certify_gains(
        model, polytope, L, X, scaling, dt, slowest=slowest, fastest=fastest, gamma=gamma
    )
    return MotorcycleLMI(
        model, polytope, L, X, found, scaling, slowest, np.inf if fastest is None else fastest, dt, certificate
    )


def _scaling(
    model: LPV, errors: dict[str, float], sensors: dict[str, float], torque_rate: float, rate: float, fastest: float | None
) -> Scaling:  # fmt: skip
    """The units, checked.

    Raises:
        DesignError: a weight that is not positive, or of no state or output.
    """
    strange = [n for n in errors if n not in model.states] + [n for n in sensors if n not in model.outputs]
    weights, noise = {**ERRORS, **errors}, {**SENSORS, **sensors}
    absent = [n for n in model.states if n not in weights] + [n for n in model.outputs if n not in noise]
    numbers = [*weights.values(), *noise.values(), torque_rate, rate]
    if strange or absent or not all(np.isfinite(x) and x > 0 for x in numbers):
        raise DesignError(
            f"weights {errors}, {sensors}, torque rate {torque_rate:g}, {rate:g} samples/s; unknown: {strange}, "
            f"missing: {absent}",
            "positive numbers by names of the model's states and outputs", "correct the weights",
        )  # fmt: skip
    return Scaling(
        np.array([weights[n] for n in model.states]), np.array([noise[n] for n in model.outputs]) / np.sqrt(rate),
        np.full(model.B.shape[1], torque_rate), 10.0 / (fastest or 300.0),
    )  # fmt: skip


def _solve(
    model: LPV, polytope: Polytope, scaling: Scaling, gamma: float | None, slowest: float, fastest: float | None,
    scheduled: bool,
) -> tuple[Array, list[Array]]:  # fmt: skip
    """X and the scaled gains.

    Raises:
        DesignError: the solver finds none.
        UsageError: cvxpy is not installed.
    """
    try:
        import cvxpy as cp
    except ImportError:
        raise UsageError(
            "the LMI design needs cvxpy, which is not installed", "cvxpy and clarabel", "pip install 'codriver[lmi]'"
        ) from None

    n, p, T = len(model.states), len(model.outputs), scaling.time
    X = cp.Variable((n, n), symmetric=True)
    shared = cp.Variable((n, p))
    Lbar = [cp.Variable((n, p)) if scheduled else shared for _ in polytope.vertices]
    bar = cp.Variable() if gamma is None else cp.Constant(gamma**2 * (1 - 1e-6))
    limits = [X >> 1e-6 * np.eye(n)]
    for vertex, own in zip(polytope.vertices, Lbar, strict=True):
        A, P, C = scaling.of(vertex, model.B, model.C)
        M = X @ A - own @ C
        XS = cp.hstack([X @ P, -own])
        size = P.shape[1] + p
        whole = cp.bmat([[M + M.T + np.eye(n), XS], [XS.T, -bar * np.eye(size)]])
        limits += [whole << -1e-7 * np.eye(n + size), M + M.T + 2 * slowest * T * X << 0]
        if fastest is not None:
            limits.append(cp.bmat([[-fastest * T * X, M], [M.T, -fastest * T * X]]) << 0)
    problem = cp.Problem(cp.Minimize(bar if gamma is None else 0), limits)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # that a solution may be inaccurate: the certificate says so
            problem.solve(solver=cp.CLARABEL)
        status = problem.status
    except cp.error.SolverError as error:
        status = f"solver failed: {error}"
    if status not in ("optimal", "optimal_inaccurate") or X.value is None:
        wanted = "any gamma" if gamma is None else f"gamma = {gamma:g}"
        low, high = polytope.range
        raise DesignError(
            f"no observer with {wanted} from {low:g} to {high:g} m/s and poles in the region (solver: {status})",
            "inequalities that have a solution", "a larger gamma, a wider pole region or a narrower range of speed",
        )  # fmt: skip
    found = np.asarray((X.value + X.value.T) / 2)
    return found, [np.linalg.solve(found, np.asarray(own.value)) for own in Lbar]
