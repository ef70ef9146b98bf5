"""Whether the signals of a drive are fit for an identification at all; asked before anything is fitted.

Least squares finds numbers in any signals. What no fit can show afterwards is looked for beforehand:

* too few samples, or too few a second: the low-pass of 5 Hz needs 5 a second or more, 10 are better;
* a signal that is the same all the time;
* an accelerometer that does not follow the change of speed: wrong unit, wrong sign, stuck (`codriver.trust.sensors_agree`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from codriver.errors import LogError
from codriver.finding import Finding
from codriver.identify.brake_rows import short_name
from codriver.names import VOCABULARY
from codriver.signals import Log
from codriver.trust.sensors_agree import pedals_move, sensors_agree

LEAST_RATE, GOOD_RATE = 5.0, 10.0  # Hz
LEAST_SAMPLES = 3
LEAST_SECONDS = 5.0  # below it a signal may well stay the same
RESTS = ("longitudinal_speed", "brake_pressure")  # a car that stands, a brake that is not used: said elsewhere


def refuse_unsound(logs: Sequence[Log], needed: Sequence[str]) -> list[Finding]:
    """Refuse drives whose signals cannot be right.

    Args:
        logs: the drives.
        needed: signals that the identification uses; the accelerometer is held against the speed if it is among them.

    Returns:
        Warnings of what is odd, and may be right.

    Raises:
        MissingSignal: a log lacks a signal.
        LogError: its signals cannot be right; the message names the signal and the likely cause.
    """
    odd = []
    for log in logs:
        for name in needed:
            _signal(log, name)
        if "longitudinal_acceleration" in needed:
            odd += _motion(log)
    return odd


def _signal(log: Log, name: str) -> None:
    """Raises LogError where one signal has too few samples, too few a second, or one value."""
    s = log[name]
    there = s.values[np.isfinite(s.values)]
    if there.size < LEAST_SAMPLES or s.duration <= 0:
        raise LogError(
            f"{short_name(log)}: {name} has {there.size} samples over {s.duration:.3g} s",
            "minutes of driving, with stamps that increase",
            "record a longer drive, or see with `codriver info LOG` what it holds",
        )
    if s.rate < 0.9 * LEAST_RATE:  # clocks are not exact
        raise LogError(
            f"{short_name(log)}: {name} comes {s.rate:.3g} times a second, which is too slow for signals low-passed at 5 Hz",
            f"at least {LEAST_RATE:g} a second, {GOOD_RATE:g} or more are better",
            "record the signal faster",
        )
    if s.duration >= LEAST_SECONDS and np.ptp(there) == 0 and (there[0] != 0 or name not in RESTS):
        raise LogError(
            f"{short_name(log)}: {name} is {there[0]:.4g} {VOCABULARY[name].unit} all the time",
            "a signal that changes while the car drives",
            "is the sensor stuck, or another signal mapped in the names file?",
        )


def _motion(log: Log) -> list[Finding]:
    """Warnings; raises LogError where accelerometer, speed and pressure do not go together."""
    motion = sensors_agree(log)
    wrong = [finding.text for finding in motion if finding.severity == "bad"]
    if wrong:
        raise LogError(
            f"{short_name(log)}: {wrong[0]}",
            "an accelerometer (longitudinal_acceleration) that shows the change of longitudinal_speed",
            "check unit and sign of both in the names file; `codriver check names FILE` shows them",
        )
    wrong = [finding.text for finding in pedals_move(log, {"brake_pressure"})]  # a ratio leaves braking out by it
    if wrong:
        raise LogError(f"{short_name(log)}: {wrong[0]}", "the master cylinder's pressure", "mend the names file")
    return [
        replace(finding, text=f"{short_name(log)}: {finding.text}") for finding in motion if finding.severity == "warn"
    ]
