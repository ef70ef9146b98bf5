"""One thing found about an estimate."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """One thing found.

    Attributes:
        severity: "ok", "warn" or "bad".
        text: one sentence with the number, and what to do.
        spans: stretches of time it is about, (start, stop) in s.
    """

    severity: str
    text: str
    spans: tuple[tuple[float, float], ...] = ()
