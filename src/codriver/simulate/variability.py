"""How a driver is not the same all the time: gains that drift, eyes and hands that are noisy.

    K(t) = K exp(g(t) - sd^2 / 2)                              of anticipation and compensation, each its own g
    theta_seen = theta + n(t)                                  each point its own n
    pull = told + n_m(t) (share |told| + floor)                signal-dependent noise of the muscles (Harris, Wolpert 1998)

g, n, n_m are Ornstein-Uhlenbeck processes: Gaussian, correlated over a time, sampled exactly. Delays and lags do not vary. Harris,
Wolpert 1998, doi:10.1038/29528, for noise that grows with the command; the sizes are this project's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from codriver.signals.signal import Array


@dataclass(frozen=True)
class Variability:
    """Sizes.

    Attributes:
        drift: sd of the logarithm of each gain; drift_time: s over which it is alike.
        near, far: sd of what is seen of each point, rad; sight_time: s.
        motor: share of the torque that the muscles are told; floor: N m; motor_time: s.

    Raises:
        ValueError: a size is negative, or a time not positive.
    """

    drift: float = 0.15
    drift_time: float = 20.0
    near: float = 0.004
    far: float = 0.002
    sight_time: float = 0.4
    motor: float = 0.1
    floor: float = 0.05
    motor_time: float = 0.08

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if value < 0 or (name.endswith("time") and value == 0):
                raise ValueError(f"{name} is {value:g}; sizes are at least 0, times positive")


@dataclass(frozen=True, eq=False)
class Variation:
    """One driver's variation over a drive; columns of shape (n,).

    Attributes:
        anticipation, compensation: factors of the gains.
        near, far: added to what is seen, rad.
        motor: of unit size; times share of the told torque and floor.
    """

    anticipation: Array
    compensation: Array
    near: Array
    far: Array
    motor: Array

    @classmethod
    def draw(cls, sizes: Variability, n: int, dt: float, rng: np.random.Generator) -> Variation:
        """Draw one.

        Args:
            sizes: how much.
            n: ticks.
            dt: s.
            rng: of randomness.
        """
        far_gain, near_gain = (
            np.exp(sizes.drift * wander(rng, n, dt, sizes.drift_time) - sizes.drift**2 / 2) for _ in range(2)
        )
        near, far = (sd * wander(rng, n, dt, sizes.sight_time) for sd in (sizes.near, sizes.far))
        return cls(far_gain, near_gain, near, far, wander(rng, n, dt, sizes.motor_time))

    @classmethod
    def none(cls, n: int) -> Variation:
        """A driver who is always the same."""
        one, zero = np.ones(n), np.zeros(n)
        return cls(one, one, zero, zero, zero)


def wander(rng: np.random.Generator, n: int, dt: float, time: float) -> Array:
    """An Ornstein-Uhlenbeck process of variance 1 from its long run, shape (n,).

    Args:
        rng: of randomness.
        n: ticks.
        dt: s.
        time: s over which it is alike.
    """
    from scipy.signal import lfilter

    keep = np.exp(-dt / time)
    kicks = rng.standard_normal(n) * np.sqrt(1 - keep**2)
    if n:
        kicks[0] /= np.sqrt(1 - keep**2)
    return np.asarray(lfilter([1.0], [1.0, -keep], kicks))
