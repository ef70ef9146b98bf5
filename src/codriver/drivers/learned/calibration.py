"""Bands that hold what they promise: the errors a model makes on blocks it has not seen, as a Student distribution.

    z = (T - mean) / sd      on held-out blocks,      z ~ c t_nu
    band at p:  mean +- c t_nu^-1((1 + p) / 2) sd        sd reported:  c sqrt(nu / (nu - 2)) sd

A model's own sd is what it thinks of itself on the rows it learnt from. Drivers have quiet stretches and busy ones, so errors have
heavier tails than a normal distribution, which nu takes up. c and nu by maximum likelihood.

Lange, Little, Taylor 1989, doi:10.1080/01621459.1989.10478852 (errors with t distribution).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import log
from typing import Any, Self

import numpy as np

from codriver.signals.signal import Array

_NU = (2.2, 60.0)  # heavier has no variance to report, lighter is normal


@dataclass(frozen=True)
class Calibration:
    """Scale and tail of a model's standardised errors.

    Attributes:
        scale: c.
        nu: degrees of freedom.
        rows: errors it was learnt from.
    """

    scale: float = 1.0
    nu: float = _NU[1]
    rows: int = 0

    @classmethod
    def of(cls, z: Array) -> Self:
        """From standardised errors on rows that were not learnt from; fewer than 30 leave the model's own sd."""
        from scipy.optimize import minimize
        from scipy.stats import t

        z = z[np.isfinite(z)]
        if z.size < 30:
            return cls()
        start = max(float(np.median(np.abs(z))) / 0.7, 1e-6)

        def cost(p: Array) -> float:
            nu = _NU[0] + (_NU[1] - _NU[0]) / (1 + np.exp(-p[1]))
            return float(-np.mean(t.logpdf(z / np.exp(p[0]), nu)) + p[0])

        best = minimize(cost, np.array([log(start), -2.0]), method="Nelder-Mead", options={"maxiter": 300}).x
        return cls(float(np.exp(best[0])), float(_NU[0] + (_NU[1] - _NU[0]) / (1 + np.exp(-best[1]))), int(z.size))

    def sd(self, sd: Array) -> Array:
        """Standard deviation of an error."""
        return np.asarray(self.scale * np.sqrt(self.nu / (self.nu - 2)) * sd)

    def half_width(self, sd: Array, level: float = 0.95) -> Array:
        """Half the width of the band that holds `level` of the errors."""
        from scipy.stats import t

        return np.asarray(self.scale * t.ppf((1 + level) / 2, self.nu) * sd)

    def log_density(self, error: Array, sd: Array) -> Array:
        """Log density of errors, 1 / (N m) in the logarithm."""
        from scipy.stats import t

        size = self.scale * sd
        return np.asarray(t.logpdf(error / size, self.nu) - np.log(size))

    def as_plain(self) -> dict[str, Any]:
        """For a file."""
        return dict(vars(self))

    @classmethod
    def from_plain(cls, plain: Mapping[str, Any]) -> Self:
        """From `as_plain`."""
        return cls(float(plain["scale"]), float(plain["nu"]), int(plain["rows"]))
