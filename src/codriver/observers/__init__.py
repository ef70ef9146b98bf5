"""Observers: frozen designs with one step each."""

from codriver.observers.intent import ESTIMATORS, build
from codriver.observers.observer import Certificate, Observer, Output, chain
from codriver.observers.scaled_gain import PRESETS, Preset, ScaledGain, design_scaled_gain

__all__ = [
    "ESTIMATORS",
    "PRESETS",
    "Certificate",
    "Observer",
    "Output",
    "Preset",
    "ScaledGain",
    "build",
    "chain",
    "design_scaled_gain",
]
