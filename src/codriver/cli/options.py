"""Options that commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

LogPath = Annotated[
    Path, typer.Argument(metavar="LOG", help="A recording: file, or folder of a known layout.", show_default=False)
]
Dbc = Annotated[Path | None, typer.Option("--dbc", help="CAN database, for raw CAN traces.", show_default=False)]
Names = Annotated[
    Path | None, typer.Option("--names", help="Names file (TOML): channels to standard names.", show_default=False)
]
Bus = Annotated[int | None, typer.Option("--bus", help="CAN channel to keep; all by default.", show_default=False)]
VehicleName = Annotated[
    str | None,
    typer.Option(
        "--vehicle",
        help="Built-in name or TOML file. Cars: bisoffi2017, bisoffi2015, renault-zoe; steering wheels: okamoto2019, "
        "okamoto2019-simulator; two-wheelers: sharp1971, meijaard2007, pasma2024, moore2012.",
        show_default=False,
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Write the summary as JSON to standard output, and nothing else.")]
Ell = Annotated[
    float | None,
    typer.Option(
        "--ell",
        help="The knob: larger is quicker and noisier. Default: the preset's (2 for bisoffi2017).",
        show_default=False,
    ),
]
PresetName = Annotated[
    str | None,
    typer.Option(
        "--preset",
        help="Noise of a paper, or a preset file (TOML). Default: bisoffi2017 (intent-torque's paper has bisoffi2015); "
        "driver-torque fits its noise to the log ('driver' is built in; driver-torque-pi: okamoto2019, okamoto2019-simulator).",
        show_default=False,
    ),
]
Form = Annotated[str, typer.Option("--form", help="kalman (missing rows exact) or constant (the papers' gain; small).")]
EstimatorName = Annotated[
    str,
    typer.Argument(
        metavar="ESTIMATOR",
        help="intent (intended acceleration and jerk), driver-torque (at the steering wheel) or motorcycle (lean, forces, rider's "
        "torque): the best the log can feed. Or one of them: intent-pedals, ..., motorcycle-imu; codriver info LOG lists all.",
        show_default=False,
    ),
]


def check_inputs(log: Path, dbc: Path | None, names: Path | None) -> None:
    """Whether the files named are there at all.

    Raises:
        UsageError: one is not; the message says which.
    """
    from codriver.errors import UsageError
    from codriver.vehicles import built_in_vehicles

    for path, what, option in (
        (log, "a recording", "LOG"),
        (dbc, "a CAN database", "--dbc"),
        (names, "a names file", "--names"),
    ):
        if path is not None and not path.exists():
            do = "check the path"
            if str(path) in built_in_vehicles():
                do = f"{path} is a built-in vehicle: give it by --vehicle; `codriver check vehicle {path}` shows it"
            raise UsageError(f"{option} {path} does not exist", what, do)
