"""Reports of a steering wheel identified, and of the weights hung on one."""

from __future__ import annotations

from math import pi

import numpy as np

from codriver.identify import SteeringFit, TorqueScale
from codriver.identify.steering_passes import Passes
from codriver.identify.steering_result import PARAMETERS
from codriver.report.document import Chart, Curve, Document, Findings, Mark, Part, Plot, Section, Span, Table
from codriver.vehicles import Vehicle

Row = tuple[str, str, str, str, str, str]
SHOWN = 40.0  # s of the angle
MOST_POINTS = 2000
LETTERS = {"J_s": ("kg m²", 5), "b_s": ("N m s/rad", 4), "T_c": ("N m", 3), "T_0": ("N m", 3)}
DEGREE = pi / 180


def steering_rows(fit: SteeringFit, old: Vehicle | None) -> list[Row]:
    """The coefficients: letter, unit, value, sd, 95 % interval, and what the old vehicle had."""
    rows: list[Row] = []
    for letter, c in fit.coefficients.items():
        unit, digits = LETTERS[letter]
        known = PARAMETERS.get(letter)
        before = f"{old.number(known):.{digits}f}" if old is not None and known is not None and known in old else "-"
        value, sd, low, high = (f"{x:.{digits}f}" for x in (c.value, c.sd, c.low, c.high))
        rows.append((letter, unit, value, sd, f"{low} to {high}", before))
    return rows


def scale_rows(fit: TorqueScale, old: Vehicle | None) -> list[Row]:
    """Scale and offset as rows of the same table."""
    before = f"{old.number('torque_scale'):.4f}" if old is not None and "torque_scale" in old else "-"
    half = (fit.high - fit.low) / 2 / fit.sd_scale * fit.sd_offset if fit.sd_scale > 0 else 0.0
    between = f"{fit.offset - half:.4f} to {fit.offset + half:.4f}"
    return [
        ("torque_scale", "N m", f"{fit.scale:.4f}", f"{fit.sd_scale:.4f}", f"{fit.low:.4f} to {fit.high:.4f}", before),
        ("torque_offset", "N m", f"{fit.offset:.4f}", f"{fit.sd_offset:.4f}", between, "-"),
    ]  # fmt: skip


def steering_document(fit: SteeringFit, old: Vehicle | None, command: str = "") -> Document:
    """The report of `identify_steering_wheel`."""
    head = ("coefficient", "unit", "value", "sd", "95 % interval", "before")
    parts: tuple[Part, ...] = (
        Table(
            head,
            tuple(steering_rows(fit, old)),
            "T_0, a constant torque, does not go into the vehicle file." if "T_0" in fit.coefficients else "",
        ),
        Findings(tuple((f.severity, f.text) for f in fit.findings)),
    )
    comparison: tuple[Section, ...] = ()
    if fit.filters:
        comparison = (Section("Beside the paper's filters", (_compared(fit), *(_path(fit, p) for p in fit.filters))),)
    return Document(
        "Steering wheel identification" + (f": {old.name}" if old is not None else ""),
        "J_s and b_s of a wheel that its motor turns, by prediction errors over the whole record; beside it the joint EKF and UKF "
        "of Okamoto and Tsiotras 2019 (Robotics and Autonomous Systems, algorithm 1).",
        (
            Section("Result", parts),
            Section("Measured and simulated angle", (_angle(fit), _torque(fit))),
            Section("What is left over", (_correlation(fit), _innovations(fit))),
            Section("What the recording excites", (_excitation(fit),)),
            *comparison,
        ),
        (
            ("recording", fit.source), ("torque", fit.torque_from), ("length", f"{fit.seconds:.1f} s"),
            ("R² of the angle 2 s ahead", f"{fit.r2:.4f}"), ("encoder noise", f"{fit.encoder_sd / DEGREE:.3g} deg"),
            ("delay of the torque", f"{fit.delay * 1000:.0f} ms"), ("left out", f"{fit.left_out:.1%}"),
        ),
        command,
    )  # fmt: skip


def torque_scale_document(fit: TorqueScale, old: Vehicle | None, command: str = "") -> Document:
    """The report of `identify_torque_scale`."""
    ends = np.array([fit.command.min(), fit.command.max()])
    chart = Chart(
        "Torque of the weights over the command that holds them", "command",
        (Plot("torque (N m)", (
            Curve("weighings", fit.command, fit.torque, "#0072B2", "points", width=6),
            Curve(f"{fit.scale:.4f} T_com {fit.offset:+.4f} N m", ends, fit.scale * ends + fit.offset, "#C84C00"),
        ), 320),),
        f"R² {fit.r2:.5f}; a weighing lies {fit.residual:.2g} N m (standard deviation) off the line, a parabola at most "
        f"{fit.curvature:.2g} N m.",
    )  # fmt: skip
    head = ("coefficient", "unit", "value", "sd", "95 % interval", "before")
    return Document(
        "Torque scale" + (f": {old.name}" if old is not None else ""),
        "From the motor's command to torque, by weights hung on the wheel (Okamoto, Tsiotras 2019, eq. 89).",
        (Section("Result", (Table(head, tuple(scale_rows(fit, old))), chart)),),
        (("weighings", str(fit.command.size)), ("source", fit.source)),
        command,
    )


def _angle(fit: SteeringFit) -> Chart:
    """Angle, measured and from the torque alone."""
    time = fit.rows.time - fit.rows.time[0]
    show = time <= SHOWN
    there = show & fit.rows.fresh
    return Chart(
        "Angle of the wheel", "time (s)",
        (
            Plot("angle (deg)", (
                Curve("measured", time[there], fit.rows.angle[there] / DEGREE, "#757575", width=3.0),
                Curve("from the torque alone", time[show], fit.simulated[show] / DEGREE, "#C84C00"),
            ), 260),
            Plot("measured - simulated (deg)", (
                Curve("", time[there], (fit.rows.angle - fit.simulated)[there] / DEGREE, "#0072B2"),
            ), 140, (0.0,)),
        ),
        "The simulation starts anew every 2 s from the filter's state and sees no angle in between. Grey: left out.",
        _left_out(fit),
    )  # fmt: skip


def _torque(fit: SteeringFit) -> Chart:
    """The motor's torque, and where it goes."""
    time = fit.rows.time - fit.rows.time[0]
    show = time <= SHOWN
    theta, rate = fit.best.theta, fit.best.run.rate
    against = np.exp(theta[1]) * rate + theta[2] * np.sign(rate)
    return Chart(
        "Torque of the motor, and what it does", "time (s)",
        (Plot("torque (N m)", (
            Curve("motor", time[show], fit.rows.torque[show], "#1a1a1a"),
            Curve("damping and friction", time[show], against[show], "#007A5A"),
            Curve("left to accelerate the wheel", time[show], (fit.rows.torque + theta[3] - against)[show], "#0072B2"),
        ), 220),),
    )  # fmt: skip


def _correlation(fit: SteeringFit) -> Chart:
    """Autocorrelation of the innovations."""
    limit = 1.96 / np.sqrt(max(float(fit.best.run.counts.sum()), 1.0))
    return Chart(
        "Autocorrelation of the innovations", "lag (s)",
        (Plot("correlation", (Curve("normalised innovations", fit.lags[1:], fit.correlation[1:], kind="bars"),), 180,
              (-limit, 0.0, limit)),),
        "Dotted: where 95 % of them lie if the model leaves nothing out.", half=True,
    )  # fmt: skip


def _innovations(fit: SteeringFit) -> Chart:
    """Normalised innovations over time."""
    use = np.flatnonzero(fit.best.run.counts)
    use = use[:: max(use.size // MOST_POINTS, 1)]
    e = fit.best.run.e[use] / np.sqrt(fit.best.run.s[use])
    return Chart(
        "Innovations, in their own standard deviations", "time (s)",
        (Plot("e / sd", (Curve("", fit.rows.time[use] - fit.rows.time[0], e, "#0072B2", "points", width=3, faint=True),), 180,
              (-1.96, 0.0, 1.96)),),
        f"Mean square {fit.nis:.3f}; 1 by the choice of the noise.", half=True,
    )  # fmt: skip


def _excitation(fit: SteeringFit) -> Table:
    """Where the torque goes."""
    x = fit.excitation
    why = {r.name: Mark("bad", r.reason) for r in fit.refused}
    fine = Mark("good", "told")
    rubbing = fine if "T_c" in fit.coefficients else Mark("open", "not in the model")
    return Table(
        ("part of the torque", "RMS, N m", "coefficient"),
        (
            ("motor", x.torque, None),
            ("J_s times acceleration", x.inertia, why.get("J_s", fine)),
            ("b_s times rate", x.damping, why.get("b_s", fine)),
            ("friction while slipping", x.friction, why.get("T_c", rubbing)),
            ("unexplained, over 0.1 s", x.unexplained, None),
        ),
        f"Rate {x.rate:.3g} rad/s RMS, {x.turns} reversals; correlation of the estimates of J_s and b_s {x.correlation:.3f}.",
    )  # fmt: skip


def _compared(fit: SteeringFit) -> Table:
    """All three ways side by side."""
    rows: list[tuple[str | float | Mark | None, ...]] = []
    found = fit.coefficients
    rows.append((
        "prediction errors", found["J_s"].value if "J_s" in found else None, found["J_s"].sd if "J_s" in found else None,
        found["b_s"].value if "b_s" in found else None, found["b_s"].sd if "b_s" in found else None, fit.nis,
        Mark("good", "converged") if fit.best.converged else Mark("bad", "did not come to rest"),
    ))  # fmt: skip
    for p in fit.filters:
        last = p.passes[-1]
        said = Mark("good", f"converged in pass {len(p.passes)}") if p.converged else Mark("bad", last.why_not)
        numbers = last.values[0], last.sds[0], last.values[1], last.sds[1], last.nis
        rows.append((p.name, *(x if np.isfinite(x) else None for x in numbers), said))
    return Table(
        ("way", "J_s, kg m²", "sd", "b_s, N m s/rad", "sd", "NIS", ""), tuple(rows),
        "The filters start from the guess, or else from what the fit found. They have the paper's noise (85), no friction and no "
        "constant torque; their sd is what they claim. NIS far below 1: they expect more noise than there is.",
    )  # fmt: skip


def _path(fit: SteeringFit, p: Passes) -> Chart:
    """J_s and b_s along the last pass, as figures 2 and 3 of the paper."""
    last = p.passes[-1]
    step = max(last.path.shape[0] // MOST_POINTS, 1)
    time = (fit.rows.time - fit.rows.time[0])[::step]
    plots = []
    for i, (letter, unit) in enumerate((("J_s", "kg m²"), ("b_s", "N m s/rad"))):
        value, sd = last.path[::step, i], last.path_sd[::step, i]
        curves = [Curve(f"{p.name}, one standard deviation", time, value, low=value - sd, high=value + sd)]
        if letter in fit.coefficients:
            final = np.full(time.size, fit.coefficients[letter].value)
            curves.append(Curve("prediction errors", time, final, "#C84C00", dash="dash"))
        middle = fit.coefficients[letter].value if letter in fit.coefficients else float(np.nanmedian(value))
        plots.append(Plot(f"{letter} ({unit})", tuple(curves), 180, limits=(0.0, 2 * abs(middle))))
    return Chart(f"{p.name}: the last pass", "time (s)", tuple(plots), half=True)


def _left_out(fit: SteeringFit) -> tuple[Span, ...]:
    """Stretches at which the filter started anew."""
    time = fit.rows.time - fit.rows.time[0]
    edges = np.flatnonzero(np.diff(np.r_[False, fit.rows.reset & (time <= SHOWN), False]))
    last = time.size - 1
    return tuple(
        Span(float(time[a]), float(time[min(b, last)]), "other") for a, b in zip(edges[::2], edges[1::2], strict=True)
    )
