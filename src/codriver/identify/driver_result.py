"""What the identification of a driver found: parameters with intervals, refusals by name, and how well it all fits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from codriver.errors import LogError
from codriver.identify.brake_fit import Refusal
from codriver.identify.driver_record import DriverRecord
from codriver.models.two_point import TwoPointDriver
from codriver.signals.signal import Array

# Attribute of TwoPointDriver: letter, unit.
LETTERS = {
    "anticipation": ("K_p", "1"), "compensation": ("K_c", "m/s"), "lead": ("T_L", "s"), "lag": ("T_I", "s"),
    "delay": ("tau_p", "s"), "column_gain": ("K_r", "N*s/rad"), "reflex": ("K_t", "N*m/rad"), "muscle": ("T_N", "s"),
}  # fmt: skip


@dataclass(frozen=True)
class DriverParameter:
    """One parameter.

    Attributes:
        name, letter, unit: as in TwoPointDriver; SI.
        value: in `unit`.
        sd: standard error, the larger of the two; what was known before the drive counts.
        sd_model: if the residuals are white; `sd_robust` if they are alike from tick to tick (Newey-West).
        low, high: 95 % interval, even in the parameter's logarithm.
    """

    name: str
    letter: str
    unit: str
    value: float
    sd: float
    sd_model: float
    sd_robust: float
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class DriverFit:
    """What was found.

    Attributes:
        parameters: by name, those that the drive tells.
        refused: the others that were asked for, and why.
        given: parameters that were not asked for, as they were taken.
        correlation: of the estimates of `names`, shape (p, p); names: those that were sought.
        by: "road" or "direct"; settled: the search ended by itself.
        best: the driver at the end of the search.
        rms: of the torque that the model does not explain, N m; `explained`: share of the torque's variance that it does.
        one_step: rms of the error one tick of `tick` s ahead, N m.
        seconds, speed: of the drive that counts, s, m/s.
        record: what was fitted.
    """

    parameters: Mapping[str, DriverParameter]
    refused: tuple[Refusal, ...]
    given: Mapping[str, float]
    correlation: Array = field(repr=False)
    names: tuple[str, ...]
    by: str
    settled: bool
    best: TwoPointDriver
    rms: float
    explained: float
    one_step: float
    tick: float
    seconds: float
    speed: float
    record: DriverRecord = field(repr=False)

    def driver(self) -> TwoPointDriver:
        """The driver found.

        Raises:
            LogError: the drive does not tell all parameters that were asked for.
        """
        if self.refused:
            raise LogError(
                f"{self.record.source}: " + "; ".join(f"{r.name}: {r.reason}" for r in self.refused),
                "a drive that tells all parameters asked for",
                "record a longer drive with more curves, or leave these parameters out of `asked`: they are then those of `known`",
            )
        return replace(self.best)

    def torque(self) -> Array:
        """The torque of the driver found on this drive, from what he saw, N m, shape (n,)."""
        r = self.record
        return self.best.torque(r.near, r.far, r.angle, r.speed, r.dt)

    def table(self) -> list[tuple[str, str, str, float, float, float, float]]:
        """Rows of name, letter, unit, value, sd, low, high."""
        return [(p.name, p.letter, p.unit, p.value, p.sd, p.low, p.high) for p in self.parameters.values()]
