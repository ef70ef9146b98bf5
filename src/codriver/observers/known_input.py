"""The known input u of the intention model, three ways.

    intent-pedals   u = tau/M T_e - (1 - sigma) (tau/M c_r p_r + c_b/M p_b)     2017 eq. (10a)
    intent-torque   u = tau/M (T_e - (1 - sigma) T_r)                           2015 eq. (7a); sigma as in 2017 eq. (7)
    kinematic       u = 0                                                       2017 eq. (22), 2015 eq. (8)

with T_e cut by the clutch (`powertrain`). Where an input is missing for longer than it may be held, u is 0, the estimate
goes on as the kinematic one, and `inputs_known` is 0.
"""

from __future__ import annotations

from codriver.kernel import Scalar, both, select
from codriver.observers.observer import Observer, Output, Scalars
from codriver.observers.powertrain import CARRY, FLAGS, powertrain
from codriver.vehicles import Vehicle

PEDAL_PRESSED = 0.02
_U = Output("known_input", "m/s^2", "input", "u: what the powertrain adds to the driver's intention")


def from_pedals(vehicle: Vehicle, dt: float) -> Observer:
    """u from accelerator pedal, brake pressure, engine torque and gear (2017 eq. 10a)."""
    M, c_r, c_b = vehicle.number("mass"), vehicle.number("pedal_coefficient"), vehicle.number("brake_coefficient")

    def intended(u: Scalars, ok: Scalars) -> tuple[Scalar, Scalar, Scalar]:
        fine = both(ok["accelerator_pedal"], ok["brake_pressure"])
        pedal = select(fine, u["accelerator_pedal"], 0.0)
        return c_r * pedal, c_b * select(fine, u["brake_pressure"], 0.0), fine

    required = ("accelerator_pedal", "brake_pressure", "engine_torque", "gear")
    return _front("pedal-input", vehicle, dt, M, required, ("clutch", "brake_switch"), intended)


def from_torque(vehicle: Vehicle, dt: float) -> Observer:
    """u from requested and actual torque (2015 eq. 7a)."""

    def intended(u: Scalars, ok: Scalars) -> tuple[Scalar, Scalar, Scalar]:
        fine = ok["engine_torque_request"]
        return select(fine, u["engine_torque_request"], 0.0), 0.0, fine

    several = len(vehicle.numbers("transmission")) > 1
    required = ("engine_torque_request", "engine_torque", *(("gear",) if several else ()))
    optional = ("clutch", "brake_pressure", "brake_switch", "accelerator_pedal", *(() if several else ("gear",)))
    return _front("torque-input", vehicle, dt, vehicle.number("mass"), required, optional, intended)


def kinematic(dt: float) -> Observer:
    """u = 0. The gear, where there is one, tells reverse from forward."""

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        gear = select(ok["gear"], u["gear"], 1.0)
        return {}, {"known_input": 0.0, "direction": select(gear < 0, -1.0, 1.0), "inputs_known": 1.0}

    return Observer("no-input", dt, ("gear",), (), {}, (_U, *FLAGS[:2]), step, optional=frozenset({"gear"}))


def _front(
    name: str,
    vehicle: Vehicle,
    dt: float,
    M: float,
    required: tuple[str, ...],
    optional: tuple[str, ...],
    intended: object,
) -> Observer:
    """The step that all known inputs share; `intended` gives the driver's torque, brake force, and whether both are known."""

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        given = {**dict.fromkeys(_ALL, 0.0), **u}
        here = {**dict.fromkeys(_ALL, 0.0), **ok}
        train = powertrain(vehicle, dt, carry, given, here)
        torque, brake, fine = intended(given, here)  # type: ignore[operator]
        known = both(both(fine, ok["engine_torque"]), train.known)
        actual = select(ok["engine_torque"], given["engine_torque"], 0.0)
        wanted = select(train.sigma, 0.0, train.tau / M * torque + brake / M)
        value = select(known, train.tau / M * (train.passing * actual) - wanted, 0.0)
        pedal = select(here["accelerator_pedal"], given["accelerator_pedal"], 0.0)
        return train.carry, {
            "known_input": value, "direction": train.direction, "inputs_known": known, "braking": train.sigma,
            "gear_shift": train.shifting, "both_pedals": both(train.sigma, pedal > PEDAL_PRESSED),
        }  # fmt: skip

    return Observer(
        name, dt, (*required, *optional), (), dict(CARRY), (_U, *FLAGS), step,
        optional=frozenset(optional), settings={"vehicle": vehicle.name},
    )  # fmt: skip


_ALL = (
    "accelerator_pedal", "brake_pressure", "brake_switch", "engine_torque", "engine_torque_request", "gear", "clutch",
)  # fmt: skip
