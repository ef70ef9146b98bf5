"""Documents: what they say is escaped, what they draw is what was given, and the file is whole."""

from __future__ import annotations

import base64
import gzip
import json
import re
from pathlib import Path

import numpy as np
import pytest

from codriver.errors import UsageError
from codriver.report.charts import MOST, chart_figure
from codriver.report.document import (
    Chart,
    Curve,
    Document,
    Findings,
    Mark,
    Plot,
    Section,
    Span,
    Table,
    write_document,
)


def _page(tmp_path: Path, *parts: object) -> str:
    path = tmp_path / "page.html"
    write_document(
        Document("Title & all", "Lead.", (Section("Part one", parts),), (("log", "a<b"),), "codriver x"), path
    )  # type: ignore[arg-type]
    return path.read_text(encoding="utf-8")


def test_text_is_escaped_and_numbers_are_rounded(tmp_path: Path) -> None:
    page = _page(
        tmp_path, "One <b> paragraph", Table(("x", "y"), (("<i>", 1.23456), (Mark("bad", "no & no"), None))),
        Findings((("warn", "a < b"),)),
    )  # fmt: skip
    for said in (
        "Title &amp; all",
        "a&lt;b",
        "One &lt;b&gt; paragraph",
        "&lt;i&gt;",
        "1.23<",
        "no &amp; no",
        "a &lt; b",
        "–",
    ):
        assert said in page, said
    assert 'id="charts"' not in page  # nothing to draw, so no plotly either
    assert len(page) < 20_000


def test_charts_lie_in_the_page(tmp_path: Path) -> None:
    x = np.arange(5.0)
    chart = Chart("C", "time (s)", (Plot("v (m/s)", (Curve("v", x, np.array([1, np.nan, 3, 4, 5.0])),)),), "Caption")
    page = _page(tmp_path, chart)
    found = re.search(r'id="charts">([^<]+)<', page)
    assert found
    (drawn,) = json.loads(gzip.decompress(base64.b64decode(found[1])))
    assert drawn["traces"][0]["x"] == [0, 1, 2, 3, 4]
    assert drawn["traces"][0]["y"] == [1, None, 3, 4, 5]
    assert drawn["layout"]["yaxis"]["title"]["text"] == "v (m/s)"
    assert "http://" not in page.split("<script")[0]
    assert "https://" not in page.split("<script")[0]


def test_a_long_line_keeps_its_extremes() -> None:
    x = np.arange(500_000.0)
    y = np.sin(x / 1e4)
    y[123_456], y[400_001] = 7.0, -9.0
    (trace,) = chart_figure(Chart("", "", (Plot("", (Curve("a", x, y),)),)))["traces"]
    assert len(trace["y"]) <= MOST + 2
    assert max(trace["y"]) == 7.0
    assert min(trace["y"]) == -9.0
    assert trace["x"] == sorted(trace["x"])
    assert trace["x"][trace["y"].index(7.0)] == 123_456


def test_bands_bars_spans_and_boxes() -> None:
    x = np.arange(3.0)
    band = Curve("b", x, x, low=x - 1, high=x + 1)
    bars = Curve(
        "c", ("p", "q"), np.array([1.0, 2.0]), kind="bars", low=np.array([0.5, 1.0]), high=np.array([2.0, 2.5])
    )
    drawn = chart_figure(
        Chart("", "", (Plot("", (band,), guides=(0.0,)),), spans=(Span(1, 2, "braking"),), boxes=((0, 1, "1"),))
    )
    assert [t.get("fill") for t in drawn["traces"]] == ["none", "tonexty", None]
    assert [s["type"] for s in drawn["layout"]["shapes"]] == ["line", "rect", "rect"]
    (bar,) = chart_figure(Chart("", "", (Plot("", (bars,)),)))["traces"]
    assert bar["x"] == ["p", "q"]
    assert bar["error_y"]["array"] == [1.0, 0.5]
    assert bar["error_y"]["arrayminus"] == [0.5, 1.0]


def test_a_folder_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="cannot be written"):
        write_document(Document("t", "l", ()), tmp_path / "no" / "page.html")


def test_words_along_an_axis_are_all_shown_in_lines_that_fit():
    words = ["PWC", "ANN (2), weight decay", "a<b"] + [f"method {k}" for k in range(9)]
    bars = Curve("", words, np.ones(12), kind="bars")
    figure = chart_figure(Chart("", "", (Plot("", (bars,), height=200),)))
    axis = figure["layout"]["xaxis"]
    assert axis["tickvals"] == words
    assert axis["ticktext"][:3] == ["PWC", "ANN (2),<br>weight decay", "a&lt;b"]
    few = chart_figure(Chart("", "", (Plot("", (Curve("", words[:3], np.ones(3), kind="bars"),), height=200),)))
    assert few["layout"]["xaxis"]["ticktext"][1] == words[1]
    # The axis gets the room that its second line takes.
    assert figure["layout"]["margin"]["b"] > few["layout"]["margin"]["b"]
    assert figure["layout"]["height"] - few["layout"]["height"] == 16
