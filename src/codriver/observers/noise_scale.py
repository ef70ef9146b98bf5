"""The common factor of Q and R, learnt from the innovations.

The papers' Q and R fix the gain only through their ratio: multiplied by one factor they give the same gain, and standard
deviations sqrt(factor) as wide. The factor is therefore estimated from the innovations e with their nominal variance s, in
two ways, both as averages with a memory of `MEMORY` seconds and a prior worth `PRIOR_WEIGHT` seconds:

    quick = mean of e^2 / s                                        what the samples scatter
    slow  = mean of m^2 / var(m),  m = low-passed e / sqrt(s)      what they do together over about 1/ell s

For the noise the filter assumes, both equal the factor. A driver is no white noise: during a burst of jerk the filter lags
and its innovations lean to one side for as long as the lag lasts, far below the accelerometer's own scatter. Only `slow`
sees that, so the larger of the two is taken. (Measured coverage: docs/trust.md.)
"""

from __future__ import annotations

from math import exp

from codriver.kernel import Scalar, select, sqrt

MEMORY = 60.0
PRIOR_WEIGHT = 2.0
# A sensor noise for the first seconds: an accelerometer of 0.05 m/s^2 rms at 100 Hz has the intensity 0.05^2 / 100.
PRIOR_SCALE = 2.5e-5


def initial() -> dict[str, float]:
    """The carried scalars of the estimate."""
    return {
        "scale_quick": PRIOR_SCALE, "scale_slow": PRIOR_SCALE, "scale_weight": 0.0,
        "scale_mean_acceleration": 0.0, "scale_mean_speed": 0.0,
    }  # fmt: skip


def learn(
    carry: dict[str, Scalar], innovations: tuple[tuple[str, Scalar, Scalar, Scalar], ...], active: Scalar, dt: float, horizon: float
) -> tuple[dict[str, Scalar], Scalar]:
    """Take the innovations of one tick.

    Args:
        carry: the scalars of `initial`.
        innovations: (name, e, s, ok) of each row; name is the end of its "scale_mean_..." scalar.
        active: 1 where the model holds and the innovations count.
        dt: tick, s.
        horizon: of the slow mean, s.

    Returns:
        new scalars, and the factor.
    """
    forget = exp(-dt / MEMORY)
    smooth = exp(-dt / horizon)
    # Variance of m per unit variance of white e: (1 - smooth) / (1 + smooth).
    shrink = (1 - smooth) / (1 + smooth)
    weight = carry["scale_weight"]
    quick, slow = carry["scale_quick"], carry["scale_slow"]
    new: dict[str, Scalar] = {}
    for name, e, s, ok in innovations:
        counts = select(active, ok, 0.0)
        key = f"scale_mean_{name}"
        squared = e * e / s
        # The mean moves by e / sqrt(s); its square is compared with its variance under white innovations.
        normal = e / sqrt(s)
        mean = select(counts, smooth * carry[key] + (1 - smooth) * normal, carry[key])
        together = mean * mean * (1 / shrink)
        share = dt / (PRIOR_WEIGHT + weight)
        quick = select(counts, quick + share * (squared - quick), quick)
        slow = select(counts, slow + share * (together - slow), slow)
        weight = select(counts, forget * (weight + dt), weight)
        new[key] = mean
    order = {"scale_quick": quick, "scale_slow": slow, "scale_weight": weight}
    return {**order, **{key: new[key] for key in carry if key not in order}}, select(quick < slow, slow, quick)
