"""The rig's circuit as a way to drive: some laps to the left, to the right, or first to the left and then to the right.

As in Okamoto, Tsiotras 2019 (Robotics and Autonomous Systems), section 5.3, one drive goes both ways. Here the car turns about on
the circuit's first straight, so that the curvature is continuous: laps, the straight, the straight again, laps backwards.
"""

from __future__ import annotations

import numpy as np

from codriver.signals.signal import Array
from codriver.simulate.rig import circuit_curvature, circuit_length

DIRECTIONS = ("both", "left", "right")
_TURN = 80.0  # m, the first straight


def way_length(laps: int, direction: str) -> float:
    """Length of a drive, m.

    Args:
        laps: each way.
        direction: of DIRECTIONS.
    """
    one = laps * circuit_length()
    return 2 * (one + _TURN) if direction == "both" else one


def way_curvature(distance: Array, laps: int, direction: str) -> Array:
    """Curvature along a drive, 1/m, positive to the left.

    Args:
        distance: m, from the start; the laps go on beyond the end.
        laps: each way.
        direction: "left", the way in which the circuit turns by 360 degrees to the left; "right"; "both".

    Raises:
        ValueError: there is no such direction, or no lap.
    """
    if direction not in DIRECTIONS or laps < 1:
        raise ValueError(f"{laps} laps, direction '{direction}'; at least 1 lap, and one of {', '.join(DIRECTIONS)}")
    if direction == "left":
        return circuit_curvature(distance)
    if direction == "right":
        return -circuit_curvature(_TURN - distance)
    middle = way_length(laps, direction) / 2
    return np.where(distance < middle, circuit_curvature(distance), -circuit_curvature(_TURN - (distance - middle)))
