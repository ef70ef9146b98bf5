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
from scipy.optimize import least_squares
from scipy.signal import butter, sosfiltfilt

import codriver as cd
from codriver.observers.hands import HandsSettings, hands_observer

NAMES = Path(__file__).parent / "names" / "comma2k19.toml"
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

    time: np.ndarray
    load: np.ndarray
    motor: np.ndarray
    sensor: np.ndarray
    raw: np.ndarray

    def span(self, begin: float, end: float) -> np.ndarray:
        return (self.time > begin) & (self.time < end)

    def estimate(self, fitted: np.ndarray) -> np.ndarray:
        """Driver torque in the motor's counts, by the load that held without hands where `fitted`."""
        coefficients = np.linalg.lstsq(self.load[fitted], self.motor[fitted], rcond=None)[0]
        return np.asarray(self.load @ coefficients - self.motor)


def assisted_column(folder: Path, cutoff: float = 1.0) -> Assisted:
    dbc = folder / COMMA_DBC
    log = cd.read(folder, dbc=dbc, names=NAMES)
    sensor = "STEER_TORQUE_SENSOR.STEER_TORQUE_DRIVER"
    counts = cd.open_recording(folder, dbc=dbc).load([sensor])[sensor]
    begin, dt = log["steering_wheel_angle"].time[0], 0.02
    time = np.arange(0.1, 59.9, dt)
    sos = butter(2, cutoff * 2 * dt, output="sos")

    def at(name: str) -> np.ndarray:
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


def hands_by(torque: np.ndarray, spread: float, correlation: float, dt: float = 0.02) -> np.ndarray:
    """Probability of hands on, by a torque in any unit whose spread without hands and correlation time (s) are known."""
    settings = HandsSettings(
        share=1.0, floor=1e-6 * spread, quiet_torque=0.1 * spread, pulling_torque=2 * spread, correlation=correlation
    )
    there, one = np.ones(torque.size, bool), np.ones(torque.size)
    values = {"driver_torque": torque, "driver_torque_sd": spread * one, "valid": one}
    ok = dict.fromkeys(values, there)
    return cd.compile(hands_observer(dt, settings)).run_grid(cd.Grid(one.cumsum() * dt, dt, values, ok, ok))["hands_on"]


def correlation_time(x: np.ndarray, dt: float = 0.02) -> float:
    """Where the autocorrelation first falls below 1/e, s."""
    x = x - x.mean()
    for k in range(1, x.size):
        if x[k:] @ x[:-k] < (x @ x) / np.e:
            return k * dt
    raise AssertionError("the record is shorter than its correlation time")


def explained(y: np.ndarray, by: np.ndarray) -> float:
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

    time: np.ndarray
    torque: np.ndarray
    sideslip: np.ndarray
    yaw_over_speed: np.ndarray
    angle: np.ndarray
    lateral: np.ndarray

    def slip(self, front: float, ratio: float) -> np.ndarray:
        """The bracket of eq. (92): minus the front slip angle, rad."""
        return self.sideslip + front * self.yaw_over_speed - self.angle / ratio


def shaft(path: Path) -> Shaft:
    log = cd.read(path)
    surface = cd.open_recording(path).load(["PlayerTrackSurface"])["PlayerTrackSurface"].values
    speed = log["longitudinal_speed"].values
    on = (surface == 3) & (speed > 8)
    at = {name: log[name].values[on] for name in log if log[name].values.shape == on.shape}
    return Shaft(
        log["longitudinal_speed"].time[on] - log["longitudinal_speed"].time[0], -at["steering_wheel_torque"],
        np.arctan2(at["lateral_velocity"], speed[on]), at["yaw_rate"] / speed[on], at["steering_wheel_angle"],
        at["lateral_acceleration"],
    )  # fmt: skip


def linear(s: Shaft, fitted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Eq. (92) by least squares: K, l_f, g_s; and T_aln of all samples."""
    X = np.column_stack([s.sideslip, s.yaw_over_speed, -s.angle])
    c = np.linalg.lstsq(X[fitted], s.torque[fitted], rcond=None)[0]
    return np.array([c[0], c[1] / c[0], c[0] / c[2]]), X @ c


def brush(s: Shaft, fitted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The saturating form: K, l_f, g_s, a; and T_aln of all samples."""

    def model(p: np.ndarray) -> np.ndarray:
        alpha = s.slip(p[1], p[2])
        return p[0] * p[3] / 3 * np.sign(alpha) * (1 - (1 - np.minimum(abs(alpha) / p[3], 1)) ** 3)

    start = [*linear(s, fitted)[0], 0.1]
    p = least_squares(lambda p: (model(p) - s.torque)[fitted], start, x_scale=np.abs(start)).x
    return p, model(p)


def regression(s: Shaft, fitted: np.ndarray, *features: np.ndarray) -> np.ndarray:
    """T_aln of all samples by least squares on some features."""
    X = np.column_stack(features)
    return np.asarray(X @ np.linalg.lstsq(X[fitted], s.torque[fitted], rcond=None)[0])
