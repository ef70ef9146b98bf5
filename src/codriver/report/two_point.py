"""Report of a two-point driver identified from drives."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from codriver.identify.driver_fit import TOLD
from codriver.identify.driver_record import DriverRecord
from codriver.identify.driver_result import WORDS, DriverFit
from codriver.identify.driver_verdict import driver_findings, error_correlation
from codriver.identify.standard_errors import Index
from codriver.models.two_point_file import LETTERS, FiledDriver
from codriver.report.document import GREY, Chart, Curve, Document, Findings, Mark, Part, Plot, Section, Table
from codriver.signals.signal import Array

HEAD = ("parameter", "", "unit", "value", "se", "95 % interval", "told")
MOST_POINTS = 4000
SHOWN = 90.0  # s of the torque in detail
BLUE, RED, GREEN = "#0072B2", "#C84C00", "#007A5A"


def two_point_rows(fit: DriverFit, beside: FiledDriver | None = None) -> list[tuple[str, ...]]:
    """Parameters as rows of HEAD, and, where another driver stands beside, his value and how many standard errors it is off."""
    rows: list[tuple[str, ...]] = []
    for name, (letter, unit) in LETTERS.items():
        p = fit.parameters.get(name)
        if p is not None:
            row = (f"{p.value:.4g}", f"{p.sd:.2g}", f"{p.low:.4g} to {p.high:.4g}", "yes")
        elif name in fit.given:
            row = (f"{fit.given[name]:.4g}", "-", "-", "given")
        else:
            row = ("-", "-", "-", "no")
        rows.append((name, "" if letter == name else letter, unit, *row))
        if beside is None:
            continue
        other = beside.parameters[name].value
        # Intervals are even in the logarithm, and so is what is off.
        off = None if p is None or other is None or not other > 0 else np.log(p.value / other) / (p.sd / p.value)
        rows[-1] += ("-" if other is None else f"{other:.4g}", "-" if off is None else f"{off:+.1f}")
    return rows


def two_point_document(fit: DriverFit, beside: FiledDriver | None = None, command: str = "") -> Document:
    """The report of `identify_driver`.

    Args:
        fit: what was found.
        beside: another driver to compare with, such as the one who drove a simulation.
        command: that made it.
    """
    head = HEAD if beside is None else (*HEAD, beside.name, "off, se")
    caption = (
        "Intervals are even in the logarithm. They hold what was known before the drive, a factor of 1.6 either way, so that the "
        "doubt about what is not told is in them."
    )
    result: list[Part] = [
        Table(head, tuple(two_point_rows(fit, beside)), caption),
        Findings(tuple((f.severity, f.text) for f in driver_findings(fit))),
    ]
    if fit.found is not None:
        result.append(_bars(fit, beside))
    if any(d.holes for d in fit.drives):
        result.append(_pieces(fit))
    sections = [
        Section("Result", tuple(result)),
        Section("Measured and modelled torque", tuple(c for k in range(len(fit.records)) for c in _torque(fit, k))),
    ]
    if fit.path is not None:
        sections.append(Section("Parameters over time, by dual EKF", (_path(fit, beside),)))
    if fit.found is not None:
        sections.append(Section("What is left over", (_correlation(fit), _errors(fit))))
        sections.append(Section("What the drives do not tell", _untold(fit)))
    return Document(
        "Two-point driver identification",
        "Parameters of a driver who steers by torque, by what he saw of a near and a far point of the road: a gain of anticipation "
        "and one of compensation, a delay, and arms (Sentouh et al. 2009, Saleh et al. 2013).",
        tuple(sections),
        (
            ("drives", ", ".join(Path(d.source).name for d in fit.drives)), ("by", WORDS[fit.by]),
            ("length", f"{fit.seconds / 60:.1f} min"), ("speed", fit.speeds_told()),
            ("left unexplained", f"{fit.rms:.3g} N m"), ("explained of the torque's variance", f"{100 * fit.explained:.1f} %"),
            ("error one tick ahead", f"{fit.one_step:.3g} N m in {1000 * fit.tick:.0f} ms"),
        ),
        command,
    )  # fmt: skip


def _bars(fit: DriverFit, beside: FiledDriver | None) -> Chart:
    """Values with intervals, over what was known before the drive."""
    assert fit.found is not None
    before = np.array([max(getattr(fit.known, n), 1e-3) for n in fit.names])
    value = np.exp(fit.found.theta)
    sd = np.sqrt(np.maximum(fit.found.plain.diagonal(), fit.found.robust.diagonal()))
    low, high = value * np.exp(-1.96 * sd), value * np.exp(1.96 * sd)
    labels = [LETTERS[n][0] + ("" if n in fit.parameters else ", not told") for n in fit.names]
    curves = [Curve("found", labels, value / before, "#8FB8D4", "bars", low=low / before, high=high / before)]
    if beside is not None:
        other = np.array([beside.parameters[n].value or np.nan for n in fit.names])
        curves.append(Curve(beside.name, labels, other / before, RED, "points", width=9))
    return Chart(
        "Values with 95 % intervals, over what was known before the drive", "",
        (Plot("over the value given before", tuple(curves), 260, (1.0,)),),
        f"Not told: the doubt left is more than {TOLD:g} of that before the drive, or the value is far from all that was known.",
    )  # fmt: skip


def _pieces(fit: DriverFit) -> Table:
    """What became of the pieces of drives with holes."""
    rows: list[tuple[str, ...]] = []
    for drive in fit.drives:
        name = Path(drive.source).name
        made = [(a, b, "yes") for a, b in drive.spans] + [(p.start, p.stop, f"no: {p.why}") for p in drive.left_out]
        rows += [(name, f"{a:.1f}", f"{b:.1f}", said) for a, b, said in sorted(made)]
    return Table(
        ("drive", "from, s", "to, s", "used"),
        tuple(rows),
        "Drives are cut where a signal has a hole; each piece settles anew.",
    )


def _torque(fit: DriverFit, record: int) -> tuple[Chart, ...]:
    """Measured torque, the model's, and the rest, over a drive; and the first stretch of a long one in detail."""
    r, made = fit.records[record], fit.torque(record)
    rows = np.arange(r.first, r.last)
    rows = rows[:: max(rows.size // MOST_POINTS, 1)]
    part = np.arange(r.first, min(r.first + round(SHOWN / r.dt), r.last))
    part = part[:: max(part.size // MOST_POINTS, 1)]
    offset = float((r.torque - made)[r.first : r.last].mean())
    title = Path(r.source).name or f"drive {record + 1}"

    def both(use: Index) -> tuple[Curve, Curve]:
        return (
            Curve("measured", _seconds(r, use), r.torque[use], GREY, width=2.5),
            Curve("model", _seconds(r, use), made[use] + offset, RED),
        )

    whole = Chart(
        title, "time (s)",
        (
            Plot("torque (N m)", both(rows), 240),
            Plot("measured - model (N m)", (Curve("", _seconds(r, rows), (r.torque - made)[rows] - offset, BLUE),), 160, (0.0,)),
        ),
        f"The model's torque comes from what the driver saw and the wheel's angle, without any measured torque; a constant of "
        f"{offset:+.3f} N m is added.",
    )  # fmt: skip
    if (r.last - r.first) * r.dt < 1.5 * SHOWN:
        return (whole,)
    return whole, Chart(f"{title}, its first {SHOWN:g} s", "time (s)", (Plot("torque (N m)", both(part), 240),))


def _seconds(r: DriverRecord, rows: Index) -> Array:
    return np.asarray(r.start + r.dt * rows, float)


def _path(fit: DriverFit, beside: FiledDriver | None) -> Chart:
    """Parameters over time with their standard deviations."""
    assert fit.path is not None
    step = max(fit.path.time.size // MOST_POINTS, 1)
    time = fit.path.time[::step]
    plots = []
    for k, name in enumerate(fit.path.names):
        value, sd = fit.path.values[::step, k], fit.path.sd[::step, k]
        curves = [Curve("one standard deviation" if k == 0 else "", time, value, BLUE, low=value - sd, high=value + sd)]
        other = None if beside is None else beside.parameters[name].value
        if other is not None and beside is not None:
            curves.append(Curve(beside.name if k == 0 else "", time, np.full(time.size, other), RED, dash="dash"))
        letter, unit = LETTERS[name]
        plots.append(Plot(f"{letter} ({unit})", tuple(curves), 110))
    return Chart("Parameters tick by tick", "time (s)", tuple(plots))


def _correlation(fit: DriverFit) -> Chart:
    lags, rho, bound = error_correlation(fit)
    return Chart(
        "Autocorrelation of the errors one tick ahead", "lag (s)",
        (Plot("correlation", (Curve("", lags, rho, BLUE, "bars"),), 200, (-bound, 0.0, bound)),),
        "Dotted: where 95 % of them lie if nothing is left to foretell.", half=True,
    )  # fmt: skip


def _errors(fit: DriverFit) -> Chart:
    assert fit.found is not None
    e = fit.found.errors
    step = max(e.size // MOST_POINTS, 1)
    return Chart(
        "Errors one tick ahead", "time over all drives (s)",
        (Plot("error (N m)", (Curve("", fit.tick * np.arange(0.0, e.size, step), e[::step], GREEN, "points", width=3, faint=True),),
              200, (0.0,)),),
        f"{fit.one_step:.3g} N m rms, ticks of {1000 * fit.tick:.0f} ms.", half=True,
    )  # fmt: skip


def _untold(fit: DriverFit) -> tuple[Part, ...]:
    """Refusals, what is confused with what, and what was taken for granted."""
    parts: list[Part] = []
    if fit.refused:
        rows = tuple(
            (r.name, LETTERS[r.name][0], f"{getattr(fit.known, r.name):.4g} {LETTERS[r.name][1]}".removesuffix(" 1"), r.reason)
            for r in fit.refused
        )  # fmt: skip
        parts.append(Table(("not told", "", "given before", "why"), rows, "Who drives with the file chooses whether to take "
                           "these: codriver simulate circuit --driver FILE --given NAMES."))  # fmt: skip
    else:
        parts.append("Nothing that was asked for.")
    if len(fit.names) > 1:
        letters = tuple(LETTERS[n][0] for n in fit.names)
        parts.append(Table(
            ("correlation of the estimates", *letters),
            tuple((a, *(_cell(float(x), i == k) for k, x in enumerate(row)))
                  for i, (a, row) in enumerate(zip(letters, fit.correlation, strict=True))),
            "Two that are above 0.9 in size can hardly be told from one another.",
        ))  # fmt: skip
    taken = ", ".join(f"{n} ({LETTERS[n][0]}) {x:g} {LETTERS[n][1]}".removesuffix(" 1") for n, x in fit.given.items())
    parts.append(
        f"Taken as given: {taken}. At one speed only K_r v + K_t shows, so K_p and K_c are those for "
        "the K_r given; drives at two speeds tell it."
    )
    return tuple(parts)


def _cell(x: float, own: bool) -> str | Mark:
    if own:
        return "1"
    return Mark("bad", f"{x:+.2f}") if abs(x) > 0.9 else f"{x:+.2f}"
