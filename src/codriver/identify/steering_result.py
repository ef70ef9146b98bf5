"""What the identification of a wheel found: coefficients, refusals, excitation, and how well it all fits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from codriver.errors import LogError
from codriver.finding import Finding
from codriver.identify.brake_fit import Refusal
from codriver.identify.steering_fit import Best
from codriver.identify.steering_likelihood import NAMES, Rows
from codriver.identify.steering_passes import Passes
from codriver.signals.signal import Array
from codriver.vehicles import Vehicle

PARAMETERS = {"J_s": "steering_inertia", "b_s": "steering_damping", "T_c": "steering_friction"}


@dataclass(frozen=True)
class WheelCoefficient:
    """One coefficient.

    Attributes:
        name: J_s, b_s, T_c or T_0.
        value: in `unit`.
        sd: standard error, the larger of the two.
        sd_model: if the model is right; `sd_robust` if innovations are alike from tick to tick.
        low, high: 95 % interval.
        unit: SI.
    """

    name: str
    value: float
    sd: float
    sd_model: float
    sd_robust: float
    low: float
    high: float
    unit: str


@dataclass(frozen=True)
class Excitation:
    """What the recording excites.

    Attributes:
        torque: RMS of the motor's torque, N m.
        inertia, damping, friction: RMS of J_s times acceleration, b_s times rate, and of friction while slipping, N m.
        unexplained: RMS of the torque that would explain what the filter takes for noise of the wheel, N m, over 0.1 s.
        rate: RMS, rad/s.
        correlation: of the estimates of J_s and b_s.
        turns: how often the rate changes its sign.
    """

    torque: float
    inertia: float
    damping: float
    friction: float
    unexplained: float
    rate: float
    correlation: float
    turns: int


@dataclass(frozen=True, eq=False)
class SteeringFit:
    """What was found.

    Attributes:
        coefficients: by the paper's letter, those that the recording tells.
        refused: the others, and why.
        excitation: what the recording excites.
        encoder_sd: of the angle's noise, rad.
        nis: mean squared normalised innovation.
        lags, correlation: autocorrelation of the normalised innovations, s and 1.
        r2: of the angle two seconds ahead, from the torque alone.
        delay: by which the torque acts late, s.
        end_stops: angles at which the wheel was stopped, rad.
        left_out: share of the ticks at which the filter started anew.
        seconds: of the recording.
        findings: what is to say, the worst first.
        filters: joint EKF and UKF by Algorithm 1, for comparison.
        best: the search's end; `rows` what it saw; `simulated` the angle from the torque alone, restarted every 2 s, rad.
        torque_from, source: where it comes from.
    """

    coefficients: Mapping[str, WheelCoefficient]
    refused: tuple[Refusal, ...]
    excitation: Excitation
    encoder_sd: float
    nis: float
    lags: Array = field(repr=False)
    correlation: Array = field(repr=False)
    r2: float
    delay: float
    end_stops: tuple[float, ...]
    left_out: float
    seconds: float
    findings: tuple[Finding, ...]
    filters: tuple[Passes, ...] = field(repr=False)
    best: Best = field(repr=False)
    rows: Rows = field(repr=False)
    simulated: Array = field(repr=False)
    torque_from: str
    source: str

    def refused_together(self) -> list[tuple[str, str]]:
        """Refusals with one reason together: their names, and the reason."""
        reasons = dict.fromkeys(r.reason for r in self.refused)
        return [(", ".join(r.name for r in self.refused if r.reason == why), why) for why in reasons]

    def vehicle(self, old: Vehicle | None = None, name: str = "wheel") -> Vehicle:
        """A vehicle with what was found; everything else is that of the old one, if there is one.

        Raises:
            LogError: nothing was found.
        """
        if not self.coefficients:
            raise LogError(
                f"{self.source}: " + "; ".join(f"{names}: {why}" for names, why in self.refused_together()),
                "at least one coefficient",
                "record the wheel turned by its motor: a chirp from 0.3 to 4 Hz, some N m, hands off",
            )  # fmt: skip
        new = old or Vehicle(
            name, f"steering wheel, identified from {self.source}", "codriver identify steering-wheel", {}
        )
        text = (
            f"identified from {self.source} by prediction errors over {self.seconds:.1f} s, torque from {self.torque_from}; "
            f"R2 of the angle 2 s ahead {self.r2:.3f}"
        )
        for letter, parameter in PARAMETERS.items():
            if letter in self.coefficients:
                found = self.coefficients[letter]
                new = new.with_parameter(parameter, found.value, found.sd, text)
        refused = {r.name for r in self.refused}
        if "J_s" in self.coefficients and "T_c" not in self.coefficients and "T_c" not in refused:
            new = new.with_parameter("steering_friction", 0.0, source=f"{self.source} asks for none")
        if self.end_stops:
            where = f"the wheel is stopped there in {self.source}"
            new = new.with_parameter("steering_end_stop", min(abs(stop) for stop in self.end_stops), source=where)
        return new


# What the filter's steps with friction leave as bias, as a share: docs/steering-identification.md, measured on simulated wheels.
STEPS = {"J_s": 0.005, "b_s": 0.005, "T_c": 0.014, "T_0": 0.0}


def coefficients_of(best: Best, scale_error: float = 0.0) -> dict[str, WheelCoefficient]:
    """The wheel's coefficients with their standard errors; intervals of J_s and b_s are those of their logarithms.

    Args:
        best: the fit.
        scale_error: standard error of the torque's scale, as a share; all coefficients go with it.
    """
    found = {}
    rubs = 2 in best.free  # T_c
    for name, letter, unit in zip(
        NAMES[:4], ("J_s", "b_s", "T_c", "T_0"), ("kg*m^2", "N*m*s/rad", "N*m", "N*m"), strict=True
    ):
        i = NAMES.index(name)
        if i not in best.free:
            continue
        k = best.free.index(i)
        model, robust = (float(np.sqrt(max(P[k, k], 0.0))) for P in (best.covariance, best.robust))
        value = float(best.theta[i])
        share = float(np.hypot(scale_error, STEPS[letter] if rubs else 0.0))
        # J_s and b_s are searched as logarithms, so that a share of them adds as it is.
        sd = float(np.hypot(max(model, robust), share * (1.0 if letter in ("J_s", "b_s") else abs(value))))
        half = 1.959964 * sd
        if letter in ("J_s", "b_s"):
            value = float(np.exp(value))
            with np.errstate(over="ignore"):
                low, high = float(value * np.exp(-half)), float(value * np.exp(half))
            found[letter] = WheelCoefficient(letter, value, value * sd, value * model, value * robust, low, high, unit)
        else:
            found[letter] = WheelCoefficient(letter, value, sd, model, robust, value - half, value + half, unit)
    return found
