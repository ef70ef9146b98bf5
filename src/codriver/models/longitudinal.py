"""The longitudinal model of a driver's intention.

    v'   = a_i + u         speed, m/s
    a_i' = j_i             intentional acceleration, m/s^2
    o_a' = 0               accelerometer offset g sin(slope) + bias, m/s^2
    j_i' = 0               intentional jerk, m/s^3
    y1   = a_i + o_a + u   accelerometer, m/s^2
    y2   = v               speed from the wheels, m/s

u, m/s^2, is what the powertrain adds to the driver's intention; with u = 0 it is the kinematic model, and a_i, j_i are the
vehicle's own acceleration and jerk.

Bisoffi et al. 2017, eq. (11), doi:10.1109/TMECH.2017.2716838; Bisoffi et al. 2015, eq. (11), doi:10.1109/ITSC.2015.301.
"""

from __future__ import annotations

import numpy as np

from codriver.models.state_space import StateSpace


def intention_model() -> StateSpace:
    """The model of eq. (11): four states, one known input, two outputs."""
    return StateSpace(
        A=np.array([[0, 1, 0, 0], [0, 0, 0, 1], [0, 0, 0, 0], [0, 0, 0, 0]], float),
        B=np.array([[1], [0], [0], [0]], float),
        C=np.array([[0, 1, 1, 0], [1, 0, 0, 0]], float),
        D=np.array([[1], [0]], float),
        states=("longitudinal_speed", "intentional_acceleration", "acceleration_offset", "intentional_jerk"),
        inputs=("known_input",),
        outputs=("longitudinal_acceleration", "longitudinal_speed"),
    )
