"""The estimators of the driver's torque on the steering wheel: the family `driver-torque`, in order of preference.

| name                       | what else acts on the column                           | how                       |
|----------------------------|--------------------------------------------------------|---------------------------|
| driver-torque-logged       | the log's alignment_torque                             | Kalman filter, with bands |
| driver-torque-assist       | a map of angle and speed, and steering_motor_torque    | the same                  |
| driver-torque-car          | a map of angle and speed, identified from drives       | the same                  |
| driver-torque-single-track | eq. (92) with a single track, from angle and speed     | the same                  |
| driver-torque-motor        | steering_motor_torque: the motor of a simulator        | the same                  |
| driver-torque-command      | the motor's command, by torque_scale                   | the same                  |
| driver-torque-pi           | the log's alignment_torque                             | PI observer, no bands     |

Where the motor's torque is among what is known, the filter that tells whether hands are on the wheel runs behind (`hands`). Without
it nobody can tell hands from a motor that steers.

Presets of the Kalman filters are a `TorqueNoise`; without one, a run over a log fits it to that log. Those of the PI observer are
weights V_1 and V_2 (`pi_weights`). Okamoto, Tsiotras 2019 (Robotics and Autonomous Systems), sections 3 and 4.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from codriver.models.alignment import USUAL
from codriver.observers.column import Column, assist_column, car_column, logged_column, single_track_column
from codriver.observers.driver_torque import driver_torque_observer
from codriver.observers.hands import HandsSettings, hands_observer
from codriver.observers.mended_angle import with_mended_angle
from codriver.observers.observer import Observer, chain
from codriver.observers.pi import pi_observer
from codriver.observers.pi_weights import DEGREES, PIWeights, find_pi_weights, wheel_pi_design
from codriver.observers.registry import Design, Estimator, register
from codriver.observers.torque_noise import TorqueNoise, find_torque_noise
from codriver.vehicles import Vehicle

FAMILY = "driver-torque"
WHEEL = ("steering_inertia", "steering_damping")
SINGLE_TRACK = (
    "steering_ratio", "mass", "yaw_inertia", "wheelbase", "front_axle_distance", "front_cornering_stiffness",
    "rear_cornering_stiffness",
)  # fmt: skip


@dataclass(frozen=True)
class Source:
    """Where the known torque comes from.

    Attributes:
        name: of the estimator.
        parameters: that the vehicle must have.
        signals: that it needs beside the angle.
        meaning: as `Estimator` has it.
        column: makes it, of a vehicle for a tick.
        wheel: the vehicle that the wheel's inertia and damping are taken from.
        motor: whether the torque of every motor is in it.
        forbids: as `Estimator` has it.
    """

    name: str
    parameters: tuple[str, ...]
    signals: tuple[str, ...]
    meaning: str
    column: Callable[[Vehicle, float], Column]
    wheel: Callable[[Vehicle], Vehicle] = lambda vehicle: vehicle
    motor: bool = True
    forbids: tuple[str, ...] = ()

    def build(self, vehicle: Vehicle | None, design: Design) -> Observer:
        """The Kalman filter with this source, and the hands behind it where they can be told."""
        assert vehicle is not None  # the registry saw to it, for the estimator has parameters
        assert isinstance(design.preset, TorqueNoise)
        column = self.column(vehicle, design.dt)
        torque = driver_torque_observer(self.wheel(vehicle), column, design.preset, design.dt, self.name)
        if not self.motor:
            return torque
        settings = HandsSettings()
        hands = hands_observer(design.dt, replace(settings, floor=max(settings.floor, column.error)))
        return chain(torque, hands, self.name)


def usual_wheel(vehicle: Vehicle) -> Vehicle:
    """A car's vehicle with the inertia and damping of a usual steering wheel, where it has none of its own.

    Drives hardly tell the inertia: a car's wheel is turned slowly. The damping was found with the map and its error is in the
    map's, so it has no standard deviation of its own here.
    """
    damping = vehicle.number("steering_damping") if "steering_damping" in vehicle else USUAL["steering_damping"]
    vehicle = vehicle.with_parameter("steering_damping", damping, source="found with the map, or a usual car's")
    if "steering_inertia" in vehicle:
        return vehicle
    J = USUAL["steering_inertia"]
    return vehicle.with_parameter("steering_inertia", J, 0.5 * J, source="a usual passenger car's")


def _pi(vehicle: Vehicle | None, design: Design) -> Observer:
    assert vehicle is not None
    weights: PIWeights = design.preset
    made = wheel_pi_design(vehicle.number("steering_inertia"), vehicle.number("steering_damping"), weights)
    settings = {"vehicle": vehicle.name, "known_torque": "alignment_torque", "inputs": weights.inputs}
    return with_mended_angle(pi_observer(made, design.dt, scales=[DEGREES], inputs=weights.inputs, settings=settings))


SOURCES = (
    Source(
        "driver-torque-logged", WHEEL, ("alignment_torque",),
        "the driver's steering torque from the wheel's angle and the log's alignment torque (2019)", logged_column,
    ),
    Source(
        "driver-torque-assist", ("alignment_gain", "alignment_whole"), ("longitudinal_speed", "steering_motor_torque"),
        "the driver's steering torque from angle, speed, the motor's torque and a map of the car", assist_column, usual_wheel,
    ),
    Source(
        "driver-torque-car", ("alignment_gain",), ("longitudinal_speed",),
        "the driver's steering torque from angle, speed and a map of the car identified from drives", car_column, usual_wheel,
        motor=False, forbids=("alignment_whole",),
    ),
    Source(
        "driver-torque-single-track", (*WHEEL, "alignment_stiffness", *SINGLE_TRACK), ("longitudinal_speed",),
        "the driver's steering torque from angle, speed and a single track (2019 eq. 92)", single_track_column,
        motor=False,
    ),
    Source(
        "driver-torque-motor", WHEEL, ("steering_motor_torque",),
        "the driver's steering torque from angle and motor torque, where nothing else acts (2019)",
        lambda vehicle, dt: logged_column(vehicle, dt, "steering_motor_torque"),
    ),
    Source(
        "driver-torque-command", (*WHEEL, "torque_scale"), ("steering_motor_command",),
        "the driver's steering torque from angle and motor command, where nothing else acts (2019)",
        lambda vehicle, dt: logged_column(vehicle, dt, "steering_motor_command"),
    ),
)  # fmt: skip
for _source in SOURCES:
    register(Estimator(
        _source.name, _source.parameters, ("steering_wheel_angle", *_source.signals), _source.meaning, FAMILY, _source.build,
        "driver", find=find_torque_noise, tell=lambda noise: noise.settings(), learns=True, forms=("kalman",),
        forbids=_source.forbids,
    ))  # fmt: skip
register(Estimator(
    "driver-torque-pi", WHEEL, ("steering_wheel_angle", "alignment_torque"),
    "the driver's steering torque by the PI observer of the 2019 paper, no bands", FAMILY, _pi, "okamoto2019",
    find=find_pi_weights, tell=lambda weights: weights.settings(), forms=("kalman",),
))  # fmt: skip
