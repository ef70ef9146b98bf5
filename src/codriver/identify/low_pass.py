"""The low-pass that all signals of an identification share (2017, below eq. 19).

    [w]_F = w / (1 + s / (2 pi f)),  f = 5 Hz

On ticks of dt seconds a signal is held (`codriver.signals.sampler`), and for a held signal the filter is exact:

    F_{k+1} = a F_k + (1 - a) w_k,   a = exp(-2 pi f dt)

The same filter for all keeps an equation that is linear in them true, its lag included. What it does not take away is the
hold itself, which delays a signal by half of its own sample interval on average: 5 ms at 100 Hz, 50 ms at 10 Hz. So the
stamps of a measured signal are set back by half an interval first (`centred`). A latency in the sensor or on the bus stays.
"""

from __future__ import annotations

from math import exp, isfinite, pi

import numpy as np

from codriver.signals import Log, Signal
from codriver.signals.signal import Array

LOW_PASS = 5.0  # Hz, 2017 section IV-A
RATE_PASS = 1.0  # Hz, of a rate taken from a noisy signal


def low_pass(x: Array, dt: float, frequency: float = LOW_PASS) -> Array:
    """First-order low-pass of a held signal, causal, started at its first value.

    Args:
        x: shape (n,) or (n, m), finite.
        dt: tick, s.
        frequency: f, Hz.
    """
    from scipy.signal import lfilter

    if not x.size:
        return x
    a = exp(-2 * pi * frequency * dt)
    filtered, _ = lfilter([0.0, 1 - a], [1, -a], x, axis=0, zi=x[:1])
    return np.asarray(filtered)


def rate(x: Array, dt: float) -> Array:
    """Time derivative of [x]_F, low-passed once more at RATE_PASS, for a rate of noisy wheels; shape of x."""
    slow = low_pass(x, dt)
    return 2 * pi * RATE_PASS * (slow - low_pass(slow, dt, RATE_PASS))


def centred(log: Log, names: tuple[str, ...]) -> Log:
    """A log whose signals `names` are set back by half of their sample interval, so that their hold delays none of them."""
    return log.with_signals(*(_back(log[name]) for name in names if name in log))


def _back(signal: Signal) -> Signal:
    half = 0.5 / signal.rate if isfinite(signal.rate) else 0.0
    return Signal(signal.name, signal.time - half, signal.values, signal.unit, signal.source)
