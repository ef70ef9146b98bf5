"""What the powertrain does, from gear, clutch and brake: the part that all estimators with a vehicle share.

* gear: tau comes from the gear's entry in the vehicle file. Neutral passes no torque, and the intention keeps the tau of the
  gear engaged last, until another engages. A gear that the vehicle file lacks passes a torque that nobody knows.
* clutch: with the clutch open tau T_e reaches no wheel and is cut; half open, half of it.
* shift: 1 while the clutch is not closed, and for 0.5 s after the gear changed where there is no clutch signal.
* brake: sigma is 1 from the brake pressure's threshold on, until it is down to half of it; or while the brake switch is on.
* reverse: tau and the speed turn sign.
"""

from __future__ import annotations

from dataclasses import dataclass

from codriver.kernel import Scalar, both, either, negate, select
from codriver.observers.observer import Output, Scalars
from codriver.vehicles import Vehicle

DEFAULT_BRAKE_THRESHOLD = 0.7e5  # Pa; above the rest pressure and noise of the sensors we have seen
SHIFT_SECONDS = 0.5
OPEN_CLUTCH = 0.05
PEDAL_PRESSED = 0.02

CARRY = {"tau": 0.0, "gear_before": 0.0, "since_shift": SHIFT_SECONDS, "pressed_before": 0.0}
FLAGS = (
    Output("direction", "1", "input", "1 forward, -1 reverse"),
    Output("inputs_known", "1", "flag", "1 where all inputs of the model are there"),
    Output("braking", "1", "flag", "sigma: 1 while the driver brakes"),
    Output("gear_shift", "1", "flag", "1 while a gear shift goes on"),
    Output("both_pedals", "1", "flag", "1 where accelerator and brake are pressed together; the brake counts"),
)


@dataclass(frozen=True)
class Powertrain:
    """The state of the powertrain at one tick.

    Attributes:
        tau: wheel force per engine torque of the engaged (or last engaged) gear, signed, 1/m.
        passing: share of the engine torque that passes the clutch, 0 to 1.
        direction: 1 or -1.
        sigma: 1 while the driver brakes.
        shifting: 1 while a shift goes on.
        known: 1 where tau is known: in a gear of the vehicle file, or in neutral after one.
        carry: the new carried scalars.
    """

    tau: Scalar
    passing: Scalar
    direction: Scalar
    sigma: Scalar
    shifting: Scalar
    known: Scalar
    carry: Scalars


def powertrain(vehicle: Vehicle, dt: float, carry: Scalars, u: Scalars, ok: Scalars) -> Powertrain:
    """Follow gear, clutch and brake for one tick."""
    ratios = vehicle.numbers("transmission")
    gear = _gear(ratios, u, ok)
    tau_now: Scalar = 0.0
    for number, ratio in enumerate(ratios, 1):
        tau_now = select(gear == number, ratio, tau_now)
    if "transmission_reverse" in vehicle:
        tau_now = select(gear == -1, -vehicle.number("transmission_reverse"), tau_now)
    engaged = negate(tau_now == 0)
    tau = select(engaged, tau_now, carry["tau"])

    open_share = select(ok["clutch"], u["clutch"], 0.0)
    open_share = select(open_share < 0, 0.0, select(open_share > 1, 1.0, open_share))
    passing = select(engaged, 1.0 - open_share, 0.0)

    changed = both(negate(gear == carry["gear_before"]), negate(carry["tau"] == 0))
    since = select(changed, 0.0, carry["since_shift"] + dt)
    since = select(since < SHIFT_SECONDS, since, SHIFT_SECONDS)
    # Half a tick early, so that rounding does not decide where the time is a whole number of ticks.
    shifting = select(ok["clutch"], open_share > OPEN_CLUTCH, since < SHIFT_SECONDS - dt / 2)

    pressed = _pressed(vehicle, carry["pressed_before"], u, ok)
    sigma = either(pressed, select(ok["brake_switch"], u["brake_switch"] > 0.5, 0.0))
    new = {"tau": tau, "gear_before": gear, "since_shift": since, "pressed_before": pressed}
    known = both(negate(tau == 0), either(engaged, gear == 0))
    return Powertrain(tau, passing, select(gear < 0, -1.0, 1.0), sigma, shifting, known, new)


def _gear(ratios: tuple[float, ...], u: Scalars, ok: Scalars) -> Scalar:
    """The gear; a car of one gear (electric) is in it unless it says neutral or reverse."""
    return select(ok["gear"], u["gear"], 1.0 if len(ratios) == 1 else 0.0)


def _pressed(vehicle: Vehicle, before: Scalar, u: Scalars, ok: Scalars) -> Scalar:
    """Whether the pressure says that the driver brakes, with hysteresis (the switch must not latch it)."""
    on = vehicle.number("brake_threshold") if "brake_threshold" in vehicle else DEFAULT_BRAKE_THRESHOLD
    pressure = select(ok["brake_pressure"], u["brake_pressure"], 0.0)
    return pressure > select(before, on / 2, on)
