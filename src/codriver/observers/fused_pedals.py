"""What the pedals say at once: the acceleration they ask for and its rate, by a Kalman filter of bursts.

    a_p' = j_p                                     acceleration asked by the pedals, m/s^2; without the jumps of the gear
    j_p' = c_p                                     its rate, m/s^3
    c_p' = -w^2 j_p - 2 w c_p + white noise q      bursts: jerk comes and goes back to 0, standard deviation sqrt(q / (4 w^3))
    y    = a_p + noise of variance R

The measurement is what 2017 eq. (23a), (23b) make of the pedals, and an offset o:

    y = (1 - sigma) tau/M c_r p_r - sigma c_b/M p_b + o,    R = ((1 - sigma) tau/M c_r)^2 r_r + (sigma c_b/M)^2 r_b

with r_r, r_b the sensors' noise, learnt (`fused_noise`), so that the filter is as quick as they allow. Where tau changes, or
sigma drops a pressed accelerator, o takes up the jump: it is not differentiated (23c). Then o' = -o/T hands it over in
T = 3 s. A driver who is given another tau moves the pedal until the acceleration is again what he wants; that movement is
no new intention, and what is handed over takes a part of it out.

With the requested torque instead of the accelerator: y = tau/M T_r - sigma c_b/M p_b + o. As in `known_input`, sigma does
not drop the request, which in an electric car is there with the pedal released.
The brake's threshold (`powertrain`) is raised to 3.5 standard deviations of the pressure's noise where that is more.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp

from codriver.kernel import Scalar, both, negate, select, sqrt
from codriver.observers import fused_noise
from codriver.observers.covariance import Matrix, predict_covariance, predict_mean, update_row
from codriver.observers.fused_gain import PedalGain
from codriver.observers.observer import Observer, Output, Scalars
from codriver.observers.powertrain import CARRY, DEFAULT_BRAKE_THRESHOLD, FLAGS, PEDAL_PRESSED, Powertrain, powertrain
from codriver.vehicles import Vehicle

HAND_OVER = 3.0  # T, s
THRESHOLD_SDS = 3.5
SETTLED = 0.8  # the jerk's variance over that of a burst, from which on the filter knows something
# Least noise: the sensor's and its converter's, a step of 0.4 % and of 0.1 bar and 0.5 N m being usual.
PEDAL_SD, PEDAL_FLOOR = 3e-3, 1.2e-3
BRAKE_SD, BRAKE_FLOOR = 1e4, 3e3  # Pa
TORQUE_SD, TORQUE_FLOOR = 1.0, 0.2  # N m
_PAIRS = [(i, j) for i in range(3) for j in range(i, 3)]
_STATES = ("acceleration", "jerk", "curve")

OUTPUTS = (
    Output("pedal_acceleration", "m/s^2", "input", "a_p - o, what the pedals ask for, filtered"),
    Output("pedal_acceleration_variance", "m^2/s^4", "input", "its variance"),
    Output("pedal_jerk", "m/s^3", "input", "j_p"),
    Output("pedal_jerk_variance", "m^2/s^6", "input", "its variance"),
    Output("pedal_handed_over", "m/s^3", "input", "what o hands over to the jerk"),
    Output("pedal_settled", "1", "flag", "1 where the pedals' filter knows more than that bursts come"),
    Output("force", "m/s^2", "input", "what engine and brakes do, per mass"),
    Output("known_input", "m/s^2", "input", "u: what the powertrain adds to the driver's intention"),
    *FLAGS,
    Output("pedal_innovation", "m/s^2", "input", "what the pedals ask for less predicted; 0 where none arrived"),
    Output("pedal_innovation_variance", "m^2/s^4", "input", "its variance by the filter"),
    Output("pedal_used", "1", "flag", "1 where a pedal value was used"),
)


@dataclass(frozen=True)
class Asked:
    """What one tick says of the pedals; scalars.

    Attributes:
        gain: of the accelerator or the request, m/s^2 per its unit; 0 while the brake counts.
        value: of the accelerator or the request.
        raw: acceleration asked for, m/s^2.
        braking: the brakes' share of it, as a deceleration, m/s^2.
        R: variance of its noise.
        fresh: 1 where it is new.
        known: 1 where it is known.
    """

    gain: Scalar
    value: Scalar
    raw: Scalar
    braking: Scalar
    R: Scalar
    fresh: Scalar
    known: Scalar


def pedal_filter(vehicle: Vehicle, gain: PedalGain, *, torque: bool = False) -> Observer:
    """The filter of the pedals as the first part of an estimator.

    Args:
        vehicle: with mass, transmission and c_b; for the accelerator also c_r.
        gain: the design at one ell and tick.
        torque: whether the requested torque stands for the accelerator.
    """
    M, c_b, dt = vehicle.number("mass"), vehicle.number("brake_coefficient"), gain.dt
    asking = "engine_torque_request" if torque else "accelerator_pedal"
    c_r = 1.0 if torque else vehicle.number("pedal_coefficient")
    measured = (asking, "brake_pressure")
    noise = {
        asking: (TORQUE_SD, TORQUE_FLOOR) if torque else (PEDAL_SD, PEDAL_FLOOR),
        "brake_pressure": (BRAKE_SD, BRAKE_FLOOR),
    }

    def sensors(carry: Scalars, u: Scalars, ok: Scalars) -> tuple[Scalars, dict[str, Scalar], Powertrain]:
        """Learn the sensors' noise, follow the powertrain: new scalars, variance by signal, powertrain."""
        given = {**u, **{name: select(ok[f"{name}_held"], u[name], 0.0) for name in measured}}
        held = {**ok, **{name: ok[f"{name}_held"] for name in measured}}
        new: Scalars = {}
        variance: dict[str, Scalar] = {}
        for name in measured:
            more, variance[name] = fused_noise.learn(
                carry, name, given[name], ok[name], held[name], noise[name][1], rest_counts=name == "brake_pressure"
            )
            new |= more
        on = vehicle.number("brake_threshold") if "brake_threshold" in vehicle else DEFAULT_BRAKE_THRESHOLD
        needed = THRESHOLD_SDS * sqrt(variance["brake_pressure"])
        # The threshold is the powertrain's own; to raise it, the pressure is shown to it lower.
        lower = select(needed > on, on / select(needed > on, needed, on), 1.0)
        shown = {**dict.fromkeys(_ALL, 0.0), **given}
        shown["brake_pressure"] = lower * shown["brake_pressure"]
        train = powertrain(vehicle, dt, carry, shown, {**dict.fromkeys(_ALL, 0.0), **held})
        return {**train.carry, **new}, variance, train

    def asked(u: Scalars, ok: Scalars, variance: dict[str, Scalar], train: Powertrain) -> Asked:
        """What the pedals ask for."""
        value = select(ok[f"{asking}_held"], u[asking], 0.0)
        pressure = select(ok["brake_pressure_held"], u["brake_pressure"], 0.0)
        by_foot = train.tau / M * c_r if torque else select(train.sigma, 0.0, train.tau / M * c_r)
        by_brake = select(train.sigma, train.direction * (c_b / M), 0.0)
        braking = by_brake * pressure
        return Asked(
            by_foot, value, by_foot * value - braking, braking,
            by_foot * by_foot * variance[asking] + by_brake * by_brake * variance["brake_pressure"],
            select(train.sigma, ok["brake_pressure"], ok[asking]),
            both(both(ok[f"{asking}_held"], ok["brake_pressure_held"]), train.known),
        )  # fmt: skip

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        """One tick: follow sensors and powertrain, keep jumps out, predict and update."""
        new, variance, train = sensors(carry, u, ok)
        now = asked(u, ok, variance, train)
        known = both(now.known, ok["engine_torque"])
        first = both(known, negate(carry["pedal_known"]))
        x = [carry[f"pedal_x_{state}"] for state in _STATES]
        offset = select(first, 0.0, exp(-dt / HAND_OVER) * (carry["offset"] - _jump(carry, x[0], now, train)))

        prior = [now.R, gain.jerk_variance, gain.curve_variance]
        P: Matrix = [[0.0] * 3 for _ in range(3)]
        for i, j in _PAIRS:
            P[i][j] = P[j][i] = carry[f"pedal_P_{_STATES[i]}_{_STATES[j]}"]
        P = predict_covariance(P, gain.F, gain.Qd)
        P = [[select(first, prior[i] if i == j else 0.0, P[i][j]) for j in range(3)] for i in range(3)]
        x = [select(first, value, old) for value, old in zip([now.raw, 0.0, 0.0], predict_mean(x, gain.F), strict=True)]
        use = both(known, now.fresh)
        e = select(use, now.raw + offset - x[0], 0.0)
        x, P, s = update_row(x, P, [1.0, 0.0, 0.0], e, now.R, use)

        new |= {"pedal_known": known, "offset": select(known, offset, 0.0), "gain": now.gain, "braked": train.sigma}
        new |= {f"pedal_x_{state}": value for state, value in zip(_STATES, x, strict=True)}
        new |= {f"pedal_P_{_STATES[i]}_{_STATES[j]}": P[i][j] for i, j in _PAIRS}
        driven = train.tau / M * (train.passing * select(ok["engine_torque"], u["engine_torque"], 0.0))
        force = driven - now.braking
        pedal = select(ok["accelerator_pedal"], u["accelerator_pedal"], 0.0) if torque else now.value
        return new, {
            "pedal_acceleration": select(known, x[0] - offset, 0.0), "pedal_acceleration_variance": P[0][0],
            "pedal_jerk": select(known, x[1], 0.0), "pedal_jerk_variance": P[1][1],
            "pedal_handed_over": select(known, offset * (-1 / HAND_OVER), 0.0),
            "pedal_settled": both(known, P[1][1] <= SETTLED * gain.jerk_variance),
            "force": select(known, force, 0.0), "known_input": select(known, force - now.raw, 0.0),
            "direction": train.direction, "inputs_known": known, "braking": train.sigma, "gear_shift": train.shifting,
            "both_pedals": both(train.sigma, pedal > PEDAL_PRESSED),
            "pedal_innovation": e, "pedal_innovation_variance": s, "pedal_used": use,
        }  # fmt: skip

    one_gear = torque and len(vehicle.numbers("transmission")) == 1
    optional = ("clutch", "brake_switch", *(("accelerator_pedal",) if torque else ()), *(("gear",) if one_gear else ()))
    inputs = dict.fromkeys((*measured, "engine_torque", "gear", *optional))
    carry = dict(CARRY)
    for name in measured:
        carry |= fused_noise.initial(name, noise[name][0])
    carry |= dict.fromkeys(("pedal_known", "offset", "gain", "braked", *(f"pedal_x_{s}" for s in _STATES)), 0.0)
    carry |= {f"pedal_P_{_STATES[i]}_{_STATES[j]}": 0.0 for i, j in _PAIRS}
    return Observer(
        "pedal-filter", dt, tuple(inputs), measured, carry, OUTPUTS, step, optional=frozenset(optional),
        settings={"vehicle": vehicle.name},
    )  # fmt: skip


def _jump(carry: Scalars, acceleration: Scalar, now: Asked, train: Powertrain) -> Scalar:
    """By how much y jumps because tau or sigma changed, the pedals being where they were, m/s^2.

    Between gears the pedal is what the filter has of it; where the brake comes in or goes, what its sensor shows.
    """
    before = select(carry["gain"] == 0, 1.0, carry["gain"])
    filtered = (acceleration - carry["offset"]) / before
    same = both(negate(train.sigma), both(negate(carry["braked"]), negate(carry["gain"] == 0)))
    small = select(now.value < 0, -now.value, now.value) <= PEDAL_PRESSED
    pedal = select(same, filtered, select(small, 0.0, now.value))
    return (now.gain - carry["gain"]) * pedal


_ALL = ("accelerator_pedal", "brake_pressure", "brake_switch", "engine_torque_request", "gear", "clutch")
