"""codriver style: how drivers drive, beside each other."""

from __future__ import annotations

import json as json_module
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from codriver.cli.options import Bus, Dbc, Ell, Json, Names, PresetName, VehicleName

if TYPE_CHECKING:
    from codriver.drivers import Comparison
    from codriver.estimate import Estimate
    from codriver.report.styles import Box
    from codriver.signals import Log
    from codriver.vehicles import Vehicle

# In this order, the first that all logs can feed; the scale that comes with codriver is of the first.
PREFERRED = ("intent-pedals", "intent-torque", "pedals-only")


def style(
    logs: Annotated[
        list[Path] | None,
        typer.Argument(metavar="LOG...", help="Recordings; each is a driver, named by its file.", show_default=False),
    ] = None,
    driver: Annotated[
        list[str] | None,
        typer.Option("--driver", metavar="NAME=LOG", help="A recording of a driver; may be repeated.", show_default=False),
    ] = None,
    vehicle: VehicleName = None,
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", metavar="OUT", help="Table to write: .parquet or .csv.", show_default=False),
    ] = None,
    dbc: Dbc = None,
    names: Names = None,
    ell: Ell = None,
    preset: PresetName = None,
    bus: Bus = None,
    estimator: Annotated[
        str | None,
        typer.Option("--estimator", help="Default: the first of intent-pedals, intent-torque, pedals-only that all logs can feed.",
                     show_default=False),
    ] = None,
    start: Annotated[float | None, typer.Option("--from", help="Only from here on, m.", show_default=False)] = None,
    stop: Annotated[float | None, typer.Option("--to", help="Only up to here, m.", show_default=False)] = None,
    how: Annotated[str, typer.Option("--align", help="auto, start, ends or position.")] = "auto",
    reference: Annotated[
        Path | None, typer.Option("--reference", metavar="SCALE.toml", help="A scale of your own.", show_default=False)
    ] = None,
    write_reference: Annotated[
        Path | None,
        typer.Option("--write-reference", metavar="SCALE.toml", help="Make a scale of these drivers.", show_default=False),
    ] = None,
    box: Annotated[
        list[str] | None,
        typer.Option("--box", metavar="FROM:TO:LABEL", help="Stretch to frame in the report, m.", show_default=False),
    ] = None,
    report: Annotated[Path | None, typer.Option("--report", help="Report to write (HTML).", show_default=False)] = None,
    json: Json = False,
) -> None:  # fmt: skip
    """Compare how drivers drive: intentional jerk, bursts per kilometre, a score and a class.

    Example: codriver style anna.blf ben.blf --dbc car.dbc --names names.toml --vehicle bisoffi2017 --report drivers.html
    """
    from codriver.cli.terminal import command_line, working
    from codriver.drivers import compare_drivers, load_scale, make_scale, save_scale, save_styles
    from codriver.drivers.style_file import rows_of
    from codriver.vehicles import load_vehicle

    of_driver = named(logs or [], driver or [])
    boxes = [parse_box(text) for text in box or []]
    every = [path for mine in of_driver.values() for path in mine]
    _check(every, dbc, names, out, report, reference, write_reference, how)
    car = load_vehicle(vehicle) if vehicle is not None else None
    scale = load_scale(reference) if reference is not None else None
    with working(not json, len(every) + 1) as stage:
        estimates, skipped = _estimates(of_driver, car, dbc, names, bus, estimator, ell, preset, stage)
        stage("comparing")
        found = compare_drivers(estimates, scale=scale, start=start, stop=stop, how=how)  # type: ignore[arg-type]
        made = None
        if write_reference is not None:
            source = f"{len(found.styles)} drivers, classes unknown: thresholds are terciles"
            made = make_scale(found.styles, write_reference.stem, source)
        if report is not None:
            _report(found, boxes, report, command_line())
        if out is not None:
            save_styles(found, out)
        if made is not None and write_reference is not None:
            save_scale(made, write_reference)
    written = [str(path) for path in (out, report, write_reference) if path is not None]
    findings = [{"severity": f.severity, "text": f.text} for f in found.findings]
    told: dict[str, Any] = {
        "estimator": found.styles[0].observer, "ell": found.styles[0].ell, "aligned": found.aligned,
        "scale": found.scale.name if found.scale else None, "drivers": rows_of(found),
        "findings": findings + [{"severity": "warn", "text": text} for text in skipped], "written": written,
    }  # fmt: skip
    if json:
        typer.echo(json_module.dumps(told, indent=2, ensure_ascii=False, allow_nan=False))
    else:
        _say(told)


def named(logs: Sequence[Path], drivers: Sequence[str]) -> dict[str, list[Path]]:
    """Logs by driver: those of --driver by its name, the others by the file's; two files of one name by their folders too.

    Raises:
        UsageError: no log at all, or a --driver that is not NAME=LOG.
    """
    from codriver.errors import UsageError

    found: dict[str, list[Path]] = {}
    stems = [path.stem for path in logs]
    for path in logs:
        name = path.stem if stems.count(path.stem) == 1 else f"{path.resolve().parent.name}/{path.stem}"
        if name in found:
            raise UsageError(f"two logs are named '{name}'", "names that differ", "name them with --driver NAME=LOG")
        found[name] = [path]
    for text in drivers:
        name, equals, path_text = text.partition("=")
        if not equals or not name.strip() or not path_text:
            raise UsageError(f"--driver {text}", "NAME=LOG", "write --driver anna=drive.blf")
        found.setdefault(name.strip(), []).append(Path(path_text))
    if not found:
        raise UsageError("no log was given", "LOG... or --driver NAME=LOG", "name the recordings to compare")
    return found


def parse_box(text: str) -> Box:
    """A stretch to frame.

    Raises:
        UsageError: it is not FROM:TO:LABEL with FROM below TO.
    """
    from codriver.errors import UsageError

    start, _, rest = text.partition(":")
    stop, _, label = rest.partition(":")
    try:
        box = float(start), float(stop), label
    except ValueError:
        raise UsageError(f"--box {text}", "FROM:TO:LABEL in metres", "write --box 120:480:ramp") from None
    if not box[0] < box[1] < float("inf"):
        raise UsageError(f"--box {text}", "FROM below TO", "swap them")
    return box


def _check(
    logs: list[Path], dbc: Path | None, names: Path | None, out: Path | None, report: Path | None,
    reference: Path | None, write_reference: Path | None, how: str,
) -> None:  # fmt: skip
    """What can be refused before the long work.

    Raises:
        UsageError: an input is missing, or an output cannot be written or would replace an input.
    """
    from codriver.cli.estimate import check_report
    from codriver.cli.options import check_inputs
    from codriver.drivers.alignment import HOWS
    from codriver.drivers.scale_file import check_scale_name
    from codriver.drivers.style_file import check_styles_name
    from codriver.errors import UsageError

    for path in logs:
        check_inputs(path, dbc, names)
    if how not in HOWS:
        raise UsageError(f"--align {how}", f"one of {', '.join(HOWS)}", "choose one")
    if out is not None:
        check_styles_name(out)
    if write_reference is not None:
        check_scale_name(write_reference)
    check_report(report)
    inputs = [path for path in (*logs, dbc, names, reference) if path is not None]
    for output in (out, report):
        if output is not None and output.exists() and any(output.samefile(p) for p in inputs if p.exists()):
            raise UsageError(f"{output} is an input", "another name", "choose another; inputs are kept")


def _estimates(
    of_driver: dict[str, list[Path]], car: Vehicle | None, dbc: Path | None, names: Path | None, bus: int | None,
    estimator: str | None, ell: float | None, preset: str | None, stage: Any,
) -> tuple[dict[str, list[Estimate]], list[str]]:  # fmt: skip
    """Estimates by driver, and why some logs were left out.

    Raises:
        LogError: no log has a valid moment.
    """
    from codriver.errors import LogError
    from codriver.logs import read
    from codriver.run import estimate_log

    recorded: dict[str, list[Log]] = {}
    for name, paths in of_driver.items():
        for path in paths:
            stage(f"reading {path.name}")
            recorded.setdefault(name, []).append(read(path, dbc=dbc, names=names, bus=bus))
    chosen = estimator or _common([log for mine in recorded.values() for log in mine], car)
    found: dict[str, list[Estimate]] = {}
    skipped = []
    for name, mine in recorded.items():
        for log in mine:
            estimate = estimate_log(chosen, log, car, ell=ell, preset=preset)
            if estimate.valid.any():
                found.setdefault(name, []).append(estimate)
            else:
                skipped.append(f"{name}: {log.source} has no valid moment and is left out")
    if not found:
        raise LogError(
            f"{'; '.join(skipped)}", "a drive in which the vehicle moves and all signals are there together",
            "see with `codriver info LOG` what the logs hold",
        )  # fmt: skip
    return found, skipped


def _common(logs: list[Log], car: Vehicle | None) -> str:
    """The estimator that all logs can feed.

    Raises:
        MissingSignal: there is none.
    """
    from codriver.errors import MissingSignal
    from codriver.observers.feed import feeds

    lacking = []
    for name in PREFERRED:
        cannot = [(log, f) for log in logs for f in feeds(log, car, "intent") if f.estimator == name and not f.possible]
        if not cannot:
            return name
        log, feed = cannot[0]
        lacking.append(f"{name}: {log.source or 'a log'} lacks {feed.lacks(car)}")
    raise MissingSignal(
        f"no estimator of the intention can be fed by all logs ({'; '.join(lacking)})",
        "signals and vehicle for one of them", "give --vehicle, map the signals, or leave the log out",
    )  # fmt: skip


def _report(found: Comparison, boxes: list[Box], path: Path, command: str) -> None:
    from codriver.report.document import write_document
    from codriver.report.styles import styles_document

    write_document(styles_document(found, boxes, command), path)


def _say(told: dict[str, Any]) -> None:
    """The table and the findings."""
    from rich.markup import escape
    from rich.table import Table

    from codriver.cli.terminal import console

    out = console()
    out.print(f"[bold]{told['estimator']}[/], ell {told['ell']}; aligned by {told['aligned'] or 'nothing'}; scale: "
              f"{escape(told['scale'] or 'none fits')}\n")  # fmt: skip
    table = Table(box=None, pad_edge=False)
    head = (
        "driver",
        "class",
        "score",
        "rank",
        "min",
        "km",
        "rms jerk",
        "j 5 %",
        "j 95 %",
        "bursts/km",
        "reversals/min",
    )
    for column in head:
        table.add_column(column, justify="left" if column in ("driver", "class") else "right")
    for row in told["drivers"]:
        kind, sure = row["class"], row.get(f"p_{row['class']}")
        table.add_row(
            escape(row["driver"]), kind + (f" {sure:.0%}" if sure is not None else ""),
            _cell(row, "score"), "-" if row["rank"] is None else f"{row['rank']} ({row['rank_low']}-{row['rank_high']})",
            f"{row['valid_s'] / 60:.1f}", f"{row['valid_km']:.1f}", _cell(row, "jerk_rms_m/s3"),
            _cell(row, "jerk_q05_m/s3"), _cell(row, "jerk_q95_m/s3"), _cell(row, "bursts_per_km"),
            _cell(row, "pedal_reversals_per_min", 1),
        )  # fmt: skip
    out.print(table)
    color = {"ok": "green", "warn": "yellow", "bad": "red"}
    reasons = [{"severity": "warn", "text": f"{row['driver']}: {row['why']}"} for row in told["drivers"] if row["why"]]
    for finding in [*told["findings"], *reasons]:
        out.print(f"  [{color[finding['severity']]}]{finding['severity']:<4}[/] {escape(finding['text'])}")
    if told["written"]:
        out.print(f"\nwrote {escape(', '.join(told['written']))}")


def _cell(row: dict[str, Any], key: str, digits: int = 2) -> str:
    """A value and its interval."""
    value, low, high = row.get(key), row.get(f"{key}_low"), row.get(f"{key}_high")
    if value is None:
        return "-"
    return f"{value:.{digits}f}" + (f" ({low:.{digits}f}-{high:.{digits}f})" if low is not None else "")
