"""What the sensors of a motorcycle or bicycle say of each other, whatever the estimator tells of itself.

Some estimators of this family have no innovations, and the innovations of the others do not say what is wrong. Over blocks of
0.5 s while it moves:

* the vertical accelerometer shows g and more, the lateral one little: else gravity is in another axis, missing, or upside down;
* the roll rate follows the change of the lean that speed and yaw rate balance, sin phi = -v r / g;
* the yaw rate follows speed times steer angle, by a length of the order of a wheelbase;
* the pitch rate in bends is -v r^2 / g;
* v delta = w r + v delta_0, by least squares: delta_0 is the steering encoder's zero, unless the estimator finds it;
* the accelerometer is level (`motorcycle_mounting.py`);
* no sensor hangs or is at the end of its range (`motorcycle_still.py`);
* bends tell biases of roll and yaw rate, and scales (`motorcycle_bends.py`); without them
* the roll rate adds up to nothing, since nobody rolls over.

On rides without bends nothing is judged but gravity.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from codriver.finding import Finding
from codriver.models.road_frame import GRAVITY
from codriver.names import VOCABULARY
from codriver.signals import Grid, Log
from codriver.signals.grid import Flags
from codriver.signals.signal import Array
from codriver.trust.motorcycle_bends import bend_findings, fit_bends
from codriver.trust.motorcycle_mounting import mounting_findings
from codriver.trust.motorcycle_still import still_findings

SPEED = "longitudinal_speed"
NAMES = (
    SPEED, "roll_rate", "pitch_rate", "yaw_rate", "steer_angle", "longitudinal_acceleration", "lateral_acceleration",
    "vertical_acceleration",
)  # fmt: skip
DT, BLOCK = 0.02, 25  # s, ticks of a block
MOVING, LEAST = 2.0, 12  # m/s, blocks
# Standard deviations below which nothing is judged: rad/s, rad in 0.5 s, rad/s.
TURNING, SWAYING, PITCHING = 0.03, 0.03, 0.015
AGAINST, LOOSE, WITH = -0.4, 0.3, 0.5  # correlations
TIMES = 12.0  # roll rate and turn may differ by so much, degrees and radians by 57
SHORT, LONG = 0.25, 12.0  # m, speed times steer angle over yaw rate; 1 to 4 in the rides we have
UPWARDS = (0.75 * GRAVITY, 2.0 * GRAVITY)  # medians
DEGREE = np.pi / 180
OFF, SURELY, SURE = 0.25 * DEGREE, 4.0, 0.15 * DEGREE  # rad, standard errors, rad: the encoder's zero
ROLLED, BIASED = 1.5, 2 * np.pi / 180  # rad, rad/s: roll rate added up, and its mean
Values = Mapping[str, Array]


def motorcycle_findings(values: Values, valid: Flags, grid: Grid, log: Log) -> list[Finding]:
    """Hold the sensors of a two-wheeler against each other; nothing to say of estimates of something else.

    Args:
        values: columns of the observer's outputs.
        valid: where it is valid.
        grid: its sampled inputs.
        log: where it came from.
    """
    if "roll_angle" not in values or "roll_rate" not in grid.values or not {SPEED, "roll_rate"} <= set(log):
        return []
    columns = _columns(log)
    moving = columns[SPEED] > MOVING
    if moving.sum() < LEAST * BLOCK:
        least = LEAST * BLOCK * DT
        return [
            Finding(
                "warn",
                f"{moving.sum() * DT:.3g} s of riding: too short to tell wrong signs, units, axes or biases ({least:g} s)",
            )
        ]
    used = set(grid.values)
    blocks = {name: _blocks(np.where(moving, column, np.nan)) for name, column in _with_turn(columns).items()}
    mounted, askew = mounting_findings(columns, moving, DT, BLOCK, used)
    bends = fit_bends(columns, moving, DT, BLOCK)
    return [
        *_seldom(log, used),
        *still_findings({name: log[name] for name in NAMES if name in log}, log[SPEED], MOVING, used),
        *_gravity({name: column[moving] for name, column in columns.items()}, used),
        *mounted,
        *_bends(blocks, used),
        *_zero(blocks, values, used),
        *(bend_findings(bends, values, valid, askew) if bends is not None else []),
        *(_rolled(columns["roll_rate"][moving], values, valid) if bends is None or bends.sway is None else []),
    ]


def _columns(log: Log) -> dict[str, Array]:
    """The signals on one tick; NaN in gaps, which are longer than a value holds, and than one and a half steps of a slow signal."""
    grid = log.sample([name for name in NAMES if name in log], DT)
    columns = {}
    for name, column in grid.values.items():
        signal = log[name]
        stamps = signal.time[np.isfinite(signal.values)]
        if not stamps.size:
            columns[name] = np.full(column.size, np.nan)
            continue
        age = grid.time - stamps[np.maximum(np.searchsorted(stamps, grid.time + DT / 2) - 1, 0)]
        longest = max(VOCABULARY[name].hold, 1.5 / signal.rate if len(signal) > 1 else 0.0)
        columns[name] = np.where(np.abs(age) <= longest, column, np.nan)
    return columns


def _seldom(log: Log, used: set[str]) -> list[Finding]:
    """Signals that come so seldom that their last value does not hold until the next."""
    findings = []
    for name in NAMES:
        hold = VOCABULARY[name].hold
        if name in used and name in log and len(log[name]) > 2 and log[name].rate * hold < 0.95:
            findings.append(Finding(
                "warn", f"{name} comes every {1 / log[name].rate:.2g} s, and a value holds for {hold:g} s: between, nothing is "
                f"valid. Log it at {2 / hold:.2g} Hz or more, or interpolate it before",
            ))  # fmt: skip
    return findings


def _with_turn(columns: Values) -> dict[str, Array]:
    """The columns, and what follows from speed, yaw rate and steer angle."""
    found = dict(columns)
    v = columns[SPEED]
    if "yaw_rate" in columns:
        turn = v * columns["yaw_rate"] / GRAVITY
        found |= {"lean": np.arcsin(np.clip(-turn, -0.95, 0.95)), "turn": -turn * columns["yaw_rate"]}
    if "steer_angle" in columns:
        found["course"] = v * columns["steer_angle"]
    return found


def _blocks(column: Array) -> Array:
    """Means of blocks; NaN where a tick is missing."""
    n = column.size // BLOCK
    return column[: n * BLOCK].reshape(n, BLOCK).mean(axis=1)


def _severity(name: str, used: set[str]) -> str:
    return "bad" if name in used else "warn"


def _gravity(columns: Values, used: set[str]) -> list[Finding]:
    """Whether the accelerometer shows gravity upwards, and only there."""
    findings = []
    up, side = (columns.get(name, np.zeros(0)) for name in ("vertical_acceleration", "lateral_acceleration"))
    up, side = up[np.isfinite(up)], side[np.isfinite(side)]
    if up.size and not UPWARDS[0] < (shown := float(np.median(up))) < UPWARDS[1]:
        if -UPWARDS[1] < shown < -UPWARDS[0]:
            likely = "z down, or the IMU upside down? y and z of gyroscope and accelerometer then need sign = -1 in the names file"
        elif 0.75 < shown < 2.0:
            likely = "g read as m/s^2?"
        elif abs(shown) > 5 * GRAVITY:
            likely = "m/s^2 read as g?"
        else:
            likely = "gravity taken out of it, or another axis?"
        findings.append(Finding(
            _severity("vertical_acceleration", used),
            f"vertical_acceleration shows {shown:.3g} m/s^2 (median) where {GRAVITY:.3g} and more is right: {likely}",
        ))  # fmt: skip
    if side.size and (shown := float(np.median(np.abs(side)))) > 0.5 * GRAVITY:
        findings.append(Finding(
            _severity("lateral_acceleration", used),
            f"lateral_acceleration shows {shown:.3g} m/s^2 (median) where a machine in balance has next to none: another axis, or "
            "m/s^2 read as g?",
        ))  # fmt: skip
    return findings


def _pair(x: Array, y: Array) -> tuple[Array, Array]:
    """Both where both are there."""
    there = np.isfinite(x) & np.isfinite(y)
    return x[there], y[there]


def _goes_with(x: Array, y: Array) -> float:
    """Correlation; 0 where one of them never changes."""
    return float(np.corrcoef(x, y)[0, 1]) if x.std() > 0 and y.std() > 0 else 0.0


def _bends(blocks: dict[str, Array], used: set[str]) -> list[Finding]:
    """What the gyroscope's axes and the steer angle say of the same bends."""
    if "yaw_rate" not in blocks:
        return []
    findings, steers = [], None
    if "course" in blocks:
        course, yaw = _pair(blocks["course"], blocks["yaw_rate"])
        turned = max(yaw.std(), course.std() / 2) if course.size >= LEAST else 0.0
        if turned > TURNING and yaw.std() > 0:
            steers = _goes_with(course, yaw)
            length = float(course.std() / yaw.std())
            if abs(steers) > WITH and not SHORT < length < LONG:
                likely = (
                    "steer angle in degrees read as radians, or gyroscope in radians read as degrees"
                    if length > LONG
                    else "steer angle in radians read as degrees, or gyroscope in degrees read as radians"
                )
                findings.append(Finding(
                    _severity("steer_angle", used), f"speed times steer angle over yaw rate is {length:.2g} m, where a wheelbase "
                    f"is 1 to 2: {likely}?",
                ))  # fmt: skip
    rate = 0.5 * (blocks["roll_rate"][1:] + blocks["roll_rate"][:-1]) * BLOCK * DT
    change, rate = _pair(np.diff(blocks["lean"]), rate)
    leans = None
    if change.size >= LEAST and change.std() > SWAYING:
        leans = _goes_with(rate, change)
        ratio = float(change.std() / rate.std()) if rate.std() > 0 else np.inf
        said = f"roll rate and the lean that speed and yaw rate balance: correlation {leans:.2f}"
        if leans < AGAINST:
            wrong = "yaw_rate" if steers is not None and steers < AGAINST else "roll_rate"
            other = "" if steers is not None else ", or the yaw rate's"
            findings.append(Finding(
                "bad", f"{said}; the sign of {wrong} is wrong{other}: set sign = -1 in the names file, or turn the IMU's axes",
            ))  # fmt: skip
        elif leans < LOOSE:
            findings.append(
                Finding("bad", f"{said}; they hardly go together: another axis, a clock, a sensor that hangs?")
            )
        elif not 1 / TIMES < ratio < TIMES:
            findings.append(
                Finding("bad", f"{said}, but they differ {max(ratio, 1 / ratio):.2g} times: degrees or radians?")
            )
        else:
            findings.append(Finding("ok", f"{said}: they go together"))
    if steers is not None and steers < AGAINST and (leans is None or leans > LOOSE):
        findings.append(Finding(
            _severity("steer_angle", used), f"yaw rate and speed times steer angle: correlation {steers:.2f}; the sign of "
            "steer_angle is wrong, or the IMU is mounted askew: set sign = -1 in the names file, or turn the IMU's axes",
        ))  # fmt: skip
    if "pitch_rate" in blocks:
        pitch, turn = _pair(blocks["pitch_rate"], blocks["turn"])
        if pitch.size >= LEAST and turn.std() > PITCHING and (goes := _goes_with(pitch, turn)) < AGAINST:
            findings.append(Finding(
                _severity("pitch_rate", used), f"pitch rate and that of bends, -v r^2 / g: correlation {goes:.2f}; the sign of "
                "pitch_rate is wrong: set sign = -1 in the names file",
            ))  # fmt: skip
    return findings


def _zero(blocks: Values, values: Values, used: set[str]) -> list[Finding]:
    """Whether the steering encoder is off its zero, with an estimator that takes it as it is or as it was told."""
    if "steer_angle" not in used:
        return []
    told = float(values["steer_offset"][-1]) if "steer_offset" in values and values["steer_offset"].size else 0.0
    if "steer_offset_sd" in values:  # found while it ran
        sd = float(values["steer_offset_sd"][-1]) if values["steer_offset_sd"].size else np.inf
        said = f"the steering encoder's zero, {told / DEGREE:.2f} deg with a standard deviation of {sd / DEGREE:.2g}, is taken out"
        return [Finding("ok", said)] if sd < SURE else []
    fine = (
        [Finding("ok", f"the steering encoder's zero, {told / DEGREE:.2f} deg as told, is taken out")] if told else []
    )
    if not {"course", "yaw_rate"} <= set(blocks):
        return fine
    there = np.isfinite(blocks["course"]) & np.isfinite(blocks["yaw_rate"])
    y, X = blocks["course"][there], np.column_stack([blocks["yaw_rate"], blocks[SPEED]])[there]
    if y.size < LEAST or X[:, 0].std() < TURNING:
        return fine
    normal = np.linalg.inv(X.T @ X)
    fitted = normal @ X.T @ y
    sd = float(np.sqrt(normal[1, 1] * np.sum((y - X @ fitted) ** 2) / (y.size - 2)))
    zero = float(fitted[1])
    if abs(zero - told) < max(OFF, SURELY * sd) or _goes_with(X[:, 0], y - zero * X[:, 1]) < 1 - LOOSE:
        return fine
    mend = "auto" if "lateral_acceleration" in used else f"{zero / DEGREE:.2g}"
    return [Finding(
        "bad",
            f"steer_angle is off its zero by {zero / DEGREE:.2g} deg, by speed and yaw rate in bends"
            + (f", where {told / DEGREE:.2g} was told" if told else "")
            + f"; a tenth of a degree may cost a degree of roll: --steer-zero {mend} takes it out",
    )]  # fmt: skip


def _rolled(rate: Array, values: Values, valid: Flags) -> list[Finding]:
    """Whether the roll rate adds up to more than a machine can lean, with a bias that the estimator does not find."""
    rate = rate[np.isfinite(rate)]
    mean = float(rate.mean()) if rate.size else 0.0
    if abs(mean) < BIASED or abs(mean) * rate.size * DT < ROLLED:
        return []
    if "roll_rate_bias" in values and valid.any() and abs(float(values["roll_rate_bias"][valid][-1]) - mean) < BIASED:
        return []
    return [Finding(
        "bad", f"roll_rate has a mean of {mean * 180 / np.pi:.2g} deg/s, and nobody rolls over: a bias that is not found; take it "
        "out by offset in the names file",
    )]  # fmt: skip
