"""The states of the motorcycle's large-angle filter (`motorcycle_ekf`), where they start, and what the model leaves out of them.

    x = (phi, delta, v_y, W, phi', delta', Y_f, Y_r, tau, M_phi, theta', b_p, b_q, b_r, b_y, b_z [, delta_0])

delta_0, the zero of the steering encoder, which shows delta + delta_0, is there where it is told to be unknown (`EkfNoise.zero`
above 0), and else no part of the filter at all.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from codriver.models.motorcycle_lean import LEAN_STATES
from codriver.signals.signal import Array

IMU = ("roll_rate", "pitch_rate", "yaw_rate", "lateral_acceleration", "vertical_acceleration")
ROWS = (*IMU, "steer_angle")
# The states in their order, by the names of the outputs.
STATES = (
    "roll_angle", "steer_angle", "lateral_velocity", "heading_rate", "roll_rate", "steer_rate", "front_lateral_force",
    "rear_lateral_force", "rider_torque", "roll_moment", "pitching", *(f"{row}_bias" for row in IMU),
)  # fmt: skip
OFFSET = "steer_offset"  # delta_0, after the others
N, MOVING, LEAN = len(STATES), 8, len(LEAN_STATES)
ROLL, STEER, TURN, LEANING, MOMENT, PITCHING, BIASES = 0, 1, 3, 4, 9, 10, 11
PITCH_TIME, MOMENT_TIME, TILT_TIME, HEAVE_TIME, BEND_TIME = 0.2, 0.5, 0.5, 0.2, 0.5  # s
RATE = 100.0  # Hz, at which the floors of the rows are told
STEEPEST = 1.35  # rad, of a roll that the filter follows
# What states cannot exceed, so that nonsense stays finite; standard deviations at the start. Units of STATES.
BOUNDS = (STEEPEST + 0.1, 1.0, 20.0, 6.0, 10.0, 30.0, 2e4, 2e4, 1e3, 5e3, 3.0, 1.0, 1.0, 1.0, 5.0, 5.0)
MOST_OFFSET = 0.5  # rad
START = (0.15, 0.05, 0.5, 0.2, 0.3, 0.5, 300.0, 300.0, 30.0, 50.0, 0.05, 0.01, 0.01, 0.01, 0.25, 0.25)


@dataclass(frozen=True)
class EkfNoise:
    """What the model leaves out.

    Attributes:
        lateral, yaw, roll, steer: white noise of the accelerations, m/s^2, rad/s^2 per sqrt(Hz).
        tyre: of the tyre forces' rates, N/s per sqrt(Hz).
        torque: of the rider's torque's rate, N m/s per sqrt(Hz).
        moment, feet: sd of M_phi, N m, when riding and what is added when slow.
        pitch: sd of theta', rad/s.
        tilt: sd of the pitch angle, rad, which turns p by W and r by phi' times itself, for `TILT_TIME` seconds.
        gyro_walk, accelerometer_walk: of the biases, rad/s and m/s^2 per sqrt(s).
        share: systematic error of the roll in parts of it, which is told in its standard deviation and not carried.
        heave: error of the vertical acceleration of a lean, which springs take up, in parts of it, for `HEAVE_TIME` seconds.
        zero, creep: sd of the encoder's zero, rad, at the start, and of its walk, rad per sqrt(s); with zero 0 it is known.
        bend: error of the steer angle that a bend takes, in parts of it, for `BEND_TIME` seconds; where the zero is to be found, so
            that bends do not pass for one.
        gyro, lateral_force, vertical_force, encoder: floors of the rows' sd, rad/s, m/s^2, rad, for errors that are independent at
            `RATE`.
    """

    lateral: float = 0.05
    yaw: float = 0.06
    roll: float = 0.06
    steer: float = 0.4
    tyre: float = 400.0
    torque: float = 25.0
    moment: float = 20.0
    feet: float = 600.0
    pitch: float = 0.03
    gyro_walk: float = 0.0005
    accelerometer_walk: float = 1e-3
    share: float = 0.015
    heave: float = 0.3
    tilt: float = 0.012
    gyro: float = 0.003
    lateral_force: float = 0.03
    vertical_force: float = 0.22
    encoder: float = 0.0005
    zero: float = 0.0
    creep: float = 1e-5
    bend: float = 0.05

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states that the filter has, in their order."""
        return (*STATES, OFFSET) if self.zero else STATES

    def start(self) -> tuple[float, ...]:
        """Standard deviations of the states at the start."""
        return (*START, self.zero) if self.zero else START

    def bounds(self) -> tuple[float, ...]:
        """What the states cannot exceed."""
        return (*BOUNDS, MOST_OFFSET) if self.zero else BOUNDS

    def process(self) -> Array:
        """Intensities of the states, shape (16,), or (17,) with the encoder's zero."""
        white = [0.0, 0.0, self.lateral, self.yaw, self.roll, self.steer, self.tyre, self.tyre, self.torque]
        come_and_go = [self.moment * (2 / MOMENT_TIME) ** 0.5, self.pitch * (2 / PITCH_TIME) ** 0.5]
        creep = [self.creep] if self.zero else []
        return np.square([*white, *come_and_go, *[self.gyro_walk] * 3, *[self.accelerometer_walk] * 2, *creep])

    def floors(self, dt: float) -> dict[str, float]:
        """Least variance of a tick's sample, by row."""
        sds = [self.gyro] * 3 + [self.lateral_force, self.vertical_force, self.encoder]
        return {row: sd * sd / (RATE * dt) for row, sd in zip(ROWS, sds, strict=True)}
