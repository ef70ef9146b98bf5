"""A driving simulator with a force-feedback wheel that measures its angle only: a drive on it, with the driver's true torque.

    J_s delta_s'' + b_s delta_s' + T_c sign(delta_s') = T_dr + T_aln                                    2019 eq. (27), and friction
    T_aln = K_aln / g_s (beta + l_f r / v - delta_s / g_s)                                              (92)
    beta, r: single-track car at constant speed                                                         e.g. Rajamani 2012

K_aln is positive here: the tyres turn the wheel back towards where the car goes. The road is a closed circuit of curves joined by
straights. The driver looks ahead, wants a wheel angle, and pulls the wheel there with arms that have stiffness, damping and a lag;
what he wants wanders, he corrects in steps, and his torque trembles. So the torque is rough where drivers' torques are, and no
sinusoid. The motor renders T_aln, so its command is T_aln in the device's own unit (89).

Okamoto, Tsiotras 2019 (Robotics and Autonomous Systems), section 4.2, whose wheel this is.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import pi

import numpy as np

from codriver.models.steering import tick_of
from codriver.signals import Log, Signal
from codriver.signals.signal import Array
from codriver.simulate.steering import Wheel

SUBSTEPS = 4  # a tick
# Length of straight before, length of the bend (m), angle turned (degrees, left positive).
_CIRCUIT = (
    (80, 110, 90), (50, 80, 60), (120, 120, -75), (30, 90, 80), (60, 80, -55), (20, 95, 95), (150, 160, 100), (40, 90, -60),
    (60, 100, 85), (90, 110, 40),
)  # fmt: skip


@dataclass(frozen=True)
class RigCar:
    """The car that the simulator drives.

    Attributes:
        mass, inertia: kg, and about z, kg m^2.
        front, rear: l_f and l_r, m.
        front_stiffness, rear_stiffness: of both tyres of an axle, N/rad.
        ratio: g_s, of the steering.
        alignment: K_aln, N m/rad.
        speed: m/s.
    """

    mass: float = 1500.0
    inertia: float = 2600.0
    front: float = 1.2
    rear: float = 1.5
    front_stiffness: float = 9.0e4
    rear_stiffness: float = 1.1e5
    ratio: float = 16.0
    alignment: float = 1000.0
    speed: float = 50 / 3.6

    def matrices(self) -> tuple[Array, Array]:
        """A and B of (beta, r)' = A (beta, r) + B delta."""
        m, I, a, b, v = self.mass, self.inertia, self.front, self.rear, self.speed  # noqa: E741
        f, r = self.front_stiffness, self.rear_stiffness
        A = np.array([
            [-(f + r) / (m * v), (r * b - f * a) / (m * v * v) - 1],
            [(r * b - f * a) / I, -(f * a * a + r * b * b) / (I * v)],
        ])  # fmt: skip
        return A, np.array([f / (m * v), f * a / I])


@dataclass(frozen=True)
class RigDriver:
    """Who sits at the wheel.

    Attributes:
        preview: s by which he looks ahead.
        offset_gain, heading_gain: rad of road wheel per m, and per rad.
        stiffness, damping: of the arms, N m/rad and N m s/rad at the wheel.
        lag: of the muscles, s.
        step: he corrects what he wants every so many seconds.
        wander: rms of what he wants beside that, rad at the wheel.
        tremor: rms of his torque, N m, over 0.05 s.
    """

    preview: float = 0.7
    offset_gain: float = 0.008
    heading_gain: float = 0.12
    stiffness: float = 6.0
    damping: float = 0.6
    lag: float = 0.08
    step: float = 0.25
    wander: float = 0.03
    tremor: float = 0.05


@dataclass(frozen=True)
class RigSetting:
    """A drive to be made.

    Attributes:
        wheel, car, driver: what and who.
        seconds, dt: length and tick, s.
        resolution: of the encoder, rad.
        torque_scale, torque_offset: of the motor: torque = scale * command + offset, N m.
    """

    wheel: Wheel = field(default_factory=lambda: Wheel(0.0298, 0.3515, 0.15))
    car: RigCar = RigCar()
    driver: RigDriver = RigDriver()
    seconds: float = 180.0
    dt: float = 0.01
    resolution: float = 0.1 * pi / 180
    torque_scale: float = 1.8615
    torque_offset: float = 0.2197


@dataclass(frozen=True, eq=False)
class RigDrive:
    """What happened; columns of shape (n,).

    Attributes:
        setting: what was asked for.
        time: s.
        measured: angle by the encoder, rad; angle, rate: true.
        alignment_torque, driver_torque: N m.
        sideslip, yaw_rate, curvature, offset: of car and road: rad, rad/s, 1/m, m from the middle.
    """

    setting: RigSetting
    time: Array
    measured: Array
    angle: Array
    rate: Array
    alignment_torque: Array
    driver_torque: Array
    sideslip: Array
    yaw_rate: Array
    curvature: Array
    offset: Array

    def log(self) -> Log:
        """What the simulator logs: angle, alignment torque, the motor's command, speed, sideslip and yaw rate."""
        s = self.setting
        command = (self.alignment_torque - s.torque_offset) / s.torque_scale
        made = (
            ("steering_wheel_angle", self.measured, "rad", "encoder"),
            ("alignment_torque", self.alignment_torque, "N*m", "vehicle model"),
            ("steering_motor_command", command, "1", "motor"),
            ("longitudinal_speed", np.full(self.time.size, s.car.speed), "m/s", "vehicle model"),
            ("sideslip_angle", self.sideslip, "rad", "vehicle model"),
            ("yaw_rate", self.yaw_rate, "rad/s", "vehicle model"),
            ("road_curvature", self.curvature, "1/m", "scene"),
        )
        return Log.of([Signal(n, self.time, v, unit, source) for n, v, unit, source in made], source="simulated rig")

    def truth(self) -> Log:
        """What was true: the driver's torque, angle and rate."""
        made = (
            ("driver_torque", self.driver_torque, "N*m"), ("steering_wheel_angle", self.angle, "rad"),
            ("steering_wheel_rate", self.rate, "rad/s"),
        )  # fmt: skip
        return Log.of([Signal(n, self.time, v, unit, "simulation") for n, v, unit in made], source="truth of the rig")


def circuit_curvature(distance: Array) -> Array:
    """Curvature of the circuit at distances along it, 1/m, positive to the left; it closes and begins anew."""
    edges, values = _edges()
    return np.interp(np.mod(distance, edges[-1]), edges, values)


def circuit_length() -> float:
    """Length of the circuit, m."""
    return _edges()[0][-1]


def _edges() -> tuple[list[float], list[float]]:
    """Distances between which the circuit's curvature runs straight, m, and the curvature there, 1/m."""
    edges, values = [0.0], [0.0]
    s = 0.0
    for straight, bend, angle in _CIRCUIT:
        kappa = np.radians(angle) / (bend * 0.7)
        for length, value in ((straight, 0.0), (0.3 * bend, kappa), (0.4 * bend, kappa), (0.3 * bend, 0.0)):
            s += length
            edges.append(s)
            values.append(value)
    return edges, values


def simulate_rig(setting: RigSetting | None = None, *, seed: int = 0) -> RigDrive:
    """Drive.

    Args:
        setting: wheel, car, driver and sensors.
        seed: of what the driver does beside following the road.
    """
    s = setting or RigSetting()
    rng = np.random.default_rng([seed, 51])
    n = round(s.seconds / s.dt) + 1
    time = np.arange(n, dtype=np.float64) * s.dt
    wander = _wander(rng, n, s.dt, s.driver.wander, 1.5)
    tremor = _wander(rng, n, s.dt, s.driver.tremor, 0.05)
    car, driver, wheel = s.car, s.driver, s.wheel
    A, B = car.matrices()
    dt = s.dt / SUBSTEPS
    tick = tick_of(wheel.inertia, wheel.damping, dt)
    steady: Array = np.asarray(
        np.linalg.solve(-A, B), dtype=np.float64
    )  # sideslip angle and yaw rate per rad of road wheel
    bend = steady[1] / car.speed  # curvature per rad of road wheel, when all is steady
    back = car.alignment / car.ratio
    kept = np.zeros((7, n))
    delta = omega = beta = r = psi = y = hand = want = 0.0
    next_step = 0.0
    ahead = circuit_curvature(car.speed * (time + driver.preview))
    here = circuit_curvature(car.speed * time)
    for k in range(n):
        if time[k] >= next_step:
            seen = ahead[k] / bend
            want = (
                car.ratio * (seen - driver.offset_gain * (y + 0.7 * car.speed * psi) - driver.heading_gain * psi)
                + wander[k]
            )
            next_step = time[k] + driver.step * rng.uniform(0.6, 1.4)
        aligned = back * (beta + car.front * r / car.speed - delta / car.ratio)
        # The arms bear what the tyres will ask for at the wanted angle, and pull the rest of the way.
        asked = _held(want / car.ratio, car, back, steady) + driver.stiffness * (want - delta) - driver.damping * omega
        hand += s.dt / driver.lag * (asked - hand)
        torque = hand + tremor[k]
        kept[:, k] = delta, omega, aligned, torque, beta, r, y
        for _ in range(SUBSTEPS):
            delta, omega = tick.advance(delta, omega, torque + aligned, wheel.friction)
            road = delta / car.ratio
            change = A @ [beta, r] + B * road
            beta, r = beta + dt * change[0], r + dt * change[1]
            psi += dt * (r - car.speed * here[k])
            y += dt * car.speed * (psi + beta)
    measured = np.round(kept[0] / s.resolution) * s.resolution if s.resolution > 0 else kept[0]
    return RigDrive(s, time, measured, kept[0], kept[1], kept[2], kept[3], kept[4], kept[5], here, kept[6])


def _held(road: float, car: RigCar, back: float, steady: Array) -> float:
    """Torque that holds a steady angle of the road wheels, N m; `steady`: sideslip angle and yaw rate per rad of it."""
    beta, r = steady * road
    return float(-back * (beta + car.front * r / car.speed - road))


def _wander(rng: np.random.Generator, n: int, dt: float, rms: float, over: float) -> Array:
    """An AR(1) process with this rms and correlation time, s, shape (n,)."""
    from scipy.signal import lfilter

    keep = np.exp(-dt / over)
    kicks = rng.standard_normal(n) * rms * np.sqrt(1 - keep**2)
    kicks[0] = rng.standard_normal() * rms
    return np.asarray(lfilter([1.0], [1.0, -keep], kicks))
