"""What an identification of the brake found, and the vehicle that it makes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from codriver.finding import Finding
from codriver.identify.brake_rows import DriveRows
from codriver.identify.brake_verdict import refuse_condemned
from codriver.identify.learning import LearningPoint
from codriver.identify.plausible import within_file_bounds
from codriver.signals.grid import Flags
from codriver.signals.signal import Array
from codriver.vehicles import Vehicle

PARAMETERS = {"c_b": "brake_coefficient", "kappa_1": "rolling_resistance", "kappa_2": "drag"}


@dataclass(frozen=True)
class Coefficient:
    """One coefficient that was found.

    Attributes:
        name: the paper's letter.
        value: in `unit`.
        sd: standard error given M and tau, from the block bootstrap.
        sd_hac: the same from Newey and West's formula, as a check.
        sd_total: with the standard deviations of M and tau, where the vehicle has them.
        low, high: 95 % interval, of sd_total.
        unit: SI.
    """

    name: str
    value: float
    sd: float
    sd_hac: float
    sd_total: float
    low: float
    high: float
    unit: str


@dataclass(frozen=True)
class Refusal:
    """A coefficient that the drive does not tell, and why."""

    name: str
    reason: str


@dataclass(frozen=True, eq=False)
class BrakeFit:
    """What was found.

    Attributes:
        coefficients: by the paper's letter: c_b (N/Pa), kappa_1 (N), kappa_2 (kg/m), gamma (1).
        refused: what was not.
        offsets: kappa_1 - M d_a of each log, N.
        bias_known: whether a bias was given, so that kappa_1 is free of it.
        minutes_fit, minutes_validation: usable time of the halves.
        minutes_braking: of the fit half, with the brake pressed.
        share: of all ticks that were left out, by reason; `used_share` of those that were not.
        trimmed: share of the fit half left out as outliers.
        rmse: of the validation half, m/s^2; `rmse_old` with the old vehicle's coefficients and the best offset, None where it
            lacks one; `rmse_constant` of answering the fit half's mean.
        block: s, length of a block of the bootstrap; `blocks` how many.
        curve: figure 2.
        rows, model: filtered signals, and a_ID on all ticks, m/s^2.
        fitted, validated: ticks of the halves, the first without its outliers.
        lags, correlation: autocorrelation of the residuals, s and 1.
        mass: M, kg.
        remarks: what gears, sensors and the old vehicle say of the fit.
        sources: of the logs.
    """

    coefficients: Mapping[str, Coefficient]
    refused: tuple[Refusal, ...]
    offsets: tuple[float, ...]
    bias_known: bool
    minutes_fit: float
    minutes_validation: float
    minutes_braking: float
    share: Mapping[str, float]
    used_share: float
    trimmed: float
    rmse: float
    rmse_old: float | None
    rmse_constant: float
    block: float
    blocks: int
    curve: tuple[LearningPoint, ...] = field(repr=False)
    rows: DriveRows = field(repr=False)
    model: Array = field(repr=False)
    fitted: Flags = field(repr=False)
    validated: Flags = field(repr=False)
    lags: Array = field(repr=False)
    correlation: Array = field(repr=False)
    mass: float
    remarks: tuple[Finding, ...] = ()
    sources: tuple[str, ...] = ()

    def vehicle(self, old: Vehicle) -> Vehicle:
        """The old vehicle with the coefficients that were found; refused ones keep their old value, if any.

        Raises:
            LogError: the fit is condemned by its own verdict, `codriver.identify.brake_verdict`.
        """
        refuse_condemned(self)
        new = old
        for letter, name in PARAMETERS.items():
            # A negative kappa_1 is a bias and no resistance; no vehicle file takes it.
            if (found := self.coefficients.get(letter)) is not None and found.value >= 0:
                within_file_bounds(name, [found.value], "a unit of the log's signals, or the vehicle's mass")
                new = new.with_parameter(name, found.value, found.sd_total, self._source(letter, found))
        return new

    def _source(self, letter: str, found: Coefficient) -> str:
        text = (
            f"{letter} identified from {', '.join(self.sources)}; 2017 eq. (19)-(20), {self.minutes_fit:.1f} usable minutes, "
            f"validation RMSE {self.rmse:.3f} m/s^2 on another {self.minutes_validation:.1f}; "
            f"sd {found.sd:.3g} {found.unit} given M and tau"
        )
        if letter == "kappa_1" and not self.bias_known:
            text += "; this is kappa_1 - M d_a, the accelerometer's bias d_a is in it"
        return text
