"""From which jerk on an estimate shows a burst: what the observer makes of the smallest change worth counting, above its noise.

The jerk estimate is the true jerk j through the observer's impulse response h (1/s),

    h(t) = -e_4' exp((A - L C) t) e_2,      integral of h = 1,      greatest value h_max = 0.85 ell (2017's noise),

since a jump of the acceleration by d is an impulse of jerk of area d. So the quickest change of d = 0.2 m/s^2 shows as a
peak of d h_max, and that is the threshold: 0.34 m/s^3 at ell = 2. It belongs to the estimator and not to the driver, so counts
of several drivers compare. It must stand clear of the noise of the estimate, which is that of the sensors through the
same observer (`observers.response.noise_gain`); where 4 standard deviations of it are more, they are the threshold.

The sensors' noise is taken from the innovations e: neighbours differ by white noise alone, for lag and manoeuvres change
slowly, so sd = 1.4826 median|e_k+1 - e_k| / sqrt(2). The standard deviation that comes with the estimate is no measure of
this: it holds the lag, and is widest while a burst is under way (docs/trust.md).

An estimate without observer (`pedals-only`, or one whose design is not known here) has no h. Its threshold is the greatest jerk
of a minimum-jerk change of d in 1 s, 1.875 d (Flash and Hogan 1985, doi:10.1523/JNEUROSCI.05-07-01688.1985).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from codriver.errors import CodriverError
from codriver.estimate import Estimate
from codriver.models import intention_model
from codriver.observers.preset_file import preset_of
from codriver.observers.response import noise_gain
from codriver.observers.scaled_gain import ScaledGain, design_scaled_gain

SMALLEST = 0.2  # d, m/s^2
CLEAR = 4.0  # standard deviations of the noise
_SPAN = 8.0  # of h, in units of 1/ell s; after 2.8 of them it has settled to 5 %
_ROWS = {"acceleration": 0, "speed": 1}  # column of the noise gain
_PEAK = 1.875  # greatest slope of the minimum-jerk curve over its mean slope


@dataclass(frozen=True)
class Threshold:
    """From which jerk on a burst is one.

    Attributes:
        on: a burst reaches it, m/s^3.
        off: it lasts while it is above, m/s^3: half of it.
        change: least change of the acceleration in a burst, m/s^2.
        noise: standard deviation of the jerk from the sensors' noise, m/s^3; None where it is not known.
        delay: low-frequency delay of the estimate, s; None where it is not known.
    """

    on: float
    off: float
    change: float
    noise: float | None
    delay: float | None

    @property
    def noisy(self) -> bool:
        """Whether the noise set the threshold: then counts do not compare with those of quieter sensors."""
        return self.noise is not None and self.on <= CLEAR * self.noise * (1 + 1e-12)


def burst_threshold(estimate: Estimate, change: float = SMALLEST) -> Threshold:
    """The threshold of an estimate; see the module.

    Args:
        estimate: with intentional_jerk.
        change: smallest change of the intended acceleration worth counting, m/s^2.
    """
    design = _design(estimate)
    delay = estimate.provenance.get("delay_s")
    late = float(delay) if delay is not None else None
    if design is None:
        on = _PEAK * change / 1.0
        return Threshold(on, 0.5 * on, change, None, late)
    noise = jerk_noise(estimate, design)
    on = max(change * greatest_response(design), CLEAR * (noise or 0.0))
    return Threshold(on, 0.5 * on, change, noise, late)


def greatest_response(design: ScaledGain) -> float:
    """h_max, 1/s: the greatest jerk an observer shows after a jump of the acceleration by 1 m/s^2."""
    return float(impulse_response(design)[1].max())


def impulse_response(design: ScaledGain) -> tuple[np.ndarray, np.ndarray]:
    """Times (s) and h (1/s) of the jerk estimate after an impulse of jerk of area 1, shape (n,) each."""
    from scipy.linalg import expm

    model = intention_model()
    step = 2e-3 / design.ell
    advance = expm((model.A - design.L @ model.C) * step)
    error, values = np.array([0.0, 1.0, 0.0, 0.0]), []
    for _ in range(round(_SPAN / 2e-3)):
        values.append(-error[3])
        error = advance @ error
    return step * np.arange(len(values)), np.array(values)


def jerk_noise(estimate: Estimate, design: ScaledGain) -> float | None:
    """Standard deviation of the jerk from white sensor noise, m/s^3; None where there are too few innovations."""
    variance = 0.0
    for row in estimate.innovations:
        if row.row not in _ROWS:
            continue
        at = np.flatnonzero(row.used & estimate.valid & np.isfinite(row.values))
        if at.size < 50:
            return None
        sd = 1.4826 * float(np.median(np.abs(np.diff(row.values[at])))) / np.sqrt(2)
        interval = float(np.median(np.diff(at))) * estimate.grid.dt
        variance += (sd * noise_gain(design, interval)[_ROWS[row.row]]) ** 2
    return float(np.sqrt(variance)) if variance else None


def _design(estimate: Estimate) -> ScaledGain | None:
    """The gains an estimate was made with; None where it has no such design."""
    settings = estimate.provenance
    if "form" not in settings or "ell" not in settings:
        return None
    try:
        return design_scaled_gain(preset_of(settings), estimate.grid.dt, float(settings["ell"]))
    except (CodriverError, ValueError, KeyError):
        return None
