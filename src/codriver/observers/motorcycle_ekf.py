"""The motorcycle's large-angle extended Kalman filter on the raw signals of an IMU, a steering encoder and a speed.

    x = (phi, delta, v_y, W, phi', delta', Y_f, Y_r, tau, M_phi, theta', b_p, b_q, b_r, b_y, b_z [, delta_0])

The first eight move as `models.motorcycle_lean` says, at any lean; the rider's torque tau walks. M_phi, N m, is a moment about the
road that nothing else explains: a leaning rider, a side wind, feet on the ground. theta' is a pitch rate that comes and goes within
`PITCH_TIME`. The biases of gyroscope and accelerometer walk slowly, and so does delta_0, the zero of the encoder, which shows
delta + delta_0: a state only where `EkfNoise.zero` tells that it is unknown. In body axes (ISO 8855) the IMU at (X, n, Z) shows

    p = phi' + b_p,   q = theta' + W sin phi + b_q,   r = W cos phi + b_r
    f_y = a_y cos phi + (a_z + g) sin phi + b_y,      f_z = -a_y sin phi + (a_z + g) cos phi + b_z
    a_y = v_y' + v W + X W' - Z (phi'' cos phi - phi'^2 sin phi) - n (phi'' sin phi + phi'^2 cos phi) + W^2 (Z sin phi - n cos phi)
    a_z = (rho - Z)(phi'' sin phi + phi'^2 cos phi) + n (phi'' cos phi - phi'^2 sin phi)

with v_y', W', phi'' from the model, so that what the tyres do is told by the accelerometer. No acceleration is squared away, no
turn is taken as balanced, no pitch rate as zero.

**Tick.** x+ = x + (dt + A dt^2/2 + ...) f(x), F = 1 + A dt + A^2 dt^2/2 + ... with A at the last estimate, as many terms as the
tick needs up to the greatest speed. Rows one at a time, where fresh. v and v' come from the speed by `track_speed`.

**Start** once everything needed came within `STALE` s, at sin phi = (f_y - v r) / g: exact in a steady turn at any lean, and at
rest. A gap of `GAP` s, or a roll beyond `STEEPEST`, starts it anew.

**Noise.** What a sensor's samples scatter by is learnt from their second differences (`learn_scatter`), beside a floor for what
the model leaves out. The model's own noise is `EkfNoise`; its defaults were chosen so that bands cover machines that are told wrong
(docs/motorcycle.md).

**Slow.** Below `SLOW` m/s feet may be on the ground, so that M_phi may be anything: roll is then gyroscope's and gravity's. `slow`
is 1 there, `speed_in_range` 0 outside the speeds given; `valid` is 1 where the speed is in range and not slow, signals come, and
the roll's standard deviation is below `SURE`.

Sharp 1971 and Cossalter 2006 as in `motorcycle_lean`; the filter: Jazwinski 1970 (Stochastic Processes and Filtering Theory), 8.3.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from codriver.kernel import Scalar, both, negate, select, sqrt
from codriver.models.motorcycle_lean import LeanParameters, lean_functions
from codriver.names import quantity
from codriver.observers.arrivals import all_came, arrivals_carry, note_arrivals
from codriver.observers.augmented_kalman import Moments, carried, pack, unpack
from codriver.observers.covariance import Matrix, update_row
from codriver.observers.motorcycle_ekf_rows import sensor_function
from codriver.observers.motorcycle_ekf_states import (
    BEND_TIME,
    BIASES,
    HEAVE_TIME,
    IMU,
    LEAN,
    LEANING,
    MOMENT,
    MOMENT_TIME,
    MOVING,
    OFFSET,
    PITCH_TIME,
    PITCHING,
    ROLL,
    ROWS,
    STEEPEST,
    STEER,
    TILT_TIME,
    TURN,
    EkfNoise,
)  # fmt: skip
from codriver.observers.observer import Observer, Output, Scalars
from codriver.observers.sample_scatter import learn_scatter, scatter_carry
from codriver.observers.scaled_gain import check_tick
from codriver.observers.series import series, terms_needed
from codriver.observers.speed_tracker import CARRY as SPEED_CARRY
from codriver.observers.speed_tracker import track_speed

DEGREE = np.pi / 180
SPEED = "longitudinal_speed"
OPTIONAL = frozenset({"pitch_rate", "vertical_acceleration"})
NEEDED = tuple(name for name in (*ROWS, SPEED) if name not in OPTIONAL)
TILTED = {"roll_rate": TURN, "yaw_rate": LEANING}  # rows that see another rate where the machine is pitched
TRACKING, SCATTER_TIME = 4.0, 2.0  # rad/s, s
GAP, STALE = 1.0, 0.25  # s
SLOW = (2.0, 4.0)  # m/s: all of it below the first, none above the second
SURE = 3 * DEGREE
CLOSE, TERMS = 1e-3, 12
OWN = {OFFSET: "what steer_angle shows straight ahead"}
SCATTER = dict(zip(IMU, (0.05, 0.05, 0.05, 1.0, 1.0), strict=True))  # rad/s, m/s^2, until learnt


def motorcycle_ekf(
    p: LeanParameters, dt: float = 0.01, *, low: float = 5.0, high: float = 45.0, noise: EkfNoise | None = None
) -> Observer:
    """The filter.

    Args:
        p: the machine.
        dt: tick, s.
        low, high: speeds between which it is claimed to hold, m/s.
        noise: of the model; with `zero` above 0 the encoder's zero is a state, and `steer_offset` an output.

    Raises:
        DesignError: a tick too long for the tyres at the greatest speed.
        UsageError: a tick that cannot be.
    """
    check_tick(dt)
    noise = noise or EkfNoise()
    states, starts, bounds = noise.states, noise.start(), noise.bounds()
    n = len(states)
    predict, terms = _prediction(p, noise, dt, high)
    take = _rows(p, noise, dt)

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        came = note_arrivals(carry, NEEDED, y, ok, dt)
        begun, active = carry["begun"], select(carry["begun"], 1.0, all_came(came, NEEDED, STALE))
        track = track_speed(carry, y[SPEED], ok[SPEED], TRACKING, dt)
        scatter = learn_scatter(carry, IMU, y, ok, SCATTER_TIME, dt)
        v, dv = track["speed"], track["speed_rate"]
        slowness = select(v < SLOW[0], 1.0, select(v > SLOW[1], 0.0, (SLOW[1] - v) / (SLOW[1] - SLOW[0])))

        moved, P, A = predict(unpack(carry, n), v, dv, slowness)
        start = _start(p, came, v, states)
        found = [select(begun, moved[i], start[i]) for i in range(n)]
        apart: Matrix = [[0.0 if i != j else starts[i] ** 2 for j in range(n)] for i in range(n)]
        apart[MOMENT][MOMENT] += slowness * noise.feet**2
        covariance = [[select(begun, P[min(i, j), max(i, j)], apart[i][j]) for j in range(n)] for i in range(n)]
        # The sample that it starts from is not taken twice.
        fresh = {row: both(ok[row], begun) for row in ROWS}
        done, out = take(Moments(found, covariance), A, v, dv, y, fresh, scatter)

        bounded = [select(a > b, b, select(a < -b, -b, a)) for a, b in zip(done.x, bounds, strict=True)]
        estimate = [select(active, a, 0.0) for a in bounded]
        variances = [select(done.P[i][i] > 0, done.P[i][i], 0.0) for i in range(n)]
        systematic = noise.share * estimate[ROLL]
        variances[ROLL] = variances[ROLL] + systematic * systematic
        sds = [select(active, sqrt(variance), sd) for variance, sd in zip(variances, starts, strict=True)]
        lean = select(estimate[ROLL] < 0, -estimate[ROLL], estimate[ROLL])
        keep = both(active, both(all_came(came, NEEDED, GAP), lean < STEEPEST))
        inside = both(track["speed_known"], both(v >= low, v <= high))
        sure = both(both(all_came(came, NEEDED, STALE), sds[ROLL] < SURE), both(inside, negate(slowness > 0)))
        new = {**pack(Moments(estimate, done.P)), "begun": keep, **came, **track, **scatter}
        for name, value, sd in zip(states, estimate, sds, strict=True):
            out |= {name: value, f"{name}_sd": sd}
        flags = {"slow": slowness > 0, "speed_in_range": inside, "valid": both(keep, sure)}
        return {key: new[key] for key in begin}, out | flags

    begin = {**carried(n), "begun": 0.0, **arrivals_carry(NEEDED), **SPEED_CARRY, **scatter_carry(SCATTER)}
    return Observer(
        "motorcycle-ekf", dt, (), (*ROWS, SPEED), begin, _outputs(states, low, high), step, optional=OPTIONAL,
        settings={"low": low, "high": high, "terms": terms, "front_crown": p.front_crown, "rear_crown": p.rear_crown,
                  "pneumatic_trail": p.pneumatic_trail},
    )  # fmt: skip


def _prediction(p: LeanParameters, noise: EkfNoise, dt: float, high: float) -> tuple[Callable[..., Any], int]:
    """(estimate, v, v', slowness) -> state and covariance a tick later, and A at the estimate; terms of the series."""
    import casadi as ca

    linear = lean_functions(p)[1]
    n, Q, terms = len(noise.states), noise.process(), _terms(linear, dt, high)

    def predict(now: Moments, v: Scalar, dv: Scalar, slowness: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        x: Scalar = ca.vertcat(*now.x)
        P: Scalar = ca.vertcat(*[ca.horzcat(*row) for row in now.P])
        f, A = linear(x[:LEAN], v, dv, ca.sin(x[0]), ca.cos(x[0]))
        whole = ca.SX(n, n)
        whole[:MOVING, :LEAN] = A
        whole[MOMENT, MOMENT], whole[PITCHING, PITCHING] = -1 / MOMENT_TIME, -1 / PITCH_TIME
        rate = ca.vertcat(f, 0, -x[MOMENT] / MOMENT_TIME, -x[PITCHING] / PITCH_TIME, ca.SX(n - BIASES, 1))
        F = ca.SX.eye(n) + series(whole, whole, dt, terms)
        spread = ca.SX(ca.DM(Q * dt))
        spread[MOMENT] += slowness * (noise.feet**2 * 2 / MOMENT_TIME * dt)
        return x + series(whole, rate, dt, terms), F @ P @ F.T + ca.diag(spread), A

    return predict, terms


def _rows(p: LeanParameters, noise: EkfNoise, dt: float) -> Callable[..., tuple[Moments, Scalars]]:
    """(prediction, A, v, v', y, fresh, scatter) -> the estimate after the rows, one at a time, and innovations."""
    import casadi as ca

    n, floors = len(noise.states), noise.floors(dt)
    rates, show = lean_functions(p)[0], sensor_function(p, n)

    def take(
        ahead: Moments, A: Scalar, v: Scalar, dv: Scalar, y: Scalars, fresh: Scalars, scatter: Scalars
    ) -> tuple[Moments, Scalars]:
        # What the rows should show; the accelerations' derivatives are those at the last estimate.
        found = ahead.x
        x: Scalar = ca.vertcat(*found)
        S, C = ca.sin(x[0]), ca.cos(x[0])
        expected, H, heave = show(x, rates(x[:LEAN], v, dv, S, C)[2:5], A[2:5, :], v, S, C)
        done = ahead
        out: Scalars = {}
        for k, row in enumerate(ROWS):
            value = expected[k] + sum(H[k, i] * (done.x[i] - found[i]) for i in range(n))
            e = select(fresh[row], y[row] - value, 0.0)
            R = floors[row] + (scatter[f"scatter_{row}"] if row in IMU else 0.0)
            if row in TILTED:
                seen = noise.tilt * found[TILTED[row]]
                R = R + seen * seen * (2 * TILT_TIME / dt)
            if row == "steer_angle" and noise.zero:
                seen = noise.bend * found[STEER]
                R = R + seen * seen * (2 * BEND_TIME / dt)
            if row == "vertical_acceleration":
                R = R + (noise.heave * heave) ** 2 * (2 * HEAVE_TIME / dt)
            mean, covariance, s = update_row(done.x, done.P, [H[k, i] for i in range(n)], e, R, fresh[row])
            done = Moments(mean, covariance)
            out |= {f"{row}_innovation": e, f"{row}_innovation_sd": sqrt(s)}
        return done, out

    return take


def _start(p: LeanParameters, came: Scalars, v: Scalar, states: tuple[str, ...]) -> list[Scalar]:
    """The state at the first tick: a steady turn, or rest."""
    import casadi as ca

    q = p.sharp
    given = {name: came[f"latest_{name}"] for name in NEEDED}
    lean = (given["lateral_acceleration"] - v * given["yaw_rate"]) / q.g
    held = select(lean > 0.95, 0.95, select(lean < -0.95, -0.95, lean))
    turn = given["yaw_rate"] / sqrt(1 - held * held)
    share, side = q.load / (q.mass * q.g), q.mass * v * turn
    known = {
        "roll_angle": ca.asin(held), "steer_angle": given["steer_angle"], "heading_rate": turn,
        "roll_rate": given["roll_rate"], "front_lateral_force": side * share, "rear_lateral_force": side * (1 - share),
    }  # fmt: skip
    return [known.get(name, 0.0) for name in states]


def _terms(linear: Scalar, dt: float, high: float) -> int:
    """Terms that a tick needs at rest and up to a quarter beyond the greatest speed."""
    scale = np.array([1.0, 0.1, 1, 1, 1, 1, 300, 300])
    closed = []
    for v in (0.0, high, 1.25 * high):
        for roll in (0.0, 0.6):
            A = np.array(linear([roll, *[0.0] * (LEAN - 1)], v, 0.0, np.sin(roll), np.cos(roll))[1])[:, :MOVING]
            closed.append(A * scale / scale[:, None])
    return terms_needed(closed, dt, CLOSE, TERMS)


def _outputs(states: tuple[str, ...], low: float, high: float) -> tuple[Output, ...]:
    """All outputs."""
    outputs = []
    for name in states:
        unit = quantity("steer_angle" if name == OFFSET else name.removesuffix("_bias")).unit
        meaning = f"bias of {name[:-5]}" if name.endswith("_bias") else OWN.get(name) or quantity(name).meaning
        outputs += [
            Output(name, unit, "estimate", meaning),
            Output(f"{name}_sd", unit, "sd", f"standard deviation of {name}"),
        ]
    for row in ROWS:
        unit, name = quantity(row).unit, f"{row}_innovation"
        outputs += [
            Output(name, unit, "innovation", f"measured {row} less predicted; 0 where none arrived"),
            Output(f"{name}_sd", unit, "innovation_sd", f"standard deviation of {name}"),
        ]
    return (
        *outputs,
        Output("slow", "1", "flag", "1 where it is so slow that feet may be on the ground"),
        Output("speed_in_range", "1", "flag", f"1 where the speed is between {low:.4g} and {high:.4g} m/s"),
        Output("valid", "1", "flag", "1 where the speed is in range, signals come, and the roll is known to 3 degrees"),
    )
