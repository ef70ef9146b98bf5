"""The driver's plan: an acceleration that is held, and changed in bursts of jerk.

Between bursts the planned acceleration is constant, so its jerk is zero, as the 2017 paper finds ("the baseline value
for the intentional jerk is zero", section IV-B). A burst takes the acceleration from a_0 (with jerk j_0 and its rate
s_0) to a_1 (with jerk and rate zero) in T seconds along the polynomial of least fifth degree,

    a(x) = a_0 + j_0 T x + s_0 T^2 x^2 / 2 + c_3 x^3 + c_4 x^4 + c_5 x^5,   x = (t - t_0) / T,

which from rest is the minimum-jerk curve of Flash and Hogan (1985) with speed read as jerk:
a = a_0 + (a_1 - a_0)(10 x^3 - 15 x^4 + 6 x^5), whose greatest jerk is 1.875 (a_1 - a_0) / T at half time.
"""

from __future__ import annotations

# Greatest slope of 10 x^3 - 15 x^4 + 6 x^5, at x = 1/2.
PEAK = 1.875


class Plan:
    """The planned acceleration over time; see the module."""

    def __init__(self, acceleration: float = 0.0) -> None:
        self.goal = acceleration  # m/s^2, held after the burst
        self.start, self.duration = 0.0, 0.0  # of the last burst, s
        self._c = (acceleration, 0.0, 0.0, 0.0, 0.0, 0.0)

    def at(self, time: float) -> tuple[float, float, float]:
        """Planned acceleration (m/s^2), jerk (m/s^3) and rate of jerk (m/s^4) at a time (s)."""
        duration = self.duration
        if time >= self.start + duration:
            return self.goal, 0.0, 0.0
        x = (time - self.start) / duration
        c0, c1, c2, c3, c4, c5 = self._c
        a = c0 + x * (c1 + x * (c2 + x * (c3 + x * (c4 + x * c5))))
        j = c1 + x * (2 * c2 + x * (3 * c3 + x * (4 * c4 + x * 5 * c5)))
        s = 2 * c2 + x * (6 * c3 + x * (12 * c4 + x * 20 * c5))
        return a, j / duration, s / (duration * duration)

    def busy(self, time: float) -> bool:
        """Whether a burst is under way."""
        return time < self.start + self.duration

    def burst(self, time: float, goal: float, duration: float) -> None:
        """Begin a burst to the acceleration `goal` (m/s^2) over `duration` (s); one under way is bent over to it."""
        a, j, s = self.at(time)
        c1, c2 = j * duration, 0.5 * s * duration * duration
        # What the cubic and higher terms must supply at x = 1: the rest of the way, and minus the slope and curvature
        # there.
        way, slope, bend = goal - a - c1 - c2, -c1 - 2 * c2, -2 * c2
        self._c = (
            a, c1, c2,
            10 * way - 4 * slope + 0.5 * bend,
            -15 * way + 7 * slope - bend,
            6 * way - 3 * slope + 0.5 * bend,
        )  # fmt: skip
        self.start, self.duration, self.goal = time, duration, goal


def duration_of(change: float, peak_jerk: float) -> float:
    """Seconds a burst of this change of acceleration (m/s^2) takes at this peak jerk (m/s^3); 0.6 to 3 s.

    Small changes are made more gently than large ones: the peak shrinks to half for a change towards zero.
    """
    size = abs(change)
    peak = peak_jerk * min(1.0, 0.5 + 0.35 * size)
    return min(3.0, max(0.6, PEAK * size / peak))
