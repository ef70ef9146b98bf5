"""The alignment map on drives that it has not seen, beside a regression of nine features and beside the mean.

    T_dr = theta' (1, delta_s, a_f, delta_s v, omega_s, tanh(omega_s / 0.05), tanh(a_f / 3), a_f / (1 + (v / 20)^2), omega_s v)

a_f = v^2 kappa of a steady turn, m/s^2. With several drives each is left out in turn. One drive is cut into blocks of at least
BLOCK seconds, each left out in turn together with GAP seconds on both sides, since neighbours are alike. The regression and the
mean are fitted on what the map is fitted on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np

from codriver.identify.alignment_drive import Drive
from codriver.identify.alignment_fit import LETTERS, Chosen, correlation_time, fit_told, modelled
from codriver.identify.regression import rms
from codriver.models.alignment import AlignmentModel
from codriver.signals.grid import Flags
from codriver.signals.signal import Array

BLOCK, GAP = 60.0, 5.0  # s
MOST_BLOCKS = 10
WAYS = ("map", "regression", "mean")


@dataclass(frozen=True)
class Held:
    """One part left out.

    Attributes:
        name: of the drive, or of the stretch.
        seconds: that count.
        rmse: by way, N m.
        r2: by way.
    """

    name: str
    seconds: float
    rmse: dict[str, float]
    r2: dict[str, float]


@dataclass(frozen=True, eq=False)
class HoldOut:
    """All parts.

    Attributes:
        parts: those left out; empty where there is too little to leave any out.
        whole: all of them together; None likewise.
        by_drive: whether drives were left out, or blocks of one.
        time: correlation time of the map's error, s.
        predicted: the map's answer on each drive where it was held out, NaN elsewhere, N m.
    """

    parts: tuple[Held, ...]
    whole: Held | None
    by_drive: bool
    time: float
    predicted: tuple[Array, ...] = field(repr=False)


def hold_out(drives: Sequence[Drive], start: AlignmentModel, letters: Sequence[str] = tuple(LETTERS)) -> HoldOut:
    """Leave each part out in turn."""
    by_drive = len(drives) > 1
    predicted = [{way: np.full(d.time.size, np.nan) for way in WAYS} for d in drives]
    parts = []
    for name, rest, out in _drives(drives) if by_drive else _blocks(drives[0]):
        fit, _ = fit_told(rest, start, letters)
        theta = regression(rest)
        mean = float(np.mean(np.concatenate([d.torque[keep] for d, keep in rest])))
        k, keep = out
        drive = drives[k]
        answers = {"map": modelled(drive, fit.model), "regression": features(drive) @ theta,
                   "mean": np.full(drive.time.size, mean)}  # fmt: skip
        for way, answer in answers.items():
            predicted[k][way][keep] = answer[keep]
        parts.append(_held(name, [(drive, keep)], [answers]))
    if not parts:
        return HoldOut((), None, by_drive, float("nan"), tuple(p["map"] for p in predicted))
    told = [(d, np.isfinite(p["map"])) for d, p in zip(drives, predicted, strict=True)]
    errors = [np.where(keep, d.torque - p["map"], 0.0) for (d, keep), p in zip(told, predicted, strict=True)]
    whole = _held("all", told, predicted)
    return HoldOut(tuple(parts), whole, by_drive, correlation_time(told, errors), tuple(p["map"] for p in predicted))


def features(drive: Drive) -> Array:
    """The nine features, shape (n, 9)."""
    a, v, w, lateral = drive.angle, drive.speed, drive.rate, drive.lateral
    one, rub, bent = np.ones(a.size), np.tanh(w / 0.05), np.tanh(lateral / 3)
    return np.column_stack([one, a, lateral, a * v, w, rub, bent, lateral / (1 + (v / 20) ** 2), w * v])


def regression(rows: Chosen) -> Array:
    """theta, shape (9,)."""
    X = np.vstack([features(drive)[keep] for drive, keep in rows])
    y = np.concatenate([drive.torque[keep] for drive, keep in rows])
    return np.asarray(np.linalg.lstsq(X, y, rcond=None)[0])


# name, rows to fit on, and the drive's number and its rows left out
Fold = tuple[str, list[tuple[Drive, Flags]], tuple[int, Flags]]


def _drives(drives: Sequence[Drive]) -> list[Fold]:
    """Each drive in turn."""
    return [
        (Path(out.source).name or f"drive {k + 1}", [(d, d.keep) for d in drives if d is not out], (k, out.keep))
        for k, out in enumerate(drives)
    ]


def _blocks(drive: Drive) -> list[Fold]:
    """Each block of a drive in turn."""
    count = min(int(drive.time.size * drive.dt / BLOCK), MOST_BLOCKS)
    if count < 3:
        return []
    edges = np.linspace(0, drive.time.size, count + 1).astype(int)
    gap, index, folds = round(GAP / drive.dt), np.arange(drive.time.size), []
    for first, last in pairwise(edges.tolist()):
        inside = (index >= first) & (index < last) & drive.keep
        rest = ((index < first - gap) | (index >= last + gap)) & drive.keep
        if inside.sum() * drive.dt > BLOCK / 4:
            start, stop = (float(drive.time[k] - drive.time[0]) for k in (first, last - 1))
            folds.append((f"{start:.0f} to {stop:.0f} s", [(drive, rest)], (0, inside)))
    return folds


def _held(name: str, rows: Chosen, answers: Sequence[dict[str, Array]]) -> Held:
    """How far the answers are from the torque."""
    y = np.concatenate([drive.torque[keep] for drive, keep in rows])
    rmse, r2 = {}, {}
    for way in WAYS:
        e = y - np.concatenate([a[way][keep] for a, (_, keep) in zip(answers, rows, strict=True)])
        rmse[way] = rms(e)
        r2[way] = 1 - float(np.mean(e**2) / np.var(y)) if np.var(y) > 0 else float("nan")
    return Held(name, float(sum(keep.sum() * drive.dt for drive, keep in rows)), rmse, r2)
