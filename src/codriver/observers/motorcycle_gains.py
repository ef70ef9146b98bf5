"""Noise of the motorcycle's linear model, and the stationary Kalman gains over the speed that go with it.

    K(v) = P(v) C(v)' (C P C' + R)^-1,   P(v) the stationary covariance before the update,  C(v) = C_0 + v C_1

K is solved at `NODES` speeds and straight between them: K(v) = sum_k s_k(v) K_k, with hats s_k that add up to 1. The
certificate says that all poles of F(v) (1 - K(v) C(v)) lie inside the unit circle at `GRID` speeds, each kept; a fast change of
speed is not covered.

Rows are steer angle, roll rate, yaw rate about the road's normal, and the balance of the turn; see `motorcycle_kalman`.

Damon, Ichalal, Arioui 2018; Kalman 1960, doi:10.1115/1.3662552.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from codriver.errors import DesignError
from codriver.kernel import Scalar, select
from codriver.models.lpv import LPV
from codriver.models.state_space import matrix_exponential
from codriver.observers.observer import Certificate
from codriver.observers.riccati import stationary_predicted, tick_map
from codriver.signals.signal import Array

ROWS = {"steer_angle": "rad", "roll_rate": "rad/s", "yaw_rate": "rad/s", "balance": "m/s^2"}  # of the model
NODES, GRID = 9, 41
# Sizes of the states, in which matrices compare.
SIZES = np.array([0.1, 0.01, 0.5, 0.2, 0.2, 0.2, 300.0, 300.0, 10.0])
UNPROVEN = Certificate(False, (), np.empty(0, complex), np.empty(0, complex), 0.0)


@dataclass(frozen=True)
class LinearNoise:
    """What the linear model and its sensors leave out.

    Attributes:
        lateral, yaw, roll, steer: white noise of the accelerations, m/s^2, rad/s^2 per sqrt(Hz).
        tyre: of the tyre forces' rates, N/s per sqrt(Hz).
        torque: of the rider's torque's rate, N m/s per sqrt(Hz).
        encoder, gyro, turn, balance: sd of a sample of the rows: rad, rad/s, rad/s, m/s^2.
        sample: sd of a gyroscope's sample where it is not learnt, rad/s.
        share: systematic error of the roll in parts of it.
        bias: of the gyroscope, rad/s, which nothing here finds.
        rate: at which samples err independently, Hz; the sd of a row at another tick is that times sqrt(1 / (rate dt)).
    """

    lateral: float = 0.15
    yaw: float = 0.15
    roll: float = 0.15
    steer: float = 1.0
    tyre: float = 800.0
    torque: float = 60.0
    encoder: float = 0.001
    gyro: float = 0.005
    turn: float = 0.01
    balance: float = 0.3
    sample: float = 0.015
    share: float = 0.06
    bias: float = 0.006
    rate: float = 100.0

    def process(self) -> Array:
        """Intensities of the states, shape (9,)."""
        return np.square([0, 0, self.lateral, self.yaw, self.roll, self.steer, self.tyre, self.tyre, self.torque])

    def rows(self, dt: float, scatter: Sequence[Scalar] | None = None) -> list[Scalar]:
        """Variances of a tick's rows.

        Args:
            dt: tick, s.
            scatter: variances learnt of the samples of roll rate and yaw rate; None for `sample`.
        """
        share = 1 / (self.rate * dt)
        more = (self.sample**2 * share,) * 2 if scatter is None else scatter
        own = [value**2 * share for value in (self.encoder, self.gyro, self.turn, self.balance)]
        return [own[0], own[1] + more[0], own[2] + more[1], own[3]]


@dataclass(frozen=True, eq=False)
class MotorcycleGains:
    """The stationary gains over the speed.

    Attributes:
        speeds: nodes, m/s, shape (m,).
        K: gains, shape (m, 9, 4).
        variances: of the states after the update, shape (m, 9).
        innovations: variances of the rows, shape (m, 4).
        certificate: poles at `GRID` speeds.
    """

    speeds: Array
    K: Array
    variances: Array
    innovations: Array
    certificate: Certificate

    def at(self, v: float) -> Array:
        """K(v), shape (9, 4); v clipped to the nodes."""
        return np.tensordot(_shares(self.speeds, float(np.clip(v, self.speeds[0], self.speeds[-1]))), self.K, 1)


def filter_rows(model: LPV) -> tuple[Array, Array]:
    """C_0 and C_1 of C(v) = C_0 + v C_1, shape (4, 9) each.

    Args:
        model: `motorcycle_model(p).with_walking_inputs()`.
    """
    C0, C1 = np.zeros((4, 9)), np.zeros((4, 9))
    for k, row in enumerate((*list(ROWS)[:3], "lateral_acceleration")):
        C0[k] = model.C[model.outputs.index(row)]
    C1[3, model.states.index("yaw_rate")] = -1
    return C0, C1


def design_motorcycle_gains(
    model: LPV, dt: float, low: float, high: float, noise: LinearNoise | None = None
) -> MotorcycleGains:
    """The stationary gains, certified.

    Args:
        model: `motorcycle_model(p).with_walking_inputs()`.
        dt: tick, s.
        low, high: range of speed, m/s.
        noise: of model and sensors.

    Raises:
        DesignError: there is no stationary covariance, or a pole between the nodes is not inside the unit circle.
    """
    noise = noise or LinearNoise()
    Q, R = np.diag(noise.process() * dt), np.array(noise.rows(dt))
    C0, C1 = filter_rows(model)
    speeds = np.linspace(low, high, NODES)
    gains, variances, innovations = [], [], []
    W = SIZES
    for v in speeds:
        # In units in which the states compare.
        F, c = matrix_exponential(model.A(v) * W / W[:, None] * dt), (C0 + v * C1) * W
        P = stationary_predicted([tick_map(F, Q / W / W[:, None], c, R)])
        S = c @ P @ c.T + np.diag(R)
        K = np.linalg.solve(S, c @ P).T
        gains.append(K * W[:, None])
        variances.append(np.diag(P - K @ c @ P) * W**2)
        innovations.append(np.diag(S))
    made = MotorcycleGains(speeds, np.array(gains), np.array(variances), np.array(innovations), UNPROVEN)
    poles = []
    for v in np.linspace(low, high, GRID):
        closed = matrix_exponential(model.A(v) * dt) @ (np.eye(9) - made.at(v) @ (C0 + v * C1))
        poles.append(np.linalg.eigvals(closed).astype(complex))
    every = np.concatenate(poles)
    worst = float(np.abs(every).max())
    if not worst < 1:
        raise DesignError(
            f"the gains between {NODES} speeds from {low:g} to {high:g} m/s leave a pole of {worst:.4g}", "poles inside 1",
            "a narrower range of speed",
        )  # fmt: skip
    slowest = -np.log(worst) / dt
    claims = (
        f"at {GRID} speeds from {low:g} to {high:g} m/s, each kept, all poles of F (1 - K C) lie within {worst:.5g}",
        f"errors decay with {slowest:.3g} 1/s or quicker there",
    )
    certificate = Certificate(True, claims, np.log(every) / dt, every, float(slowest))
    return MotorcycleGains(made.speeds, made.K, made.variances, made.innovations, certificate)


def node_shares(nodes: Array, v: Scalar) -> list[Scalar]:
    """Weights of the nodes for a value straight between them; exact sums to 1."""
    gap = float(nodes[1] - nodes[0])
    place = (v - float(nodes[0])) * (1 / gap)
    shares = []
    for k in range(len(nodes)):
        off = place - float(k)
        size = select(off < 0, -off, off)
        shares.append(select(size < 1, 1 - size, 0.0))
    return shares


def _shares(nodes: Array, v: float) -> Array:
    """The same in numbers."""
    return np.array([float(share) for share in node_shares(nodes, v)])
