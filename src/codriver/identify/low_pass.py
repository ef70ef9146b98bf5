"""The low-pass that all signals of an identification share (2017, below eq. 19).

    [w]_F = w / (1 + s / (2 pi f)),  f = 5 Hz

On ticks of dt seconds a signal is held (`codriver.signals.sampler`), and for a held signal the filter is exact:

    F_{k+1} = a F_k + (1 - a) w_k,   a = exp(-2 pi f dt)

The same filter for all keeps an equation that is linear in them true, its lag included. What it does not take away is the
hold itself, which delays a signal by half of its own sample interval on average: 5 ms at 100 Hz, 50 ms at 10 Hz. So the
stamps of a measured signal are set back by half an interval first (`centred`), after which holds differ by half a tick at
most. A latency in the sensor or on the bus stays.
"""

from __future__ import annotations

from math import exp, isfinite, pi

import numpy as np

from codriver.signals import Log, Signal
from codriver.signals.signal import Array

LOW_PASS = 5.0  # Hz, 2017 section IV-A
TINY = 1e-30
RATE_PASS = 1.5  # Hz, of a rate taken from a noisy signal


def low_pass(x: Array, dt: float, frequency: float = LOW_PASS) -> Array:
    """First-order low-pass of a held signal, causal, started at its first value.

    Args:
        x: shape (n,) or (n, m), finite.
        dt: tick, s.
        frequency: f, Hz.
    """
    from scipy.linalg import lapack  # scipy.signal would do, and takes half a second to load

    if not x.size:
        return x
    a = exp(-2 * pi * frequency * dt)
    bidiagonal = np.empty((2, x.shape[0]), order="F")
    bidiagonal[0], bidiagonal[1] = 1.0, -a
    held = np.empty(x.shape, order="F")
    # A signal that is 0 for long would fade into denormal numbers, which are fifty times slower.
    held[0], held[1:] = x[0] + TINY, (1 - a) * (x[:-1] + TINY)
    filtered, _ = lapack.dtbtrs(bidiagonal, held, uplo="L", overwrite_b=1)
    return np.asarray(filtered - TINY).reshape(x.shape)


def smooth(x: Array, dt: float) -> Array:
    """x through the low-pass of RATE_PASS Hz forwards and backwards, which shifts nothing in time; shape of x."""
    return _backwards(low_pass(x, dt, RATE_PASS), dt)


def rate(x: Array, dt: float) -> Array:
    """Time derivative of [x]_F, smoothed by `smooth`, for a rate of noisy wheels; shape of x.

    A causal low-pass would lag behind the other signals of a regression, and the pair of both would then stand in for a small
    delay between other signals: 5 ms would change a coefficient of the rate by 0.03.
    """
    slow = low_pass(x, dt)
    per_second = (1 - exp(-2 * pi * RATE_PASS * dt)) / dt  # makes the rate of a ramp exact
    return _backwards(per_second * (slow - low_pass(slow, dt, RATE_PASS)), dt)


def _backwards(x: Array, dt: float) -> Array:
    return low_pass(x[::-1], dt, RATE_PASS)[::-1]


def centred(log: Log, names: tuple[str, ...]) -> Log:
    """A log whose signals `names` are set back by half of their sample interval, so that their hold delays none of them."""
    return log.with_signals(*(_back(log[name]) for name in names if name in log))


def _back(signal: Signal) -> Signal:
    half = 0.5 / signal.rate if isfinite(signal.rate) else 0.0
    return Signal(signal.name, signal.time - half, signal.values, signal.unit, signal.source)
