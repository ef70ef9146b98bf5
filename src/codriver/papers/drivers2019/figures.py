"""Figures 12, 14 and 16: bars of the RMSE by sub-data set and method, and a table of the means."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from codriver.papers.drivers2019.judge import METHODS, Judged
from codriver.report.document import Chart, Curve, Mark, Plot, Table

# A hue a method; those beside the paper are greys and browns.
_COLORS = {
    "pwc": "#333333", "pwl": "#8C8C8C", "gp": "#0072B2", "gmr-21": "#E69F00", "hmm-21": "#C84C00", "ann": "#007A5A",
    "ridge": "#8E2F86", "ann-decay": "#7FBFA0", "gmr-bic": "#B8860B", "boosting": "#2AA9B8", "guarded": "#C08497",
}  # fmt: skip


def figure(title: str, found: Judged) -> Chart:
    """RMSE by sub-data set and method.

    Args:
        title: of the chart.
        found: to be drawn.
    """
    curves = []
    for name, rmse in found.rmse.items():
        middle, several = rmse.mean(axis=0), rmse.shape[0] > 1
        sd = rmse.std(axis=0, ddof=1) if several else np.zeros(middle.shape)
        ends = (np.maximum(middle - sd, 0.0), middle + sd) if several else (None, None)
        curves.append(Curve(METHODS[name].label, found.folds, middle, _COLORS[name], "bars", low=ends[0], high=ends[1]))
    drives = found.rmse["pwc"].shape[0]
    whiskers = f"Whiskers: standard deviation over {drives} drives." if drives > 1 else "One drive."
    whiskers += " Bars too low to be seen stand as numbers in the table below."
    return Chart(
        f"{title}: {found.protocol.name}", "sub-data set held out", (Plot("RMSE (N m)", tuple(curves), 280),), whiskers
    )


def means(title: str, found: Judged) -> Chart:
    """RMSE over all drives and sub-data sets."""
    names = list(found.rmse)
    mean, sd = np.array([found.mean(n) for n in names]), np.array([found.spread(n) for n in names])
    bars = Curve(
        "", [METHODS[n].label for n in names], mean, "#0072B2", "bars", low=np.maximum(mean - sd, 0.0), high=mean + sd
    )
    return Chart(
        f"{title}, over all: {found.protocol.name}", "", (Plot("RMSE (N m)", (bars,), 240, (found.mean("pwc"),)),),
        "Whiskers: standard deviation over drives and sub-data sets. Dotted: PWC.",
    )  # fmt: skip


def ratios(found: Sequence[Judged], caption: str) -> Table:
    """RMSE over that of "the torque stays", a column a protocol.

    Args:
        found: judged under each.
        caption: of the table.
    """
    names = [name for name in METHODS if any(name in f.rmse for f in found)]
    rows: list[tuple[str | float | Mark | None, ...]] = [
        (METHODS[name].label, *(f.ratio(name) if name in f.rmse else None for f in found)) for name in names
    ]
    rows.append(("PWC, N m", *(f.mean("pwc") for f in found)))
    return Table(("method", *(f.protocol.name for f in found)), tuple(rows), caption)
