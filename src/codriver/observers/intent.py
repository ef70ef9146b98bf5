"""The four estimators of the longitudinal intention, by name.

| name          | known input                                   | needs a vehicle |
|---------------|-----------------------------------------------|-----------------|
| intent-pedals | pedals, brake pressure, engine torque, gear   | yes             |
| intent-torque | requested and actual torque, gear             | yes             |
| kinematic     | none: the vehicle's own jerk                  | no              |
| pedals-only   | pedals and gear, no observer                  | yes             |
"""

from __future__ import annotations

from dataclasses import dataclass

from codriver.errors import UsageError, VehicleError
from codriver.names import nearest
from codriver.observers import known_input
from codriver.observers.jerk import jerk_observer
from codriver.observers.observer import Observer, Output, chain
from codriver.observers.pedals_only import pedals_only
from codriver.observers.scaled_gain import PRESETS, Preset, check_tick, design_scaled_gain
from codriver.vehicles import Vehicle

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


@dataclass(frozen=True)
class Estimator:
    """What is to be known of an estimator before it is built.

    Attributes:
        name: as on the command line.
        parameters: the vehicle parameters it needs; none means it needs no vehicle.
        signals: the signals it needs (beside optional ones).
        meaning: one sentence.
    """

    name: str
    parameters: tuple[str, ...]
    signals: tuple[str, ...]
    meaning: str


# In order of preference: `intent` takes the first that a log and a vehicle can feed.
ESTIMATORS: dict[str, Estimator] = {
    e.name: e
    for e in (
        Estimator(
            "intent-pedals", ("mass", "transmission", "pedal_coefficient", "brake_coefficient"),
            ("accelerator_pedal", "brake_pressure", "engine_torque", "gear", "longitudinal_acceleration", "longitudinal_speed"),
            "intentional acceleration and jerk from pedals, torque, accelerometer and speed (2017)",
        ),
        Estimator(
            "intent-torque", ("mass", "transmission"),
            ("engine_torque_request", "engine_torque", "gear", "longitudinal_acceleration", "longitudinal_speed"),
            "intentional acceleration and jerk from requested and actual torque, accelerometer and speed (2015)",
        ),
        Estimator(
            "kinematic", (), ("longitudinal_acceleration", "longitudinal_speed"),
            "the vehicle's own acceleration and jerk, whoever caused them",
        ),
        Estimator(
            "pedals-only", ("mass", "transmission", "pedal_coefficient", "brake_coefficient"),
            ("accelerator_pedal", "brake_pressure", "gear"), "pedals turned into acceleration and jerk, without an observer",
        ),
    )
}  # fmt: skip


def needed_signals(name: str, vehicle: Vehicle | None) -> tuple[str, ...]:
    """The signals an estimator needs with this vehicle; a car of one gear does not need the gear."""
    estimator = get_estimator(name)
    one_gear = vehicle is not None and "transmission" in vehicle and len(vehicle.numbers("transmission")) == 1
    return tuple(s for s in estimator.signals if s != "gear" or name != "intent-torque" or not one_gear)


def get_estimator(name: str) -> Estimator:
    """The entry of ESTIMATORS.

    Raises:
        UsageError: there is no such estimator.
    """
    if name not in ESTIMATORS:
        near = nearest(name, [*ESTIMATORS, "intent"])
        raise UsageError(
            f"no estimator is called '{name}'", f"one of {', '.join(ESTIMATORS)}, or intent",
            f"did you mean {near}?" if near else "see `codriver estimate --help`",
        )  # fmt: skip
    return ESTIMATORS[name]


def build(
    name: str,
    vehicle: Vehicle | None = None,
    *,
    dt: float = 0.01,
    ell: float | None = None,
    preset: str | Preset = "bisoffi2017",
    form: str = "kalman",
) -> Observer:
    """Build an estimator.

    Args:
        name: one of ESTIMATORS.
        vehicle: not needed by `kinematic`.
        dt: tick, s.
        ell: the knob; None takes the preset's (2 for 2017, 1.4 for 2015).
        preset: noise of a paper, or one's own.
        form: "kalman" (missing and multi-rate rows exact) or "constant" (the papers' gain; small).

    Raises:
        UsageError: no such estimator, preset or form; dt or ell not positive.
        VehicleError: the vehicle is missing, or lacks a parameter.
        DesignError: the design fails its certificate.
    """
    estimator = get_estimator(name)
    check_tick(dt)
    if form not in ("kalman", "constant"):
        raise UsageError(f"form '{form}'", "'kalman' or 'constant'", "choose one")
    if estimator.parameters and vehicle is None:
        raise VehicleError(
            f"{name} was given no vehicle", f"one with {', '.join(estimator.parameters)}",
            "give a built-in name or a vehicle file (--vehicle), or use the estimator 'kinematic', which needs none",
        )  # fmt: skip
    if name == "pedals-only":
        assert vehicle is not None
        return pedals_only(vehicle, dt)
    design = design_scaled_gain(preset, dt, ell)
    label = preset if isinstance(preset, str) else "own"
    if name == "kinematic":
        front, outputs = known_input.kinematic(dt), MOTION
    else:
        assert vehicle is not None
        front = (
            known_input.from_pedals(vehicle, dt) if name == "intent-pedals" else known_input.from_torque(vehicle, dt)
        )
        outputs = INTENTION
    observer = chain(front, jerk_observer(design, form, outputs), name)
    settings = {"estimator": name, **observer.settings, "preset": label}
    return Observer(
        name, dt, observer.inputs, observer.measured, observer.carry, observer.outputs, observer.step,
        observer.scheduling, observer.optional, settings, observer.gains, observer.certificate,
    )  # fmt: skip


__all__ = ["ESTIMATORS", "PRESETS", "Estimator", "build", "get_estimator", "needed_signals"]
