"""A handling track: a closed lap of 4.5 km on a slope, so that what the slope does to a sensor repeats every lap.

The lap turns once in all (its curvature sums up to 2 pi) and returns to its own height; it is not drawn on a plane. The
2015 paper drove two laps of a test track and shows the estimated offset of the accelerometer repeating itself with them
(figure 1). Its track is not described; this one is made up.
"""

from __future__ import annotations

import math

from codriver.errors import UsageError
from codriver.simulate.road import KMH, Curve, Grade, Road, Stop, Zone, build_road

LAP = 4500.0  # m
_TRANSITION = 15.0  # m

# Start and stop of the bends (m), and the angle turned (degrees, left is positive); the angles sum up to 360.
_BENDS = ((520, 640, 75), (900, 1080, 95), (1330, 1400, -50), (1480, 1560, 60), (1950, 2190, 110), (2700, 2760, -70),
          (2850, 2960, 90), (3350, 3560, -80), (3700, 3950, 130))  # fmt: skip
# Start and length of a change of slope (m), new slope; the climb of 40 m is taken back within the lap.
_GRADES = ((450, 150, 0.025), (1150, 150, 0.05), (1600, 150, 0.0), (2150, 200, -0.04), (2900, 150, -0.01),
           (3400, 150, -0.0075), (4200, 150, 0.0))  # fmt: skip
# From this distance (m) on: speed (km/h), and how briskly.
_ZONES = ((0, 110, 1.1), (480, 80, 1.0), (1200, 60, 1.0), (1620, 100, 1.2), (2660, 70, 1.0), (3000, 120, 1.2),
          (3300, 90, 1.0), (4020, 110, 1.1))  # fmt: skip


def track_road(laps: int = 2) -> Road:
    """Whole laps of the track, from a standing start to the line, crossed at speed.

    Args:
        laps: how many.

    Raises:
        UsageError: less than one.
    """
    if laps < 1:
        raise UsageError(f"{laps} laps", "one or more", "ask for at least one lap")
    starts = [lap * LAP for lap in range(laps)]
    return build_road(
        f"handling track, {laps} laps",
        laps * LAP,
        [Zone(at + start, speed * KMH, eager) for at in starts for start, speed, eager in _ZONES],
        grades=[Grade(at + start, length, slope) for at in starts for start, length, slope in _GRADES],
        # Of a bend's angle, its two transitions turn as much as one of their lengths of full curvature would.
        curves=[
            Curve(at + start, at + stop, (stop - start + _TRANSITION) / math.radians(angle))
            for at in starts
            for start, stop, angle in _BENDS
        ],
        stops=[Stop(0.0, 2.0)],
        transition=_TRANSITION,
    )
