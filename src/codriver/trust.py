"""Whether an estimate can be trusted, from its own innovations.

A filter whose assumptions hold leaves innovations that are as large as it says and that lean to neither side. What is
looked at, where the estimate is valid:

* share of time that is valid at all;
* scatter and lean of each row of innovations (`innovations.py`), the lean over 1/ell seconds: how much they do together.
  Both are told as multiples of the band. The bands of our estimators cover the larger of the two in the worst of the last
  minute, so over a whole sound drive the larger is about 0.5; above 1.5 is a warning, above 2.5 the band is wrong, and
  where both are below 0.25 the band is wider than this sensor needs;
* stretches where one of the two is above 16 for at least 1 s: wheel slip, a wrong ratio, a sensor fault;
* the sensors against each other: accelerometer and change of speed must go together, else a sign or a unit is wrong;
* the accelerometer offset: more than 3 m/s^2 is no road;
* pedals that go with the car and stay far below what a foot does: a unit that is too small;
* a steering wheel's encoder and what is known to act on its column (`steering_trust.py`);
* gyroscope, accelerometer and steer angle of a two-wheeler against each other (`motorcycle_trust.py`);
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
from codriver.innovations import Innovations, blocks, innovation_rows, row_name
from codriver.motorcycle_trust import motorcycle_findings
from codriver.observers.observer import Output
from codriver.sensors_agree import pedals_move, sensors_agree
from codriver.signals import Grid, Log
from codriver.signals.signal import Array
from codriver.steering_trust import ENCODER, steering_findings

# Of squares: scatter and lean of 1.5, 2.5, 4 and 0.25 times the band. And m/s^2.
LARGE, WRONG, BAD_STRETCH, SMALL, STEEP = 2.25, 6.25, 16.0, 0.0625, 3.0
SPIKE = 20.0  # times the usual scatter; bursts of jerk and shifts reach about half of that
HORIZON = 0.5  # s over which innovations may lean, where no knob says how quick the observer is
FEW = 50  # innovations; fewer say nothing
# What is likely where the innovations of a row are far too large for a second.
_LIKELY = dict.fromkeys(("acceleration", "speed"), "slip, a wrong ratio, or a sensor fault")
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
            *_rows(values, outputs, measured, valid, grid, ell, nis, lean),
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
                + ("is its axis, unit or sign right?" if always else "a slide, a crash, a bad sensor?"), _spans(steep, grid),
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
    return Finding("bad" if share < 0.05 else "warn" if share < 0.5 else "ok", text, _spans(~valid, grid))


def _rows(
    values: Mapping[str, Array], outputs: Sequence[Output], measured: tuple[str, ...], valid: npt.NDArray[np.bool_],
    grid: Grid, ell: float | None, nis: dict[str, float], lean: dict[str, float],
) -> list[Finding]:  # fmt: skip
    """What the innovations say, row by row, and which rows cannot say anything."""
    rows = innovation_rows(values, outputs)
    if not rows:
        # Where nothing is measured at all, the finding on that says more.
        there = measured or any(output.role == "innovation" for output in outputs)
        return [Finding("warn", "cannot be judged: no innovations among the outputs")] if there else []
    findings = []
    for row in rows:
        # A sensor that the observer can do without, and that the log does not have.
        if row.used.any() or np.isfinite(grid.values.get(row.row, np.zeros(1))).any():
            findings += _row(row, valid, grid, ell, nis, lean)
    for output in outputs:
        if output.role == "innovation" and output.name not in values:
            findings.append(
                Finding("warn", f"{row_name(output)}: cannot be judged: {output.name} is not among the outputs")
            )
    return findings


def _row(
    row: Innovations, valid: npt.NDArray[np.bool_], grid: Grid, ell: float | None,
    nis: dict[str, float], lean: dict[str, float],
) -> list[Finding]:  # fmt: skip
    """What the innovations of one measured row say."""
    name = row.row
    if row.sd is None:
        return [
            Finding("warn", f"{name}: cannot be judged: no standard deviation of its innovations among the outputs")
        ]
    findings, counted = [], valid & row.sound
    if (broken := valid & row.used & ~row.sound).any():
        findings.append(Finding(
            "bad", f"{name}: {broken.sum() * grid.dt:.3g} s where innovation or standard deviation is no number, or the latter is "
            "not above 0: an error in the observer", _spans(broken, grid),
        ))  # fmt: skip
    if counted.sum() < FEW:
        return [
            *findings,
            Finding("warn", f"{name}: only {int(counted.sum())} valid innovations, too few to judge the band"),
        ]
    normal = row.normalised()
    nis[name] = float(np.mean(normal[counted] ** 2))
    _, together, weight = blocks(normal, counted, max(round((1 / ell if ell else HORIZON) / grid.dt), 1))
    lean[name] = float(np.average(together, weights=weight))
    said = f"{name}: the innovations scatter {nis[name] ** 0.5:.2g} and lean {lean[name] ** 0.5:.2g} times what the band allows"
    larger = max(nis[name], lean[name])
    if larger > LARGE:
        cure = "check vehicle parameters and units" + (", or raise ell" if ell else "")
        findings.append(Finding("bad" if larger > WRONG else "warn", f"{said}; it is too narrow: {cure}"))
    elif larger < SMALL:
        findings.append(Finding("ok", f"{said}; the band is wide for this sensor"))
    else:
        findings.append(Finding("ok", f"{said} (1 is right, less is cautious)"))
    if name != ENCODER:  # its filter has a gate, and tells what it met there
        findings += _spikes(name, row.values[counted])
    second = max(round(1.0 / grid.dt), 1)
    scattering, leaning, count = blocks(normal, counted, second)
    worst = np.maximum(leaning, scattering)
    # The second in which the estimate becomes valid is left out: what happened before was unknown to the filter.
    whole = np.logical_and.reduceat(valid, np.arange(0, normal.size, second))
    bad = np.repeat((worst > BAD_STRETCH) & (count >= 5) & whole, second)[: len(grid)]
    if bad.any():
        likely = _LIKELY.get(name, "something the model does not know, or a sensor fault")
        findings.append(Finding(
            "warn", f"{name}: {bad.sum() * grid.dt:.1f} s where the innovations are up to {worst[whole].max() ** 0.5:.0f} times "
            f"their band: {likely}", _spans(bad, grid),
        ))  # fmt: skip
    return findings


def _spikes(name: str, values: Array) -> list[Finding]:
    """Single innovations far beyond the rest; the filter has no gate, so each of them went into the estimate."""
    middle = float(np.median(values))
    usual = 1.4826 * float(np.median(np.abs(values - middle)))  # the standard deviation, if they were normal
    count = int((np.abs(values - middle) > SPIKE * usual).sum()) if usual > 0 else 0
    if not 3 <= count < 0.05 * values.size:
        return []
    return [Finding(
        "warn", f"{name}: {count} values stand out by more than {SPIKE:g} times the usual scatter ({usual:.2g}): spikes? "
        "They are used as they are; a cleaner source is better",
    )]  # fmt: skip


def _spans(mask: npt.NDArray[np.bool_], grid: Grid) -> tuple[tuple[float, float], ...]:
    """Stretches of time where a mask holds."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    return tuple(
        (float(grid.time[i]), float(grid.time[k - 1] + grid.dt)) for i, k in zip(edges[::2], edges[1::2], strict=True)
    )
