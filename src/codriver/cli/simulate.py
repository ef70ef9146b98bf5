"""codriver simulate: long drives with known truth, as the files a logger would have left."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from codriver.cli.simulate_circuit import circuit
from codriver.cli.simulate_motorcycle import motorcycle
from codriver.cli.simulate_shared import shared

if TYPE_CHECKING:
    from collections.abc import Callable

    from codriver.simulate import RoadTest
    from codriver.vehicles import Vehicle

app = typer.Typer(help="Simulate a long drive with known truth.", no_args_is_help=True, rich_markup_mode=None)
app.command("circuit")(circuit)
app.command("motorcycle")(motorcycle)
app.command("shared")(shared)

Out = Annotated[Path, typer.Option("-o", "--out", metavar="DIR", help="Folder to write into.", show_default=False)]
Driver = Annotated[str, typer.Option("--driver", help="aggressive, anticipating, ordinary, nervous, smooth or brisk.")]
Seed = Annotated[int, typer.Option("--seed", min=0, help="Another seed, another drive of the same kind.")]
Duration = Annotated[
    float | None,
    typer.Option("--duration", help="End after so many seconds. Default: the whole way.", show_default=False),
]


Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace an earlier simulation in that folder.")]


@app.command("road-test")
def road_test(
    out: Out, driver: Driver = "ordinary", seed: Seed = 1, duration: Duration = None, overwrite: Overwrite = False
) -> None:
    """Drive 53 km of town, country and motorway, some 42 minutes, with the car of the 2017 paper.

    Example: codriver simulate road-test -o drive --driver smooth
    """
    from codriver.simulate import road_test

    _simulate(out, lambda: road_test(driver, seed, duration=duration), "bisoffi2017", None, overwrite)


@app.command("track")
def track(
    out: Out, driver: Driver = "ordinary", seed: Seed = 1, duration: Duration = None, overwrite: Overwrite = False
) -> None:
    """Drive two laps of a handling track with the car of the 2015 paper; writes its nominal vehicle.toml too.

    Example: codriver simulate track -o laps
    """
    from codriver.simulate import nominal_2015, track_test

    _simulate(
        out, lambda: track_test(driver, seed, duration=duration), str(out / "vehicle.toml"), nominal_2015(), overwrite
    )


@app.command("rig")
def rig(out: Out, seed: Seed = 0, duration: Duration = None, overwrite: Overwrite = False) -> None:
    """Record at a driving simulator: weights on its wheel, a chirp of its motor, and three minutes by a driver.

    The wheel is the one of the 2019 paper with some friction; it measures its angle in steps of 0.1 degree, and no torque.

    Example: codriver simulate rig -o rig
    """
    from dataclasses import replace

    from codriver.cli.terminal import console
    from codriver.errors import UsageError
    from codriver.identify.regression import rms
    from codriver.simulate.folder import refuse_earlier, refuse_foreign
    from codriver.simulate.rig import RigSetting
    from codriver.simulate.rig_files import FILES, write_rig

    refuse_foreign(out, "rig", FILES)
    refuse_earlier(out, overwrite)
    setting = RigSetting()
    if duration is not None:
        if not 5 <= duration <= 3600:
            raise UsageError(f"--duration {duration:g}", "5 to 3600 s", "choose one of these")
        setting = replace(setting, seconds=duration)
    files, drive = write_rig(out, setting, seed)
    wheel, torque = setting.wheel, drive.driver_torque
    console().print(
        f"a force-feedback wheel: J_s {wheel.inertia:g} kg m^2, b_s {wheel.damping:g} N m s/rad, T_c {wheel.friction:g} N m, "
        f"torque {setting.torque_scale:g} command + {setting.torque_offset:g} N m\n"
        f"{drive.time[-1]:.0f} s at {setting.car.speed * 3.6:.0f} km/h, driver's torque {rms(torque):.2f} N m (rms), seed {seed}\n"
        f"wrote {', '.join(str(p) for p in vars(files).values())}\n\n"
        f"then: codriver identify torque-scale {files.weights} -o {out / 'scale.toml'}\n"
        f"      codriver identify steering-wheel {files.chirp} --names {files.names} --vehicle {out / 'scale.toml'} "
        f"-o {out / 'wheel.toml'}\n"
        f"      codriver estimate driver-torque {files.drive} --names {files.names} --vehicle {out / 'wheel.toml'} "
        f"-o {out / 'torque.parquet'} --report {out / 'torque.html'}",
        markup=False,
    )


def _simulate(
    out: Path, drive: Callable[[], RoadTest], vehicle: str, nominal: Vehicle | None, overwrite: bool
) -> None:  # fmt: skip
    """Simulate, write, and say what was written and how to estimate from it."""
    import shlex

    from codriver.cli.terminal import console, working
    from codriver.simulate import refuse_foreign, write_drive
    from codriver.simulate.folder import refuse_earlier

    refuse_foreign(out, "simulated drive")
    refuse_earlier(out, overwrite)
    with working(True, 2) as stage:
        stage("driving")
        test = drive()
        stage("writing the CAN trace")
        files = write_drive(out, test, vehicle=nominal)
    trace = test.trace
    estimator = "intent-pedals" if nominal is None else "intent-torque"
    command = [
        "codriver", "estimate", estimator, str(files.log), "--dbc", str(files.dbc), "--names", str(files.names),
        "--vehicle", vehicle, "-o", str(out / "estimate.parquet"), "--report", str(out / "report.html"),
    ]  # fmt: skip
    minutes = float(trace["time"][-1]) / 60
    written = [files.log, files.dbc, files.names, files.truth, *([files.vehicle] if files.vehicle else [])]
    console().print(
        f"{trace.road.name}\n"
        f"{trace.style.name} driver, seed {test.seed}: {trace['distance'][-1] / 1000:.2f} km in {minutes:.1f} minutes, "
        f"{len(test.frames)} CAN frames, holes in them: {len(test.bus.holes)}\n"
        f"wrote {', '.join(str(path) for path in written)}\n\n"
        f"estimate from it: {shlex.join(command)}",
        markup=False,
    )
