"""Weights of theorem 1 for a steering wheel, the angle in degrees as in the paper, and the paper's own as presets.

V_33 belongs to the pseudo-inverse T_1 and to degrees: with another T_2, or with radians, other numbers are right.
Okamoto, Tsiotras 2019 (Robotics and Autonomous Systems), sections 4.1 and 4.2.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Any

from codriver.errors import UsageError
from codriver.models import StateSpace
from codriver.models.steering import steering_model
from codriver.names import nearest
from codriver.observers.pi_design import PIDesign, design_pi_observer

DEGREES = 180 / pi


@dataclass(frozen=True)
class PIWeights:
    """Weights, and how inputs run between ticks.

    Attributes:
        V_1: diagonal, of angle, rate and torque.
        V_2: of the angle.
        inputs: "straight" or "held".
        source, name: where they come from.
    """

    V_1: tuple[float, float, float]
    V_2: float
    inputs: str = "straight"
    source: str = "given"
    name: str = "own"

    def settings(self) -> dict[str, str]:
        """For provenance."""
        return {"preset": self.name, "V_1": " ".join(f"{v:g}" for v in self.V_1), "V_2": f"{self.V_2:g}"}


# The simulation's and the simulator's; the paper's steps of Runge and Kutta hold their inputs.
PI_WEIGHTS = {
    "okamoto2019": PIWeights((1.0, 1.0, 1e11), 1.0, "held", "2019, section 4.1", "okamoto2019"),
    "okamoto2019-simulator": PIWeights((1.0, 1.0, 3.1e9), 1.0, "held", "2019, section 4.2", "okamoto2019-simulator"),
}


def find_pi_weights(preset: Any) -> PIWeights:
    """Weights themselves, or the paper's by name.

    Raises:
        UsageError: there are no such weights.
    """
    if isinstance(preset, PIWeights):
        return preset
    if str(preset) not in PI_WEIGHTS:
        near = nearest(str(preset), PI_WEIGHTS)
        raise UsageError(
            f"no preset '{preset}' for the PI observer", f"one of {', '.join(PI_WEIGHTS)}",
            f"did you mean {near}?" if near else "choose one, or pass PIWeights in Python",
        )  # fmt: skip
    return PI_WEIGHTS[str(preset)]


def wheel_in_degrees(inertia: float, damping: float) -> StateSpace:
    """The wheel as the paper has it: y = 180/pi delta_s (29)."""
    m = steering_model(inertia, damping)
    return StateSpace(m.A, m.B, DEGREES * m.C, m.D, m.states, m.inputs, m.outputs)


def wheel_pi_design(inertia: float, damping: float, weights: PIWeights) -> PIDesign:
    """Theorem 1 for a wheel.

    Args:
        inertia: J_s, kg m^2.
        damping: b_s, N m s/rad.
        weights: V_1 and V_2.
    """
    return design_pi_observer(wheel_in_degrees(inertia, damping), ("driver_torque",), weights.V_1, weights.V_2)
