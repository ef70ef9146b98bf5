"""The steering wheel and its column.

    delta_s' = omega_s                                       angle, rad
    J_s omega_s' = T - b_s omega_s - T_c sign(omega_s)       rate, rad/s
    y = delta_s                                              encoder, rad

T, N m, is the sum of all torques on the column: of the force-feedback or assist motor, of the tyres, of the driver's hands. J_s,
kg m^2; b_s, N m s/rad; T_c, N m, Coulomb friction, which the paper leaves out and real wheels have. Angles are radians here; the
paper's C = 180/pi makes degrees of them.

Okamoto, Tsiotras 2019 (Robotics and Autonomous Systems), eq. (27)-(29). Over one tick with T held, E = exp(-b_s dt / J_s):

    exact     delta+ = delta + (1 - E) J_s/b_s omega + (dt - (1 - E) J_s/b_s) T/b_s,     omega+ = E omega + (1 - E) T/b_s
    Euler     delta+ = delta + dt omega,                     omega+ = omega + dt (T - b_s omega) / J_s             (77)

Friction acts as an impulse of at most T_c that can stop the wheel and cannot turn it back (Moreau's time stepping), so a wheel
that sticks stands still exactly.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from codriver.models.state_space import StateSpace

STATES = ("steering_wheel_angle", "steering_wheel_rate")
FORMS = ("exact", "euler")
# A CasADi SX, a float or an array; CasADi ships no types.
Value = Any


def steering_model(
    inertia: float, damping: float, torques: tuple[str, ...] = ("alignment_torque", "driver_torque")
) -> StateSpace:
    """The model of eq. (28) without friction, as observers are designed on it.

    Args:
        inertia: J_s, kg m^2.
        damping: b_s, N m s/rad.
        torques: standard names of the inputs, each N m on the column.

    Raises:
        ValueError: the inertia is not positive.
    """
    if not inertia > 0:
        raise ValueError(f"an inertia of {inertia} kg m^2; it must be positive")
    return StateSpace(
        A=np.array([[0, 1], [0, -damping / inertia]], float),
        B=np.array([[0.0] * len(torques), [1 / inertia] * len(torques)]),
        C=np.array([[1, 0]], float),
        D=np.zeros((1, len(torques))),
        states=STATES,
        inputs=torques,
        outputs=("steering_wheel_angle",),
    )


@dataclass(frozen=True)
class Tick:
    """One tick of the wheel without friction: (delta, omega)+ = (delta + reach omega, keep omega) + (lift, push) T.

    Attributes:
        reach: s.
        keep: 1.
        lift: rad/(N m).
        push: rad/s/(N m).
    """

    reach: Value
    keep: Value
    lift: Value
    push: Value

    def advance(self, angle: Value, rate: Value, torque: Value, friction: Value = 0.0) -> tuple[Value, Value]:
        """Angle and rate after the tick.

        Args:
            angle: rad.
            rate: rad/s.
            torque: N m, held over the tick.
            friction: T_c, N m.
        """
        free = self.keep * rate + self.push * torque
        slowed = soften(free, self.push * friction)
        return angle + self.reach * rate + self.lift * torque - self.lift / self.push * (free - slowed), slowed


def tick_of(inertia: Value, damping: Value, dt: float, form: str = "exact") -> Tick:
    """The tick of a wheel.

    Args:
        inertia: J_s, kg m^2, positive.
        damping: b_s, N m s/rad.
        dt: s.
        form: "exact", for numbers; or "euler", eq. (77), for CasADi's symbols too.

    Raises:
        ValueError: there is no such form.
    """
    if form == "euler":
        push = dt / inertia
        return Tick(dt, 1 - damping * push, 0.0, push)
    if form != "exact":
        raise ValueError(f"form '{form}'; there are {', '.join(FORMS)}")
    x = damping * dt / inertia
    # (1 - exp(-x)) / x and (1 - that) / x, by their series where the quotients would cancel.
    near = abs(x) < 1e-4
    whole = 1 - x / 2 + x * x / 6 if near else -np.expm1(-x) / x
    rest = 0.5 - x / 6 + x * x / 24 if near else (1 - whole) / x
    # Plain numbers: with numpy's a simulation, step by step, would take twice as long.
    return Tick(float(dt * whole), float(np.exp(-x)), float(dt * dt / inertia * rest), float(dt / inertia * whole))


def soften(value: Value, by: Value) -> Value:
    """The value moved towards 0 by at most `by`, and never past it."""
    return value - (abs(value + by) - abs(value - by)) / 2
