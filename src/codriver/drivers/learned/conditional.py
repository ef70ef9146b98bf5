"""The torque given the features, in each of several Gaussians of both.

    m_i(z) = mu_i^T + Sigma_i^Tz (Sigma_i^zz)^-1 (z - mu_i^z)                2019 eq. (22)
    s_i^2 = Sigma_i^TT - Sigma_i^Tz (Sigma_i^zz)^-1 Sigma_i^zT
    T = sum_i h_i m_i                                                        2019 eq. (23), (25)
    var T = sum_i h_i (s_i^2 + (m_i - T)^2)                                  law of total variance

(22) is printed as a probability; it is the mean. With Sigma = L L' of (z, T) and W = L^-1, the last row of W is
[-w', 1]/s: so the weights w of (22) and s come out of the factor without another inverse, and the leading block of W is that of z.

The weights h_i come from a prior p_i and the density of z, h_i ~ p_i exp(l_i(z) - max l(z)). The largest exponent is 0, so with
all p_i above 0 the sum is too: however far away z is (short of squares that overflow), h is that of the components nearest
to it, and T their linear forms.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import log, pi
from typing import Any

import numpy as np

from codriver.drivers.learned.gaussians import ROWS, Gaussians
from codriver.drivers.learned.regressor import State
from codriver.drivers.learned.rows import array
from codriver.kernel import Scalar, select, sqrt
from codriver.signals.signal import Array


@dataclass(frozen=True, eq=False)
class Conditional:
    """N Gaussians of features and torque, as a regression of the torque.

    Attributes:
        means: mu^z, shape (N, d).
        factors: W of Sigma^zz, shape (N, d, d).
        log_peaks: log densities at mu^z, shape (N,).
        offsets: mu^T, shape (N,).
        slopes: w, shape (N, d).
        variances: s^2, shape (N,).
    """

    means: Array
    factors: Array
    log_peaks: Array
    offsets: Array
    slopes: Array
    variances: Array

    @classmethod
    def of(cls, gaussians: Gaussians) -> Conditional:
        """Of Gaussians of (z, T), the torque last."""
        W = gaussians.factors
        last = W[:, -1, -1]
        # The peak of (z, T) is that of z times that of T given z.
        peaks = gaussians.log_peaks - np.log(last) + 0.5 * log(2 * pi)
        return cls(
            gaussians.means[:, :-1], np.ascontiguousarray(W[:, :-1, :-1]), peaks, gaussians.means[:, -1],
            -W[:, -1, :-1] / last[:, np.newaxis], 1.0 / last**2,
        )  # fmt: skip

    @classmethod
    def restored(cls, state: Mapping[str, Any]) -> Conditional:
        """From what `state` gave."""
        return cls(*(array(state, name) for name in cls.__dataclass_fields__))

    def state(self) -> State:
        """Its arrays by name."""
        return dict(vars(self))

    @property
    def features(self) -> int:
        """d."""
        return int(self.means.shape[1])

    def evaluated(self, X: Array) -> tuple[Array, Array]:
        """l and m of features (n, d), each of shape (n, N)."""
        N = self.offsets.size
        logs, m = np.empty((X.shape[0], N)), np.empty((X.shape[0], N))
        both = np.concatenate([self.factors, self.slopes[:, np.newaxis, :]], axis=1)
        for first in range(0, X.shape[0], ROWS):
            part = slice(first, first + ROWS)
            for i in range(N):
                e = (X[part] - self.means[i]) @ both[i].T
                m[part, i] = self.offsets[i] + e[:, -1]
                logs[part, i] = self.log_peaks[i] - 0.5 * np.einsum("ij,ij->i", e[:, :-1], e[:, :-1])
        return logs, m

    def torque(self, m: Array, h: Array) -> tuple[Array, Array]:
        """Mean and standard deviation, each of shape (n,), from m and weights h, both (n, N)."""
        mean = np.einsum("ij,ij->i", h, m)
        variance = h @ self.variances + np.einsum("ij,ij->i", h, np.square(m - mean[:, np.newaxis]))
        return mean, np.sqrt(variance)

    def torque_step(self, priors: Sequence[Scalar], z: Sequence[Scalar]) -> tuple[list[Scalar], Scalar, Scalar]:
        """h, mean and standard deviation on scalars, from the priors p."""
        import casadi

        logs: list[Scalar] = []
        m: list[Scalar] = []
        for i in range(self.offsets.size):
            off = [z_c - mean for z_c, mean in zip(z, self.means[i].tolist(), strict=True)]
            squares: Scalar = 0.0
            for r, row in enumerate(self.factors[i].tolist()):
                e = _dot(row[: r + 1], off)
                squares = squares + e * e
            logs.append(float(self.log_peaks[i]) - 0.5 * squares)
            m.append(float(self.offsets[i]) + _dot(self.slopes[i].tolist(), off))
        most = logs[0]
        for value in logs[1:]:
            most = select(value > most, value, most)
        shares = [p * casadi.exp(value - most) for p, value in zip(priors, logs, strict=True)]
        total = _sum(shares)
        h = [share / total for share in shares]
        mean = _sum([h_i * m_i for h_i, m_i in zip(h, m, strict=True)])
        variance = _sum(
            [
                h_i * (s2 + (m_i - mean) * (m_i - mean))
                for h_i, m_i, s2 in zip(h, m, self.variances.tolist(), strict=True)
            ]
        )
        return h, mean, sqrt(variance)


def _dot(weights: Sequence[float], values: Sequence[Scalar]) -> Scalar:
    """Sum of products; zip stops at the shorter."""
    return _sum([weight * value for weight, value in zip(weights, values, strict=False)])


def _sum(values: Sequence[Scalar]) -> Scalar:
    total = values[0]
    for value in values[1:]:
        total = total + value
    return total
