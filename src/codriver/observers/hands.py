"""Hands on or off the wheel, as a probability, from the estimated driver torque and its band.

A hidden Markov filter with three states: hands off; hands on but quiet (they rest, or steer too little to be seen); hands that
pull.

    off        z ~ N(0, B),                              B = (share s)^2 + floor^2
    quiet      z ~ N(0, B + a_q^2)
    pulling    z ~ mean of N(0, B + (c a_p)^2)           c in SCALES
    hands_on = P(quiet) + P(pulling)

z, N m, is the estimated torque and s its standard deviation. The band allows for a torque that changes; where there is none, z
errs by a `share` of s only. `floor` is what z shows without hands by errors of the model (friction, alignment torque); a_q and
a_p are the spread of the torque of quiet and of pulling hands. States change at rates of 1/dwell: over a tick the probabilities
are multiplied by exp(G dt). Without a valid estimate nothing else happens, and they drift to their long-run shares.

Neighbouring samples of z err alike; taken as independent, they would push the probability to 0 or 1 within some ticks. So the
likelihood is tempered. Of an AR(1) process with correlation time tau, n samples tell as much of the mean as n (1 - r) / (1 + r)
independent ones, r = exp(-dt / tau), and a tick counts by that factor:

    p_i <- p_i (f_i(z) / f_off(z))^tanh(dt / (2 tau)),     then to a sum of 1

An exponent within f_i / f_off is cut off at `cap`, so an encoder jump alone decides nothing.

Quiet hands are a state of their own because a driver who has just pulled and now does nothing is more likely quiet than gone.
A filter of two states takes silence for "off", and is too sure of it. Where a_q is below the band, quiet and off look alike;
dwell times alone part them, and the probability stays between 0 and 1.

HMM filter: Rabiner 1989 (Proceedings of the IEEE 77), section III.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from math import inf, isfinite, tanh

import numpy as np

from codriver.errors import UsageError
from codriver.kernel import Scalar, both, minimum, select
from codriver.observers.observer import Observer, Output, Scalars
from codriver.observers.scaled_gain import check_tick
from codriver.signals.signal import Array

SCALES = (1 / 3, 1.0, 3.0)
QUIET, PULLING = "hands_quiet", "hands_pulling"


@dataclass(frozen=True)
class HandsSettings:
    """What hands do, and how far the torque estimate is to be believed.

    Attributes:
        off_dwell, on_dwell: mean time that hands stay off and on, s.
        quiet_dwell, pulling_dwell: mean time that hands on the wheel are quiet, and pull, before they do the other, s; infinite
            for never.
        pulling_first: share of the times hands come on that they pull at once.
        share: of the band that the estimate errs by without hands.
        floor: error of the torque estimate beyond that, N m.
        quiet_torque, pulling_torque: a_q, a_p, N m.
        correlation: tau, s.
        cap: the most that z^2 may say before it is tempered, in log odds.
    """

    off_dwell: float = 25.0
    on_dwell: float = 35.0
    quiet_dwell: float = 3.6
    pulling_dwell: float = 2.6
    pulling_first: float = 0.05
    share: float = 0.25
    floor: float = 0.12
    quiet_torque: float = 0.02
    pulling_torque: float = 1.1
    correlation: float = 0.027
    cap: float = 20.0

    def floored(self, torque: Array, band: Array) -> HandsSettings:
        """These settings with the floor that a stretch without hands shows, and at least a tenth of their own.

        Args:
            torque, band: estimated torque and its standard deviation of a drive that is known to be without hands, N m.
        """
        beyond = float(np.mean(np.square(torque) - np.square(self.share * np.asarray(band))))
        return replace(self, floor=max(beyond, 0.01 * self.floor**2) ** 0.5)

    def rates(self) -> Array:
        """G, 1/s: row i holds the rates from state i to off, quiet, pulling; rows sum to 0."""
        first = self.pulling_first
        G = np.array([
            [0, (1 - first) / self.off_dwell, first / self.off_dwell],
            [1 / self.on_dwell, 0, 1 / self.quiet_dwell],
            [1 / self.on_dwell, 1 / self.pulling_dwell, 0],
        ])  # fmt: skip
        return np.asarray(G - np.diag(G.sum(1)))

    def long_run(self) -> Array:
        """Shares of off, quiet and pulling when nothing is known."""
        system = np.vstack([self.rates().T, np.ones(3)])
        return np.asarray(np.linalg.lstsq(system, np.array([0.0, 0, 0, 1]), rcond=None)[0])


def hands_observer(
    dt: float = 0.01,
    settings: HandsSettings | None = None,
    *,
    torque: str = "driver_torque",
    band: str = "driver_torque_sd",
    valid: str = "valid",
) -> Observer:
    """The filter, to be chained behind an observer of the torque: `chain(first, hands_observer(first.dt))`.

    Args:
        dt: tick, s.
        settings: the defaults fit a simulated car, see docs/hands.md.
        torque, band, valid: the first observer's outputs: torque and its standard deviation, N m, and whether they hold (1 or 0).

    Raises:
        UsageError: a setting or the tick is out of range.
    """
    from scipy.linalg import expm

    check_tick(dt)
    settings = settings or HandsSettings()
    _check(settings)
    change = [[float(x) for x in row] for row in expm(settings.rates() * dt)]
    start = settings.long_run()
    pulling_torques = tuple(scale * settings.pulling_torque for scale in SCALES)
    count = tanh(dt / (2 * settings.correlation))

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        """Dwell times, then the estimate."""
        quiet, pulling = carry[QUIET], carry[PULLING]
        old = (1.0 - (quiet + pulling), quiet, pulling)
        off, quiet, pulling = (sum(old[i] * change[i][j] for i in range(3)) for j in range(3))
        told = both(both(ok[torque], ok[band]), select(ok[valid], u[valid], 0.0))
        z, s = select(told, u[torque], 0.0), select(told, u[band], 1.0)
        B = (settings.share * s) * (settings.share * s) + settings.floor**2
        quiet *= select(told, _tempered(z, B, (settings.quiet_torque,), settings.cap, count), 1.0)
        pulling *= select(told, _tempered(z, B, pulling_torques, settings.cap, count), 1.0)
        total = off + (quiet + pulling)
        new = {QUIET: quiet / total, PULLING: pulling / total}
        return new, {"hands_on": (quiet + pulling) / total}

    return Observer(
        "hands", dt, (torque, band, valid), (), {QUIET: float(start[1]), PULLING: float(start[2])},
        (Output("hands_on", "1", "estimate", "probability that hands are on the wheel"),), step,
        settings={f"hands_{name}": value for name, value in asdict(settings).items()},
    )  # fmt: skip


def _tempered(z: Scalar, B: Scalar, spreads: tuple[float, ...], cap: float, count: float) -> Scalar:
    """Likelihood of z with these spreads, each as likely, over that without hands, to the power `count`."""
    import casadi

    total: Scalar = 0.0
    for spread in spreads:
        V = B + spread**2
        total += casadi.sqrt(B / V) * casadi.exp(minimum(0.5 * (z * z) * (1.0 / B - 1.0 / V), cap))
    return casadi.exp(count * casadi.log(total / len(spreads)))


def _check(settings: HandsSettings) -> None:
    """Refuse what cannot be.

    Raises:
        UsageError: see the text.
    """
    for name, value in asdict(settings).items():
        endless = name in ("quiet_dwell", "pulling_dwell") and value == inf
        good = 0 <= value <= 1 if name == "pulling_first" else endless or (value > 0 and isfinite(value))
        if not good:
            wanted = "from 0 to 1" if name == "pulling_first" else "a positive number"
            raise UsageError(f"{name} = {value:g} of the hands filter", wanted, "correct the setting")
