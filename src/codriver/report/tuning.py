"""The report of a tuning: the curve of delay against noise and the place on it, likelihood, innovations, and how to use it."""

from __future__ import annotations

import numpy as np

from codriver.report.document import BLACK, COLORS, GREY, Chart, Curve, Document, Mark, Plot, Section, Table
from codriver.tune import NoiseFit, Point, Tuning, Whiteness
from codriver.tune.likelihood import LEAST_BLOCKS

_QUICK = 0.2  # s; below it ripples of body and driveline pass for intention
_BEGUN, _OWN = COLORS[0], COLORS[1]


def tuning_document(result: Tuning, file: str = "", command: str = "") -> Document:
    """The report of a tuning.

    Args:
        result: what `tune` found.
        file: name of the preset written; "" where none was.
        command: that made it.
    """
    at = result.chosen
    lead = (
        f"The setting chosen shows slow changes of the jerk {at.slow_delay:.2f} s late; with these sensors the jerk then "
        f"scatters by {at.noise:.2g} m/s³. {_way(result)}"
    )
    sections = [_place(result), _likelihood(result), _innovations(result), _use(result, file)]
    facts = (
        ("drives", ", ".join(result.logs)),
        ("estimator", result.estimator + (f", vehicle {result.vehicle}" if result.vehicle else "")),
        ("counted", f"{result.seconds:.0f} s at {1 / result.dt:g} Hz; speed on every {_ordinal(result.every[1])} tick"),
        ("sensors", f"accelerometer {result.sensors[0]:.3g} m/s², speed {result.sensors[1]:.3g} m/s a sample"),
    )
    return Document(f"Tuning: {result.preset.name}", lead, tuple(sections), facts, command)


def _way(result: Tuning) -> str:
    """How the setting was chosen."""
    if result.noise is None:
        return f"Q and R are those of {result.begun.name}; ell was chosen for the delay asked for."
    if result.delay is None:
        return f"Q and R were fitted by maximum likelihood, for the ell of {result.begun.name}."
    return "Q and R were fitted by maximum likelihood, then ell was chosen for the delay asked for."


def _place(result: Tuning) -> Section:
    """The curve and the settings on it."""
    marks, own = result.marks, result.chosen
    fitted = result.noise is not None
    curves = [_curve(f"noise of {result.begun.name}", result.begun_curve, _BEGUN)]
    if fitted:
        curves.append(_curve(f"noise of {result.preset.name}", result.curve, _OWN))
    labels = tuple(f"ell = {p.ell:g}" for p in marks)
    curves.append(_points("usual settings", marks, _BEGUN, labels))
    measured = [p for p in (*marks, own) if p.calm is not None]
    if measured:
        x, y = np.array([p.delay for p in measured]), np.array([p.calm for p in measured], float)
        curves.append(Curve("measured in calm stretches", x, y, GREY, "points", width=7))
    curves.append(_points("chosen", (own,), BLACK, ("chosen",)))
    chart = Chart(
        "Delay against noise", "delay of slow changes of the jerk at these rates, s",
        (Plot("standard deviation of the jerk, m/s³", tuple(curves), 380, log=True),),
        "Lines: from the transfer functions, with the sensors' noise as found in the drives. Down and to the left is better; "
        "ell moves along a line, Q and R move the line.", log_x=True,
    )  # fmt: skip
    rows = []
    for label, p in [*((result.begun.name, p) for p in marks), (result.preset.name, own)]:
        rows.append((label, p.ell, p.slow_delay, p.delay, p.bandwidth, p.noise, p.calm))
    table = Table(
        (
            "noise",
            "ell",
            "delay, s",
            "delay at these rates, s",
            "bandwidth, Hz",
            "jerk noise, m/s³",
            "in calm stretches, m/s³",
        ),
        tuple(rows),
        "The last row is the setting chosen. Calm: 5 s in which, and for 2 s before, neither pedals nor request moved; what the "
        "road does is in it.",
    )
    return Section("Where it lies", (chart, table))


def _likelihood(result: Tuning) -> Section:
    """Likelihood along ell, and the ratios."""
    profile = result.profile
    there = np.isfinite(profile.log_likelihood)
    best = profile.found.log_likelihood
    below = (profile.log_likelihood[there] - best) / profile.found.count
    curves = (
        Curve(f"Q and R of {result.begun.name}", profile.ell[there], below, _BEGUN),
        Curve(
            "most likely",
            np.array([profile.best]),
            np.array([0.0]),
            _BEGUN,
            "points",
            width=9,
            text=(f"{profile.best:.2f}",),
        ),
    )
    chart = Chart(
        "Likelihood along the knob", "ell", (Plot("log likelihood a row, below its best", curves, 260),),
        "How well the rows are foreseen, one tick ahead. It is no measure of how well the intention is found.", log_x=True,
    )  # fmt: skip
    parts: list[str | Chart | Table] = [chart]
    if result.blocks < LEAST_BLOCKS:
        parts.append(
            f"How sure the most likely ell is cannot be said: too few blocks of 10 s count ({result.blocks}, "
            f"{LEAST_BLOCKS} are needed)."
        )
    fit = result.noise
    if fit is not None:
        parts.append(_fitted(result.begun.name, fit))
        rows = []
        for r in fit.ratios:
            mark = (
                Mark("good", "told")
                if r.told
                else Mark("open", "not told: any value as small does as well, or as large")
            )
            rows.append(
                (r.name, r.start, r.found, f"× or / {np.exp(r.spread):.2f}" if np.isfinite(r.spread) else "flat", mark)
            )
        parts.append(
            Table(
                ("over R of the accelerometer", "begun with", "found", "standard error", "do the drives tell it"),
                tuple(rows),
            )
        )
        if result.delay is None and result.chosen.slow_delay < _QUICK:
            parts.append(
                f"The delay that came out is {result.chosen.slow_delay:.2f} s. So quick an estimate follows ripples of body and "
                "driveline as if they were intended. Give --delay as well to choose how late it may be."
            )
    return Section("What the rows say", tuple(parts))


def _fitted(begun: str, fit: NoiseFit) -> str:
    """What the fit of Q and R came to, in words."""
    ending = (
        "The search ended by itself."
        if fit.converged
        else "The search did not end by itself: take the values with care."
    )
    return (
        f"Log likelihood {fit.start.log_likelihood:.0f} with {begun}, {fit.found.log_likelihood:.0f} with the "
        f"fitted noise, over {fit.found.count} rows. {ending} The common factor of Q and R is found in closed form "
        f"({fit.found.factor:.3g}) and changes no gain; ell is no parameter beside a free Q and R."
    )


def _innovations(result: Tuning) -> Section:
    """Innovations before and after."""
    charts = []
    for before, after in zip(result.before, result.after, strict=True):
        curves = _white(result.begun.name, before, _BEGUN), _white(result.preset.name, after, _OWN)
        plot = Plot("correlation", curves, 220, (0.0,))
        charts.append(Chart(f"{before.row}: innovations against later ones", "later by, s", (plot,), half=True))
    rows = tuple((b.row, b.scatter, a.scatter) for b, a in zip(result.before, result.after, strict=True))
    table = Table(
        ("row", f"scatter with {result.begun.name}", f"with {result.preset.name}"), rows,
        "Root mean square of the innovations over what the band allows: 1 is right, less is cautious.",
    )  # fmt: skip
    said = (
        "A filter whose noise is right leaves innovations that do not follow one another. During a burst of the driver an "
        "observer with a delay leans to one side, so a slow setting is never white."
    )
    return Section("Innovations before and after", (said, *charts, table))


def _use(result: Tuning, file: str) -> Section:
    """What was chosen, and the command to run."""
    p = result.preset
    rows = (
        ("ell", f"{p.ell:.6g}"),
        ("Q (v, a_i, o_a, j_i)", ", ".join(f"{q:.4g}" for q in p.Q)),
        ("R (accelerometer, speed)", ", ".join(f"{r:.4g}" for r in p.R)),
    )
    vehicle = f" --vehicle {result.vehicle}" if result.vehicle else ""
    told = (
        f"codriver estimate {result.estimator} LOG{vehicle} --preset {file} -o OUT"
        if file
        else f"codriver estimate {result.estimator} LOG{vehicle} --preset {result.begun.name} --ell {p.ell:.4g} -o OUT"
        if result.noise is None
        else "Write the preset with -o FILE.toml, then: codriver estimate ... --preset FILE.toml"
    )
    return Section("How to use it", (Table(("setting", "value"), rows), told))


def _curve(name: str, points: tuple[Point, ...], color: str) -> Curve:
    return Curve(name, np.array([p.delay for p in points]), np.array([p.noise for p in points]), color)


def _points(name: str, points: tuple[Point, ...], color: str, labels: tuple[str, ...]) -> Curve:
    x, y = np.array([p.delay for p in points]), np.array([p.noise for p in points])
    return Curve(name, x, y, color, "points", width=10, text=labels)


def _white(name: str, row: Whiteness, color: str) -> Curve:
    return Curve(name, row.lag, row.correlation, color)


def _ordinal(n: int) -> str:
    return {1: "", 2: "second", 3: "third"}.get(n, f"{n}th")
