"""Report of a drive that an assist motor shares: with and without, and the drive itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from codriver.finding import Finding
from codriver.report.document import BLACK, GREY, Chart, Curve, Document, Findings, Plot, Section, Table
from codriver.simulate.shared_control import SharedDrive
from codriver.simulate.shared_outcomes import FIGURES, Outcome, change_of, mean_outcome, verdict

SHOWN = 60.0  # s
NAMES = {"none": "no assist", "present": "power steering", "predicted": "foretold torque", "path": "back to the path"}
_SAID = {
    "none": "it gives nothing", "present": "power steering, g times his present torque",
    "predicted": "g times the torque that a model of him foretells", "path": "it pulls back to the path",
}  # fmt: skip
_MAIN = ("offset", "heading", "torque", "power")


def shared_document(
    shared: SharedDrive, alone: SharedDrive, found: Mapping[str, Sequence[Outcome]], driver: str, command: str = "",
    notes: Sequence[Finding] = (),
) -> Document:  # fmt: skip
    """The report.

    Args:
        shared, alone: a drive with the motor, and the same without.
        found: by kind of assist, outcomes of the same drives; "none" among them.
        driver: who.
        command: that made it.
        notes: what is to be said of the driver model.
    """
    assist, drives = shared.setting.assist, len(found["none"])
    return Document(
        "A steering wheel that two turn",
        f"{driver} drives round the circuit with an assist motor on the column: {_SAID[assist.kind]}.",
        (
            *_compared(found, notes),
            Section("A drive", (_drive(shared, alone),)),
        ),
        (
            ("gain", f"{assist.gain:g}"), ("drives compared", str(drives)),
            ("limit", f"{assist.limit:g} N m, {assist.rate:g} N m/s"),
            ("lag", f"{assist.lag:g} s"), ("authority fades", "yes" if assist.fade is not None else "no"),
            ("the driver is used to it", f"{shared.setting.used_to_it:g}"),
        ),
        command,
    )  # fmt: skip


def _compared(found: Mapping[str, Sequence[Outcome]], notes: Sequence[Finding]) -> tuple[Section, ...]:
    """Verdict and change, where there is an assist to compare; the table always."""
    if len(found) < 2:
        return (Section("Without", (_table(found),)),)
    said = Findings(tuple((f.severity, f.text) for f in (*notes, *verdict(found))))
    return (
        Section("Verdict", (said, "Behind ±: the standard error over the drives, in pairs with the same seed.")),
        Section("With and without", (_table(found), _changes(found))),
    )


def _table(found: Mapping[str, Sequence[Outcome]]) -> Table:
    """Mean and standard deviation of each figure."""
    columns = {kind: mean_outcome(list(each)) for kind, each in found.items()}
    rows = []
    for name, words, unit, factor in FIGURES:
        cells: list[str | float | None] = []
        for mean, spread in columns.values():
            value, sd = factor * getattr(mean, name), factor * getattr(spread, name)
            cells.append(None if not np.isfinite(value) else f"{value:.3g} ± {sd:.2g}" if np.isfinite(sd) else value)
        if any(cell is not None for cell in cells):
            rows.append((f"{words} ({unit})" if unit else words, *cells))
    return Table(("", *(NAMES[kind] for kind in found)), tuple(rows), "Mean and standard deviation over the drives.")


def _changes(found: Mapping[str, Sequence[Outcome]]) -> Chart:
    """Change of the main figures against no assist, in pairs."""
    kinds = [kind for kind in found if kind != "none"]
    names = [words for name, words, *_ in FIGURES if name in _MAIN]
    curves = []
    for kind in kinds:
        pairs = [change_of(found[kind], found["none"], name) for name in _MAIN]
        mean, error = (100 * np.array(column) for column in zip(*pairs, strict=True))
        error = np.nan_to_num(error)
        curves.append(Curve(NAMES[kind], names, mean, kind="bars", low=mean - error, high=mean + error))
    return Chart(
        "Change against no assist", "", (Plot("%", tuple(curves), 260, (0.0,)),),
        "Each drive against the same driver's drive with the same seed; whiskers: standard error over the drives.",
    )  # fmt: skip


def _drive(shared: SharedDrive, alone: SharedDrive) -> Chart:
    """Torques, offset and authority over a stretch."""
    d = shared.drive
    rows = d.time < SHOWN
    t = d.time[rows]
    torques = [
        Curve("driver, alone", t, alone.drive.driver_torque[rows], GREY),
        Curve("driver", t, d.driver_torque[rows], BLACK),
        Curve("motor", t, d.motor_torque[rows], "#0072B2"),
    ]
    plots = [
        Plot("torque (N m)", tuple(torques), 260),
        Plot("off the path (m)", (
            Curve("alone", t, alone.drive.offset[rows], GREY), Curve("with the motor", t, d.offset[rows], "#0072B2"),
        ), 180),
    ]  # fmt: skip
    if shared.setting.assist.fade is not None:
        plots.append(Plot("authority", (Curve("", t, shared.authority[rows], "#0072B2"),), 100, limits=(-0.05, 1.05)))
    return Chart(
        f"The first {SHOWN:g} s", "time (s)", tuple(plots), "Positive to the left. Both drives have the same seed.",
    )  # fmt: skip
