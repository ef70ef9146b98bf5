"""A solid made of parts, and what is left of it when parts are taken out: the inertia by Huygens and Steiner.

    I = sum I_i + m_i (d_i . d_i - d_i d_i^T),   d_i from the whole's mass centre

So a rider or a wheel becomes a body of its own, and with all at its place the machine is Sharp's as before.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from codriver.signals.signal import Array


@dataclass(frozen=True, eq=False)
class Solid:
    """A rigid body.

    Attributes:
        mass: kg.
        centre: m, shape (3,).
        inertia: about its centre, kg m^2, shape (3, 3).
    """

    mass: float
    centre: Array
    inertia: Array

    def about(self, point: Array) -> Array:
        """Inertia about a point, kg m^2, shape (3, 3).

        Args:
            point: m, shape (3,).
        """
        d = self.centre - point
        return self.inertia + self.mass * (d @ d * np.eye(3) - np.outer(d, d))


def solid(mass: float, centre: Sequence[float], inertia: Array | Sequence[float]) -> Solid:
    """A body of a mass, a centre and an inertia.

    Args:
        mass: kg.
        centre: m.
        inertia: kg m^2, shape (3, 3), or its diagonal.
    """
    matrix = np.asarray(inertia, dtype=np.float64)
    return Solid(mass, np.asarray(centre, dtype=np.float64), np.diag(matrix) if matrix.ndim == 1 else matrix)


def without(whole: Solid, parts: Sequence[Solid]) -> Solid:
    """What is left when parts are taken out.

    Args:
        whole: body.
        parts: in it.

    Raises:
        ValueError: what is left could not be a body: its mass or a principal inertia is not positive.
    """
    mass = whole.mass - sum(part.mass for part in parts)
    moment = whole.mass * whole.centre - sum((part.mass * part.centre for part in parts), np.zeros(3))
    centre = moment / mass
    there = Solid(mass, centre, np.zeros((3, 3)))
    inertia = whole.inertia - sum((part.about(whole.centre) for part in parts), np.zeros((3, 3)))
    left = Solid(mass, centre, inertia - there.about(whole.centre))
    if not mass > 0 or not np.linalg.eigvalsh(left.inertia).min() > 0:
        raise ValueError(f"parts of {whole.mass - mass:g} kg leave {mass:g} kg with inertia {np.diag(left.inertia)}")
    return left
