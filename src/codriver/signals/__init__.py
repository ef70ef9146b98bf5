"""Signals on their own clocks, logs of them, and the one resampler."""

from codriver.signals.grid import Grid
from codriver.signals.log import Log
from codriver.signals.sampler import Channel, Sampler, sample
from codriver.signals.signal import Signal

__all__ = ["Channel", "Grid", "Log", "Sampler", "Signal", "sample"]
