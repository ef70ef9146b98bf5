"""--steer-zero: the zero of a two-wheeler's steering encoder, told, or found from the ride itself."""

from __future__ import annotations

import json
import shlex
import sys
from math import isfinite, pi
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from codriver.estimate import Estimate
    from codriver.observers.steer_zero import SteerZero
    from codriver.signals import Log
    from codriver.trust import Check
    from codriver.vehicles import Vehicle

OPTION, AUTO = "--steer-zero", "auto"
DEGREE = pi / 180
MOST, WIDEST = 20.0, 10.0  # degrees
SteerZeroText = Annotated[
    str | None,
    typer.Option(
        OPTION, metavar="auto|DEG[:SD]", show_default=False,
        help="Two-wheelers: degrees that the steering encoder shows straight ahead; with :SD motorcycle-ekf finds the rest while "
        "it runs. auto: found from the whole ride first. Default: steer_zero of the vehicle file, or 0.",
    ),
]  # fmt: skip


def parse_steer_zero(text: str | None) -> SteerZero | None:
    """A zero that is told; None where it is to be found, or nothing is said.

    Args:
        text: of the option.

    Raises:
        UsageError: it is neither "auto" nor DEG nor DEG:SD.
    """
    from codriver.errors import UsageError
    from codriver.observers.steer_zero import SteerZero

    if text is None or text == AUTO:
        return None
    value, colon, sd = text.partition(":")
    try:
        degrees, width = float(value), float(sd) if colon else 0.0
    except ValueError:
        degrees = width = float("nan")
    if not (isfinite(degrees) and isfinite(width) and abs(degrees) <= MOST and 0 <= width <= WIDEST):
        raise UsageError(
            f"{OPTION} {text}",
            f"auto, or degrees within {MOST:g}, as 0.3, or with a standard deviation within {WIDEST:g}, as 0.3:0.1", "correct it",
        )  # fmt: skip
    return SteerZero(degrees * DEGREE, width * DEGREE, f"{OPTION} {text}")


def with_steer_zero(
    text: str, name: str, log: Log | None, vehicle: Vehicle | None, rate: float | None = None
) -> Vehicle:
    """The vehicle with the zero that was told, or that the ride tells.

    Args:
        text: of the option.
        name: the estimator.
        log: the ride; None where there is none to find it from.
        vehicle: the machine.
        rate: ticks per second, for the search.

    Raises:
        UsageError: the estimator takes no steer angle, or there is no ride.
        LogError: the ride does not tell it.
    """
    from codriver.errors import UsageError
    from codriver.observers.registry import get_estimator

    estimator = get_estimator(name)
    if vehicle is None or estimator.family != "motorcycle" or "steer_angle" not in estimator.signals:
        raise UsageError(
            f"{OPTION} {text} with {name}" + (" and no vehicle" if vehicle is None else ""),
            "a two-wheeler's estimator that takes steer_angle, and a vehicle (--vehicle)", f"leave {OPTION} out",
        )  # fmt: skip
    told = parse_steer_zero(text)
    if told is not None:
        return told.of(vehicle)
    if log is None:
        raise UsageError(
            f"{OPTION} {AUTO} without a ride", "degrees", "find it with `codriver estimate motorcycle` first"
        )
    from codriver.identify import find_steer_zero

    by = name if name == "bicycle-kalman" else "motorcycle-ekf"
    return find_steer_zero(log, vehicle, by, rate=rate).of(vehicle)


def tell_steer_zero(result: Estimate, check: Check, text: str | None) -> dict[str, Any]:
    """What the summary says of the zero: what was taken out, the vehicle file's lines of what was found, what mends a wrong one.

    Args:
        result: the estimate.
        check: its verdict.
        text: of the option.
    """
    settings, told = result.provenance, dict[str, Any]()
    if "steer_zero" in settings:
        degrees, sd = (float(settings[key]) / DEGREE for key in ("steer_zero", "steer_zero_sd"))
        source = settings["steer_zero_source"]
        told["steer_zero"] = {"degrees": degrees, "sd_degrees": sd, "source": source}
        if text == AUTO:
            told["vehicle_file"] = (
                f'[steer_zero]\nvalue = {degrees:.4f}\nunit = "deg"\nsd = {sd:.4f}\nsource = {json.dumps(source)}'
            )
    mend = command_that_mends(check)
    return told | ({"mend": mend} if mend is not None else {})


def command_that_mends(check: Check) -> str | None:
    """The command line that takes out a zero which the verdict tells; None where it tells none."""
    said = [f.text for f in check.findings if f.severity == "bad" and f"{OPTION} " in f.text]
    if not said:
        return None
    value = said[0].split(f"{OPTION} ")[1].split()[0]
    kept, skip = [], False
    for word in sys.argv[1:]:
        if not skip and word != OPTION and not word.startswith(f"{OPTION}="):
            kept.append(word)
        skip = word == OPTION
    return f"codriver {shlex.join([*kept, OPTION, value])}"
