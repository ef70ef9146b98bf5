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
    "pwc": "the torque stays (eq. 3)", "pwl": "its slope stays (eq. 4)", "ridge": "ridge", "ann": "neural net (eq. 26)",
    "gp": "Gaussian process (eq. 16)", "gmr": "GMR (eq. 23)", "hmm-gmr": "HMM-GMR (eq. 25)", "boosting": "boosted ridge",
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
    items = dict.fromkeys((f.severity, f.text) for f in first.verdict(first.lead))
    items |= dict.fromkeys(("bad", f"protocol {e.protocol.name} leaks: {t}") for e in found[1:] for t in e.leaks)
    verdict: list[Part] = [Findings(tuple(items))]
    if len([kind for kind in first.kinds if kind not in BASELINES]) > 1:
        verdict.append(_verdicts(first))
    if notes:
        verdict.append(" ".join(f"{n}." for n in notes))
    sections = [Section(f"Verdict on {FULL[first.lead].removesuffix(' (default)')}", tuple(verdict))]
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
        "and not of the model. " + " ".join(f"{e.protocol.name}: {leak}." for e in found for leak in e.leaks),
    )  # fmt: skip


def driver_document(driver: LearnedDriver, drives: Mapping[str, Log], command: str = "") -> Document:
    """The report of `fit_driver`."""
    parts: list[Part] = []
    if driver.held is not None:
        parts += [_foretold(driver.held), _errors(driver)]
    training, setting = driver.training, driver.protocol.features
    sections = [Section("Foretold on blocks held out in turn", tuple(parts))] if parts else []
    warned = [(f.severity, f.text) for f in driver.doubts] + [("bad", f"leak: {t}") for t in driver.leaks]
    if warned:
        sections.insert(0, Section("Warnings", (Findings(tuple(warned)),)))
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
    curves = []
    for k in e.kinds:
        rmse = np.array([s.rmse for s in e.scores[k]])
        error = np.nan_to_num(np.array([s.rmse_error for s in e.scores[k]]))
        curves.append(Curve(FULL[k], folds, rmse, OF_KIND[k], "bars", low=rmse - error, high=rmse + error))
    return Chart(
        "Error on each part held out", "part held out", (Plot("RMSE (N m)", tuple(curves), 300),),
        "Lower is better. A part is foretold by models that learnt from all others. Whiskers: standard error from the scatter over "
        "blocks of 10 s within the part; models share the part, so they differ by less than whiskers suggest.",
    )  # fmt: skip


def _means(e: Evaluation) -> Chart:
    """Mean RMSE by model with standard errors."""
    names = [FULL[k] for k in e.kinds]
    mean = np.array([e.mean(k) for k in e.kinds])
    error = np.nan_to_num(np.array([e.spread(k) for k in e.kinds]))
    curve = Curve("", names, mean, "#0072B2", "bars", low=mean - error, high=mean + error)
    return Chart(
        "Error of each model", "", (Plot("RMSE (N m)", (curve,), 260, (e.mean("pwc"), e.mean("ridge"))),),
        "Bars: over all parts; whiskers: standard error over the parts. Dotted: 'the torque stays' and ridge. "
        "Equations are those of Okamoto and Tsiotras (2019).",
    )  # fmt: skip


def _verdicts(e: Evaluation) -> Table:
    """Every model against the baselines."""
    rows = []
    for kind in e.kinds:
        words = (_mark(e.against(kind, other)) if other != kind else "-" for other in BASELINES)
        rows.append((FULL[kind], *words, 100 * e.mean(kind, "inside95")))
    return Table(
        ("model", *(f"against {FULL[other]}" for other in BASELINES), "% in 95 % band"), tuple(rows),
        "All models: by the gain in squared error over blocks of 10 s, two standard errors.",
    )  # fmt: skip


def _mark(against: str) -> Mark | str:
    """A word on a comparison, coloured."""
    if against == "better":
        return Mark("good", against)
    if against == "worse":
        return Mark("bad", against)
    return Mark("open", against) if against != "-" else "-"


def _table(e: Evaluation) -> Table:
    rows = []
    for kind in e.kinds:
        ratio = e.mean(kind, "ratio")
        against = "-"
        if kind != "ridge":
            against = e.against(kind, "ridge")
        rows.append((
            FULL[kind], e.mean(kind), e.spread(kind) if len(e.scores[kind]) > 1 else None, ratio, e.mean(kind, "nrmse"),
            100 * e.mean(kind, "inside68"), 100 * e.mean(kind, "inside95"), e.mean(kind, "log_density"),
            _mark(against),
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
