"""What a motorcycle's vehicle file says that cannot be, beside bounds of single parameters; and a file that was not used.

The front wheel's load follows from masses and places, moments about the rear contact:

    -Z_f (b + l) = g (M_r b + M_f (b + k)),     l = (a - t) / cos eps,   k = (a + e) cos eps - f sin eps

Sharp's machine has 1005 N printed and 1007 N so. Symbols as in `models.motorcycle`.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import cos, sin

from codriver.finding import Finding
from codriver.models.motorcycle import LETTERS, MotorcycleParameters
from codriver.vehicles import Vehicle

APART, FAR = 0.05, 0.2  # of the load


def static_front_load(p: MotorcycleParameters) -> float:
    """The front wheel's load at rest, N, by masses and places.

    Args:
        p: the machine.
    """
    c, s = cos(p.eps), sin(p.eps)
    return p.g * (p.Mr * p.b + p.Mf * (p.b + (p.a + p.e) * c - p.f * s)) / (p.b + p.front)


def motorcycle_vehicle_findings(vehicle: Vehicle, settings: Mapping[str, str]) -> list[Finding]:
    """Look at a vehicle file.

    Args:
        vehicle: of any kind.
        settings: an estimate's provenance; without "vehicle" the file was not used. Empty: there is no estimate.
    """
    lacking = [name for name in LETTERS.values() if name not in vehicle]
    if lacking:
        if not settings or "vehicle" in settings:
            return []
        few = len(lacking) <= len(LETTERS) // 4
        return [Finding(
            "warn", f"vehicle '{vehicle.name}' was not used: it " + (
                f"lacks {', '.join(lacking)} of a motorcycle's parameters" if few else "is no motorcycle's"
            ),
        )]  # fmt: skip
    p = MotorcycleParameters.from_vehicle(vehicle)
    findings = []
    if p.t <= 0:
        findings.append(
            Finding("warn", f"normal_trail is {p.t:g} m; every motorcycle has some behind the steer axis: its sign?")
        )
    load = static_front_load(p)
    if not abs(p.load / load - 1) < APART:
        findings.append(Finding(
            "bad" if not abs(p.load / load - 1) < FAR else "warn",
            f"front_wheel_load is {p.load:.4g} N, where masses and places give {load:.4g} N: a wrong mass, place or unit (N, not "
            "kg)? A rider of another mass changes the load too",
        ))  # fmt: skip
    return findings
