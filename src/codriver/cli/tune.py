"""codriver tune: noise and knob from recorded drives, and where they lie on the curve of delay against noise."""

from __future__ import annotations

import json as json_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from codriver.cli.options import Bus, Dbc, Json, Names, PresetName, VehicleName

if TYPE_CHECKING:
    from codriver.tune import Point, Tuning


Tuned = Annotated[
    str,
    typer.Argument(
        metavar="ESTIMATOR",
        help="intent-pedals, intent-torque, kinematic, or intent: the best the log can feed; driver-torque or one of its Kalman "
        "filters. Others have no such noise.",
        show_default=False,
    ),
]
Logs = Annotated[list[Path], typer.Argument(metavar="LOG...", help="Recordings of one vehicle.", show_default=False)]
Delay = Annotated[
    float | None,
    typer.Option("--delay", metavar="S", help="Choose ell for this delay of slow changes, s.", show_default=False),
]
Fit = Annotated[bool, typer.Option("--likelihood", help="Fit Q and R by maximum likelihood. Default without --delay.")]
Out = Annotated[
    Path | None, typer.Option("-o", "--out", metavar="OUT", help="Preset to write (.toml).", show_default=False)
]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace a preset file that is there.")]
Rate = Annotated[
    float | None, typer.Option("--rate", help="Ticks per second. Default: from the logs.", show_default=False)
]
Report = Annotated[
    Path | None, typer.Option("--report", help="Report to write (HTML); for the intent estimators.", show_default=False)
]


def tune(
    estimator: Tuned, logs: Logs, vehicle: VehicleName = None, dbc: Dbc = None, names: Names = None, delay: Delay = None,
    likelihood: Fit = False, out: Out = None, overwrite: Overwrite = False, rate: Rate = None, preset: PresetName = None,
    bus: Bus = None, report: Report = None, json: Json = False,
) -> None:  # fmt: skip
    """Tune the noise of an estimator on recorded drives: by likelihood, by a wanted delay, or both.

    Example: codriver tune intent drive.blf --dbc car.dbc --names names.toml --vehicle bisoffi2017 --delay 0.4 -o mine.toml
    """
    from codriver.cli.estimate import check_report, check_with_vehicle
    from codriver.cli.options import check_inputs
    from codriver.cli.terminal import command_line, working
    from codriver.cli.tune_torque import tune_torque
    from codriver.errors import UsageError
    from codriver.logs import read
    from codriver.observers import find_preset
    from codriver.observers.registry import get_estimator
    from codriver.run import check_rate, choose
    from codriver.tune import tune as tuned
    from codriver.vehicles import load_vehicle

    for log in logs:
        check_inputs(log, dbc, names)
    inputs = [*logs, dbc, names, *(Path(name) for name in (vehicle, preset) if name is not None)]
    if out is not None:
        _check_out(out, inputs, overwrite)
    check_report(report)
    check_rate(rate)
    car = load_vehicle(vehicle) if vehicle is not None else None
    if _of_torque(estimator):
        _refuse_for_torque(
            {"--delay": delay, "--likelihood": likelihood or None, "--preset": preset, "--report": report}
        )
        with working(not json, 2) as stage:
            stage(f"reading {', '.join(log.name for log in logs)}")
            recorded = [read(log, dbc=dbc, names=names, bus=bus) for log in logs]
            stage("tuning")
            chosen, _ = choose(estimator, recorded[0], car)
            if not get_estimator(chosen).learns:
                raise UsageError(f"{chosen} has no noise to tune", "a Kalman filter of driver-torque", "choose another")
        tune_torque(chosen, recorded, car, rate, out, json)
        return
    if preset is not None:
        find_preset(preset)
    with working(not json, 3) as stage:
        stage(f"reading {', '.join(log.name for log in logs)}")
        recorded = [read(log, dbc=dbc, names=names, bus=bus) for log in logs]
        stage("tuning")
        result = tuned(
            recorded, estimator, car, preset=preset, delay=delay, likelihood=True if likelihood else None, rate=rate,
            name=out.stem if out is not None else "own", judge=lambda run: check_with_vehicle(run, run.log, car),
        )  # fmt: skip
        stage("writing")
        _write(result, out, report, command_line())
    told = told_of(result, out, report)
    if json:
        typer.echo(json_module.dumps(told, indent=2, ensure_ascii=False, allow_nan=False))
    else:
        _say(result, told)


def _of_torque(estimator: str) -> bool:
    """Whether an estimator, or a family, is of the driver's torque."""
    from codriver.observers.driver_torque_family import FAMILY
    from codriver.observers.registry import ESTIMATORS

    return estimator == FAMILY or (estimator in ESTIMATORS and ESTIMATORS[estimator].family == FAMILY)


def _refuse_for_torque(given: dict[str, Any]) -> None:
    """Options that the noise of a driver's torque has not.

    Raises:
        UsageError: one was given.
    """
    from codriver.errors import UsageError

    strange = [option for option, value in given.items() if value is not None]
    if strange:
        raise UsageError(
            f"{', '.join(strange)} for a driver's torque",
            "its noise is found by maximum likelihood alone",
            "leave it out",
        )


def _write(result: Tuning, out: Path | None, report: Path | None, command: str) -> None:
    """Write preset and report: both or neither.

    Raises:
        LogError: a file cannot be written.
    """
    from contextlib import ExitStack

    from codriver.logs.write import complete_or_nothing
    from codriver.observers import save_preset
    from codriver.report.document import write_document
    from codriver.report.tuning import tuning_document

    with ExitStack() as drafts:
        if report is not None:
            draft = drafts.enter_context(complete_or_nothing(report))
            write_document(tuning_document(result, str(out or ""), command), draft)
        if out is not None:
            save_preset(result.preset, drafts.enter_context(complete_or_nothing(out)))


def _check_out(out: Path, inputs: list[Path | None], overwrite: bool) -> None:
    """Whether a preset can be written here, asked before the long work.

    Raises:
        UsageError: it cannot, or it would replace an input, a preset without `overwrite`, or what is no preset.
    """
    import os

    from codriver.errors import UsageError
    from codriver.observers import PRESETS, find_preset
    from codriver.observers.torque_noise import TORQUE_NOISES, find_torque_noise

    if out.suffix != ".toml" or out.is_dir():
        raise UsageError(f"-o {out}", "the name of a file ending in .toml", "rename it")
    if out.stem in PRESETS or out.stem in TORQUE_NOISES:
        raise UsageError(f"-o {out}: '{out.stem}' is the name of a paper's preset", "a name of your own", "rename it")
    if not out.parent.is_dir() or not os.access(out.parent, os.W_OK):
        raise UsageError(
            f"-o {out}: the folder does not exist or may not be written", "a folder to write into", "check it"
        )
    if not out.exists():
        return
    if any(path is not None and path.exists() and out.samefile(path) for path in inputs):
        raise UsageError(f"-o {out} is an input", "another name", "choose another -o; inputs are kept")
    if not overwrite:
        raise UsageError(f"-o {out} is there already", "the name of a new file", "choose another, or say --overwrite")
    for read in (find_preset, find_torque_noise):
        try:
            read(out)
        except UsageError:
            continue
        return
    raise UsageError(f"-o {out} is there already and no preset", "a new name", "choose another -o")


def told_of(result: Tuning, out: Path | None, report: Path | None) -> dict[str, Any]:
    """What --json prints."""
    fit = result.noise
    return {
        "estimator": result.estimator,
        "vehicle": result.vehicle,
        "logs": list(result.logs),
        "counted_s": round(result.seconds, 3),
        "blocks": result.blocks,
        "rate_hz": round(1 / result.dt, 6),
        "sensor_noise": {"acceleration": _finite(result.sensors[0]), "speed": _finite(result.sensors[1])},
        "begun_with": result.begun.name,
        "preset": {
            "name": result.preset.name, "source": result.preset.source, "ell": result.preset.ell,
            "Q": list(result.preset.Q), "R": list(result.preset.R),
        },
        "wanted_delay_s": result.delay,
        "log_likelihood": {"begun": fit.start.log_likelihood if fit else None, "found": result.evidence.log_likelihood},
        "most_likely_ell": {"ell": result.profile.best, "sd_of_log": _finite(result.profile.spread)},
        "converged": fit.converged if fit else None,
        "ratios": [
            {"name": r.name, "begun": r.start, "found": r.found, "sd_of_log": _finite(r.spread), "told": r.told}
            for r in (fit.ratios if fit else ())
        ],
        "settings": [_point(p) for p in result.marks],
        "chosen": _point(result.chosen),
        "result": str(out) if out is not None else None,
        "report": str(report) if report is not None else None,
    }  # fmt: skip


def _point(p: Point) -> dict[str, Any]:
    return {
        "ell": p.ell, "delay_s": p.slow_delay, "delay_at_these_rates_s": p.delay, "bandwidth_hz": p.bandwidth,
        "jerk_noise": _finite(p.noise), "calm_jerk": p.calm,
    }  # fmt: skip


def _finite(x: float) -> float | None:
    """A number; None for what JSON does not know."""
    return x if abs(x) < float("inf") else None


def _say(result: Tuning, told: dict[str, Any]) -> None:
    """The summary for people."""
    from rich.markup import escape
    from rich.table import Table

    from codriver.cli.terminal import console
    from codriver.tune.likelihood import LEAST_BLOCKS

    out = console()
    out.print(
        f"[bold]{result.estimator}[/] tuned on {escape(', '.join(result.logs))}: {result.seconds:.0f} s that count, at "
        f"{1 / result.dt:g} Hz; sensors scatter {result.sensors[0]:.3g} m/s^2 and {result.sensors[1]:.3g} m/s\n"
    )
    table = Table(box=None, pad_edge=False)
    for column in ("setting", "ell", "delay, s", "-3 dB, Hz", "jerk noise, m/s^3", "in calm stretches"):
        table.add_column(column, justify="left" if column == "setting" else "right")
    for label, p in [*((result.begun.name, p) for p in result.marks), (result.preset.name, result.chosen)]:
        calm = f"{p.calm:.3f}" if p.calm is not None else "-"
        table.add_row(label, f"{p.ell:.3g}", f"{p.slow_delay:.2f}", f"{p.bandwidth:.2f}", f"{p.noise:.3f}", calm)
    out.print(table)
    if result.noise is not None:
        fit = result.noise
        gain = fit.found.log_likelihood - fit.start.log_likelihood
        out.print(
            f"\nlog likelihood {gain:+.0f} for {fit.found.count} rows"
            + ("" if fit.converged else "; [yellow]the search did not end by itself[/]")
        )
        for r in fit.ratios:
            said = (
                f"{r.found:.3g} (times or over {2.718281828**r.spread:.2f})" if r.told else "not told by these drives"
            )
            out.print(f"  {r.name:<22} {r.start:.3g} -> {said}")
    out.print(f"\nat the Q and R of {result.begun.name} the rows are most likely for ell = {result.profile.best:.3g}")
    if result.blocks < LEAST_BLOCKS:
        out.print(
            f"how sure that is cannot be said: too few blocks of 10 s count ({result.blocks}, {LEAST_BLOCKS} are needed)"
        )
    if told["result"]:
        out.print(f"\nwrote {escape(told['result'])}; use it with --preset {escape(told['result'])}")
    if told["report"]:
        out.print(f"wrote {escape(told['report'])}")
