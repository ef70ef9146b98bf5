"""What the car's sensors make of a drive.

Accelerometer, on a body that pitches, on a driveline that rings:

    y_1 = v' + g sin(alpha) + bias + g theta + ring + noise, quantised
    theta = G(s) k v',               G = w_p^2 / (s^2 + 2 z_p w_p s + w_p^2)   nose up when speeding up
    ring  = share (H(s) - 1) tau T_c / M,   H likewise with w_d, z_d            decaying after each shift and tip-in

Wheel speeds show nothing below their least speed (the teeth pass too slowly), and differ in bends and by noise. With
`teeth` they are made of the edges of a toothed ring, with the errors of such a measurement (`odometer.py`).
Pedals, pressure and torque have noise and the steps of their converters. The gearbox's own states are exact.
Noise is white per sample; its standard deviation does not depend on the rate.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from codriver.names import VOCABULARY
from codriver.signals import Log, Signal
from codriver.signals.signal import Array
from codriver.simulate.car import GRAVITY
from codriver.simulate.drive import Trace
from codriver.simulate.odometer import edge_times, tooth_speed


@dataclass(frozen=True)
class SensorParameters:
    """The sensors' imperfections; standard deviations are per sample.

    Attributes:
        bias: of the accelerometer, m/s^2.
        acceleration_noise, acceleration_step: m/s^2.
        pitch_gain: pitch angle per acceleration, k, rad s^2/m; a soft car has 0.005.
        pitch_frequency, pitch_damping: of the body's pitch, Hz and 1.
        ring_share: share of the driveline's torque that rings.
        ring_frequency, ring_damping: Hz and 1.
        speed_noise, speed_step: of a wheel, m/s.
        speed_least: below it a wheel shows 0, m/s.
        teeth: of a wheel's ring; 0 for a wheel speed without teeth, true but for its noise.
        rolling_radius: of the wheels, m; for the teeth.
        tooth_error: standard deviation of a tooth's place, share of the distance between two.
        timer_step: of the timer that stamps the teeth, s.
        pedal_noise, pedal_step: share of the pedal's range.
        brake_noise, brake_step: Pa.
        brake_zero: offset of the pressure sensor, Pa.
        switch: pressure at which the brake switch closes, Pa; it opens at two thirds of it.
        torque_noise, torque_step: N m.
        track: distance of left and right wheels, m.
        clutch: what the gearbox's unit reports as clutch: "torque", the share of the engine's torque that does not pass
            (it knows its clutch), or "travel", the position of the release bearing.
    """

    bias: float = 0.05
    acceleration_noise: float = 0.06
    acceleration_step: float = 0.01
    pitch_gain: float = 0.0015
    pitch_frequency: float = 1.4
    pitch_damping: float = 0.35
    ring_share: float = 0.5
    ring_frequency: float = 5.5
    ring_damping: float = 0.10
    speed_noise: float = 0.012
    speed_step: float = 0.01
    speed_least: float = 0.3
    teeth: int = 0
    rolling_radius: float = 0.31
    tooth_error: float = 0.004
    timer_step: float = 4e-6
    pedal_noise: float = 0.001
    pedal_step: float = 0.004
    brake_noise: float = 0.05e5
    brake_step: float = 0.1e5
    brake_zero: float = 0.0
    switch: float = 0.4e5
    torque_noise: float = 0.3
    torque_step: float = 0.5
    track: float = 1.5
    clutch: Literal["torque", "travel"] = "torque"


# For judging estimators: standard deviations of pedal (share of its range) and brake pressure (Pa), from good sensors to
# bad ones. Use: SensorParameters(pedal_noise=pedal, brake_noise=brake).
PEDAL_NOISE_LEVELS = ((0.001, 0.05e5), (0.005, 0.15e5), (0.01, 0.3e5), (0.02, 0.6e5))

WHEELS = {"front_left": (1, 1), "front_right": (1, -1), "rear_left": (0, 1), "rear_right": (0, -1)}

# Sensors that show a column of the trace as it is, but for noise and steps.
_PLAIN = {
    "accelerator_pedal": "pedal",
    "engine_torque": "torque",
    "engine_torque_request": "request",
    "engine_speed": "engine_speed",
    "gear": "gear",
}
# Hz, of the signals without a bus.
_RATES = {
    "longitudinal_acceleration": 100.0,
    "engine_torque": 100.0,
    "engine_torque_request": 100.0,
    "engine_speed": 100.0,
    "longitudinal_speed": 50.0,
    "accelerator_pedal": 50.0,
    "brake_pressure": 50.0,
    "brake_switch": 50.0,
    "gear": 50.0,
    "clutch": 50.0,
    "steering_wheel_angle": 50.0,
    "yaw_rate": 50.0,
}


class Instruments:
    """The sensors of one drive; `read` gives a sensor's samples at any times.

    Sensor names are standard names, and `wheel.front_left`, ... (m/s), `shift` (0 or 1), `dashboard_speed` (m/s).
    """

    def __init__(self, trace: Trace, sensors: SensorParameters, seed: int) -> None:
        self._trace, self._p, self._seed = trace, sensors, seed
        self._random = np.random.default_rng([seed, 17])
        self._curves: dict[str, Array] = {}

    def read(self, name: str, times: Array) -> Array:
        """Samples of a sensor at `times` (s, shape (m,)), with its noise and quantisation, in SI units."""
        p, trace = self._p, self._trace
        if name in ("gear", "clutch", "shift", "brake_switch"):
            # States are held, not interpolated.
            index = np.clip(np.searchsorted(trace["time"], times, side="right") - 1, 0, len(trace) - 1)
            return self._curve(name)[index]
        if name.startswith("wheel.") and p.teeth:
            clean = self._by_teeth(name, times)
        else:
            clean = np.interp(times, trace["time"], self._curve(name))
        sd, step = {
            "longitudinal_acceleration": (p.acceleration_noise, p.acceleration_step),
            "lateral_acceleration": (p.acceleration_noise, p.acceleration_step),
            "yaw_rate": (0.002, 0.0005),
            "accelerator_pedal": (p.pedal_noise, p.pedal_step),
            "brake_pressure": (p.brake_noise, p.brake_step),
            "engine_torque": (p.torque_noise, p.torque_step),
            "engine_torque_request": (0.0, p.torque_step),
            "engine_speed": (0.5, 0.025),
            "steering_wheel_angle": (0.001, 0.0017),
            "dashboard_speed": (0.0, 0.14),
        }.get(name, (p.speed_noise, p.speed_step))
        noisy = clean + sd * self._random.standard_normal(times.size)
        if name.startswith("wheel."):
            noisy = np.where(clean < p.speed_least, 0.0, noisy)
        elif name == "accelerator_pedal":
            # The unit behind the pedal reports a released pedal as 0, and never less.
            noisy = np.where(clean > 0.0, np.clip(noisy, 0.0, 1.0), 0.0)
        elif name in ("engine_torque", "engine_speed"):
            noisy = np.where(clean == 0.0, 0.0, noisy)
        return np.round(noisy / step) * step

    def _by_teeth(self, name: str, times: Array) -> Array:
        """A wheel's speed (m/s) as the brake unit works it out of the teeth, at the ends of its periods `times`."""
        p = self._p
        ring = np.random.default_rng([self._seed, 23, list(WHEELS).index(name.removeprefix("wheel."))])
        shares = p.tooth_error * ring.standard_normal(p.teeth)
        pitch = 2 * np.pi * p.rolling_radius / p.teeth
        edges = edge_times(self._trace["time"], self._curve(name), pitch, shares, p.timer_step)
        return tooth_speed(edges, times, pitch, p.speed_least)

    def _curve(self, name: str) -> Array:
        """A sensor's signal before noise and sampling, on the trace's clock; worked out once."""
        if name not in self._curves:
            self._curves[name] = self._work_out(name)
        return self._curves[name]

    def _work_out(self, name: str) -> Array:
        p, trace, car = self._p, self._trace, self._trace.car
        if name in _PLAIN:
            return trace[_PLAIN[name]]
        v, a = trace["speed"], trace["acceleration"]
        curvature = trace.road.at(trace.road.curvature, trace["distance"])
        if name == "longitudinal_acceleration":
            theta = _resonance(p.pitch_gain * a, trace.dt, p.pitch_frequency, p.pitch_damping)
            push = trace.tau * trace["passed"] / car.mass
            ring = p.ring_share * (_resonance(push, trace.dt, p.ring_frequency, p.ring_damping) - push)
            return a + GRAVITY * (np.sin(trace["slope"]) + theta) + p.bias + ring
        if name == "lateral_acceleration":
            return v * v * curvature
        if name == "yaw_rate":
            return v * curvature
        if name == "steering_wheel_angle":
            return car.steering_ratio * (car.wheelbase * curvature + car.understeer * v * v * curvature)
        if name == "clutch":
            return trace.clutch_share if p.clutch == "torque" else trace["clutch"]
        if name == "brake_pressure":
            return trace["brake"] + p.brake_zero
        if name == "brake_switch":
            return _schmitt(trace["brake"], p.switch, p.switch * 2 / 3)
        if name == "shift":
            return np.abs(trace["shifting"])
        if name == "dashboard_speed":
            return np.where(v > 0.5, v * 1.02 + 0.6, 0.0)
        front, left = WHEELS[name.removeprefix("wheel.")]
        # Wheels outside in a bend go faster; steered wheels travel a little further still.
        return v * (1 - left * 0.5 * p.track * curvature) * np.sqrt(1 + front * (car.wheelbase * curvature) ** 2)


def measured_log(
    trace: Trace, sensors: SensorParameters | None = None, *, seed: int = 1, rates: dict[str, float] | None = None
) -> Log:
    """The sensors' signals as a Log of standard names, without a bus between: even clocks, no losses.

    Args:
        trace: the drive.
        sensors: their imperfections.
        seed: of the noise.
        rates: Hz by standard name, beyond or instead of 100 Hz for acceleration and torques, 50 Hz for the others.
    """
    instruments = Instruments(trace, sensors or SensorParameters(), seed)
    stop = float(trace["time"][-1])
    signals = []
    for name, rate in {**_RATES, **(rates or {})}.items():
        times = np.arange(int(stop * rate) + 1) / rate
        if name == "longitudinal_speed":  # the mean of the rear wheels, as a brake unit reports it
            values = 0.5 * (instruments.read("wheel.rear_left", times) + instruments.read("wheel.rear_right", times))
        else:
            values = instruments.read(name, times)
        signals.append(Signal(name, times, values, VOCABULARY[name].unit, "simulated sensor"))
    return Log.of(signals, "simulated sensors")


def _resonance(x: Array, dt: float, frequency: float, damping: float) -> Array:
    """x through w^2 / (s^2 + 2 z w s + w^2), by the bilinear transform, starting at rest in x[0]; shape (n,)."""
    from scipy.signal import bilinear, lfilter

    w = 2 * np.pi * frequency
    b, a = bilinear([w * w], [1.0, 2 * damping * w, w * w], fs=1.0 / dt)
    return np.asarray(lfilter(b, a, x - x[0]) + x[0], dtype=float)


def _schmitt(x: Array, on: float, off: float) -> Array:
    """1 from where x rises above `on` until it falls below `off`, else 0; shape (n,)."""
    decided = np.where(x > on, 1.0, np.where(x < off, 0.0, np.nan))
    decided[0] = 1.0 if x[0] > on else 0.0
    last = np.maximum.accumulate(np.where(np.isnan(decided), 0, np.arange(x.size)))
    return decided[last]
