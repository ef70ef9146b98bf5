"""The estimators of the longitudinal intention: the family `intent`, in order of preference.

| name          | known input                                   | needs a vehicle |
|---------------|-----------------------------------------------|-----------------|
| intent-pedals | pedals, brake pressure, engine torque, gear   | yes             |
| intent-torque | requested and actual torque, gear             | yes             |
| intent-fused  | as intent-pedals, and the pedals' rate        | yes             |
| fused-torque  | as intent-torque, brakes, and their rate      | yes             |
| kinematic     | none: the vehicle's own jerk                  | no              |
| pedals-only   | pedals and gear, no observer                  | yes             |

Those with an observer take the noise of the 2017 paper. `intent-torque` is of the 2015 paper; the preset "bisoffi2015"
gives that paper's noise and ell.
"""

from __future__ import annotations

from codriver.observers import known_input
from codriver.observers.fused import fused_observer
from codriver.observers.jerk import jerk_observer
from codriver.observers.observer import Observer, Output, chain
from codriver.observers.pedals_only import pedals_only
from codriver.observers.registry import Design, Estimator, register
from codriver.observers.scaled_gain import PRESETS, design_scaled_gain
from codriver.vehicles import Vehicle

FAMILY = "intent"
DEFAULT_PRESET = "bisoffi2017"
_SPEED = Output("longitudinal_speed", "m/s", "estimate", "v")
_OFFSET = Output("acceleration_offset", "m/s^2", "estimate", "o_a = g sin(slope) + accelerometer bias")
INTENTION = (
    _SPEED,
    Output("intentional_acceleration", "m/s^2", "estimate", "a_i, the acceleration the driver asks for"),
    _OFFSET,
    Output("intentional_jerk", "m/s^3", "estimate", "j_i = da_i/dt"),
)
MOTION = (
    _SPEED,
    Output("longitudinal_acceleration", "m/s^2", "estimate", "dv/dt, the vehicle's own, offset taken out"),
    _OFFSET,
    Output("longitudinal_jerk", "m/s^3", "estimate", "d2v/dt2, the vehicle's own"),
)


def _with_observer(front: Observer, design: Design, outputs: tuple[Output, ...]) -> Observer:
    """A known input, and the observer that takes it."""
    gains = design_scaled_gain(design.preset or DEFAULT_PRESET, design.dt, design.ell)
    return chain(front, jerk_observer(gains, design.form, outputs))


def _intent_pedals(vehicle: Vehicle | None, design: Design) -> Observer:
    assert vehicle is not None  # the registry saw to it, for the estimator has parameters
    return _with_observer(known_input.from_pedals(vehicle, design.dt), design, INTENTION)


def _intent_torque(vehicle: Vehicle | None, design: Design) -> Observer:
    assert vehicle is not None
    return _with_observer(known_input.from_torque(vehicle, design.dt), design, INTENTION)


def _fused(vehicle: Vehicle | None, design: Design, *, torque: bool) -> Observer:
    assert vehicle is not None
    preset = design.preset or PRESETS[DEFAULT_PRESET]
    return fused_observer(vehicle, design.dt, design.ell, preset, design.form, INTENTION, torque=torque)


def _intent_fused(vehicle: Vehicle | None, design: Design) -> Observer:
    return _fused(vehicle, design, torque=False)


def _fused_torque(vehicle: Vehicle | None, design: Design) -> Observer:
    return _fused(vehicle, design, torque=True)


def _kinematic(vehicle: Vehicle | None, design: Design) -> Observer:
    return _with_observer(known_input.kinematic(design.dt), design, MOTION)


def _pedals_only(vehicle: Vehicle | None, design: Design) -> Observer:
    assert vehicle is not None
    return pedals_only(vehicle, design.dt)


register(Estimator(
    "intent-pedals", ("mass", "transmission", "pedal_coefficient", "brake_coefficient"),
    ("accelerator_pedal", "brake_pressure", "engine_torque", "gear", "longitudinal_acceleration", "longitudinal_speed"),
    "intentional acceleration and jerk from pedals, torque, accelerometer and speed (2017)",
    FAMILY, _intent_pedals, DEFAULT_PRESET, knob=True,
))  # fmt: skip
register(Estimator(
    "intent-torque", ("mass", "transmission"),
    ("engine_torque_request", "engine_torque", "gear", "longitudinal_acceleration", "longitudinal_speed"),
    "intentional acceleration and jerk from requested and actual torque, accelerometer and speed (2015)",
    FAMILY, _intent_torque, DEFAULT_PRESET, knob=True,
))  # fmt: skip
register(Estimator(
    "intent-fused", ("mass", "transmission", "pedal_coefficient", "brake_coefficient"),
    ("accelerator_pedal", "brake_pressure", "engine_torque", "gear", "longitudinal_acceleration", "longitudinal_speed"),
    "the same as intent-pedals with less lag: the pedals' rate at once, the observer for the rest",
    FAMILY, _intent_fused, DEFAULT_PRESET, knob=True,
))  # fmt: skip
register(Estimator(
    "fused-torque", ("mass", "transmission", "brake_coefficient"),
    (
        "engine_torque_request", "brake_pressure", "engine_torque", "gear", "longitudinal_acceleration",
        "longitudinal_speed",
    ),
    "the same as intent-torque with less lag: the request's rate at once, the observer for the rest",
    FAMILY, _fused_torque, DEFAULT_PRESET, knob=True,
))  # fmt: skip
register(Estimator(
    "kinematic", (), ("longitudinal_acceleration", "longitudinal_speed"),
    "the vehicle's own acceleration and jerk, whoever caused them",
    FAMILY, _kinematic, DEFAULT_PRESET, knob=True,
))  # fmt: skip
register(Estimator(
    "pedals-only", ("mass", "transmission", "pedal_coefficient", "brake_coefficient"),
    ("accelerator_pedal", "brake_pressure", "gear"), "pedals turned into acceleration and jerk, without an observer",
    FAMILY, _pedals_only,
))  # fmt: skip
