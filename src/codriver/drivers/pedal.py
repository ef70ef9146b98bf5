"""Reversals of the accelerator pedal: how restless a foot is.

    h_k = min(max(h_{k-1}, p_k - g/2), p_k + g/2),      g = 2 % of the pedal's range

follows the pedal p with a play of g, so that noise, converter steps and trembling smaller than g leave it where it is. A
reversal is a change of the sign of h's movement. It is to the accelerator what the reversal rate is to the steering wheel
(McLean and Hoffmann 1975, doi:10.1177/001872087501700304). Reversals depend far less on the road than the jerk does
(docs/styles.md).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from codriver.estimate import Estimate
from codriver.signals.signal import Array
from codriver.summary import measured_on_ticks

PEDAL = "accelerator_pedal"
GAP = 0.02  # g, share of the pedal's range
RATE = 10.0  # Hz at which the pedal is looked at


def pedal_reversals(estimate: Estimate, gap: float = GAP) -> npt.NDArray[np.intp] | None:
    """Ticks of the reversals of the accelerator pedal, shape (m,); None where the log has no pedal.

    Args:
        estimate: whose log may have accelerator_pedal.
        gap: the play, share of the pedal's range.
    """
    if PEDAL not in estimate.log or not len(estimate.log[PEDAL]) or not len(estimate.grid):
        return None
    every = max(1, round(1.0 / (RATE * estimate.grid.dt)))
    pedal = measured_on_ticks(estimate, PEDAL)[::every]
    if not np.isfinite(pedal).any():
        return None
    return reversals(pedal, gap) * every


def reversals(pedal: Array, gap: float) -> npt.NDArray[np.intp]:
    """Indices at which the movement of a pedal turns, shape (m,); samples that are no numbers leave it where it was."""
    held = with_play(pedal, gap)
    moved = np.nan_to_num(np.diff(held, prepend=held[:1]))
    at = np.flatnonzero(moved)
    if at.size == 0:
        return at
    sign = np.sign(moved[at])
    return at[1:][sign[1:] != sign[:-1]]


def with_play(values: Array, gap: float) -> Array:
    """Values followed with a play of `gap`, shape (n,)."""
    finite = values[np.isfinite(values)]
    if not finite.size:
        return np.full(values.size, np.nan)
    half, held = 0.5 * gap, float(finite[0])
    out = np.empty(values.size)
    for k, value in enumerate(values.tolist()):
        if value == value:
            held = min(max(held, value - half), value + half)
        out[k] = held
    return out
