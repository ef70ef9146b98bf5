"""codriver estimate: from a recorded drive to estimates, a summary and a report."""

from __future__ import annotations

import json as json_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from codriver.cli.options import Bus, Dbc, Ell, EstimatorName, Form, Json, LogPath, Names, PresetName, VehicleName

if TYPE_CHECKING:
    from codriver.estimate import Estimate
    from codriver.signals import Log
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
) -> None:
    """Estimate what the driver intends from a recorded drive.

    Example: codriver estimate intent drive.blf --dbc car.dbc --names names.toml --vehicle bisoffi2017 -o drive.parquet
    """
    estimate_log(estimator, log, out, vehicle, dbc, names, ell, rate, preset, form, bus, report, json)


def estimate_log(
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
) -> Estimate:
    """What the command does; the demo calls it too, with the truth for its report."""
    from codriver.cli.options import check_inputs
    from codriver.cli.terminal import command_line, say, working
    from codriver.errors import UsageError
    from codriver.logs import read
    from codriver.vehicles import load_vehicle

    check_inputs(path, dbc, names)
    _check_outputs(out, report, path)
    if rate is not None and not 1 <= rate <= 10000:
        raise UsageError(f"--rate {rate:g}", "1 to 10000 Hz", "choose a rate near the accelerometer's, such as 100")
    vehicle = load_vehicle(vehicle_name) if vehicle_name is not None else None
    with working(not as_json, 3) as stage:
        stage(f"reading {path.name}")
        recorded = read(path, dbc=dbc, names=names, bus=bus)
        name, why = _choose(estimator, recorded, vehicle)
        stage(f"estimating: {name}")
        result = run_estimator(name, recorded, vehicle, ell=ell, rate=rate, preset=preset, form=form)
        _refuse_empty(result)
        stage(f"writing {out.name}" + (f" and {report.name}" if report is not None else ""))
        _write(result, out, report, command_line(), truth)
    summary = summarise(result, str(out), str(report) if report is not None else None, why)
    if as_json:
        typer.echo(json_module.dumps(summary, indent=2, ensure_ascii=False, allow_nan=False))
    else:
        say(summary)
    return result


def _check_outputs(out: Path, report: Path | None, log: Path) -> None:
    """Whether result and report can be written, asked before the long work.

    Raises:
        UsageError: they cannot, or the result would replace the recording.
    """
    import os

    from codriver.errors import UsageError
    from codriver.logs.write import check_output

    check_output(out)
    if out.exists() and out.samefile(log):
        raise UsageError(f"-o {out} is the recording itself", "another name", "choose another -o; recordings are kept")
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


def _choose(estimator: str, log: Log, vehicle: Vehicle | None) -> tuple[str, str]:
    """The estimator's name, and why it was taken where the log decided."""
    from codriver.observers.feed import best, feeds
    from codriver.observers.registry import families, get_estimator

    if estimator not in families():
        return get_estimator(estimator).name, ""
    unusable = [fault for fault in log.faults if fault.endswith("it is left out")]
    feed = best(log, vehicle, log.source + (f" ({'; '.join(unusable)})" if unusable else ""), estimator)
    better = []
    for other in feeds(log, vehicle, estimator):
        if other.estimator == feed.estimator:
            break
        better.append(f"{other.estimator} lacks {other.lacks(vehicle)}")
    return feed.estimator, "the best this log can feed" + (f" ({'; '.join(better)})" if better else "")


def run_estimator(
    name: str,
    log: Log,
    vehicle: Vehicle | None,
    *,
    ell: float | None,
    rate: float | None,
    preset: str | None,
    form: str,
) -> Estimate:
    """Build, compile and run an estimator at the rate given or the log's."""
    from codriver.observers import build
    from codriver.observers.feed import suggest_rate
    from codriver.program import compile

    probe = build(name, vehicle, dt=0.01, ell=ell, preset=preset, form=form)
    rate = rate if rate is not None else suggest_rate(log, probe.measured or probe.required)
    observer = build(name, vehicle, dt=1.0 / rate, ell=ell, preset=preset, form=form)
    return compile(observer).run(log)


def _write(result: Estimate, out: Path, report: Path | None, command: str, truth: Log | None) -> None:
    """Write result and report: both or neither."""
    from codriver.estimate_file import save_estimate

    if report is None:
        save_estimate(result, out, {"command": command})
        return
    from codriver.report import write_report

    # The report goes first, to a name of its own; it is renamed when the result is there too.
    draft = report.with_name(f".{report.name}.draft")
    try:
        write_report(
            result, draft, truth=truth, command=command, title=f"{result.observer}: {Path(result.log.source).name}"
        )
        save_estimate(result, out, {"command": command})
        draft.replace(report)
    finally:
        draft.unlink(missing_ok=True)


def summarise(result: Estimate, out: str, report: str | None, why: str) -> dict[str, object]:
    """What the terminal shows and --json prints."""
    import numpy as np

    def number(value: float | np.floating[Any]) -> float | None:
        return float(value) if np.isfinite(value) else None  # JSON knows no NaN

    check = result.check()
    valid = result.valid
    rows: dict[str, dict[str, float | str | None]] = {}
    for output in result.estimates:
        values = result.columns[output.name][valid]
        sd = result.sd(output.name)
        rows[output.name] = {
            "unit": output.unit,
            "rms": number(np.sqrt(np.mean(values**2))) if values.size else None,
            "p5": number(np.quantile(values, 0.05)) if values.size else None,
            "p95": number(np.quantile(values, 0.95)) if values.size else None,
            "mean_sd": number(np.mean(sd[valid])) if sd is not None and values.size else None,
        }
    shifts = np.flatnonzero(np.diff(result.flag("gear_shift").astype(int)) == 1).size
    speed = result.grid.values.get("longitudinal_speed")
    return {
        "estimator": result.observer,
        "why": why,
        "settings": dict(result.provenance),
        "log": result.log.source,
        "duration_s": round(len(result.grid) * result.grid.dt, 3),
        "distance_m": round(float(np.nansum(np.abs(speed)) * result.grid.dt), 1) if speed is not None else None,
        "rate_hz": round(1 / result.grid.dt, 6),
        "valid_share": round(check.valid_share, 4),
        "gear_shifts": int(shifts),
        "braking_share": round(float(result.flag("braking").mean()), 4) if len(result.grid) else 0.0,
        "estimates": rows,
        "verdict": check.verdict,
        "findings": [{"severity": f.severity, "text": f.text} for f in check.findings],
        "result": out,
        "report": report,
    }
