"""The PI observer as an observer with one step.

    x_k = Phi x_{k-1} + G_0 w_{k-1} + G_1 w_k,     x = (z, v^),  w = (y, u)                     w straight between ticks
    x_k = Phi x_{k-1} + (G_0 + G_1) w_{k-1}                                                     w held over the tick

Both are exact, by the matrix exponential of (33); the paper integrates by Runge and Kutta with w held. To a tick without a
measurement x^ moves as the plant does under v^, exactly too, and z = T_1 x^.

It starts when every output was measured once: x^ as that measurement has it, rates and unknown inputs 0, z = T_1 x^. Then its
error is what it is, and dies as the certificate says; `valid` is 1 from five of the slowest time constants on, where the known
inputs are there, and again that long after they were not, or after GAP seconds without a measurement. There are no
standard deviations: the design holds no noise.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from codriver.errors import DesignError
from codriver.kernel import Scalar, both, either, negate, select
from codriver.names import VOCABULARY
from codriver.observers.covariance import predict_mean
from codriver.observers.observer import Observer, Output, Scalars
from codriver.observers.pi_design import PIDesign
from codriver.observers.unknown_input import with_unknown
from codriver.signals.signal import Array

INPUTS = ("straight", "held")
SETTLES = 5.0  # slowest time constants
GAP = 0.5  # s


def pi_observer(
    design: PIDesign, dt: float, *, scales: Sequence[float] | None = None, inputs: str = "straight", name: str = "pi-observer",
    settings: Mapping[str, str | float] | None = None,
) -> Observer:  # fmt: skip
    """A PI observer that compiles, runs live and exports.

    Args:
        design: by `design_pi_observer`. Its plant has at least as many states as outputs, and each output measures one state.
        dt: tick, s.
        scales: what each measured signal is multiplied by to give the design's output; 1 by default, 180 / pi for degrees.
        inputs: how outputs and known inputs run between ticks: "straight" or "held".
        name: of the observer.
        settings: for provenance.

    Raises:
        DesignError: an output that is not one state's, or no such way of the inputs.
    """
    if inputs not in INPUTS:
        raise DesignError(f"inputs '{inputs}'", f"one of {', '.join(INPUTS)}", "choose one")
    system = design.system
    n, p = design.F.shape[0], design.C.shape[0]
    scale = [1.0] * p if scales is None else [float(s) for s in scales]
    seen = _state_of_each_output(design.C)
    measured, known = design.model.outputs, design.known
    Phi, (before, now) = system.transition(dt), system.input_maps(dt)
    plant = with_unknown(design.model, design.unknown)
    Phi_free, (before_free, now_free) = plant.transition(dt), plant.input_maps(dt)
    if inputs == "held":
        before, now = before + now, np.zeros_like(now)
        before_free, now_free = before_free + now_free, np.zeros_like(now_free)
    settle = SETTLES / design.certificate.decay_rate

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        x = [carry[f"x_{k}"] for k in range(n + len(design.unknown))]
        w = [carry[f"w_{k}"] for k in range(p + len(known))]
        given = [select(ok[c], u[c], carry[f"w_{p + k}"]) for k, c in enumerate(known)]
        rows = [select(ok[c], scale[k] * y[c], 0.0) for k, c in enumerate(measured)]
        fresh: Scalar = 1.0
        for c in measured:
            fresh = both(fresh, ok[c])
        begun = carry["begun"]
        first = both(negate(begun), fresh)
        x_hat = _sum(x[:n], predict_mean(w[:p], design.T_2))
        alone = _sum(
            predict_mean([*x_hat, *x[n:]], Phi_free), predict_mean(w[p:], before_free), predict_mean(given, now_free)
        )
        expected = predict_mean(alone[:n], design.C)
        alone = [*predict_mean(alone[:n], design.T_1), *alone[n:]]
        taken = _sum(predict_mean(x, Phi), predict_mean(w, before), predict_mean([*rows, *given], now))
        moved = [select(fresh, a, b) for a, b in zip(taken, alone, strict=True)]
        state: list[Scalar] = [0.0] * n
        for k, index in enumerate(seen):
            state[index] = rows[k] / float(design.C[k, index])
        start = [*predict_mean(state, design.T_1), *([0.0] * len(design.unknown))]
        x = [select(first, start[i], select(begun, moved[i], 0.0)) for i in range(len(x))]
        outputs = [select(fresh, rows[k], select(begun, expected[k], 0.0)) for k in range(p)]
        x_hat = _sum(x[:n], predict_mean(outputs, design.T_2))
        # Innovation: against what was expected before the measurement was taken.
        count = both(begun, fresh)
        told = {
            f"{c}_innovation": select(count, (rows[k] - expected[k]) / scale[k], 0.0) for k, c in enumerate(measured)
        }
        there: Scalar = 1.0
        for c in known:
            there = both(there, ok[c])
        gap = select(fresh, 0.0, carry["gap"] + dt)
        begun = select(begun, 1.0, fresh)
        lost = either(negate(begun), either(negate(there), either(first, gap > GAP)))
        since = select(lost, 0.0, carry["since"] + dt)
        new = {
            **{f"x_{k}": value for k, value in enumerate(x)},
            **{f"w_{k}": value for k, value in enumerate([*outputs, *given])}, "begun": begun, "since": since, "gap": gap,
        }  # fmt: skip
        out = dict(zip((*design.model.states, *design.unknown), [*x_hat, *x[n:]], strict=True))
        return new, {**out, **told, "inputs_known": there, "valid": since >= settle}

    size = n + len(design.unknown)
    carry = {
        **{f"x_{k}": 0.0 for k in range(size)}, **{f"w_{k}": 0.0 for k in range(p + len(known))},
        "begun": 0.0, "since": 0.0, "gap": 0.0,
    }  # fmt: skip
    gains = {letter: getattr(design, letter) for letter in ("F", "L_1", "L_2", "L_3", "J", "T_1", "T_2")}
    return Observer(
        name, dt, known, measured, carry, pi_outputs(design), step,
        settings={"dt": dt, **(settings or {})}, gains=gains, certificate=design.certificate,
    )  # fmt: skip


def pi_outputs(design: PIDesign) -> tuple[Output, ...]:
    """States, unknown inputs, innovations and flags."""
    names = (*design.model.states, *design.unknown)
    estimates = tuple(Output(n, unit_of(n), "estimate", meaning_of(n)) for n in names)
    innovations = tuple(
        Output(f"{n}_innovation", unit_of(n), "innovation", f"measured {n} less expected; 0 where none arrived")
        for n in design.model.outputs
    )
    flags = (
        Output("inputs_known", "1", "flag", "1 where all known inputs are there"),
        Output("valid", "1", "flag", "1 where the known inputs are there and the start has died away"),
    )
    return (*estimates, *innovations, *flags)


def unit_of(name: str) -> str:
    """The vocabulary's unit of a name; per second for "<name>_rate"; empty for others."""
    if name in VOCABULARY:
        return VOCABULARY[name].unit
    base = name.removesuffix("_rate")
    return f"{VOCABULARY[base].unit}/s" if base in VOCABULARY and base != name else ""


def meaning_of(name: str) -> str:
    """The vocabulary's meaning of a name, where it has one."""
    return VOCABULARY[name].meaning if name in VOCABULARY else ""


def _state_of_each_output(C: Array) -> list[int]:
    """The state that each output measures.

    Raises:
        DesignError: an output is of several states.
    """
    found = []
    for row in C:
        there = np.flatnonzero(row)
        if there.size != 1:
            raise DesignError(
                "an output that is no single state", "outputs that measure one state each", "choose other states"
            )
        found.append(int(there[0]))
    return found


def _sum(*terms: Sequence[Scalar]) -> list[Scalar]:
    """Vectors added; those of no known input are empty."""
    there = [term for term in terms if term]
    return [sum(entries[1:], entries[0]) for entries in zip(*there, strict=True)]
