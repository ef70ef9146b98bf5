"""What the identification of a driver found: parameters with intervals, refusals by name, and how well it all fits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from codriver.errors import LogError
from codriver.identify.brake_fit import Refusal
from codriver.identify.driver_dual_ekf import DualFit
from codriver.identify.driver_pieces import DrivePieces
from codriver.identify.driver_record import DriverRecord
from codriver.identify.driver_search import Found
from codriver.models.two_point import TwoPointDriver
from codriver.models.two_point_file import LETTERS, FiledDriver, FiledParameter
from codriver.signals.signal import Array

WORDS = {"road": "the road", "direct": "prediction errors", "dual-ekf": "dual EKF"}


@dataclass(frozen=True)
class DriverParameter:
    """One parameter.

    Attributes:
        name, letter, unit: as in TwoPointDriver; SI.
        value: in `unit`.
        sd: standard error, the larger of the two; what was known before the drive counts.
        sd_model: if the residuals are white; `sd_robust` if they are alike from tick to tick (Newey-West). Of the dual filter
            both are its own, which hold what its tuning assumes.
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
        known: what was given before the drive.
        correlation: of the estimates of `names`, shape (p, p); names: those that were sought.
        by: "road", "direct" or "dual-ekf".
        settled: the search ended by itself; of the dual filter: no parameter moved by more than its standard deviation in the last
            fifth of the drive.
        best: the driver at the end of the search.
        rms: of the torque that the model does not explain, N m; `explained`: share of the torque's variance that it does.
        one_step: rms of the error one tick of `tick` s ahead, N m.
        found: the search's end: errors one tick ahead, covariances; None if nothing was sought.
        seconds: of the drives that count; speeds: of each record, m/s.
        drives: each with its holes and what is left out; records: what was fitted, of all of them.
        path: the parameters over time by the dual filter; None otherwise.
        estimated: sources of torques that are no sensor's, by drive.
    """

    parameters: Mapping[str, DriverParameter]
    refused: tuple[Refusal, ...]
    given: Mapping[str, float]
    known: TwoPointDriver
    correlation: Array = field(repr=False)
    names: tuple[str, ...]
    by: str
    settled: bool
    best: TwoPointDriver
    rms: float
    explained: float
    one_step: float
    tick: float
    found: Found | None = field(repr=False)
    seconds: float
    speeds: tuple[float, ...]
    drives: tuple[DrivePieces, ...]
    records: tuple[DriverRecord, ...] = field(repr=False)
    path: DualFit | None = field(repr=False)
    estimated: tuple[str, ...] = ()

    @property
    def source(self) -> str:
        """The drives."""
        return ", ".join(d.source for d in self.drives)

    def speeds_told(self) -> str:
        """The speeds in words; pieces of a drive mostly share one."""
        return ", ".join(dict.fromkeys(f"{3.6 * v:.0f}" for v in self.speeds)) + " km/h"

    def driver(self) -> TwoPointDriver:
        """The driver found.

        Raises:
            LogError: the drive does not tell all parameters that were asked for.
        """
        if self.refused:
            raise LogError(
                f"{self.source}: " + "; ".join(f"{r.name}: {r.reason}" for r in self.refused),
                "a drive that tells all parameters asked for",
                "record a longer drive with more curves, or leave these parameters out of `asked`: they are then those of `known`",
            )
        return replace(self.best)

    def torque(self, record: int = 0) -> Array:
        """The torque of the driver found on a drive, or a piece of one, from what he saw, N m, shape (n,)."""
        r = self.records[record]
        return self.best.torque(*r.seen(self.best.near, self.best.far), r.angle, r.speed, r.dt)

    def filed(self, name: str) -> FiledDriver:
        """The driver as a file holds him: told, given, or not told and why.

        Args:
            name: whose.
        """
        told = {p.name: FiledParameter(p.value, p.sd, source="identified") for p in self.parameters.values()}
        why = {r.name: f"not told: {r.reason}" for r in self.refused}
        made = {
            n: told.get(n)
            or (FiledParameter(None, given=float(getattr(self.known, n)), source=why[n]) if n in why
                else FiledParameter(self.given[n], source="given"))
            for n in LETTERS
        }  # fmt: skip
        return FiledDriver(name, f"identified from {self.source}, by {WORDS[self.by]}", made)

    def table(self) -> list[tuple[str, str, str, float, float, float, float]]:
        """Rows of name, letter, unit, value, sd, low, high."""
        return [(p.name, p.letter, p.unit, p.value, p.sd, p.low, p.high) for p in self.parameters.values()]
