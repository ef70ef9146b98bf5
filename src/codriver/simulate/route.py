"""The road of the road test: 53 km like the round trip of the 2017 paper, with its stretches by name.

In character that of the paper (section IV): from a suburb through a small town to a larger one and back another way, on
urban arteries, extra-urban roads and motorways, over roundabouts, ramps and intersections. Distances, bends and slopes
are made up; nobody surveyed them. The stretch `comparison` follows the paper's description of its figures 4, 5 and 7
scene by scene, at about the same time into the drive.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from codriver.signals.signal import Array
from codriver.simulate.road import KMH, Curve, Grade, Road, Scene, Stop, Zone, build_road

LENGTH = 53_000.0  # m

# From this distance (m) on: signed speed (km/h), and how briskly the place asks to be driven.
_ZONES = (
    (0, 50, 0.8), (500, 70, 1.0), (2300, 60, 0.9),  # out of the suburb
    (3000, 90, 1.1), (6300, 90, 1.0),  # extra-urban
    (9200, 50, 0.9), (10700, 70, 1.0),  # a small town
    (11500, 90, 1.0), (11800, 70, 1.0), (12600, 90, 1.0), (17800, 70, 1.0),  # extra-urban, with hills
    (18500, 50, 0.9), (20000, 70, 1.0),  # the larger town
    (21300, 70, 1.2), (21750, 130, 1.5), (25900, 90, 1.0), (26300, 62, 1.0),  # entry ramp, motorway, exit ramp
    (27000, 90, 1.5), (28960, 70, 1.0),  # the main road of the comparison
    (30000, 90, 1.1), (32500, 70, 1.2), (32900, 130, 1.5), (47350, 90, 1.0), (47700, 60, 1.0),  # second motorway
    (48000, 90, 1.2), (50300, 70, 1.0), (51400, 50, 0.9),  # back into the suburb
)  # fmt: skip
# Give-way lines: at (m), speed at the line (km/h).
_GIVE_WAYS = ((27000, 22), (48000, 25))
# Roundabouts: where their give-way line is, m.
_ROUNDABOUTS = (1200, 3000, 8400, 11500, 14500, 20600, 28900, 49600, 51800)
# Bends: start, stop, signed radius, m.
_CURVES = (
    (700, 820, 120), (1750, 1830, -90), (4100, 4350, -380), (5650, 5740, 75), (6050, 6120, -85), (7300, 7600, 320),
    (9400, 9440, -28), (10150, 10190, 25), (12600, 12900, -350), (13300, 13420, 160), (15700, 15790, 105),
    (16600, 16800, -260), (18900, 18930, 24), (19800, 19840, -26), (21520, 21760, -95), (23500, 24700, 1800),
    (26965, 26990, -32), (27290, 27350, 70), (31250, 31420, -340), (32520, 32760, 95), (35500, 36900, -1700),
    (40200, 41500, 1900), (44500, 45600, -1600), (47790, 47930, 80), (48700, 48800, -150), (51200, 51230, 26),
)  # fmt: skip
# Slopes: start and length of the change, m; new slope, rise over run.
_GRADES = (
    (3300, 200, 0.012), (5000, 200, 0.0), (6500, 150, 0.022), (7200, 150, -0.01), (8000, 150, 0.0),
    (9600, 100, 0.02), (10300, 100, -0.015), (10900, 100, 0.0),
    (12000, 60, 0.08), (12260, 60, 0.0),  # the short uphill segment
    (12800, 120, -0.038), (13500, 120, 0.0), (15000, 150, 0.035), (15900, 200, -0.04), (16900, 200, 0.0),
    (19000, 100, 0.018), (19700, 100, 0.0), (22500, 400, -0.008), (25500, 400, 0.01), (26700, 150, 0.03),
    (27000, 120, 0.0), (27700, 200, -0.012), (28300, 200, 0.008), (28900, 150, 0.0),
    (30400, 100, 0.015), (32000, 200, 0.0),  # the slightly inclined straight
    (32500, 150, -0.025), (32900, 200, 0.0), (34500, 500, 0.018), (37000, 500, -0.0225), (39500, 500, 0.0),
    (42000, 500, 0.005), (44500, 500, -0.02), (46500, 400, 0.0), (47700, 100, 0.02), (48000, 100, 0.0),
    (50200, 200, -0.01), (50900, 200, 0.0),
)  # fmt: skip
# Lines to stop at, m, and the wait there, s.
_STOPS = ((0, 2), (480, 4), (2300, 6), (9950, 7), (18700, 3), (19400, 9), (31550, 3), (51000, 5), (52950, 2))


@dataclass(frozen=True)
class Stretch:
    """A part of a road: from `start` to `stop` (m), and what happens there."""

    start: float
    stop: float
    meaning: str

    def holds(self, distance: Array) -> npt.NDArray[np.bool_]:
        """Which of some distances (m) lie within, shape of `distance`."""
        return (distance >= self.start) & (distance < self.stop)


ROAD_TEST_STRETCHES: dict[str, Stretch] = {
    "comparison": Stretch(26_700, 29_000, "the 2.3 km of the 2017 paper's figures 4 and 7"),
    "ramp": Stretch(26_800, 27_140, "exit ramp, give way, strong acceleration onto a main road (box 1)"),
    "bend": Stretch(27_140, 27_400, "sharp bend of the main road (box 2)"),
    "other_car": Stretch(27_500, 27_800, "another car seems to come out, then does not: brake, accelerate (box 3)"),
    "roundabout": Stretch(28_560, 29_000, "give way at a roundabout, through it and out (box 4)"),
    "uphill": Stretch(11_950, 12_400, "short uphill segment, 8 %, on which the gearbox shifts down (figure 6, middle)"),
    "straight": Stretch(31_560, 31_990, "slightly inclined straight, 1.5 %, sped up on from a stop (figure 6, right)"),
    "motorway": Stretch(33_500, 47_000, "motorway"),
    "town": Stretch(18_500, 20_600, "urban: stops and tight turns"),
}


def road_test_road() -> Road:
    """The 53 km of the road test; `ROAD_TEST_STRETCHES` names parts of it."""
    return build_road(
        "road test: suburb, two towns, extra-urban roads, two motorways, back to the suburb",
        LENGTH,
        _zones(),
        grades=[Grade(*grade) for grade in _GRADES],
        curves=[Curve(*curve) for curve in _CURVES] + [c for line in _ROUNDABOUTS for c in _ring(line)],
        stops=[Stop(*stop) for stop in _STOPS],
        scenes=[Scene(27_640, 30 * KMH, 75, 1.6), Scene(7_000, 35 * KMH, 80, 2.0), Scene(50_300, 25 * KMH, 60, 2.5)],
        transition=10.0,
    )


def _zones() -> list[Zone]:
    """Signed speeds, with a low one over each give-way line and a brisk way out of it."""
    zones = [Zone(start, speed * KMH, eager) for start, speed, eager in _ZONES]
    for line, speed in (*_GIVE_WAYS, *((line, 24) for line in _ROUNDABOUTS)):
        behind = [zone for zone in zones if zone.start <= line + 8][-1]
        zones = [zone for zone in zones if not line - 8 <= zone.start <= line + 8]
        zones += [Zone(line - 8, speed * KMH, 1.0), Zone(line + 8, behind.speed, max(1.2, behind.eager))]
        zones.sort(key=lambda zone: zone.start)
    return zones


def _ring(line: float) -> list[Curve]:
    """A roundabout driven straight across, its give-way line at `line` (m): right, left around the island, right."""
    return [Curve(line - 6, line + 2, -30), Curve(line + 14, line + 38, 17), Curve(line + 50, line + 60, -34)]
