"""Report of error against horizon, the question of figure 11 of the 2019 paper."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from codriver.drivers.learned.features import Index
from codriver.drivers.learned.horizon_errors import NAIVE, HorizonErrors
from codriver.report.document import BLACK, COLORS, GREY, Chart, Curve, Document, Findings, Part, Plot, Section, Table
from codriver.report.drivers import FULL

SHOWN = 20.0  # s of a drive: forecasts over it can be told apart
EVERY = 1.0  # s between the moments whose forecasts are drawn


def horizon_document(found: HorizonErrors, drives: Sequence[str], notes: Sequence[str], command: str = "") -> Document:
    """The report of `error_against_horizon`.

    Args:
        found: the errors.
        drives: names.
        notes: what was derived, or left.
        command: that made it.
    """
    findings = Findings(tuple((f.severity, f.text) for f in found.verdict()))
    said: list[Part] = [findings, *([" ".join(f"{n}." for n in notes)] if notes else [])]
    left = ", ".join(found.left_out) or "none"
    return Document(
        "How far ahead a driver's torque can be foretold",
        f"Models foretell {found.target} up to {found.horizons[-1]:g} s ahead. Every part of the data is held out once and "
        "foretold by models that learnt from the rest. All know the past and the road ahead, and nothing else.",
        (
            Section("Verdict", tuple(said)),
            Section("Error against horizon", (_errors(found), _table(found))),
            Section("Forecasts", (_forecasts(found),)),
        ),
        (
            ("drives", ", ".join(drives)), ("held out in turn", ", ".join(found.folds)), ("moments", str(found.rows)),
            ("road known ahead", f"{found.road:g} s at most" if found.road else "no road"), ("signals the drives lack", left),
        ),
        command,
    )  # fmt: skip


def _name(form: str, kind: str) -> str:
    return f"{FULL[kind]}, iterated" if form == "iterated" else FULL[kind]


def _looks(found: HorizonErrors) -> dict[tuple[str, str], tuple[str, str]]:
    """Colour and dash: a colour a kind, dashed where iterated, grey for the naive ones."""
    kinds = [k for k in dict.fromkeys(kind for _, kind in found.made) if k not in NAIVE]
    colors = {kind: COLORS[i % len(COLORS)] for i, kind in enumerate(kinds)} | dict.fromkeys(NAIVE, GREY)
    return {
        (form, kind): (colors[kind], "dash" if form == "iterated" else "dot" if kind == "pwl" else "solid")
        for form, kind in found.made
    }


def _errors(found: HorizonErrors) -> Chart:
    """RMSE over horizon; standard errors over the parts, beside each other."""
    looks = _looks(found)
    step = 0.006 * float(found.horizons[-1])
    curves = []
    for place, key in enumerate(found.made):
        color, dash = looks[key]
        rmse, spread = found.rmse(*key), np.nan_to_num(found.spread(*key))
        x = found.horizons + step * (place - (len(found.made) - 1) / 2)
        curves += [
            Curve(_name(*key), x, rmse, color, dash=dash),
            Curve("", x, rmse, color, "points", low=rmse - spread, high=rmse + spread),
        ]
    top = max(
        float((found.rmse(*key) + np.nan_to_num(found.spread(*key))).max()) for key in found.made if key[1] != "pwl"
    )
    limits = (0.0, 1.15 * top)
    return Chart(
        "Error against horizon", "horizon (s)", (Plot("RMSE (N m)", tuple(curves), 340, limits=limits),),
        "Over all moments held out; whiskers: standard error over the parts. Points of one horizon stand beside each other. "
        "Iterated: a model of one step, and column and car between the steps. The slope that stays may leave the frame.",
    )  # fmt: skip


def _table(found: HorizonErrors) -> Table:
    rows = [(_name(*key), *found.rmse(*key).tolist()) for key in found.made]
    rows += [(f"% in the 95 % band of {FULL[kind]}", *(100 * share).tolist()) for kind, share in found.coverage.items()]
    for kind, share in found.diverged.items():
        if share[-1] > 0:
            rows.append((f"% of {FULL[kind]}'s rollouts held at a bound", *(100 * share).tolist()))
    return Table(("RMSE, N m", *(f"{h:g} s" for h in found.horizons)), tuple(rows))


def _forecasts(found: HorizonErrors) -> Chart:
    """Some forecasts over the torque that came."""
    looks, rows = _looks(found), _busiest(found)
    start = float(found.time[rows[0]])
    # The torque as it is known at the rows, which is what the forecasts are held against.
    curves = [Curve("measured", found.time[rows] - start, found.now[rows], BLACK, width=2.0)]
    chosen = rows[np.r_[True, np.diff(np.floor((found.time[rows] - start) / EVERY)) > 0]]
    for key, made in found.made.items():
        if key[1] == "pwl":
            continue
        color, dash = looks[key]
        x = np.hstack([np.r_[found.time[k], found.time[k] + found.horizons, np.nan] - start for k in chosen])
        y = np.hstack([np.r_[found.now[k], made[k], np.nan] for k in chosen])
        curves.append(Curve(_name(*key), x, y, color, dash=dash, width=1.2))
    return Chart(
        "Forecasts, one a second, over the torque that came", "time from the start of the stretch (s)",
        (Plot("torque (N m)", tuple(curves), 340),),
        f"The {SHOWN:g} s in which the torque varies most; the models had not seen them. Each line starts at the torque then.",
    )  # fmt: skip


def _busiest(found: HorizonErrors) -> Index:
    """Rows of the stretch of SHOWN s in which the torque varies most, in the order of time."""
    order = np.lexsort((found.time, found.drive))
    time, drive = found.time[order], found.drive[order]
    starts = range(0, order.size, max(order.size // 200, 1))
    near = [np.flatnonzero((drive == drive[k]) & (time >= time[k]) & (time < time[k] + SHOWN)) for k in starts]
    full = [rows for rows in near if rows.size >= 0.8 * max(r.size for r in near)]
    return order[max(full, key=lambda rows: float(np.std(found.now[order[rows]])))]
