"""The constant-gain observer and nothing else, as a step of ours: what the kernel makes of the bare equations."""

from __future__ import annotations

from codriver.kernel import select
from codriver.observers import Observer, Output, ScaledGain

STATES = ("v", "a", "o", "j")


def plain_observer(design: ScaledGain) -> Observer:
    """x = F x + K ok (y - C F x), from the first sample on at x = [v, 0, a, 0]."""
    F, K = design.F, design.K

    def step(carry, u, y, ok, rho):
        x = [carry[name] for name in STATES]
        p = [sum((float(F[i, j]) * x[j] for j in range(4) if F[i, j] != 0), start=0.0) for i in range(4)]
        a, v = y["longitudinal_acceleration"], y["longitudinal_speed"]
        e = (
            select(ok["longitudinal_acceleration"], a - (p[1] + p[2]), 0.0),
            select(ok["longitudinal_speed"], v - p[0], 0.0),
        )
        first = carry["started"] == 0
        new = [p[i] + (float(K[i, 0]) * e[0] + float(K[i, 1]) * e[1]) for i in range(4)]
        new = [select(first, s, x) for s, x in zip((v, 0.0, a, 0.0), new, strict=True)]
        named = dict(zip(STATES, new, strict=True))
        return {"started": 1.0, **named}, named

    outputs = tuple(Output(name, "1", "estimate") for name in STATES)
    carry = {"started": 0.0, **dict.fromkeys(STATES, 0.0)}
    return Observer("bare", design.dt, (), ("longitudinal_acceleration", "longitudinal_speed"), carry, outputs, step)
