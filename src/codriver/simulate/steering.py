"""A simulated steering wheel that its force-feedback motor turns: recordings with known J_s and b_s.

    x_{k+1} = tick(x_k, T_k) + w_k,     y_k = delta_k + v_k

The paper's w ~ N(0, 0.01 I), eq. (84), can be read in three ways:

    "step"          w_k has covariance 0.01 I: 5.7 degrees a tick
    "continuous"    0.01 I dt: white noise of the continuous model
    "derivative"    0.01 I dt^2: dt w, w added to the derivative. Preset "okamoto2019": this one reproduces the paper's table 1

v ~ N(0, 0.01 deg^2). Beside the paper's wheel there are Coulomb friction and end stops (stiff springs with damping, in substeps).
Okamoto, Tsiotras 2019 (Robotics and Autonomous Systems), section 4.1.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, pi

import numpy as np

from codriver.errors import UsageError
from codriver.models.steering import Tick, Value, tick_of
from codriver.signals import Log, Signal
from codriver.signals.signal import Array

READINGS = ("step", "continuous", "derivative")
SUBSTEPS = 20  # a tick, where there is friction or an end stop


@dataclass(frozen=True)
class Wheel:
    """A wheel.

    Attributes:
        inertia: J_s, kg m^2.
        damping: b_s, N m s/rad.
        friction: T_c, N m.
        end_stop: rad to either side; infinite where there is none.
        stop_stiffness: N m/rad beyond the end stop.
        stop_damping: N m s/rad beyond it.
    """

    inertia: float = 0.0672
    damping: float = 0.3562
    friction: float = 0.0
    end_stop: float = inf
    stop_stiffness: float = 200.0
    stop_damping: float = 1.0


@dataclass(frozen=True)
class WheelNoise:
    """What disturbs wheel and encoder.

    Attributes:
        reading: of `process`, see the module's docstring.
        process: variance of each state's noise, in the unit of the reading.
        angle: variance of the encoder, rad^2.
        resolution: of the encoder, rad; 0 for none.
    """

    reading: str = "derivative"
    process: float = 0.01
    angle: float = 0.01 * (pi / 180) ** 2
    resolution: float = 0.0

    def tick_variance(self, dt: float) -> float:
        """Variance that each state gathers in a tick.

        Raises:
            UsageError: there is no such reading.
        """
        if self.reading not in READINGS:
            raise UsageError(
                f"the reading '{self.reading}' of the process noise", f"one of {', '.join(READINGS)}", "choose one"
            )
        return self.process * {"step": 1.0, "continuous": dt, "derivative": dt * dt}[self.reading]


@dataclass(frozen=True)
class WheelSetting:
    """A recording to be made.

    Attributes:
        wheel, noise: what turns, and what disturbs.
        plant: "euler", eq. (77), or "exact".
        start: angle and rate, rad and rad/s.
        seconds: length.
        dt: tick, s.
    """

    wheel: Wheel = Wheel()
    noise: WheelNoise = WheelNoise()
    plant: str = "euler"
    start: tuple[float, float] = (1.0, 0.0)
    seconds: float = 15.0
    dt: float = 0.01


SETTINGS = {"okamoto2019": WheelSetting()}


@dataclass(frozen=True, eq=False)
class WheelRuns:
    """Recordings of one wheel under one torque, one a seed.

    Attributes:
        time: s, shape (n,).
        torque: of the motor, N m, shape (n,), held until the next tick.
        angle, rate: true, shape (runs, n).
        measured: angle as the encoder shows it, rad, shape (runs, n).
    """

    time: Array
    torque: Array
    angle: Array
    rate: Array
    measured: Array

    def log(self, run: int = 0) -> Log:
        """One recording: `steering_wheel_angle` and `steering_motor_torque`."""
        return Log.of(
            [
                Signal("steering_wheel_angle", self.time, self.measured[run], "rad", "encoder"),
                Signal("steering_motor_torque", self.time, self.torque, "N*m", "motor"),
            ],
            source=f"simulated wheel, run {run}",
        )


def sine(time: Array, amplitude: float = 2.0, frequency: float = 4.0) -> Array:
    """amplitude sin(frequency t), N m; eq. (83) by default. `frequency` in rad/s."""
    return np.asarray(amplitude * np.sin(frequency * time))


def chirp(time: Array, amplitude: float = 2.0, low: float = 0.1, high: float = 5.0) -> Array:
    """A sine whose frequency grows from `low` to `high`, Hz, in equal ratios over the record."""
    span = float(time[-1] - time[0])
    growth = np.log(high / low) / span
    return np.asarray(amplitude * np.sin(2 * pi * low * np.expm1(growth * (time - time[0])) / growth))


def simulate_wheel(
    torque: Array | None = None, setting: WheelSetting | None = None, *, runs: int = 1, seed: int = 0
) -> WheelRuns:
    """Turn a wheel, several times with noise of different seeds at once.

    Args:
        torque: of the motor at each tick, N m, shape (n,) or of any length; the paper's sine over the setting's length if None.
        setting: wheel, noise and plant; the paper's by default.
        runs: how many recordings; run r has the noise of seed (seed, r), however many there are.
        seed: of the noise.

    Raises:
        UsageError: a setting that cannot be.
    """
    setting = setting or SETTINGS["okamoto2019"]
    if torque is None:
        torque = sine(_ticks(round(setting.seconds / setting.dt) + 1, setting.dt))
    n, dt = torque.size, setting.dt
    sd, sd_angle = np.sqrt(setting.noise.tick_variance(dt)), np.sqrt(setting.noise.angle)
    noise = np.stack([np.random.default_rng([seed, run]).standard_normal((n, 3)) for run in range(runs)])
    kicks = sd * noise[:, :, :2].transpose(1, 2, 0)
    angle, rate = np.empty((runs, n)), np.empty((runs, n))
    angle[:, 0], rate[:, 0] = setting.start
    stepper = _Plant(setting)
    state: tuple[Value, Value] = (angle[:, 0], rate[:, 0])
    each: Value = kicks
    if runs == 1:
        # Plain numbers: the same operations, and several times as quick as arrays of one.
        state, each = (float(angle[0, 0]), float(rate[0, 0])), kicks[:, :, 0].tolist()
    for k, before in enumerate(np.asarray(torque, float)[: n - 1].tolist(), 1):
        free, kick = stepper.step(*state, before), each[k]
        state = free[0] + kick[0], free[1] + kick[1]
        angle[:, k], rate[:, k] = state
    measured = angle + sd_angle * noise[:, :, 2]
    if setting.noise.resolution > 0:
        measured = np.round(measured / setting.noise.resolution) * setting.noise.resolution
    return WheelRuns(_ticks(n, dt), np.asarray(torque, float), angle, rate, measured)


def _ticks(count: int, dt: float) -> Array:
    return np.arange(count, dtype=np.float64) * dt


class _Plant:
    """A tick of the setting's wheel, for many runs at once."""

    def __init__(self, setting: WheelSetting) -> None:
        wheel = setting.wheel
        self.wheel, self.count = wheel, SUBSTEPS if np.isfinite(wheel.end_stop) or wheel.friction else 1
        try:
            tick = tick_of(wheel.inertia, wheel.damping, setting.dt / self.count, setting.plant)
        except ValueError as error:
            raise UsageError(str(error), "exact or euler", "choose one") from None
        self.tick = Tick(*(float(value) for value in (tick.reach, tick.keep, tick.lift, tick.push)))
        self.stops = bool(np.isfinite(wheel.end_stop))

    def step(self, angle: Value, rate: Value, torque: float) -> tuple[Value, Value]:
        """Angle and rate after a tick without noise."""
        wheel = self.wheel
        for _ in range(self.count):
            total: Value = torque
            if self.stops:
                beyond = angle - np.clip(angle, -wheel.end_stop, wheel.end_stop)
                total = torque - wheel.stop_stiffness * beyond - wheel.stop_damping * rate * (beyond != 0)
            angle, rate = self.tick.advance(angle, rate, total, wheel.friction)
        return angle, rate
