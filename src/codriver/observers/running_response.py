"""What the Kalman form buys and costs where its rows come at rates of their own.

With a row on every m-th tick only, P and K repeat after some ticks (the least common multiple), and the error of the
estimate goes on as

    e_k+1 = (I - K_k C) (F e_k + w) - K_k n_k

    delay    mean of the jerk's error in the steady state after a ramp of jerk of 1 m/s^4: w = [dt^3/6, dt^2/2, 0, dt]
    noise    root of the mean variance of the jerk's error, n_k white of variance 1 in one row

With both rows on every tick these are those of `response`, but for half a tick that the sampled filter is quicker.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import lcm

import numpy as np

from codriver.errors import UsageError
from codriver.models import intention_model
from codriver.observers.riccati import stationary_predicted, tick_map
from codriver.observers.scaled_gain import ScaledGain
from codriver.signals.signal import Array

_JERK = 3


@dataclass(frozen=True)
class RunningResponse:
    """Delay and noise of the jerk estimate.

    Attributes:
        delay: of slow changes of the jerk, s.
        noise: standard deviation of the jerk, m/s^3, per unit of white noise of the samples: of the accelerometer (m/s^2)
            and of the speed (m/s).
    """

    delay: float
    noise: tuple[float, float]

    def jerk_noise(self, sensors: tuple[float, float]) -> float:
        """Standard deviation of the jerk for standard deviations of the samples of accelerometer and speed, m/s^3."""
        return float(np.hypot(self.noise[0] * sensors[0], self.noise[1] * sensors[1]))


def running_response(design: ScaledGain, every: tuple[int, int] = (1, 1)) -> RunningResponse:
    """Delay and noise of the running Kalman form.

    Args:
        design: gains at one ell and tick.
        every: the accelerometer comes on every so manieth tick, and the speed.

    Raises:
        UsageError: a row comes less often than never.
    """
    from scipy.linalg import solve_discrete_lyapunov

    if min(every) < 1:
        raise UsageError(f"rows on every {every} ticks", "whole numbers of at least 1", "say 1 for a row on every tick")
    gains, dt = _periodic_gains(design, every), design.dt
    C, eye = intention_model().C, np.eye(4)
    steps = [(eye - K @ C) @ design.F for K in gains]
    ramp = np.array([dt**3 / 6, dt**2 / 2, 0.0, dt])
    pushes = [(eye - K @ C) @ ramp for K in gains]
    whole, push = eye, np.zeros(4)
    for step, add in zip(steps, pushes, strict=True):
        whole, push = step @ whole, step @ push + add
    error, late = np.linalg.solve(eye - whole, push), []
    for step, add in zip(steps, pushes, strict=True):
        error = step @ error + add
        late.append(error[_JERK])
    noise = []
    for row in (0, 1):
        spreads = [np.outer(K[:, row], K[:, row]) for K in gains]
        total = np.zeros((4, 4))
        for step, add in zip(steps, spreads, strict=True):
            total = step @ total @ step.T + add
        X, variances = solve_discrete_lyapunov(whole, total), []
        for step, add in zip(steps, spreads, strict=True):
            X = step @ X @ step.T + add
            variances.append(X[_JERK, _JERK])
        noise.append(float(np.sqrt(np.mean(variances))))
    return RunningResponse(float(np.mean(late)), (noise[0], noise[1]))


def _periodic_gains(design: ScaledGain, every: tuple[int, int]) -> list[Array]:
    """The gain of each tick of a period, shape (4, 2) each, 0 where a row does not come."""
    C, R, eye = intention_model().C, np.diag(design.Rd), np.eye(4)
    rows = [[row for row in (0, 1) if k % every[row] == 0] for k in range(lcm(*every))]
    predicted = stationary_predicted([tick_map(design.F, design.Qd, C[here], R[here]) for here in rows])
    gains = []
    for here in rows:
        H, K = C[here], np.zeros((4, 2))
        if here:
            K[:, here] = np.linalg.solve(H @ predicted @ H.T + np.diag(R[here]), H @ predicted).T
        left = eye - K @ C
        P = left @ predicted @ left.T + K @ design.Rd @ K.T
        predicted = design.F @ P @ design.F.T + design.Qd
        gains.append(K)
    return gains
