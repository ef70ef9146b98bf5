"""The motion of the car's mass.

    M v' = tau T_c - F_b - M g sin(alpha) - kappa_1 - kappa_2 v^2           (2017 eq. 2a and 19)

with T_c the torque that passes the clutch (N m, equal to the engine's T_e while the clutch is locked), F_b = c_b p_b,
kappa_1 and F_b opposing the motion. At standstill they are static friction: the car stays while the other forces are
smaller than they are.
"""

from __future__ import annotations

import math

from codriver.simulate.car_parameters import CarParameters
from codriver.simulate.powertrain import Powertrain

GRAVITY = 9.80665  # m/s^2


class Car:
    """State of the car.

    Attributes:
        powertrain: engine, clutch and gearbox.
        distance, speed: s (m) and v (m/s).
        acceleration: v' at the present instant, m/s^2.
    """

    __slots__ = (
        "_brake",
        "_drag",
        "_mass",
        "_rolling",
        "acceleration",
        "distance",
        "parameters",
        "powertrain",
        "speed",
    )

    def __init__(self, parameters: CarParameters, distance: float = 0.0, speed: float = 0.0) -> None:
        self.parameters = parameters
        self.powertrain = Powertrain(parameters, speed)
        self.distance, self.speed, self.acceleration = distance, speed, 0.0
        self._mass, self._brake = parameters.mass, parameters.brake
        self._rolling, self._drag = parameters.rolling, parameters.drag

    def evaluate(self, brake: float, slope: float) -> float:
        """The acceleration (m/s^2) now, from the powertrain's torque, the brake pressure (Pa) and the slope (rad)."""
        mass, v = self._mass, self.speed
        force = self.powertrain.force - mass * GRAVITY * math.sin(slope)
        friction = self._rolling + self._brake * brake
        if v > 0.0:
            force -= friction + self._drag * v * v
        elif v < 0.0:
            force += friction + self._drag * v * v
        elif force > friction:
            force -= friction
        elif force < -friction:
            force += friction
        else:
            force = 0.0
        self.acceleration = force / mass
        return self.acceleration

    def move(self, dt: float) -> None:
        """Advance distance and speed by dt seconds at the acceleration last evaluated; friction stops at v = 0."""
        v, a = self.speed, self.acceleration
        new = v + dt * a
        if v * new < 0.0:
            # It comes to rest within the step; whether it stays is for the next evaluation to find out.
            self.distance -= 0.5 * v * v / a
            self.speed = 0.0
        else:
            self.distance += dt * (v + 0.5 * dt * a)
            self.speed = new
