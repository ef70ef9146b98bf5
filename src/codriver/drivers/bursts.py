"""Bursts of intentional jerk: where the driver changes what he wants.

Between manoeuvres the intentional jerk is zero (2017, section IV-B): a driver holds an acceleration and changes it in
bursts. A burst is a stretch in which the estimate keeps its sign and

    |j| > off throughout,   max |j| >= on,   |integral of j dt| >= change,   duration >= shortest,   all of it valid.

on, off and change come from the estimator (`threshold.py`). Two thresholds keep a burst whole whose top is uneven; the
change keeps out spikes without area. The estimate is causal, so its bursts are late: by about the low-frequency delay
(setting delay_s, 0.46 s at ell = 2) where the burst is long, by a little less at its start. Times here are those of the
estimate unless `shift` takes the delay off.

A change of gear moves the intention as the models define it, for tau T_r / M jumps with tau while the foot is still. Such
bursts are flagged (`in_shift`), not left out, because drivers do change their mind in shifts too.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import overload

import numpy as np
import numpy.typing as npt

from codriver.drivers.threshold import Threshold, burst_threshold
from codriver.errors import MissingSignal, UsageError
from codriver.estimate import Estimate
from codriver.signals.signal import Array

JERK = "intentional_jerk"
SHORTEST = 0.2  # s: no foot changes a pedal and back in less


@dataclass(frozen=True)
class Burst:
    """One burst.

    Attributes:
        start, peak, stop: s; of the crossing of `off`, of the greatest jerk, of the crossing back.
        jerk: at the peak, with its sign, m/s^3.
        change: of the intended acceleration, the integral of the jerk, m/s^2.
        in_shift: whether a gear shift, or the second after it, touches it.
    """

    start: float
    peak: float
    stop: float
    jerk: float
    change: float
    in_shift: bool

    @property
    def sign(self) -> int:
        """1 for more, -1 for less acceleration."""
        return 1 if self.jerk > 0 else -1

    @property
    def duration(self) -> float:
        """s."""
        return self.stop - self.start


@dataclass(frozen=True)
class Bursts(Sequence[Burst]):
    """The bursts of an estimate, by their start.

    Attributes:
        found: the bursts.
        threshold: what made them bursts.
        shifted: seconds that were taken off the times of the estimate; 0 for none.
    """

    found: tuple[Burst, ...]
    threshold: Threshold
    shifted: float

    @overload
    def __getitem__(self, index: int) -> Burst: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Burst]: ...
    def __getitem__(self, index: int | slice) -> Burst | Sequence[Burst]:
        return self.found[index]

    def __iter__(self) -> Iterator[Burst]:
        return iter(self.found)

    def __len__(self) -> int:
        return len(self.found)


def find_bursts(
    estimate: Estimate,
    *,
    threshold: Threshold | float | None = None,
    shortest: float = SHORTEST,
    shift: bool = False,
) -> Bursts:
    """Find the bursts of an estimate of the intentional jerk; see the module.

    Args:
        estimate: of intent-pedals, intent-torque or any other with intentional_jerk.
        threshold: None takes that of the estimator; a number is the jerk to reach, m/s^3.
        shortest: least duration, s.
        shift: take the low-frequency delay of the estimate off all times.

    Raises:
        MissingSignal: the estimate has no intentional jerk, or its flag `valid` was left out.
        UsageError: the threshold is not above 0; or `shift` is asked for and the delay is not known.
    """
    if JERK not in estimate:
        raise MissingSignal(
            f"{estimate.observer} gives no {JERK}", "an estimate of the intention",
            "use intent-pedals or intent-torque: the vehicle's own jerk holds gear shifts too",
        )  # fmt: skip
    limits = threshold if isinstance(threshold, Threshold) else burst_threshold(estimate)
    if isinstance(threshold, (int, float)):
        if not (threshold > 0 and np.isfinite(threshold)):
            raise UsageError(f"a threshold of {threshold} m/s^3", "a jerk above 0", "choose one, such as 0.3")
        limits = Threshold(threshold, 0.5 * threshold, limits.change, limits.noise, limits.delay)
    if shift and limits.delay is None:
        raise UsageError(
            f"the delay of {estimate.observer} is not known", "an estimator with the setting delay_s", "use shift=False"
        )
    late = limits.delay if shift and limits.delay is not None else 0.0
    jerk, time, dt = estimate.columns[JERK], estimate.time, estimate.grid.dt
    shifts = _in_shifts(estimate)
    sound = estimate.valid & np.isfinite(jerk)
    found = []
    for sign in (1.0, -1.0):
        signed = np.where(sound, sign * jerk, 0.0)
        for first, last in runs(signed > limits.off):
            top = first + int(np.argmax(signed[first:last]))
            change = float(jerk[first:last].sum()) * dt
            if signed[top] >= limits.on and abs(change) >= limits.change and (last - first) * dt >= shortest:
                at = [float(time[i]) - late for i in (first, top, last - 1)]
                touched = bool(shifts[first:last].any())
                found.append(Burst(at[0], at[1], at[2] + dt, float(jerk[top]), change, touched))
    return Bursts(tuple(sorted(found, key=lambda burst: burst.start)), limits, late)


def runs(flags: npt.NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First index and index after the last of each run of True."""
    edges = np.diff(np.concatenate([[0], flags.astype(np.int8), [0]]))
    return list(zip(np.flatnonzero(edges == 1).tolist(), np.flatnonzero(edges == -1).tolist(), strict=True))


def _in_shifts(estimate: Estimate) -> npt.NDArray[np.bool_]:
    """Where a gear shift is, or was in the second before, shape (n,)."""
    shifting = estimate.flag("gear_shift")
    since = np.where(shifting, np.arange(shifting.size), -(10**9))
    newest: Array = np.maximum.accumulate(since) if since.size else since
    return np.asarray(np.arange(shifting.size) - newest <= round(1.0 / estimate.grid.dt))
