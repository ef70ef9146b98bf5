"""Beside 2017 section IV-C: how the estimators bear noise of the pedals' sensors, which the paper's figure 6 shows."""

from __future__ import annotations

from collections.abc import Sequence

from codriver.papers.drives import Driven
from codriver.papers.item import Item
from codriver.papers.reproduction import Chapter
from codriver.report.document import Table

_ELL = 2.0
_SPIKES = 2.0  # times our own peaks: beyond it the pedal solution counts as prone to spikes


def noise_chapter(drives: Sequence[Driven]) -> Chapter:
    """The sixth driver's drive again, with noisier and noisier pedals; the first is the road test's own."""
    rows = []
    for driven in drives:
        for score in driven.scores:
            if score.truth == "plan":
                rows.append((
                    _level(driven), score.estimator, "–" if score.ell is None else f"{score.ell:g}", score.correlation, score.lag,
                    score.moment, score.zero, driven.peaks[score.estimator, score.ell],
                ))  # fmt: skip
    spikes = {_level(d): d.peaks["pedals-only", None] / d.peaks["intent-pedals", _ELL] for d in drives}
    listed = ", ".join(f"{level}: {ratio:.2f}" for level, ratio in spikes.items())
    clean, noisy = next(iter(spikes)), list(spikes)[-1]
    items = [
        Item(f"fig. 6: the pedal solution is prone to spikes, {said}", "spikes", spikes[level], "1", spikes[level] > _SPIKES,
             f"99.9 % quantile of its jerk over that of ours at ell = 2, whole drive; above 2 counts. {listed}")
        for said, level in (("clean pedals", clean), (f"pedal noise of {noisy}", noisy))
    ]  # fmt: skip
    words = (
        "What the paper's pedals were like is not said. The same drive is judged with several levels of white noise per sample "
        "on accelerator (share of its range) and brake pressure; converters' steps (0.4 %, 0.1 bar) are in all of them.",
    )
    head = (
        "noise",
        "estimator",
        "ell",
        "best correlation with the plan",
        "at lag, s",
        "error of the moment",
        "zero",
        "99.9 % of |jerk|",
    )
    table = Table(
        head, tuple(rows), "Jerk, m/s³. The kinematic model takes no pedal and is not listed again for each level."
    )
    return Chapter("Noise of the pedals (to IV-C)", words, (table,), tuple(items))


def _level(driven: Driven) -> str:
    job = driven.job
    if job.pedal_noise is None or job.brake_noise is None:
        return "0.1 %, 0.05 bar"
    return f"{100 * job.pedal_noise:g} %, {job.brake_noise / 1e5:g} bar"
