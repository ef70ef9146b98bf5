"""codriver simulate circuit: a two-point driver on a closed circuit."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from codriver.finding import Finding
    from codriver.models.two_point import TwoPointDriver
    from codriver.signals.signal import Array
    from codriver.simulate.rig import RigCar

Out = Annotated[Path, typer.Option("-o", "--out", metavar="DIR", help="Folder to write into.", show_default=False)]
Driver = Annotated[
    str,
    typer.Option("--driver", help="anna, ben, carla, david, emma, or a file of codriver identify driver (NAME.toml)."),
]
Given = Annotated[
    str,
    typer.Option(
        "--given", metavar="NAMES", help="Of a driver file: parameters it does not tell, taken as they were given."
    ),
]
Varied = Annotated[
    bool, typer.Option("--variability/--no-variability", help="A driver whose gains drift and who is noisy.")
]
Laps = Annotated[int, typer.Option("--laps", min=1, max=50, help="Laps each way; one takes 2 minutes at 50 km/h.")]
Seed = Annotated[int, typer.Option("--seed", min=0, help="Another seed, another drive of the same driver.")]
Ahead = Annotated[str, typer.Option("--anticipation", help="far-point, or mpc: a predictive plan in its place.")]
Direction = Annotated[str, typer.Option("--direction", help="left, right, or both: first left, then right.")]
Speed = Annotated[float, typer.Option("--speed", help="km/h, held.")]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace an earlier simulation in that folder.")]

LINEAR_TYRES = 8.0  # m/s2 sideways, from which linear tyres are told of


def circuit(
    out: Out,
    driver: Driver = "anna",
    given: Given = "",
    variability: Varied = True,
    laps: Laps = 4,
    seed: Seed = 0,
    anticipation: Ahead = "far-point",
    direction: Direction = "both",
    speed: Speed = 50.0,
    overwrite: Overwrite = False,
) -> None:
    """Let a two-point visual driver steer by torque round a closed circuit.

    The log has the wheel's angle and the driver's torque by sensors, and what the simulator knows of car and road.

    Example: codriver simulate circuit -o laps --driver ben
    """
    from codriver.cli.terminal import console, say_findings
    from codriver.identify.regression import rms
    from codriver.simulate.circuit import CircuitSetting
    from codriver.simulate.circuit_files import FILES, write_circuit
    from codriver.simulate.folder import refuse_earlier, refuse_foreign
    from codriver.simulate.variability import Variability

    refuse_foreign(out, "circuit", FILES)
    refuse_earlier(out, overwrite)
    setting = CircuitSetting(
        who_drives(driver, given), Variability() if variability else None, anticipation, laps=laps, direction=direction,
        car=car_at(speed),
    )  # fmt: skip
    files, drive = write_circuit(out, setting, seed, file_name(driver))
    console().print(
        f"{driver}, {'varying' if variability else 'always the same'}, anticipation by {anticipation}, seed {seed}\n"
        f"{drive.time[-1] / 60:.1f} minutes at {speed:g} km/h, {direction}: "
        f"off the path by {rms(drive.offset):.2f} m (rms), {abs(drive.offset).max():.2f} m at most, "
        f"driver's torque {rms(drive.driver_torque):.2f} N m (rms)\n"
        f"wrote {', '.join(str(p) for p in vars(files).values())}",
        markup=False,
    )
    say_findings(
        console(), [{"severity": f.severity, "text": f.text} for f in hard_bends(setting.car.speed, drive.curvature)]
    )


def hard_bends(speed: float, curvature: Array) -> list[Finding]:
    """A warning where a path at a speed asks more of the tyres than a linear model tells.

    Args:
        speed: m/s.
        curvature: of the path, 1/m.
    """
    from codriver.finding import Finding

    asked = speed**2 * float(abs(curvature).max())
    if asked < LINEAR_TYRES:
        return []
    text = f"the bends ask {asked:.1f} m/s2 sideways at {3.6 * speed:.0f} km/h, and the car's tyres are linear"
    return [Finding("warn", f"{text}: no real car drives so from about {LINEAR_TYRES:g} m/s2")]


def car_at(speed: float) -> RigCar:
    """The circuit's car at a speed, km/h.

    Raises:
        UsageError: it is no speed for the circuit.
    """
    from dataclasses import replace

    from codriver.errors import UsageError
    from codriver.simulate.rig import RigCar

    if not 10 <= speed <= 120:
        raise UsageError(f"--speed {speed:g}", "10 to 120 km/h", "choose one of these")
    return replace(RigCar(), speed=speed / 3.6)


def file_name(driver: str) -> str | None:
    """What a driver of a file is called: as his file. None for one by name."""
    return Path(driver).stem if Path(driver).suffix == ".toml" else None


def who_drives(driver: str, given: str) -> TwoPointDriver:
    """A driver by name, or of a file.

    Raises:
        UsageError: there is none, the file is wrong, or does not tell all of him.
    """
    from codriver.errors import UsageError
    from codriver.models.two_point_file import load_two_point, named
    from codriver.simulate.circuit_drivers import circuit_driver

    take = [named(word.strip()) for word in given.split(",") if word.strip()]
    if file_name(driver) is not None:
        return load_two_point(driver).driver(take)
    if take:
        raise UsageError(f"--given {given} for {driver}", "a driver file", "leave it out: his parameters are all known")
    return circuit_driver(driver)
