"""How good is a model of a driver? Errors on what it has not seen, with the simplest baselines beside it.

    RMSE = sqrt(mean (T - mean)^2)           NRMSE = RMSE / sd(T)           ratio = RMSE / RMSE of "the torque stays"
    gain over a baseline, block by block:    g_b = mean over 10 s of (e_baseline^2 - e_model^2)

Neighbouring errors are nearly copies, so the question whether one model beats another is asked of blocks of 10 s: the mean of g_b
over its standard error.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np

from codriver.drivers.learned.features import FeatureTable, Index, features_of
from codriver.drivers.learned.kinds import BASELINES, DEFAULT
from codriver.drivers.learned.learned_driver import fit_table
from codriver.drivers.learned.protocol import Fold, Protocol, folds_of
from codriver.drivers.learned.scaling import Scaling
from codriver.drivers.learned.twice import refuse_twice
from codriver.finding import Finding
from codriver.signals import Log
from codriver.signals.signal import Array

BLOCK = 10.0  # s


@dataclass(frozen=True)
class Score:
    """A model on one fold.

    Attributes:
        kind, fold: which.
        rmse, nrmse: N m, and over the sd of the torque; NaN where that never changes.
        ratio: to "the torque stays"; NaN where it does.
        inside68, inside95: shares of the torques inside the bands.
        log_density: mean.
        rows: judged.
        seconds: that fitting took, calibration included.
    """

    kind: str
    fold: str
    rmse: float
    nrmse: float
    ratio: float
    inside68: float
    inside95: float
    log_density: float
    rows: int
    seconds: float


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Models judged on held-out parts.

    Attributes:
        protocol: how.
        scores: by kind, a score a fold.
        gains: (kind, baseline) to (mean, standard error) of the gain in squared error per 10-s block, N^2 m^2.
        features: names of the columns.
        left_out: signals that the drives lack.
        target: the torque's name.
        estimated: whether that is an estimate from the wheel's angle.
    """

    protocol: Protocol
    scores: Mapping[str, tuple[Score, ...]]
    gains: Mapping[tuple[str, str], tuple[float, float]]
    features: tuple[str, ...]
    left_out: tuple[str, ...]
    target: str
    estimated: bool = False

    @property
    def kinds(self) -> tuple[str, ...]:
        """Judged, in order."""
        return tuple(self.scores)

    def mean(self, kind: str, figure: str = "rmse") -> float:
        """A figure's mean over the folds; of squared figures the root of the mean square, over rows."""
        rows = np.array([s.rows for s in self.scores[kind]], dtype=float)
        values = np.array([getattr(s, figure) for s in self.scores[kind]])
        if figure == "rmse":
            return float(np.sqrt(np.average(values**2, weights=rows)))
        if figure == "ratio":
            return self.mean(kind) / self.mean("pwc")
        known = np.isfinite(values)
        return float(np.average(values[known], weights=rows[known])) if known.any() else float("nan")

    def spread(self, kind: str, figure: str = "rmse") -> float:
        """Standard error of a figure's mean from its scatter over the folds; NaN with one fold."""
        values = np.array([getattr(s, figure) for s in self.scores[kind]])
        return float(values.std(ddof=1) / np.sqrt(values.size)) if values.size > 1 else float("nan")

    def verdict(self, kind: str = DEFAULT) -> list[Finding]:
        """What can be said of a kind against the baselines, and of the protocol."""
        found = [Finding("bad", f"leak: {text}") for text in self.protocol.leaks]
        if self.estimated:
            worse = self.protocol.features.current != ()
            said = "the torque is itself an estimate from the wheel's angle" + (
                ", which the features hold" if worse else ""
            )
            found.append(Finding("bad" if worse else "warn", f"{'leak: ' if worse else ''}{said}"))
        still = [s.fold for s in self.scores["pwc"] if not s.rmse > 0]
        if still:
            found.append(
                Finding("warn", f"the torque never changes in {', '.join(still)}: no model can be judged there")
            )
        if kind in self.scores:
            found += [self._against(kind, other) for other in BASELINES if other != kind and other in self.scores]
            inside = self.mean(kind, "inside95")
            word = "ok" if 0.9 <= inside <= 0.985 else "warn"
            found.append(Finding(word, f"{inside:.1%} of the held-out torques lie in {kind}'s 95 % band"))
        return found

    def _against(self, kind: str, other: str) -> Finding:
        mean, error = self.gains[kind, other]
        ratio = self.mean(kind) / self.mean(other)
        said = f"RMSE {ratio:.3f} times that of {other}"
        if mean > 2 * error:
            return Finding("ok", f"{kind} beats {other}: {said}")
        if mean < -2 * error:
            return Finding("bad", f"{kind} is worse than {other}: {said}; take {other} here")
        return Finding("warn", f"{kind} against {other}: {said}, which these drives cannot tell from 1")


def evaluate(
    drives: Mapping[str, Log], kinds: Sequence[str] = (DEFAULT,), *, protocol: Protocol | None = None,
    options: Mapping[str, Mapping[str, Any]] | None = None, calibrate: bool = True,
    progress: Callable[[str], None] | None = None,
) -> Evaluation:  # fmt: skip
    """Judge models of one driver by holding out drives, or blocks of one.

    Args:
        drives: by name.
        kinds: of models; the baselines are added.
        protocol: default: the honest one.
        options: by kind, parameters of the models.
        calibrate: bands learnt from blocks within the training part; False is quicker and leaves the models' own.
        progress: told what is going on.

    Raises:
        MissingSignal: a drive lacks the torque.
        LogError: there are too few usable rows.
        UsageError: there is no such kind or parameter, or two drives are the same recording.
    """
    protocol = protocol or Protocol()
    refuse_twice(drives)
    table = features_of(list(drives.values()), protocol.features)
    return evaluate_table(
        table, folds_of(table, protocol, tuple(drives)), kinds, protocol=protocol, options=options, calibrate=calibrate,
        progress=progress,
    )  # fmt: skip


def evaluate_table(
    table: FeatureTable, folds: Sequence[Fold], kinds: Sequence[str] = (DEFAULT,), *, protocol: Protocol,
    options: Mapping[str, Mapping[str, Any]] | None = None, calibrate: bool = True,
    progress: Callable[[str], None] | None = None,
) -> Evaluation:  # fmt: skip
    """The same on rows and splits of one's own; see `evaluate`."""
    every = tuple(dict.fromkeys((*BASELINES, *kinds)))
    scores: dict[str, list[Score]] = {kind: [] for kind in every}
    blocks: dict[str, list[Array]] = {kind: [] for kind in every}
    for fold in folds:
        train, test = table.take(fold.train), table.take(fold.test)
        spread, stays = float(test.y.std()), float(np.sqrt(np.mean((test.y - test.X[:, test.torque_columns[0]]) ** 2)))
        for kind in every:
            if progress is not None:
                progress(f"{kind}, fold {fold.name}")
            start = perf_counter()
            scaling = Scaling.of(table) if protocol.scaling == "record" else None
            driver = fit_table(
                train, kind, protocol=protocol, options=(options or {}).get(kind), scaling=scaling, calibrate=calibrate
            )
            seconds = perf_counter() - start
            made = driver.predict_table(test)
            error, own = made.error, made.sd
            half = {p: (made.high - made.mean) * _over(driver.calibration, p) for p in (0.68, 0.95)}
            rmse = float(np.sqrt(np.mean(error**2)))
            scores[kind].append(
                Score(
                    kind, fold.name, rmse, _over_size(rmse, spread), _over_size(rmse, stays),
                    float(np.mean(np.abs(error) <= half[0.68])), float(np.mean(np.abs(error) <= half[0.95])),
                    float(np.mean(made.log_density)), own.size, seconds,
                )
            )  # fmt: skip
            blocks[kind].append(block_means(error**2, made.time, test.drive))
    gains = {}
    for kind in every:
        for other in every:
            if kind != other:
                gain = np.concatenate(blocks[other]) - np.concatenate(blocks[kind])
                gains[kind, other] = float(gain.mean()), float(gain.std(ddof=1) / np.sqrt(gain.size))
    return Evaluation(
        protocol,
        {kind: tuple(mine) for kind, mine in scores.items()},
        gains,
        table.names,
        table.left_out,
        table.target,
        table.estimated,
    )


def block_means(values: Array, time: Array, drive: Index, length: float = BLOCK) -> Array:
    """Means over blocks of `length` s of each drive; short ends that are less than half a block are left out."""
    found = []
    for k in np.unique(drive):
        mine = drive == k
        number = ((time[mine] - time[mine].min()) / length).astype(int)
        count = np.bincount(number)
        sums = np.bincount(number, values[mine])
        full = count >= 0.5 * np.median(count[count > 0])
        found.append(sums[full] / count[full])
    return np.concatenate(found)


def _over_size(error: float, size: float) -> float:
    """An error over a size; NaN over none."""
    return error / size if size > 0 else float("nan")


def _over(calibration: Any, level: float) -> float:
    """Half width of the band at a level over that at 95 %."""
    one = np.ones(1)
    return float(calibration.half_width(one, level)[0] / calibration.half_width(one)[0])
