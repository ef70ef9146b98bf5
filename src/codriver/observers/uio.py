"""The unknown-input observer as an observer with one step.

    s_k = Phi s_{k-1} + G_0 w_{k-1} + G_1 w_k,     (x^, v^) = C_s s_k + D_s w_k,     w = (y, u) straight between ticks

exactly, by the matrix exponential of the design's system. It needs every output at every tick: where one is missing, the last one
is held, and `valid` is 0 until five of the slowest time constants later. It holds no noise, so it gives no standard deviations.
"""

from __future__ import annotations

from collections.abc import Mapping

from codriver.kernel import Scalar, both, negate, select
from codriver.observers.covariance import predict_mean
from codriver.observers.observer import Observer, Output, Scalars
from codriver.observers.pi import SETTLES, meaning_of, unit_of
from codriver.observers.uio_design import UIODesign


def unknown_input_observer(
    design: UIODesign,
    dt: float,
    *,
    name: str = "unknown-input-observer",
    settings: Mapping[str, str | float] | None = None,
) -> Observer:
    """An unknown-input observer that compiles, runs live and exports.

    Args:
        design: by `design_unknown_input_observer`.
        dt: tick, s.
        name: of the observer.
        settings: for provenance.
    """
    system = design.system
    n, p = len(system.states), len(design.model.outputs)
    Phi, (before, now) = system.transition(dt), system.input_maps(dt)
    settle = SETTLES * max(1.0 / design.certificate.decay_rate, design.tau)
    channels = (*design.model.outputs, *design.known)

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        s, old = [carry[f"s_{k}"] for k in range(n)], [carry[f"w_{k}"] for k in range(len(channels))]
        values = {**y, **{name: u[name] for name in design.known}}
        w = [select(ok[c], values[c], old[k]) for k, c in enumerate(channels)]
        there: Scalar = 1.0
        for c in channels:
            there = both(there, ok[c])
        begun = carry["begun"]
        moved = [
            a + b + c
            for a, b, c in zip(predict_mean(s, Phi), predict_mean(old, before), predict_mean(w, now), strict=True)
        ]
        # Until everything came once it rests; then it starts from rest with the low-passed outputs where they are.
        start = [0.0] * len(design.model.states) + w[:p] + [0.0] * p
        first = both(there, negate(begun))
        s = [select(first, start[k], select(begun, moved[k], 0.0)) for k in range(n)]
        begun = select(begun, 1.0, there)
        found = [a + b for a, b in zip(predict_mean(s, system.C), predict_mean(w, system.D), strict=True)]
        since = select(both(begun, both(there, negate(first))), carry["since"] + dt, 0.0)
        new = {
            **{f"s_{k}": value for k, value in enumerate(s)}, **{f"w_{k}": value for k, value in enumerate(w)},
            "begun": begun, "since": since,
        }  # fmt: skip
        return new, {**dict(zip(system.outputs, found, strict=True)), "valid": since >= settle}

    carry = dict.fromkeys(
        [*(f"s_{k}" for k in range(n)), *(f"w_{k}" for k in range(len(channels))), "begun", "since"], 0.0
    )
    outputs = (
        *(Output(o, unit_of(o), "estimate", meaning_of(o)) for o in system.outputs),
        Output("valid", "1", "flag", "1 where everything is measured and the start has died away"),
    )
    gains = {letter: getattr(design, letter) for letter in ("N", "L", "G", "E", "K")}
    return Observer(
        name, dt, design.known, design.model.outputs, carry, outputs, step,
        settings={"dt": dt, "tau": design.tau, **(settings or {})}, gains=gains, certificate=design.certificate,
    )  # fmt: skip
