"""A report that is no estimate: sections of text, charts and tables, as values.

Whoever has something to report (an identification, a comparison, a paper made again) builds a `Document`;
`write_document` makes one self-contained HTML file of it. Nothing here knows HTML or plotly: `charts` turns a chart into
traces, `document_page` the whole into HTML. Text is plain text everywhere, and escaped there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from codriver.signals.signal import Array

COLORS = ("#0072B2", "#C84C00", "#007A5A", "#8E2F86", "#E69F00", "#1a1a1a")
GREY, BLACK = "#757575", "#1a1a1a"
SIGNIFICANT = 3  # digits of a number in a table


@dataclass(frozen=True)
class Curve:
    """One curve of a plot.

    Attributes:
        name: in the legend; empty for none.
        x, y: shape (n,), y NaN where there is a gap. For bars x may be words.
        color: by default the next of COLORS.
        kind: a line, points, steps (the value holds until the next), or bars.
        dash: "solid", "dash", "dot", "dashdot".
        width: of the line, or size of the points, pixels.
        low, high: a band around a line or steps, error bars of points or bars; in the unit of y.
        right: belongs to the right axis.
        faint: drawn half transparent, for clouds of points and raw measurements.
        text: words shown beside each point.
    """

    name: str
    x: Array | Sequence[str]
    y: Array
    color: str = ""
    kind: Literal["line", "points", "steps", "bars"] = "line"
    dash: str = "solid"
    width: float = 1.5
    low: Array | None = None
    high: Array | None = None
    right: bool = False
    faint: bool = False
    text: tuple[str, ...] = ()


@dataclass(frozen=True)
class Plot:
    """One plot: curves over the chart's x axis.

    Attributes:
        y_label: quantity and unit, at the left axis.
        curves: the lowest first.
        height: pixels.
        guides: dotted horizontal lines.
        right_label: at the right axis, if a curve is there.
        log: whether the left axis is logarithmic.
        limits: of the left axis; by default all that is drawn.
    """

    y_label: str
    curves: tuple[Curve, ...]
    height: int = 220
    guides: tuple[float, ...] = ()
    right_label: str = ""
    log: bool = False
    limits: tuple[float, float] | None = None


@dataclass(frozen=True)
class Span:
    """A shaded stretch of the x axis: "braking" (pink), "gear_shift" (blue) or "other" (grey)."""

    start: float
    stop: float
    kind: str


@dataclass(frozen=True)
class Chart:
    """Plots above one another over one x axis.

    Attributes:
        title: what it shows.
        x_label: quantity and unit.
        plots: from the top.
        caption: what to see in it.
        spans: shaded stretches.
        boxes: framed stretches with a label each: (start, stop, label).
        half: takes half of the page's width, beside the next one that does.
        log_x: whether the x axis is logarithmic.
    """

    title: str
    x_label: str
    plots: tuple[Plot, ...]
    caption: str = ""
    spans: tuple[Span, ...] = ()
    boxes: tuple[tuple[float, float, str], ...] = ()
    half: bool = False
    log_x: bool = False


@dataclass(frozen=True)
class Mark:
    """A cell of a table that says good, bad or open (neither), with its words."""

    kind: Literal["good", "bad", "open"]
    text: str


@dataclass(frozen=True)
class Table:
    """A table; numbers are shown with three significant digits and set flush right, None as a dash."""

    head: tuple[str, ...]
    rows: tuple[tuple[str | float | Mark | None, ...], ...]
    caption: str = ""


@dataclass(frozen=True)
class Findings:
    """A list of judged sentences: (severity "ok", "warn" or "bad", sentence)."""

    items: tuple[tuple[str, str], ...]


Part = str | Chart | Table | Findings


@dataclass(frozen=True)
class Section:
    """A heading and what stands below it; a str is a paragraph."""

    title: str
    parts: tuple[Part, ...] = field(repr=False)


@dataclass(frozen=True)
class Document:
    """A report.

    Attributes:
        title, lead: what it is about, in a line and in a sentence or two.
        sections: in order.
        facts: name and value of what is to be known at a glance.
        command: that made it.
    """

    title: str
    lead: str
    sections: tuple[Section, ...] = field(repr=False)
    facts: tuple[tuple[str, str], ...] = ()
    command: str = ""


def write_document(document: Document, path: str | Path) -> None:
    """Write a document as one self-contained HTML file, whole or not at all.

    Raises:
        UsageError: the file cannot be written.
    """
    from codriver.report.document_page import document_page
    from codriver.report.write import write_whole

    write_whole(document_page(document), Path(path))
