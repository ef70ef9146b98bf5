"""The smoothers over a drive of 42 minutes, and the likelihood that tuning asks for: against numpy, filterpy and statsmodels.

Ours is the whole call: sampling the log, compiling, filter and passes. The alternatives get arrays of rows on ticks, filter and
smooth them with the same model and start, and are compared with our numbers before they are timed. What is slow and steady is
measured on a part and scaled; the notes say so.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from batch import DT, agree, drive
from measure import Row, Timing, compared, duration, measure
from others import _start

import codriver as cd
from codriver.models import intention_model
from codriver.observers import ScaledGain, design_scaled_gain
from codriver.offline import smooth
from codriver.tune import Likelihood

COUNT = 252_000  # 42 minutes at 100 Hz
NAMES = ("longitudinal_speed", "longitudinal_acceleration", "acceleration_offset", "longitudinal_jerk")
ROWS = ("longitudinal_acceleration", "longitudinal_speed")


def log_and_rows(count: int, *, half_speed: bool = False) -> tuple[cd.Log, np.ndarray]:
    """A drive as a log, and its rows on ticks, NaN where there is none."""
    grid = drive(count, half_speed=half_speed)
    y = np.column_stack([np.where(grid.fresh[name], grid.values[name], np.nan) for name in ROWS])
    signals = [cd.Signal(name, grid.time[grid.fresh[name]], grid.values[name][grid.fresh[name]], "") for name in ROWS]
    return cd.Log.of(signals), y


def numpy_rts(design: ScaledGain, y: np.ndarray) -> np.ndarray:
    """The textbook's filter and smoother on 4 x 4 matrices."""
    F, C, Q, R = design.F, intention_model().C, design.Qd, design.Rd
    x, P = _start(design, y)
    n = len(y)
    xs, Ps, ahead, Ahead = (np.empty(shape) for shape in ((n, 4), (n, 4, 4), (n, 4), (n, 4, 4)))
    for k in range(n):
        if k:
            x, P = F @ x, F @ P @ F.T + Q
        ahead[k], Ahead[k] = x, P
        K = P @ C.T @ np.linalg.inv(C @ P @ C.T + R)
        x, P = x + K @ (y[k] - C @ x), P - K @ C @ P
        xs[k], Ps[k] = x, P
    for k in range(n - 2, -1, -1):
        G = Ps[k] @ F.T @ np.linalg.inv(Ahead[k + 1])
        xs[k] += G @ (xs[k + 1] - ahead[k + 1])
        Ps[k] += G @ (Ps[k + 1] - Ahead[k + 1]) @ G.T
    return xs


def filterpy_rts(design: ScaledGain, y: np.ndarray) -> np.ndarray:
    """filterpy's batch_filter and rts_smoother."""
    from filterpy.kalman import KalmanFilter

    kf = KalmanFilter(dim_x=4, dim_z=2)
    kf.F, kf.H, kf.Q, kf.R = design.F, intention_model().C, design.Qd, design.Rd
    x, kf.P = _start(design, y)
    kf.x = x.reshape(4, 1)
    kf.update(y[0].reshape(2, 1))
    first, first_P = kf.x.copy(), kf.P.copy()
    means, covariances, _, _ = kf.batch_filter(y[1:, :, None])
    means = np.concatenate([first[None], means])
    return kf.rts_smoother(means, np.concatenate([first_P[None], covariances]))[0][:, :, 0]


def statsmodels_smoother(design: ScaledGain, y: np.ndarray) -> np.ndarray:
    """statsmodels' compiled smoother; single rows may be missing."""
    from statsmodels.tsa.statespace.kalman_smoother import SMOOTHER_STATE, KalmanSmoother

    kf = KalmanSmoother(k_endog=2, k_states=4)
    _fill(kf, design, y)
    return kf.smooth(smoother_output=SMOOTHER_STATE).smoothed_state.T


def statsmodels_likelihood(design: ScaledGain, y: np.ndarray) -> float:
    """statsmodels' log likelihood."""
    from statsmodels.tsa.statespace.kalman_filter import MEMORY_CONSERVE, KalmanFilter

    kf = KalmanFilter(k_endog=2, k_states=4)
    _fill(kf, design, y)
    kf.set_conserve_memory(MEMORY_CONSERVE)
    return float(kf.loglike())


def _fill(kf, design: ScaledGain, y: np.ndarray) -> None:
    kf.bind(np.asfortranarray(y.T))
    kf["design"], kf["transition"], kf["selection"] = intention_model().C, design.F, np.eye(4)
    kf["state_cov"], kf["obs_cov"] = design.Qd, design.Rd
    kf.initialize_known(*_start(design, y))


def run(quick: bool = False) -> Iterator[Row]:
    """All rows."""
    count = 20_000 if quick else COUNT
    design = design_scaled_gain("bisoffi2017", DT)
    others: list[tuple[str, Callable[[ScaledGain, np.ndarray], np.ndarray], int, bool]] = [
        ("numpy loop", numpy_rts, 10_000, False),
        ("filterpy", filterpy_rts, 10_000, False),
        ("statsmodels", statsmodels_smoother, 50_000, False),
        ("statsmodels", statsmodels_smoother, 50_000, True),
    ]
    for name, work, part, half_speed in others:
        part = min(part, count)
        log, _ = log_and_rows(count, half_speed=half_speed)
        short, y = log_and_rows(part, half_speed=half_speed)
        note = agree(states(smooth(short, "kinematic", dt=DT)), work(design, y), 1e-6)
        ours = measure(lambda log=log: smooth(log, "kinematic", dt=DT))
        theirs = measure(lambda work=work, y=y: work(design, y), 2)
        what = f"fixed-interval smoother, {count} samples" + (", every second speed missing" if half_speed else "")
        yield _row(
            what, ours, name, theirs.best * count / part, f"{note}; {name} measured on {part} samples and scaled"
        )
    log, y = log_and_rows(count)
    for lag in (0.5, 2.0):
        took = measure(lambda lag=lag: smooth(log, "kinematic", dt=DT, lag=lag))
        yield Row(
            f"fixed-lag smoother, {lag:g} s, {count} samples",
            f"{duration(took.best)} (+{took.spread})",
            note="the whole call",
        )
    likelihood = Likelihood([cd.compile(cd.build("kinematic", dt=DT)).run(log)], every_row=True)
    preset = cd.observers.PRESETS["bisoffi2017"]
    ours, part = measure(lambda: likelihood.at(preset, 2.0)), min(50_000, count)
    theirs = measure(lambda: statsmodels_likelihood(design, y[:part]), 3)
    yield _row(
        f"one likelihood for tuning, {count} samples", ours, "statsmodels", theirs.best * count / part,
        f"the common factor at its best included; statsmodels measured on {part} samples and scaled",
    )  # fmt: skip


def states(estimate: cd.Estimate) -> np.ndarray:
    """The four estimates, shape (n, 4)."""
    return np.column_stack([estimate.columns[name] for name in NAMES])


def _row(what: str, ours: Timing, name: str, other: float, note: str) -> Row:
    return compared(what, ours.best, name, other, note, spread=ours.spread)
