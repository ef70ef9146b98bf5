"""Courses and speeds of the 2018 paper's kind: slalom, double lane change, a closed track; speed that ramps, or suits the bends.

Of the paper's own paths no figures are printed.

    v(s) = min(v_max, sqrt(a_lat / |kappa|)),   then |v'| <= a sqrt(1 - (kappa v^2 / a_lat)^2) both ways
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import pi, radians, sin, sqrt

import numpy as np

from codriver.signals.signal import Array
from codriver.simulate.motorcycle.course import Course, by_curvature, by_place

SpeedPlan = Callable[[float, float], float]  # m/s of the time, s, and the distance along the course, m
LENGTH = 1000.0  # m, of courses that end nowhere
LEANING = 6.0  # m before and behind a bend that count as in it
IN_BENDS = 0.2  # of the acceleration along that is left at the greatest across


def straight(length: float = LENGTH) -> Course:
    """Straight ahead.

    Args:
        length: m.
    """
    return by_curvature(np.zeros_like, length)


def rise(share: float) -> float:
    """From 0 to 1 without a jump of curvature: 10 s^3 - 15 s^4 + 6 s^5.

    Args:
        share: s, of the way.
    """
    s = min(max(share, 0.0), 1.0)
    return s**3 * (10 - 15 * s + 6 * s * s)


def slalom(amplitude: float, wavelength: float, start: float = 30.0, length: float = LENGTH) -> Course:
    """y = A sin(2 pi (x - start) / wavelength), risen over its first wavelength.

    Args:
        amplitude: A, m.
        wavelength: m.
        start: m.
        length: m.
    """

    def path(x: float) -> float:
        along = (x - start) / wavelength
        return amplitude * rise(along) * sin(2 * pi * along)

    return by_place(path, length)


def double_lane_change(
    width: float, length: float, stay: float, start: float = 60.0, whole: float = LENGTH
) -> Course:  # fmt: skip
    """To the left by a width, stay, and back.

    Args:
        width: m; negative for a change to the right first.
        length: of either change, m.
        stay: between them, m.
        start: m.
        whole: length of the course, m.
    """

    def path(x: float) -> float:
        return width * (rise((x - start) / length) - rise((x - start - length - stay) / length))

    return by_place(path, whole)


# Length of arc, m, and angle, degrees to the left, of each piece; bends bend in and out over a third of their length each.
LAP = (
    (90.0, 0.0), (80.0, 95.0), (60.0, 0.0), (60.0, -80.0), (40.0, 0.0), (32.0, 120.0), (150.0, 0.0), (100.0, 65.0), (70.0, -75.0),
    (45.0, 0.0), (60.0, 110.0), (60.0, 0.0), (75.0, -60.0), (80.0, 95.0), (60.0, 0.0), (90.0, 90.0),
)  # fmt: skip


def closed(pieces: Sequence[tuple[float, float]] = LAP, laps: int = 1) -> Course:
    """A closed course of straights and bends; the two straights that are most across each other are made to fit.

    Args:
        pieces: length, m, and angle, degrees to the left; together 360 either way.
        laps: how many.

    Raises:
        ValueError: the angles do not close, or no lengths of the straights do.
    """
    if abs(abs(sum(angle for _, angle in pieces)) - 360) > 1e-9:
        raise ValueError(f"the bends turn by {sum(angle for _, angle in pieces):g} degrees in all, not by 360")
    lengths = [length for length, _ in pieces]
    ways = np.cumsum([0.0] + [radians(angle) for _, angle in pieces])[:-1]
    straights = [i for i, (_, angle) in enumerate(pieces) if not angle]
    one, other = max(
        ((i, j) for i in straights for j in straights if i < j),
        key=lambda pair: abs(sin(ways[pair[1]] - ways[pair[0]])),
    )
    for _ in range(4):  # once is enough, but for the points' distance
        end = _of_pieces(lengths, pieces, 1).place[-1]
        across = np.array([[np.cos(ways[i]) for i in (one, other)], [np.sin(ways[i]) for i in (one, other)]])
        more = np.linalg.solve(across, -end)
        lengths[one] += float(more[0])
        lengths[other] += float(more[1])
    if min(lengths) < 0:
        raise ValueError(
            f"the straights {one} and {other} would have to be {lengths[one]:.0f} and {lengths[other]:.0f} m"
        )
    return _of_pieces(lengths, pieces, laps)


def _of_pieces(lengths: Sequence[float], pieces: Sequence[tuple[float, float]], laps: int) -> Course:
    ends = np.cumsum([0.0, *lengths])

    def curvature(distance: Array) -> Array:
        along = np.mod(distance, ends[-1])
        bend = np.zeros_like(along)
        for first, last, (_, angle) in zip(ends[:-1], ends[1:], pieces, strict=True):
            share = np.clip((along - first) / (last - first), 0, 1)
            shape = np.minimum(np.minimum(3 * share, 3 * (1 - share)), 1.0)
            bend += np.where((along >= first) & (along < last), 1.5 * radians(angle) / (last - first) * shape, 0.0)
        return bend

    return by_curvature(curvature, laps * float(ends[-1]))


def ramp(first: float, last: float, begin: float, end: float) -> SpeedPlan:
    """Speed from first to last between two times.

    Args:
        first: m/s.
        last: m/s.
        begin: s.
        end: s.
    """

    def speed(time: float, _distance: float = 0.0) -> float:
        return first + (last - first) * min(max((time - begin) / (end - begin), 0.0), 1.0)

    return speed


def for_bends(
    course: Course, slowest: float, fastest: float, lateral: float, along: float = 2.5, braking: float = 3.0,
    start: float | None = None,
) -> SpeedPlan:  # fmt: skip
    """As fast as bends allow; who leans neither brakes nor drives hard.

    Args:
        course: the way.
        slowest, fastest: m/s.
        lateral: greatest acceleration across, m/s^2; `slowest` goes before.
        along, braking: greatest acceleration and deceleration upright, m/s^2.
        start: speed at the course's start, m/s; else what bends allow there.
    """
    from scipy.ndimage import maximum_filter1d

    near = 2 * round(LEANING / course.step) + 1
    bend = np.maximum(maximum_filter1d(np.abs(course.curvature), near), 1e-9)
    square = np.clip(np.sqrt(lateral / bend), slowest, fastest) ** 2
    square[0] = square[0] if start is None else min(square[0], start**2)

    def most(i: int, upright: float) -> float:
        used = min(bend[i] * square[i] / lateral, 1.0)
        return 2 * course.step * upright * max(sqrt(1 - used * used), IN_BENDS)

    for i in range(1, len(square)):
        square[i] = min(square[i], square[i - 1] + most(i - 1, along))
    for i in range(len(square) - 2, -1, -1):
        square[i] = min(square[i], square[i + 1] + most(i + 1, braking))
    distance, speeds = course.step * np.arange(len(square)), np.sqrt(square)

    def speed(_time: float, place: float = 0.0) -> float:
        return float(np.interp(place, distance, speeds))

    return speed
