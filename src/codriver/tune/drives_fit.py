"""Whether drives are fit to tune on, asked before.

Tuning takes what the rows do for noise. So where a sign, a unit or a ratio is wrong it fits the error: with an accelerometer
that is stuck at 0 it finds a speed whose R is hundreds of times that of the accelerometer, and says so with a small standard
error. The check of an estimate with the preset begun with sees most of this, a sensor without any scatter the rest.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import PurePath

import numpy as np

from codriver.errors import LogError
from codriver.estimate import Estimate
from codriver.observers.jerk_forms import ROWS
from codriver.trust import Check
from codriver.tune.curve import sensor_noise
from codriver.tune.likelihood import BLOCK, LEAST_BLOCKS, Likelihood


def refuse_stuck(runs: Sequence[Estimate]) -> None:
    """Sensors that show no noise are not tuned to.

    Args:
        runs: estimates with the preset begun with.

    Raises:
        LogError: a sensor is constant or without scatter.
    """
    for run in runs:
        said = [_stuck(run, row, spread) for row, spread in zip(ROWS, sensor_noise([run]), strict=True)]
        if any(said):
            raise _unfit(run, [text for text in said if text])


def refuse_doubtful(
    runs: Sequence[Estimate], likely: Callable[[], Sequence[Estimate]], judge: Callable[[Estimate], Check]
) -> None:
    """Drives whose data contradict themselves are not tuned on.

    That a band is too narrow may be the noise of the preset, which is to be tuned. So a drive is refused only if it is bad at
    the most likely ell as well.

    Args:
        runs: estimates with the preset begun with.
        likely: makes them with its most likely ell; called where it is needed.
        judge: the verdict on each.

    Raises:
        LogError: something bad was found.
    """
    checks = [judge(run) for run in runs]
    if all(check.trusted for check in checks):
        return
    for run, check, other in zip(runs, checks, likely(), strict=True):
        if not check.trusted and not judge(other).trusted:
            raise _unfit(run, [f.text for f in check.findings if f.severity == "bad"])


def refuse_short(likelihood: Likelihood) -> None:
    """Q and R are not fitted where their standard errors would rest on a few blocks.

    Raises:
        LogError: too few.
    """
    blocks = likelihood.blocks
    if blocks < LEAST_BLOCKS:
        raise LogError(
            f"{likelihood.seconds:.0f} s that count, {blocks} block{'s' * (blocks != 1)} of {BLOCK:g} s: too few to say how "
            "sure Q and R are",
            f"at least {LEAST_BLOCKS} blocks, {LEAST_BLOCKS * BLOCK:g} s of moving with all inputs, between gear shifts",
            "give longer drives or more of them, or choose ell alone (--delay without --likelihood)",
        )  # fmt: skip


def _unfit(run: Estimate, why: Sequence[str]) -> LogError:
    log = PurePath(run.log.source.replace("\\", "/")).name or "a recording in memory"
    return LogError(
        f"{log} is not fit to tune on: {'; '.join(why)}", "a drive that an estimate with the preset begun with trusts",
        "see it with `codriver estimate`, correct the names file or the vehicle, or leave the drive out",
    )  # fmt: skip


def _stuck(run: Estimate, row: str, spread: float) -> str:
    """What is wrong with a sensor that shows no scatter; "" where it does."""
    name = f"longitudinal_{row}"
    values = run.grid.values[name][run.valid & run.flag(f"{row}_used")]
    if values.size and np.ptp(values) == 0:
        return f"{name} is {values[0]:.4g} all the time"
    return f"{name} has no scatter: most of its values are those before" if spread == 0 else ""
