"""codriver simulate shared: driver and assist motor turn one steering wheel."""

from __future__ import annotations

import json as json_module
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from codriver.cli.options import Json
from codriver.cli.simulate_circuit import (
    Ahead,
    Direction,
    Driver,
    Given,
    Out,
    Overwrite,
    Seed,
    Speed,
    Varied,
    hard_bends,
)

if TYPE_CHECKING:
    from codriver.finding import Finding
    from codriver.program import Program
    from codriver.simulate.shared_outcomes import Outcome

Model = Annotated[
    Path | None,
    typer.Option("--model", metavar="NAME.driver", help="Driver model, for --assist predicted.", show_default=False),
]
AssistKind = Annotated[
    str,
    typer.Option(
        "--assist", help="predicted (by the driver model), present (power steering), path (lane keeping) or none."
    ),
]
Gain = Annotated[
    float, typer.Option("--gain", min=0.0, max=10.0, help="Authority: the motor's torque per torque of the driver.")
]
UsedToIt = Annotated[
    float,
    typer.Option(
        "--used-to-it", min=0.0, max=1.0, help="0: he expects to turn the wheel alone; 1: he knows the motor."
    ),
]
Fading = Annotated[bool, typer.Option("--fade/--no-fade", help="Take authority back where the driver disagrees.")]
Laps = Annotated[int, typer.Option("--laps", min=1, max=50, help="Laps each way; one takes 2 minutes at 50 km/h.")]
Drives = Annotated[
    int, typer.Option("--drives", min=1, max=100, help="Compare over so many drives: this seed and the next.")
]
Report = Annotated[Path | None, typer.Option("--report", help="Report to write (HTML).", show_default=False)]
OTHER_SPEED = 0.05  # share by which a speed is another than the model's
FAR_AHEAD = 0.3  # s, horizon of a model beyond which it is told


def shared(
    out: Out, driver: Driver = "anna", given: Given = "", model: Model = None, assist: AssistKind = "predicted", gain: Gain = 0.5,
    used_to_it: UsedToIt = 1.0, fade: Fading = True, drives: Drives = 3, variability: Varied = True, laps: Laps = 1,
    seed: Seed = 0, anticipation: Ahead = "far-point", direction: Direction = "both", speed: Speed = 50.0,
    overwrite: Overwrite = False, report: Report = None, json: Json = False,
) -> None:  # fmt: skip
    """Let a two-point driver and an assist motor share a steering wheel, and compare with driving alone.

    The first drive is written as files. With a predicted torque the comparison has power steering at the same gain in it, too.
    Learn the driver model from other drives of the same driver without assist.

    Example: codriver simulate shared -o helped --driver anna --model anna.driver --assist predicted --gain 0.5
    """
    from dataclasses import replace

    from codriver.cli.estimate import check_report
    from codriver.cli.simulate_circuit import car_at, file_name, who_drives
    from codriver.cli.terminal import command_line, working
    from codriver.errors import UsageError
    from codriver.logs.write import complete_or_nothing
    from codriver.report.document import write_document
    from codriver.report.shared import shared_document
    from codriver.simulate.assist import Assist, Fade
    from codriver.simulate.circuit import CircuitSetting
    from codriver.simulate.circuit_files import FILES
    from codriver.simulate.folder import refuse_earlier, refuse_foreign
    from codriver.simulate.shared_control import SharedSetting, simulate_shared
    from codriver.simulate.shared_files import write_shared
    from codriver.simulate.shared_outcomes import compare_assists, verdict
    from codriver.simulate.variability import Variability

    if model is not None and assist != "predicted":
        raise UsageError(
            f"--model with --assist {assist}", "--assist predicted", "leave --model out: it would not be used"
        )
    refuse_foreign(out, "circuit", FILES)
    refuse_earlier(out, overwrite)
    check_report(report)
    chosen = Assist(assist, gain, fade=Fade() if fade else None)
    circuit = CircuitSetting(
        who_drives(driver, given), Variability() if variability else None, anticipation, laps=laps, direction=direction,
        car=car_at(speed),
    )  # fmt: skip
    kinds = dict.fromkeys(("none", *(("present",) if assist == "predicted" else ()), assist))
    with working(not json, len(kinds) + 2) as stage:
        stage("compiling the driver model")
        program, notes = _compiled(model, circuit.car.speed) if assist == "predicted" else (None, [])
        stage("driving")
        first = simulate_shared(SharedSetting(circuit, chosen, used_to_it), program, seed=seed)
        notes = [*notes, *hard_bends(circuit.car.speed, first.drive.curvature)]
        found: dict[str, list[Outcome]] = {}
        for kind in kinds:
            stage(f"comparing: {kind}")
            one = {kind: replace(chosen, kind=kind)}
            found |= compare_assists(circuit, one, program, range(seed, seed + drives), used_to_it)
        if report is None:
            files = write_shared(out, first, file_name(driver))
        else:
            alone = simulate_shared(SharedSetting(circuit), seed=seed)
            with complete_or_nothing(report) as draft:
                write_document(shared_document(first, alone, found, driver, command_line(), notes), draft)
                files = write_shared(out, first, file_name(driver))
    told: dict[str, Any] = {
        "driver": driver, "assist": assist, "gain": gain if assist != "none" else None,
        "used_to_it": used_to_it, "drives": drives, "seed": seed,
        "model": str(model) if model is not None else None, "outcomes": {k: _told(v) for k, v in found.items()},
        "findings": [{"severity": f.severity, "text": f.text} for f in (*notes, *verdict(found))],
        "files": [str(p) for p in vars(files).values()], "report": str(report) if report is not None else None,
    }  # fmt: skip
    if json:
        typer.echo(json_module.dumps(told, indent=2, ensure_ascii=False, allow_nan=False))
    else:
        _say(told)


def _compiled(model: Path | None, speed: float) -> tuple[Program, list[Finding]]:
    """A driver file as a compiled observer, and what is to be said of it at a speed, m/s."""
    from codriver.drivers.learned.driver_file import load_driver
    from codriver.drivers.learned.driver_observer import observer_of
    from codriver.errors import UsageError
    from codriver.finding import Finding
    from codriver.program import compile as compile_observer

    if model is None:
        raise UsageError(
            "--assist predicted without --model", "a driver file",
            "learn one: codriver simulate circuit -o laps, then codriver driver fit laps/drive.csv --names laps/names.toml "
            "--model ridge --signals steering_wheel_angle,road_curvature -o anna.driver",
        )  # fmt: skip
    known = load_driver(model)
    at = [float(known.scaling.mean[k]) for k, f in enumerate(known.features) if f.signal == "longitudinal_speed"]
    notes = []
    if at and abs(speed / at[0] - 1) > OTHER_SPEED:
        text = f"the driver model was learnt at {3.6 * at[0]:.0f} km/h on average, and drives at {3.6 * speed:.0f} km/h here"
        notes.append(Finding("warn", f"{text}: what it foretells may be far off"))
    return compile_observer(observer_of(known)), [*notes, *_far_ahead(known.protocol.features.horizon)]


def _far_ahead(horizon: float) -> list[Finding]:
    """A warning where a model foretells further than an assist torque should lead the driver, s."""
    from codriver.finding import Finding

    if horizon <= FAR_AHEAD:
        return []
    text = (
        f"the driver model foretells {horizon:g} s ahead: the motor turns the wheel that much before the driver would"
    )
    return [Finding("warn", f"{text}; learn one with --horizon {FAR_AHEAD:g} or less")]


def _told(found: list[Any]) -> dict[str, Any]:
    """Mean and standard deviation of each figure; None where there is none."""
    from codriver.simulate.shared_outcomes import FIGURES, mean_outcome

    mean, spread = (vars(one) for one in mean_outcome(found))
    return {
        name: {
            "mean": mean[name] if isfinite(mean[name]) else None,
            "sd": spread[name] if isfinite(spread[name]) else None,
        }
        for name, *_ in FIGURES
    }


def _say(told: dict[str, Any]) -> None:
    """Show it."""
    from rich.table import Table

    from codriver.cli.terminal import console, say_findings
    from codriver.simulate.shared_outcomes import FIGURES

    out = console()
    count = f"{told['drives']} drives, mean ± standard deviation" if told["drives"] > 1 else "1 drive"
    helped = "no assist" if told["assist"] == "none" else f"{told['assist']} with gain {told['gain']:g}"
    out.print(f"{told['driver']}, {helped}; {count}\n", markup=False)
    table = Table(box=None, pad_edge=False)
    table.add_column("")
    for name in told["outcomes"]:
        table.add_column("no assist" if name == "none" else name, justify="right")
    for figure, words, unit, factor in FIGURES:
        cells = [_cell(one[figure], factor) for one in told["outcomes"].values()]
        if any(cell != "-" for cell in cells):
            table.add_row(f"{words}, {unit}" if unit else words, *cells)
    out.print(table)
    if told["findings"]:
        out.print("\n[bold]verdict[/]:")
        say_findings(out, told["findings"])
    written = [*told["files"], *([told["report"]] if told["report"] else [])]
    out.print(f"\nwrote {', '.join(written)}", markup=False)


def _cell(one: dict[str, float | None], factor: float) -> str:
    if one["mean"] is None:
        return "-"
    spread = f" ± {factor * one['sd']:.2g}" if one["sd"] is not None else ""
    return f"{factor * one['mean']:.3g}{spread}"
