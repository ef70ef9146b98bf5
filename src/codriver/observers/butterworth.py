"""A Butterworth low-pass behind an observer, as the papers put behind their noisy estimates.

    |H(i w)|^2 = 1 / (1 + (w / w_c)^(2 n))          n the order, w_c = 2 pi f_c

made discrete by the bilinear rule with w_c kept exact, as second-order sections in the transposed direct form II:

    out = b_0 x + z_1,   z_1 <- b_1 x - a_1 out + z_2,   z_2 <- b_2 x - a_2 out

It starts as if its first value had always been there. Slow changes come late by the sum of sin((2 k + 1) pi / (2 n)) / w_c, which
is 2 / w_c at order 3 (the setting filter_delay, with the bilinear rule's w_c).
"""

from __future__ import annotations

import numpy as np

from codriver.errors import DesignError
from codriver.kernel import Scalar, both, negate, select
from codriver.names import quantity
from codriver.observers.observer import Observer, Output, Scalars
from codriver.observers.scaled_gain import check_tick


def butterworth_filter(dt: float, signals: tuple[str, ...], cutoff: float, order: int = 3) -> Observer:
    """The low-pass, to be chained: `chain(observer, butterworth_filter(observer.dt, ("rider_torque",), 5.0))`.

    Args:
        dt: tick, s.
        signals: standard names; each is filtered and bears its name again.
        cutoff: f_c, Hz, where half the power passes.
        order: n, 1 to 8.

    Raises:
        DesignError: a cut-off at or above half the sample rate, or no such order.
        UsageError: a tick that cannot be, or a name that is not in the vocabulary.
    """
    from scipy.signal import butter

    check_tick(dt)
    units = [quantity(name).unit for name in signals]
    if not (0 < cutoff < 0.5 / dt and 1 <= order <= 8 and signals):
        raise DesignError(
            f"cut-off {cutoff:g} Hz of order {order} at {1 / dt:g} Hz for {len(signals)} signals",
            f"above 0, below {0.5 / dt:g} Hz, order 1 to 8, one signal at least", "choose another cut-off",
        )  # fmt: skip
    sections = [[float(x) for x in row] for row in butter(order, cutoff, fs=1 / dt, output="sos")]
    # What each section's memory holds when its input has been 1 for ever, and what it then gives.
    rest, level = [], 1.0
    for b0, b1, b2, _, a1, a2 in sections:
        out = level * (b0 + b1 + b2) / (1 + a1 + a2)
        z2 = b2 * level - a2 * out
        rest.append((b1 * level - a1 * out + z2, z2))
        level = out
    keys = {name: [(f"{name}_{k}_1", f"{name}_{k}_2") for k in range(len(sections))] for name in signals}

    carry_names = [key for name in signals for pair in keys[name] for key in pair]
    carry_names += [f"{name}_{what}" for name in signals for what in ("last", "started")]

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        new: Scalars = {}
        out: Scalars = {}
        for name in signals:
            started = carry[f"{name}_started"]
            first = both(ok[name], negate(started))
            x: Scalar = select(ok[name], u[name], 0.0)
            begin = x
            for (b0, b1, b2, _, a1, a2), (one, two), (s1, s2) in zip(sections, keys[name], rest, strict=True):
                z1, z2 = select(first, s1 * begin, carry[one]), select(first, s2 * begin, carry[two])
                value = b0 * x + z1
                new[one] = select(ok[name], b1 * x - a1 * value + z2, carry[one])
                new[two] = select(ok[name], b2 * x - a2 * value, carry[two])
                x = value
            out[name] = select(ok[name], x, carry[f"{name}_last"])
            new[f"{name}_last"] = out[name]
            new[f"{name}_started"] = select(ok[name], 1.0, started)
        return {key: new[key] for key in carry_names}, out

    carry = dict.fromkeys(carry_names, 0.0)
    outputs = tuple(
        Output(name, unit, "estimate", f"{quantity(name).meaning}; low-passed at {cutoff:g} Hz")
        for name, unit in zip(signals, units, strict=True)
    )
    sines = sum(np.sin((2 * k + 1) * np.pi / (2 * order)) for k in range(order))
    delay = float(sines * dt / 2 / np.tan(np.pi * cutoff * dt))
    settings = {"cutoff": cutoff, "order": order, "filter_delay": delay}
    return Observer("butterworth", dt, signals, (), carry, outputs, step, settings=settings)
