"""The pedals alone, without an observer.

    a_i = (1 - sigma) tau/M c_r p_r - sigma c_b/M p_b                  2017 eq. (23a), (23b)
    j_i = (1 - sigma) tau/M c_r D(p_r) - sigma c_b/M D(p_b)            2017 eq. (23c)
    D(p) = s / (1 + s / (2 pi f_D)) p,  f_D = 2 Hz

D is w (p - z) with z' = w (p - z), w = 2 pi f_D, exact for p straight between ticks; tau is not differentiated. There is no
observer, so there are no error covariance and no standard deviations: its errors are the pedals' noise, differentiated, and
everything the road does to the car.
"""

from __future__ import annotations

from math import exp, pi

from codriver.kernel import Scalar, both, negate, select
from codriver.observers.observer import Observer, Output, Scalars
from codriver.observers.powertrain import CARRY, FLAGS, PEDAL_PRESSED, powertrain
from codriver.vehicles import Vehicle

CORNER_FREQUENCY = 2.0  # Hz, 2017 section IV-C


def pedals_only(vehicle: Vehicle, dt: float) -> Observer:
    """Intentional acceleration and jerk from pedals and gear alone (2017 eq. 23)."""
    M, c_r, c_b = vehicle.number("mass"), vehicle.number("pedal_coefficient"), vehicle.number("brake_coefficient")

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        """One tick: follow the powertrain, differentiate the pedals."""
        train = powertrain(vehicle, dt, carry, u, ok)
        fine = both(ok["accelerator_pedal"], ok["brake_pressure"])
        pedal, pressure = (select(fine, u[n], 0.0) for n in ("accelerator_pedal", "brake_pressure"))
        start = both(fine, negate(carry["started"]))
        new = {**train.carry, "started": select(carry["started"], 1.0, fine)}
        rates: list[Scalar] = []
        for name, value in (("p_r", pedal), ("p_b", pressure)):
            z, rate = _derivative(carry[f"{name}_low"], carry[f"{name}_before"], value, dt)
            new[f"{name}_low"] = select(start, value, select(fine, z, carry[f"{name}_low"]))
            new[f"{name}_before"] = select(fine, value, carry[f"{name}_before"])
            rates.append(select(both(fine, negate(start)), rate, 0.0))
        known = both(fine, train.known)
        gas, brake = train.tau / M * c_r, train.direction * (c_b / M)
        out = {
            "intentional_acceleration": select(known, select(train.sigma, -brake * pressure, gas * pedal), 0.0),
            "intentional_jerk": select(known, select(train.sigma, -brake * rates[1], gas * rates[0]), 0.0),
            "direction": train.direction, "inputs_known": known, "braking": train.sigma, "gear_shift": train.shifting,
            "both_pedals": both(train.sigma, pedal > PEDAL_PRESSED), "valid": known,
        }  # fmt: skip
        return new, out

    outputs = (
        Output("intentional_acceleration", "m/s^2", "estimate", "a_i by the pedals alone; no standard deviation"),
        Output("intentional_jerk", "m/s^3", "estimate", "j_i by the pedals alone; no standard deviation"),
        *FLAGS,
        Output("valid", "1", "flag", "1 where the pedals and the gear are known"),
    )
    filters = dict.fromkeys(("started", "p_r_low", "p_r_before", "p_b_low", "p_b_before"), 0.0)
    carry = {**CARRY, **filters}
    return Observer(
        "pedals-only", dt, ("accelerator_pedal", "brake_pressure", "gear", "clutch", "brake_switch"), (), carry, outputs,
        step, optional=frozenset({"clutch", "brake_switch"}),
        settings={"vehicle": vehicle.name, "f_D": CORNER_FREQUENCY, "dt": dt},
    )  # fmt: skip


def _derivative(z: Scalar, before: Scalar, value: Scalar, dt: float) -> tuple[Scalar, Scalar]:
    """The low-passed value one tick on, and the filtered derivative w (p - z); exact for p straight between ticks.

    z_k = E z + (1 - E) p_before + (1 - (1 - E)/(w dt)) (p - p_before),  E = exp(-w dt).
    """
    w = 2 * pi * CORNER_FREQUENCY
    E = exp(-w * dt)
    ramp = 1 - (1 - E) / (w * dt)
    low = E * z + (1 - E) * before + ramp * (value - before)
    return low, w * (value - low)
