"""Reports of learned drivers: one driver, and models judged on what they have not seen (figures 12, 14, 16 of the 2019 paper)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from codriver.drivers.learned.evaluate import Evaluation
from codriver.drivers.learned.features import Index
from codriver.drivers.learned.kinds import BASELINES
from codriver.drivers.learned.learned_driver import LearnedDriver, TorquePrediction
from codriver.report.document import BLACK, GREY, Chart, Curve, Document, Findings, Mark, Part, Plot, Section, Table
from codriver.signals import Log

FULL = {
    "pwc": "the torque stays (3)", "pwl": "its slope stays (4)", "ridge": "ridge", "ann": "neural net (26)",
    "gp": "Gaussian process (16)", "gmr": "GMR (23)", "hmm-gmr": "HMM-GMR (25)", "boosting": "boosted ridge",
    "guarded": "guarded (default)",
}  # fmt: skip
# All nine beside each other must be told apart.
OF_KIND = {
    "pwc": "#1A1A1A", "pwl": "#9A9A9A", "ridge": "#0072B2", "ann": "#E69F00", "gp": "#007A5A", "gmr": "#8E2F85",
    "hmm-gmr": "#D58BC6", "boosting": "#7CC4EC", "guarded": "#C84C00",
}  # fmt: skip
SHOWN = 120.0  # s of a drive, at most, so that single movements can be seen


def evaluation_document(
    found: Sequence[Evaluation], drives: Sequence[str], notes: Sequence[str], command: str = ""
) -> Document:
    """The report of `evaluate`, under one or several protocols.

    Args:
        found: an evaluation a protocol, of the same drives.
        drives: their names.
        notes: what was derived.
        command: that made it.
    """
    first = found[0]
    judged = [k for k in first.kinds if k not in BASELINES] or ["ridge"]
    items = dict.fromkeys((f.severity, f.text) for kind in judged for f in first.verdict(kind))
    items |= dict.fromkeys(
        ("warn", f"protocol {e.protocol.name} leaks: {t}") for e in found[1:] for t in e.protocol.leaks
    )
    sections = [Section("Verdict", (Findings(tuple(items)), *([" ".join(f"{n}." for n in notes)] if notes else [])))]
    sections += [Section(f"Protocol {e.protocol.name}", protocol_parts(e)) for e in found]
    if len(found) > 1:
        sections.append(Section("What the leak is worth", (leak_table(found),)))
    left = ", ".join(first.left_out) or "none"
    return Document(
        "Models of a driver, judged on what they have not seen",
        f"Each model foretells {first.target} {first.protocol.features.horizon:g} s ahead. Every part of the data is held out once "
        "and foretold by models that learnt from the rest.",
        tuple(sections),
        (
            ("drives", ", ".join(drives)), ("features", str(len(first.features))), ("signals the drives lack", left),
            ("torques judged", str(sum(s.rows for s in first.scores["pwc"]))),
        ),
        command,
    )  # fmt: skip


def protocol_parts(e: Evaluation) -> tuple[Part, ...]:
    """Bars and table of one evaluation."""
    return (_bars(e), _means(e), _table(e))


def leak_table(found: Sequence[Evaluation]) -> Table:
    """RMSE as a fraction of "the torque stays", a column a protocol."""
    rows = [
        (FULL[kind], *(e.mean(kind, "ratio") if kind in e.kinds else None for e in found)) for kind in found[0].kinds
    ]
    return Table(
        ("model", *(e.protocol.name for e in found)), tuple(rows),
        "RMSE over that of 'the torque stays', under each protocol. Where a protocol leaks, its column is a figure of the protocol "
        "and not of the model. " + " ".join(f"{e.protocol.name}: {leak}." for e in found for leak in e.protocol.leaks),
    )  # fmt: skip


def driver_document(driver: LearnedDriver, drives: Mapping[str, Log], command: str = "") -> Document:
    """The report of `fit_driver`."""
    parts: list[Part] = []
    if driver.held is not None:
        parts += [_foretold(driver.held), _errors(driver)]
    training, setting = driver.training, driver.protocol.features
    sections = [Section("Foretold on blocks held out in turn", tuple(parts))] if parts else []
    if driver.protocol.leaks:
        sections.insert(
            0, Section("Warnings", (Findings(tuple(("bad", f"leak: {t}") for t in driver.protocol.leaks)),))
        )
    sections.append(Section("Features", (_features(driver),)))
    rmse = training.get("held_out_rmse", float("nan"))
    return Document(
        f"How {driver.name} steers", f"A model of kind {driver.kind}, which foretells {driver.target} {setting.horizon:g} s ahead.",
        tuple(sections),
        (
            ("learnt from", f"{', '.join(drives)}; {training['minutes']:.1f} min"), ("rows", f"{training['rows']}"),
            ("held-out RMSE", f"{rmse:.3f} N m"),
            ("the torque stays", f"{training.get('held_out_stays_rmse', float('nan')):.3f} N m"),
            ("in the 95 % band", f"{training.get('held_out_inside95', float('nan')):.1%}"),
            ("signals the drives lack", ", ".join(driver.left_out) or "none"),
        ),
        command,
    )  # fmt: skip


def _bars(e: Evaluation) -> Chart:
    """RMSE by fold and model, as in figures 12, 14 and 16."""
    folds = [s.fold for s in e.scores["pwc"]]
    curves = tuple(Curve(FULL[k], folds, np.array([s.rmse for s in e.scores[k]]), OF_KIND[k], "bars") for k in e.kinds)
    return Chart(
        "Error on each part held out", "part held out", (Plot("RMSE (N m)", curves, 300),),
        "Lower is better. A part is foretold by models that learnt from all others.",
    )  # fmt: skip


def _means(e: Evaluation) -> Chart:
    """Mean RMSE by model with standard errors."""
    names = [FULL[k].replace(" (", "<br>(") for k in e.kinds]  # nine in a row are turned and cut off otherwise
    mean = np.array([e.mean(k) for k in e.kinds])
    error = np.nan_to_num(np.array([e.spread(k) for k in e.kinds]))
    curve = Curve("", names, mean, "#0072B2", "bars", low=mean - error, high=mean + error)
    return Chart(
        "Error of each model", "", (Plot("RMSE (N m)", (curve,), 260, (e.mean("pwc"), e.mean("ridge"))),),
        "Bars: over all parts; whiskers: standard error over the parts. Dotted: 'the torque stays' and ridge.",
    )  # fmt: skip


def _table(e: Evaluation) -> Table:
    rows = []
    for kind in e.kinds:
        ratio = e.mean(kind, "ratio")
        against = "-"
        if kind != "ridge":
            mean, error = e.gains[kind, "ridge"]
            against = "better" if mean > 2 * error else "worse" if mean < -2 * error else "not told apart"
        mark = {"better": "good", "worse": "bad"}.get(against, "open")
        rows.append((
            FULL[kind], e.mean(kind), e.spread(kind) if len(e.scores[kind]) > 1 else None, ratio, e.mean(kind, "nrmse"),
            100 * e.mean(kind, "inside68"), 100 * e.mean(kind, "inside95"), e.mean(kind, "log_density"),
            Mark(mark, against) if against != "-" else "-",  # type: ignore[arg-type]
            max(s.seconds for s in e.scores[kind]),
        ))  # fmt: skip
    return Table(
        (
            "model", "RMSE, N m", "s.e.", "of 'stays'", "NRMSE", "% in 68 % band", "% in 95 % band", "log density",
            "against ridge", "fit, s",
        ),
        tuple(rows),
        "Against ridge: by the gain in squared error over blocks of 10 s, two standard errors. NRMSE: over the torque's scatter.",
    )  # fmt: skip


def _foretold(held: TorquePrediction) -> Chart:
    """Torque foretold and measured over the busiest stretch."""
    rows = _busiest(held)
    time = held.time[rows] + held.horizon - held.time[rows[0]]
    return Chart(
        f"The torque and what was foretold {held.horizon:g} s before", "time from the start of the stretch (s)",
        (Plot("torque (N m)", (
            Curve("foretold, 95 % band", time, held.mean[rows], "#0072B2", low=held.low[rows], high=held.high[rows]),
            Curve("measured", time, held.measured[rows], BLACK),
        ), 280),),
        "The two minutes in which the torque varies most. The model that foretold had not seen them.",
    )  # fmt: skip


def _errors(driver: LearnedDriver) -> Chart:
    """How the standardised errors scatter beside what the band assumes."""
    from scipy.stats import t

    held = driver.held
    assert held is not None
    edges = np.linspace(-6, 6, 61)
    factor = np.sqrt(driver.calibration.nu / (driver.calibration.nu - 2))
    z = held.error / held.sd * factor
    assumed = f"the band's, nu = {driver.calibration.nu:.1f}"
    density, _ = np.histogram(np.clip(z, -6, 6), edges, density=True)
    middle = (edges[1:] + edges[:-1]) / 2
    return Chart(
        "Errors in units of the band", "error / scale", (Plot("density", (
            Curve("held-out errors", middle, density, GREY, "bars"),
            Curve(assumed, middle, t.pdf(middle, driver.calibration.nu), "#C84C00"),
        ), 220),),
        "The grey bars should follow the line, a Student distribution; then the band holds what it promises.", half=True,
    )  # fmt: skip


def _features(driver: LearnedDriver) -> Table:
    kinds = {"past": "past", "slow": "newest value", "current": "at the moment foretold", "preview": "road ahead"}
    found: dict[tuple[str, str], list[float]] = {}
    for feature in driver.features:
        found.setdefault((feature.signal, kinds[feature.kind]), []).append(feature.when)
    rows = tuple(
        (signal, kind, ", ".join(f"{w:+.2g}" if w else "0" for w in sorted(whens)))
        for (signal, kind), whens in found.items()
    )
    return Table(("signal", "as", "s from now"), rows)


def _busiest(held: TorquePrediction) -> Index:
    """Rows of the stretch of SHOWN s in which the torque varies most; drives have clocks of their own."""
    starts = range(0, held.time.size, max(held.time.size // 200, 1))
    time, drive = held.time, held.drive
    found = [np.flatnonzero((drive == drive[k]) & (time >= time[k]) & (time < time[k] + SHOWN)) for k in starts]
    full = [rows for rows in found if rows.size >= 0.8 * max(r.size for r in found)]
    return max(full, key=lambda rows: float(np.std(held.measured[rows])))
