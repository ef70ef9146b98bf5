"""The torque balance of two recorded columns: a car whose assistant steers (comma2k19), and a simulator's (iRacing).

Driver torque in the car, and shaft torque in the simulator, 2019 eq. (92), the second for a brush tyre that slides from a on:

    T_dr  = load - T_m
    load  = c_0 + (c_1 + c_2 v^2) delta + c_3 v r + c_4 delta' + c_5 tanh(delta' / (1 deg/s)) + c_6 delta''
    T_aln = K alpha,                                                    alpha = beta + l_f r / v - delta_s / g_s
    T_aln = K a / 3 (1 - (1 - |alpha| / a)^3) sgn alpha
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

import codriver.program as programs
from codriver.logs import open_recording, read
from codriver.logs.names_file import parse_names
from codriver.observers.hands import HandsSettings, hands_observer
from codriver.papers.steering2019.runs import on_grid
from codriver.signals.grid import Flags
from codriver.signals.signal import Array

# The motor's torque as the car counts it, positive to the left: it goes with the wheel's motion.
NAMES = parse_names(
    """
    [longitudinal_speed]
    source = ["WHEEL_SPEEDS.WHEEL_SPEED_RL", "WHEEL_SPEEDS.WHEEL_SPEED_RR"]
    [yaw_rate]
    source = "KINEMATICS.YAW_RATE"
    [steering_wheel_angle]
    source = "CAN/steering_angle"
    [steering_motor_command]
    source = "STEER_TORQUE_SENSOR.STEER_TORQUE_EPS"
    unit = "1"
    """,
    "names of the Toyota",
)
COMMA_DBC = "toyota_new_mc_pt_full.dbc"
HANDS_LEAVE = 9.0  # s


@dataclass(frozen=True, eq=False)
class Assisted:
    """The car's column on ticks of 20 ms, everything low-passed at 1 Hz, forwards and backwards.

    Attributes:
        time: from the log's begin, s.
        load: the regressors of the load, shape (n, 7).
        motor: torque of the motor, counts.
        sensor: torque sensor of the column, counts; `raw` without low-pass.
    """

    time: Array
    load: Array
    motor: Array
    sensor: Array
    raw: Array

    def span(self, begin: float, end: float) -> Flags:
        """The ticks between two times, s."""
        return np.asarray((self.time > begin) & (self.time < end))

    def estimate(self, fitted: Flags) -> Array:
        """Driver torque in the motor's counts, by the load that held without hands where `fitted`."""
        coefficients = np.linalg.lstsq(self.load[fitted], self.motor[fitted], rcond=None)[0]
        return np.asarray(self.load @ coefficients - self.motor)


def assisted_column(folder: Path, cutoff: float = 1.0) -> Assisted:
    """The minute of comma2k19's Toyota.

    Args:
        folder: of the recording, with its DBC.
        cutoff: of the low-pass, Hz.
    """
    from scipy.signal import butter, sosfiltfilt

    dbc = folder / COMMA_DBC
    log = read(folder, dbc=dbc, names=NAMES)
    sensor = "STEER_TORQUE_SENSOR.STEER_TORQUE_DRIVER"
    counts = open_recording(folder, dbc=dbc).load([sensor])[sensor]
    begin, dt = log["steering_wheel_angle"].time[0], 0.02
    time = np.arange(0.1, 59.9, dt)
    sos = butter(2, cutoff * 2 * dt, output="sos")

    def at(name: str) -> Array:
        return np.interp(time, log[name].time - begin, log[name].values)

    angle, speed, yaw = at("steering_wheel_angle"), at("longitudinal_speed"), at("yaw_rate")
    raw = np.interp(time, counts.time - begin, counts.values)
    delta = sosfiltfilt(sos, angle)
    rate = np.gradient(delta, dt)
    rows = [
        np.ones(time.size), delta, sosfiltfilt(sos, speed**2 * angle), sosfiltfilt(sos, speed * yaw), rate,
        sosfiltfilt(sos, np.tanh(rate / np.deg2rad(1))), np.gradient(rate, dt),
    ]  # fmt: skip
    motor = sosfiltfilt(sos, at("steering_motor_command"))
    return Assisted(time, np.transpose(rows), motor, sosfiltfilt(sos, raw), raw)


def hands_by(torque: Array, spread: float, correlation: float, dt: float = 0.02) -> Array:
    """Probability of hands on, by a torque in any unit whose spread without hands and correlation time (s) are known."""
    settings = HandsSettings(
        share=1.0, floor=1e-6 * spread, quiet_torque=0.1 * spread, pulling_torque=2 * spread, correlation=correlation
    )
    one = np.ones(torque.size)
    grid = on_grid(one.cumsum() * dt, {"driver_torque": torque, "driver_torque_sd": spread * one, "valid": one})
    return programs.compile(hands_observer(dt, settings)).run_grid(grid)["hands_on"]


def correlation_time(x: Array, dt: float = 0.02) -> float:
    """Where the autocorrelation first falls below 1/e, s."""
    x = x - x.mean()
    for k in range(1, x.size):
        if x[k:] @ x[:-k] < (x @ x) / np.e:
            return k * dt
    return x.size * dt


def explained(y: Array, by: Array) -> float:
    """R2."""
    return float(1 - np.sum((y - by) ** 2) / np.sum((y - y.mean()) ** 2))


@dataclass(frozen=True, eq=False)
class Shaft:
    """The simulator's column on its own ticks of 1/60 s, where the car is on the track and quicker than 8 m/s.

    Attributes:
        time: from the log's begin, s.
        torque: of the shaft on the wheel, N m, positive to the left: T_aln.
        sideslip, yaw_over_speed, angle: beta, r / v (1/m) and delta_s.
        lateral: acceleration, m/s^2.
    """

    time: Array
    torque: Array
    sideslip: Array
    yaw_over_speed: Array
    angle: Array
    lateral: Array

    def slip(self, front: float, ratio: float) -> Array:
        """The bracket of eq. (92): minus the front slip angle, rad."""
        return self.sideslip + front * self.yaw_over_speed - self.angle / ratio


def shaft(path: Path) -> Shaft:
    """The lap of a recording of iRacing."""
    log = read(path)
    surface = open_recording(path).load(["PlayerTrackSurface"])["PlayerTrackSurface"].values
    speed = log["longitudinal_speed"].values
    on = (surface == 3) & (speed > 8)
    at = {name: log[name].values[on] for name in log if log[name].values.shape == on.shape}
    return Shaft(
        log["longitudinal_speed"].time[on] - log["longitudinal_speed"].time[0], -at["steering_wheel_torque"],
        np.arctan2(at["lateral_velocity"], speed[on]), at["yaw_rate"] / speed[on], at["steering_wheel_angle"],
        at["lateral_acceleration"],
    )  # fmt: skip


def linear(s: Shaft, fitted: Flags) -> tuple[Array, Array]:
    """Eq. (92) by least squares: K, l_f, g_s; and T_aln of all samples."""
    X = np.column_stack([s.sideslip, s.yaw_over_speed, -s.angle])
    c = np.linalg.lstsq(X[fitted], s.torque[fitted], rcond=None)[0]
    return np.array([c[0], c[1] / c[0], c[0] / c[2]]), X @ c


def brush(s: Shaft, fitted: Flags) -> tuple[Array, Array]:
    """The saturating form: K, l_f, g_s, a; and T_aln of all samples."""
    from scipy.optimize import least_squares

    def model(p: Array) -> Array:
        alpha = s.slip(p[1], p[2])
        return np.asarray(p[0] * p[3] / 3 * np.sign(alpha) * (1 - (1 - np.minimum(abs(alpha) / p[3], 1)) ** 3))

    start = [*linear(s, fitted)[0], 0.1]
    p = least_squares(lambda p: (model(p) - s.torque)[fitted], start, x_scale=np.abs(start)).x
    return p, model(p)


def regression(s: Shaft, fitted: Flags, *features: Array) -> Array:
    """T_aln of all samples by least squares on some features."""
    X = np.column_stack(features)
    return np.asarray(X @ np.linalg.lstsq(X[fitted], s.torque[fitted], rcond=None)[0])
