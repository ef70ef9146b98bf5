"""codriver estimate: from a recorded drive to estimates, a summary and a report."""

from __future__ import annotations

import json as json_module
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from codriver.cli.options import Bus, Dbc, Ell, EstimatorName, Form, Json, LogPath, Names, PresetName, VehicleName
from codriver.cli.steer_zero import SteerZeroText

if TYPE_CHECKING:
    from codriver.estimate import Estimate
    from codriver.signals import Log
    from codriver.trust import Check
    from codriver.vehicles import Vehicle


def estimate(
    estimator: EstimatorName,
    log: LogPath,
    out: Annotated[
        Path, typer.Option("-o", "--out", metavar="OUT", help="Result: .parquet, .csv or .mf4.", show_default=False)
    ],
    vehicle: VehicleName = None,
    dbc: Dbc = None,
    names: Names = None,
    ell: Ell = None,
    rate: Annotated[
        float | None, typer.Option("--rate", help="Ticks per second. Default: from the log.", show_default=False)
    ] = None,
    preset: PresetName = None,
    form: Form = "kalman",
    bus: Bus = None,
    report: Annotated[Path | None, typer.Option("--report", help="Report to write (HTML).", show_default=False)] = None,
    json: Json = False,
    steer_zero: SteerZeroText = None,
) -> None:
    """Estimate what the driver intends, or does at the steering wheel, or how a motorcycle leans, from a recorded drive.

    Examples: codriver estimate intent drive.blf --dbc car.dbc --names names.toml --vehicle bisoffi2017 -o drive.parquet;
    codriver estimate driver-torque drive.csv --names names.toml --vehicle wheel.toml -o torque.parquet;
    codriver estimate motorcycle ride.csv --names names.toml --vehicle sharp1971 -o lean.parquet
    """
    estimate_file(
        estimator, log, out, vehicle, dbc, names, ell, rate, preset, form, bus, report, json, steer_zero=steer_zero
    )


def estimate_file(
    estimator: str,
    path: Path,
    out: Path,
    vehicle_name: str | None = None,
    dbc: Path | None = None,
    names: Path | None = None,
    ell: float | None = None,
    rate: float | None = None,
    preset: str | None = None,
    form: str = "kalman",
    bus: int | None = None,
    report: Path | None = None,
    as_json: bool = False,
    truth: Log | None = None,
    work: Callable[..., Estimate] | None = None,
    steer_zero: str | None = None,
) -> Estimate:
    """What the command does; the demo calls it too, with the truth for its report, and `smooth`, with its own `work`."""
    from codriver.cli.options import check_inputs
    from codriver.cli.steer_zero import parse_steer_zero, tell_steer_zero, with_steer_zero
    from codriver.cli.terminal import command_line, say, working
    from codriver.logs import read
    from codriver.run import check_rate, choose, estimate_log
    from codriver.vehicles import load_vehicle

    check_inputs(path, dbc, names)
    _check_outputs(out, report, path)
    check_rate(rate)
    parse_steer_zero(steer_zero)
    vehicle = load_vehicle(vehicle_name) if vehicle_name is not None else None
    with working(not as_json, 3) as stage:
        stage(f"reading {path.name}")
        recorded = read(path, dbc=dbc, names=names, bus=bus)
        name, why = choose(estimator, recorded, vehicle)
        stage(f"estimating: {name}")
        if steer_zero is not None:
            vehicle = with_steer_zero(steer_zero, name, recorded, vehicle, rate)
        run = work or estimate_log
        result = run(name, recorded, vehicle, ell=ell, rate=rate, preset=preset, form=form)
        _refuse_empty(result)
        check = check_with_vehicle(result, recorded, vehicle)
        stage(f"writing {out.name}" + (f" and {report.name}" if report is not None else ""))
        _write(result, check, out, report, command_line(), truth)
    told = {**_told(result, check, out, report, why), **tell_steer_zero(result, check, steer_zero)}
    if as_json:
        typer.echo(json_module.dumps(told, indent=2, ensure_ascii=False, allow_nan=False))
    else:
        say(told)
    return result


def _check_outputs(out: Path, report: Path | None, log: Path) -> None:
    """Whether result and report can be written, asked before the long work.

    Raises:
        UsageError: they cannot, or the result would replace the recording.
    """
    from codriver.logs.write import check_output

    check_output(out)
    refuse_recording(out, log)
    check_report(report)


def refuse_recording(out: Path, log: Path) -> None:
    """Keep a result from replacing the recording that it is made of.

    Raises:
        UsageError: it would.
    """
    from codriver.errors import UsageError

    if out.exists() and log.exists() and out.samefile(log):
        raise UsageError(f"-o {out} is the recording itself", "another name", "choose another -o; recordings are kept")


def check_report(report: Path | None) -> None:
    """Whether a report can be written, asked before the long work.

    Raises:
        UsageError: it cannot.
    """
    import os

    from codriver.errors import UsageError

    if report is None:
        return
    folder = report.parent
    if report.suffix.lower() not in (".html", ".htm"):
        raise UsageError(f"--report {report}", "a name ending in .html", "rename it")
    if not folder.is_dir():
        raise UsageError(f"--report {report}: the folder does not exist", "an existing folder", "create it first")
    if report.is_dir() or not os.access(folder, os.W_OK):
        raise UsageError(f"--report {report} cannot be written", "a file in a folder you may write", "choose another")


def _refuse_empty(result: Estimate) -> None:
    """An estimate without one valid moment is no result.

    Raises:
        LogError: no tick is valid; the message says why.
    """
    from codriver.errors import LogError

    if result.valid.any():
        return
    why = [f.text for f in result.check().findings if f.severity != "ok" and "too few to judge" not in f.text]
    raise LogError(
        f"{result.log.source}: {result.observer} has no valid moment in it. {'; '.join(why)}",
        "a drive in which the vehicle moves and all signals are there together, for some seconds at least",
        "see with `codriver info LOG` what the log holds and from when to when; nothing was written",
    )


def check_with_vehicle(result: Estimate, log: Log, vehicle: Vehicle | None) -> Check:
    """The verdict with what the log itself says of the vehicle's parameters, which innovations do not show."""
    check = result.check()
    if vehicle is None:
        return check
    from codriver.identify import check_vehicle_against_log
    from codriver.measured_torque import sensor_findings
    from codriver.observers.column import wheel_findings
    from codriver.observers.gears import unknown_gears
    from codriver.observers.motorcycle_vehicle import motorcycle_vehicle_findings

    said = {f.text for f in check.findings}
    found = [f for f in check_vehicle_against_log(log, vehicle) if f.severity != "ok" and f.text not in said]
    order = {"bad": 0, "warn": 1, "ok": 2}
    findings = sorted(
        [
            *(replace(f, text=f"vehicle file: {f.text}") for f in found),
            *(unknown_gears(log, vehicle) if "gear" in result.grid.values else []),
            *(motorcycle_vehicle_findings(vehicle, result.provenance) if "roll_angle" in result else []),
            *(wheel_findings(vehicle, result.provenance) if "column_torque" in result else []),
            *sensor_findings(result),
            *check.findings,
        ],
        key=lambda f: order[f.severity],
    )
    return replace(check, findings=tuple(findings))


def _write(result: Estimate, check: Check, out: Path, report: Path | None, command: str, truth: Log | None) -> None:
    """Write result and report: both or neither."""
    from codriver.estimate_file import save_estimate

    extra = {
        "command": command,
        "verdict": check.verdict,
        "findings": json_module.dumps([f"{f.severity}: {f.text}" for f in check.findings], ensure_ascii=False),
    }
    if report is None:
        save_estimate(result, out, extra)
        return
    from codriver.report import write_report

    # The report goes first, to a name of its own; it is renamed when the result is there too.
    draft = report.with_name(f".{report.name}.draft")
    try:
        write_report(
            result,
            draft,
            truth=truth,
            command=command,
            check=check,
            title=f"{result.observer}: {Path(result.log.source).name}",
        )
        save_estimate(result, out, extra)
        draft.replace(report)
    finally:
        draft.unlink(missing_ok=True)


def _told(result: Estimate, check: Check, out: Path, report: Path | None, why: str) -> dict[str, object]:
    """What the terminal shows and --json prints."""
    from codriver.measured_torque import compare_with_sensor
    from codriver.summary import summarise, tell_findings

    sensor = compare_with_sensor(result)
    return {
        "estimator": result.observer,
        "why": why,
        "settings": dict(result.provenance),
        "log": result.log.source,
        **summarise(result).to_dict(),
        "sensor": {**vars(sensor), "text": sensor.told()} if sensor is not None else None,
        "verdict": check.verdict,
        "findings": tell_findings(check),
        "result": str(out),
        "report": str(report) if report is not None else None,
    }
