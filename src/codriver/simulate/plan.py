"""The driver's plan: an acceleration that is held, and changed in bursts of jerk.

Between bursts the planned acceleration is constant, so its jerk is zero, as the 2017 paper finds ("the baseline value
for the intentional jerk is zero", section IV-B). A burst changes the acceleration by d in T seconds along the
minimum-jerk curve of Flash and Hogan (1985), with acceleration in place of position,

    d (10 x^3 - 15 x^4 + 6 x^5),   x = (t - t_0) / T,      greatest jerk 1.875 d / T at half time.

A change of mind while a burst is under way adds a second burst to the first, which runs on: so people amend reaching
movements (Flash and Henis 1991, doi:10.1162/jocn.1991.3.3.220).
"""

from __future__ import annotations

PEAK = 1.875  # greatest slope of 10 x^3 - 15 x^4 + 6 x^5, at x = 1/2
SHORTEST, LONGEST = 0.6, 3.0  # s


class Plan:
    """The planned acceleration over time.

    Attributes:
        goal: acceleration after the bursts under way, m/s^2.
    """

    def __init__(self, acceleration: float = 0.0) -> None:
        self.goal = acceleration
        self._bursts: list[tuple[float, float, float]] = []  # start (s), duration (s), change (m/s^2)

    def at(self, time: float) -> tuple[float, float]:
        """Planned acceleration (m/s^2) and jerk (m/s^3) at a time (s) not before that of the last burst."""
        a, j = self.goal, 0.0
        for start, duration, change in self._bursts:
            x = (time - start) / duration
            if x < 1.0:
                a += change * (x * x * x * (10.0 + x * (6.0 * x - 15.0)) - 1.0)
                y = x * (1.0 - x)
                j += 30.0 * change / duration * y * y
        return a, j

    def progress(self, time: float) -> float:
        """How far the last burst is, 0 to 1."""
        if not self._bursts:
            return 1.0
        start, duration, _ = self._bursts[-1]
        return min(1.0, (time - start) / duration)

    def burst(self, time: float, goal: float, duration: float) -> None:
        """Begin a burst that takes the plan to the acceleration `goal` (m/s^2) in `duration` (s)."""
        self._bursts = [b for b in self._bursts if time < b[0] + b[1]]
        self._bursts.append((time, duration, goal - self.goal))
        self.goal = goal


def duration_of(change: float, peak_jerk: float) -> float:
    """Seconds a burst of this change (m/s^2) takes whose jerk peaks at `peak_jerk` (m/s^3), within human bounds.

    Small changes are made more gently than large ones: the peak shrinks to half for a change towards zero.
    """
    size = abs(change)
    return min(LONGEST, max(SHORTEST, PEAK * size / (peak_jerk * min(1.0, 0.5 + 0.35 * size))))
