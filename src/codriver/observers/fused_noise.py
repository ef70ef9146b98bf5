"""The noise of the pedals' sensors, learnt while they run; and what their innovations say of the bursts assumed.

    d_k = p_k - 3 p_{k-1} + 3 p_{k-2} - p_{k-3},    var(d) = 20 r        for white noise of variance r
    r  <- r + (min(d^2 / 20, 9 r) - r) / n                               n: samples counted so far, at most 1,000

A foot moves slowly against 50 samples a second, so its third difference is next to nothing and what is left is noise and the
steps of the converter. Samples of quick movement are bounded to 9 r, so that they count little. A pedal at rest may be
reported as exactly 0 and says nothing; its samples do not count (`rest_counts`).

A filter that takes the bursts for weaker than they are lags, and its innovations lean to one side while it does. With
n = e / sqrt(s), m the low-passed n, and averages over a minute (as in `noise_scale`), the pedals' variances are taken

    max(1, mean of m^2 / var(m))

times, where var(m) is that of m for white n.
"""

from __future__ import annotations

from math import exp

from codriver.kernel import Scalar, both, minimum, negate, select, sqrt
from codriver.observers.noise_scale import MEMORY as MINUTE
from codriver.observers.noise_scale import PRIOR_WEIGHT
from codriver.observers.observer import Scalars

PRIOR = 50.0  # samples that the starting value is worth
MEMORY = 1000.0  # samples
_OUTLIER = 9.0


def initial(name: str, sd: float) -> dict[str, float]:
    """The carried scalars, for a sensor expected to have the noise `sd`."""
    past = {f"{name}_past{k}": 0.0 for k in (1, 2, 3)}
    return {f"{name}_variance": sd * sd, f"{name}_weight": PRIOR, f"{name}_seen": 0.0, **past}


def learn(
    carry: Scalars, name: str, value: Scalar, fresh: Scalar, there: Scalar, floor: float, *, rest_counts: bool
) -> tuple[Scalars, Scalar]:
    """Take a sample.

    Args:
        carry: with the scalars of `initial`.
        name: of the sensor.
        value: its newest sample, in its unit.
        fresh: 1 where the sample is new.
        there: 1 while the signal is there; a loss begins a new run of samples.
        floor: least standard deviation, in its unit.
        rest_counts: whether samples of exactly 0 say something of the noise.

    Returns:
        new scalars, and the variance r of the noise.
    """
    one, two, three = (carry[f"{name}_past{k}"] for k in (1, 2, 3))
    seen, weight, variance = (carry[f"{name}_{key}"] for key in ("seen", "weight", "variance"))
    third = (value - three) - 3.0 * (one - two)
    counts = both(fresh, seen >= 3)
    if not rest_counts:
        for sample in (value, one, two, three):
            counts = both(counts, negate(sample == 0))
    found = minimum(third * third * (1 / 20), _OUTLIER * variance)
    learnt = variance + (found - variance) / weight
    learnt = select(learnt < floor * floor, floor * floor, learnt)
    variance = select(counts, learnt, variance)
    past = {1: value, 2: one, 3: two}
    new = {
        f"{name}_variance": variance,
        f"{name}_weight": select(counts, minimum(weight + 1.0, MEMORY), weight),
        f"{name}_seen": select(there, select(fresh, minimum(seen + 1.0, 3.0), seen), 0.0),
        **{f"{name}_past{k}": select(fresh, sample, carry[f"{name}_past{k}"]) for k, sample in past.items()},
    }
    return new, variance


def initial_lean() -> dict[str, float]:
    """The carried scalars of `lean`."""
    return {"lean_mean": 0.0, "lean_square": 1.0, "lean_weight": 0.0}


def lean(carry: Scalars, e: Scalar, s: Scalar, counts: Scalar, dt: float, horizon: float) -> tuple[Scalars, Scalar]:
    """Take an innovation of the pedals.

    Args:
        carry: with the scalars of `initial_lean`.
        e, s: innovation and its variance by the filter.
        counts: 1 where there is one and the model holds.
        dt: tick, s.
        horizon: of m, s; longer where samples are rarer than ticks, for it counts samples.

    Returns:
        new scalars, and the factor of the variances, at least 1.
    """
    smooth, forget = exp(-dt / horizon), exp(-dt / MINUTE)
    mean, square, weight = (carry[f"lean_{key}"] for key in ("mean", "square", "weight"))
    mean = select(counts, smooth * mean + (1 - smooth) * (e / sqrt(s)), mean)
    found = mean * mean * ((1 + smooth) / (1 - smooth))
    square = select(counts, square + dt / (PRIOR_WEIGHT + weight) * (found - square), square)
    new = {
        "lean_mean": mean, "lean_square": square, "lean_weight": select(counts, forget * (weight + dt), weight),
    }  # fmt: skip
    return new, select(square > 1, square, 1.0)
