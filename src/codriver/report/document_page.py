"""A document as one HTML text that needs nothing beside it: like the page of an estimate, but for any content."""

from __future__ import annotations

import json
import re
from itertools import groupby

from codriver.report.charts import chart_figure
from codriver.report.document import SIGNIFICANT, Chart, Document, Findings, Mark, Part, Section, Table
from codriver.report.pack import packed
from codriver.report.page import HEAD, asset, plotly
from codriver.report.shown import number
from codriver.report.tables import SEVERITY, table, text

_LONG = 5  # sections from which on a list of contents is given


def document_page(document: Document) -> str:
    """The document as HTML; see `codriver.report.document.write_document`."""
    charts: list[dict[str, object]] = []
    body = [f"<h1>{text(document.title)}</h1><p class=lead>{text(document.lead)}</p>"]
    if document.facts:
        facts = "".join(f"<div><span>{text(k)}</span>{text(v)}</div>" for k, v in document.facts)
        body.append(f"<div class=facts>{facts}</div>")
    if len(document.sections) >= _LONG:
        links = "".join(f'<li><a href="#{_anchor(s)}">{text(s.title)}</a></li>' for s in document.sections)
        body.append(f"<nav class=screen><ul class=contents>{links}</ul></nav>")
    body += [_section(section, charts) for section in document.sections]
    if document.command:
        body.append(f"<h2>How this was made</h2><p><code>{text(document.command)}</code></p>")
    if charts:
        spec = packed(json.dumps(charts, allow_nan=False, separators=(",", ":")).encode())
        body.append(
            "<noscript><p>The plots need JavaScript; all figures in the tables stand without.</p></noscript>\n"
            f'<script type="application/octet-stream" id="charts">{spec}</script>\n'
            f'<script type="application/octet-stream" id="plotly">{plotly()}</script>\n'
            f"<script>\n{asset('document.js')}</script>"
        )
    content = "\n".join(body)
    return (
        f"{HEAD}<title>{text(document.title)}</title>\n<style>\n{asset('page.css')}</style>\n</head>\n<body>\n"
        f"{content}\n</body>\n</html>\n"
    )


def _anchor(section: Section) -> str:
    return re.sub(r"[^a-z0-9]+", "-", section.title.lower()).strip("-")


def _section(section: Section, charts: list[dict[str, object]]) -> str:
    """A heading and its parts; neighbouring half charts stand beside one another."""
    made = [f'<section id="{_anchor(section)}"><h2>{text(section.title)}</h2>']
    for half, parts in groupby(section.parts, lambda part: isinstance(part, Chart) and part.half):
        inner = "".join(_part(part, charts) for part in parts)
        made.append(f"<div class=columns>{inner}</div>" if half else inner)
    return "".join(made) + "</section>"


def _part(part: Part, charts: list[dict[str, object]]) -> str:
    if isinstance(part, str):
        return f"<p>{text(part)}</p>"
    if isinstance(part, Findings):
        items = "".join(
            f'<li class="{severity}"><b class=tag>{SEVERITY[severity]}</b> <span>{text(sentence)}</span></li>'
            for severity, sentence in part.items
        )
        return f"<ul class=findings>{items}</ul>"
    if isinstance(part, Table):
        return _table(part)
    drawn = chart_figure(part)
    charts.append(drawn)
    caption = f"<figcaption>{text(part.caption)}</figcaption>" if part.caption else ""
    height = drawn["layout"]["height"]
    return (
        f"<figure><h3>{text(part.title)}</h3>"
        f'<div class=chart data-chart="{len(charts) - 1}" style="min-height:{height}px"></div>{caption}</figure>'
    )


def _table(part: Table) -> str:
    numeric = [
        i for i in range(len(part.head)) if any(isinstance(row[i], (int, float)) for row in part.rows if i < len(row))
    ]
    caption = f"<p><small>{text(part.caption)}</small></p>" if part.caption else ""
    return table([text(h) for h in part.head], [[_cell(c) for c in row] for row in part.rows], numeric) + caption


def _cell(cell: str | float | Mark | None) -> str:
    if cell is None:
        return "–"
    if isinstance(cell, Mark):
        return f'<span class="mark {cell.kind}">{text(cell.text)}</span>'
    return text(cell) if isinstance(cell, str) else number(float(cell), SIGNIFICANT)
