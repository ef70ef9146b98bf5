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

from codriver.kernel import Scalar, both, negate, select, sqrt
from codriver.observers import noise_scale
from codriver.observers.jerk_forms import ROWS, STATES, Situation, constant_update, initial, kalman_update
from codriver.observers.observer import Observer, Output, Scalars
from codriver.observers.response import delay
from codriver.observers.scaled_gain import ScaledGain

STANDSTILL_BELOW, STANDSTILL_ABOVE = 0.3, 0.5
SLOW = 1.0


def jerk_observer(design: ScaledGain, form: str, outputs: tuple[Output, ...], name: str = "jerk") -> Observer:
    """The observer of speed, acceleration, offset and jerk from accelerometer and speed, given the known input.

    Args:
        design: gains at one ell and tick.
        form: "kalman" or "constant".
        outputs: the four estimates, in the order of STATES, by the names they bear in the result.
        name: of the observer.
    """
    update = kalman_update if form == "kalman" else constant_update

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        """One tick: predict, update in the form's way, learn the noise scale, judge validity."""
        y_a, y_v = _measurements(u, y, ok)
        ok_a, ok_v = ok["longitudinal_acceleration"], ok["longitudinal_speed"]
        started, standing = _phase(carry, y_v, ok_v)
        known = select(standing, 0.0, u["known_input"])
        first = both(started, negate(carry["started"]))
        start = [y_v, 0.0, select(ok_a, y_a - known, 0.0), 0.0]
        x = [select(first, new, old) for new, old in zip(start, _predict(carry, design, known), strict=True)]
        lost = both(negate(u["inputs_known"]), negate(standing))
        use_a, use_v = both(ok_a, started), both(ok_v, started)
        now = Situation(known, y_a, y_v, use_a, use_v, started, first, standing, lost)
        done = update(design, carry, x, now)

        x = [done.x[0], select(standing, 0.0, done.x[1]), done.x[2], select(standing, 0.0, done.x[3])]
        moving = both(started, negate(standing))
        counts = both(moving, done.settled)
        scale_new, scale = noise_scale.learn(carry, done.innovations, counts, design.dt, 1.0 / design.ell)
        quick = select(x[0] < 0, -x[0], x[0]) >= SLOW
        valid = both(both(moving, quick), both(u["inputs_known"], done.settled))
        new = {
            "started": started, "standing": standing, "input_before": known,
            **{f"x_{state}": value for state, value in zip(STATES, x, strict=True)}, **done.memory, **scale_new,
        }  # fmt: skip
        out = {output.name: value for output, value in zip(outputs, x, strict=True)}
        out |= {f"{o.name}_sd": sqrt(scale * variance) for o, variance in zip(outputs, done.variances, strict=True)}
        for row, (e, s, use) in done.innovations.items():
            out |= {f"{row}_innovation": e, f"{row}_innovation_sd": sqrt(scale * s), f"{row}_used": use}
        return new, {**out, "standstill": standing, "valid": valid}

    carry = {"started": 0.0, "standing": 0.0, "input_before": 0.0, **{f"x_{state}": 0.0 for state in STATES}}
    return Observer(
        name, design.dt, ("known_input", "direction", "inputs_known"), ("longitudinal_acceleration", "longitudinal_speed"),
        {**carry, **initial(design, form), **noise_scale.initial()}, (*outputs, *_more_outputs(outputs, ROWS)), step,
        settings={"form": form, "ell": design.ell, "dt": design.dt, "delay_s": round(delay(design), 6)},
        gains={"L_K": design.L_K, "L": design.L, "K": design.K, "P": design.P, "Q_ell": design.Q, "R_ell": design.R},
        certificate=design.certificate,
    )  # fmt: skip


def _measurements(u: Scalars, y: Scalars, ok: Scalars) -> tuple[Scalar, Scalar]:
    """Accelerometer and signed speed, 0 where there is none: wheel speeds seldom carry a sign, the gear does."""
    y_a = select(ok["longitudinal_acceleration"], y["longitudinal_acceleration"], 0.0)
    raw = select(ok["longitudinal_speed"], y["longitudinal_speed"], 0.0)
    return y_a, select(u["direction"] < 0, -select(raw < 0, -raw, raw), raw)


def _phase(carry: Scalars, y_v: Scalar, ok_v: Scalar) -> tuple[Scalar, Scalar]:
    """Whether the observer has started, and whether the vehicle stands (with hysteresis, kept while no speed comes)."""
    size = select(y_v < 0, -y_v, y_v)
    started = select(carry["started"], 1.0, ok_v)
    bound = select(carry["standing"], STANDSTILL_ABOVE, STANDSTILL_BELOW)
    return started, select(ok_v, size < bound, carry["standing"])


def _predict(carry: Scalars, design: ScaledGain, known: Scalar) -> list[Scalar]:
    """The states one tick on, before the measurements."""
    x = [carry[f"x_{state}"] for state in STATES]
    dt = design.dt
    v = x[0] + dt * x[1] + float(design.F[0, 3]) * x[3] + (0.5 * dt) * (carry["input_before"] + known)
    return [v, x[1] + dt * x[3], x[2], x[3]]


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
