"""codriver tune driver-torque: the noise of a driver-torque filter from records, by maximum likelihood."""

from __future__ import annotations

import json as json_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

if TYPE_CHECKING:
    from codriver.signals import Log
    from codriver.torque_fit import TorqueFit
    from codriver.vehicles import Vehicle


def tune_torque(
    name: str, logs: list[Log], vehicle: Vehicle | None, rate: float | None, out: Path | None, as_json: bool
) -> None:
    """Fit, write the preset, and say what was found.

    Args:
        name: of an estimator that learns its noise.
        logs: records of one wheel.
        vehicle: its parameters.
        rate: ticks per second; from the logs by default.
        out: preset to write.
        as_json: print JSON and nothing else.
    """
    from codriver.observers.feed import suggest_rate
    from codriver.observers.registry import build
    from codriver.observers.torque_noise import save_torque_noise
    from codriver.torque_fit import fit_torque_noise

    probe = build(name, vehicle)
    assert vehicle is not None  # else the estimator could not be built
    rate = rate or max(suggest_rate(log, probe.measured) for log in logs)
    fit = fit_torque_noise(name, logs, vehicle, rate, out.stem if out is not None else "own")
    if out is not None:
        save_torque_noise(fit.noise, out)
    told = _told(name, fit, rate, out)
    if as_json:
        typer.echo(json_module.dumps(told, indent=2, ensure_ascii=False, allow_nan=False))
    else:
        _say(fit, told)


def _told(name: str, fit: TorqueFit, rate: float, out: Path | None) -> dict[str, Any]:
    noise = fit.noise
    return {
        "estimator": name, "rate_hz": rate, "counted": fit.rows, "looked_at_s": round(fit.seconds, 3),
        "log_likelihood": {f"order {o}, balance {c}": value for (o, c), value in fit.log_likelihood.items()},
        "preset": {"name": noise.name, "source": noise.source, **{k: v for k, v in noise.settings().items() if k != "preset"}},
        "result": str(out) if out is not None else None,
    }  # fmt: skip


def _say(fit: TorqueFit, told: dict[str, Any]) -> None:
    """The summary for people."""
    from math import pi

    from rich.markup import escape

    from codriver.cli.terminal import console

    screen, noise = console(), fit.noise
    walk = "a random walk" if noise.order == 1 else "an integrated random walk"
    what = "the driver's torque" if noise.balance == 0 else "the driver's torque beyond what bears the column's"
    others = sorted(fit.log_likelihood.values(), reverse=True)
    per = "N m per sqrt(s)" if noise.order == 1 else "N m/s per sqrt(s)"
    screen.print(
        f"[bold]{told['estimator']}[/] tuned at {told['rate_hz']:g} Hz on {fit.seconds:.0f} s, {fit.rows} angles that count\n"
        f"{what} is {walk} (log likelihood of the next best kind {others[1] - others[0]:+.0f})\n\n"
        f"  angle   {noise.angle * 180 / pi:.4g} deg, a sample\n  slip    {noise.slip * 180 / pi:.3g} deg per sqrt(s)\n"
        f"  rate    {noise.rate:.3g} rad/s per sqrt(s)\n  torque  {noise.torque:.3g} {per}"
    )
    if told["result"]:
        screen.print(f"\nwrote {escape(told['result'])}; use it with --preset {escape(told['result'])}")
