"""Whether the signals of a driver's drive go together: what betrays a wrong sign or unit, which a fit can explain away.

    delta_s  goes with rho      the wheel is turned the way the road bends: delta_s / rho = i (l + K v^2), m
    T_dr     goes with delta_s  the driver holds the wheel against the tyres
    y'       = v (psi + beta)   offset and heading error are of one path, and the speed is right; beta, which at one speed goes
                                with rho, is taken out of both sides

Sizes are compared only where the correlation says that two signals belong together.
"""

from __future__ import annotations

import numpy as np

from codriver.finding import Finding
from codriver.identify.driver_lateness import late_findings
from codriver.identify.driver_record import DriverRecord
from codriver.signals.signal import Array

AGAINST = -0.5  # correlation; a wrong sign gives -0.8 to -1 on the simulated circuit
TOGETHER = 0.5
ANGLE_OVER_BEND = (8.0, 800.0)  # m; i from 8 to 25, l from 2 to 6 m, and as much again for what the tyres give way
HEADING_SLOPES = (0.4, 2.5)
MOST_TORQUE = 30.0  # N m, standard deviation: nobody pulls like that
STEP = 0.5  # s, over which the offset's change is taken


def sign_findings(record: DriverRecord) -> tuple[Finding, ...]:
    """Judged sentences, none where nothing is odd.

    Args:
        record: a drive with curves.
    """
    rows = slice(record.first, record.last)
    angle, torque, bend = record.angle[rows], record.torque[rows], record.curvature[rows]
    found = _turning(angle, bend, record.source)
    with_angle, _ = _pair(angle, torque)
    if with_angle < AGAINST:
        found.append(_bad(f"{record.source}: the driver's torque goes against the wheel's angle (correlation {with_angle:.2f})",
                          "one of the two has the wrong sign: set sign = -1 in the names file"))  # fmt: skip
    if (sd := float(torque.std())) > MOST_TORQUE:
        found.append(
            _bad(f"{record.source}: the torque varies by {sd:.3g} N m (sd), which no driver pulls", "look at its unit")
        )
    found += late_findings(angle, torque, record.dt, record.source)
    if not record.summed:
        found += _path(record, rows)
    return tuple(found)


def _turning(angle: Array, bend: Array, source: str) -> list[Finding]:
    """The wheel's angle against the road."""
    alike, ratio = _pair(bend, angle)
    if alike < AGAINST:
        return [_bad(f"{source}: the wheel is turned against the road's bends (correlation {alike:.2f})",
                     "steering_wheel_angle or road_curvature has the wrong sign: both are positive to the left")]  # fmt: skip
    least, most = ANGLE_OVER_BEND
    if alike > TOGETHER and not least < ratio < most:
        return [_bad(f"{source}: the wheel turns {ratio:.2g} rad for a curvature of 1 1/m, a car {least:g} to {most:g}",
                     "look at the units of steering_wheel_angle and road_curvature")]  # fmt: skip
    return []


def _path(record: DriverRecord, rows: slice) -> list[Finding]:
    """The offset's change against the heading error."""
    n = max(round(STEP / record.dt), 1)
    moved = np.diff(record.offset[rows][::n])
    should, bent = (
        record.speed * record.dt * np.diff(np.cumsum(x[rows])[::n]) for x in (record.heading, record.curvature)
    )
    alike, ratio = _pair(_without(moved, bent), _without(should, bent))
    if alike < AGAINST:
        return [_bad(f"{record.source}: the offset goes against the heading error (correlation {alike:.2f})",
                     "one of the two has the wrong sign: both are the car's from the path, positive to the left")]  # fmt: skip
    least, most = HEADING_SLOPES
    if alike > TOGETHER and not least < ratio < most:
        return [_bad(f"{record.source}: speed and heading error move the car {ratio:.2g} times as far as the offset says",
                     "look at the units of heading_error, longitudinal_speed and lateral_offset")]  # fmt: skip
    return []


def _without(x: Array, other: Array) -> Array:
    """A column without its mean and what goes with another."""
    x, other = x - x.mean(), other - other.mean()
    power = float(other @ other)
    return np.asarray(x - other * (float(x @ other) / power)) if power > 0 else x


def _pair(x: Array, y: Array) -> tuple[float, float]:
    """Correlation of two columns, and how many times as much the second varies; 0 and 1 where one rests."""
    a, b = float(np.std(x)), float(np.std(y))
    if x.size < 2 or not a > 0 or not b > 0:
        return 0.0, 1.0
    return float(np.corrcoef(x, y)[0, 1]), b / a


def _bad(said: str, do: str) -> Finding:
    return Finding("bad", f"{said}; {do}")
