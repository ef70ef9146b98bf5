"""What was true in a drive, as a Log: the reference an estimate is judged against.

Intention as the model defines it (2017 eq. 7), with the car's true parameters:

    M a_i = tau T_r (1 - sigma) - sigma F_b - F_d(v),    F_d = M g sin(alpha) + kappa_1 + kappa_2 v^2

tau is that of the engaged gear; during a shift the old one until the new gear is in. So a_i jumps where tau or sigma
does, and its derivative has impulses there. `intentional_jerk` is the derivative of the smooth parts alone, written
out:

    M j_i = tau c_r p_r' (1 - sigma) - sigma c_b p_b' - M g cos(alpha) alpha'(s) v - 2 kappa_2 v v'

An estimator sees the jumps as well, spread by its own lag. Judge it therefore against the same estimator fed with
`ideal_signals`, which lags alike and has neither noise nor errors of u; this log's jerk is for counting bursts and
for plots.

Intention as the driver planned it (`planned_acceleration`, `planned_jerk`) knows nothing of gears and pedals. It is
the more honest of the two, since model and estimator share the first.

`known_input` is u of eq. 10a with the torque that truly passed the clutch, so a_i + u = v' holds whenever the car
moves. (At standstill static friction carries the rest.)
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from codriver.names import VOCABULARY
from codriver.signals import Log, Signal
from codriver.signals.signal import Array
from codriver.simulate.car import GRAVITY
from codriver.simulate.drive import Trace

_EXTRA_UNITS = {
    "planned_acceleration": "m/s^2",
    "planned_jerk": "m/s^3",
    "clutch_torque": "N*m",
    "shift": "1",
    "braking": "1",
}


def intention(trace: Trace) -> tuple[Array, Array, Array]:
    """a_i (m/s^2), j_i (m/s^3) and u (m/s^2) at every row of the trace; see the module."""
    car, v, slope = trace.car, trace["speed"], trace["slope"]
    sigma, tau = trace.braking, trace.tau
    dissipated = car.mass * GRAVITY * np.sin(slope) + car.rolling + car.drag * v * v
    braking = car.brake * trace["brake"]
    a_i = (tau * trace["request"] * (1 - sigma) - sigma * braking - dissipated) / car.mass
    bend = trace.road.at(np.gradient(trace.road.slope), trace["distance"])
    changing = car.mass * GRAVITY * np.cos(slope) * bend * v + 2 * car.drag * v * trace["acceleration"]
    j_i = (
        tau * car.pedal * trace["pedal_rate"] * (1 - sigma) - sigma * car.brake * trace["brake_rate"] - changing
    ) / car.mass
    u = (tau * trace["passed"] - (1 - sigma) * (tau * trace["request"] + braking)) / car.mass
    return a_i, j_i, u


def truth_log(trace: Trace, *, bias: float = 0.05, rate: float = 100.0) -> Log:
    """The true signals of a drive.

    Standard names, and beside them planned_acceleration, planned_jerk, clutch_torque, shift (1 up, -1 down) and
    braking. `longitudinal_acceleration` is here v' itself, without the accelerometer's offset.

    Args:
        trace: the drive.
        bias: of the accelerometer, m/s^2, for `acceleration_offset`.
        rate: samples per second; the trace's own rows, thinned out without filtering.
    """
    a_i, j_i, u = intention(trace)
    v, a = trace["speed"], trace["acceleration"]
    values = {
        "longitudinal_speed": v,
        "longitudinal_acceleration": a,
        "longitudinal_jerk": np.gradient(a, trace.dt),
        "intentional_acceleration": a_i,
        "intentional_jerk": j_i,
        "known_input": u,
        "planned_acceleration": trace["planned_acceleration"],
        "planned_jerk": trace["planned_jerk"],
        "road_slope": trace["slope"],
        "acceleration_offset": GRAVITY * np.sin(trace["slope"]) + bias,
        "distance": trace["distance"],
        "accelerator_pedal": trace["pedal"],
        "brake_pressure": trace["brake"],
        "engine_torque": trace["torque"],
        "engine_torque_request": trace["request"],
        "engine_speed": trace["engine_speed"],
        "clutch_torque": trace["passed"],
        "gear": trace["gear"],
        "clutch": trace.clutch_share,
        "shift": trace["shifting"],
        "braking": trace.braking,
    }
    every = max(1, round(1.0 / (rate * trace.dt)))
    return Log.of(
        [
            Signal(name, trace["time"][::every], column[::every], _unit(name), "simulation")
            for name, column in values.items()
        ],
        "truth of a simulated drive",
    )


def ideal_signals(
    trace: Trace, of: Literal["model", "plan"] = "model", *, bias: float = 0.05, rate: float = 100.0
) -> Log:
    """What a perfect car would show an estimator: the delay-matched reference is the estimator's answer to it.

    Speed v, accelerometer v' + o_a and known input u, free of noise, with u such that the intention v' - u is exactly
    a_i (of="model") or the driver's plan (of="plan").
    """
    truth = truth_log(trace, bias=bias, rate=rate)
    time, a = truth["longitudinal_speed"].time, truth["longitudinal_acceleration"].values
    wanted = truth["intentional_acceleration" if of == "model" else "planned_acceleration"].values
    made = {"longitudinal_acceleration": a + truth["acceleration_offset"].values, "known_input": a - wanted}
    signals = [Signal(name, time, values, VOCABULARY[name].unit, "simulation") for name, values in made.items()]
    return Log.of([truth["longitudinal_speed"], *signals], f"ideal signals of a simulated drive, intention of the {of}")


def _unit(name: str) -> str:
    return VOCABULARY[name].unit if name in VOCABULARY else _EXTRA_UNITS[name]
