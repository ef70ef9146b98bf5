"""Roads made by chance: a town, a country road and a motorway in any order; for calibrating, so that the road test is not seen."""

from __future__ import annotations

import numpy as np

from codriver.simulate.road import KMH, Curve, Grade, Road, Stop, Zone, build_road

# Of each part: share of the length, signed speeds (km/h), eagerness, pieces (m), radii (m), length of a bend (m).
PARTS = {
    "town": (0.22, (40, 50, 50, 60), 0.85, (250, 700), (18, 60), 30),
    "country": (0.36, (70, 80, 90, 90), 1.05, (500, 1500), (60, 350), 110),
    "motorway": (0.42, (100, 110, 130, 130), 1.4, (1500, 3500), (900, 2500), 600),
}


def made_road(seed: int, length: float = 14_000.0) -> Road:
    """A road of some 14 minutes; the same seed makes the same road."""
    random = np.random.default_rng([seed, 101])
    zones, stops, curves, grades = [], [Stop(0, 2.0)], [], []
    end = 0.0
    for part in random.permutation(list(PARTS)):
        share, speeds, eager, piece, radius, bend = PARTS[part]
        at, end = end, end + share * length
        while at < end - 60.0:
            zones.append(Zone(at, float(random.choice(speeds)) * KMH, eager))
            long = float(random.uniform(*piece))
            if part == "town" and random.random() < 0.6 and at + 0.7 * long < end:
                stops.append(Stop(at + 0.7 * long, float(random.uniform(3, 14))))
            if random.random() < 0.7 and at + 0.35 * long + bend < end:
                start = at + 0.35 * long
                side = float(random.choice([-1, 1]))
                curves.append(Curve(start, start + bend, side * float(random.uniform(*radius))))
            if part == "country" and random.random() < 0.35 and at + long < end - 60.0:
                zones.append(Zone(at + long - 30.0, 24 * KMH, 1.0))  # a roundabout
            at += long
    at = 300.0
    while at < length - 400.0:
        grades.append(Grade(at, float(random.uniform(80, 300)), float(random.normal(0, 0.022))))
        at += float(random.uniform(400, 1200))
    near = length - 100.0
    return build_road(
        f"made {seed}", length, [z for z in zones if z.start < near], grades=grades,
        curves=[c for c in curves if c.stop < near], stops=[p for p in stops if p.at < near],
    )  # fmt: skip
