"""Tuning: noise and knob from recorded drives, and the curve of delay against noise they lie on."""

from codriver.tune.curve import Point, calm_jerk, sensor_noise
from codriver.tune.knob import KnobProfile, ell_for_delay, likely_ell
from codriver.tune.likelihood import Evidence, Likelihood
from codriver.tune.noise import NoiseFit, Ratio, fit_noise
from codriver.tune.tuning import Tuning, Whiteness, tune

__all__ = [
    "Evidence",
    "KnobProfile",
    "Likelihood",
    "NoiseFit",
    "Point",
    "Ratio",
    "Tuning",
    "Whiteness",
    "calm_jerk",
    "ell_for_delay",
    "fit_noise",
    "likely_ell",
    "sensor_noise",
    "tune",
]
