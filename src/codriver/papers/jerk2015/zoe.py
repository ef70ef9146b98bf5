"""Beside the papers: a recorded electric car, whose actual torque departs from the request when its brake regenerates.

One scene of the nuScenes CAN bus expansion (Caesar et al. 2020, doi:10.1109/CVPR42600.2020.01164), a Renault Zoe in a city,
19 s. Nothing measures intention there, but request and actual torque are both recorded at 100 Hz, and where they differ the
vehicle's own jerk shows what the powertrain did and the driver did not ask for by the accelerator pedal.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from codriver.errors import CodriverError
from codriver.estimate import Estimate
from codriver.papers.drawing import BLUE, GREEN, PURPLE, RED, curve, measured, shades, window_between
from codriver.papers.item import Item
from codriver.papers.reproduction import Chapter
from codriver.report.document import BLACK, Chart, Plot
from codriver.signals import Log
from codriver.simulate.judge import rms

SCENE = "nuscenes-zoe-scene-0103"
_TITLE = "A real recording beside it: regeneration in an electric car"
_ELL = 2.0
_DIFFERENT = 0.15  # m/s^2 of u: beyond it the actual torque counts as differing from the request
_AROUND = 0.5  # s


def zoe_chapter(recordings: Path | None) -> Chapter:
    """The recording through intent-torque and the kinematic model; says so if it is not there."""
    folder = recordings / SCENE if recordings is not None else None
    if folder is None or not folder.is_dir():
        return Chapter(_TITLE, (
            f"The recording {SCENE} is not there; give the folder that holds it with --recordings.",
        ), ())  # fmt: skip
    from codriver.logs import read
    from codriver.run import estimate_log
    from codriver.vehicles import load_vehicle

    try:
        log = read(folder)
        car = load_vehicle("renault-zoe")
        intent = estimate_log("intent-torque", log, car, ell=_ELL, rate=100.0)
        kinematic = estimate_log("kinematic", log, ell=_ELL, rate=100.0)
    except CodriverError as error:
        return Chapter(_TITLE, (f"The recording {SCENE} could not be used: {error}",), ())
    n = min(len(intent.grid), len(kinematic.grid))
    u = np.abs(intent.columns["known_input"][:n])
    around = round(_AROUND / intent.grid.dt)
    near = np.convolve(u > _DIFFERENT, np.ones(2 * around + 1), "same") > 0
    use = near & intent.valid[:n] & kinematic.valid[:n]
    ours, theirs = intent.columns["intentional_jerk"][:n][use], kinematic.columns["longitudinal_jerk"][:n][use]
    items = (
        Item("the known input takes what the powertrain adds out of the jerk", None,
             f"{rms(ours):.2f} against {rms(theirs):.2f} m/s³", "", rms(ours) < rms(theirs),
             "not in the papers; rms jerk where the actual torque differs from the request, intention against kinematic"),
        Item("its peak is smaller", None, f"{np.max(np.abs(ours)):.2f} against {np.max(np.abs(theirs)):.2f} m/s³", "",
             bool(np.max(np.abs(ours)) < np.max(np.abs(theirs))),
             "greatest jerk there, intention against kinematic; what is left is the friction brake, which no signal gives"),
    )  # fmt: skip
    return Chapter(_TITLE, (
        "When the driver releases the accelerator and brakes, the motor's torque goes below the request. The kinematic jerk "
        "takes that for the driver's doing; intent-torque takes it out.",
    ), (_chart(log, intent, kinematic, n),), items)  # fmt: skip


def _chart(log: Log, intent: Estimate, kinematic: Estimate, n: int) -> Chart:
    a, b = float(intent.time[0]), float(intent.time[n - 1])
    part = window_between(intent, a, b)
    return Chart(
        "Renault Zoe in a city", "time (s)",
        (
            Plot("torque (N m)", (measured("actual", log, "engine_torque", a, b, GREEN),
                                  measured("requested", log, "engine_torque_request", a, b, PURPLE)), 140),
            Plot("speed (km/h)", (measured("measured", log, "longitudinal_speed", a, b, BLACK),), 110),
            Plot("jerk (m/s³)", (curve("intention", intent, "intentional_jerk", part, RED),
                                 curve("kinematic", kinematic, "longitudinal_jerk", part, BLUE)), 190, (0.0,)),
        ),
        "Pink: the brake is pressed.", shades(intent, part),
    )  # fmt: skip
