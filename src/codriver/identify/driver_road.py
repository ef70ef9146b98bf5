"""The road as instrument: what of a driver's torque answers to the road, and not to his own noise come back through the car.

    u^ = sum over lags of c_j rho(t - lag_j),  lags -PREVIEW .. PAST s            what he saw, as far as the road makes it

theta_near, theta_far and delta_s hold the driver's own noise, since he sits in the loop, and so do the car's offset and heading:
least squares of the torque is biased, however long the drive, unless the noise is modelled right. The road's curvature knows
nothing of that noise. u^ is a projection on it, each block's by coefficients from the other blocks, so that it does not take up
noise (split-sample instruments: Angrist, Krueger 1995, doi:10.1080/07350015.1995.10524589). The price is precision: what his noise
would tell of him is not used.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from codriver.identify.driver_record import PREVIEW, DriverRecord
from codriver.identify.driver_residual import thinning

PAST = 4.0  # s
_LAG = 0.2  # s, between lags
_BLOCKS = 8


def by_the_road(record: DriverRecord) -> DriverRecord:
    """The record with what the driver saw replaced by what the road makes of it."""
    dt, n, q = record.dt, record.torque.size, max(round(_LAG / record.dt), 1)
    ahead, past = round(PREVIEW / _LAG) * q, round(PAST / _LAG) * q
    lags = np.arange(-ahead, past + 1, q)
    smooth = np.convolve(record.curvature, np.bartlett(2 * q + 1) / q, mode="same")
    rows = np.arange(max(record.first, past), min(record.last, n - ahead), thinning(dt))
    X = np.column_stack([*(smooth[rows - lag] for lag in lags), np.ones(rows.size)])
    edges = np.linspace(0, rows.size, _BLOCKS + 1).astype(int)
    saw = np.stack([record.near, record.far, record.angle, record.offset, record.heading], axis=1)
    XX = np.array([X[i:k].T @ X[i:k] for i, k in pairwise(edges)])
    Xu = np.array([X[i:k].T @ saw[rows[i:k]] for i, k in pairwise(edges)])
    made = np.empty_like(saw)
    for block in range(_BLOCKS):
        A = XX.sum(axis=0) - XX[block]
        c = np.linalg.solve(A + 1e-9 * np.trace(A) / A.shape[0] * np.eye(A.shape[0]), Xu.sum(axis=0) - Xu[block])
        kernel = np.zeros((ahead + past + 1, saw.shape[1]))
        kernel[lags + ahead] = c[:-1]
        first = 0 if block == 0 else rows[edges[block]]
        last = n if block == _BLOCKS - 1 else rows[edges[block + 1]]
        for column in range(saw.shape[1]):
            made[first:last, column] = (
                np.convolve(smooth, kernel[:, column])[ahead : ahead + n][first:last] + c[-1, column]
            )
    return replace(record, **dict(zip(("near", "far", "angle", "offset", "heading"), made.T, strict=True)))
