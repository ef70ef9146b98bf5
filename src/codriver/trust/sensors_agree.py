"""Whether the signals of a drive go together: what betrays a wrong sign, unit, axis or a stuck sensor.

* The accelerometer follows the change of speed.
* A pedal that goes with what the car does, yet never moves as far as a foot moves it, has a unit that is too small: a share
  taken for per cent, bar taken for Pa. Such a pedal adds nothing to an estimate, so its innovations do not show it. A pedal
  that rests (cruise control, no braking) goes with nothing.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from codriver.finding import Finding
from codriver.signals import Log
from codriver.signals.signal import Array

# Ratios of (change of speed) / accelerometer that betray a unit, and what is then likely wrong.
_SLOPES = (
    (3.6, "the speed looks like km/h read as m/s"), (1 / 3.6, "the speed looks like m/s read as km/h"),
    (2.237, "the speed looks like mph read as m/s"), (0.447, "the speed looks like m/s read as mph"),
    (1.609, "the speed looks like km/h read as mph"), (0.621, "the speed looks like mph read as km/h"),
    (9.807, "the accelerometer looks like g read as m/s^2"), (0.102, "the accelerometer looks like m/s^2 read as g"),
)  # fmt: skip
LEAST_STEPS = 20  # of 1 s
LEAST_CHANGE = 0.1  # m/s in 1 s, standard deviation
LEAST_PEDAL, LEAST_PRESSURE = 0.02, 0.3e5  # 1, Pa; below these no foot is at work
GOES_WITH = 0.5  # correlation; 0.8 for the accelerator and 0.9 for the brake in the drives we have
STILL = 0.15  # of the accelerometer's variation: a speed that changes less does not follow it


def sensors_agree(log: Log) -> list[Finding]:
    """Compare the accelerometer's mean with the change of speed, over 1-s steps."""
    if "longitudinal_acceleration" not in log or "longitudinal_speed" not in log:
        return []
    grid = log.sample(["longitudinal_acceleration", "longitudinal_speed"], 0.02)
    a, v = grid.values["longitudinal_acceleration"], grid.values["longitudinal_speed"]
    steps = len(grid) // 50
    mean_a = a[: steps * 50].reshape(steps, 50).mean(axis=1)[:-1]
    dv = np.diff(v[: steps * 50 : 50])
    good = np.isfinite(mean_a) & np.isfinite(dv)
    mean_a, dv = mean_a[good], dv[good]
    if good.sum() < LEAST_STEPS:
        said = f"only {int(good.sum())} s of both: accelerometer and change of speed are not held against each other"
        return [Finding("ok", said)]
    moving = dv.std() >= LEAST_CHANGE
    if moving and np.ptp(mean_a) < 1e-6:
        return [
            Finding(
                "bad", f"the accelerometer shows {mean_a[0]:.3g} m/s^2 all the time while the speed changes; stuck?"
            )
        ]
    # Steps of the accelerometer: a slope or bias, which changes slowly, is no motion.
    shaking = float(np.diff(mean_a).std())
    if not moving and shaking > LEAST_CHANGE and dv.std() < STILL * shaking:
        return [
            Finding("bad", f"the speed hardly changes ({dv.std():.2g} m/s in 1 s) while the accelerometer does; stuck?")
        ]
    if not moving:
        return [Finding("ok", "the speed changes too little to hold it against the accelerometer: not judged")]
    slope = float(np.cov(mean_a, dv)[0, 1] / mean_a.var(ddof=1))
    correlation = float(np.corrcoef(mean_a, dv)[0, 1])
    said = f"accelerometer and change of speed: correlation {correlation:.2f}, slope {slope:.3g}"
    if correlation < -0.3:
        return [Finding("bad", f"{said}; the accelerometer's sign is wrong: set sign = -1 in the names file")]
    if correlation < 0.5:
        return [Finding("bad", f"{said}; they hardly go together: wrong axis, wrong clock or wrong signal?")]
    if not 0.7 < slope < 1.4:
        likely = [text for ratio, text in _SLOPES if abs(np.log(slope / ratio)) < 0.1 and correlation > 0.8]
        hint = f"; {likely[0]}" if likely else ""
        severity = "bad" if likely or not 0.4 < slope < 2.5 else "warn"
        return [Finding(severity, f"{said} where 1 is right{hint}; check the units of both, and the tyre radius")]
    return [Finding("ok", f"{said} (1 and 1 are right)")]


def pedals_move(log: Log, used: Collection[str]) -> list[Finding]:
    """Look for a pedal or a pressure that follows the car and stays far below what a foot does.

    Args:
        log: accelerator pedal with engine torque or accelerometer; brake pressure with accelerometer.
        used: names of the signals that an estimate used.
    """
    names = ("accelerator_pedal", "brake_pressure", "engine_torque", "longitudinal_acceleration")
    columns = log.sample([name for name in names if name in log], 0.05).values
    a = columns.get("longitudinal_acceleration")
    findings = []
    pedal, torque = columns.get("accelerator_pedal"), columns.get("engine_torque")
    if pedal is not None and "accelerator_pedal" in used:
        follows = torque if torque is not None else None if a is None else np.where(a > 0, a, np.nan)
        if follows is not None and _small(pedal, LEAST_PEDAL, follows):
            findings.append(Finding(
                "bad", f"the accelerator pedal goes with what the car does, yet is never above {np.nanmax(pedal):.2g} of 1: a "
                'share taken for per cent? Then unit = "1" in the names file',
            ))  # fmt: skip
    pressure = columns.get("brake_pressure")
    if pressure is None or a is None or "brake_pressure" not in used:
        return findings
    if _small(pressure, LEAST_PRESSURE, np.where(a < 0, -a, np.nan)):
        findings.append(Finding(
            "bad", f"the brake pressure goes with what the car does, yet is never above {np.nanmax(pressure) / 1e5:.2g} bar: "
            'is its unit right in the names file ("bar", "kPa", "Pa")?',
        ))  # fmt: skip
    return findings


def _small(values: Array, least: float, follows: Array) -> bool:
    """Whether values stay below `least` and go with others all the same."""
    there = np.isfinite(values) & np.isfinite(follows)
    x, y = values[there], follows[there]
    if x.size < 20 * LEAST_STEPS or not 0 < x.max() < least or x.std() == 0 or y.std() == 0:
        return False
    return bool(np.corrcoef(x, y)[0, 1] > GOES_WITH)
