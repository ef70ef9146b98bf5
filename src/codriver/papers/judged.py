"""The four estimators against the simulated truth, at each ell: errors, lags, and what answering zero would give."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from codriver.papers.drawing import BLUE, GREEN, PURPLE, TURQUOISE
from codriver.papers.drives import Driven
from codriver.papers.item import Item
from codriver.papers.reproduction import Chapter
from codriver.report.document import GREY, Chart, Curve, Plot, Table
from codriver.simulate.compare import TRUTHS, Score, Truth

# What a road test is held to, in gear shifts: intention over kinematic, against each truth.
SHIFT_LIMITS: Mapping[Truth, Mapping[float, float]] = {
    "model": {1.0: 0.08, 2.0: 0.15, 3.0: 0.25},
    "plan": {1.0: 0.55, 2.0: 0.55, 3.0: 0.55},
}
HALF = 0.5  # where a paper is not held to the limits of the road test, at most half of the kinematic error counts
ERROR_LIMITS = {1.0: 0.02, 2.0: 0.06, 3.0: 0.15}  # m/s^3, of the jerk against the model's truth, lag taken out
_WORDS: Mapping[Truth, str] = {"model": "the intention as the model defines it", "plan": "the driver's plan"}
_FIELDS = (
    "moment",
    "zero",
    "correlation",
    "lag",
    "matched",
    "matched_zero",
    "shifts",
    "shifts_zero",
    "around",
    "around_zero",
)
Mean = Mapping[tuple[str, float | None, Truth], Mapping[str, float]]


def judged_chapter(drives: Sequence[Driven], ells: tuple[float, ...], estimator: str, *, limits: bool) -> Chapter:
    """The chapter on the errors.

    Args:
        drives: judged drives.
        ells: the knob's values.
        estimator: the paper's own.
        limits: whether the road test's limits are held against the means.
    """
    mean = means(score for driven in drives for score in driven.scores)
    words = (
        "The paper has no truth to compare with; the simulation has two. “Model”: the intention as the paper's model defines "
        "it, from the true pedals, mass and slope; truth and estimator then share their assumptions. “Plan”: the "
        "acceleration that the simulated driver planned, before feet, engine and gearbox came between; the more honest one.",
        "An observer lags, and against the truth of the moment its error is mostly lag: always answering zero can look "
        "better. So the error is also given with the lag taken out (against the same observer fed ideal signals of the "
        "truth), over the whole drive and in gear shifts, each beside the error of answering zero. The best correlation "
        "and the lag at which it is reached need neither.",
    )
    return Chapter(
        "Judged against the simulated truth", words, (_table(mean), _chart(mean)), _items(mean, ells, estimator, limits)
    )


def means(scores: Iterable[Score]) -> Mean:
    """Means over the drives that have a figure, by estimator, ell and truth; NaN where none has it."""
    gathered: dict[tuple[str, float | None, Truth], list[list[float]]] = {}
    for score in scores:
        row = [np.nan if (value := getattr(score, name)) is None else float(value) for name in _FIELDS]
        gathered.setdefault((score.estimator, score.ell, score.truth), []).append(row)
    return {key: dict(zip(_FIELDS, map(_mean, zip(*rows, strict=True)), strict=True)) for key, rows in gathered.items()}


def _mean(values: Iterable[float]) -> float:
    """The mean of the numbers among the values."""
    there = [value for value in values if not np.isnan(value)]
    return float(np.mean(there)) if there else float("nan")


def shift_ratio(mean: Mean, ell: float, truth: Truth, estimator: str, where: str = "shifts") -> float:
    """Error inside gear shifts, lag taken out, of an estimator over the kinematic model's; where="around": a second more."""
    return mean[estimator, ell, truth][where] / mean["kinematic", ell, truth][where]


def _items(mean: Mean, ells: tuple[float, ...], estimator: str, limits: bool) -> tuple[Item, ...]:
    made = []
    for ell in ells:
        for truth in TRUTHS:
            ratio, around = (shift_ratio(mean, ell, truth, estimator, where) for where in ("shifts", "around"))
            if np.isnan(ratio):
                continue  # no driver shifted
            bound = SHIFT_LIMITS[truth][ell] if limits else HALF
            ours, other = mean[estimator, ell, truth], mean["kinematic", ell, truth]
            nearer = "" if ours["shifts"] < ours["shifts_zero"] else ", which is nearer here"
            made.append(Item(
                f"gear shifts are rejected: ell = {ell:g}, against {_WORDS[truth]}", "rejected", ratio, "1", ratio <= bound,
                "jerk error inside shifts, intention over kinematic, lag taken out, mean of the drives; at most "
                f"{bound:g} counts. Intention {ours['shifts']:.2f}, kinematic {other['shifts']:.2f}, answering zero "
                f"{ours['shifts_zero']:.2f} m/s³{nearer}. With the second after each shift: {around:.2f}",
            ))  # fmt: skip
        if limits:
            error = mean[estimator, ell, "model"]["matched"]
            made.append(Item(
                f"error of the jerk, ell = {ell:g}, lag taken out", None, error, "m/s³", error <= ERROR_LIMITS[ell],
                f"not in the paper; against the model's truth. Zero {mean[estimator, ell, 'model']['matched_zero']:.2f}, kinematic "
                f"{mean['kinematic', ell, 'model']['matched']:.2f}; at most {ERROR_LIMITS[ell]:g} counts",
            ))  # fmt: skip
    return tuple(made)


def _table(mean: Mean) -> Table:
    rows = tuple(
        (
            truth, estimator, "–" if ell is None else f"{ell:g}",
            *(None if np.isnan(value) else value for value in (found[name] for name in _FIELDS)),
        )
        for (estimator, ell, truth), found in sorted(mean.items(), key=lambda item: item[0][2])
    )  # fmt: skip
    return Table(
        ("truth", "estimator", "ell", "error of the moment", "zero", "best correlation", "at lag, s",
         "lag taken out", "zero", "inside shifts", "zero", "and 1 s after", "zero"),
        rows,
        "Jerk, m/s³ rms, mean over the drives, on the ticks where all estimators are valid. No ideal "
        "signals lag as pedals-only and intent-fused do, so their lag cannot be taken out; the truth of the model is made from "
        "the same pedals, which flatters both.",
    )  # fmt: skip


def _chart(mean: Mean) -> Chart:
    """Correlation with the plan over lag: what each estimator knows, and when."""
    curves = []
    for estimator, color in (
        ("intent-pedals", GREEN),
        ("intent-torque", PURPLE),
        ("intent-fused", BLUE),
        ("kinematic", TURQUOISE),
        ("pedals-only", GREY),
    ):
        points = [(ell, f) for (name, ell, truth), f in mean.items() if name == estimator and truth == "plan"]
        if points:
            curves.append(Curve(
                estimator, np.array([f["lag"] for _, f in points]), np.array([f["correlation"] for _, f in points]), color,
                kind="points", width=3, text=tuple("" if ell is None else f"ell {ell:g}" for ell, _ in points),
            ))  # fmt: skip
    return Chart(
        "How well the planned jerk is known, and how late", "lag (s)", (Plot("best correlation", tuple(curves), 260),),
        "Up and to the left is better. A larger ell is earlier.",
    )  # fmt: skip
