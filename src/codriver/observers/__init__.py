"""Observers: frozen designs with one step each."""

from codriver.observers import intent as _intent  # noqa: F401, I001  registers its family, the first
from codriver.observers import driver_torque_family as _driver_torque  # noqa: F401  registers its family
from codriver.observers import motorcycle_family as _motorcycle  # noqa: F401  registers its family
from codriver.observers.feed import best, feeds
from codriver.observers.observer import Certificate, Observer, Output, chain
from codriver.observers.preset_file import find_preset, preset_of, save_preset
from codriver.observers.registry import ESTIMATORS, Design, Estimator, build, families, register
from codriver.observers.scaled_gain import PRESETS, Preset, ScaledGain, design_scaled_gain

__all__ = [
    "ESTIMATORS",
    "PRESETS",
    "Certificate",
    "Design",
    "Estimator",
    "Observer",
    "Output",
    "Preset",
    "ScaledGain",
    "best",
    "build",
    "chain",
    "design_scaled_gain",
    "families",
    "feeds",
    "find_preset",
    "preset_of",
    "register",
    "save_preset",
]
