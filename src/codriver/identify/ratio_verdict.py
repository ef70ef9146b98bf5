"""What is to say about identified ratios, and when they must not become a vehicle file.

    tau_1 > tau_2 > ...          0.8 <= tau_g / (omega / v) <= 1          tau_g is near the vehicle's old value

They are refused where one gear's tau is not below that of the gear before it (a gear kept from the old file beside gears that
are numbered in another way), where there are more gears than the vehicle has, where the engine's speed tells another tau, where
the fit hardly explains the acceleration, or many moments do not fit. A factor from the old values is told with the likely cause.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from codriver.errors import LogError
from codriver.finding import Finding
from codriver.identify.brake_verdict import HARDLY, MANY_OUTLIERS, SOME_OUTLIERS
from codriver.identify.gear_by_engine import EFFICIENCY
from codriver.identify.plausible import CLEAR, FAR, LEAST_FAR, within_file_bounds
from codriver.vehicles import Vehicle

if TYPE_CHECKING:
    from codriver.identify.ratio import RatioFit

LIKE = 0.07  # share within which two ratios are those of one gear


def ratio_findings(fit: RatioFit, old: Vehicle) -> list[Finding]:
    """What is to say about the ratios, the worst first.

    Args:
        fit: the ratios.
        old: the vehicle, with its mass; its transmission if it has one.
    """
    said = condemned(fit, old)
    said += [Finding("warn", f"gear {gear} is refused: {why}") for gear, why in fit.refused.items()]
    said += fit.remarks
    if fit.gain is None:
        said.append(Finding(
            "warn", "the roads are too level to tell the accelerometer's gain error (pitch), which is in the ratios"
        ))  # fmt: skip
    if SOME_OUTLIERS < fit.trimmed <= MANY_OUTLIERS:
        said.append(Finding("warn", f"{fit.trimmed:.1%} of the moments do not fit and were left out as outliers"))
    said += _far(fit, old)
    if not said:
        agrees = ", and agrees with the engine's speed" if fit.engine_turns else "; no engine speed to hold against it"
        said.append(Finding("ok", f"every gear that was driven is told{agrees}"))
    return sorted(said, key=lambda one: ("bad", "warn", "ok").index(one.severity))


def condemned(fit: RatioFit, old: Vehicle) -> list[Finding]:
    """Why the ratios must not become a vehicle file; empty if they may."""
    M, known = old.number("mass"), old.numbers("transmission") if "transmission" in old else ()
    taus = {g.gear: g.ratio * M for g in fit.gears}
    said = []
    if known and max(taus) > len(known):
        said.append(
            f"the log has a gear {max(taus)}, and the vehicle {len(known)}: are the gears numbered in another way, or is it "
            "another car? (take [transmission] out of the vehicle file if its list is too short)"
        )
    listed = {
        gear: taus.get(gear, known[gear - 1] if gear <= len(known) else np.nan) for gear in range(1, max(taus) + 1)
    }
    listed |= {gear: known[gear - 1] for gear in range(max(taus) + 1, len(known) + 1)}
    for (one, high), (two, low) in pairwise(sorted(listed.items())):
        if high <= low * (1 + LIKE / 2) and (one in taus or two in taus):
            said.append(
                f"tau of gear {two}, {low:.3g} 1/m, is not below that of gear {one}, {high:.3g} 1/m"
                + ("" if one in taus and two in taus else f" (gear {two if one in taus else one} from the old file)")
                + ": are the gears numbered in another way?"
            )
    shares = {gear: taus[gear] / turns for gear, turns in fit.engine_turns.items() if gear in taus}
    if odd := [
        f"gear {gear} {share:.2f}" for gear, share in shares.items() if not EFFICIENCY[0] <= share <= EFFICIENCY[1]
    ]:
        said.append(
            f"tau is no 0.8 to 1 times engine speed over speed ({', '.join(odd)}): the unit of the torque, the scale of the "
            "accelerometer, M or the gear is wrong"
        )
    said += [f.text for f in fit.wrong_gears]
    if not fit.residual < HARDLY * fit.constant:
        said.append(
            f"the fit leaves {fit.residual:.3g} m/s^2 (RMS), and a constant {fit.constant:.3g}: torque does not explain it"
        )
    if fit.trimmed > MANY_OUTLIERS:
        said.append(f"{fit.trimmed:.1%} of the moments do not fit at all: is the log's gear the engaged one?")
    return [Finding("bad", text) for text in said]


def refuse_condemned(fit: RatioFit, old: Vehicle) -> None:
    """Raises LogError where the ratios are condemned, with all the reasons."""
    if reasons := [f.text for f in condemned(fit, old)]:
        raise LogError(
            f"{', '.join(fit.sources)}: {'; '.join(reasons)}", "ratios that fall from gear to gear and go with the engine's speed",
            "mend what is named; nothing was written",
        )  # fmt: skip
    within_file_bounds(
        "transmission",
        [g.ratio * old.number("mass") for g in fit.gears],
        "the unit of engine_torque, or the vehicle's mass",
    )


def _far(fit: RatioFit, old: Vehicle) -> list[Finding]:
    """One warning for all gears that are far from their old values."""
    M, known = old.number("mass"), old.numbers("transmission") if "transmission" in old else ()
    sds = old.parameters["transmission"].sd if known else None
    far, neighbours = [], 0
    for g in fit.gears:
        if g.gear > len(known):
            continue
        before, factor = known[g.gear - 1], g.ratio * M / known[g.gear - 1]
        sd = sds[g.gear - 1] if isinstance(sds, tuple) else sds
        off = abs(g.ratio * M - before) / np.hypot(g.sd * M, sd or 0.0)
        clear = sd is not None and off > CLEAR and abs(factor - 1) > LEAST_FAR
        if clear or (not 1 / (1 + FAR) <= factor <= 1 + FAR and off > 2):
            far.append(f"gear {g.gear} {factor:.3g}")
            beside = [known[k - 1] for k in (g.gear - 1, g.gear + 1) if 1 <= k <= len(known)]
            neighbours += any(abs(g.ratio * M / tau - 1) < LIKE for tau in beside)
    if not far:
        return []
    cause = (
        "the gears are numbered in another way"
        if 2 * neighbours > len(far)
        else "the torque's unit, M or the gear is wrong"
    )
    return [
        Finding(
            "warn",
            f"tau is far from the vehicle's old value, in times of it: {', '.join(far)}; if that was right, {cause}",
        )
    ]
