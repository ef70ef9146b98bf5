"""The words and tables of a report, as HTML. Whatever came from a file is escaped here, by `text`."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

import numpy as np

from codriver.estimate import Estimate
from codriver.names import VOCABULARY
from codriver.report.numbers import Error, Row
from codriver.report.shown import number, shown, shown_unit, words
from codriver.report.stretches import Span, gaps, not_valid
from codriver.trust import Check

SEVERITY = {"bad": "Bad", "warn": "Warning", "ok": "Good"}
MOST_SPANS = 12  # named one by one; more are counted


def text(value: object) -> str:
    """Any value as HTML text."""
    return escape(str(value), quote=True)


def span_link(span: Span, origin: float) -> str:
    """A stretch of time as a link that zooms the plots to it."""
    a, b = span[0] - origin, span[1] - origin
    return f'<a href="#plots" data-from="{a:.3f}" data-to="{b:.3f}">{a:.1f}–{b:.1f} s</a>'


def table(head: Sequence[str], rows: Iterable[Sequence[str]], numeric: Sequence[int] = ()) -> str:
    """A table; the cells are HTML. `numeric` columns are set flush right."""

    def cells(row: Sequence[str], tag: str) -> str:
        return "".join(f"<{tag}{' class=num' if i in numeric else ''}>{cell}</{tag}>" for i, cell in enumerate(row))

    body = "".join(f"<tr>{cells(row, 'td')}</tr>" for row in rows)
    top = f"<thead><tr>{cells(head, 'th')}</tr></thead>" if head else ""
    return f'<div class="wide"><table>{top}<tbody>{body}</tbody></table></div>'


def verdict(estimate: Estimate, check: Check, origin: float) -> str:
    """The verdict with its findings, the worst first, and the stretches of time that are not to be trusted."""
    worst = check.findings[0].severity if check.findings else "ok"
    title = {
        "bad": "Do not trust this estimate as it is",
        "warn": "Usable, with care",
        "ok": "Nothing speaks against this estimate",
    }[worst]
    items = []
    for finding in check.findings:
        where = ""
        if finding.spans and finding.severity != "ok":
            where = f" <span class=where>(at {_listed(finding.spans, origin)})</span>"
        items.append(
            f'<li class="{finding.severity}"><b class=tag>{SEVERITY[finding.severity]}</b> '
            f"<span>{text(_sentence(finding.text))}{where}</span></li>"
        )
    return (
        f'<section class="verdict {worst}" id="verdict"><h2>{title}</h2><p>Verdict: {text(check.verdict)}. '
        f"{check.valid_share:.1%} of the time is valid.</p><ul class=findings>{''.join(items)}</ul>"
        f"{_distrust(estimate, origin)}</section>"
    )


def _distrust(estimate: Estimate, origin: float) -> str:
    """What not to use and why: stretches that are not valid, and silent signals."""
    items = []
    by_reason: dict[str, list[Span]] = {}
    for stretch in not_valid(estimate):
        by_reason.setdefault(stretch.reason, []).append(stretch.span)
    for reason, spans in by_reason.items():
        total = sum(stop - start for start, stop in spans)
        so_much = f"{total:.1f}" if total >= 1 else f"{total:.1g}"
        items.append(f"<li>Leave out {_listed(spans, origin)} ({so_much} s in all): not valid, {text(reason)}.</li>")
    for name, holes in gaps(estimate).items():
        then = (
            "the estimate goes on without it, and where it is still valid its band is wider"
            if name in estimate.measured
            else "the estimate is not valid there"
        )
        items.append(f"<li>{text(words(name).capitalize())} missing {_listed(holes, origin)}: {then}.</li>")
    if not items:
        return "<p>No stretch has to be left out: every tick is valid, and no signal is missing.</p>"
    return f"<p><b>Stretches to distrust</b> (a click zooms the plots to one)</p><ul>{''.join(items)}</ul>"


def figures(rows: Iterable[Row]) -> str:
    """The table of figures."""
    return table(
        ("figure", "value", ""),
        ((text(r.name), f"<b>{text(r.value)}</b>", f"<small>{text(r.note)}</small>") for r in rows),
    )


def error_table(found: Sequence[Error], source: str) -> str:
    """Errors against the reference."""
    if not found:
        return "<p>A reference was given, but it shares no signal with the valid part of the estimate.</p>"
    head = (
        "estimate",
        "against",
        "RMS error",
        "mean error",
        "best shift",
        "RMS error, after the best shift",
        "inside the 95% band",
    )
    rows = [
        (
            text(words(e.name)), text(words(e.against)), f"{number(e.rms)} {e.unit}", f"{number(e.mean)} {e.unit}",
            f"{e.lag:.2f} s", f"{number(e.rms_shifted)} {e.unit}", "–" if e.covered is None else f"{e.covered:.0%}",
        )
        for e in found
    ]  # fmt: skip
    return (
        f"<p>Against the reference “{text(source or 'in memory')}” (dotted in the plots), over the valid ticks. The "
        "best shift in time is the one after which they differ least; an observer always lags, so the error after it "
        "says how well the shape is met.</p>" + table(head, rows, (2, 3, 4, 5, 6))
    )  # fmt: skip


def signals(estimate: Estimate) -> str:
    """The signals of the log, those the estimator takes first."""
    used = [name for name in estimate.grid.values if name in estimate.log]
    rest = sorted(name for name in estimate.log if name not in used)
    rows = []
    for name in (*used, *rest):
        signal = estimate.log[name]
        finite = shown(name, signal.values[np.isfinite(signal.values)], signal.unit if name in VOCABULARY else None)
        low_high = (
            f"{number(float(finite.min()), 4)} to {number(float(finite.max()), 4)}" if finite.size else "no values"
        )
        role = "measurement" if name in estimate.measured else "input" if name in used else "not used"
        missing = signal.values.size - finite.size
        rows.append((
            text(words(name)), role, text(signal.source) or "–",
            f"{len(signal)}" + (f" ({missing} missing)" if missing else ""),
            f"{number(signal.rate)} Hz" if np.isfinite(signal.rate) else "–", low_high,
            text(shown_unit(name, signal.unit)) or "–",
        ))  # fmt: skip
    absent = [name for name in estimate.grid.values if name not in estimate.log]
    note = f"<p>Optional inputs the recording lacks: {text(', '.join(map(words, absent)))}.</p>" if absent else ""
    return table(("signal", "role", "source", "samples", "rate", "range", "unit"), rows, (3, 4, 5)) + note


def faults(estimate: Estimate) -> str:
    """What was wrong with the recording."""
    sentences = [*estimate.faults, *estimate.log.implausible()]
    if not sentences:
        return "<p>None was found.</p>"
    return f"<ul>{''.join(f'<li>{text(sentence)}</li>' for sentence in sentences)}</ul>"


def _sentence(sentence: str) -> str:
    """Units as print has them."""
    return sentence.replace("m/s^2", "m/s²").replace("m/s^3", "m/s³")


def _listed(spans: Sequence[Span], origin: float) -> str:
    """Stretches in order of time; of many, the longest."""
    chosen = sorted(sorted(spans, key=lambda s: s[0] - s[1])[:MOST_SPANS])
    more = len(spans) - len(chosen)
    return ", ".join(span_link(s, origin) for s in chosen) + (f" and {more} shorter ones" if more > 0 else "")
