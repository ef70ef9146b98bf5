"""Whether the accelerometer and the change of speed go together: what betrays a wrong sign, unit, axis or a stuck sensor."""

from __future__ import annotations

import numpy as np

from codriver.finding import Finding
from codriver.signals import Log

# Ratios of (change of speed) / accelerometer that betray a unit, and what is then likely wrong.
_SLOPES = (
    (3.6, "the speed looks like km/h read as m/s"), (1 / 3.6, "the speed looks like m/s read as km/h"),
    (2.237, "the speed looks like mph read as m/s"), (0.447, "the speed looks like m/s read as mph"),
    (1.609, "the speed looks like km/h read as mph"), (0.621, "the speed looks like mph read as km/h"),
    (9.807, "the accelerometer looks like g read as m/s^2"), (0.102, "the accelerometer looks like m/s^2 read as g"),
)  # fmt: skip
LEAST_STEPS = 20  # of 1 s
LEAST_CHANGE = 0.1  # m/s in 1 s, standard deviation
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
