"""The alternatives: the same filter by filterpy, statsmodels, scipy and numpy.

Each function takes the design and gives work(y) -> x: y of shape (n, 2) holds accelerometer and speed, NaN where a row is
missing; x of shape (n, 4) the filtered states. All start where ours does: at the first rows, with a wide covariance.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from codriver.models import intention_model
from codriver.observers import ScaledGain
from codriver.observers.jerk_forms import WIDE_START

Work = Callable[[np.ndarray], np.ndarray]


def _start(design: ScaledGain, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.array([y[0, 1], 0.0, y[0, 0], 0.0]), WIDE_START * np.diag(np.diag(design.P))


def filterpy_filter(design: ScaledGain) -> Work:
    """filterpy's KalmanFilter, predict and update a sample; no rows may be missing."""
    from filterpy.kalman import KalmanFilter

    def work(y: np.ndarray) -> np.ndarray:
        kf = KalmanFilter(dim_x=4, dim_z=2)
        kf.F, kf.H, kf.Q, kf.R = design.F, intention_model().C, design.Qd, design.Rd
        x, kf.P = _start(design, y)
        kf.x = x.reshape(4, 1)
        out = np.empty((len(y), 4))
        for k in range(len(y)):
            if k:
                kf.predict()
            kf.update(y[k].reshape(2, 1))
            out[k] = kf.x[:, 0]
        return out

    return work


def filterpy_steady(design: ScaledGain) -> Work:
    """filterpy's KalmanFilter with the gain held, predict_steadystate and update_steadystate a sample."""
    from filterpy.kalman import KalmanFilter

    def work(y: np.ndarray) -> np.ndarray:
        kf = KalmanFilter(dim_x=4, dim_z=2)
        kf.F, kf.H, kf.K = design.F, intention_model().C, design.K
        kf.x = _start(design, y)[0].reshape(4, 1)
        out = np.empty((len(y), 4))
        for k in range(len(y)):
            if k:
                kf.predict_steadystate()
            kf.update_steadystate(y[k].reshape(2, 1))
            out[k] = kf.x[:, 0]
        return out

    return work


def statsmodels_filter(design: ScaledGain) -> Work:
    """statsmodels' compiled Kalman filter; single rows may be missing."""
    from statsmodels.tsa.statespace.kalman_filter import MEMORY_NO_SMOOTHING, KalmanFilter

    def work(y: np.ndarray) -> np.ndarray:
        kf = KalmanFilter(k_endog=2, k_states=4)
        kf.bind(np.asfortranarray(y.T))
        kf["design"], kf["transition"], kf["selection"] = intention_model().C, design.F, np.eye(4)
        kf["state_cov"], kf["obs_cov"] = design.Qd, design.Rd
        kf.initialize_known(*_start(design, y))
        kf.set_conserve_memory(MEMORY_NO_SMOOTHING)
        return kf.filter().filtered_state.T

    return work


def numpy_kalman(design: ScaledGain) -> Work:
    """The textbook's five lines on 4 x 4 matrices."""
    F, C, Q, R = design.F, intention_model().C, design.Qd, design.Rd

    def work(y: np.ndarray) -> np.ndarray:
        x, P = _start(design, y)
        out = np.empty((len(y), 4))
        for k in range(len(y)):
            if k:
                x, P = F @ x, F @ P @ F.T + Q
            K = P @ C.T @ np.linalg.inv(C @ P @ C.T + R)
            x = x + K @ (y[k] - C @ x)
            P = P - K @ C @ P
            out[k] = x
        return out

    return work


def _after_first(design: ScaledGain, y: np.ndarray) -> np.ndarray:
    """The state after the first sample's update with the constant gain."""
    x = _start(design, y)[0]
    return x + design.K @ (y[0] - intention_model().C @ x)


def numpy_constant(design: ScaledGain) -> Work:
    """x = (I - K C) F x + K y on 4 x 4 matrices."""
    K = design.K
    A = (np.eye(4) - K @ intention_model().C) @ design.F

    def work(y: np.ndarray) -> np.ndarray:
        x = _after_first(design, y)
        out = np.empty((len(y), 4))
        out[0] = x
        for k in range(1, len(y)):
            x = A @ x + K @ y[k]
            out[k] = x
        return out

    return work


def scipy_dlsim(design: ScaledGain) -> Work:
    """The same as a discrete system for scipy.signal.dlsim; no rows may be missing."""
    from scipy.signal import dlsim, dlti

    K = design.K
    A = (np.eye(4) - K @ intention_model().C) @ design.F
    # dlsim's x[k+1] = A x[k] + B u[k]: the rows go in one sample ahead.
    system = dlti(A, K, np.eye(4), np.zeros((4, 2)), dt=design.dt)

    def work(y: np.ndarray) -> np.ndarray:
        ahead = np.vstack([y[1:], y[-1:]])
        return dlsim(system, ahead, x0=_after_first(design, y))[1]

    return work
