"""A car that this project did not write: the multi-body car of commonroad-vehicle-models, steered and driven round the circuit.

Its inputs are the rate of the front wheels' angle and an acceleration; 29 states, magic-formula tyres, suspension, roll, pitch.
"""

from __future__ import annotations

from math import atan2, cos, hypot, sin

import numpy as np
import pytest

import codriver as cd
from codriver.models.road_sight import PathAhead
from codriver.models.single_track import SingleTrack
from codriver.models.steering import tick_of
from codriver.models.two_point import TwoPointDriver
from codriver.simulate.circuit_way import way_curvature, way_length
from codriver.simulate.steering import Wheel

mb = pytest.importorskip("vehiclemodels.vehicle_dynamics_mb")
parameters = pytest.importorskip("vehiclemodels.parameters_vehicle2")
start = pytest.importorskip("vehiclemodels.init_mb")

STEER, VX, YAW, YAW_RATE, VY = 2, 3, 4, 5, 10
G = 9.81


class MultiBody:
    """The car, stepped by Runge-Kutta of fourth order with steps of 5 ms; its speed is held by a proportional controller."""

    def __init__(self, speed: float):
        self.p, self.speed = parameters.parameters_vehicle2(), speed
        self.x = np.array(start.init_mb([0, 0, 0, speed, 0, 0, 0], self.p), float)

    def rates(self, x: np.ndarray, steer_rate: float, push: float) -> np.ndarray:
        return np.array(mb.vehicle_dynamics_mb(x.tolist(), [steer_rate, push], self.p))

    def steer_to(self, angle: float, dt: float = 0.01) -> None:
        """Turn the front wheels to an angle, rad, over a tick."""
        rate, push = (angle - self.x[STEER]) / dt, 2.0 * (self.speed - self.x[VX])
        h = dt / 2
        for _ in range(2):
            a = self.rates(self.x, rate, push)
            b = self.rates(self.x + h / 2 * a, rate, push)
            c = self.rates(self.x + h / 2 * b, rate, push)
            d = self.rates(self.x + h * c, rate, push)
            self.x = self.x + h / 6 * (a + 2 * b + 2 * c + d)

    @property
    def sideslip(self) -> float:
        return atan2(self.x[VY], self.x[VX])

    @property
    def velocity(self) -> float:
        return hypot(self.x[VX], self.x[VY])

    @property
    def yaw_rate(self) -> float:
        return self.x[YAW_RATE]

    def single_track(self) -> SingleTrack:
        """Its mass, inertia and lengths, and the slope of its tyres' lateral force at no slip under their static load."""
        p = self.p
        wheelbase, slope = p.a + p.b, -p.tire.p_ky1
        return SingleTrack(
            p.m, p.I_z, p.a, p.b, slope * p.m * G * p.b / wheelbase, slope * p.m * G * p.a / wheelbase
        )  # fmt: skip


def drive_multi_body(
    driver: TwoPointDriver,
    speed: float,
    laps: int = 1,
    direction: str = "both",
    ratio: float = 16.0,
    alignment: float = 1000.0,
) -> cd.Log:
    """The two-point driver on the circuit with this car: what a simulator would log, every 10 ms.

    Position along the path and errors are those of a plane curve, without small angles.
    """
    dt, wheel = 0.01, Wheel(0.0298, 0.3515, 0.15)
    car, column = MultiBody(speed), tick_of(wheel.inertia, wheel.damping, dt / 2)
    length = way_length(laps, direction)
    table = np.arange(0, length + 100, 0.1)
    path = PathAhead.of(table, way_curvature(table, laps, direction))
    ahead = driver.far * speed
    near_bend, far_bend = path.bend(table, driver.near), path.bend(table, ahead)
    tick = driver.tick(dt, speed)
    state, rows = tick.start(), []
    place = delta = omega = psi = y = 0.0
    while place < length:
        rho, near, far = (np.interp(place, table, x) for x in (path.curvature, near_bend, far_bend))
        near, far = near - y / driver.near - psi, far - y / ahead - psi
        state, torque = tick.advance(state, near, driver.anticipation * far, delta)
        beta, r, v = car.sideslip, car.yaw_rate, car.velocity
        rows.append((delta, torque, v, beta, r, rho, y, psi))
        for _ in range(2):
            aligned = alignment / ratio * (beta + car.p.a * r / v - delta / ratio)
            delta, omega = column.advance(delta, omega, torque + aligned, wheel.friction)
        car.steer_to(delta / ratio, dt)
        # Midpoint of the tick.
        slid, turned, v = (beta + car.sideslip) / 2, (r + car.yaw_rate) / 2, (v + car.velocity) / 2
        along = v * cos(psi + slid) / (1 - y * rho)
        y += dt * v * sin(psi + slid)
        psi += dt * (turned - rho * along)
        place += dt * along
        assert abs(y) < 4, f"off the road at {place:.0f} m"
    names = (
        ("steering_wheel_angle", "rad"), ("driver_torque", "N*m"), ("longitudinal_speed", "m/s"), ("sideslip_angle", "rad"),
        ("yaw_rate", "rad/s"), ("road_curvature", "1/m"), ("lateral_offset", "m"), ("heading_error", "rad"),
    )  # fmt: skip
    time = dt * np.arange(len(rows))
    columns = np.array(rows).T
    return cd.Log.of(
        [cd.Signal(n, time, x, unit, "multi-body car") for (n, unit), x in zip(names, columns, strict=True)]
    )
