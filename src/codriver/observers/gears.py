"""Gears that a log shows and a vehicle file lacks.

`powertrain` knows tau for the gears 1 to n of the file, for reverse where the file has it, and for neutral after one of
them. In any other gear nobody knows what the engine passes to the wheels: `inputs_known` is 0 there, and the estimate goes
on as the kinematic one. Here the log is looked at before anything is estimated.
"""

from __future__ import annotations

import numpy as np

from codriver.finding import Finding
from codriver.signals import Log
from codriver.vehicles import Vehicle

MOSTLY = 0.5  # share of the time in gear from which on the vehicle file is not this car's


def unknown_gears(log: Log, vehicle: Vehicle) -> list[Finding]:
    """A finding for the gears of a log that the vehicle file lacks; none where it has them all, or either says nothing.

    Args:
        log: its signal gear; each value counts until the next.
        vehicle: its transmission, one value per forward gear, and transmission_reverse.
    """
    if "gear" not in log or "transmission" not in vehicle or not len(log["gear"]):
        return []
    count = len(vehicle.numbers("transmission"))
    signal = log["gear"]
    there = np.isfinite(signal.values)
    stamps, gears = signal.time[there], signal.values[there]
    # The last one too stands for some time, though nobody says for how long.
    lasts = np.diff(stamps, append=max(log.stop, stamps[-1] + 1e-3)) if stamps.size else stamps
    known = (gears >= 1) & (gears <= count) & (gears == np.round(gears))
    back = gears == -1
    if "transmission_reverse" in vehicle:
        known |= back
    unknown = ~known & (gears != 0)
    if not unknown.any():
        return []
    share = float(lasts[unknown].sum() / lasts[gears != 0].sum())
    forward = np.unique(gears[unknown & ~back])
    lacks = []
    if forward.size:
        shown = ", ".join(f"{gear:g}" for gear in forward[:8]) + (", ..." if forward.size > 8 else "")
        has = "one gear" if count == 1 else f"{count} gears"
        lacks.append(f"gear {shown}, where transmission of the vehicle file has {has}")
    if (unknown & back).any():
        lacks.append("reverse, where the vehicle file has no transmission_reverse")
    return [Finding(
        "bad" if share > MOSTLY else "warn", f"the log shows {', and '.join(lacks)}: {share:.1%} of the time in gear, in which "
        "what the powertrain adds is unknown and the estimate goes on as kinematic; "
        + ("is this the log's vehicle?" if share > MOSTLY else "complete the vehicle file"),
    )]  # fmt: skip
