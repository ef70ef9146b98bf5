"""Speed and its rate from samples of the speed: an alpha-beta filter, critically damped, on scalars.

    v- = v + dt a,   e = y - v-,   v = v- + (1 - p^2) e,   a = a + (1 - p)^2 / (n dt) e,   p = exp(-n w dt)

n ticks since the last sample; w in rad/s. After `FORGOTTEN` seconds without one the rate is taken as 0.
Kalata 1984, doi:10.1109/TAES.1984.310438.
"""

from __future__ import annotations

from math import exp

from codriver.kernel import Scalar, both, minimum, negate, select
from codriver.observers.observer import Scalars

FORGOTTEN = 1.0  # s
CARRY = {"speed": 0.0, "speed_rate": 0.0, "speed_faded": 1.0, "speed_waited": 0.0, "speed_known": 0.0}


def track_speed(carry: Scalars, measured: Scalar, fresh: Scalar, quickness: float, dt: float) -> Scalars:
    """The carry a tick later: `speed`, m/s, `speed_rate`, m/s^2, `speed_known`, 1 once one came, and the filter's own.

    Args:
        carry: of the tick before.
        measured: speed, m/s; not looked at where it is not fresh.
        fresh: 1 where it is.
        quickness: w, rad/s.
        dt: tick, s.
    """
    first = both(fresh, negate(carry["speed_known"]))
    faded, waited = carry["speed_faded"] * exp(-quickness * dt), carry["speed_waited"] + dt
    ahead = carry["speed"] + dt * carry["speed_rate"]
    e = select(fresh, measured - ahead, 0.0)
    rate = select(waited > FORGOTTEN, 0.0, carry["speed_rate"] + (1 - faded) * (1 - faded) / waited * e)
    return {
        "speed": select(first, measured, ahead + (1 - faded * faded) * e), "speed_rate": select(first, 0.0, rate),
        "speed_faded": select(fresh, 1.0, faded), "speed_waited": select(fresh, 0.0, minimum(waited, 2 * FORGOTTEN)),
        "speed_known": select(fresh, 1.0, carry["speed_known"]),
    }  # fmt: skip
