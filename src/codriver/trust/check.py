"""Whether an estimate can be trusted, from its own innovations.

A filter whose assumptions hold leaves innovations that are as large as it says and that lean to neither side. What is
looked at, where the estimate is valid:

* share of time that is valid at all;
* scatter and lean of each row of innovations (`rows.py`, `innovations.py`), the lean over 1/ell seconds: how much they do together.
  Both are told as multiples of the band. The bands of our estimators cover the larger of the two in the worst of the last
  minute, so over a whole sound drive the larger is about 0.5; above 1.5 is a warning, above 2.5 the band is wrong, and
  where both are below 0.25 the band is wider than this sensor needs. A row that is no sensor's, but what the model takes for
  granted, is bad above 8;
* stretches where one of the two is above 16 for at least 1 s: wheel slip, a wrong ratio, a sensor fault;
* the sensors against each other: accelerometer and change of speed must go together, else a sign or a unit is wrong;
* the accelerometer offset: more than 3 m/s^2 is no road;
* pedals that go with the car and stay far below what a foot does: a unit that is too small;
* a steering wheel's encoder and what is known to act on its column (`steering.py`);
* gyroscope, accelerometer and steer angle of a two-wheeler against each other (`motorcycle.py`);
* brake and known input: a brake that is always pressed, a powertrain that adds more than the vehicle shows;
* used signals most of whose samples no vehicle can show: a unit or a scale is wrong.

What an observer does not tell is not judged, and what was left out of the outputs (`compile(observer, outputs=...)`) is
named: without innovations, or without the flag that says where they count, nothing is claimed of the band.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from codriver.finding import Finding
from codriver.observers.observer import Output
from codriver.signals import Grid, Log
from codriver.signals.signal import Array
from codriver.trust.motorcycle import motorcycle_findings
from codriver.trust.rows import row_findings, spans
from codriver.trust.sensors_agree import pedals_move, sensors_agree
from codriver.trust.steering import steering_findings

STEEP = 3.0  # m/s^2
# Known input over accelerometer, rms: a quarter to a third in the drives we have.
POWERFUL = 1.5
RANGES = ("speed_in_range", "certified")  # flags that are 1 where the speed is one that the observer was made for


@dataclass(frozen=True)
class Check:
    """The verdict.

    Attributes:
        findings: what was looked at, the worst first.
        valid_share: share of the ticks that are valid; NaN where the flag `valid` was left out of the outputs.
        nis: mean normalised innovation squared of each row, by row.
        lean: mean normalised square of the rows' block means, by row.
    """

    findings: tuple[Finding, ...]
    valid_share: float
    nis: Mapping[str, float]
    lean: Mapping[str, float]

    @property
    def trusted(self) -> bool:
        """Whether nothing bad was found."""
        return all(f.severity != "bad" for f in self.findings)

    @property
    def verdict(self) -> str:
        """One line."""
        bad = sum(f.severity == "bad" for f in self.findings)
        warn = sum(f.severity == "warn" for f in self.findings)
        if bad:
            return f"do not trust it as it is: {bad} bad finding{'s' * (bad > 1)}, {warn} warning{'s' * (warn != 1)}"
        return f"usable, with {warn} warning{'s' * (warn > 1)}" if warn else "nothing speaks against it"


def check_estimate(
    values: Mapping[str, Array],
    outputs: Sequence[Output],
    grid: Grid,
    measured: tuple[str, ...],
    log: Log,
    ell: float | None = None,
) -> Check:
    """Look at an estimate; see the module's docstring.

    Args:
        values: columns of the observer's outputs; some may have been left out.
        outputs: all outputs of the observer; their roles say what is what.
        grid: its sampled inputs.
        measured: names of the measurements.
        log: where it came from; its faults become warnings.
        ell: the observer's knob; the lean is taken over 1/ell s. None: HORIZON.
    """
    nis: dict[str, float] = {}
    lean: dict[str, float] = {}
    # An observer without the flag `valid` claims to be valid always; one whose flag was left out claims nothing.
    judged = "valid" in values or all(output.name != "valid" for output in outputs)
    valid = values["valid"] > 0.5 if "valid" in values else np.full(len(grid), judged)
    if judged:
        findings = [
            _validity(values, outputs, valid, grid),
            *row_findings(values, outputs, measured, valid, grid, ell, nis, lean),
        ]
    else:
        findings = [Finding("warn", "cannot be judged: the flag 'valid' is not among the outputs; compile with it")]
    if not measured:
        findings.append(Finding(
            "warn", "nothing measured is held against it, so a wrong parameter or unit would not show here; compare with kinematic",
        ))  # fmt: skip
    if {"longitudinal_acceleration", "longitudinal_speed"} <= set(measured):
        findings += sensors_agree(log)
    if "acceleration_offset" in values and valid.any():
        steep = valid & (np.abs(values["acceleration_offset"]) > STEEP)
        if steep.mean() > 0.01:
            always = steep.mean() > 0.2
            findings.append(Finding(
                "bad" if always else "warn", f"the accelerometer offset exceeds {STEEP:g} m/s^2 for {steep.mean():.0%} of the "
                "time, more than any road: "
                + ("is its axis, unit or sign right?" if always else "a slide, a crash, a bad sensor?"), spans(steep, grid),
            ))  # fmt: skip
    if (
        "turn_measured" in values
        and valid.any()
        and (share := float(np.mean(values["turn_measured"][valid] < 0.5))) > 0.01
    ):
        findings.append(Finding(
            "warn", f"no yaw rate for {share:.0%} of the valid time: the ride is taken to go straight on the average there, and "
            "roll is wrong in a long bend; map yaw_rate if there is one",
        ))  # fmt: skip
    findings += [*_driver(values, valid, grid), *pedals_move(log, grid.values)]
    findings += steering_findings(values, valid, grid, log)
    findings += motorcycle_findings(values, valid, grid, log)
    absurd = Log({name: log[name] for name in grid.values if name in log}).implausible()
    findings += [Finding("bad" if fault in absurd else "warn", fault) for fault in log.faults]
    order = {"bad": 0, "warn": 1, "ok": 2}
    return Check(
        tuple(sorted(findings, key=lambda f: order[f.severity])),
        (float(valid.mean()) if valid.size else 0.0) if judged else float("nan"), nis, lean,
    )  # fmt: skip


def _driver(values: Mapping[str, Array], valid: npt.NDArray[np.bool_], grid: Grid) -> list[Finding]:
    """Whether brake and powertrain say what a drive can show."""
    findings = []
    if "braking" in values and valid.any() and (share := float(np.mean(values["braking"][valid] > 0.5))) > 0.9:
        findings.append(Finding(
            "bad", f"the driver seems to brake for {share:.0%} of the valid time: a rest pressure above the brake threshold, or a "
            "switch with the opposite meaning? See offset in the names file, brake_threshold in the vehicle file",
        ))  # fmt: skip
    measured = grid.values.get("longitudinal_acceleration")
    if "known_input" in values and measured is not None:
        there = valid & np.isfinite(measured)
        size = float(np.sqrt(np.mean(measured[there] ** 2))) if there.any() else 0.0
        known = float(np.sqrt(np.mean(values["known_input"][there] ** 2))) if there.any() else 0.0
        if known > POWERFUL * max(size, 0.5):
            findings.append(Finding(
                "bad", f"what the powertrain adds to the driver's request is {known:.3g} m/s^2 rms, where the accelerometer shows "
                f"{size:.3g} m/s^2: a wrong unit or scale of torque or pedal, a wrong gear, or another vehicle's parameters",
            ))  # fmt: skip
    return findings


def _validity(
    values: Mapping[str, Array], outputs: Sequence[Output], valid: npt.NDArray[np.bool_], grid: Grid
) -> Finding:
    """How much of the drive is valid, and why the rest is not."""
    if not valid.size:
        return Finding("bad", "there is not one tick: the signals do not overlap, or the log is empty")
    share = float(valid.mean())
    reasons = []
    if "standstill" in values:
        reasons.append(f"standing {np.mean(values['standstill'] > 0.5):.0%}")
    if "inputs_known" in values:
        reasons.append(f"inputs missing {np.mean(values['inputs_known'] < 0.5):.0%}")
        if "standstill" in values:
            rest = ~valid & (values["standstill"] < 0.5) & (values["inputs_known"] > 0.5)
            if rest.mean() > 0.05:
                reasons.append(f"slower than 1 m/s, before the first speed or not settled {rest.mean():.0%}")
    for output in outputs:
        if (
            output.name in RANGES
            and output.name in values
            and (beyond := float(np.mean(values[output.name] < 0.5))) > 0.05
        ):
            reasons.append(f"{beyond:.0%} out of range or without a speed; {output.name} is {output.meaning}")
    text = f"{share:.0%} of {len(grid) * grid.dt:.1f} s is valid" + (f" ({', '.join(reasons)})" if reasons else "")
    return Finding("bad" if share < 0.05 else "warn" if share < 0.5 else "ok", text, spans(~valid, grid))
