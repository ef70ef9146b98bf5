"""The common factor of Q and R, learnt from the innovations.

The papers' Q and R fix the gain only through their ratio: multiplied by one factor they give the same gain, and standard
deviations sqrt(factor) as wide. The factor is therefore estimated from the innovations e with their nominal variance s:

    quick        = mean of e^2 / s over both rows                      what the samples scatter
    slow, by row = mean of m^2 / var(m),  m = low-passed e / sqrt(s)   what they do together over about 1/ell s

as averages with a memory of `MEMORY` seconds after a prior worth `PRIOR_WEIGHT` seconds. For the noise the filter assumes,
all equal the factor. A driver is no white noise: during a burst of jerk the filter lags and its innovations lean to one
side for as long as the lag lasts, by far less than the accelerometer's own scatter. Only the slow means see that, so the
largest of the three is taken. (Measured coverage: docs/trust.md.)
"""

from __future__ import annotations

from math import exp

from codriver.kernel import Scalar, select, sqrt

MEMORY = 60.0
PRIOR_WEIGHT = 2.0
# A sensor noise for the first seconds: an accelerometer of 0.05 m/s^2 rms at 100 Hz has the intensity 0.05^2 / 100.
PRIOR_SCALE = 2.5e-5
ROWS = ("acceleration", "speed")


def initial() -> dict[str, float]:
    """The carried scalars of the estimate."""
    start = {"scale_quick": PRIOR_SCALE, "scale_weight": 0.0}
    for row in ROWS:
        start |= {f"scale_slow_{row}": PRIOR_SCALE, f"scale_mean_{row}": 0.0}
    return start


def learn(
    carry: dict[str, Scalar],
    innovations: dict[str, tuple[Scalar, Scalar, Scalar]],
    active: Scalar,
    dt: float,
    horizon: float,
) -> tuple[dict[str, Scalar], Scalar]:
    """Take the innovations of one tick.

    Args:
        carry: the scalars of `initial`.
        innovations: (e, s, ok) of each row.
        active: 1 where the model holds and the innovations count.
        dt: tick, s.
        horizon: of the slow mean, s.

    Returns:
        new scalars, and the factor.
    """
    forget = exp(-dt / MEMORY)
    smooth = exp(-dt / horizon)
    # Variance of m under white e of variance 1.
    shrink = (1 - smooth) / (1 + smooth)
    share = dt / (PRIOR_WEIGHT + carry["scale_weight"])
    new = {key: carry[key] for key in initial()}
    factor: Scalar = 0.0
    for row in ROWS:
        e, s, ok = innovations[row]
        counts = select(active, ok, 0.0)
        mean, slow = carry[f"scale_mean_{row}"], carry[f"scale_slow_{row}"]
        mean = select(counts, smooth * mean + (1 - smooth) * (e / sqrt(s)), mean)
        slow = select(counts, slow + share * (mean * mean * (1 / shrink) - slow), slow)
        quick = new["scale_quick"]
        new["scale_quick"] = select(counts, quick + 0.5 * share * (e * e / s - quick), quick)
        new[f"scale_mean_{row}"], new[f"scale_slow_{row}"] = mean, slow
        factor = select(factor < slow, slow, factor)
    # The weight counts the time in which the model held, whichever rows came.
    weight = carry["scale_weight"]
    new["scale_weight"] = select(active, forget * (weight + dt), weight)
    return new, select(factor < new["scale_quick"], new["scale_quick"], factor)
