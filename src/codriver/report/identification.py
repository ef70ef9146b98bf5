"""Reports of identifications: figures 1 to 3 of the 2017 paper, what was left out, and how sure it is."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from codriver.identify import BrakeFit, GearRatio, PedalFit, RatioFit
from codriver.identify.brake_fit import PARAMETERS
from codriver.identify.brake_verdict import brake_findings
from codriver.identify.pedal import REASONS as PEDAL_REASONS
from codriver.identify.ratio_verdict import ratio_findings
from codriver.identify.usable import REASONS
from codriver.report.document import Chart, Curve, Document, Findings, Mark, Plot, Section, Span, Table
from codriver.signals.grid import Flags
from codriver.vehicles import Vehicle

STRETCH = 120.0  # s of figure 1
MOST_POINTS = 4000  # of figure 3
Row = tuple[str, str, str, str, str, str]
HEAD = ("coefficient", "unit", "value", "sd", "95 % interval", "before")
# Letter: unit to show, factor to it, decimals.
_SHOWN = {"c_b": ("N/bar", 1e5, 2), "kappa_1": ("N", 1.0, 1), "kappa_2": ("kg/m", 1.0, 4), "gamma": ("%", 100.0, 2)}


def brake_rows(fit: BrakeFit, old: Vehicle) -> list[Row]:
    """The coefficients as a table: letter, unit, value, sd, 95 % interval, and what the old vehicle had."""
    rows: list[Row] = []
    for letter, found in fit.coefficients.items():
        unit, factor, digits = _SHOWN[letter]
        value, sd, low, high = (
            f"{x * factor:.{digits}f}" for x in (found.value, found.sd_total, found.low, found.high)
        )
        known = PARAMETERS.get(letter)
        before = f"{old.number(known) * factor:.{digits}f}" if known is not None and known in old else "-"
        name = letter if letter != "kappa_1" or fit.bias_known else "kappa_1 - M d_a"
        rows.append((name, unit, value, sd, f"{low} to {high}", before))
    return rows


def pedal_row(fit: PedalFit, old: Vehicle | None) -> Row:
    """c_r as a row of the same table."""
    before = f"{old.number('pedal_coefficient'):.2f}" if old is not None and "pedal_coefficient" in old else "-"
    return "c_r", "N m", f"{fit.c_r:.2f}", f"{fit.sd:.2f}", f"{fit.low:.2f} to {fit.high:.2f}", before


def ratio_rows(fit: RatioFit, old: Vehicle | None) -> list[Row]:
    """tau/M by gear as rows of the same table."""
    known = old.numbers("transmission") if old is not None and {"transmission", "mass"} <= set(old.parameters) else ()
    rows: list[Row] = []
    for g in fit.gears:
        half = fit.interval_factor * g.sd
        before = f"{known[g.gear - 1] / old.number('mass'):.6f}" if old is not None and g.gear <= len(known) else "-"
        rows.append((
            f"tau/M, gear {g.gear}", "1/(kg m)", f"{g.ratio:.6f}", f"{g.sd:.6f}", f"{g.ratio - half:.6f} to {g.ratio + half:.6f}",
            before,
        ))  # fmt: skip
    return rows


def brake_document(fit: BrakeFit, old: Vehicle, command: str = "") -> Document:
    """The report of `identify_brake`."""
    before = "-" if fit.rmse_old is None else f"{fit.rmse_old:.4f}"
    quality = Table(
        ("RMSE on the validation half", "m/s²"),
        (("these coefficients", f"{fit.rmse:.4f}"), ("the old ones, with the best offset", before),
         ("a constant", f"{fit.rmse_constant:.4f}")),
    )  # fmt: skip
    return Document(
        f"Brake identification: {old.name}",
        "c_b, kappa_1 and kappa_2 by least squares on signals low-passed at 5 Hz: the first half of the usable data to fit, the "
        "second to validate (2017, section IV-A, doi:10.1109/TMECH.2017.2716838).",
        (
            Section("Result", (
                Table(HEAD, tuple(brake_rows(fit, old)),
                      "sd and interval hold the standard deviations of M and tau, where the vehicle has them."),
                Findings(tuple((f.severity, f.text) for f in brake_findings(fit))), quality,
                "Without a known bias, kappa_1 cannot be told from the accelerometer's bias d_a: what is found is kappa_1 - M d_a. "
                "gamma is how much more acceleration the sensor shows than the wheels, mostly the pitch of the body.",
            )),
            Section("Measured and modelled acceleration", (validation_chart(fit),)),
            Section("How much data it takes", learning_chart(fit)),
            Section("How sure", (
                _correlation(fit),
                f"Neighbouring residuals are alike, so they count for less than their number. Standard errors come from drawing "
                f"{fit.blocks} blocks of {fit.block:.2f} s again and again; Newey and West's formula is the check.",
                Table(("coefficient", "unit", "sd, block bootstrap", "sd, Newey-West", "sd with that of M and tau"), tuple(
                    (c.name, _SHOWN[c.name][0], *(sd * _SHOWN[c.name][1] for sd in (c.sd, c.sd_hac, c.sd_total)))
                    for c in fit.coefficients.values()
                )),
            )),
            Section("What was used", (_masks(fit.share, fit.used_share, REASONS),)),
        ),
        (
            ("recordings", ", ".join(fit.sources)), ("vehicle", old.name), ("fitted on", f"{fit.minutes_fit:.1f} min"),
            ("of them braking", f"{fit.minutes_braking:.1f} min"), ("validated on", f"{fit.minutes_validation:.1f} min"),
        ),
        command,
    )  # fmt: skip


def pedal_document(fit: PedalFit, old: Vehicle | None, command: str = "") -> Document:
    """The report of `identify_pedal`."""
    return Document(
        "Pedal identification" + (f": {old.name}" if old is not None else ""),
        "c_r from the requested torque over the accelerator pedal, T_r = c_r p_r (2017, eq. 8b and figure 3, "
        "doi:10.1109/TMECH.2017.2716838).",
        (
            Section("Result", (
                Table(HEAD, (pedal_row(fit, old),)), Findings(tuple((f.severity, f.text) for f in fit.findings)),
                Table(("RMSE on the validation half", "N m"), (
                    ("this c_r", f"{fit.rmse:.2f}"), ("the old one", "-" if fit.rmse_old is None else f"{fit.rmse_old:.2f}"),
                    ("a constant", f"{fit.rmse_constant:.2f}"),
                )),
            )),
            Section("Requested torque over pedal", (pedal_chart(fit),)),
            Section("What was used", (_masks(fit.share, fit.used_share, PEDAL_REASONS),)),
        ),
        (("recordings", ", ".join(fit.sources)), ("fitted on", f"{fit.minutes_fit:.1f} min"),
         ("validated on", f"{fit.minutes_validation:.1f} min")),
        command,
    )  # fmt: skip


def ratio_document(fit: RatioFit, old: Vehicle | None, command: str = "") -> Document:
    """The report of `identify_ratio`."""
    M = old.number("mass") if old is not None and "mass" in old else None
    turns = tuple(
        (
            str(gear),
            f"{here:.2f}",
            *((_efficiency(g.ratio * M / here),) if M is not None and (g := _of(fit, gear)) else ("-",)),
        )
        for gear, here in fit.engine_turns.items()
    )
    parts: tuple[str | Table | Findings, ...] = (
        Table(HEAD, tuple(ratio_rows(fit, old)), "tau is the ratio times M."),
        Findings(
            tuple((f.severity, f.text) for f in ratio_findings(fit, old))
            if M is not None and old is not None
            else tuple(("warn", f"gear {gear} is refused: {why}") for gear, why in fit.refused.items())
        ),
        f"RMS of the fit {fit.residual:.4f} m/s² on {fit.seconds / 60:.1f} min with the brake released.",
        "The accelerometer's gain error, mostly pitch, cannot be told on roads so level: it is in the ratios."
        if fit.gain is None
        else f"The accelerometer's gain error is taken out: {fit.gain[0]:.1%}, standard error {fit.gain[1]:.1%}.",
    )
    if turns:
        parts = (*parts, Table(("gear", "engine speed over speed, 1/m", "tau over it (0.8 to 1 is right)"), turns))
    return Document(
        "Ratio identification" + (f": {old.name}" if old is not None else ""),
        "tau/M by gear from drives with the brake released (2017, eq. 19 per unit of mass, doi:10.1109/TMECH.2017.2716838).",
        (Section("Result", parts), Section("What was used", (_masks(fit.share, None, REASONS),))),
        (("recordings", ", ".join(fit.sources)), ("used", f"{fit.seconds / 60:.1f} min")),
        command,
    )


def _of(fit: RatioFit, gear: int) -> GearRatio | None:
    return next((g for g in fit.gears if g.gear == gear), None)


def _efficiency(share: float) -> Mark:
    return Mark("good" if 0.8 <= share <= 1.02 else "bad", f"{share:.2f}")


def validation_chart(fit: BrakeFit) -> Chart:
    """[y1]_F and a_ID over the stretch of the validation half that brakes most."""
    rows = fit.rows
    n = min(round(STRETCH / rows.dt), rows.time.size)
    total = np.concatenate([[0], np.cumsum(fit.validated & rows.pressed)])
    there = np.concatenate([[0], np.cumsum(fit.validated)])
    log = rows.log_of
    starts = np.arange(rows.time.size - n + 1)
    whole = (log[starts] == log[starts + n - 1]) & (there[starts + n] - there[starts] > 0.6 * n)
    start = int(np.argmax(np.where(whole, total[starts + n] - total[starts], -1)))
    part = slice(start, start + n)
    time = rows.time[part]
    other = ~rows.keep[part] & ~rows.shifting[part]
    spans = [
        Span(a, b, kind)
        for kind, mask in (("braking", rows.pressed[part]), ("gear_shift", rows.shifting[part]), ("other", other))
        for a, b in _stretches(mask, time, rows.dt)
    ]
    return Chart(
        "Figure 1: measured [y1]_F and modelled a_ID, validation half", "time (s)",
        (Plot("acceleration (m/s²)", (
            Curve("[y1]_F, accelerometer", time, rows.y[part], "#1a1a1a"),
            Curve("a_ID, from torque, pressure and speed", time, fit.model[part], "#C84C00"),
        ), 300, (0.0,)),),
        "Pink: braking; blue: gear shifts, which are left out with a second after them, for the driveline rings; grey: left "
        "out for another reason. The two curves should lie on one another outside the blue.",
        tuple(spans),
    )  # fmt: skip


def learning_chart(fit: BrakeFit) -> tuple[Chart | str, ...]:
    """Coefficient and validation error against minutes."""
    points = [p for p in fit.curve if np.isfinite(p.value)]
    c_b = fit.coefficients.get("c_b")
    if not points or c_b is None:
        return ("c_b was not found, so there is no curve.",)
    minutes, value, sd, rmse = (
        np.array([getattr(p, key) for p in points]) for key in ("minutes", "value", "sd", "rmse")
    )
    factor = _SHOWN["c_b"][1]
    final = c_b.value * factor
    return (Chart(
        "Figure 2: c_b and the validation RMSE against identification data", "usable identification data (min)",
        (
            Plot("c_b (N/bar)", (
                Curve("c_b and 95 % interval", minutes, value * factor, low=(value - 1.96 * sd) * factor,
                      high=(value + 1.96 * sd) * factor),
            ), 240, (0.95 * final, 1.05 * final), limits=(0.85 * final, 1.15 * final)),
            Plot("RMSE (m/s²)", (Curve("validation RMSE", minutes, rmse, "#007A5A"),), 160,
                 limits=(0.0, 3 * float(rmse[-1]))),
        ),
        "Dotted: 5 % around the final value. Where c_b has come to rest within them, more data of the same kind would add little.",
    ),)  # fmt: skip


def pedal_chart(fit: PedalFit) -> Chart:
    """Request over pedal, with the line."""
    rows = np.flatnonzero(fit.fitted | fit.validated)
    rows = rows[:: max(rows.size // MOST_POINTS, 1)]
    line = np.array([0.0, float(fit.pedal[rows].max())])
    return Chart(
        "Figure 3: requested torque over accelerator pedal", "pedal (%)",
        (Plot("requested torque (N m)", (
            Curve("measured, low-passed at 5 Hz", 100 * fit.pedal[rows], fit.request[rows], "#0072B2", "points", width=3,
                  faint=True),
            Curve(f"T_r = {fit.c_r:.1f} N m p_r", 100 * line, fit.c_r * line, "#C84C00", width=2.0),
        ), 360),),
        f"R2 {fit.r2:.4f}. Points that leave the line in a bundle are a controller's work; a cloud around a curve is a pedal map "
        "that is not linear.",
    )  # fmt: skip


def _correlation(fit: BrakeFit) -> Chart:
    """Autocorrelation of the residuals."""
    return Chart(
        "Autocorrelation of the residuals", "lag (s)",
        (Plot("correlation", (Curve("residuals of the fit", fit.lags, fit.correlation),), 180, (0.0,)),),
        "How long a residual resembles those before it. The blocks of the bootstrap must be longer than that.",
    )  # fmt: skip


def _masks(share: Mapping[str, float], used: float | None, words: Mapping[str, str]) -> Table:
    """What was left out, and why."""
    rows = [(words[reason], f"{part:.1%}") for reason, part in share.items()]
    if used is not None:
        rows.append(("used, of all", f"{used:.1%}"))
    return Table(("left out", "share of the time"), tuple(rows), "One moment can have several reasons.")


def _stretches(mask: Flags, time: np.ndarray, dt: float) -> list[tuple[float, float]]:
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    return [(float(time[i]), float(time[k - 1]) + dt) for i, k in zip(edges[::2], edges[1::2], strict=True)]
