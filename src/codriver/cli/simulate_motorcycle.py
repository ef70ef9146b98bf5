"""codriver simulate motorcycle: the rides of the 2018 paper on a nonlinear motorcycle."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Out = Annotated[Path, typer.Option("-o", "--out", metavar="DIR", help="Folder to write into.", show_default=False)]
Scenario = Annotated[str, typer.Option("--scenario", help="track, slalom or double-lane-change.")]
Noise = Annotated[
    float, typer.Option("--noise", metavar="PERCENT", help="Of gyroscope and accelerometer, of each one's rms.")
]
Bias = Annotated[
    float,
    typer.Option("--bias", metavar="TIMES", help="Constant biases: 1 for 0.5 deg/s and 0.2 m/s2 an axis, either way."),
]
SpeedError = Annotated[
    float, typer.Option("--speed-error", metavar="PERCENT", help="Of the wheel speed, beside lean and slip.")
]
Encoder = Annotated[int, typer.Option("--encoder", min=0, help="Counts of the steering encoder a turn; 0: ideal.")]
Zero = Annotated[
    float,
    typer.Option(
        "--zero", metavar="DEGREES", help="What the encoder shows when the bar is straight; names.toml keeps 0."
    ),
]
Imu = Annotated[
    tuple[float, float, float],
    typer.Option(
        "--imu",
        metavar="X Y Z",
        help="Its place from the road point below the rear frame's mass centre, m: forward, left, up. vehicle.toml tells it.",
    ),
]
Bank = Annotated[
    float,
    typer.Option(
        "--bank",
        metavar="DEGREES",
        help="Of the road, to both sides in turn. The truth's roll_angle is from the road; an estimate's from the vertical.",
    ),
]
RiderMass = Annotated[float, typer.Option("--rider-mass", metavar="KG", help="Of the rider; vehicle.toml keeps 75.")]
Tyres = Annotated[
    float, typer.Option("--tyre-stiffness", metavar="PERCENT", help="Of Sharp's; vehicle.toml keeps 100.")
]
Rate = Annotated[int, typer.Option("--rate", help="Of the log, Hz: 100, 200, 500, 1000, ...")]
Duration = Annotated[
    float | None,
    typer.Option("--duration", help="End after so many seconds. Default: the whole ride.", show_default=False),
]
Seed = Annotated[int, typer.Option("--seed", min=0, help="Another seed, other hands and other noise.")]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace an earlier simulation in that folder.")]


def motorcycle(
    out: Out,
    scenario: Scenario = "track",
    noise: Noise = 0.0,
    bias: Bias = 0.0,
    speed_error: SpeedError = 0.0,
    encoder: Encoder = 4096,
    zero: Zero = 0.0,
    imu: Imu = (0.1, 0.03, 0.8),
    bank: Bank = 0.0,
    rider_mass: RiderMass = 75.0,
    tyre_stiffness: Tyres = 100.0,
    rate: Rate = 100,
    duration: Duration = None,
    seed: Seed = 0,
    overwrite: Overwrite = False,
) -> None:
    """Ride a motorcycle round a track, through a slalom or a double lane change.

    The log has gyroscope and accelerometer in the leaning machine's axes, steer angle and wheel speed;
    the truth roll, forces and torque.

    Example: codriver simulate motorcycle -o ride --scenario slalom --noise 7.5 --bias 1
    """
    from math import degrees, radians

    from codriver.cli.terminal import console, working
    from codriver.identify.regression import rms
    from codriver.simulate.folder import refuse_earlier, refuse_foreign
    from codriver.simulate.motorcycle import RideSetting
    from codriver.simulate.motorcycle.files import FILES, write_ride

    refuse_foreign(out, "ride", FILES)
    refuse_earlier(out, overwrite)
    setting = RideSetting(
        scenario, noise / 100, bias, speed_error / 100, encoder, radians(zero), imu, radians(bank), rider_mass,
        tyre_stiffness / 100, rate=rate, seconds=duration,
    )  # fmt: skip
    with working(True, 1) as stage:
        stage("riding")
        files, record = write_ride(out, setting, seed)
    ride = record.ride
    seen = " from the road" if bank else ""
    roll, torque = ride.of("roll"), ride.of("rider_torque")
    console().print(
        f"{scenario}, rider of {rider_mass:g} kg, tyres of {tyre_stiffness:g} % stiffness, seed {seed}\n"
        f"{ride.time[-1]:.0f} s at {3.6 * ride.speed.min():.0f} to {3.6 * ride.speed.max():.0f} km/h, "
        f"roll {degrees(roll.min()):.0f} to {degrees(roll.max()):.0f} degrees{seen}, rider's torque {rms(torque):.1f} N m (rms), "
        f"off the path by {rms(ride.offset):.2f} m (rms), {abs(ride.offset).max():.2f} m at most\n"
        f"wrote {', '.join(str(p) for p in vars(files).values())}",
        markup=False,
    )
