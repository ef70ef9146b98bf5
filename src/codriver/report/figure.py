"""Panels turned into what plotly draws: traces, a layout, and the packed columns the page fills them from.

All panels share one x axis, so a zoom in one is a zoom in all. The traces carry no points: `plots.js` fills them with
what is in view. Shaded stretches are traces too, one a panel and kind, so that they can be hatched and switched off.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from codriver.estimate import Estimate
from codriver.report.pack import Pack
from codriver.report.parts import Band, Line, Panel
from codriver.report.stretches import Span, braking, spans

TITLE, TOP, BOTTOM, LEFT, RIGHT = 34, 26, 46, 64, 58  # pixels


@dataclass(frozen=True)
class Shade:
    """How a kind of stretch is shaded: key, words for the legend, fill colour, and hatching ("" for none)."""

    key: str
    words: str
    color: str
    hatch: str = ""


# Pink for braking and blue for shifts are the paper's; what is not valid is hatched.
SHADES = (
    Shade("braking", "pink: the driver brakes", "rgba(231,84,150,0.20)"),
    Shade("gear_shift", "blue: a gear shift goes on", "rgba(64,140,255,0.30)"),
    Shade("not_valid", "hatched: the estimate is not valid", "rgba(90,90,90,0.55)", "/"),
)


@dataclass(frozen=True)
class Figure:
    """What the page needs to draw.

    Attributes:
        spec: traces, layout, columns and stretches, as JSON holds it.
        data: the packed columns.
        bucket: s; each keeps its least and its greatest value. The tick if no point was lost.
        shades: the kinds of stretches that occur.
    """

    spec: dict[str, Any]
    data: str
    bucket: float
    shades: tuple[Shade, ...]


def figure(estimate: Estimate, stack: list[Panel], origin: float = 0.0) -> Figure:
    """The figure of a stack of panels.

    Args:
        estimate: for the clock and the flags.
        stack: the panels, from the top.
        origin: the time shown as 0, s.
    """
    n, dt = len(estimate.grid), estimate.grid.dt
    start = float(estimate.time[0]) - origin if n else 0.0
    stop = start + max(n - 1, 1) * dt
    pack = Pack(start, dt)
    stretches = _stretches(estimate, origin)
    shades = tuple(shade for shade in SHADES if stretches[shade.key])
    height = TOP + BOTTOM + sum(panel.height + TITLE for panel in stack)
    inner = height - TOP - BOTTOM
    traces: list[dict[str, Any]] = []
    sources: list[dict[str, Any]] = []
    layout = _layout(height, start, stop)
    above = 0.0
    for row, panel in enumerate(stack, 1):
        top, bottom = 1 - (above + TITLE) / inner, 1 - (above + TITLE + panel.height) / inner
        above += TITLE + panel.height
        left, right = "y" if row == 1 else f"y{2 * row - 1}", f"y{2 * row}"
        legend = "legend" if row == 1 else f"legend{row}"
        limits = _limits(panel, False)
        for shade in shades:
            # Far beyond the axis, so that the stretch stays filled when the axis is dragged.
            reach = 5 * (limits[1] - limits[0])
            sources.append({"kind": "spans", "key": shade.key, "low": limits[0] - reach, "high": limits[1] + reach})
            traces.append(_shading(shade, left))
        for item in panel.items:
            axis = right if isinstance(item, Line) and item.right else left
            if isinstance(item, Band):
                sources.append({"kind": "band", "low": pack.add(item.low, "low"), "high": pack.add(item.high, "high")})
            else:
                sources.append({"kind": "line", "column": pack.add(item.values)})
            traces.append(_trace(item, axis, legend, panel))
        _axes(layout, panel, left, right, (bottom, top), limits)
        layout["annotations"].append(_heading(panel, top))
        layout[legend] = {
            "orientation": "h", "x": 1, "xanchor": "right", "y": top, "yanchor": "bottom", "font": {"size": 12},
            "bgcolor": "rgba(0,0,0,0)", "itemclick": "toggle", "itemdoubleclick": False,
        }  # fmt: skip
        layout["shapes"] += [
            {
                "type": "line", "xref": "paper", "x0": 0, "x1": 1, "yref": left, "y0": level, "y1": level,
                "layer": "below", "line": {"color": "#8a8a8a", "width": 1, "dash": "dot" if level else "solid"},
            }
            for level in panel.guides
        ]  # fmt: skip
    spec = {
        "traces": traces, "sources": sources, "columns": pack.columns, "layout": layout, "span": [start, stop],
        "stretches": {shade.key: stretches[shade.key] for shade in shades},
    }  # fmt: skip
    return Figure(spec, pack.text(), pack.bucket, shades)


def _stretches(estimate: Estimate, origin: float) -> dict[str, list[Span]]:
    masks = {"braking": braking(estimate), "gear_shift": estimate.flag("gear_shift"), "not_valid": ~estimate.valid}
    return {
        key: [(round(a - origin, 4), round(b - origin, 4)) for a, b in spans(mask, estimate)]
        for key, mask in masks.items()
    }


def _layout(height: int, start: float, stop: float) -> dict[str, Any]:
    return {
        "height": height, "margin": {"l": LEFT, "r": RIGHT, "t": TOP, "b": BOTTOM}, "paper_bgcolor": "#ffffff",
        "plot_bgcolor": "rgba(0,0,0,0)", "hovermode": "x unified", "dragmode": "zoom", "annotations": [], "shapes": [],
        "font": {"family": "system-ui, 'Segoe UI', Helvetica, Arial, sans-serif", "size": 13, "color": "#1a1a1a"},
        "hoverlabel": {"bgcolor": "rgba(255,255,255,0.92)", "font": {"size": 12}},
        "xaxis": {
            "range": [start, stop], "title": {"text": "time (s)"}, "showgrid": True, "gridcolor": "#e4e4e4",
            "zeroline": False, "side": "bottom", "showspikes": True, "spikemode": "across", "spikesnap": "cursor",
            "spikethickness": 1, "spikecolor": "#777777", "spikedash": "dot", "hoverformat": ".2f", "unifiedhovertitle":
            {"text": "%{x:.2f} s"}, "ticks": "outside", "exponentformat": "none", "separatethousands": False,
        },
    }  # fmt: skip


def _axes(
    layout: dict[str, Any],
    panel: Panel,
    left: str,
    right: str,
    domain: tuple[float, float],
    limits: tuple[float, float],
) -> None:
    """The left axis of a panel, and the right one if it has one."""
    common: dict[str, Any] = {
        "domain": [max(domain[0], 0.0), min(domain[1], 1.0)], "zeroline": False, "showline": True, "anchor": "x",
        "linecolor": "#444444", "ticks": "outside", "tickmode": "auto", "nticks": max(3, panel.height // 24),
        "exponentformat": "none", "hoverformat": ".2f",
    }  # fmt: skip
    if panel.whole:
        common |= {"tickmode": "linear", "tick0": 0, "dtick": 1 if limits[1] - limits[0] < 3.5 else 2}
    layout[f"yaxis{left[1:]}"] = common | {
        "range": limits, "title": {"text": panel.unit, "standoff": 6}, "gridcolor": "#e4e4e4",
    }  # fmt: skip
    layout["xaxis"]["anchor"] = left  # the last panel's, at the bottom
    if panel.right_unit:
        layout[f"yaxis{right[1:]}"] = common | {
            "range": _limits(panel, True), "title": {"text": panel.right_unit, "standoff": 6}, "overlaying": left,
            "side": "right", "showgrid": False,
        }  # fmt: skip


def _limits(panel: Panel, right: bool) -> tuple[float, float]:
    """The range of an axis: everything that is drawn where it counts, guides included, and a little more."""
    low, high = (min(panel.guides), max(panel.guides)) if panel.guides and not right else (0.0, 0.0)
    fitted = [i for i in panel.items if isinstance(i, Band) or not i.reference] or panel.items
    for item in fitted:
        for values in (item.low, item.high) if isinstance(item, Band) else (item.values,):
            if (isinstance(item, Line) and item.right) == right:
                counted = values[panel.fit & np.isfinite(values)] if panel.fit.any() else values[np.isfinite(values)]
                if counted.size:
                    low, high = min(low, float(counted.min())), max(high, float(counted.max()))
    if high - low < 1e-9:
        low, high = low - 1.0, high + 1.0
    margin = 0.06 * (high - low)
    return low - margin, high + margin


def _shading(shade: Shade, axis: str) -> dict[str, Any]:
    trace: dict[str, Any] = {
        "type": "scatter", "mode": "lines", "line": {"width": 0}, "fill": "toself", "fillcolor": shade.color,
        "xaxis": "x", "yaxis": axis, "hoverinfo": "skip", "showlegend": False, "name": shade.words, "meta": shade.key,
    }  # fmt: skip
    if shade.hatch:
        back = "rgba(130,130,130,0.10)"
        trace["fillcolor"] = back
        trace["fillpattern"] = {
            "shape": shade.hatch, "fgcolor": shade.color, "bgcolor": back, "size": 7, "solidity": 0.15,
        }  # fmt: skip
    return trace


def _trace(item: Line | Band, axis: str, legend: str, panel: Panel) -> dict[str, Any]:
    trace: dict[str, Any] = {
        "type": "scatter", "mode": "lines", "name": item.name, "xaxis": "x", "yaxis": axis, "legend": legend,
    }  # fmt: skip
    if isinstance(item, Band):
        return trace | {"line": {"width": 0}, "fill": "toself", "fillcolor": item.color, "hoverinfo": "skip"}
    unit = panel.right_unit if item.right else panel.unit
    shape = "hv" if item.steps else "linear"
    return trace | {
        "line": {"color": item.color, "width": item.width, "dash": item.dash, "shape": shape}, "connectgaps": False,
        "showlegend": item.legend, "hovertemplate": f"%{{y:.3~f}} {unit}<extra>{item.name}</extra>",
    }  # fmt: skip


def _heading(panel: Panel, top: float) -> dict[str, Any]:
    return {
        "text": f"<b>{panel.title}</b>", "xref": "paper", "yref": "paper", "x": 0, "y": top, "xanchor": "left",
        "yanchor": "bottom", "showarrow": False, "align": "left", "font": {"size": 13},
    }  # fmt: skip
