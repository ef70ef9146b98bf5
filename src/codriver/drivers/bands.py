"""Speed bands: town, country road, motorway.

A person drives otherwise in a town than on a motorway, and a log holds as much of each as the route had. So a style is
measured band by band, and bands are weighed on purpose (`scale.py`), not by the route's mixture.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from codriver.signals.signal import Array

KMH = 1 / 3.6


@dataclass(frozen=True)
class Band:
    """Speeds from `low` to `high` (m/s, the latter excluded)."""

    name: str
    low: float
    high: float

    @property
    def words(self) -> str:
        """The speeds, as people say them."""
        low, high = self.low / KMH, self.high / KMH
        if self.low == 0.0:
            return f"below {high:.0f} km/h"
        return f"above {low:.0f} km/h" if not np.isfinite(high) else f"{low:.0f} to {high:.0f} km/h"


BANDS = (
    Band("urban", 0.0, 55 * KMH),
    Band("extra-urban", 55 * KMH, 95 * KMH),
    Band("motorway", 95 * KMH, float("inf")),
)


def band_of(speed: Array) -> npt.NDArray[np.intp]:
    """Index of the band of each speed (m/s), shape of `speed`; the sign does not matter."""
    return np.searchsorted(np.array([band.low for band in BANDS[1:]]), np.abs(speed), side="right")
