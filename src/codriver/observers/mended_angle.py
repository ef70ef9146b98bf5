"""An observer of a steering wheel whose encoder may wrap, jump or fall silent: `angle_row` before one that knows no such.

The observer gets the unwrapped angle. Where it jumps, or comes back after a gap, the observer is begun anew from its initial carry,
with the angle as its first.
"""

from __future__ import annotations

from dataclasses import replace

from codriver.kernel import both, either, negate, select
from codriver.observers.angle_row import CARRY, angle_row
from codriver.observers.observer import Observer, Output, Scalars

ANGLE = "steering_wheel_angle"


def with_mended_angle(observer: Observer) -> Observer:
    """The observer with an encoder's faults taken out, told by angle_jump, angle_turns and restarted.

    Args:
        observer: measures steering_wheel_angle; its initial carry is that of an observer which has seen nothing.
    """

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        row = angle_row(carry, y[ANGLE], ok[ANGLE], observer.dt)
        anew = either(row.first, either(row.jumped, row.resumed))
        before = {key: select(anew, value, carry[key]) for key, value in observer.carry.items()}
        new, out = observer.step(before, u, {**y, ANGLE: row.angle}, {**ok, ANGLE: row.fresh}, rho)
        told = {
            "angle_turns": row.turns, "angle_jump": both(row.jumped, negate(row.resumed)), "restarted": anew,
        }  # fmt: skip
        return {**new, **row.memory}, {**out, **told}

    outputs = (
        *observer.outputs,
        Output("angle_turns", "rad", "input", "what was added to the encoder's value, for wraps"),
        Output("angle_jump", "1", "flag", "1 where the angle jumped and the observer started anew"),
        Output("restarted", "1", "flag", "1 where the observer started anew: first angle, jump, or after a gap"),
    )
    return replace(observer, carry={**observer.carry, **CARRY}, outputs=outputs, step=step)
