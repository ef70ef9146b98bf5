"""Drives in which hands come on and off: a car that keeps its lane by a motor on the steering column, and a driver who adds to it.

    J_s delta'' + b_s delta' + T_c sign(delta') = T_dr + T_m + T_aln          column, models/steering.py
    kappa = delta / (g_s (l + l_u v^2))                                       curvature that the wheel angle makes
    psi' = v (kappa - rho) + gust,     y' = v psi                             heading and place in the lane
    T_aln = -c v^2 kappa                                                      tyres, less what the base assist takes

The motor has a share of the torque that its own line needs, all of it while hands are off. Hands that steer follow a line of
their own, late and unsteadily: what the motor leaves, a pull to their angle, and a wandering torque. Hands that rest give a tiny
torque that wanders. Dwell times are log-normal, so they have a typical length, which the exponential ones of `observers.hands` have
not. What an estimator gets is the angle in steps of the encoder, the motor's torque, and the tyres' torque with errors: a wrong
factor and a slow wander, as of an eq. (92) whose coefficients were identified.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import pi

import numpy as np

from codriver.models.steering import tick_of
from codriver.signals import Log, Signal
from codriver.signals.signal import Array
from codriver.simulate.steering import Wheel
from codriver.vehicles import Vehicle

SUBSTEPS = 4  # of the column, a tick
OFF, RESTING, STEERING = 0, 1, 2


@dataclass(frozen=True)
class HandsSetting:
    """Car, driver and sensors.

    Attributes:
        wheel: the column.
        speed: v, m/s.
        seconds, dt: length and tick, s.
        ratio: g_s; base: l, m; understeer: l_u, s^2/m; caster: c, N m per m/s^2.
        off_dwell, on_dwell, resting_dwell, steering_dwell: mean dwell times, s; `spread`: sd of their logarithms.
        steering_first: share of the times hands come on that they steer at once.
        curvature: rms of the road's, 1/m, over 8 s; gust: rms of its yaw rate, rad/s, over 1 s.
        least_share: of the motor while hands are on; each time it is drawn from here to 1.
        resting_torque: rms, N m, over 0.7 s; unsteadiness: rms of steering hands, N m, over 0.3 s.
        resolution: of the encoder, rad.
        factor_error: sd of the tyre torque's wrong factor from drive to drive; wander: rms of its error, N m, over 3 s.
    """

    wheel: Wheel = field(default_factory=lambda: Wheel(0.04, 0.3, 0.1))
    speed: float = 25.0
    seconds: float = 600.0
    dt: float = 0.01
    ratio: float = 16.0
    base: float = 2.7
    understeer: float = 0.003
    caster: float = 1.0
    off_dwell: float = 25.0
    on_dwell: float = 35.0
    resting_dwell: float = 6.0
    steering_dwell: float = 8.0
    spread: float = 0.7
    steering_first: float = 0.7
    curvature: float = 0.0015
    gust: float = 0.003
    least_share: float = 0.3
    resting_torque: float = 0.04
    unsteadiness: float = 0.15
    resolution: float = 0.1 * pi / 180
    factor_error: float = 0.05
    wander: float = 0.05

    def vehicle(self) -> Vehicle:
        """The column as a vehicle file would have it: inertia, damping, friction."""
        numbers = {
            "steering_inertia": self.wheel.inertia,
            "steering_damping": self.wheel.damping,
            "steering_friction": self.wheel.friction,
        }
        made = Vehicle("simulated-hands", "simulated steering column", "codriver.simulate.hands", {})
        for name, value in numbers.items():
            made = made.with_parameter(name, value, source="codriver.simulate.hands")
        return made


@dataclass(frozen=True, eq=False)
class HandsDrives:
    """Drives of one setting, one a seed.

    Attributes:
        time: s, shape (n,).
        state: 0 off, 1 resting, 2 steering, shape (drives, n).
        driver_torque, motor_torque, alignment_torque: true, N m, shape (drives, n).
        known_alignment: what an estimator is told of the tyres, N m, shape (drives, n).
        angle: true, rad; measured: by the encoder; offset: from the middle of the lane, m; shape (drives, n).
    """

    time: Array
    state: Array
    driver_torque: Array
    motor_torque: Array
    alignment_torque: Array
    known_alignment: Array
    angle: Array
    measured: Array
    offset: Array

    @property
    def hands_on(self) -> Array:
        """1 where hands are on, else 0, shape (drives, n)."""
        return np.asarray((self.state != OFF).astype(float))

    def log(self, drive: int = 0) -> Log:
        """What an estimator gets: the angle, and the torque of tyres and motor as far as it is known."""
        known = self.known_alignment[drive] + self.motor_torque[drive]
        angle = Signal("steering_wheel_angle", self.time, self.measured[drive], "rad", "encoder")
        torque = Signal("alignment_torque", self.time, known, "N*m", "tyre model and motor")
        return Log.of([angle, torque], source=f"simulated hands, drive {drive}")

    def truth(self, drive: int = 0) -> Log:
        """What was true: hands_on (0 or 1) and driver_torque."""
        on = Signal("hands_on", self.time, self.hands_on[drive], "1", "simulation")
        torque = Signal("driver_torque", self.time, self.driver_torque[drive], "N*m", "simulation")
        return Log.of([on, torque], source=f"simulated hands, truth of drive {drive}")


def simulate_hands(setting: HandsSetting | None = None, *, drives: int = 1, seed: int = 0) -> HandsDrives:
    """Drive, several times at once.

    Args:
        setting: car, driver and sensors.
        drives: how many; drive d has the noise of seed (seed, d), however many there are.
        seed: of the noise.
    """
    s = setting or HandsSetting()
    n = round(s.seconds / s.dt) + 1
    rngs = [np.random.default_rng([seed, drive]) for drive in range(drives)]
    plans = [_hands(s, n, rng) for rng in rngs]
    state, share = np.stack([p[0] for p in plans]), np.stack([p[1] for p in plans])
    wandering = {
        name: np.stack([_wander(rng, n, s.dt, rms, over) for rng in rngs])
        for name, rms, over in (
            ("road", s.curvature, 8.0), ("gust", s.gust, 1.0), ("line", 0.2, 10.0), ("unsteady", s.unsteadiness, 0.3),
            ("rest", s.resting_torque, 0.7), ("error", s.wander, 3.0),
        )
    }  # fmt: skip
    wandering["road"] = _lagged(wandering["road"], 1.5, s.dt)
    factor = 1 + s.factor_error * np.array([[rng.standard_normal()] for rng in rngs])
    angle, motor, driver, tyres, offset = _drive(s, state, share, wandering)
    known = factor * tyres + wandering["error"]
    measured = np.round(angle / s.resolution) * s.resolution if s.resolution > 0 else angle
    return HandsDrives(
        np.arange(n, dtype=np.float64) * s.dt, state, driver, motor, tyres, known, angle, measured, offset
    )


def _drive(
    s: HandsSetting, state: Array, share: Array, noise: dict[str, Array]
) -> tuple[Array, Array, Array, Array, Array]:
    """Angle, motor torque, driver torque, tyre torque and offset in the lane, each of shape (drives, n)."""
    drives, n = state.shape
    tick = tick_of(s.wheel.inertia, s.wheel.damping, s.dt / SUBSTEPS)
    bend = 1 / (s.ratio * (s.base + s.understeer * s.speed**2))  # kappa per rad at the wheel
    stiffness = s.caster * s.speed**2 * bend  # N m/rad
    kept = np.zeros((5, drives, n))
    delta, omega, psi, y, hand, seen = np.zeros((6, drives))
    for k in range(n):
        rho = noise["road"][:, k]
        seen += s.dt / 0.3 * (rho - seen)  # the driver's eye is late
        lane = (rho - 0.003 * y - 0.15 * psi) / bend  # where the motor wants the wheel
        motor = share[:, k] * (stiffness * lane + 6.0 * (lane - delta) - 0.5 * omega)
        own = (seen - 0.004 * (y - noise["line"][:, k]) - 0.15 * psi) / bend
        wanted = stiffness * own - motor + 3.0 * (own - delta) - 0.3 * omega + noise["unsteady"][:, k]
        hand += s.dt / 0.15 * (np.where(state[:, k] == STEERING, wanted, noise["rest"][:, k]) - hand)
        hand = np.where(state[:, k] == OFF, 0.0, hand)
        tyres = -stiffness * delta
        kept[:, :, k] = delta, motor, hand, tyres, y
        for _ in range(SUBSTEPS):
            delta, omega = tick.advance(delta, omega, hand + motor + tyres, s.wheel.friction)
        psi = psi + s.dt * (s.speed * (bend * delta - rho) + noise["gust"][:, k])
        y = y + s.dt * s.speed * psi
    return kept[0], kept[1], kept[2], kept[3], kept[4]


def _hands(s: HandsSetting, n: int, rng: np.random.Generator) -> tuple[Array, Array]:
    """State of the hands and the motor's share at each tick, shape (n,) each."""
    state, share = np.zeros(n), np.ones(n)
    on = rng.random() < s.on_dwell / (s.on_dwell + s.off_dwell)
    k = 0
    while k < n:
        last = min(n, k + _ticks(s.on_dwell if on else s.off_dwell, s, rng))
        if on:
            share[k:last] = rng.uniform(s.least_share, 1)
            steers = rng.random() < s.steering_first
            while k < last:
                end = min(last, k + _ticks(s.steering_dwell if steers else s.resting_dwell, s, rng))
                state[k:end] = STEERING if steers else RESTING
                # The motor keeps the lane alone while hands only rest.
                share[k:end] = share[k:end] if steers else 1.0
                k, steers = end, not steers
        k, on = last, not on
    return state, _lagged(share[None], 0.5, s.dt, 1.0)[0]


def _ticks(mean: float, s: HandsSetting, rng: np.random.Generator) -> int:
    """A log-normal dwell time with this mean, in ticks."""
    return max(1, round(mean * rng.lognormal(-(s.spread**2) / 2, s.spread) / s.dt))


def _wander(rng: np.random.Generator, n: int, dt: float, rms: float, over: float) -> Array:
    """An AR(1) process with this rms and correlation time, s, shape (n,)."""
    from scipy.signal import lfilter

    keep = np.exp(-dt / over)
    kicks = rng.standard_normal(n) * rms * np.sqrt(1 - keep**2)
    kicks[0] = rng.standard_normal() * rms
    return np.asarray(lfilter([1.0], [1.0, -keep], kicks))


def _lagged(x: Array, over: float, dt: float, start: float = 0.0) -> Array:
    """x behind a first-order lag, along its last axis."""
    from scipy.signal import lfilter

    keep = np.exp(-dt / over)
    return np.asarray(lfilter([1 - keep], [1.0, -keep], x - start, axis=-1) + start)
