"""Paths and speeds of the 2018 paper's kind: slalom, double lane change, speed that ramps.

Lateral place y, m, to the left, of the forward place x, m. Of the paper's own paths no figures are printed.
"""

from __future__ import annotations

from math import pi, sin

from codriver.simulate.motorcycle.rider import Path, SpeedPlan


def rise(share: float) -> float:
    """From 0 to 1 without a jump of curvature: 10 s^3 - 15 s^4 + 6 s^5.

    Args:
        share: s, of the way.
    """
    s = min(max(share, 0.0), 1.0)
    return s**3 * (10 - 15 * s + 6 * s * s)


def slalom(amplitude: float, wavelength: float, start: float = 30.0) -> Path:
    """y = A sin(2 pi (x - start) / wavelength), risen over its first wavelength.

    Args:
        amplitude: A, m.
        wavelength: m.
        start: m.
    """

    def path(x: float) -> float:
        along = (x - start) / wavelength
        return amplitude * rise(along) * sin(2 * pi * along)

    return path


def double_lane_change(width: float, length: float, stay: float, start: float = 60.0) -> Path:
    """To the left by a width, stay, and back.

    Args:
        width: m.
        length: of either change, m.
        stay: between them, m.
        start: m.
    """

    def path(x: float) -> float:
        return width * (rise((x - start) / length) - rise((x - start - length - stay) / length))

    return path


def ramp(first: float, last: float, begin: float, end: float) -> SpeedPlan:
    """Speed from first to last between two times.

    Args:
        first: m/s.
        last: m/s.
        begin: s.
        end: s.
    """

    def speed(time: float) -> float:
        return first + (last - first) * min(max((time - begin) / (end - begin), 0.0), 1.0)

    return speed
