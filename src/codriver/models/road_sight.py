"""Where a driver sees points of the path ahead: the perception of the two-point models.

    psi' = r - v rho(s)                                         heading error, rad
    y' = v (psi + beta)                                         offset of the centre of mass from the path, m
    theta(l) = bend(s, l) - y / l - psi                         direction of the point l ahead on the path, rad
    bend(s, l) = 1/l int_0^l (l - u) rho(s + u) du              = l rho / 2 where the curvature rho is constant

v, speed, m/s; beta, sideslip, rad; r, yaw rate, rad/s; rho, curvature of the path, 1/m, positive to the left like all angles;
s, distance along the path, m. Small angles, and a lens at the centre of mass. From rho, beta and r in, theta_near and theta_far
come out, as in Okamoto, Tsiotras 2019 (Robotics and Autonomous Systems), fig. 1; the two points are those of Salvucci, Gray 2004,
doi:10.1068/p5343. With l theta = Y the first three lines are Y' = v E - v beta - l r, E' = v rho(s + l) - r, the look-ahead
equations of lane keeping.

With C = int rho ds and D = int C ds, bend(s, l) = (D(s + l) - D(s)) / l - C(s): one table serves all distances.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from codriver.signals.signal import Array


@dataclass(frozen=True, eq=False)
class PathAhead:
    """A path's curvature, integrated twice.

    Attributes:
        distance: s, m, rising, shape (n,).
        heading: C, rad, at those distances.
        lateral: D, m.
        curvature: rho, 1/m; straight between the distances.
    """

    distance: Array
    heading: Array
    lateral: Array
    curvature: Array

    @classmethod
    def of(cls, distance: Array, curvature: Array) -> PathAhead:
        """Integrate a curvature that is straight between samples; exact.

        Args:
            distance: m, rising strictly, shape (n,), n at least 2.
            curvature: 1/m, shape (n,).

        Raises:
            ValueError: shapes do not match, or the distances do not rise.
        """
        if distance.ndim != 1 or distance.shape != curvature.shape or distance.size < 2:
            raise ValueError(
                f"distance {distance.shape} and curvature {curvature.shape}; they must be (n,), n at least 2"
            )
        ds = np.diff(distance)
        if not (ds > 0).all():
            raise ValueError("the distances do not rise; a path ahead needs a car that moves forward")
        first, second = curvature[:-1], curvature[1:]
        C = np.concatenate([[0.0], np.cumsum(ds * (first + second) / 2)])
        D = np.concatenate([[0.0], np.cumsum(ds * C[:-1] + ds * ds * (2 * first + second) / 6)])
        return cls(distance, C, D, curvature)

    def at(self, distance: Array) -> tuple[Array, Array]:
        """C and D at any distances; beyond the ends the last curvature goes on."""
        k = np.clip(np.searchsorted(self.distance, distance, side="right") - 1, 0, self.distance.size - 1)
        ahead = distance - self.distance[k]
        length = np.append(np.diff(self.distance), np.inf)[k]
        slope = np.append(np.diff(self.curvature), 0.0)[k] / np.where(np.isfinite(length), length, 1.0)
        rho, C = self.curvature[k], self.heading[k]
        lateral = self.lateral[k] + ahead * C + ahead**2 * (rho / 2 + ahead * slope / 6)
        return C + ahead * (rho + ahead * slope / 2), lateral

    def bend(self, distance: Array, ahead: float) -> Array:
        """Direction of the point `ahead` m on, seen from a car that goes along the path, rad.

        Args:
            distance: where the car is, m.
            ahead: l, m, positive.
        """
        heading, lateral = self.at(distance)
        return np.asarray((self.at(distance + ahead)[1] - lateral) / ahead - heading)


def path_errors(time: Array, speed: Array, curvature: Array, sideslip: Array, yaw_rate: Array) -> tuple[Array, Array]:
    """Offset, m, and heading error, rad, from what a car measures, both 0 at the start: trapezoidal sums.

    Errors of the yaw rate are integrated twice, so the result drifts: it is good for some seconds, and for fits behind a high-pass.

    Args:
        time: s, shape (n,); the others too: m/s, 1/m, rad, rad/s.
    """
    heading = _integral(time, yaw_rate - speed * curvature)
    return _integral(time, speed * (heading + sideslip)), heading


def _integral(time: Array, values: Array) -> Array:
    return np.concatenate([[0.0], np.cumsum(np.diff(time) * (values[1:] + values[:-1]) / 2)])
