"""Coefficients of a vehicle from its own drives."""

from codriver.identify.brake import BrakeFit, Coefficient, Refusal, identify_brake
from codriver.identify.ratio import RatioFit, identify_ratio

__all__ = ["BrakeFit", "Coefficient", "RatioFit", "Refusal", "identify_brake", "identify_ratio"]
