"""The alternatives to the motorcycle's estimators: filterpy, and numpy as one writes it.

Each function gives work(rows) -> z: rows of shape (n, m), none missing, in the order of the channels; z the estimated states. All
take the same model, noise and start as ours. The model's transition is made anew for every tick's speed, by the same series.
"""

from __future__ import annotations

from collections.abc import Callable
from math import factorial

import numpy as np

from codriver.models.lpv import LPV
from codriver.models.motorcycle_lean import LeanParameters, lean_functions
from codriver.models.road_frame import by_turn
from codriver.observers import motorcycle_ekf as ekf
from codriver.observers import motorcycle_ekf_states as states
from codriver.observers import motorcycle_kalman as kalman
from codriver.observers.motorcycle_ekf_rows import sensor_function
from codriver.observers.motorcycle_lmi import MotorcycleLMI
from codriver.observers.sample_scatter import PRIOR
from codriver.observers.series import series

Work = Callable[[np.ndarray], np.ndarray]


def numpy_ts(design: MotorcycleLMI, parts: int, terms: int) -> Work:
    """The Takagi-Sugeno observer; a row is the five measurements of (21) and the speed.

    Args:
        design: the gains.
        parts, terms: of a tick's series.
    """
    model, dt = design.model, design.dt
    A0, A1, C = model.powers[0], model.powers[1], model.C
    h = dt / parts

    def work(rows: np.ndarray) -> np.ndarray:
        x, y, v = np.zeros(9), rows[:, :5], rows[:, 5]
        low, high = design.polytope.range
        out = np.empty((len(rows), 9))
        out[0] = x
        for k in range(1, len(rows)):
            share = (min(max(v[k], low), high) - low) / (high - low)
            L = (1 - share) * design.L[0] + share * design.L[1]
            M = A0 + v[k] * A1 - L @ C
            last = y[k - 1]
            rising = L @ ((y[k] - last) / dt)
            driven = L @ last
            for part in range(parts):
                # The rate, the rate's rate, then each derivative M times the last.
                term = M @ x + driven + rising * (part * h)
                total = x + h * term
                for n in range(2, terms + 1):
                    term = M @ term + rising if n == 2 else M @ term
                    total = total + term * (h**n / factorial(n))
                x = total
            out[k] = x
        return out

    return work


def _kalman_rows(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Steer, roll rate, W and 0; the speed. A row is steer, roll rate, yaw rate, speed."""
    turn = np.array([by_turn(float(v), float(r)).yaw_rate for v, r in zip(rows[:, 3], rows[:, 2], strict=True)])
    return np.column_stack([rows[:, :2], turn, np.zeros(len(rows))]), rows[:, 3]


def _scatter(var: np.ndarray, rows: np.ndarray, k: int, most: float) -> np.ndarray:
    """What the samples scatter by, learnt on."""
    bend = rows[k] - 2 * rows[k - 1] + rows[k - 2]
    return var + (bend**2 / 6 - var) / min(k + PRIOR, most)


def numpy_kalman(model: LPV, dt: float, terms: int) -> Work:
    """The linear Kalman filter, joint updates."""
    noise, eye = kalman.LinearNoise(), np.eye(9)
    Q, (C0, C1) = np.diag(noise.process() * dt), kalman.filter_rows(model)
    fixed = np.square([noise.encoder, noise.gyro, noise.turn, noise.balance]) / (noise.rate * dt)

    def work(rows: np.ndarray) -> np.ndarray:
        y, v = _kalman_rows(rows)
        x, P, var = np.zeros(9), np.diag(kalman.START**2), np.full(2, kalman.SCATTER["roll_rate"] ** 2)
        x[[0, 1, 3, 4]] = -v[0] * y[0, 2] / kalman.GRAVITY, y[0, 0], y[0, 2], y[0, 1]
        out = np.empty((len(rows), 9))
        for k in range(len(rows)):
            if k:
                A, C = model.A(v[k]), C0 + v[k] * C1
                F = eye + series(A, A, dt, terms)
                if k > 1:
                    var = _scatter(var, rows[:, 1:3], k, kalman.SCATTER_TIME / dt)
                x, P = F @ x, F @ P @ F.T + Q
                R = np.diag(fixed + np.array([0.0, *var, 0.0]))
                K = np.linalg.solve(C @ P @ C.T + R, C @ P).T
                x, P = x + K @ (y[k] - C @ x), (eye - K @ C) @ P
            out[k] = x
        return out

    return work


def filterpy_kalman(model: LPV, dt: float, terms: int) -> Work:
    """filterpy's KalmanFilter, F, H and R set anew for each sample."""
    from filterpy.kalman import KalmanFilter

    noise, eye = kalman.LinearNoise(), np.eye(9)
    C0, C1 = kalman.filter_rows(model)
    fixed = np.square([noise.encoder, noise.gyro, noise.turn, noise.balance]) / (noise.rate * dt)

    def work(rows: np.ndarray) -> np.ndarray:
        y, v = _kalman_rows(rows)
        kf, var = KalmanFilter(dim_x=9, dim_z=4), np.full(2, kalman.SCATTER["roll_rate"] ** 2)
        kf.x, kf.P, kf.Q = np.zeros((9, 1)), np.diag(kalman.START**2), np.diag(noise.process() * dt)
        kf.x[[0, 1, 3, 4], 0] = -v[0] * y[0, 2] / kalman.GRAVITY, y[0, 0], y[0, 2], y[0, 1]
        out = np.empty((len(rows), 9))
        for k in range(len(rows)):
            if k:
                A = model.A(v[k])
                kf.F, kf.H = eye + series(A, A, dt, terms), C0 + v[k] * C1
                if k > 1:
                    var = _scatter(var, rows[:, 1:3], k, kalman.SCATTER_TIME / dt)
                kf.R = np.diag(fixed + np.array([0.0, *var, 0.0]))
                kf.predict()
                kf.update(y[k].reshape(4, 1))
            out[k] = kf.x[:, 0]
        return out

    return work


def numpy_ekf(p: LeanParameters, dt: float, terms: int) -> Work:
    """The large-angle filter, joint updates; rates, Jacobian and rows by CasADi's functions, called a tick."""
    rates, linear = lean_functions(p)
    show, noise = sensor_function(p), states.EkfNoise()
    Q, floors = np.diag(noise.process() * dt), np.array(list(noise.floors(dt).values()))
    fade, decay = np.exp(-ekf.TRACKING * dt), np.zeros(states.N)
    decay[[ekf.MOMENT, ekf.PITCHING]] = -1 / states.MOMENT_TIME, -1 / states.PITCH_TIME
    share = p.sharp.load / (p.sharp.mass * p.sharp.g)

    def work(rows: np.ndarray) -> np.ndarray:
        y, speed = rows[:, :6], rows[:, 6]
        v, dv = speed[0], 0.0
        lean = np.arcsin((y[0, 3] - v * y[0, 2]) / p.sharp.g)
        turn = y[0, 2] / np.cos(lean)
        x, P, var = np.zeros(states.N), np.diag(np.square(states.START)), np.square(list(ekf.SCATTER.values()))
        x[[0, 1, 3, 4]] = lean, y[0, 5], turn, y[0, 0]
        x[6:8] = p.sharp.mass * v * turn * np.array([share, 1 - share])
        whole, out = np.zeros((states.N, states.N)), np.empty((len(rows), states.N))
        for k in range(len(rows)):
            if k:
                ahead = v + dt * dv
                e = speed[k] - ahead
                v, dv = ahead + (1 - fade**2) * e, dv + (1 - fade) ** 2 / dt * e
                if k > 1:
                    var = _scatter(var, y[:, :5], k, ekf.SCATTER_TIME / dt)
                f, A = linear(x[: ekf.LEAN], v, dv, np.sin(x[0]), np.cos(x[0]))
                whole[:] = np.diag(decay)
                whole[: ekf.MOVING, : ekf.LEAN] = A
                rate = decay * x
                rate[: ekf.MOVING] = np.array(f).ravel()
                F = np.eye(states.N) + series(whole, whole, dt, terms)
                x, P = x + series(whole, rate, dt, terms), F @ P @ F.T + Q
                S, C = np.sin(x[0]), np.cos(x[0])
                now = rates(x[: ekf.LEAN], v, dv, S, C)[2:5]
                expected, H, heave = (np.array(m) for m in show(x, now, np.array(A)[2:5], v, S, C))
                R = floors + np.append(var, 0.0)
                R[[0, 2]] += (noise.tilt * x[[3, 4]]) ** 2 * 2 * ekf.TILT_TIME / dt
                R[4] += float(noise.heave * heave[0, 0]) ** 2 * 2 * ekf.HEAVE_TIME / dt
                K = np.linalg.solve(H @ P @ H.T + np.diag(R), H @ P).T
                x, P = x + K @ (y[k] - expected.ravel()), (np.eye(states.N) - K @ H) @ P
            out[k] = x
        return out

    return work
