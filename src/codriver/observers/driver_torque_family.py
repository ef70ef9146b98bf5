"""The estimators of the driver's torque on the steering wheel: the family `driver-torque`, in order of preference.

| name                  | what else acts on the column                       | how                          |
|-----------------------|----------------------------------------------------|------------------------------|
| driver-torque-logged  | the log's alignment_torque                         | Kalman filter, with bands    |
| driver-torque-motor   | steering_motor_torque: the motor of a simulator    | the same                     |
| driver-torque-command | the motor's command, by torque_scale               | the same                     |
| driver-torque-pi      | the log's alignment_torque                         | PI observer of the 2019 paper, no bands |

Presets of the Kalman filters are a `TorqueNoise`; without one, a run over a log fits it to that log. Those of the PI observer are
weights V_1 and V_2, in the paper's degrees. Okamoto, Tsiotras 2019 (Robotics and Autonomous Systems), sections 3 and 4.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import pi
from typing import Any

from codriver.errors import UsageError
from codriver.models import StateSpace
from codriver.models.steering import steering_model
from codriver.names import nearest
from codriver.observers.column import Column, logged_column
from codriver.observers.driver_torque import driver_torque_observer
from codriver.observers.observer import Observer
from codriver.observers.pi import pi_observer
from codriver.observers.pi_design import PIDesign, design_pi_observer
from codriver.observers.registry import Design, Estimator, register
from codriver.observers.torque_noise import TorqueNoise, find_torque_noise
from codriver.vehicles import Vehicle

FAMILY = "driver-torque"
WHEEL = ("steering_inertia", "steering_damping")
DEGREES = 180 / pi


@dataclass(frozen=True)
class PIWeights:
    """Weights of theorem 1 for the wheel, the angle in degrees, and how inputs run between ticks.

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


# The simulation's and the simulator's; section 4.1 and 4.2 of the paper, whose steps of Runge and Kutta hold their inputs.
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


def _kalman(name: str, source: Callable[[Vehicle], Column]) -> Callable[[Vehicle | None, Design], Observer]:
    """How a Kalman filter with this source is built."""

    def build(vehicle: Vehicle | None, design: Design) -> Observer:
        assert vehicle is not None  # the registry saw to it, for the estimator has parameters
        assert isinstance(design.preset, TorqueNoise)
        return driver_torque_observer(vehicle, source(vehicle), design.preset, design.dt, name)

    return build


def _pi(vehicle: Vehicle | None, design: Design) -> Observer:
    assert vehicle is not None
    weights: PIWeights = design.preset
    made = wheel_pi_design(vehicle.number("steering_inertia"), vehicle.number("steering_damping"), weights)
    settings = {"vehicle": vehicle.name, "known_torque": "alignment_torque", "inputs": weights.inputs}
    return pi_observer(made, design.dt, scales=[DEGREES], inputs=weights.inputs, settings=settings)


def _logged(name: str) -> Callable[[Vehicle], Column]:
    return lambda vehicle: logged_column(vehicle, name)


def _register(
    name: str, parameters: tuple[str, ...], signal: str, meaning: str, source: Callable[[Vehicle], Column]
) -> None:
    """A Kalman filter of the family."""
    register(Estimator(
        name, parameters, ("steering_wheel_angle", signal), meaning, FAMILY, _kalman(name, source), "driver",
        find=find_torque_noise, tell=lambda noise: noise.settings(), learns=True, forms=("kalman",),
    ))  # fmt: skip


_register(
    "driver-torque-logged", WHEEL, "alignment_torque",
    "the driver's steering torque from the wheel's angle and the log's alignment torque (2019)", _logged("alignment_torque"),
)  # fmt: skip
_register(
    "driver-torque-motor", WHEEL, "steering_motor_torque",
    "the same where the steering motor is all that acts beside the driver", _logged("steering_motor_torque"),
)  # fmt: skip
_register(
    "driver-torque-command", (*WHEEL, "torque_scale"), "steering_motor_command",
    "the same from the motor's command, in the device's own unit", _logged("steering_motor_command"),
)  # fmt: skip
register(Estimator(
    "driver-torque-pi", WHEEL, ("steering_wheel_angle", "alignment_torque"),
    "the driver's steering torque by the PI observer of the 2019 paper, no bands", FAMILY, _pi, "okamoto2019",
    find=find_pi_weights, tell=lambda weights: weights.settings(), forms=("kalman",),
))  # fmt: skip
