"""Report of K_aln of eq. (92): the torque over the front slip angle."""

from __future__ import annotations

import numpy as np

from codriver.identify.alignment_stiffness import StiffnessFit
from codriver.report.document import Chart, Curve, Document, Findings, Plot, Section, Table
from codriver.vehicles import Vehicle

HEAD = ("coefficient", "unit", "value", "sd", "95 % interval", "before")
CLOUD = 4000
DEGREE = np.pi / 180


def stiffness_rows(fit: StiffnessFit, old: Vehicle | None) -> list[tuple[str, ...]]:
    """The coefficient: letter, unit, value, sd, 95 % interval, and what the old vehicle had."""
    name = "alignment_stiffness"
    before = f"{old.number(name):.4g}" if old is not None and name in old else "-"
    return [
        ("K_aln", "N m/rad", f"{fit.stiffness:.5g}", f"{fit.sd:.2g}", f"{fit.low:.5g} to {fit.high:.5g}", before),
        ("T_0", "N m", f"{fit.offset:.3g}", "", "", "-"),
    ]


def stiffness_document(fit: StiffnessFit, old: Vehicle, command: str = "") -> Document:
    """The report of `identify_alignment_stiffness`."""
    step = max(fit.slip.size // CLOUD, 1)
    slip, torque = fit.slip[::step], fit.torque[::step]
    ends = np.array([fit.slip.min(), fit.slip.max()])
    line = fit.stiffness / old.number("steering_ratio") * ends
    chart = Chart(
        "Torque over the front slip angle", "front slip angle (deg)",
        (Plot("torque that turns the wheel back (N m)", (
            Curve("drives", slip / DEGREE, torque, "#56B4E9", "points", width=4, faint=True),
            Curve("eq. (92)", ends / DEGREE, line, "#C84C00"),
        ), 360),),
        f"Constant torque, damping and friction are taken off. RMSE {fit.rmse:.3g} N m.",
    )  # fmt: skip
    return Document(
        f"Alignment stiffness: {old.name}",
        "K_aln of eq. (92): how much the tyres turn the wheel back per front slip angle (Okamoto, Tsiotras 2019).",
        (Section("Result", (
            Table(HEAD, tuple(stiffness_rows(fit, old))),
            Findings(tuple((f.severity, f.text) for f in fit.findings)),
            chart,
        )),),
        (
            ("drives", fit.source), ("length", f"{fit.seconds:.0f} s"), ("torque", fit.torque_from),
            ("slip angle", f"of the {fit.slip_from}"), ("R\u00b2", f"{fit.r2:.4f}"),
            ("on the half left out", f"{fit.held_rmse:.3g} N m, {fit.held_r2:.4f}"),
        ),
        command,
    )  # fmt: skip
