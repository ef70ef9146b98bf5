"""The observer of [v, a_i, o_a, j_i], in its Kalman and its constant-gain form.

    predict   x- = F x + [dt (u_before + u) / 2; 0; 0; 0],   P- = F P F' + Q_d
    update    e1 = y1 - (a_i + o_a + u),  e2 = y2 - v,  each row when it is fresh:  x = x- + K e

Kalman form: P is carried and K follows from it, so rows at different rates and holes are exact. Constant form: K is the
stationary gain (the papers'), and an innovation after n ticks without that row counts n times (up to where n K_vv is
0.77), as it stands for n ticks: without that the form is unstable when the speed comes on every eighth tick or more
rarely. When nothing is missing, both are the same. The known input is taken straight between ticks.

Outside the model:
* start: the first speed sets v; a_i = j_i = 0; the first accelerometer value sets o_a; the covariance starts wide.
* standstill (speed below 0.3 m/s, left above 0.5 m/s): the driver's brake force is met by the road, the model does not
  hold. a_i and j_i are 0 by definition, u is not used, o_a follows the accelerometer.
* inputs missing: u is 0, and what it was is anybody's guess, so the covariance of a_i and j_i goes back to its wide start.
* `valid` is 1 where the car moves faster than 1 m/s, the inputs are known, and the estimate has settled: the jerk's
  variance is at most 2.25 times the stationary one (Kalman), or the last start, loss of inputs or gap of over 0.5 s in a
  row is three time constants past (constant). The noise scale learns only then.

Bisoffi et al. 2017, eq. (14)-(18).
"""

from __future__ import annotations

import numpy as np

from codriver.kernel import Scalar, both, either, minimum, negate, select, sqrt
from codriver.models import intention_model
from codriver.observers import noise_scale
from codriver.observers.covariance import Matrix, predict_covariance, update_row
from codriver.observers.observer import Observer, Output, Scalars
from codriver.observers.response import delay
from codriver.observers.scaled_gain import ScaledGain

STATES = ("speed", "acceleration", "offset", "jerk")
STANDSTILL_BELOW, STANDSTILL_ABOVE = 0.3, 0.5
SLOW = 1.0
WIDE_START = 25.0  # the covariance starts this many times the stationary one
GAP = 0.5  # s without a row after which the constant form is not trusted
LARGEST_GAIN = 0.77  # bound of n K_vv in the constant form
SETTLED = 2.25  # valid while the jerk's variance is at most this many times the stationary one
_PAIRS = [(i, j) for i in range(4) for j in range(i, 4)]


def jerk_observer(design: ScaledGain, form: str, outputs: tuple[Output, ...], name: str = "jerk") -> Observer:
    """The observer of speed, acceleration, offset and jerk from accelerometer and speed, given the known input.

    Args:
        design: gains at one ell and tick.
        form: "kalman" or "constant".
        outputs: the four estimates, in the order of STATES, by the names they bear in the result.
        name: of the observer.
    """
    kalman = form == "kalman"
    P_stationary = design.P
    C, rows = intention_model().C, ("acceleration", "speed")
    # How long the constant form needs until its slowest error is down to 5 %.
    settle = 3.0 / design.certificate.decay_rate
    most = max(int(LARGEST_GAIN / float(design.K[0, 1])), 1)  # ticks that one innovation may stand for
    wide = [[WIDE_START * float(P_stationary[i, j]) if i == j else 0.0 for j in range(4)] for i in range(4)]

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        known, direction = u["known_input"], u["direction"]
        ok_a, ok_v = ok["longitudinal_acceleration"], ok["longitudinal_speed"]
        y_a = select(ok_a, y["longitudinal_acceleration"], 0.0)
        raw_v = select(ok_v, y["longitudinal_speed"], 0.0)
        backward = direction < 0
        y_v = select(backward, -select(raw_v < 0, -raw_v, raw_v), raw_v)  # wheel speeds seldom carry a sign

        started, standing = _phase(carry, y_v, ok_v)
        known = select(standing, 0.0, known)
        x, P = _predict(carry, design, known, kalman)
        first = both(started, negate(carry["started"]))
        x = [
            select(first, value, old)
            for value, old in zip([y_v, 0.0, select(ok_a, y_a - known, 0.0), 0.0], x, strict=True)
        ]
        if kalman:
            P = [[select(first, wide[i][j], P[i][j]) for j in range(4)] for i in range(4)]

        use_a, use_v = both(ok_a, started), both(ok_v, started)
        predicted_a = x[1] + x[2] + known
        if kalman:
            e_a = select(use_a, y_a - predicted_a, 0.0)
            x, P, s_a = update_row(x, P, C[0], e_a, design.Rd[0, 0], use_a)
            e_v = select(use_v, y_v - x[0], 0.0)
            x, P, s_v = update_row(x, P, C[1], e_v, design.Rd[1, 1], use_v)
        else:
            e_a, e_v = select(use_a, y_a - predicted_a, 0.0), select(use_v, y_v - x[0], 0.0)
            times_a, times_v = (minimum(carry[f"ticks_{row}"] + 1.0, float(most)) for row in rows)
            K = design.K
            x = [x[i] + (float(K[i, 0]) * (times_a * e_a) + float(K[i, 1]) * (times_v * e_v)) for i in range(4)]
            S = C @ design.P_predicted @ C.T + design.Rd
            s_a, s_v = float(S[0, 0]), float(S[1, 1])
        x = [x[0], select(standing, 0.0, x[1]), x[2], select(standing, 0.0, x[3])]
        lost = both(negate(u["inputs_known"]), negate(standing))
        if kalman:
            P = _forget_motion(P, standing, np.diag(np.diag(P_stationary)).tolist())
            P = _forget_motion(P, lost, wide)
            memory = {f"P_{STATES[i]}_{STATES[j]}": P[i][j] for i, j in _PAIRS}
            variances = [P[i][i] for i in range(4)]
            settled = P[3][3] <= SETTLED * float(P_stationary[3, 3])
        else:
            memory = {
                f"ticks_{row}": select(use, 0.0, carry[f"ticks_{row}"] + 1.0)
                for row, use in zip(rows, (use_a, use_v), strict=True)
            }
            gap = either(*(memory[f"ticks_{row}"] > GAP / design.dt for row in rows))
            memory["since_start"] = select(
                either(negate(started), either(lost, gap)), 0.0, carry["since_start"] + design.dt
            )
            variances = [float(P_stationary[i, i]) for i in range(4)]
            settled = memory["since_start"] >= settle

        moving = both(started, negate(standing))
        innovations = {"acceleration": (e_a, s_a, use_a), "speed": (e_v, s_v, use_v)}
        counts = both(moving, settled)
        scale_new, scale = noise_scale.learn(carry, innovations, counts, design.dt, 1.0 / design.ell)
        v_size = select(x[0] < 0, -x[0], x[0])
        valid = both(both(moving, v_size >= SLOW), both(u["inputs_known"], settled))
        new = {
            "started": started, "standing": standing, "input_before": known,
            **{f"x_{state}": value for state, value in zip(STATES, x, strict=True)}, **memory, **scale_new,
        }  # fmt: skip
        out = {output.name: value for output, value in zip(outputs, x, strict=True)}
        out |= {f"{o.name}_sd": sqrt(scale * variance) for o, variance in zip(outputs, variances, strict=True)}
        out |= {
            "acceleration_innovation": e_a, "acceleration_innovation_sd": sqrt(scale * s_a),
            "speed_innovation": e_v, "speed_innovation_sd": sqrt(scale * s_v),
            "acceleration_used": use_a, "speed_used": use_v, "standstill": standing, "valid": valid,
        }  # fmt: skip
        return new, out

    carry = {"started": 0.0, "standing": 0.0, "input_before": 0.0}
    carry |= {f"x_{state}": 0.0 for state in STATES}
    if kalman:
        carry |= {f"P_{STATES[i]}_{STATES[j]}": float(design.P[i, j]) for i, j in _PAIRS}
    else:
        carry |= {**{f"ticks_{row}": 0.0 for row in rows}, "since_start": 0.0}
    carry |= noise_scale.initial()
    return Observer(
        name, design.dt, ("known_input", "direction", "inputs_known"),
        ("longitudinal_acceleration", "longitudinal_speed"), carry, (*outputs, *_more_outputs(outputs, rows)), step,
        settings={"form": form, "ell": design.ell, "dt": design.dt, "delay_s": round(delay(design), 6)},
        gains={"L_K": design.L_K, "L": design.L, "K": design.K, "P": design.P, "Q_ell": design.Q, "R_ell": design.R},
        certificate=design.certificate,
    )  # fmt: skip


def _phase(carry: Scalars, y_v: Scalar, ok_v: Scalar) -> tuple[Scalar, Scalar]:
    """Whether the observer has started, and whether the vehicle stands (with hysteresis, kept while no speed comes)."""
    size = select(y_v < 0, -y_v, y_v)
    started = select(carry["started"], 1.0, ok_v)
    bound = select(carry["standing"], STANDSTILL_ABOVE, STANDSTILL_BELOW)
    return started, select(ok_v, size < bound, carry["standing"])


def _predict(carry: Scalars, design: ScaledGain, known: Scalar, kalman: bool) -> tuple[list[Scalar], Matrix]:
    """State and covariance one tick on, before the measurements."""
    x = [carry[f"x_{state}"] for state in STATES]
    F, dt = design.F, design.dt
    v = x[0] + dt * x[1] + float(F[0, 3]) * x[3] + (0.5 * dt) * (carry["input_before"] + known)
    predicted = [v, x[1] + dt * x[3], x[2], x[3]]
    if not kalman:
        return predicted, []
    P: Matrix = [[0.0] * 4 for _ in range(4)]
    for i, j in _PAIRS:
        P[i][j] = P[j][i] = carry[f"P_{STATES[i]}_{STATES[j]}"]
    return predicted, predict_covariance(P, F, design.Qd)


def _forget_motion(P: Matrix, when: Scalar, fresh: Matrix) -> Matrix:
    """What is known of acceleration and jerk is forgotten: their entries are those of `fresh`, the others stay."""

    def entry(i: int, j: int) -> Scalar:
        return select(when, fresh[i][j], P[i][j]) if i in (1, 3) or j in (1, 3) else P[i][j]

    return [[entry(i, j) for j in range(4)] for i in range(4)]


def _more_outputs(outputs: tuple[Output, ...], rows: tuple[str, str]) -> tuple[Output, ...]:
    """The outputs beside the four estimates."""
    sds = tuple(Output(f"{o.name}_sd", o.unit, "sd", f"standard deviation of {o.name}") for o in outputs)
    units = {"acceleration": "m/s^2", "speed": "m/s"}
    innovations = tuple(
        output
        for row in rows
        for output in (
            Output(
                f"{row}_innovation", units[row], "innovation", f"measured {row} less predicted; 0 where none arrived"
            ),
            Output(f"{row}_innovation_sd", units[row], "innovation_sd", f"standard deviation of {row}_innovation"),
        )
    )
    flags = (
        Output("acceleration_used", "1", "flag", "1 where an accelerometer value was used"),
        Output("speed_used", "1", "flag", "1 where a speed value was used"),
        Output("standstill", "1", "flag", "1 while the vehicle stands"),
        Output("valid", "1", "flag", "1 where the model holds, the inputs are known and the estimate has settled"),
    )
    return (*sds, *innovations, *flags)
