"""The pedals at once, the observer for the rest.

    a_i = a_p - o + b,    j_i = j_p + b'
    v'  = f + b,          y1 = f + b + o_a,          y2 = v

What the pedals ask for, a_p - o, and its rate j_p come from the filter of the pedals (`fused_pedals`) with hardly any lag.
The rest b (slope, drag, rolling resistance, wrong parameters) is slow. It comes from the observer of the papers (`jerk`) with
the force f of engine and brakes as its known input, and b, b' in place of a_i, j_i. Its knob is 1 whatever ell, the papers'
gain as it is: what is slow may lag and should be quiet.

    intent-fused   f = tau/M T_e - sigma c_b/M p_b    pedals as in 2017 eq. (23)
    fused-torque   the same                           the requested torque in place of the accelerator

The intention is that of 2017 eq. (7); the papers' observer estimates all of a_i by itself, from the accelerometer and the
speed, and so lags all of it.

The bands add the variances of both parts: the pedals', from the learnt noise of their sensors and the bursts assumed,
wider where their innovations lean (`fused_noise`), and the rest's, whose scale is learnt from its innovations
(`noise_scale`). What a jump of tau hands over to the jerk counts as its own standard deviation, for it is a matter of
definition whether that belongs to the driver.
"""

from __future__ import annotations

from codriver.kernel import both, negate, select, sqrt
from codriver.observers import fused_noise
from codriver.observers.fused_gain import design_pedal_gain, pedal_delay, stationary_gain
from codriver.observers.fused_pedals import pedal_filter
from codriver.observers.jerk import jerk_observer
from codriver.observers.observer import Observer, Output, Scalars
from codriver.observers.scaled_gain import Preset, design_scaled_gain
from codriver.vehicles import Vehicle

REST_ELL = 1.0
_REST = (
    Output("longitudinal_speed", "m/s", "estimate", "v"),
    Output("rest_acceleration", "m/s^2", "estimate", "b"),
    Output("acceleration_offset", "m/s^2", "estimate", "o_a = g sin(slope) + accelerometer bias"),
    Output("rest_jerk", "m/s^3", "estimate", "b'"),
)
_PARTS = ("acceleration", "jerk")
# Of role "input", not "innovation": a quick foot is many times its band for a moment, and no fault that check() should name.
_BAND = Output("pedal_innovation_sd", "m/s^2", "input", "standard deviation of pedal_innovation")


def fused_observer(
    vehicle: Vehicle, dt: float, ell: float | None, preset: Preset, form: str, outputs: tuple[Output, ...], *,
    torque: bool = False,
) -> Observer:  # fmt: skip
    """The pedals' filter and the observer of the rest, as one observer.

    Args:
        vehicle: with mass, transmission and c_b; for the pedals also c_r.
        dt: tick, s.
        ell: the knob; None takes the preset's.
        preset: noise of the observer of the rest.
        form: of the observer of the rest: "kalman" or "constant".
        outputs: speed, intentional acceleration, offset and intentional jerk, by the names they bear in the result.
        torque: whether the requested torque stands for the accelerator.

    Raises:
        UsageError: ell is out of range.
        DesignError: the observer of the rest fails its certificate.
    """
    ell = preset.ell if ell is None else ell
    gain = design_pedal_gain(dt, ell)
    front = pedal_filter(vehicle, gain, torque=torque)
    rest = jerk_observer(design_scaled_gain(preset, dt, REST_ELL), form, _REST)
    names = [output.name for output in outputs]

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        """One tick: the pedals, the rest, and their sum."""
        new, pedals = front.step(carry, u, y, ok, rho)
        given = {**{name: pedals[name] for name in rest.inputs}, "known_input": pedals["force"]}
        more, slow = rest.step({key: carry[f"rest_{key}"] for key in rest.carry}, given, y, ok, rho)
        moving = negate(slow["standstill"])
        e, s = pedals["pedal_innovation"], pedals["pedal_innovation_variance"]
        counts = both(both(pedals["pedal_used"], pedals["pedal_settled"]), moving)
        learnt, factor = fused_noise.lean(carry, e, s, counts, dt, 1.0 / ell)
        out = {**pedals, **slow, names[0]: slow["longitudinal_speed"], names[2]: slow["acceleration_offset"]}
        extra = {"acceleration": 0.0, "jerk": pedals["pedal_handed_over"]}
        for name, part in ((names[1], "acceleration"), (names[3], "jerk")):
            sd, more_sd = slow[f"rest_{part}_sd"], extra[part]
            out[name] = select(moving, pedals[f"pedal_{part}"] + slow[f"rest_{part}"], 0.0)
            out[f"{name}_sd"] = sqrt(sd * sd + more_sd * more_sd + factor * pedals[f"pedal_{part}_variance"])
        out[_BAND.name] = sqrt(factor * s)
        out["valid"] = both(slow["valid"], pedals["pedal_settled"])
        return {**new, **{f"rest_{key}": more[key] for key in rest.carry}, **learnt}, {
            o.name: out[o.name] for o in all_outputs
        }

    sds = tuple(Output(f"{o.name}_sd", o.unit, "sd", f"standard deviation of {o.name}") for o in outputs)
    inner = {f"{o.name}{end}" for o in _REST for end in ("", "_sd")}
    own = {f"pedal_{part}{end}" for part in _PARTS for end in ("", "_variance")}
    own |= {"pedal_settled", "pedal_handed_over", "force", "pedal_innovation_variance"}
    all_outputs = (
        *(o for o in front.outputs if o.name not in own), *outputs, *sds, _BAND,
        *(o for o in rest.outputs if o.name not in inner),
    )  # fmt: skip
    return Observer(
        "fused", dt, front.inputs, (*rest.measured, *front.measured),
        {**front.carry, **{f"rest_{key}": value for key, value in rest.carry.items()}, **fused_noise.initial_lean()},
        all_outputs, step,
        optional=front.optional,
        settings={
            **front.settings, "form": form, "ell": ell, "dt": dt, "delay_s": round(pedal_delay(gain), 6),
            "rest_ell": rest.settings["ell"],
        },
        gains={"A_p": gain.A, "L_p": stationary_gain(gain), **rest.gains},
        certificate=rest.certificate,
    )  # fmt: skip
