"""Gyroscope and accelerometer of a leaning machine, turned into the road's frame: `models.road_frame` as an observer's step.

"squares" is the paper's eq. (17), (19); "turn" needs neither root nor sign. Outputs bear the names of the inputs, so that in a
chain what stands behind sees the road's frame.
"""

from __future__ import annotations

from typing import Literal

from codriver.errors import UsageError
from codriver.kernel import Scalar, both, select
from codriver.models.road_frame import by_squares, by_turn
from codriver.observers.observer import Observer, Output, Scalars
from codriver.observers.scaled_gain import check_tick

BODY = ("lateral_acceleration", "vertical_acceleration", "pitch_rate", "yaw_rate")
TURN = ("longitudinal_speed", "yaw_rate")


def road_frame_observer(
    dt: float, way: Literal["squares", "turn"] = "turn", *, acceleration_noise: float = 0.1, rate_noise: float = 0.005
) -> Observer:
    """The conversion as an observer without states.

    Args:
        dt: tick, s.
        way: see the module's docstring.
        acceleration_noise, rate_noise: sensors' noise, m/s^2 and rad/s, for the flag of a doubtful sign.

    Raises:
        UsageError: no such way, or a tick that cannot be.
    """
    check_tick(dt)
    if way not in ("squares", "turn"):
        raise UsageError(f"way '{way}'", "squares or turn", "choose one")
    inputs = BODY if way == "squares" else TURN

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        there: Scalar = 1.0
        for name in inputs:
            there = both(there, ok[name])
        seen = [select(ok[name], u[name], 0.0) for name in inputs]
        if way == "squares":
            made = by_squares(*seen, acceleration_noise=acceleration_noise, rate_noise=rate_noise)
        else:
            made = by_turn(*seen)
        return {}, {
            "lateral_acceleration": made.lateral_acceleration, "yaw_rate": made.yaw_rate,
            "outside_domain": both(there, made.outside), "sign_doubtful": both(there, made.doubtful_sign),
            "road_frame_valid": there,
        }  # fmt: skip

    outputs = (
        Output("lateral_acceleration", "m/s^2", "input", "along the road, positive to the left"),
        Output("yaw_rate", "rad/s", "input", "about the vertical, positive to the left"),
        Output("outside_domain", "1", "flag", "1 where a root's argument, or a lean, is outside its range and was cut"),
        Output("sign_doubtful", "1", "flag", "1 where a sign was taken from a signal within its noise"),
        Output("road_frame_valid", "1", "flag", "1 where all signals are there"),
    )
    return Observer(f"road-frame-{way}", dt, inputs, (), {}, outputs, step, settings={"way": way})
