"""Drivers beside each other, as a document: the table, distributions, and everything over s as figure 7 of the 2017 paper.

Figure 7 puts three drivers into one plot each of v, p_r, p_b, a_i and the slope in per cent, over the curvilinear coordinate s, and
gives the jerk of each driver a plot of its own; boxes frame the stretches that the text is about.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from codriver.drivers.alignment import Along
from codriver.drivers.compare import Comparison
from codriver.drivers.resampling import Interval
from codriver.drivers.scale import Rating, sure
from codriver.drivers.style import DriverStyle
from codriver.report.document import COLORS, Chart, Curve, Document, Findings, Mark, Part, Plot, Section, Table

TOGETHER = 3  # drivers in one plot, as in the paper
Box = tuple[float, float, str]
# Of a plot over s: key of `Along`, label, factor from SI.
_PLOTS = (
    ("speed", "v, km/h", 3.6),
    ("accelerator_pedal", "p_r, %", 100.0),
    ("brake_pressure", "p_b, bar", 1e-5),
    ("intentional_acceleration", "a_i, m/s²", 1.0),
    ("slope", "slope, %", 1.0),
)
_QUANTILES = (0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99)


def styles_document(comparison: Comparison, boxes: Sequence[Box] = (), command: str = "") -> Document:
    """What a comparison of drivers says.

    Args:
        comparison: from `codriver.drivers.compare_drivers`.
        boxes: stretches to frame: start and stop (m of s), label.
        command: that made it.
    """
    styles = comparison.styles
    scale = comparison.scale
    sections = [
        Section("Drivers", _drivers(comparison)),
        Section("Intentional jerk and acceleration", (*_distributions(styles), _band_table(styles), _envelope(styles))),
    ]
    if comparison.along is not None:
        sections.append(Section("Over the curvilinear coordinate", _over_s(comparison.along, boxes)))
    if comparison.agreement is not None and comparison.agreement.pairs:
        sections.append(Section("Slope of the road", _slopes(comparison)))
    facts = (
        ("drivers", str(len(styles))),
        ("estimator", f"{styles[0].observer}, ell {styles[0].ell}"),
        ("a burst reaches", f"{styles[0].threshold.on:.2f} m/s³"),
        ("drives aligned by", comparison.aligned or "nothing: no distance"),
        ("scale", scale.name if scale else "none fits"),
    )
    lead = "How drivers change the acceleration they want, estimated from their drives; figure 7 of the 2017 paper, and counts."
    return Document("Driving styles", lead, tuple(sections), facts, command)


def _drivers(comparison: Comparison) -> tuple[Part, ...]:
    ranks = {rank.name: rank for rank in comparison.ranking}
    rows = []
    for style, rating in zip(comparison.styles, comparison.ratings, strict=True):
        rank = ranks.get(style.name)
        rows.append((
            style.name, _kind(rating), _score(rating),
            f"{rank.rank} ({rank.low} to {rank.high})" if rank else None,
            f"{style.seconds / 60:.1f}", f"{style.kilometres:.1f}", _told(style.jerk_rms), _per_km(style),
            _told(style.burst_peak), _told(style.reversals, 1),
        ))  # fmt: skip
    head = (
        "driver", "class", "score", "rank", "valid, min", "valid, km", "rms jerk, m/s³", "bursts per km",
        "peak of a burst, m/s³", "pedal reversals per min",
    )  # fmt: skip
    caption = "In brackets: 95 % intervals. Score: -1 as the scale's smooth drivers, 1 as its aggressive. Rank 1: most aggressive."
    parts: list[Part] = [Table(head, tuple(rows), caption)]
    if comparison.scale is not None:
        parts.append(f"Scale: {comparison.scale.name}; {comparison.scale.source}.")
    told = [(f.severity, f.text) for f in comparison.told]
    for style, rating in zip(comparison.styles, comparison.ratings, strict=True):
        told += [("warn", f"{style.name}: {why}") for why in (rating.why if rating else ())]
    if told:
        parts.append(Findings(tuple(told)))
    return tuple(parts)


def _distributions(styles: Sequence[DriverStyle]) -> tuple[Part, ...]:
    charts = []
    for title, unit, key in (
        ("Intentional jerk", "m/s³", "jerk"),
        ("Intentional acceleration", "m/s²", "acceleration"),
    ):
        curves = []
        for k, style in enumerate(styles):
            found = getattr(style, key)
            if not found:
                continue
            values = np.array([found[p].value for p in _QUANTILES])
            ends = [np.array([_end(found[p], side) for p in _QUANTILES]) for side in ("low", "high")]
            names = [f"{100 * p:g} %" for p in _QUANTILES]
            curves.append(Curve(style.name, names, values, _color(k), "bars", low=ends[0], high=ends[1]))
        caption = "Bars: quantiles over the valid time; lines: 95 % intervals of a block bootstrap."
        charts.append(Chart(f"{title}: quantiles", "quantile", (Plot(unit, tuple(curves), 260),), caption, half=True))
    return tuple(charts)


def _band_table(styles: Sequence[DriverStyle]) -> Table:
    rows = [
        (
            style.name, f"{b.band.name}, {b.band.words}", f"{b.seconds / 60:.1f}", f"{b.kilometres:.1f}", _told(b.jerk_rms),
            f"{b.acceleration[0]:.2f} to {b.acceleration[1]:.2f}",
            None if b.bursts.per_km is None else f"{b.bursts.per_km:.2f} ({b.bursts.low:.2f} to {b.bursts.high:.2f})",
            _told(b.reversals, 1),
        )
        for style in styles
        for b in style.bands
    ]  # fmt: skip
    head = (
        "driver",
        "speed band",
        "min",
        "km",
        "rms jerk, m/s³",
        "a_i 5 to 95 %, m/s²",
        "bursts per km",
        "reversals per min",
    )
    return Table(head, tuple(rows))


def _envelope(styles: Sequence[DriverStyle]) -> Chart:
    curves = []
    for k, style in enumerate(styles):
        v, low, high = style.envelope
        for values, dash, name in ((high, "solid", style.name), (low, "solid", "")):
            curves.append(Curve(name, v * 3.6, values, _color(k), dash=dash))
    caption = "5 % and 95 % quantile of the intentional acceleration in steps of 10 km/h: the longitudinal part of a g-g diagram."
    return Chart("Acceleration against speed", "speed, km/h", (Plot("a_i, m/s²", tuple(curves), 260, (0.0,)),), caption)


def _over_s(along: Along, boxes: Sequence[Box]) -> tuple[Part, ...]:
    names = list(along.signals)
    parts: list[Part] = []
    kilometres = along.places / 1000
    framed = tuple((a / 1000, b / 1000, label) for a, b, label in boxes)
    limits = _jerk_limits(along)
    for first in range(0, len(names), TOGETHER):
        some = names[first : first + TOGETHER]
        plots = []
        for key, label, factor in _PLOTS:
            curves = tuple(
                Curve(name, kilometres, along.signals[name][key] * factor, _color(first + k))
                for k, name in enumerate(some)
                if key in along.signals[name]
            )
            if curves:
                plots.append(Plot(label, curves, 170))
        for k, name in enumerate(some):
            if "intentional_jerk" in along.signals[name]:
                curve = Curve(name, kilometres, along.signals[name]["intentional_jerk"], _color(first + k))
                plots.append(Plot("j_i, m/s³", (curve,), 130, (0.0,), limits=limits))
        parts.append(Chart(
            f"{', '.join(some)} over s", "s, km", tuple(plots), boxes=framed,
            caption="Signals and estimates where each driver was; estimates are late by their delay.",
        ))  # fmt: skip
    return tuple(parts)


def _jerk_limits(along: Along) -> tuple[float, float] | None:
    """One axis for the jerks of all drivers."""
    every = [mine["intentional_jerk"] for mine in along.signals.values() if "intentional_jerk" in mine]
    known = np.concatenate([j[np.isfinite(j)] for j in every]) if every else np.zeros(0)
    if not known.size:
        return None
    most = 1.05 * float(np.abs(known).max()) or 1.0
    return -most, most


def _slopes(comparison: Comparison) -> tuple[Part, ...]:
    agreement = comparison.agreement
    assert agreement is not None  # asked by the caller
    rows = tuple(
        (f"{p.names[0]} and {p.names[1]}", f"{p.metres / 1000:.1f}", p.rms, p.rms_centred, p.correlation)
        for p in (*agreement.pairs, *agreement.against_truth)
    )
    head = ("drivers", "km in both", "rms difference, %", "the same, means taken out, %", "correlation")
    text = "The slope is estimated from each drive by itself; on one road it must be the same for all."
    if agreement.spread is not None:
        text += f" Between drivers it scatters by {agreement.spread:.2f} % of slope (rms, means taken out)."
    return text, Table(head, rows)


def _kind(rating: Rating | None) -> str | Mark:
    if rating is None:
        return "no scale"
    if rating.kind == "cannot tell":
        return Mark("open", "cannot tell")
    return f"{rating.kind}, {sure(rating.probability[rating.kind])}"


def _score(rating: Rating | None) -> str | None:
    if rating is None or rating.score is None:
        return None
    if rating.low is None or rating.high is None:
        return f"{rating.score:.2f}"
    return f"{rating.score:.2f} ({rating.low:.2f} to {rating.high:.2f})"


def _per_km(style: DriverStyle) -> str | None:
    found = style.bursts
    return None if found.per_km is None else f"{found.per_km:.2f} ({found.low:.2f} to {found.high:.2f})"


def _told(found: Interval | None, digits: int = 2) -> str | None:
    if found is None or not np.isfinite(found.value):
        return None
    if not found.known:
        return f"{found.value:.{digits}f}"
    return f"{found.value:.{digits}f} ({found.low:.{digits}f} to {found.high:.{digits}f})"


def _end(found: Interval, side: str) -> float:
    end = getattr(found, side)
    return found.value if end is None else float(end)


def _color(number: int) -> str:
    return COLORS[number % len(COLORS)]
