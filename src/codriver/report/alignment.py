"""Report of a car's alignment map identified from a measured torque."""

from __future__ import annotations

from math import pi
from pathlib import Path

import numpy as np

from codriver.identify import AlignmentFit
from codriver.identify.alignment_drive import Drive
from codriver.identify.alignment_fit import LETTERS
from codriver.models.alignment import GRAVITY
from codriver.report.document import Chart, Curve, Document, Findings, Mark, Part, Plot, Section, Table
from codriver.signals.signal import Array
from codriver.vehicles import Vehicle

Row = tuple[str, str, str, str, str, str]
HEAD = ("coefficient", "unit", "value", "sd", "95 % interval", "before")
# letter: unit shown, factor from SI, digits
SHOWN = {
    "k_a": ("N m per m/s²", 1.0, 3), "T_s": ("N m", 1.0, 3), "T_0": ("N m", 1.0, 3), "e_max": ("%", 100.0, 2),
    "q": ("1", 1.0, 3), "b_s": ("N m s/rad", 1.0, 3), "T_c": ("N m", 1.0, 3), "w": ("deg", 180 / pi, 3),
}  # fmt: skip
MOST_POINTS = 6000
CLOUD = 3000
SPEEDS = (5.0, 10.0, 20.0, 30.0)  # m/s


def alignment_rows(fit: AlignmentFit, old: Vehicle | None) -> list[Row]:
    """The coefficients: letter, unit, value, sd, 95 % interval, and what the old vehicle had."""
    rows: list[Row] = []
    for letter, c in fit.coefficients.items():
        unit, factor, digits = SHOWN[letter]
        name = LETTERS[letter][1]
        before = f"{factor * old.number(name):.{digits}f}" if old is not None and name in old else "-"
        value, sd, low, high = (f"{factor * x:.{digits}f}" for x in (c.value, c.sd, c.low, c.high))
        rows.append((letter, unit, value, sd, f"{low} to {high}", before))
    return rows


def alignment_document(fit: AlignmentFit, old: Vehicle | None, command: str = "") -> Document:
    """The report of `identify_alignment`."""
    usual = tuple(
        (
            r.name,
            SHOWN[r.name][0],
            f"{SHOWN[r.name][1] * getattr(fit.model, LETTERS[r.name][0]):.{SHOWN[r.name][2]}f}",
            r.reason,
        )
        for r in fit.refused
    )
    parts: list[Part] = [
        Table(HEAD, tuple(alignment_rows(fit, old)), "k_a alignment gain, T_s bend by the assist, T_0 torque at the angle 0, e_max "
              "greatest bank, q its share, b_s damping, T_c friction, w its width.")
    ]  # fmt: skip
    if usual:
        parts.append(Table(("not told", "unit", "usual value", "why"), usual))
    parts.append(Findings(tuple((f.severity, f.text) for f in fit.findings)))
    facts = [
        ("drives", ", ".join(Path(d.source).name for d in fit.drives)), ("length", f"{fit.minutes:.1f} min"),
        ("RMSE, R² of the fit", f"{fit.rmse:.3f} N m, {fit.r2:.3f}"),
        ("torque ahead of the angle", f"{1000 * fit.lead:.0f} ms"),
    ]  # fmt: skip
    if fit.held.whole is not None:
        facts.append(("held out", f"{fit.held.whole.rmse['map']:.3f} N m, {fit.held.whole.r2['map']:.3f}"))
        facts.append(("correlation time of the error", f"{fit.held.time:.1f} s"))
    return Document(
        "Alignment torque identification" + (f": {old.name}" if old is not None else ""),
        "What tyres, banked roads, assist and friction do to the steering column, as the hands feel it: a map from angle and speed "
        "fitted to a measured torque.",
        (
            Section("Result", tuple(parts)),
            Section("On what it has not seen", _held(fit)),
            Section("Torque over lateral acceleration", (_map(fit), _banks(fit))),
            Section("Measured and modelled torque", tuple(_along(fit, k) for k in range(len(fit.drives)))),
        ),
        tuple(facts), command,
    )  # fmt: skip


def _held(fit: AlignmentFit) -> tuple[Part, ...]:
    """The map beside the regression and the mean."""
    if fit.held.whole is None:
        return ("The drive is too short to leave anything out.",)
    rows: list[tuple[str | float | Mark | None, ...]] = []
    for h in (*fit.held.parts, fit.held.whole):
        better = h.rmse["map"] <= 1.02 * h.rmse["regression"]
        verdict = Mark("good", "no worse") if better else Mark("bad", "worse")
        rows.append((h.name, h.seconds, *(x for way in h.rmse for x in (h.rmse[way], h.r2[way])), verdict))
    what = (
        "Each drive was left out in turn."
        if fit.held.by_drive
        else "Each block was left out in turn, with 5 s on both sides."
    )
    return (
        Table(
            ("left out", "s", "map: N m", "R²", "regression: N m", "R²", "mean: N m", "R²", "map against regression"),
            tuple(rows), f"Root mean square errors. {what} The regression has nine features (docs/alignment.md).",
        ),
    )  # fmt: skip


def _map(fit: AlignmentFit) -> Chart:
    """The torque over what the tyres give, and the fitted map."""
    clouds, most = [], 1.0
    for drive, colour in zip(fit.drives, ("#0072B2", "#007A5A", "#E69F00", "#8E2F86") * len(fit.drives), strict=False):
        use = np.flatnonzero(drive.keep)[:: max(int(drive.keep.sum()) // CLOUD, 1)]
        force = drive.lateral - GRAVITY * fit.model.road_bank(drive.road_curvature, drive.road_speed)
        rubbing = fit.model.friction({"presliding": drive.presliding(fit.model)}, drive.rate)
        clouds.append(
            Curve(
                Path(drive.source).name,
                force[use],
                (drive.torque - rubbing)[use],
                colour,
                "points",
                width=3,
                faint=True,
            )
        )
        most = max(most, float(np.abs(force[use]).max()))
    x = np.linspace(-most, most, 200)
    return Chart(
        "The map", "lateral acceleration that the tyres give, v² κ - g e (m/s²)",
        (Plot("torque less friction (N m)", (*clouds, Curve("map", x, -fit.model.felt(x), "#C84C00", width=2.5)), 340),),
        "Points: measured torque less modelled friction. The bank e is the model's.",
    )  # fmt: skip


def _banks(fit: AlignmentFit) -> Chart:
    """The modelled torque of a steady turn over the angle, at several speeds."""
    most = max(float(np.percentile(np.abs(d.angle[d.keep]), 99)) for d in fit.drives)
    angle, curves = np.linspace(-most, most, 200), []
    fastest = max(float(d.speed[d.keep].max()) for d in fit.drives)
    for speed in [s for s in SPEEDS if s <= fastest + 5]:
        kappa = fit.model.curvature(angle, speed)
        for road, dash in ((speed, "solid"), (max(fastest, speed), "dash")):
            force = speed * speed * kappa - GRAVITY * fit.model.road_bank(kappa, road)
            colour = ("#0072B2", "#C84C00", "#007A5A", "#8E2F86")[SPEEDS.index(speed)]
            name = f"{3.6 * speed:.0f} km/h" if dash == "solid" else ""
            curves.append(Curve(name, angle * 180 / pi, -fit.model.felt(force), colour, dash=dash))
    return Chart(
        "Steady turns at several speeds", "angle of the wheel (deg)", (Plot("torque (N m)", tuple(curves), 300, (0.0,)),),
        f"Solid: on a road made for that speed. Dashed: on one for {3.6 * fastest:.0f} km/h, whose bank pulls a slow car inwards.",
    )  # fmt: skip


def _along(fit: AlignmentFit, k: int) -> Chart:
    """Measured and modelled torque of a drive, what is left over, and what it came from."""
    drive: Drive = fit.drives[k]
    step = max(drive.time.size // MOST_POINTS, 1)
    time = (drive.time - drive.time[0])[::step]
    said = fit.held.predicted[k] if fit.held.whole is not None else fit.answers[k]

    def shown(x: Array) -> Array:
        return np.asarray(np.where(drive.keep, x, np.nan)[::step])

    return Chart(
        Path(drive.source).name or f"drive {k + 1}", "time (s)",
        (
            Plot("torque (N m)", (
                Curve("measured", time, shown(drive.torque), "#757575", width=2.5), Curve("map", time, shown(said), "#C84C00"),
            ), 260),
            Plot("measured - map (N m)", (Curve("", time, shown(drive.torque - said), "#0072B2"),), 140, (0.0,)),
            Plot("angle (deg)", (
                Curve("", time, shown(drive.angle) * 180 / pi, "#007A5A"),
                Curve("speed, right", time, shown(drive.speed) * 3.6, "#1a1a1a", right=True),
            ), 160, (0.0,), "speed (km/h)"),
        ),
        "The map was fitted without what is shown." if fit.held.whole is not None else "The map was fitted to what is shown.",
    )  # fmt: skip
