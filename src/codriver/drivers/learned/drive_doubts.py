"""Can drives be learnt from together? What a wrong names file does to a torque, asked before anything is learnt.

    size     rms(T) > 30 N m, or 20 times that of another drive        a wrong unit: a driver's arms do not do that for minutes
    sign     corr(T, angle) of two drives beyond 0.4 and opposite      a wheel turned to the left is held there to the left
    rate     9 of 10 changes of T are more than 1.5 ticks apart, half of them equally far: a slow torque repeated on quick rows

The wheel's angle, or else the yaw rate or the lateral acceleration, the first that every drive has. A drive on which the torque
hardly follows it (a straight motorway) is not asked for its sign; and a sensor of coarse steps changes seldom, but not evenly.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations

import numpy as np

from codriver.finding import Finding
from codriver.signals import Log, Signal

MOST_RMS = 30.0  # N m
_APART = 20.0  # rms over rms
_CLEAR = 0.4  # correlation
_OFTEN = 1.5  # ticks between changes
_EVEN = 0.2  # of the usual time between changes
_LEAST = 50  # samples or changes, to say anything
_ANSWERS = ("steering_wheel_angle", "yaw_rate", "lateral_acceleration")


def doubts_about(drives: Mapping[str, Log], target: str, tick: float) -> list[Finding]:
    """What is wrong with the torque of drives, by drive; empty where nothing is.

    Args:
        drives: by name; each has the torque.
        target: the torque's name.
        tick: of the features, s.
    """
    return [*_size(drives, target), *_sign(drives, target), *_rate(drives, target, tick)]


def _size(drives: Mapping[str, Log], target: str) -> list[Finding]:
    """Torques that are too large, or of another size than the rest."""
    rms = {name: _rms(log[target]) for name, log in drives.items()}
    found = [
        Finding("bad", f"the torque of {name} is {size:.3g} N m (rms), beyond what a driver does: {_UNIT}")
        for name, size in rms.items()
        if size > MOST_RMS
    ]
    least = min((size for size in rms.values() if size > 0), default=0.0)
    apart = [name for name, size in rms.items() if least > 0 and size > _APART * least and size <= MOST_RMS]
    smallest = min(rms, key=lambda name: rms[name] if rms[name] > 0 else np.inf)
    found += [
        Finding(
            "bad",
            f"the torque of {name} is {rms[name] / least:.0f} times that of {smallest} (rms), so units differ: {_ALIKE}",
        )
        for name in apart
    ]
    return found


def _sign(drives: Mapping[str, Log], target: str) -> list[Finding]:
    """Drives whose torque turns the other way than that of the others."""
    answer = next((name for name in _ANSWERS if all(name in log for log in drives.values())), None)
    if answer is None:
        return []
    follows = {name: correlation(log[target], log[answer]) for name, log in drives.items()}
    clear = [name for name, value in follows.items() if abs(value) > _CLEAR]
    against: dict[str, list[str]] = {name: [] for name in clear}
    for one, other in combinations(clear, 2):
        if follows[one] * follows[other] < 0:
            against[one].append(other)
            against[other].append(one)
    most = max((len(others) for others in against.values()), default=0)
    odd = [name for name, others in against.items() if others and len(others) == most]
    if not odd:
        return []
    told = ", ".join(f"{name} {follows[name]:+.2f}" for name in clear)
    if len(odd) == len(clear):
        return [
            Finding(
                "bad", f"the torque follows {answer} with opposite signs (correlation: {told}): some are wrong; {_WAY}"
            )
        ]
    return [
        Finding("bad", f"the torque of {name} follows {answer} the other way than most (correlation: {told}); {_WAY}")
        for name in odd
    ]  # fmt: skip


def _rate(drives: Mapping[str, Log], target: str, tick: float) -> list[Finding]:
    """Torques that change more slowly than the features ask for them."""
    found = []
    for name, log in drives.items():
        between = time_between_changes(log[target])
        if between.size < _LEAST:
            continue
        usual = float(np.median(between))
        evenly = float(np.mean(np.abs(between - usual) < _EVEN * usual)) > 0.5
        if evenly and float(np.quantile(between, 0.1)) > _OFTEN * tick:
            found.append(
                Finding(
                    "bad", f"the torque of {name} changes every {usual:.2g} s only and is repeated in between, "
                    f"which is learnt as steadiness (features are {tick:g} s apart): log it as measured, or leave the drive out",
                )
            )  # fmt: skip
    return found


def correlation(torque: Signal, answer: Signal) -> float:
    """Of a torque with another signal at its moments; 0 where either does not vary."""
    there = np.isfinite(answer.values)
    if there.sum() < 2 or len(torque) < _LEAST:
        return 0.0
    x = np.interp(torque.time, answer.time[there], answer.values[there], left=np.nan, right=np.nan)
    both = np.isfinite(x) & np.isfinite(torque.values)
    if both.sum() < _LEAST:
        return 0.0
    x, y = x[both] - x[both].mean(), torque.values[both] - torque.values[both].mean()
    size = float(np.sqrt(np.sum(x**2) * np.sum(y**2)))
    return float(np.sum(x * y)) / size if size > 0 else 0.0


def time_between_changes(signal: Signal) -> np.ndarray:
    """Between moments at which a signal takes a new value, s."""
    there = np.isfinite(signal.values)
    time, values = signal.time[there], signal.values[there]
    return np.diff(time[1:][np.diff(values) != 0])


def _rms(signal: Signal) -> float:
    known = signal.values[np.isfinite(signal.values)]
    return float(np.sqrt(np.mean(known**2))) if known.size else 0.0


_UNIT = "correct its unit (or scale) in the names file (N mm: scale = 0.001)"
_ALIKE = "one names file counts for all drives, so convert the recording, or leave it out"
_WAY = "one names file counts for all drives, so turn the sign in the recording, or leave it out"
