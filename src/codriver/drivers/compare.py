"""Several drivers beside each other: styles, scores, ranks, and the same road told from another.

Numbers of a style mix the driver with his road, so drivers compare on one road, over the same stretch. Whether it is one
is asked of the slopes that the estimator finds anyway (`slopes.py`): of one road they correlate, of two they do not.

Ranks are uncertain as scores are: in each replicate of the block bootstrap, drawn independently for each driver, the drivers
are put in order; a rank's interval holds 95 % of its replicates. Blocks are not paired by place, so that on one road
the intervals are wider than they need be.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from codriver.drivers.alignment import Along, How, align, along
from codriver.drivers.course import Course
from codriver.drivers.doubts import contradicted, doubts_of, refusal
from codriver.drivers.scale import Rating, Scale, rate_style, score_draws
from codriver.drivers.scale_file import default_scale
from codriver.drivers.slopes import Agreement, slope_agreement
from codriver.drivers.style import DriverStyle, common_threshold, describe_style, refuse_mixed
from codriver.drivers.threshold import Threshold
from codriver.errors import CodriverError, UsageError
from codriver.estimate import Estimate
from codriver.finding import Finding
from codriver.signals.signal import Array
from codriver.trust import Check

# Least correlation of the slopes of one road. Of one simulated road 0.95 at least, of two 0.77 at most (docs/styles.md).
SAME_ROAD = 0.9
_LENGTHS = 0.1  # share by which the lengths of drives of one road may differ


@dataclass(frozen=True)
class Rank:
    """A place in the order, 1 for the most aggressive, with its 95 % interval."""

    name: str
    rank: int
    low: int
    high: int


@dataclass(frozen=True, eq=False)
class Comparison:
    """Drivers beside each other.

    Attributes:
        styles: in the order given.
        ratings: of each; None where the scale does not fit. "cannot tell" without a score where the data contradict.
        ranking: the most aggressive first; those without a score are left out.
        scale: what rates them; None where none fits.
        aligned: "start", "ends" or "position"; "" where there is no curvilinear coordinate.
        courses: of the first log of each driver, by name.
        along: signals over s; None without a coordinate.
        agreement: of the slopes; None without a coordinate or slopes.
        findings: what to know before believing it.
        doubts: what the checks found against the data of each driver, by name (`doubts.py`).
    """

    styles: tuple[DriverStyle, ...]
    ratings: tuple[Rating | None, ...]
    ranking: tuple[Rank, ...]
    scale: Scale | None
    aligned: str
    courses: Mapping[str, Course] = field(repr=False)
    along: Along | None = field(repr=False)
    agreement: Agreement | None
    findings: tuple[Finding, ...]
    doubts: Mapping[str, tuple[Finding, ...]]

    @property
    def told(self) -> tuple[Finding, ...]:
        """Findings of the comparison and doubts of the drivers, each with its name, the worst first."""
        every = [replace(f, text=f"{name}: {f.text}") for name, mine in self.doubts.items() for f in mine]
        return tuple(sorted([*every, *self.findings], key=lambda f: ("bad", "warn", "ok").index(f.severity)))

    @property
    def judged(self) -> tuple[str, ...]:
        """Drivers whose data nothing bad was found against."""
        return tuple(name for name, mine in self.doubts.items() if not contradicted(mine))


def compare_drivers(
    drivers: Mapping[str, Estimate | Sequence[Estimate]],
    *,
    scale: Scale | None = None,
    start: float | None = None,
    stop: float | None = None,
    how: How = "auto",
    true_slope: Array | None = None,
    checks: Mapping[str, Sequence[Check]] | None = None,
) -> Comparison:
    """Compare drivers.

    A driver whose data contradict themselves gets no score and no class, and sets no threshold for the others.

    Args:
        drivers: estimates by name, all of one estimator with one ell and noise. Of several logs of a driver the first
            is drawn over s; all count for the style.
        scale: what rates them; None takes the built-in one if it fits the estimates.
        start, stop: only this stretch of road, m.
        how: drives are aligned; see `alignment.py`.
        true_slope: per cent at the places of `along`, where a simulation knows it.
        checks: verdicts on the estimates, by name and in their order; None takes what each says of itself (`check()`).

    Raises:
        UsageError: no drivers; estimates that do not compare; a scale that does not fit; a stretch that is none.
        LogError: a driver has nothing valid.
    """
    runs = {name: [e] if isinstance(e, Estimate) else list(e) for name, e in drivers.items()}
    every = [run for mine in runs.values() for run in mine]
    refuse_mixed(every)
    if start is not None and stop is not None and start >= stop:
        raise UsageError(f"a stretch from {start:g} m to {stop:g} m", "a start before its stop", "swap them")
    findings: list[Finding] = []
    courses, aligned = _courses(every, how, start is not None or stop is not None, findings)
    of_run = iter(courses)
    placed = {name: [next(of_run) for _ in mine] for name, mine in runs.items()} if courses else {}
    doubts = [doubts_of(m, [e.check() for e in m] if checks is None else checks[n]) for n, m in runs.items()]
    sound = [run for mine, d in zip(runs.values(), doubts, strict=True) if not contradicted(d) for run in mine]
    limits = common_threshold(sound or every)
    styles = tuple(
        describe_style(
            mine, name, start=start, stop=stop, threshold=limits,
            places=[course.s for course in placed[name]] if placed else None,
        )
        for name, mine in runs.items()
    )  # fmt: skip
    findings += _noisy(limits)
    scale = scale or _fitting(styles[0], findings)
    ratings = tuple(
        refusal(d) or (None if scale is None else rate_style(s, scale)) for s, d in zip(styles, doubts, strict=True)
    )
    chosen = {name: mine[0] for name, mine in placed.items()}
    signals = along({n: mine[0] for n, mine in runs.items()}, chosen, start, stop) if chosen else None
    agreement = _agreement(signals, true_slope)
    if len(runs) > 1:
        findings += _same_road(agreement, chosen, styles)
    return Comparison(
        styles, ratings, _ranking(styles, ratings, scale), scale, aligned, chosen, signals, agreement, tuple(findings),
        {style.name: d for style, d in zip(styles, doubts, strict=True)},
    )  # fmt: skip


def _courses(runs: list[Estimate], how: How, needed: bool, findings: list[Finding]) -> tuple[list[Course], str]:
    """Courses on one coordinate; none, and a finding, where there can be none and none is asked for."""
    try:
        return align(runs, how)
    except CodriverError as error:
        if needed or how != "auto":
            raise
        try:
            courses, aligned = align(runs, "start")
        except CodriverError:
            findings.append(Finding("warn", f"no curvilinear coordinate: {error.found}"))
            return [], ""
        findings.append(Finding("warn", f"{error.found}; drives are aligned by their start instead"))
        return courses, aligned


def _noisy(limits: Threshold) -> list[Finding]:
    """Whether noise, and not the estimator, says what a burst is."""
    if not limits.noisy:
        return []
    return [Finding("warn", (
        f"the noise of a log sets the threshold of bursts ({limits.on:.2f} m/s^3): their counts compare within "
        "this comparison only"
    ))]  # fmt: skip


def _fitting(style: DriverStyle, findings: list[Finding]) -> Scale | None:
    """The built-in scale, where it fits the estimates."""
    scale = default_scale()
    try:
        rate_style(style, scale)
    except UsageError as error:
        findings.append(Finding("warn", f"no scores: {error.found}. To do: {error.do}"))
        return None
    return scale


def _agreement(signals: Along | None, truth: Array | None) -> Agreement | None:
    if signals is None:
        return None
    slopes = {name: mine["slope"] for name, mine in signals.signals.items() if "slope" in mine}
    return slope_agreement(slopes, signals.step, truth) if slopes else None


def _same_road(
    agreement: Agreement | None, courses: Mapping[str, Course], styles: tuple[DriverStyle, ...]
) -> list[Finding]:
    """Whether the drives are of one road, as far as slopes and lengths tell."""
    told = [p for p in agreement.pairs if p.correlation is not None] if agreement else []
    if told:
        worst = min(told, key=lambda p: p.correlation or 0.0)
        value = worst.correlation or 0.0
        if value < SAME_ROAD:
            return [Finding("warn", (
                f"the slopes of {worst.names[0]} and {worst.names[1]} correlate by {value:.2f}: another road, or not "
                "aligned; differences between drivers are partly those of their roads"
            ))]  # fmt: skip
        return [Finding("ok", f"the slopes of all pairs correlate by at least {value:.2f}: one road")]
    lengths = [course.length for course in courses.values()] or [1000 * style.kilometres for style in styles]
    if max(lengths) > 0 and min(lengths) < (1 - _LENGTHS) * max(lengths):
        return [Finding("warn", (
            f"the drives are {min(lengths) / 1000:.1f} to {max(lengths) / 1000:.1f} km long and their slopes do not tell "
            "whether they share a road: differences between drivers may be those of their roads"
        ))]  # fmt: skip
    return [Finding("warn", "whether the drives are of one road could not be seen: too flat, or too short")]


def _ranking(
    styles: tuple[DriverStyle, ...], ratings: tuple[Rating | None, ...], scale: Scale | None
) -> tuple[Rank, ...]:
    """The order by score; see the module."""
    rated = [
        (style, r.score) for style, r in zip(styles, ratings, strict=True) if r is not None and r.score is not None
    ]
    if scale is None or not rated:
        return ()
    again = np.array([score_draws(style, scale, seed=k + 1) for k, (style, _) in enumerate(rated)])
    ranks = 1 + (again[None, :, :] > again[:, None, :]).sum(axis=1)
    low, high = np.quantile(ranks, [0.025, 0.975], axis=1, method="nearest")
    order = sorted(range(len(rated)), key=lambda k: -rated[k][1])
    found = []
    for rank, k in enumerate(order, 1):
        found.append(Rank(rated[k][0].name, rank, min(rank, int(low[k])), max(rank, int(high[k]))))
    return tuple(found)
