"""The rate of a steer angle from its encoder: by an algebraic differentiator, and by a Kalman filter.

**Algebraic** (Fliess, Join, Sira-Ramirez 2008, Int. J. Modelling, Identification and Control 4(1), 12-27; kernels by Mboup, Join,
Fliess 2009, doi:10.1007/s11075-008-9236-1). The angle is taken as a polynomial over a window T; its Laplace transform is freed of
the unknown start value by differentiation and of derivatives by 1/s^k. What is left is, in closed form,

    w(t) = 1/T int_0^T B(s/T) y'(t - s) ds,   B the density of Beta(mu + 2, kappa + 2)

an average of the rate over the window (kappa = mu = 0: the slope of least squares, 6/T^3 int (T - 2 s) y(t - s) ds). It is
exact for straight lines, late by T (mu + 2) / (mu + kappa + 4), and needs no model. With y straight between ticks the integral is
a FIR filter

    w_k = sum_i (F(s_(i+1)) - F(s_i)) (y_(k-i) - y_(k-i-1)) / dt,   F the distribution function, s_i = i dt / T

An encoder's count q makes an error of at most q / 2 sum |tap|, and of `rate_sd` if its roundings are independent.

**Kalman**: the rate's slope changes by chance (integrated random walk), the angle errs by its count, var q^2 / 12 and noise. Its
step is that of `disturbance_observer`: rows may be missing, and the rate has a standard deviation. The band counts on roundings
that are independent, so it is too narrow where the angle moves by less than a count in a tick.

Which? At once the Kalman filter errs less; where the rate may come half a window late, the slope of 60 to 100 ms does.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from codriver.errors import DesignError
from codriver.kernel import Scalar, minimum, select
from codriver.models import StateSpace
from codriver.observers.disturbance import disturbance_observer
from codriver.observers.disturbance_design import design_disturbance_filter
from codriver.observers.observer import Observer, Output, Scalars
from codriver.observers.scaled_gain import check_tick
from codriver.signals.signal import Array

ANGLE, RATE = "steer_angle", "steer_rate"
MOST = 200  # taps


def algebraic_taps(dt: float, window: float, kappa: float = 0.0, mu: float = 0.0) -> Array:
    """Taps of the FIR filter: w_k = sum_i taps[i] y_(k-i), shape (M + 1,), 1/s.

    Args:
        dt: tick, s.
        window: T, s, taken as a whole number M of ticks.
        kappa, mu: exponents of the kernel, above -1; mu smaller than kappa answers earlier and with more noise.

    Raises:
        DesignError: a window of no tick or more than MOST, or exponents that are not above -1.
    """
    from scipy.special import betainc

    M = round(window / dt)
    if not (1 <= M <= MOST and kappa > -1 and mu > -1):
        raise DesignError(
            f"a window of {window:g} s at a tick of {dt:g} s, kappa {kappa:g}, mu {mu:g}",
            f"1 to {MOST} ticks, exponents above -1", "choose another window",
        )  # fmt: skip
    share = np.diff(betainc(mu + 2, kappa + 2, np.arange(M + 1) / M)) / dt
    return np.append(share, 0.0) - np.append(0.0, share)


def delay_of(taps: Array, dt: float) -> float:
    """How late the rate is, s: that of a rate that grows slowly."""
    i = np.arange(taps.size)
    return float(-(taps * i**2).sum() * dt * dt / 2)


def rate_sd(taps: Array, angle_sd: float) -> float:
    """Standard deviation of the rate, rad/s, for independent errors of the angle.

    Args:
        taps: of `algebraic_taps`.
        angle_sd: rad; of an encoder that moves by more than its count q each tick, q / sqrt(12).
    """
    return float(angle_sd * np.sqrt(np.square(taps).sum()))


def algebraic_differentiator(dt: float, window: float = 0.08, kappa: float = 0.0, mu: float = 0.0) -> Observer:
    """The algebraic differentiator of steer_angle.

    A missing angle is taken as unchanged, and `valid` is 0 until the window holds none of it.

    Args:
        dt: tick, s.
        window, kappa, mu: see `algebraic_taps`.

    Raises:
        DesignError: see there.
        UsageError: a tick that cannot be.
    """
    check_tick(dt)
    taps = [float(x) for x in algebraic_taps(dt, window, kappa, mu)]
    M = len(taps) - 1
    memory = [f"angle_{i}" for i in range(1, M + 1)]

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        fresh = ok[ANGLE]
        now = select(fresh, y[ANGLE], carry[memory[0]])
        run = select(fresh, minimum(carry["angle_run"] + 1.0, M + 1.0), 0.0)
        past: list[Scalar] = [now, *(carry[name] for name in memory)]
        rate: Scalar = 0.0
        for tap, value in zip(taps, past, strict=True):
            rate = rate + tap * value
        full = run > M + 0.5
        new = dict(zip(memory, past[:-1], strict=True)) | {"angle_run": run}
        return new, {RATE: select(full, rate, 0.0), "valid": 1.0 * full}

    outputs = (
        Output(RATE, "rad/s", "estimate", "rate of the steered wheel or fork, positive to the left"),
        Output("valid", "1", "flag", "1 where the window is full of angles"),
    )
    settings = {"window": M * dt, "kappa": kappa, "mu": mu, "delay": delay_of(np.array(taps), dt)}
    carry = {**dict.fromkeys(memory, 0.0), "angle_run": 0.0}
    return Observer(
        "steer-rate-algebraic", dt, (), (ANGLE,), carry, outputs, step, settings=settings, gains={"taps": np.array([taps])}
    )  # fmt: skip


def kalman_differentiator(
    dt: float, count: float = 0.0, noise: float = 0.0, *, order: int = 2, intensity: float | None = None
) -> Observer:
    """The Kalman differentiator of steer_angle.

    Args:
        dt: tick, s.
        count: q, rad, of the encoder.
        noise: sd of its angle beside that, rad.
        order: 1, the rate walks; 2, its slope does.
        intensity: of what changes by chance, (rad/s)^2/s at order 1, (rad/s^2)^2/s at order 2. By default 0.1 and 40: a
            rate whose slope changes by 6 rad/s^2 within a second.

    Raises:
        DesignError: an encoder without error, or noises that cannot be.
        UsageError: a tick that cannot be.
    """
    check_tick(dt)
    variance = count**2 / 12 + noise**2
    if not variance > 0:
        raise DesignError("an encoder without count and noise", "one of them above 0", "give the encoder's count")
    plant = StateSpace(
        np.zeros((1, 1)), np.ones((1, 1)), np.ones((1, 1)), np.zeros((1, 1)), (ANGLE,), (RATE,), (ANGLE,)
    )
    q = intensity if intensity is not None else (0.1, 40.0)[order - 1] if order in (1, 2) else 1.0
    design = design_disturbance_filter(
        plant, (RATE,), dt, unknown_noise=[q], output_noise=[variance], order=order
    )  # fmt: skip
    start = [1.0, 5.0, 50.0][: order + 1]
    return disturbance_observer(
        design, start, name="steer-rate-kalman",
        settings={"count": count, "noise": noise, "order": order, "intensity": q, "angle_sd": sqrt(variance)},
    )  # fmt: skip
