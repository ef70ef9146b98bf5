"""Coefficients of a vehicle from its own drives."""

from codriver.identify.ratio import RatioFit, identify_ratio

__all__ = ["RatioFit", "identify_ratio"]
