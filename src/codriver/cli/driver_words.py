"""What the driver commands say."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from codriver.drivers.learned.evaluate import Evaluation
    from codriver.drivers.learned.learned_driver import LearnedDriver

NO_STEP = "a gp cannot run sample by sample, as in simulate shared or a live run; other models can"


def driver_told(
    driver: LearnedDriver, drives: Sequence[str], notes: Sequence[str], out: Path, report: Path | None
) -> dict[str, Any]:
    """What `driver fit` tells."""
    setting = driver.protocol.features
    return {
        "name": driver.name, "model": driver.kind, "logs": list(drives), "protocol": driver.protocol.name,
        "target": driver.target, "signals": list(driver.signals), "left_out": list(driver.left_out),
        "features": len(driver.features), "horizon_s": setting.horizon,
        **{name: value for name, value in driver.training.items() if name != "prints"},
        "parameters": {k: v for k, v in driver.regressor.get_params(deep=False).items() if isinstance(v, int | float | str)},
        "leaks": list(driver.leaks),
        "findings": [{"severity": f.severity, "text": f.text} for f in driver.doubts],
        "notes": [*notes, *((NO_STEP,) if driver.kind == "gp" else ())], "band_scale": driver.calibration.scale,
        "band_nu": driver.calibration.nu, "result": str(out), "report": str(report) if report is not None else None,
    }  # fmt: skip


def say_driver(told: dict[str, Any]) -> None:
    """Show it."""
    from codriver.cli.terminal import console, say_findings

    out = console()
    out.print(
        f"{told['name']}: {told['model']} learnt from {', '.join(told['logs'])}, "
        f"{told['minutes']:.1f} min, {told['rows']} rows of {told['features']} features",
        markup=False,
    )
    left = f"; left out, since the drives lack it: {', '.join(told['left_out'])}" if told["left_out"] else ""
    out.print(f"{told['target']} {told['horizon_s']:g} s ahead from {', '.join(told['signals'])}{left}", markup=False)
    if "held_out_rmse" in told:
        out.print(
            f"on blocks held out in turn: RMSE {told['held_out_rmse']:.3f} N m (the torque stays: "
            f"{told['held_out_stays_rmse']:.3f}), {told['held_out_inside95']:.0%} in the 95 % band",
            markup=False,
        )
    say_findings(out, told["findings"])
    for note in told["notes"]:
        out.print(f"  note {note}", markup=False)
    for leak in told["leaks"]:
        out.print(f"  leak {leak}", markup=False)
    out.print(f"\nwrote {told['result']}" + (f" and {told['report']}" if told["report"] else ""), markup=False)


def evaluation_told(
    found: Sequence[Evaluation], drives: Sequence[str], notes: Sequence[str], report: Path | None
) -> dict[str, Any]:
    """What `driver evaluate` tells."""
    first = found[0]
    return {
        "drives": list(drives), "target": first.target, "horizon_s": first.protocol.features.horizon,
        "left_out": list(first.left_out), "notes": list(notes), "lead": first.lead,
        "protocols": {e.protocol.name: {"folds": [s.fold for s in e.scores["pwc"]], "models": _models(e)} for e in found},
        "findings": [
            {"severity": f.severity, "text": f.text}
            for f in first.verdict(first.lead)
        ]
        + [
            {"severity": "bad", "text": f"protocol {e.protocol.name} leaks: {leak}"}
            for e in found[1:]
            for leak in e.leaks
        ],
        "report": str(report) if report is not None else None,
    }  # fmt: skip


def _models(e: Evaluation) -> dict[str, Any]:
    from codriver.drivers.learned.kinds import BASELINES

    made = {}
    for kind in e.kinds:
        spread = e.spread(kind)
        made[kind] = {
            "rmse_Nm": e.mean(kind), "rmse_se_Nm": _finite(spread), "ratio_to_pwc": e.mean(kind, "ratio"),
            "nrmse": _finite(e.mean(kind, "nrmse")), "inside68": e.mean(kind, "inside68"), "inside95": e.mean(kind, "inside95"),
            "log_density": e.mean(kind, "log_density"),
            "against": {other: e.against(kind, other) for other in BASELINES if other != kind},
            "fit_s": max(s.seconds for s in e.scores[kind]),
            "folds": [s.rmse for s in e.scores[kind]],
        }  # fmt: skip
    return made


def _finite(value: float) -> float | None:
    """None where there is no number, as JSON has it."""
    return value if isfinite(value) else None


def say_evaluation(told: dict[str, Any]) -> None:
    """Show it."""
    from rich.table import Table

    from codriver.cli.terminal import console, say_findings

    out = console()
    out.print(f"{', '.join(told['drives'])}: {told['target']} {told['horizon_s']:g} s ahead", markup=False)
    if told["left_out"]:
        out.print(f"left out, since the drives lack it: {', '.join(told['left_out'])}", markup=False)
    for note in told["notes"]:
        out.print(f"note {note}", markup=False)
    for name, one in told["protocols"].items():
        out.print(f"\nprotocol {name}; held out in turn: {', '.join(one['folds'])}\n", markup=False)
        table = Table(box=None, pad_edge=False)
        for column in (
            "model",
            "RMSE, N m",
            "+-",
            "of pwc",
            "in 68 %",
            "in 95 %",
            "log density",
            "fit, s",
            "vs pwc",
            "vs ridge",
        ):
            left = column in ("model", "vs pwc", "vs ridge")
            table.add_column(column, justify="left" if left else "right", no_wrap=True)
        for kind, row in one["models"].items():
            spread = f"{row['rmse_se_Nm']:.3f}" if row["rmse_se_Nm"] is not None else "-"
            table.add_row(
                kind, f"{row['rmse_Nm']:.4f}", spread, f"{row['ratio_to_pwc']:.3f}", f"{row['inside68']:.0%}",
                f"{row['inside95']:.0%}", f"{row['log_density']:.3f}", f"{row['fit_s']:.1f}",
                *(row["against"].get(other, "-").replace("not told apart", "~") for other in ("pwc", "ridge")),
            )  # fmt: skip
        out.print(table)
    out.print("vs: whether the gain is beyond two standard errors over blocks of 10 s; ~ cannot be told", markup=False)
    out.print(f"\n[bold]verdict on {told['lead']}[/]:")
    say_findings(out, told["findings"])
    if told["report"]:
        out.print(f"\nwrote {told['report']}", markup=False)


def say_likeness(told: dict[str, Any]) -> None:
    """Show which driver a drive is."""
    from rich.table import Table

    from codriver.cli.terminal import console, say_findings

    out = console()
    best = told["drivers"][0]
    sure = "certainly" if best["share"] > 0.99 else "probably" if best["share"] > 0.9 else "perhaps"
    verdict = f"{sure} {best['name']}" if best["like_own"] else f"none of these; {best['name']} is the least unlike"
    out.print(f"{told['drive']}: {verdict}\n", markup=False)
    table = Table(box=None, pad_edge=False)
    for column in ("driver", "model", "log density", "behind", "95 % interval", "confidence", "RMSE, N m", "in 95 %"):
        table.add_column(column, justify="left" if column in ("driver", "model") else "right")
    for one in told["drivers"]:
        interval = f"{one['behind_low']:.3f} to {one['behind_high']:.3f}" if one is not best else "-"
        table.add_row(
            one["name"], one["kind"], f"{one['log_density']:.3f}", f"{one['behind']:.3f}", interval, f"{one['share']:.0%}",
            f"{one['rmse']:.3f}", f"{one['inside95']:.0%}",
        )  # fmt: skip
    out.print(table)
    say_findings(out, told["findings"])
    for note in told["notes"]:
        out.print(f"note {note}", markup=False)
