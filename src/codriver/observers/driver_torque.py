"""The driver's torque on a steering wheel, from its angle and what else acts on the column.

    delta' = omega,   J_s omega' + b_s omega = T_dr + T_k                       2019 eq. (27)-(29); T_k from `column`
    q = T_dr + c T_k,   q' = w   or   q'' = w                                   (31), and its integrated form; c is 0 or 1
    y = delta + n

What walks by chance is the driver's torque (c = 0), or what is left of it where the driver mostly bears T_k (c = 1): then T_k does
not turn the wheel, and a change of T_k is the driver's at once. `torque_noise` says which; a fit to the record decides.

A Kalman filter of [delta, omega, q(, q')], T_k straight between ticks (`disturbance_design`, `augmented_kalman`). T_k does
not depend on the filter's state, only on measured angle, log and vehicle, so the filter is linear and its certificate holds.

    var(T_dr) = P_qq + var(T_k) + (omega' sd(J_s))^2 + (omega sd(b_s))^2

so the band holds what the filter, the column and the vehicle file do not know. That part does not average out over time.

* Start: at the first angle, the rest wide. A jump of the encoder, or an innovation beyond GATE standard deviations and a degree,
  starts the filter anew from the new angle, at rest and wide, and is told by `angle_jump`; so does a gap of over half a second,
  without being told. Wraps are taken out (`angle_row`).
* T_k missing: what is known of T_dr is forgotten, and `inputs_known` is 0.
* `valid`: T_k is known, the wheel is not at its end stop, and P_qq is at most SETTLED times the stationary one, or SURE^2.
"""

from __future__ import annotations

from math import inf

import numpy as np

from codriver.kernel import Scalar, both, either, negate, select, sqrt
from codriver.models.steering import steering_model
from codriver.observers.angle_row import CARRY as ANGLE_CARRY
from codriver.observers.angle_row import angle_row
from codriver.observers.augmented_kalman import Filter, Moments, carried, chosen, pack, predict, started, unpack, update
from codriver.observers.column import Column
from codriver.observers.covariance import plain
from codriver.observers.disturbance import SETTLED, forget
from codriver.observers.disturbance_design import DisturbanceDesign, design_disturbance_filter
from codriver.observers.observer import Observer, Output, Scalars
from codriver.observers.torque_noise import TorqueNoise
from codriver.vehicles import Vehicle

ANGLE = "steering_wheel_angle"
GATE, LEAST_GATE = 12.0, np.pi / 180  # standard deviations, and rad
SURE = 0.05  # N m
RATE_SD, TORQUE_SD, SLOPE_SD = 5.0, 20.0, 100.0  # at the start: rad/s, N m, N m/s


def driver_torque_design(vehicle: Vehicle, noise: TorqueNoise, dt: float) -> DisturbanceDesign:
    """The filter of a wheel.

    Args:
        vehicle: with steering_inertia and steering_damping.
        noise: of torque, rate and angle.
        dt: tick, s.
    """
    model = steering_model(
        vehicle.number("steering_inertia"), vehicle.number("steering_damping"), ("column_torque", "driver_torque")
    )
    return design_disturbance_filter(
        model, ("driver_torque",), dt, unknown_noise=[noise.torque**2], output_noise=[noise.angle**2],
        state_noise=[noise.slip**2, noise.rate**2], order=noise.order,
    )  # fmt: skip


def driver_torque_observer(
    vehicle: Vehicle, column: Column, noise: TorqueNoise, dt: float, name: str = "driver-torque"
) -> Observer:
    """The observer.

    Args:
        vehicle: with steering_inertia and steering_damping, and their standard deviations if known.
        column: what else acts on the column.
        noise: of torque, rate and angle.
        dt: tick, s.
        name: of the observer.
    """
    design = driver_torque_design(vehicle, noise, dt)
    n = len(design.model.states)
    wide = [noise.angle**2, RATE_SD**2, TORQUE_SD**2, SLOPE_SD**2][:n]
    kalman = filter_of(design, wide)
    J, b = vehicle.number("steering_inertia"), vehicle.number("steering_damping")
    sd_J, sd_b = (_sd(vehicle, p) for p in ("steering_inertia", "steering_damping"))
    stop = vehicle.number("steering_end_stop") if "steering_end_stop" in vehicle else inf
    limit = settled_variance(float(design.P[2, 2]))
    turning = 1.0 - noise.balance  # the share of T_k that turns the filter's wheel

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        """One tick: mend the angle, gather what acts on the column, filter, judge."""
        row = angle_row(carry, y[ANGLE], ok[ANGLE], dt, stop)
        before = turning * carry["torque_before"]
        moment = column.at({key: carry[key] for key in column.carry}, u, ok, row.angle, row.moved)
        torque = select(moment.known, moment.torque, carry["torque_before"])
        predicted = predict(kalman, unpack(carry, n), [before], [turning * torque])
        e = row.angle - predicted.x[0]
        gate = GATE**2 * (predicted.P[0][0] + kalman.R[0])
        beyond = both(both(row.fresh, both(carry["angle_begun"], e * e > gate)), e * e > LEAST_GATE**2)
        jump = either(row.jumped, beyond)
        anew = either(row.first, either(jump, row.resumed))
        use = both(row.fresh, both(row.memory["angle_begun"], negate(anew)))
        now, (told,) = update(kalman, predicted, [row.angle], [use], [turning * torque])
        # From rest: what was extrapolated over a gap or through a jump would lead away again.
        now = chosen(anew, started(kalman, [row.angle, *([0.0] * (n - 1))]), now)
        now = forget(now, negate(moment.known), wide, range(2, n))
        begun = row.memory["angle_begun"]
        # Before the first angle nothing is known, and nothing moves.
        now = chosen(begun, now, started(kalman, [0.0] * n))
        valid = both(both(begun, moment.known), both(negate(row.stopped), now.P[2][2] <= limit))
        new = {
            **pack(now), "torque_before": torque, **{key: moment.memory[key] for key in column.carry}, **row.memory,
        }  # fmt: skip
        more = moment.variance + _by_parameters(now, turning * torque, J, b, sd_J, sd_b)
        out = {
            "steering_wheel_angle": now.x[0], "steering_wheel_rate": now.x[1], "driver_torque": now.x[2] - noise.balance * torque,
            "steering_wheel_angle_sd": sqrt(now.P[0][0]), "steering_wheel_rate_sd": sqrt(now.P[1][1]),
            "driver_torque_sd": sqrt(now.P[2][2] + more), "column_torque": torque,
            "steering_wheel_angle_innovation": select(use, told.e, 0.0),
            "steering_wheel_angle_innovation_sd": sqrt(told.s), "steering_wheel_angle_used": use,
            "angle_turns": row.turns, "angle_jump": both(jump, negate(either(row.first, row.resumed))), "restarted": anew,
            "inputs_known": moment.known,
            "at_end_stop": row.stopped, "valid": valid,
        }  # fmt: skip
        return new, out

    first = pack(started(kalman, [0.0] * n))
    carry = {**carried(n), **first, "torque_before": 0.0, **column.carry, **ANGLE_CARRY}
    gains = {letter: getattr(design, letter) for letter in ("F", "G_0", "G_1", "K", "P", "Q", "Q_d")}
    return Observer(
        name, dt, column.inputs, (ANGLE,), carry, OUTPUTS, step, optional=column.optional,
        settings={"vehicle": vehicle.name, "dt": dt, "J_s": J, "b_s": b, **column.settings, **noise.settings()},
        gains={**gains, "R": np.diag(design.R)}, certificate=design.certificate,
    )  # fmt: skip


def settled_variance(stationary: float) -> float:
    """The variance of the torque, (N m)^2, up to which an estimate counts as settled.

    A filter that expects hardly any change of the torque takes for ever to reach its own stationary variance; SURE is enough.
    """
    return max(SETTLED * stationary, SURE**2)


def filter_of(design: DisturbanceDesign, wide: list[float]) -> Filter:
    """A design as the tick takes it."""
    model = design.model
    return Filter(design.F, design.G_0, design.G_1, model.C, model.D, design.Q_d, [plain(r) for r in design.R], wide)


def _by_parameters(now: Moments, torque: Scalar, J: float, b: float, sd_J: float, sd_b: float) -> Scalar:
    """Variance of the torque that J_s and b_s leave open, (N m)^2."""
    total: Scalar = 0.0
    rate = now.x[1]
    if sd_J:
        part = (sd_J / J) * (now.x[2] + torque - b * rate)
        total = total + part * part
    if sd_b:
        part = sd_b * rate
        total = total + part * part
    return total


def _sd(vehicle: Vehicle, name: str) -> float:
    """A parameter's standard deviation; 0 where nobody gave one."""
    sd = vehicle.parameters[name].sd
    return float(sd) if isinstance(sd, (int, float)) else 0.0


_ESTIMATES = (
    Output("driver_torque", "N*m", "estimate", "T_dr, torque of the driver's hands on the wheel"),
    Output(ANGLE, "rad", "estimate", "angle of the wheel"),
    Output("steering_wheel_rate", "rad/s", "estimate", "its rate"),
)
OUTPUTS = (
    *_ESTIMATES,
    *(Output(f"{o.name}_sd", o.unit, "sd", f"standard deviation of {o.name}") for o in _ESTIMATES),
    Output("column_torque", "N*m", "input", "T_k: all that acts on the column beside the driver's hands"),
    Output("angle_turns", "rad", "input", "what was added to the encoder's value, for wraps"),
    Output(f"{ANGLE}_innovation", "rad", "innovation", "measured angle less predicted; 0 where none arrived"),
    Output(f"{ANGLE}_innovation_sd", "rad", "innovation_sd", "standard deviation of the innovation"),
    Output(f"{ANGLE}_used", "1", "flag", "1 where an angle was used"),
    Output("angle_jump", "1", "flag", "1 where the angle jumped and the filter started anew"),
    Output("restarted", "1", "flag", "1 where the filter started anew: first angle, jump, or after a gap"),
    Output("at_end_stop", "1", "flag", "1 beyond the end stop of the vehicle file"),
    Output("inputs_known", "1", "flag", "1 where all that acts on the column is known"),
    Output("valid", "1", "flag", "1 where the model holds, the inputs are known and the estimate has settled"),
)
