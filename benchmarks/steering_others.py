"""The alternatives to the joint filters of the steering wheel: filterpy, and numpy as one writes it.

Each function takes the settings (and the weights of the sigma points) and gives work(rows) -> z: rows of shape (n, 2) hold torque
and angle, none missing; z of shape (n, 4) the filtered states. The torque of a row acts until the next.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from codriver.identify.steering_joint import JointSettings
from codriver.identify.steering_ukf import Weights

Work = Callable[[np.ndarray], np.ndarray]
H = np.array([[1.0, 0.0, 0.0, 0.0]])


def _start(settings: JointSettings) -> tuple[np.ndarray, np.ndarray]:
    return np.array([*settings.start, *settings.guess]), np.diag(settings.start_variance)


def _moved(z: np.ndarray, dt: float, torque: float) -> np.ndarray:
    """Euler's step (77)."""
    return np.array([z[0] + dt * z[1], z[1] + dt * (torque - z[3] * z[1]) / z[2], z[2], z[3]])


def _jacobian(z: np.ndarray, dt: float, torque: float) -> np.ndarray:
    """Of `_moved`."""
    _, rate, J, b = z
    row = [0.0, 1.0 - dt * b / J, dt * (b * rate - torque) / J**2, -dt * rate / J]
    return np.array([[1.0, dt, 0.0, 0.0], row, [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])


def filterpy_ekf(settings: JointSettings) -> Work:
    """filterpy's ExtendedKalmanFilter, predict and update a sample."""
    from filterpy.kalman import ExtendedKalmanFilter

    class Wheel(ExtendedKalmanFilter):
        def predict_x(self, u: float = 0.0) -> None:
            self.x = _moved(self.x, settings.dt, u)

    def work(rows: np.ndarray) -> np.ndarray:
        kf = Wheel(dim_x=4, dim_z=1)
        kf.x, kf.P = _start(settings)
        kf.Q, kf.R = np.diag(settings.process), np.array([[settings.angle]])
        out = np.empty((len(rows), 4))
        for k in range(len(rows)):
            if k:
                kf.F = _jacobian(kf.x, settings.dt, rows[k - 1, 0])
                kf.predict(rows[k - 1, 0])
            kf.update(rows[k, 1:], lambda z: H, lambda z: z[:1])
            out[k] = kf.x
        return out

    return work


def filterpy_ukf(settings: JointSettings, alpha: float) -> Work:
    """filterpy's UnscentedKalmanFilter with MerweScaledSigmaPoints, predict and update a sample."""
    from filterpy.kalman import MerweScaledSigmaPoints, UnscentedKalmanFilter

    def work(rows: np.ndarray) -> np.ndarray:
        points = MerweScaledSigmaPoints(4, alpha=alpha, beta=2.0, kappa=0.0)
        kf = UnscentedKalmanFilter(4, 1, settings.dt, lambda z: z[:1], _moved, points)
        kf.x, kf.P = _start(settings)
        kf.Q, kf.R = np.diag(settings.process), np.array([[settings.angle]])
        kf.sigmas_f = points.sigma_points(kf.x, kf.P)
        out = np.empty((len(rows), 4))
        for k in range(len(rows)):
            if k:
                kf.predict(torque=rows[k - 1, 0])
            kf.update(rows[k, 1:])
            out[k] = kf.x
        return out

    return work


def numpy_ekf(settings: JointSettings) -> Work:
    """The textbook's lines on 4 x 4 matrices."""

    def work(rows: np.ndarray) -> np.ndarray:
        z, P = _start(settings)
        Q, out = np.diag(settings.process), np.empty((len(rows), 4))
        for k in range(len(rows)):
            if k:
                F = _jacobian(z, settings.dt, rows[k - 1, 0])
                z, P = _moved(z, settings.dt, rows[k - 1, 0]), F @ P @ F.T + Q
            z, P = _updated(z, P, rows[k, 1], settings.angle)
            out[k] = z
        return out

    return work


def numpy_ukf(settings: JointSettings, weights: Weights) -> Work:
    """The textbook's lines, all points moved at once."""
    w, dt = weights, settings.dt
    Wm, Wc = np.array([w.mean] + 8 * [w.other]), np.array([w.covariance] + 8 * [w.other])

    def work(rows: np.ndarray) -> np.ndarray:
        z, P = _start(settings)
        Q, out = np.diag(settings.process), np.empty((len(rows), 4))
        for k in range(len(rows)):
            if k:
                root = w.spread * np.linalg.cholesky(P).T
                X = np.vstack([z, z + root, z - root])
                rate = X[:, 1].copy()
                X[:, 0] += dt * rate
                X[:, 1] += dt * (rows[k - 1, 0] - X[:, 3] * rate) / X[:, 2]
                z = Wm @ X
                P = (X - z).T * Wc @ (X - z) + Q
            z, P = _updated(z, P, rows[k, 1], settings.angle)
            out[k] = z
        return out

    return work


def _updated(z: np.ndarray, P: np.ndarray, angle: float, R: float) -> tuple[np.ndarray, np.ndarray]:
    """z and P with the angle taken."""
    K = P[:, 0] / (P[0, 0] + R)
    return z + K * (angle - z[0]), P - np.outer(K, P[0])
