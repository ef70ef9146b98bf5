"""Roll from gyroscope and speed alone: the baseline that everybody has.

    phi' = p - b_p + w,     phi_m = -asin(c v r / g) + e        p, r in body axes; sin phi = -v r / g in a turn

The roll rate is added up, and held by the lean of a balanced turn, with the rate's bias b_p as a state: a Kalman filter of two
states, which settles to the usual complementary filter. phi_m errs slowly, with the manoeuvre; an error of sd s that lasts T s
counts as white noise of intensity 2 s^2 T. c = 1 is a point mass on thin tyres. With a motorcycle's parameters c puts right, for
small leans, what crowns rho and the wheels' spin take:

    c = (H + sum(i / R) / M) / (H - rho),    H height of the mass centre, rho at it

It knows nothing of the yaw rate's bias, of pitch, of bank, and of the time that a tyre takes. `valid` is 1 where signals come, the
speed is above `SLOWEST`, v r / g below the sine of the greatest lean, and the roll's standard deviation below `SURE`.

Boniolo, Savaresi, Tanelli 2009, doi:10.1109/TCST.2008.2005739 (of such estimators); Cossalter 2006, chapter 4 (c).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np

from codriver.kernel import both, either, negate, select, sqrt
from codriver.models.motorcycle_lean import LeanParameters
from codriver.models.road_frame import GRAVITY
from codriver.models.road_frame import STEEPEST as STEEPEST_SINE
from codriver.names import quantity
from codriver.observers.arrivals import all_came, arrivals_carry, note_arrivals
from codriver.observers.augmented_kalman import Moments, carried, pack, unpack
from codriver.observers.covariance import predict_covariance, update_row
from codriver.observers.observer import Observer, Output, Scalars
from codriver.observers.scaled_gain import check_tick

SPEED = "longitudinal_speed"
RATES = ("roll_rate", "yaw_rate")
SLOWEST = 4.0  # m/s
GAP, STALE = 1.0, 0.25  # s
SURE = 5 * pi / 180
STEEPEST = 1.5  # rad
START = (0.3, 0.02)  # rad, rad/s
NAMES = ("roll_angle", "roll_rate_bias")


@dataclass(frozen=True)
class ImuNoise:
    """What is wrong with rate and turn.

    Attributes:
        rate: white noise of p, rad/s per sqrt(Hz).
        walk: of its bias, rad/s per sqrt(s).
        turn: s, sd of phi_m, rad.
        lasting: T, s.
    """

    rate: float = 0.01
    walk: float = 3e-4
    turn: float = 0.04
    lasting: float = 0.5


def crown_correction(p: LeanParameters) -> float:
    """c of a machine.

    Args:
        p: the machine.
    """
    q = p.sharp
    spin = (q.ify / q.Rf + q.iry / q.Rr) / q.mass
    return (p.height + spin) / (p.height - p.crown(0.0))


def motorcycle_imu(dt: float = 0.01, correction: float = 1.0, noise: ImuNoise | None = None) -> Observer:
    """The estimator.

    Args:
        dt: tick, s.
        correction: c.
        noise: of rate and turn.

    Raises:
        UsageError: a tick that cannot be.
    """
    check_tick(dt)
    noise = noise or ImuNoise()
    Q = np.diag([noise.rate**2 * dt, noise.walk**2 * dt]).tolist()
    R = 2 * noise.turn**2 * noise.lasting / dt
    F = [[1.0, -dt], [0.0, 1.0]]

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        import casadi as ca

        v = select(ok[SPEED], rho[SPEED], carry["speed"])
        came = note_arrivals(carry, RATES, y, ok, dt)
        turning = both(ok["yaw_rate"], ok[SPEED])
        there = both(ok[SPEED], all_came(came, RATES, STALE))
        begun, active = carry["begun"], select(carry["begun"], 1.0, there)
        p, r = came["latest_roll_rate"], came["latest_yaw_rate"]
        sine = correction * v * r * (-1 / GRAVITY)
        outside = either(sine > STEEPEST_SINE, sine < -STEEPEST_SINE)
        lean = ca.asin(select(sine > STEEPEST_SINE, STEEPEST_SINE, select(sine < -STEEPEST_SINE, -STEEPEST_SINE, sine)))
        now = unpack(carry, 2)
        moved = [now.x[0] + dt * (0.5 * (p + carry["latest_roll_rate"]) - now.x[1]), now.x[1]]
        P = predict_covariance(now.P, F, Q)
        x = [select(begun, moved[0], lean), select(begun, moved[1], 0.0)]
        P = [[select(begun, P[i][j], START[i] ** 2 if i == j else 0.0) for j in range(2)] for i in range(2)]
        use = both(active, both(turning, v > SLOWEST))
        e = select(use, lean - x[0], 0.0)
        x, P, s = update_row(x, P, [1.0, 0.0], e, R, use)
        x = [select(a > b, b, select(a < -b, -b, a)) for a, b in zip(x, (STEEPEST, 0.5), strict=True)]
        x = [select(active, a, 0.0) for a in x]
        keep = both(active, all_came(came, RATES, GAP))
        sds = [sqrt(select(P[i][i] > 0, P[i][i], 0.0)) for i in range(2)]
        inside = both(ok[SPEED], both(v > SLOWEST, negate(outside)))
        valid = both(both(keep, there), both(inside, sds[0] < SURE))
        out = {
            "roll_angle": x[0], "roll_angle_sd": sds[0], "roll_rate_bias": x[1], "roll_rate_bias_sd": sds[1],
            "turn_innovation": e, "turn_innovation_sd": sqrt(s), "lean_in_range": negate(outside), "valid": valid,
        }  # fmt: skip
        new = {**pack(Moments(x, P)), **came, "speed": v, "begun": keep}
        return {key: new[key] for key in begin}, out

    begin = {**carried(2), **arrivals_carry(RATES), "speed": 0.0, "begun": 0.0}
    outputs = (
        Output("roll_angle", "rad", "estimate", quantity("roll_angle").meaning),
        Output("roll_angle_sd", "rad", "sd", "standard deviation of roll_angle"),
        Output("roll_rate_bias", "rad/s", "estimate", "bias of roll_rate"),
        Output("roll_rate_bias_sd", "rad/s", "sd", "standard deviation of roll_rate_bias"),
        Output(
            "turn_innovation", "rad", "innovation", "lean of a balanced turn less predicted; 0 where none is to be had"
        ),
        Output("turn_innovation_sd", "rad", "innovation_sd", "standard deviation of turn_innovation"),
        Output("lean_in_range", "1", "flag", "1 where v r / g is below the sine of the greatest lean"),
        Output("valid", "1", "flag", "1 where signals come, it moves, and the roll is known to 5 degrees"),
    )
    return Observer(
        "motorcycle-imu", dt, (), RATES, begin, outputs, step, scheduling=(SPEED,), settings={"correction": correction}
    )
