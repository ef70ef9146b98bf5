"""codriver style: how drivers drive, beside each other."""

from __future__ import annotations

import json as json_module
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from codriver.cli.options import Bus, Dbc, Ell, Json, Names, PresetName, VehicleName

if TYPE_CHECKING:
    from codriver.drivers import Comparison, Scale
    from codriver.estimate import Estimate
    from codriver.report.styles import Box
    from codriver.signals import Log
    from codriver.trust import Check
    from codriver.vehicles import Vehicle

# In this order, the first that all logs can feed; the scale that comes with codriver is of the first.
PREFERRED = ("intent-pedals", "intent-torque", "pedals-only")


Logs = Annotated[
    list[Path] | None,
    typer.Argument(metavar="LOG...", help="Recordings; each is a driver, named by its file.", show_default=False),
]
Drivers = Annotated[
    list[str] | None,
    typer.Option("--driver", metavar="NAME=LOG", help="A recording of a driver; may be repeated.", show_default=False),
]
Out = Annotated[
    Path | None,
    typer.Option("-o", "--out", metavar="OUT", help="Table to write: .parquet or .csv.", show_default=False),
]
Chosen = Annotated[
    str | None,
    typer.Option(
        "--estimator",
        help="Default: the first of intent-pedals, intent-torque, pedals-only that all logs can feed.",
        show_default=False,
    ),
]
From = Annotated[float | None, typer.Option("--from", help="Only from here on, m.", show_default=False)]
To = Annotated[float | None, typer.Option("--to", help="Only up to here, m.", show_default=False)]
How = Annotated[str, typer.Option("--align", help="auto, start, ends or position.")]
Reference = Annotated[
    Path | None, typer.Option("--reference", metavar="SCALE.toml", help="A scale of your own.", show_default=False)
]
WriteReference = Annotated[
    Path | None,
    typer.Option("--write-reference", metavar="SCALE.toml", help="Make a scale of these drivers.", show_default=False),
]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace a scale that is there.")]
Boxes = Annotated[
    list[str] | None,
    typer.Option("--box", metavar="FROM:TO:LABEL", help="Stretch to frame in the report, m.", show_default=False),
]
Report = Annotated[Path | None, typer.Option("--report", help="Report to write (HTML).", show_default=False)]


def style(
    logs: Logs = None, driver: Drivers = None, vehicle: VehicleName = None, out: Out = None, dbc: Dbc = None,
    names: Names = None, ell: Ell = None, preset: PresetName = None, bus: Bus = None, estimator: Chosen = None,
    start: From = None, stop: To = None, how: How = "auto", reference: Reference = None,
    write_reference: WriteReference = None, overwrite: Overwrite = False, box: Boxes = None, report: Report = None,
    json: Json = False,
) -> None:  # fmt: skip
    """Compare how drivers drive: intentional jerk, bursts per kilometre, a score and a class.

    Example: codriver style anna.blf ben.blf --dbc car.dbc --names names.toml --vehicle bisoffi2017 --report drivers.html
    """
    from codriver.cli.style_table import say_styles, told_of
    from codriver.cli.terminal import command_line, working
    from codriver.drivers import compare_drivers, load_scale
    from codriver.vehicles import load_vehicle

    of_driver = named(logs or [], driver or [])
    boxes = parse_boxes(box or [], report)
    every = [path for mine in of_driver.values() for path in mine]
    _check(every, dbc, names, out, report, reference, write_reference, overwrite, how)
    car = load_vehicle(vehicle) if vehicle is not None else None
    scale = load_scale(reference) if reference is not None else None
    with working(not json, len(every) + 1) as stage:
        estimates, checks, skipped = _estimates(of_driver, car, dbc, names, bus, estimator, ell, preset, stage)
        stage("comparing")
        found = compare_drivers(estimates, scale=scale, start=start, stop=stop, how=how, checks=checks)  # type: ignore[arg-type]
        _write(found, boxes, out, report, write_reference, overwrite, command_line())
    told = told_of(found, skipped, [path for path in (out, report, write_reference) if path is not None])
    if json:
        typer.echo(json_module.dumps(told, indent=2, ensure_ascii=False, allow_nan=False))
    else:
        say_styles(told)
    if not found.judged:
        raise typer.Exit(1)


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


def parse_boxes(texts: Sequence[str], report: Path | None) -> list[Box]:
    """Stretches to frame in the report.

    Raises:
        UsageError: one is no stretch, or there is no report to frame them in.
    """
    from codriver.errors import UsageError

    boxes = [parse_box(text) for text in texts]
    if boxes and report is None:
        raise UsageError("--box without --report", "a report to frame it in", "add --report FILE.html, or leave it out")
    return boxes


def parse_box(text: str) -> Box:
    """A stretch to frame.

    Raises:
        UsageError: it is not FROM:TO:LABEL with FROM below TO.
    """
    from codriver.errors import UsageError

    start, _, rest = text.partition(":")
    stop, _, label = rest.partition(":")
    try:
        box = float(start), float(stop), label.strip()
    except ValueError:
        box = 0.0, 0.0, ""
    if not box[2]:
        raise UsageError(f"--box {text}", "FROM:TO:LABEL in metres", "write --box 120:480:ramp")
    if not -float("inf") < box[0] < box[1] < float("inf"):
        raise UsageError(f"--box {text}", "FROM below TO", "swap them")
    return box


def _check(
    logs: list[Path], dbc: Path | None, names: Path | None, out: Path | None, report: Path | None,
    reference: Path | None, write_reference: Path | None, overwrite: bool, how: str,
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
        check_scale_name(write_reference, overwrite=overwrite)
    check_report(report)
    inputs = [path for path in (*logs, dbc, names, reference) if path is not None]
    for output in (out, report, write_reference):
        if output is not None and output.exists() and any(output.samefile(p) for p in inputs if p.exists()):
            raise UsageError(f"{output} is an input", "another name", "choose another; inputs are kept")


def _estimates(
    of_driver: dict[str, list[Path]], car: Vehicle | None, dbc: Path | None, names: Path | None, bus: int | None,
    estimator: str | None, ell: float | None, preset: str | None, stage: Any,
) -> tuple[dict[str, list[Estimate]], dict[str, list[Check]], list[str]]:  # fmt: skip
    """Estimates by driver, the verdicts on them with what the logs say of the vehicle, and why some logs were left out.

    Raises:
        LogError: no log has a valid moment.
    """
    from codriver.cli.estimate import check_with_vehicle
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
    checks: dict[str, list[Check]] = {}
    skipped = []
    for name, mine in recorded.items():
        for log in mine:
            estimate = estimate_log(chosen, log, car, ell=ell, preset=preset)
            if estimate.valid.any():
                found.setdefault(name, []).append(estimate)
                checks.setdefault(name, []).append(check_with_vehicle(estimate, log, car))
            else:
                skipped.append(f"{name}: {log.source} has no valid moment and is left out")
    if not found:
        raise LogError(
            f"{'; '.join(skipped)}", "a drive in which the vehicle moves and all signals are there together",
            "see with `codriver info LOG` what the logs hold",
        )  # fmt: skip
    return found, checks, skipped


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


def _write(
    found: Comparison, boxes: list[Box], out: Path | None, report: Path | None, write_reference: Path | None,
    overwrite: bool, command: str,
) -> None:  # fmt: skip
    """Write table, report and scale: all or none.

    Raises:
        LogError: a file cannot be written, or a driver whose data contradict themselves would be part of a scale.
        UsageError: the drivers make no scale.
    """
    from contextlib import ExitStack

    from codriver.drivers import save_scale, save_styles
    from codriver.logs.write import complete_or_nothing
    from codriver.report.document import write_document
    from codriver.report.styles import styles_document

    scale = _scale(found, write_reference.stem) if write_reference is not None else None
    # All are complete under names of their own before the first is renamed.
    with ExitStack() as drafts:
        if report is not None:
            draft = drafts.enter_context(complete_or_nothing(report))
            write_document(styles_document(found, boxes, command), draft)
        if out is not None:
            save_styles(found, drafts.enter_context(complete_or_nothing(out)))
        if scale is not None and write_reference is not None:
            save_scale(scale, drafts.enter_context(complete_or_nothing(write_reference)))


def _scale(found: Comparison, name: str) -> Scale:
    """A scale of the drivers compared.

    Raises:
        LogError: the data of one contradict themselves.
        UsageError: they are too few.
    """
    from codriver.drivers import make_scale
    from codriver.errors import LogError

    wrong = [style.name for style in found.styles if style.name not in found.judged]
    if wrong:
        what = "; ".join(f"{name}: {f.text}" for name in wrong for f in found.doubts[name] if f.severity == "bad")
        raise LogError(
            f"no scale of these drivers: {what}", "drivers whose data agree", "correct them, or leave them out"
        )
    return make_scale(found.styles, name, f"{len(found.styles)} drivers, classes unknown: thresholds are terciles")
