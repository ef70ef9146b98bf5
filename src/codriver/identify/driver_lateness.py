"""Whether the torque of a driver's drive is logged late: the wheel cannot turn before it is pulled.

    T_dr(t + s) ~ c_0 + c_1 delta_s + c_2 delta_s' + c_3 delta_s'' + c_4 tanh(delta_s' / RATE)        column and tyres, no dead time
    late = the s in +- MOST at which this leaves least

The driver's own delay has no part in it, which a fit of the driver cannot tell from a late torque.
"""

from __future__ import annotations

import numpy as np

from codriver.finding import Finding
from codriver.signals.signal import Array

TICK = 0.05  # s
MOST = 0.7  # s
LATE = 0.2  # s; simulated drives in time give -0.15 to 0.05 s
RATE = 0.02  # rad/s, where friction turns


def lateness(angle: Array, torque: Array, dt: float) -> float:
    """Late, s, in steps of TICK.

    Args:
        angle: delta_s, rad; torque: N m; shape (n,).
        dt: s.
    """
    time = dt * np.arange(angle.size)
    grid = np.arange(0.0, time[-1], TICK)
    even = np.ones(5) / 5
    delta = np.convolve(np.interp(grid, time, angle), even, "same")
    rate = np.convolve(np.gradient(delta, TICK), even, "same")
    X = np.stack([np.ones_like(delta), delta, rate, np.gradient(rate, TICK), np.tanh(rate / RATE)], axis=1)
    pulled = np.interp(grid, time, torque)
    most = round(MOST / TICK)
    edge = most + 5
    X = X[edge:-edge]
    left = []
    for k in range(-most, most + 1):
        y = pulled[edge + k : pulled.size - edge + k]
        left.append(float(np.std(y - X @ np.linalg.lstsq(X, y)[0]) / max(float(np.std(y)), 1e-12)))
    return TICK * (int(np.argmin(left)) - most)


def late_findings(angle: Array, torque: Array, dt: float, source: str) -> list[Finding]:
    """A judged sentence if the torque is late; arguments as for `lateness`."""
    late = lateness(angle, torque, dt)
    if late < LATE - 1e-9:
        return []
    said = f"{source}: the torque goes best with how the wheel moved {late:.2g} s before: it seems to be logged late"
    return [Finding("warn", f"{said}, which makes tau_p, T_N, T_L and T_I wrong; look at its clock")]
