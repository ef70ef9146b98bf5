"""What the innovations of an estimate say, row by row: scatter and lean against the band, spikes, stretches far beyond it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from codriver.finding import Finding
from codriver.observers.observer import Output
from codriver.signals import Grid
from codriver.signals.signal import Array
from codriver.trust.innovations import Innovations, blocks, innovation_rows, row_name
from codriver.trust.steering import ENCODER

# Of squares: scatter and lean of 1.5, 2.5, 4 and 0.25 times the band.
LARGE, WRONG, BAD_STRETCH, SMALL = 2.25, 6.25, 16.0, 0.0625
SPIKE = 20.0  # times the usual scatter; bursts of jerk and shifts reach about half of that
GRANTED = 64.0  # 8 times the band: balance in a turn leans up to 5 on sound rides, whose roll and its band are right
HORIZON = 0.5  # s over which innovations may lean, where no knob says how quick the observer is
FEW = 50  # innovations; fewer say nothing
# What is likely where the innovations of a row are far too large for a second.
_LIKELY = dict.fromkeys(("acceleration", "speed"), "slip, a wrong ratio, or a sensor fault")
_GRANTED = {"balance": "turns are balanced"}


def row_findings(
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
    """What the innovations of one row say."""
    name = row.row
    if row.sd is None:
        return [
            Finding("warn", f"{name}: cannot be judged: no standard deviation of its innovations among the outputs")
        ]
    findings, counted = [], valid & row.sound
    if (broken := valid & row.used & ~row.sound).any():
        findings.append(Finding(
            "bad", f"{name}: {broken.sum() * grid.dt:.3g} s where innovation or standard deviation is no number, or the latter is "
            "not above 0: an error in the observer", spans(broken, grid),
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
        if name in _GRANTED:
            wrong, cure = (
                GRANTED,
                f"that {_GRANTED[name]} is taken for granted, not measured, and holds less well than told",
            )
        else:
            wrong, cure = (
                WRONG,
                "it is too narrow: check vehicle parameters and units" + (", or raise ell" if ell else ""),
            )
        findings.append(Finding("bad" if larger > wrong else "warn", f"{said}; {cure}"))
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
            f"their band: {likely}", spans(bad, grid),
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


def spans(mask: npt.NDArray[np.bool_], grid: Grid) -> tuple[tuple[float, float], ...]:
    """Stretches of time where a mask holds."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    return tuple(
        (float(grid.time[i]), float(grid.time[k - 1] + grid.dt)) for i, k in zip(edges[::2], edges[1::2], strict=True)
    )
