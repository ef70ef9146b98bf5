"""How often per kilometre: a count with an interval that is honest for bunches.

Exact for Poisson counts n over d km (Garwood 1936, doi:10.1093/biomet/28.3-4.437):

    chi2_{0.025}(2 n) / (2 d)   to   chi2_{0.975}(2 n + 2) / (2 d).

Bursts come in bunches (a junction) and then not for a while, so their counts scatter more. The dispersion

    phi = max(1, 1/(B - 1) sum (n_b - r d_b)^2 / (r d_b)),      r = n / d,      over B blocks with d_b > 0,

says how much more (quasi-Poisson: Wedderburn 1974, doi:10.1093/biomet/61.3.439); the interval is that of n / phi counts over
d / phi km.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from codriver.drivers.resampling import LEVEL
from codriver.signals.signal import Array


@dataclass(frozen=True)
class Rate:
    """A count over a distance.

    Attributes:
        count: events.
        kilometres: d.
        dispersion: phi; 1 for Poisson counts, and where there are too few blocks to tell.
        low, high: 95 % interval of the rate, 1/km; None without distance.
    """

    count: int
    kilometres: float
    dispersion: float
    low: float | None
    high: float | None

    @property
    def per_km(self) -> float | None:
        """Events per kilometre; None without distance."""
        return self.count / self.kilometres if self.kilometres > 0 else None


def rate(counts: Array, kilometres: Array) -> Rate:
    """The rate of events counted in blocks.

    Args:
        counts: shape (blocks,).
        kilometres: driven in each, shape (blocks,).
    """
    n, d = round(float(counts.sum())), float(kilometres.sum())
    if d <= 0:
        return Rate(n, 0.0, 1.0, None, None)
    phi = dispersion(counts, kilometres)
    low, high = poisson_interval(n / phi, d / phi)
    return Rate(n, d, phi, low, high)


def dispersion(counts: Array, kilometres: Array) -> float:
    """phi of the module, at least 1."""
    driven = kilometres > 1e-6
    if driven.sum() < 2 or counts.sum() == 0:
        return 1.0
    expected = counts.sum() / kilometres.sum() * kilometres[driven]
    return max(1.0, float(np.sum((counts[driven] - expected) ** 2 / expected) / (driven.sum() - 1)))


def poisson_interval(count: float, exposure: float) -> tuple[float, float]:
    """Garwood's interval of count / exposure; the count need not be whole."""
    from scipy.stats import chi2

    tail = 0.5 - LEVEL / 2
    low = float(chi2.ppf(tail, 2 * count)) / 2 if count > 0 else 0.0
    return low / exposure, float(chi2.ppf(1 - tail, 2 * count + 2)) / 2 / exposure
