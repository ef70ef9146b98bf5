"""The zero of a steering encoder, which shows delta + delta_0: what a vehicle file says of it, and its taking out.

    [steer_zero]
    value = 0.31      # delta_0: what the encoder shows when the handlebar is straight
    unit = "deg"
    sd = 0.02         # how far that may be off
    source = "found from ride.csv"

An estimator is given delta_shown - value. What remains is `motorcycle-ekf`'s and `bicycle-kalman`'s to find while they run, from
where it may be by sd; without sd motorcycle-ekf takes the value as right, and so do the others always.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from codriver.observers.observer import Observer, Output, Scalars
from codriver.vehicles import Vehicle

STEER, OFFSET = "steer_angle", "steer_offset"
PARAMETER = "steer_zero"
MEANING = "what steer_angle shows straight ahead"


@dataclass(frozen=True)
class SteerZero:
    """The zero of a steering encoder.

    Attributes:
        value: delta_0, rad.
        sd: its standard deviation, rad; 0 where it is known.
        source: where it comes from.
    """

    value: float = 0.0
    sd: float = 0.0
    source: str = ""

    @classmethod
    def from_vehicle(cls, vehicle: Vehicle) -> SteerZero:
        """What a vehicle says of it; 0 and known where it says nothing."""
        said = vehicle.parameters.get(PARAMETER)
        if said is None:
            return cls()
        return cls(vehicle.number(PARAMETER), said.sd if isinstance(said.sd, float) else 0.0, said.source)

    def of(self, vehicle: Vehicle) -> Vehicle:
        """A vehicle with this zero."""
        return vehicle.with_parameter(PARAMETER, self.value, self.sd or None, self.source)


def without_zero(observer: Observer, zero: SteerZero) -> Observer:
    """An observer that is given the steer angle without the encoder's zero; itself where that is 0 and known.

    The zero is an output, `steer_offset`: where the observer has one, what it found and the zero together.

    Args:
        observer: one that takes steer_angle.
        zero: what is known of it.
    """
    if STEER not in observer.channels or (not zero.value and not zero.sd):
        return observer
    settings = {
        **observer.settings,
        PARAMETER: zero.value,
        f"{PARAMETER}_sd": zero.sd,
        f"{PARAMETER}_source": zero.source,
    }
    if not zero.value:
        return replace(observer, settings=settings)
    known = [output.name for output in observer.outputs]

    def straight(values: Scalars) -> Scalars:
        return {name: value - zero.value if name == STEER else value for name, value in values.items()}

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        new, out = observer.step(carry, straight(u), straight(y), ok, straight(rho))
        return new, {**out, OFFSET: out.get(OFFSET, 0.0) + zero.value}

    outputs = observer.outputs if OFFSET in known else (*observer.outputs, Output(OFFSET, "rad", "estimate", MEANING))
    return replace(observer, outputs=outputs, step=step, settings=settings)
