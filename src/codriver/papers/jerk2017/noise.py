"""Beside 2017 section IV-C: how the estimators bear noise of the pedals' sensors, which the paper's figure 6 shows."""

from __future__ import annotations

from collections.abc import Sequence

from codriver.papers.drives import Driven
from codriver.papers.item import Item
from codriver.papers.reproduction import Chapter
from codriver.report.document import Table

_OURS = ("intent-pedals", 2.0)
_FOLLOWED = ("intent-fused", "pedals-only")
_SPIKES = 2.0  # times our own: beyond it the pedal solution counts as prone to spikes


def noise_chapter(drives: Sequence[Driven]) -> Chapter:
    """The sixth driver's drive again, with noisier and noisier pedals; the first is the road test's own."""
    rows = [
        (
            _level(driven), score.estimator, "–" if score.ell is None else f"{score.ell:g}", score.correlation, score.lag,
            score.moment, score.zero, driven.spikes[score.estimator, score.ell],
        )
        for driven in drives
        for score in driven.scores
        if score.truth == "plan" and (score.estimator in _FOLLOWED or (score.estimator, score.ell) == _OURS)
    ]  # fmt: skip
    ratios = {_level(d): d.spikes["pedals-only", None] / d.spikes[_OURS] for d in drives}
    listed = ", ".join(f"{level}: {ratio:.1f}" for level, ratio in ratios.items())
    clean, noisy = next(iter(ratios)), list(ratios)[-1]
    items = [
        Item(f"fig. 6: the pedal solution is prone to spikes, {said}", "spikes", ratios[level], "1", ratios[level] > _SPIKES,
             "how far its jerk leaves its mean over half a second (99.9 % quantile), over that of ours at ell = 2; above 2 "
             f"counts. By noise: {listed}")
        for said, level in (("clean pedals", clean), (f"pedal noise of {noisy}", noisy))
    ]  # fmt: skip
    items.append(_fused(drives))
    words = (
        "What the paper's pedals were like is not said. The same drive is judged with several levels of white noise per sample "
        "on accelerator (share of its range) and brake pressure; converters' steps (0.4 %, 0.1 bar) are in all of them.",
    )
    head = ("noise", "estimator", "ell", "correlation", "at lag, s", "error", "zero", "spikes")
    table = Table(head, tuple(rows), (
        "Best correlation with the planned jerk, and the lag of it; error against the plan of the moment, m/s³; spikes: how "
        "far the jerk leaves its mean over half a second, 99.9 % quantile, m/s³. The kinematic model takes no pedal."
    ))  # fmt: skip
    return Chapter("Noise of the pedals (to IV-C)", words, (table,), tuple(items))


def _fused(drives: Sequence[Driven]) -> Item:
    """Whether intent-fused knows the plan earlier than intent-pedals, and no worse, up to 1 % of pedal noise."""
    said, better = [], True
    for driven in drives:
        plan = {(s.estimator, s.ell): s for s in driven.scores if s.truth == "plan"}
        ours, theirs = plan["intent-fused", _OURS[1]], plan[_OURS]
        said.append(
            f"{_level(driven)}: {ours.correlation:.3f} at {ours.lag:.2f} s against {theirs.correlation:.3f} at {theirs.lag:.2f} s"
        )
        if driven.job.pedal_noise is None or driven.job.pedal_noise <= 0.01:
            better &= ours.lag < theirs.lag and ours.correlation > theirs.correlation - 0.005
    return Item(
        "intent-fused knows the driver's plan earlier", None, said[0], "", better,
        "not in the paper: best correlation with the planned jerk and its lag, intent-fused against intent-pedals, ell = 2; "
        f"earlier and no worse up to 1 % of noise counts. {'; '.join(said[1:])}",
    )  # fmt: skip


def _level(driven: Driven) -> str:
    job = driven.job
    if job.pedal_noise is None or job.brake_noise is None:
        return "0.1 %, 0.05 bar"
    return f"{100 * job.pedal_noise:g} %, {job.brake_noise / 1e5:g} bar"
