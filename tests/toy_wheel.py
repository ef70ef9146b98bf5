"""An observer that is not longitudinal at all: a steering wheel's torque from its angle, with fixed gains.

What judges, writes or draws estimates must do so for this one too, though it knows none of its names.
"""

import numpy as np

import codriver as cd
from codriver.observers import Observer, Output

DT, INERTIA = 0.01, 0.05  # s, kg m^2
GAINS = (0.3, 5.0, 40.0)  # of angle, rate and torque / inertia
OUTPUTS = (
    Output("steering_wheel_angle", "rad", "estimate", "angle of the wheel"),
    Output("driver_torque", "N*m", "estimate", "torque of the driver's hands"),
    Output("steering_wheel_angle_sd", "rad", "sd"),
    Output("driver_torque_sd", "N*m", "sd"),
    Output("angle_innovation", "rad", "innovation"),
    Output("angle_innovation_sd", "rad", "innovation_sd"),
)


def toy_wheel(innovation_sd: float = 0.0013, sd: float = 0.05, outputs=OUTPUTS, **changes) -> Observer:
    """The observer; it has no flag `valid` and no knob."""

    def step(carry, u, y, ok, rho):
        angle = carry["angle"] + DT * carry["rate"]
        rate = carry["rate"] + DT * carry["acceleration"]
        e = ok["steering_wheel_angle"] * (y["steering_wheel_angle"] - angle)
        new = {"angle": angle + GAINS[0] * e, "rate": rate + GAINS[1] * e}
        new["acceleration"] = carry["acceleration"] + GAINS[2] * e
        out = {
            "steering_wheel_angle": new["angle"], "driver_torque": INERTIA * new["acceleration"],
            "steering_wheel_angle_sd": 0.001, "driver_torque_sd": sd, "angle_innovation": e,
            "angle_innovation_sd": innovation_sd, "valid": 1.0,
        }  # fmt: skip
        return new, out

    fields = dict(
        name="toy-wheel", dt=DT, inputs=(), measured=("steering_wheel_angle",), step=step, outputs=tuple(outputs),
        carry=dict.fromkeys(("angle", "rate", "acceleration"), 0.0),
    )  # fmt: skip
    return Observer(**{**fields, **changes})


def wheel_log(seconds: float = 30.0) -> cd.Log:
    """A wheel that is turned to and fro, with the torque that does it measured too."""
    t = np.arange(round(seconds / DT)) * DT
    angle = 0.5 * np.sin(t) + 0.001 * np.random.default_rng(4).standard_normal(t.size)
    return cd.Log.of(
        [
            cd.Signal("steering_wheel_angle", t, angle, "rad", "wheel.angle"),
            cd.Signal("driver_torque", t, -0.5 * INERTIA * np.sin(t), "N*m", "wheel.torque"),
        ],
        source="recordings/wheel.csv",
    )
