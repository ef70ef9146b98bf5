"""The linear single-track model: a car in plan view, both wheels of an axle taken together.

    m v (beta' + r) = Y_f + Y_r                     beta  sideslip angle, rad      r  yaw rate, rad/s
    I_z r' = l_f Y_f - l_r Y_r                      v     speed along x, m/s       delta  steer angle of the front wheels, rad
    Y_f = C_f (delta - beta - l_f r / v)            Y     lateral force of an axle, N
    Y_r = C_r (-beta + l_r r / v)                   C     cornering stiffness of an axle, N/rad, positive

Closed forms, L = l_f + l_r:

    K_u   = m (l_r C_r - l_f C_f) / (L C_f C_r)           understeer gradient, rad per m/s^2
    r / delta = v / (L + K_u v^2)                         steady turn
    v_ch  = sqrt(L / K_u), K_u > 0                        characteristic speed: half the yaw rate of a car without slip
    v_cr  = sqrt(-L / K_u), K_u < 0                       critical speed: unstable beyond

Riekert, Schunck 1940, doi:10.1007/BF02086921; Mitschke, Wallentowitz, Dynamik der Kraftfahrzeuge, chapter on the linear
single-track model. Axes ISO 8855.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, sqrt
from typing import Any

import numpy as np

from codriver.models.state_space import StateSpace
from codriver.vehicles import Vehicle

# A CasADi SX, a float or an array; CasADi ships no types.
Value = Any
STATES = ("sideslip_angle", "yaw_rate")
SLOWEST = 2.0  # m/s; the slip angles l r / v are taken at this speed below it


@dataclass(frozen=True)
class SingleTrack:
    """A car.

    Attributes:
        mass: m, kg.
        yaw_inertia: I_z, kg m^2.
        front, rear: l_f, l_r, distances of the axles from the centre of mass, m.
        front_stiffness, rear_stiffness: C_f, C_r, N/rad.

    Raises:
        ValueError: one of them is not positive.
    """

    mass: float
    yaw_inertia: float
    front: float
    rear: float
    front_stiffness: float
    rear_stiffness: float

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not value > 0:
                raise ValueError(f"{name} is {value:g}; it must be positive")

    @classmethod
    def from_vehicle(cls, vehicle: Vehicle) -> SingleTrack:
        """A vehicle's single track.

        Raises:
            VehicleError: the vehicle lacks a parameter.
        """
        front = vehicle.number("front_axle_distance")
        return cls(
            vehicle.number("mass"), vehicle.number("yaw_inertia"), front, vehicle.number("wheelbase") - front,
            vehicle.number("front_cornering_stiffness"), vehicle.number("rear_cornering_stiffness"),
        )  # fmt: skip

    @property
    def wheelbase(self) -> float:
        """L, m."""
        return self.front + self.rear

    @property
    def front_mass(self) -> float:
        """Mass on the front axle, kg: in a steady turn Y_f is that times the lateral acceleration."""
        return self.mass * self.rear / self.wheelbase

    @property
    def understeer_gradient(self) -> float:
        """K_u, rad per m/s^2."""
        surplus = self.rear * self.rear_stiffness - self.front * self.front_stiffness
        return self.mass * surplus / (self.wheelbase * self.front_stiffness * self.rear_stiffness)

    @property
    def characteristic_speed(self) -> float:
        """v_ch, m/s; infinite for a neutral or an oversteering car."""
        return sqrt(self.wheelbase / self.understeer_gradient) if self.understeer_gradient > 0 else inf

    @property
    def critical_speed(self) -> float:
        """v_cr, m/s; infinite for a neutral or an understeering car."""
        return sqrt(-self.wheelbase / self.understeer_gradient) if self.understeer_gradient < 0 else inf

    def model(self, speed: float) -> StateSpace:
        """Sideslip and yaw rate for the steer angle, at one speed.

        Args:
            speed: m/s, positive.

        Raises:
            ValueError: the speed is not positive.
        """
        if not speed > 0:
            raise ValueError(f"a speed of {speed:g} m/s; slip angles need a car that moves forward")
        a, b = self._rates(speed)
        return StateSpace(
            np.array(a), np.array(b)[:, None], np.eye(2), np.zeros((2, 1)), STATES, ("steer_angle",), STATES
        )

    def advance(self, sideslip: Value, yaw_rate: Value, steer: Value, speed: Value, dt: float) -> tuple[Value, Value]:
        """Sideslip and yaw rate a tick later, by the implicit Euler rule: stable at every speed and tick.

        Args:
            sideslip: rad.
            yaw_rate: rad/s.
            steer: delta at the end of the tick, rad.
            speed: m/s, at least SLOWEST.
            dt: s.
        """
        (a11, a12), (a21, a22) = self._rates(speed)[0]
        b1, b2 = self._rates(speed)[1]
        m11, m12, m21, m22 = 1 - dt * a11, -dt * a12, -dt * a21, 1 - dt * a22
        e1, e2 = sideslip + dt * b1 * steer, yaw_rate + dt * b2 * steer
        determinant = m11 * m22 - m12 * m21
        return (e1 * m22 - m12 * e2) / determinant, (m11 * e2 - m21 * e1) / determinant

    def front_slip(self, sideslip: Value, yaw_rate: Value, steer: Value, speed: Value) -> Value:
        """delta - beta - l_f r / v, rad; C_f times it is the lateral force of the front axle."""
        return steer - sideslip - self.front * yaw_rate / speed

    def _rates(self, speed: Value) -> tuple[tuple[tuple[Value, Value], tuple[Value, Value]], tuple[Value, Value]]:
        """A and B."""
        f, r = self.front_stiffness, self.rear_stiffness
        moment = self.front * f - self.rear * r
        return (
            (-(f + r) / (self.mass * speed), -1 - moment / (self.mass * speed * speed)),
            (-moment / self.yaw_inertia,
             -(self.front * self.front * f + self.rear * self.rear * r) / (self.yaw_inertia * speed)),
        ), (f / (self.mass * speed), self.front * f / self.yaw_inertia)  # fmt: skip
