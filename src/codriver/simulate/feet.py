"""The driver's right foot: one foot, two pedals, moved at a human pace.

Each pedal follows where the foot wants it as x'' = w^2 (wanted - x) - 2 w x' (critically damped, w the foot's
bandwidth), with x' bounded. To change pedals the foot releases the one, travels for a fraction of a second during
which both are released, and presses the other.

    accelerator   0 released to 1
    brake         master-cylinder pressure, Pa; the force on the pedal is proportional to it
"""

from __future__ import annotations

PRESS, RELEASE = 2.5, 5.0  # fastest accelerator movement, 1/s
BRAKE_PRESS, BRAKE_RELEASE = 120e5, 150e5  # fastest change of brake pressure, Pa/s
FULL_BRAKE = 120e5  # Pa
# A released pedal is aimed a little beyond its rest, as the foot lifts off it; so it reaches rest in finite time.
LIFT_OFF, BRAKE_LIFT_OFF = -0.03, -1.5e5
LEFT, BRAKE_LEFT = 0.005, 0.1e5  # below these the foot may leave the pedal


class Feet:
    """State of the foot and the two pedals.

    Attributes:
        accelerator, accelerator_rate: 0..1 and 1/s.
        brake, brake_rate: Pa and Pa/s.
    """

    __slots__ = ("_on_brake", "_travel", "_travel_time", "_w", "accelerator", "accelerator_rate", "brake", "brake_rate",
                 "want_accelerator", "want_brake", "want_side")  # fmt: skip

    def __init__(self, bandwidth: float, travel: float, brake: float = 0.0) -> None:
        self._w, self._travel_time = bandwidth, travel
        self._on_brake, self._travel = brake > 0.0, 0.0
        self.accelerator, self.accelerator_rate = 0.0, 0.0
        self.brake, self.brake_rate = brake, 0.0
        self.want_accelerator, self.want_brake, self.want_side = 0.0, brake, brake > 0.0

    def move(self, dt: float) -> None:
        """Advance by dt seconds towards what is wanted."""
        goal = gas = 0.0
        if self._travel > 0.0:
            self._travel -= dt
        elif self.want_side != self._on_brake:
            if self.accelerator < LEFT and self.brake < BRAKE_LEFT:
                self._on_brake, self._travel = self.want_side, self._travel_time
        elif self._on_brake:
            goal = self.want_brake
        else:
            gas = self.want_accelerator
        w = self._w
        if gas or self.accelerator:
            x, rate = self.accelerator, self.accelerator_rate
            rate += dt * w * (w * ((gas or LIFT_OFF) - x) - 2.0 * rate)
            rate = PRESS if rate > PRESS else -RELEASE if rate < -RELEASE else rate
            x += dt * rate
            if x < 0.0:
                x = rate = 0.0
            elif x > 1.0:
                x, rate = 1.0, 0.0
            self.accelerator, self.accelerator_rate = x, rate
        if goal or self.brake:
            x, rate = self.brake, self.brake_rate
            rate += dt * w * (w * ((goal or BRAKE_LIFT_OFF) - x) - 2.0 * rate)
            rate = BRAKE_PRESS if rate > BRAKE_PRESS else -BRAKE_RELEASE if rate < -BRAKE_RELEASE else rate
            x += dt * rate
            if x < 0.0:
                x = rate = 0.0
            elif x > FULL_BRAKE:
                x, rate = FULL_BRAKE, 0.0
            self.brake, self.brake_rate = x, rate
