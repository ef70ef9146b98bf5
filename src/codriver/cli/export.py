"""codriver export: an estimator for a control unit."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from codriver.cli.options import Ell, EstimatorName, Form, PresetName, VehicleName
from codriver.cli.steer_zero import SteerZeroText

app = typer.Typer(help="Export an estimator for a control unit.", no_args_is_help=True, rich_markup_mode=None)


@app.command("c")
def export_c_files(
    estimator: EstimatorName,
    dt: Annotated[float, typer.Option("--dt", metavar="S", help="Tick, s.", show_default=False)],
    out: Annotated[Path, typer.Option("-o", "--out", metavar="DIR", help="Folder to write.", show_default=False)],
    vehicle: VehicleName = None,
    real: Annotated[str, typer.Option("--real", help="double (bit-exact) or float.")] = "double",
    ell: Ell = None,
    preset: PresetName = None,
    form: Form = "kalman",
    steer_zero: SteerZeroText = None,
) -> None:
    """Write an estimator as C99: header, source, check program with golden vectors, Makefile, README."""
    from codriver.cli.steer_zero import with_steer_zero
    from codriver.cli.terminal import console
    from codriver.errors import UsageError
    from codriver.export import export_c
    from codriver.observers import ESTIMATORS, build, families
    from codriver.program import compile
    from codriver.vehicles import load_vehicle

    if estimator in families():
        raise UsageError(
            f"'{estimator}' stands for whatever a log can feed",
            "one estimator",
            f"name one: {', '.join(e.name for e in ESTIMATORS.values() if e.family == estimator)}",
        )
    car = load_vehicle(vehicle) if vehicle is not None else None
    if steer_zero is not None:
        car = with_steer_zero(steer_zero, estimator, None, car)
    observer = build(estimator, car, dt=dt, ell=ell, preset=preset, form=form)
    files = export_c(compile(observer), out, real)
    screen = console()
    if ESTIMATORS[estimator].learns and preset is None:
        screen.print(
            f"the noise is the preset '{ESTIMATORS[estimator].preset}'; one fitted to your own records: codriver tune {estimator}",
            markup=False,
        )
    for file in files:
        screen.print(f"wrote {file} ({file.stat().st_size} bytes)", markup=False)
    screen.print(f"check it: make -C {out} check", markup=False)
