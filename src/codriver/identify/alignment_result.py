"""What the identification of the alignment map found: coefficients, refusals, and how it does on drives left out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from codriver.finding import Finding
from codriver.identify.alignment_drive import MOTOR, TORQUE, Drive
from codriver.identify.alignment_fit import LETTERS, MapFit
from codriver.identify.alignment_holdout import HoldOut
from codriver.identify.brake_fit import Refusal
from codriver.models.alignment import AlignmentModel
from codriver.signals.signal import Array
from codriver.vehicles import Vehicle


@dataclass(frozen=True)
class AlignmentCoefficient:
    """One coefficient.

    Attributes:
        name: letter of `models.alignment`.
        value: in `unit`.
        sd: standard error from the drives alone.
        low, high: 95 % interval; of the logarithm but for T_0.
        unit: SI.
    """

    name: str
    value: float
    sd: float
    low: float
    high: float
    unit: str


@dataclass(frozen=True, eq=False)
class AlignmentFit:
    """What was found.

    Attributes:
        coefficients: by letter, those that the drives tell.
        refused: the others, and why; the map has the usual value.
        model: the map.
        held: how it does on what it has not seen.
        rmse, r2: of the drives that it was fitted on, N m and 1.
        lead: by which the torque is ahead of the angle, s.
        drives: what it saw; `answers` the map's torque along each, N m.
        findings: what is to say.
        assumed: geometry that the vehicle lacks: name and the usual value.
        source: of the logs.
        by: standard name of the torque that turned the wheel.
    """

    coefficients: Mapping[str, AlignmentCoefficient]
    refused: tuple[Refusal, ...]
    model: AlignmentModel
    held: HoldOut
    rmse: float
    r2: float
    lead: float
    drives: tuple[Drive, ...] = field(repr=False)
    answers: tuple[Array, ...] = field(repr=False)
    findings: tuple[Finding, ...] = ()
    assumed: Mapping[str, float] = field(default_factory=dict)
    source: str = ""
    by: str = TORQUE

    @property
    def minutes(self) -> float:
        """Time that counts, min."""
        return sum(drive.seconds for drive in self.drives) / 60

    def vehicle(self, old: Vehicle | None = None, name: str = "car") -> Vehicle:
        """A vehicle with what was found, the geometry that was assumed, and the error on what was held out.

        Everything else is that of the old one, if there is one.
        """
        new = old or Vehicle(
            name, f"car, alignment torque identified from {self.source}", "codriver identify alignment", {}
        )
        text = f"identified from {self.source}, {self.minutes:.1f} min; RMSE {self.rmse:.3f} N m"
        for letter, found in self.coefficients.items():
            new = new.with_parameter(LETTERS[letter][1], found.value, found.sd, text)
        for parameter, value in self.assumed.items():
            source = "a usual passenger car's; alignment_gain was found with it, and goes with it"
            new = new.with_parameter(parameter, value, source=source)
        if self.by == MOTOR:
            what = "the whole load on the column, identified by the motor's torque"
            new = new.with_parameter("alignment_whole", 1.0, source=what)
            new = new.with_parameter("alignment_bend", self.model.bend, source=f"{what}: nothing bends it")
        if self.held.whole is not None:
            what = "drives" if self.held.by_drive else "blocks"
            source = f"of {what} left out, {self.held.whole.seconds / 60:.1f} min of {self.source}"
            new = new.with_parameter("alignment_torque_sd", self.held.whole.rmse["map"], source=source)
            new = new.with_parameter("alignment_torque_time", self.held.time, source=source)
        return new


def coefficients_of(fit: MapFit) -> dict[str, AlignmentCoefficient]:
    """Coefficients with standard errors and 95 % intervals."""
    found = {}
    for letter, x, sd in zip(fit.free, fit.x, fit.sd_x, strict=True):
        attribute, _, _, unit = LETTERS[letter]
        value, half = float(getattr(fit.model, attribute)), 1.959964 * float(sd)
        if letter == "T_0":
            found[letter] = AlignmentCoefficient(letter, value, float(sd), value - half, value + half, unit)
        else:
            low, high = (float(np.exp(x + side)) for side in (-half, half))
            found[letter] = AlignmentCoefficient(letter, value, value * float(sd), low, high, unit)
    return found
