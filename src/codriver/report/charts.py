"""A chart of a document turned into what plotly draws: traces and a layout, numbers rounded and thinned out.

A line of more than MOST points is cut into buckets along x and each keeps its least and its greatest value, so that no
extreme is lost.
"""

from __future__ import annotations

from html import escape
from textwrap import wrap
from typing import Any

import numpy as np

from codriver.report.document import COLORS, Chart, Curve, Plot
from codriver.report.figure import SHADES
from codriver.signals.signal import Array

MOST = 6000
MOST_POINTS = 4000  # of a cloud; more are thinned out evenly
GAP, TOP, BOTTOM = 18, 34, 46  # pixels
_SHADE = {shade.key: shade.color for shade in SHADES} | {"other": "rgba(120,120,120,0.18)"}
_BOX = "#C2188B"  # magenta, as the paper's boxes
_FONT = {"family": "system-ui, 'Segoe UI', Helvetica, Arial, sans-serif", "size": 13, "color": "#1a1a1a"}


def chart_figure(chart: Chart) -> dict[str, Any]:
    """Traces, layout and height of a chart, as JSON holds it."""
    legend_rows = max((_legend_rows(plot, chart.half) for plot in chart.plots), default=1)
    # The toolbar has the right end of the legend's first row, or a row of its own.
    crowded = any(_letters(plot) > (40 if chart.half else 115) for plot in chart.plots)
    top = TOP + 18 * (legend_rows - 1 + crowded)
    words = _words(chart)
    bottom = BOTTOM + 16 * max((text.count("<br>") for text in words.values()), default=0)
    height = top + bottom + sum(p.height for p in chart.plots) + (GAP + top - TOP + 20) * (len(chart.plots) - 1)
    inner = height - top - bottom
    layout: dict[str, Any] = {
        "height": height, "margin": {"l": 64, "r": 58 if any(p.right_label for p in chart.plots) else 16, "t": top, "b": bottom},
        "paper_bgcolor": "#ffffff", "plot_bgcolor": "#ffffff", "hovermode": "closest", "dragmode": "zoom", "font": _FONT,
        "shapes": [], "annotations": [], "barmode": "group",
        "xaxis": {
            "title": {"text": chart.x_label}, "gridcolor": "#e4e4e4", "zeroline": False, "showline": True,
            "linecolor": "#444444", "ticks": "outside", "side": "bottom", "exponentformat": "none",
            **({"type": "log", "dtick": "D2"} if chart.log_x else {}),
            **({"type": "category", "tickvals": list(words), "ticktext": list(words.values()), "tickangle": 0} if words else {}),
        },
    }  # fmt: skip
    if not words and not chart.log_x:
        layout["xaxis"]["range"] = _reach(chart)
    traces: list[dict[str, Any]] = []
    above = 0.0
    for row, plot in enumerate(chart.plots, 1):
        left = "y" if row == 1 else f"y{2 * row - 1}"
        legend = "legend" if row == 1 else f"legend{row}"
        domain = [max(1 - (above + plot.height) / inner, 0.0), min(1 - above / inner, 1.0)]
        above += plot.height + GAP + top - TOP + 20
        _axes(layout, plot, left, f"y{2 * row}", domain)
        for number, curve in enumerate(plot.curves):
            color = curve.color or COLORS[number % len(COLORS)]
            traces += _traces(curve, color, f"y{2 * row}" if curve.right else left, legend)
        layout[legend] = {
            "orientation": "h", "x": 0, "xanchor": "left", "y": domain[1], "yanchor": "bottom", "font": {"size": 12},
            "bgcolor": "rgba(0,0,0,0)",
        }  # fmt: skip
        layout["shapes"] += [_guide(left, level) for level in plot.guides]
        layout["xaxis"]["anchor"] = left
    layout["shapes"] += [_shade(s.start, s.stop, _SHADE.get(s.kind, _SHADE["other"])) for s in chart.spans]
    for start, stop, label in chart.boxes:
        box = _shade(start, stop, "rgba(0,0,0,0)")
        layout["shapes"].append(box | {"layer": "above", "line": {"color": _BOX, "width": 1.5}})
        layout["annotations"].append({
            "text": label, "x": start, "y": 1, "xref": "x", "yref": "paper", "xanchor": "left", "yanchor": "top",
            "showarrow": False, "font": {"color": _BOX, "size": 12}, "bgcolor": "rgba(255,255,255,0.75)",
        })  # fmt: skip
    return {"traces": traces, "layout": layout}


def _words(chart: Chart) -> dict[str, str]:
    """Words along x, in the order in which they come, and how they are shown: in lines that fit."""
    found = {x: "" for plot in chart.plots for c in plot.curves if not isinstance(c.x, np.ndarray) for x in c.x}
    fits = max((70 if chart.half else 150) // max(len(found), 1), 6)
    return {x: "<br>".join(escape(line) for line in wrap(x, fits, break_long_words=False)) for x in found}


def _legend_rows(plot: Plot, half: bool) -> int:
    """How many rows the legend of a plot takes, about."""
    return max(1, -(-_letters(plot) // (70 if half else 150)))


def _letters(plot: Plot) -> int:
    """How wide the legend of a plot is, in letters, about."""
    return sum(len(c.name) + 7 for c in plot.curves if c.name)


def _reach(chart: Chart) -> list[float]:
    """The range of x: all that is drawn, and a little more beside points and bars."""
    ends = [
        float(f(c.x[np.isfinite(c.x)]))
        for plot in chart.plots
        for c in plot.curves
        if isinstance(c.x, np.ndarray) and np.isfinite(c.x).any()
        for f in (np.min, np.max)
    ] or [0.0, 1.0]
    low, high = min(ends), max(ends)
    lines = all(c.kind in ("line", "steps") for plot in chart.plots for c in plot.curves)
    margin = 0.0 if lines else 0.04 * (high - low)
    return [low - margin, high + margin] if high > low else [low - 1.0, high + 1.0]


def _axes(layout: dict[str, Any], plot: Plot, left: str, right: str, domain: list[float]) -> None:
    common: dict[str, Any] = {
        "domain": domain, "anchor": "x", "zeroline": False, "showline": True, "linecolor": "#444444", "ticks": "outside",
        "nticks": max(3, plot.height // 28), "exponentformat": "none",
    }  # fmt: skip
    layout[f"yaxis{left[1:]}"] = common | {
        "title": {"text": plot.y_label, "standoff": 6}, "gridcolor": "#e4e4e4",
        **({"type": "log", "dtick": _decades(plot)} if plot.log else {}),
        **({"range": list(np.log10(plot.limits)) if plot.log else list(plot.limits)} if plot.limits else {}),
    }  # fmt: skip
    if plot.right_label:
        layout[f"yaxis{right[1:]}"] = common | {
            "title": {"text": plot.right_label, "standoff": 6}, "overlaying": left, "side": "right", "showgrid": False,
            "tickmode": "auto",
        }  # fmt: skip


def _decades(plot: Plot) -> float | str:
    """Ticks of a logarithmic axis: at 1, 2 and 5 of a decade, or at each decade where there are many."""
    drawn = np.concatenate([c.y[np.isfinite(c.y) & (c.y > 0)] for c in plot.curves]) if plot.curves else np.ones(1)
    return 1.0 if drawn.size and drawn.max() > 100 * drawn.min() else "D2"


def _traces(curve: Curve, color: str, axis: str, legend: str) -> list[dict[str, Any]]:
    """What a curve is drawn as: itself, and its band below it."""
    base: dict[str, Any] = {
        "name": curve.name, "showlegend": bool(curve.name), "xaxis": "x", "yaxis": axis, "legend": legend,
        "opacity": 0.35 if curve.faint else 1.0, "hovertemplate": "%{x}: %{y:.4~g}<extra>" + curve.name + "</extra>",
    }  # fmt: skip
    x, y = curve.x, curve.y
    if curve.kind in ("points", "bars") or not isinstance(x, np.ndarray):
        step = max(1, -(-y.size // MOST_POINTS)) if curve.kind == "points" else 1
        places = _numbers(x[::step]) if isinstance(x, np.ndarray) else list(x)
        shown = base | {"x": places, "y": _numbers(y[::step])}
        if curve.low is not None and curve.high is not None:
            up, down = _numbers((curve.high - y)[::step]), _numbers((y - curve.low)[::step])
            shown["error_y"] = {
                "type": "data", "symmetric": False, "array": up, "arrayminus": down, "thickness": 1.2, "width": 3,
                "color": "#333333",
            }  # fmt: skip
        if curve.kind == "bars":
            return [shown | {"type": "bar", "marker": {"color": color}}]
        mode = "markers+text" if curve.text else "markers"
        return [shown | {
            "type": "scatter", "mode": mode, "marker": {"color": color, "size": 3 + 2 * curve.width},
            "text": list(curve.text), "textposition": "top right",
        }]  # fmt: skip
    made: list[dict[str, Any]] = []
    if curve.low is not None and curve.high is not None:
        for bound, fill in ((curve.low, "none"), (curve.high, "tonexty")):
            bx, by = _thinned(x, bound)
            made.append({
                "type": "scatter", "mode": "lines", "x": bx, "y": by, "xaxis": "x", "yaxis": axis, "hoverinfo": "skip",
                "line": {"width": 0, "color": color}, "showlegend": False, "fill": fill, "fillcolor": _clear(color),
            })  # fmt: skip
    tx, ty = _thinned(x, y)
    shape = "hv" if curve.kind == "steps" else "linear"
    line = {"color": color, "width": curve.width, "dash": curve.dash, "shape": shape}
    made.append(base | {"type": "scatter", "mode": "lines", "x": tx, "y": ty, "line": line, "connectgaps": False})
    return made


def _thinned(x: Array, y: Array) -> tuple[list[float | None], list[float | None]]:
    """A line with at most about MOST points: the least and the greatest of each bucket, in order."""
    if y.size <= MOST:
        return _numbers(x), _numbers(y)
    size = -(-2 * y.size // MOST)
    padded = np.full(-(-y.size // size) * size, np.nan)
    padded[: y.size] = y
    table = padded.reshape(-1, size)
    low = np.argmin(np.where(np.isfinite(table), table, np.inf), axis=1)
    high = np.argmax(np.where(np.isfinite(table), table, -np.inf), axis=1)
    first = np.arange(table.shape[0]) * size
    index = np.minimum(np.sort(np.stack([first + low, first + high], axis=1), axis=1).ravel(), y.size - 1)
    return _numbers(x[index]), _numbers(y[index])


def _numbers(values: Array) -> list[float | None]:
    """Numbers with seven significant digits; None where there is none (JSON has no NaN)."""
    return [float(f"{v:.7g}") if np.isfinite(v) else None for v in np.asarray(values, dtype=float).tolist()]


def _clear(color: str) -> str:
    """A colour, nearly transparent."""
    r, g, b = (int(color[i : i + 2], 16) for i in (1, 3, 5))
    return f"rgba({r},{g},{b},0.20)"


def _shade(start: float, stop: float, color: str) -> dict[str, Any]:
    return {
        "type": "rect", "xref": "x", "yref": "paper", "x0": float(start), "x1": float(stop), "y0": 0, "y1": 1,
        "fillcolor": color, "line": {"width": 0}, "layer": "below",
    }  # fmt: skip


def _guide(axis: str, level: float) -> dict[str, Any]:
    return {
        "type": "line", "xref": "paper", "x0": 0, "x1": 1, "yref": axis, "y0": level, "y1": level, "layer": "below",
        "line": {"color": "#8a8a8a", "width": 1, "dash": "dot" if level else "solid"},
    }  # fmt: skip
