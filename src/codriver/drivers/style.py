"""The style of one driver, as numbers: how intentional jerk and acceleration are distributed, how often bursts come.

Everything is over the valid ticks (the car moves, the estimate has settled), in blocks of 30 s of valid driving, so that
intervals are those of a block bootstrap (`resampling.py`):

* quantiles of j and a_i, rms of j, per driver and per speed band (`bands.py`);
* bursts per kilometre with an over-dispersed interval (`counts.py`), and the geometric mean of their peaks;
* reversals of the accelerator pedal per minute (`pedal.py`);
* acceleration against speed: quantiles of a_i in steps of 10 km/h, the longitudinal part of a g-g diagram.

The jerk estimate answers with a bandwidth of 0.33 ell Hz (2017's noise), so its quantiles shrink with ell: numbers of another
ell, noise or estimator are other numbers, and are not mixed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from codriver.drivers.bands import BANDS, KMH, Band, band_of
from codriver.drivers.bursts import JERK, Burst, Bursts, find_bursts
from codriver.drivers.counts import Rate, rate
from codriver.drivers.course import course_of, speed_of
from codriver.drivers.pedal import pedal_reversals
from codriver.drivers.resampling import Interval, block_index, draws, interval, quantile_intervals
from codriver.drivers.threshold import Threshold
from codriver.errors import LogError, UsageError
from codriver.estimate import Estimate
from codriver.signals.signal import Array

ACCELERATION = "intentional_acceleration"
PROBABILITIES = (0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99)
# Sums over a block, by speed band: what every statistic of a style is made of.
SECONDS, KILOMETRES, JERK_SQUARED, BURSTS, LOG_PEAKS, REVERSALS, PEDAL_SECONDS = range(7)
UNKNOWN = len(BANDS)  # band of ticks whose speed is not known
SETTINGS = ("ell", "preset", "preset_Q", "preset_R")
_STEP = 10 * KMH  # of the envelope, m/s
_LEAST = 10.0  # s in a step of the envelope


@dataclass(frozen=True)
class BandStyle:
    """A driver in one speed band.

    Attributes:
        band: the speeds.
        seconds, kilometres: of valid driving in it.
        jerk_rms: m/s^3.
        acceleration: 5 % and 95 % quantile of a_i, m/s^2.
        bursts: per kilometre.
        reversals: of the pedal, 1/min; None without a pedal.
    """

    band: Band
    seconds: float
    kilometres: float
    jerk_rms: Interval
    acceleration: tuple[float, float]
    bursts: Rate
    reversals: Interval | None


@dataclass(frozen=True, eq=False)
class DriverStyle:
    """How someone drove.

    Attributes:
        name: of the driver.
        sources: the logs.
        observer, settings: what estimated; `ell` and noise are among the settings.
        threshold: of the bursts.
        duration: of the logs, s, standstill included.
        seconds, kilometres: of valid driving.
        jerk, acceleration: quantiles by probability, m/s^3 and m/s^2.
        jerk_rms: m/s^3.
        bursts: per kilometre.
        burst_peak: geometric mean of the bursts' peaks, m/s^3; None where there are fewer than 3.
        in_shift: share of the bursts that a gear shift touches.
        reversals: of the pedal, 1/min; None where a log has no pedal.
        bands: those driven in for 10 s at least.
        envelope: speeds (m/s, middle of a step), 5 % and 95 % quantile of a_i (m/s^2), shape (3, steps).
        sums: over blocks, shape (blocks, bands + 1, 7); see the constants of this module.
    """

    name: str
    sources: tuple[str, ...]
    observer: str
    settings: Mapping[str, str]
    threshold: Threshold
    duration: float
    seconds: float
    kilometres: float
    jerk: Mapping[float, Interval]
    acceleration: Mapping[float, Interval]
    jerk_rms: Interval
    bursts: Rate
    burst_peak: Interval | None
    in_shift: float
    reversals: Interval | None
    bands: tuple[BandStyle, ...]
    envelope: Array
    sums: Array = field(repr=False)

    @property
    def ell(self) -> str:
        """The knob, as its estimator wrote it; "none" where it has none."""
        return self.settings.get("ell", "none")


@dataclass(frozen=True, eq=False)
class _Piece:
    """The valid ticks of one log: values, bands and blocks; and the sums of its blocks."""

    jerk: Array
    acceleration: Array
    speed: Array
    band: npt.NDArray[np.intp]
    block: npt.NDArray[np.intp]
    sums: Array
    bursts: tuple[Burst, ...]
    pedal: bool


def describe_style(
    estimates: Estimate | Sequence[Estimate],
    name: str = "",
    *,
    start: float | None = None,
    stop: float | None = None,
    places: Sequence[Array] | None = None,
    threshold: Threshold | None = None,
) -> DriverStyle:
    """Describe how someone drove.

    Args:
        estimates: of one driver, of one estimator with one ell.
        name: of the driver; by default the log's.
        start, stop: only this stretch of road, m of the curvilinear coordinate.
        places: s of the ticks of each estimate, m; by default from the start of each (`course_of`). Used with a stretch.
        threshold: of the bursts; None takes that of the estimator, the largest of the logs.

    Raises:
        UsageError: no estimate, or estimates that do not compare (estimator, ell, noise).
        MissingSignal: an estimate has no intentional jerk, or a stretch is asked for and there is no distance.
        LogError: nothing is valid.
    """
    runs = [estimates] if isinstance(estimates, Estimate) else list(estimates)
    refuse_mixed(runs)
    limits = threshold or common_threshold(runs)
    pieces = []
    for number, run in enumerate(runs):
        inside = np.ones(len(run.grid), bool)
        if start is not None or stop is not None:
            s = course_of(run).s if places is None else places[number]
            inside = (s >= (-np.inf if start is None else start)) & (s < (np.inf if stop is None else stop))
        pieces.append(_piece(run, find_bursts(run, threshold=limits), inside))
    if not any(piece.jerk.size for piece in pieces):
        where = "" if start is None and stop is None else " in this stretch"
        raise LogError(
            f"{', '.join(run.log.source or 'the log' for run in runs)}: no moment{where} is valid",
            "a drive in which the vehicle moves and all signals are there together",
            "see with `codriver info LOG` what the log holds" if not where else "choose another stretch (--from, --to)",
        )
    return _described(name or (runs[0].log.source or "driver"), runs, pieces, limits)


def refuse_mixed(estimates: Sequence[Estimate]) -> None:
    """Numbers compare only of one estimator with one ell and one noise.

    Raises:
        UsageError: they differ, or there is no estimate.
    """
    if not estimates:
        raise UsageError("no estimate", "one at least", "estimate a log first, with codriver.estimate_log")
    first = estimates[0]
    for other in estimates[1:]:
        if other.observer != first.observer:
            raise UsageError(
                f"estimates of {first.observer} and of {other.observer}", "one estimator for all that is compared",
                "estimate all logs with the one that all can feed",
            )  # fmt: skip
        differ = [key for key in SETTINGS if other.provenance.get(key) != first.provenance.get(key)]
        if differ:
            said = ", ".join(f"{k} {first.provenance.get(k)} and {other.provenance.get(k)}" for k in differ)
            raise UsageError(
                f"estimates of {said}", "one ell and one noise: they set how much of a burst is seen",
                "estimate all logs with the same --ell and --preset",
            )  # fmt: skip


def common_threshold(estimates: Sequence[Estimate]) -> Threshold:
    """The largest threshold of several estimates, so that their counts compare."""
    return max((find_bursts(estimate).threshold for estimate in estimates), key=lambda limits: limits.on)


def _piece(estimate: Estimate, bursts: Bursts, inside: npt.NDArray[np.bool_]) -> _Piece:
    """One log, looked at tick by tick."""
    dt, n = estimate.grid.dt, len(estimate.grid)
    jerk = estimate.columns[JERK]
    a = estimate.columns.get(ACCELERATION, np.full(n, np.nan))
    good = estimate.valid & inside & np.isfinite(jerk)
    at = np.flatnonzero(good)
    speed = speed_of(estimate)
    v = np.full(n, np.nan) if speed is None else speed
    band = np.where(np.isfinite(v), band_of(np.nan_to_num(v)), UNKNOWN)
    block = block_index(at.size, dt).astype(int)
    turns = pedal_reversals(estimate)
    count = int(block.max()) + 1 if at.size else 0
    sums = np.zeros((count, UNKNOWN + 1, 7))
    place = (block, band[at])
    np.add.at(sums[:, :, SECONDS], place, dt)
    np.add.at(sums[:, :, KILOMETRES], place, np.nan_to_num(v[at]) * dt / 1000.0)
    np.add.at(sums[:, :, JERK_SQUARED], place, jerk[at] ** 2 * dt)
    of_tick = np.full(n, -1)
    of_tick[at] = block
    kept = []
    for burst in bursts:
        tick = min(n - 1, round((burst.peak - float(estimate.time[0])) / dt))
        if of_tick[tick] >= 0:
            kept.append(burst)
            sums[of_tick[tick], band[tick], BURSTS] += 1.0
            sums[of_tick[tick], band[tick], LOG_PEAKS] += np.log(abs(burst.jerk))
    if turns is not None:
        counted = turns[of_tick[turns] >= 0]
        np.add.at(sums[:, :, REVERSALS], (of_tick[counted], band[counted]), 1.0)
        sums[:, :, PEDAL_SECONDS] = sums[:, :, SECONDS]
    return _Piece(jerk[at], a[at], v[at], band[at], block, sums, tuple(kept), turns is not None)


def _described(name: str, runs: list[Estimate], pieces: list[_Piece], limits: Threshold) -> DriverStyle:
    """The pieces as one driver."""
    sums = np.concatenate([piece.sums for piece in pieces])
    offsets = np.cumsum([0, *(piece.sums.shape[0] for piece in pieces[:-1])])
    block = np.concatenate([piece.block + offset for piece, offset in zip(pieces, offsets, strict=True)])
    jerk, a, v = (np.concatenate([getattr(p, key) for p in pieces]) for key in ("jerk", "acceleration", "speed"))
    band = np.concatenate([piece.band for piece in pieces])
    known = np.isfinite(a)
    weights = draws(sums.shape[0])
    total, pedal = sums.sum(axis=1), all(piece.pedal for piece in pieces)
    found = [burst for piece in pieces for burst in piece.bursts]
    bands = []
    for index, entry in enumerate(BANDS):
        mine, here = sums[:, index], (band == index) & known
        if mine[:, SECONDS].sum() >= _LEAST and here.any():
            low, high = np.quantile(a[here], [0.05, 0.95])
            bands.append(BandStyle(
                entry, float(mine[:, SECONDS].sum()), float(mine[:, KILOMETRES].sum()), interval(_rms, mine, weights),
                (float(low), float(high)), rate(mine[:, BURSTS], mine[:, KILOMETRES]),
                interval(_reversals, mine, weights) if pedal else None,
            ))  # fmt: skip
    settings = {key: runs[0].provenance[key] for key in (*SETTINGS, "form", "delay_s") if key in runs[0].provenance}
    return DriverStyle(
        name, tuple(run.log.source for run in runs), runs[0].observer, settings, limits,
        float(sum(len(run.grid) * run.grid.dt for run in runs)),
        float(total[:, SECONDS].sum()), float(total[:, KILOMETRES].sum()),
        quantile_intervals(jerk, block, PROBABILITIES), quantile_intervals(a[known], block[known], PROBABILITIES),
        interval(_rms, total, weights), rate(total[:, BURSTS], total[:, KILOMETRES]),
        interval(_peak, total, weights) if len(found) >= 3 else None,
        float(np.mean([burst.in_shift for burst in found])) if found else 0.0,
        interval(_reversals, total, weights) if pedal else None,
        tuple(bands), _envelope(v[known], a[known], runs[0].grid.dt), sums,
    )  # fmt: skip


def _rms(total: Array) -> Array:
    return np.sqrt(_over(total[:, JERK_SQUARED], total[:, SECONDS]))


def _peak(total: Array) -> Array:
    return np.exp(_over(total[:, LOG_PEAKS], total[:, BURSTS]))


def _reversals(total: Array) -> Array:
    return 60.0 * _over(total[:, REVERSALS], total[:, PEDAL_SECONDS])


def _over(above: Array, below: Array) -> Array:
    """above / below, NaN where below is 0."""
    return np.divide(above, below, out=np.full(above.shape, np.nan), where=below > 0)


def _envelope(v: Array, a: Array, dt: float) -> Array:
    """Quantiles of the acceleration in steps of speed; see `DriverStyle.envelope`."""
    rows = []
    step = np.floor(np.nan_to_num(v, nan=-1.0) / _STEP).astype(int)
    for k in range(max(int(step.max(initial=-1)) + 1, 0)):
        here = a[step == k]
        if here.size * dt >= _LEAST:
            low, high = np.quantile(here, [0.05, 0.95])
            rows.append(((k + 0.5) * _STEP, float(low), float(high)))
    return np.array(rows).reshape(-1, 3).T
