"""The known input u of the intention model, three ways.

    intent-pedals   u = tau/M T_e - (1 - sigma) (tau/M c_r p_r + c_b/M p_b)     2017 eq. (10a)
    intent-torque   u = tau/M (T_e - T_r)                                       2015 eq. (7a)
    kinematic       u = 0                                                       2017 eq. (22), 2015 eq. (8)

with T_e cut by the clutch (`powertrain`). The torque form has no sigma: the request of an electric car is negative with
the pedal released, and to drop it when the brake is touched would be a jump of u that nobody made. Where an input is
missing for longer than it may be held, u is 0, the estimate goes on as the kinematic one, and `inputs_known` is 0.
"""

from __future__ import annotations

from collections.abc import Callable

from codriver.kernel import Scalar, both, select
from codriver.observers.observer import Observer, Output, Scalars
from codriver.observers.powertrain import CARRY, FLAGS, PEDAL_PRESSED, Powertrain, powertrain
from codriver.vehicles import Vehicle

_U = Output("known_input", "m/s^2", "input", "u: what the powertrain adds to the driver's intention")
# (inputs, ok, powertrain) -> the acceleration that the driver asks of the powertrain, m/s^2, and whether it is known.
Intended = Callable[[Scalars, Scalars, Powertrain], tuple[Scalar, Scalar]]


def from_pedals(vehicle: Vehicle, dt: float) -> Observer:
    """u from accelerator pedal, brake pressure, engine torque and gear (2017 eq. 10a)."""
    M, c_r, c_b = vehicle.number("mass"), vehicle.number("pedal_coefficient"), vehicle.number("brake_coefficient")

    def intended(u: Scalars, ok: Scalars, train: Powertrain) -> tuple[Scalar, Scalar]:
        fine = both(ok["accelerator_pedal"], ok["brake_pressure"])
        pedal, pressure = (select(fine, u[name], 0.0) for name in ("accelerator_pedal", "brake_pressure"))
        asked = train.tau / M * (c_r * pedal) + train.direction * (c_b / M) * pressure
        return select(train.sigma, 0.0, asked), fine

    required = ("accelerator_pedal", "brake_pressure", "engine_torque", "gear")
    return _front("pedal-input", vehicle, dt, required, ("clutch", "brake_switch"), intended)


def from_torque(vehicle: Vehicle, dt: float) -> Observer:
    """u from requested and actual torque (2015 eq. 7a)."""
    M = vehicle.number("mass")

    def intended(u: Scalars, ok: Scalars, train: Powertrain) -> tuple[Scalar, Scalar]:
        fine = ok["engine_torque_request"]
        return train.tau / M * select(fine, u["engine_torque_request"], 0.0), fine

    one_gear = len(vehicle.numbers("transmission")) == 1
    required = ("engine_torque_request", "engine_torque", *(() if one_gear else ("gear",)))
    optional = ("clutch", "brake_pressure", "brake_switch", "accelerator_pedal", *(("gear",) if one_gear else ()))
    return _front("torque-input", vehicle, dt, required, optional, intended)


def kinematic(dt: float) -> Observer:
    """u = 0. The gear, where there is one, tells reverse from forward."""

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        gear = select(ok["gear"], u["gear"], 1.0)
        return {}, {"known_input": 0.0, "direction": select(gear < 0, -1.0, 1.0), "inputs_known": 1.0}

    return Observer("no-input", dt, ("gear",), (), {}, (_U, *FLAGS[:2]), step, optional=frozenset({"gear"}))


def _front(
    name: str, vehicle: Vehicle, dt: float, required: tuple[str, ...], optional: tuple[str, ...], intended: Intended
) -> Observer:
    """The step that the known inputs share: what the powertrain gives, less what the driver asks of it."""
    M = vehicle.number("mass")

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        """One tick: follow the powertrain, subtract what the driver asks of it."""
        # The powertrain looks at optional signals too; those that this estimator does not take are never there.
        given, here = {**dict.fromkeys(_ALL, 0.0), **u}, {**dict.fromkeys(_ALL, 0.0), **ok}
        train = powertrain(vehicle, dt, carry, given, here)
        asked, fine = intended(given, here, train)
        actual = train.tau / M * (train.passing * select(here["engine_torque"], given["engine_torque"], 0.0))
        known = both(both(fine, here["engine_torque"]), train.known)
        pedal = select(here["accelerator_pedal"], given["accelerator_pedal"], 0.0)
        return train.carry, {
            "known_input": select(known, actual - asked, 0.0),
            "direction": train.direction,
            "inputs_known": known,
            "braking": train.sigma,
            "gear_shift": train.shifting,
            "both_pedals": both(train.sigma, pedal > PEDAL_PRESSED),
        }

    return Observer(
        name, dt, (*required, *optional), (), dict(CARRY), (_U, *FLAGS), step,
        optional=frozenset(optional), settings={"vehicle": vehicle.name},
    )  # fmt: skip


_ALL = (
    "accelerator_pedal", "brake_pressure", "brake_switch", "engine_torque", "engine_torque_request", "gear", "clutch",
)  # fmt: skip
