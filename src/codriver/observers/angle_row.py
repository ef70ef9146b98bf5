"""A steering wheel's angle as an encoder gives it, made fit for a filter tick by tick: turns, jumps, end stops.

* A step of nearly a turn between two samples, which no wheel makes, is a wrap: the turn is taken out and stays out.
* Any other step quicker than 40 rad/s is a jump: the encoder's, or a wrong sample. The filter starts anew from it.
* After GAP seconds without a sample nobody knows how the wheel moved meanwhile: the filter starts anew, too, which is no jump.
* Beyond the end stop (vehicle file: steering_end_stop) the stop pushes back with a torque that nobody knows.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, pi

from codriver.kernel import Scalar, both, either, negate, select
from codriver.observers.observer import Scalars

FASTEST = 40.0  # rad/s; no hand and no motor is quicker
TURN = 2 * pi
GAP = 0.5  # s
NEAR = 0.1 * TURN  # how far from a whole turn a wrap may be
CARRY = {"angle_before": 0.0, "turns": 0.0, "since_angle": 0.0, "angle_begun": 0.0}


@dataclass(frozen=True)
class AngleRow:
    """The angle at a tick.

    Attributes:
        angle: unwrapped, rad; the last one where none is fresh.
        moved: since the last sample, rad; 0 where none is fresh, or it jumped.
        fresh: 1 where a sample arrived.
        first: 1 on the tick of the first one.
        jumped: 1 where it made a step that no wheel makes.
        resumed: 1 where it is back after a gap.
        stopped: 1 beyond the end stop.
        turns: what was added to the encoder's value, rad.
        memory: the new carry.
    """

    angle: Scalar
    moved: Scalar
    fresh: Scalar
    first: Scalar
    jumped: Scalar
    resumed: Scalar
    stopped: Scalar
    turns: Scalar
    memory: Scalars


def angle_row(carry: Scalars, value: Scalar, fresh: Scalar, dt: float, end_stop: float = inf) -> AngleRow:
    """Take the encoder's value.

    Args:
        carry: with the scalars of CARRY.
        value: rad; not looked at where it is not fresh.
        fresh: 1 where it arrived on this tick.
        dt: tick, s.
        end_stop: rad to either side.
    """
    begun = carry["angle_begun"]
    first = both(fresh, negate(begun))
    before = carry["angle_before"]
    raw = select(fresh, value, 0.0) + carry["turns"]
    step = select(both(fresh, begun), raw - before, 0.0)
    elapsed = carry["since_angle"] + dt
    fast = either(step > FASTEST * elapsed, step < -FASTEST * elapsed)
    # One turn up or down at a time: a sensor that wraps does not skip turns between samples.
    up, down = both(step < -(TURN - NEAR), step > -(TURN + NEAR)), both(step > TURN - NEAR, step < TURN + NEAR)
    turn = select(both(fast, up), TURN, select(both(fast, down), -TURN, 0.0))
    wrapped = either(both(fast, up), both(fast, down))
    jumped = both(fast, negate(wrapped))
    resumed = both(both(fresh, begun), elapsed > GAP)
    turns = carry["turns"] + turn
    angle = select(fresh, raw + turn, before)
    memory = {
        "angle_before": angle, "turns": turns, "since_angle": select(fresh, 0.0, elapsed),
        "angle_begun": select(begun, 1.0, fresh),
    }  # fmt: skip
    stopped: Scalar = 0.0
    if end_stop < inf:
        stopped = either(angle >= end_stop, angle <= -end_stop)
    return AngleRow(angle, select(jumped, 0.0, step + turn), fresh, first, jumped, resumed, stopped, turns, memory)
