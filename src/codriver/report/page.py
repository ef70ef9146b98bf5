"""The page: one HTML text that needs nothing beside it.

plotly's JavaScript and the columns lie in it compressed (2 MB instead of 5), and a content security policy forbids the
page to load anything from anywhere.
"""

from __future__ import annotations

import json
from functools import cache
from importlib.resources import files
from pathlib import PurePath

from codriver.estimate import Estimate
from codriver.report import tables
from codriver.report.figure import Figure, figure
from codriver.report.numbers import Row, errors, figures
from codriver.report.pack import packed
from codriver.report.panels import panels
from codriver.report.shown import number
from codriver.report.tables import text
from codriver.report.words import how_to_read, subject, what
from codriver.signals import Log
from codriver.summary import summarise
from codriver.trust import Check

_POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:"
HEAD = (
    '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
    f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">\n'
    '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
)
_FAR = 1e5  # s; times beyond (dates as seconds) are shown from the start of the drive
_HINT = (
    "<p class=screen>Drag across a plot to zoom; all plots follow. Double click for the whole drive. "
    '<a href="#how">How to read this</a></p>'
)


def page(
    estimate: Estimate, title: str | None, truth: Log | None, command: str | None, check: Check | None = None
) -> str:
    """The report as HTML; see `codriver.report.write_report` for the arguments."""
    start = float(estimate.time[0]) if len(estimate.grid) else 0.0
    origin = start if abs(start) > _FAR else 0.0
    check = check or estimate.check()
    name = PurePath(estimate.log.source.replace("\\", "/")).name
    title = title or f"{subject(estimate)}: {name or 'recording in memory'}"
    rows = figures(estimate, summarise(estimate))
    reading = "".join(f"<p>{text(p)}</p>" for p in how_to_read(estimate))
    parts = [
        f"<h1>{text(title)}</h1><p class=lead>{text(what(estimate))}</p>",
        _facts(estimate, rows),
        tables.verdict(estimate, check, origin),
        _plots(estimate, truth, origin),
        f"<div class=columns><section><h2>Figures</h2>{tables.figures(rows)}</section>"
        f'<section id="how"><h2>How to read this</h2>{reading}</section></div>',
    ]
    if truth is not None:
        parts.append(f"<h2>Against the reference</h2>{tables.error_table(errors(estimate, truth), truth.source)}")
    parts += [
        f"<h2>Signals of the recording</h2>{tables.signals(estimate)}",
        f"<h2>Faults of the recording</h2>{tables.faults(estimate)}",
        f"<h2>How this was made</h2>{_provenance(estimate, command)}",
    ]
    content = "\n".join(parts)
    return (
        f"{HEAD}<title>{text(title)}</title>\n<style>\n{asset('page.css')}</style>\n</head>\n<body>\n"
        f"{content}\n</body>\n</html>\n"
    )


def _facts(estimate: Estimate, rows: list[Row]) -> str:
    """The header's facts: estimator and settings, duration and distance."""
    settings = estimate.provenance
    values = {row.name: row.value for row in rows}
    facts = [
        ("recording", estimate.log.source or "in memory"), ("estimator", estimate.observer),
        ("vehicle", settings.get("vehicle", "not needed")),
        ("ell (high: quick, noisy)", settings.get("ell", "")), ("noise preset", settings.get("preset", "")),
        ("form", settings.get("form", "")),
        ("tick", f"{number(estimate.grid.dt)} s ({number(1 / estimate.grid.dt)} Hz)"),
        ("duration", values["duration"]), ("distance", values["distance"]),
    ]  # fmt: skip
    return (
        "<div class=facts>" + "".join(f"<div><span>{text(k)}</span>{text(v)}</div>" for k, v in facts if v) + "</div>"
    )


def _plots(estimate: Estimate, truth: Log | None, origin: float) -> str:
    """The plots with the key of the shadings, and all that draws them."""
    stack = panels(estimate, truth) if len(estimate.grid) else []
    if not stack:
        return "<h2>Plots</h2><p>There is nothing to draw.</p>"
    drawn = figure(estimate, stack, origin)
    notes = []
    if drawn.bucket > estimate.grid.dt:
        notes.append(
            f"The drive is long: each curve was thinned out to the least and the greatest value of every "
            f"{number(drawn.bucket, 2)} s. No extreme is lost; what is faster than that cannot be zoomed into."
        )
    if origin:
        notes.append(f"Time 0 s is {origin:.3f} s of the recording's clock.")
    spec = json.dumps(drawn.spec, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    return (
        f"<section class=plots><h2>Plots</h2>{_HINT}{_key(drawn, truth)}"
        f"{''.join(f'<p><small>{text(n)}</small></p>' for n in notes)}\n"
        '<div id="plots"></div>'
        "<noscript><p>The plots need JavaScript; all figures in the tables stand without.</p></noscript></section>\n"
        f'<script type="application/json" id="figure">{spec}</script>\n'
        f'<script type="application/octet-stream" id="columns">{drawn.data}</script>\n'
        f'<script type="application/octet-stream" id="plotly">{plotly()}</script>\n'
        f"<script>\n{asset('plots.js')}</script>\n"
    )


def _key(drawn: Figure, truth: Log | None) -> str:
    """The key of the shadings; a box switches each on and off."""
    labels = []
    for shade in drawn.shades:
        fill = f"background:{shade.color}"
        if shade.hatch:
            fill = f"background:repeating-linear-gradient(-45deg,#eee 0 4px,{shade.color} 4px 5px)"
        labels.append(
            f'<label><input type="checkbox" checked data-shade="{shade.key}"><span class=swatch style="{fill}"></span>'
            f"{text(shade.words)}</label>"
        )
    if truth is not None:
        labels.append("<span>dotted: the reference, what was true</span>")
    return f"<div class=key>{''.join(labels)}</div>" if labels else ""


def _provenance(estimate: Estimate, command: str | None) -> str:
    rows = [(text(key), f"<code>{text(value)}</code>") for key, value in estimate.provenance.items()]
    rows.append(("recording", f"<code>{text(estimate.log.source or 'in memory')}</code>"))
    if command:
        rows.append(("command", f"<code>{text(command)}</code>"))
    return tables.table((), rows)


def asset(name: str) -> str:
    """A file of this package, as text."""
    return files("codriver.report").joinpath(name).read_text(encoding="utf-8")


@cache
def plotly() -> str:
    """plotly's JavaScript, packed."""
    from plotly.offline import get_plotlyjs

    return packed(get_plotlyjs().encode())
