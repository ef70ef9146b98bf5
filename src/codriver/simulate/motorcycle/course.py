"""A way on the ground by arc length: curvature, heading and place, and where on it something is.

    psi' = kappa(s),   x' = cos psi,   y' = sin psi;     s, e of a point: (p - p(s)) . t(s) = 0,   e = (p - p(s)) . n(s)

It may cross itself and close; beyond its end it runs straight on. Left is positive.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import cos, floor, sin

import numpy as np

from codriver.signals.signal import Array

STEP = 0.25  # m between the points that are kept, about


@dataclass(frozen=True, eq=False)
class Course:
    """A way.

    Attributes:
        step: along the way from a point to the next, m.
        place: the points, m, shape (n, 2).
        heading: there, rad.
        curvature: there, 1/m, to the left.
    """

    step: float
    place: Array
    heading: Array
    curvature: Array

    @property
    def length(self) -> float:
        """m."""
        return self.step * (len(self.heading) - 1)

    def at(self, distance: float) -> tuple[float, float, float, float]:
        """x, y, m, heading, rad, and curvature, 1/m.

        Args:
            distance: s, m.
        """
        points = self._points
        places = distance / self.step
        k = min(max(floor(places), 0), len(points) - 2)
        share = min(max(places - k, 0.0), 1.0)
        over = (places - k - share) * self.step  # outside of the course
        x, y, heading, bend = (a + share * (b - a) for a, b in zip(points[k], points[k + 1], strict=True))
        return x + over * cos(heading), y + over * sin(heading), heading, 0.0 if over else bend

    @cached_property
    def _points(self) -> list[tuple[float, float, float, float]]:
        """As Python's own numbers, which are faster one by one."""
        x, y = self.place.T.tolist()
        return list(zip(x, y, self.heading.tolist(), self.curvature.tolist(), strict=True))

    def curvature_at(self, distance: float) -> float:
        """Curvature, 1/m.

        Args:
            distance: s, m.
        """
        return self.at(distance)[3]

    def locate(self, x: float, y: float, near: float) -> tuple[float, float]:
        """Distance along the way of the point that is abreast, m, and offset to the left of it, m.

        Args:
            x, y: m.
            near: distance to search from, m.
        """
        distance, offset = near, 0.0
        for _ in range(3):
            px, py, heading, bend = self.at(distance)
            c, s = cos(heading), sin(heading)
            offset = c * (y - py) - s * (x - px)
            along = c * (x - px) + s * (y - py)
            distance += along / max(1 - bend * offset, 0.2)
            if abs(along) < 1e-6:
                break
        return distance, offset

    def offsets(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Distance and offset of the points of a way ridden from the start, m, each of shape (n,).

        Args:
            x, y: m, shape (n,).
        """
        found = np.empty((len(x), 2))
        near = 0.0
        for i, (px, py) in enumerate(zip(x.tolist(), y.tolist(), strict=True)):
            found[i] = near, _ = self.locate(px, py, near)
        return found[:, 0], found[:, 1]


def by_curvature(curvature: Callable[[Array], Array], length: float) -> Course:
    """A course from the origin along x, by the mid-point rule.

    Args:
        curvature: 1/m, to the left, against distance, m; of arrays.
        length: m.
    """
    count = round(length / STEP)
    step = length / count
    distance = step * np.arange(count + 1, dtype=np.float64)
    turned = step * curvature(distance[:-1] + step / 2)
    heading = np.concatenate([[0.0], np.cumsum(turned)])
    middle = (heading[1:] + heading[:-1]) / 2
    # the chord of an arc is shorter than the arc
    steps = step * np.sinc(turned / 2 / np.pi)[:, None] * np.column_stack([np.cos(middle), np.sin(middle)])
    return Course(step, np.vstack([[0.0, 0.0], np.cumsum(steps, axis=0)]), heading, curvature(distance))


def by_place(place: Callable[[float], float], length: float) -> Course:
    """A course whose lateral place is a function of the forward one.

    Args:
        place: y, m, of x, m; with a second derivative.
        length: in x, m.
    """
    fine = STEP / 2
    x = fine * np.arange(-2, round(length / fine) + 3)
    y = np.array([place(value) for value in x.tolist()])
    slope = (y[2:] - y[:-2]) / (2 * fine)
    bend = (y[2:] - 2 * y[1:-1] + y[:-2]) / fine**2 / (1 + slope**2) ** 1.5
    x, y = x[1:-1], y[1:-1]
    run = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    run -= run[1]  # x = 0 is the second point
    distance = STEP * np.arange(int(run[-1] / STEP) + 1)
    columns = [np.interp(distance, run, values) for values in (x, y, np.arctan(slope), bend)]
    return Course(STEP, np.column_stack(columns[:2]), columns[2], columns[3])
