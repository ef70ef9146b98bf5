"""codriver driver fit, evaluate: how a driver steers, learned from drives, and how good that is."""

from __future__ import annotations

import json as json_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from codriver.cli.options import Bus, Dbc, Json, Names, VehicleName

if TYPE_CHECKING:
    from codriver.drivers.learned.learned_driver import LearnedDriver
    from codriver.drivers.learned.protocol import Protocol
    from codriver.signals import Log

app = typer.Typer(
    help="How a driver steers: learn it, judge it, recognise it, foretell the next second.", no_args_is_help=True,
    rich_markup_mode=None,
)  # fmt: skip

Drives = Annotated[list[Path], typer.Argument(metavar="DRIVE...", help="Recordings of one driver.", show_default=False)]
Model = Annotated[
    str,
    typer.Option(
        "--model", help="guarded, ridge, ann, gmr, hmm-gmr, gp, boosting, pwc or pwl; docs/drivers.md says which when."
    ),
]
ProtocolName = Annotated[
    str, typer.Option("--protocol", help="honest, or paper2019 (its figures flatter, and it says why).")
]
Horizon = Annotated[
    float | None,
    typer.Option("--horizon", help="How far ahead the torque is foretold, s. Default: 0.2.", show_default=False),
]
Options = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="NAME=VALUE", help="A parameter of the model, such as components=21.", show_default=False
    ),
]
Signals = Annotated[
    str | None,
    typer.Option(
        "--signals",
        help="Whose past the model sees beside the torque's, with commas between. Default: all it knows to use.",
        show_default=False,
    ),
]
Report = Annotated[Path | None, typer.Option("--report", help="Report to write (HTML).", show_default=False)]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace a driver file that is there.")]


@app.command("fit")
def fit(
    drives: Drives,
    out: Annotated[
        Path, typer.Option("-o", "--out", metavar="NAME.driver", help="Driver file to write.", show_default=False)
    ],
    model: Model = "guarded", name: Annotated[
        str | None, typer.Option("--name", help="Whose it is. Default: the file's name.", show_default=False)
    ] = None,
    dbc: Dbc = None, names: Names = None, bus: Bus = None, vehicle: VehicleName = None, protocol: ProtocolName = "honest",
    horizon: Horizon = None, signals: Signals = None, options: Options = None, report: Report = None,
    overwrite: Overwrite = False, json: Json = False,
) -> None:  # fmt: skip
    """Learn how a driver steers from drives with a torque sensor, or with what estimates the torque (--vehicle).

    Example: codriver driver fit monday.csv tuesday.csv --names names.toml --model hmm-gmr -o anna.driver --report anna.html
    """
    from codriver.cli.driver_words import driver_told, say_driver
    from codriver.cli.identify import check_outputs
    from codriver.cli.terminal import command_line, working
    from codriver.drivers.learned.driver_file import SUFFIX, load_driver, save_driver
    from codriver.drivers.learned.kinds import class_of
    from codriver.drivers.learned.learned_driver import fit_driver

    class_of(model)
    check_outputs(out, report, [*drives, *(p for p in (dbc, names) if p is not None)], overwrite, SUFFIX)
    if out.exists():
        load_driver(out)  # raises: only a driver file may be replaced
    chosen, parameters = with_signals(protocol_of(protocol, horizon), signals), parse_options(options or [])
    with working(not json, len(drives) + 2) as stage:
        logs, notes = read_drives(drives, dbc, names, bus, vehicle, stage)
        stage(f"learning {model}")
        driver = fit_driver(logs, model, name=name or out.stem, protocol=chosen, options=parameters)
        stage("writing")
        _write(driver, logs, out, report, command_line(), save_driver)
    told = driver_told(driver, list(logs), notes, out, report)
    if json:
        typer.echo(json_module.dumps(told, indent=2, ensure_ascii=False, allow_nan=False))
    else:
        say_driver(told)


@app.command("evaluate")
def evaluate(
    drives: Drives,
    models: Annotated[
        list[str] | None,
        typer.Option("--model", help="Of which models; may be repeated, 'all' takes every one.", show_default="guarded"),
    ] = None,
    dbc: Dbc = None, names: Names = None, bus: Bus = None, vehicle: VehicleName = None, protocol: ProtocolName = "honest",
    horizon: Horizon = None, folds: Annotated[int, typer.Option("--folds", min=2, help="Blocks, where one drive is given.")] = 4,
    both: Annotated[bool, typer.Option("--both", help="Also under the other protocol: what its leaks are worth.")] = False,
    report: Report = None, json: Json = False,
) -> None:  # fmt: skip
    """Judge models of a driver on what they have not seen: each drive held out in turn, or blocks of one drive.

    Example: codriver driver evaluate monday.csv tuesday.csv --names names.toml --model all --report judged.html
    """
    from dataclasses import replace

    from codriver.cli.driver_words import evaluation_told, say_evaluation
    from codriver.cli.estimate import check_report
    from codriver.cli.terminal import command_line, working
    from codriver.drivers.learned.evaluate import evaluate as judge
    from codriver.drivers.learned.kinds import BASELINES, DEFAULT, KINDS, class_of
    from codriver.drivers.learned.protocol import PROTOCOLS
    from codriver.logs.write import complete_or_nothing
    from codriver.report.document import write_document
    from codriver.report.drivers import evaluation_document

    kinds = KINDS if models and "all" in models else tuple(models or (DEFAULT,))
    for kind in kinds:
        class_of(kind)
    check_report(report)
    first = protocol_of(protocol, horizon)
    protocols = [first, *(protocol_of(n, horizon) for n in PROTOCOLS if both and n != first.name)]
    parts = max(folds, len(drives)) * len({*BASELINES, *kinds}) * len(protocols)
    with working(not json, len(drives) + parts + 1) as stage:
        logs, notes = read_drives(drives, dbc, names, bus, vehicle, stage)
        found = [judge(logs, kinds, protocol=replace(p, folds=folds), progress=stage) for p in protocols]
        if report is not None:
            with complete_or_nothing(report) as draft:
                write_document(evaluation_document(found, list(logs), notes, command_line()), draft)
    told = evaluation_told(found, list(logs), notes, report)
    if json:
        typer.echo(json_module.dumps(told, indent=2, ensure_ascii=False, allow_nan=False))
    else:
        say_evaluation(told)


def protocol_of(name: str, horizon: float | None) -> Protocol:
    """A protocol by name, perhaps with another horizon.

    Raises:
        UsageError: there is none of that name, or the horizon cannot be.
    """
    from codriver.drivers.learned.protocol import PROTOCOLS
    from codriver.errors import UsageError

    if name not in PROTOCOLS:
        raise UsageError(f"--protocol {name}", f"one of {', '.join(PROTOCOLS)}", "choose one")
    return PROTOCOLS[name] if horizon is None else PROTOCOLS[name].with_features(horizon=horizon)


def with_signals(protocol: Protocol, names: str | None) -> Protocol:
    """A protocol whose features have the past of these signals only.

    Args:
        protocol: which features it has else.
        names: standard names with commas between; None leaves the protocol's.

    Raises:
        UsageError: one is no standard name.
    """
    from codriver.errors import UsageError
    from codriver.names import VOCABULARY

    if names is None:
        return protocol
    wanted = tuple(name.strip() for name in names.split(",") if name.strip())
    strange = [name for name in wanted if name not in VOCABULARY]
    if strange or not wanted:
        raise UsageError(
            f"--signals {names}", f"standard names with commas between, such as {','.join(protocol.features.past[:2])}",
            "see docs/names.md",
        )  # fmt: skip
    return protocol.with_features(past=wanted)


def parse_options(texts: list[str]) -> dict[str, Any]:
    """NAME=VALUE texts as parameters: numbers where they are numbers.

    Raises:
        UsageError: one is not NAME=VALUE.
    """
    from codriver.errors import UsageError

    found: dict[str, Any] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals or not name.strip() or not value.strip():
            raise UsageError(f"--set {text}", "NAME=VALUE", "write --set components=21")
        found[name.strip()] = _value(value.strip())
    return found


def read_drives(
    paths: list[Path], dbc: Path | None, names: Path | None, bus: int | None, vehicle: str | None, stage: Any
) -> tuple[dict[str, Log], list[str]]:
    """Drives by name, made ready for learning, and a sentence on each thing derived.

    Raises:
        CodriverError: one cannot be read, or has no torque.
    """
    from codriver.cli.options import check_inputs
    from codriver.cli.style import named
    from codriver.drivers.learned.prepare import prepared
    from codriver.logs import read
    from codriver.vehicles import load_vehicle

    car = load_vehicle(vehicle) if vehicle is not None else None
    for path in paths:
        check_inputs(path, dbc, names)
    logs: dict[str, Log] = {}
    notes: list[str] = []
    for name, (path,) in named(paths, []).items():
        stage(f"reading {path.name}")
        logs[name], said = prepared(read(path, dbc=dbc, names=names, bus=bus), car)
        notes += [f"{name}: {sentence}" for sentence in said]
    return logs, notes


def _write(
    driver: LearnedDriver, logs: dict[str, Log], out: Path, report: Path | None, command: str, save: Any
) -> None:
    """Driver file and report: both or none."""
    from codriver.logs.write import complete_or_nothing
    from codriver.report.document import write_document
    from codriver.report.drivers import driver_document

    if report is None:
        save(driver, out)
        return
    with complete_or_nothing(report) as draft:
        write_document(driver_document(driver, logs, command), draft)
        save(driver, out)


def _value(text: str) -> Any:
    """A number, a yes or no, or the text itself."""
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return {"true": True, "false": False, "none": None}.get(text.lower(), text)
