"""Whether the data of a driver allow a judgement: what the checks of the estimates found.

A wrong sign, unit or ratio moves the jerk as much as a driver does, and no number of a style shows it: a pedal in per cent
that is read as a share looks like a very restless foot. So a driver of whom a check found something bad gets neither score
nor class.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import PurePath

from codriver.drivers.scale import Rating
from codriver.estimate import Estimate
from codriver.finding import Finding
from codriver.trust import Check


def doubts_of(runs: Sequence[Estimate], checks: Sequence[Check]) -> tuple[Finding, ...]:
    """What speaks against the data of a driver, the worst first; with the log's name where there are several."""
    found = []
    for run, check in zip(runs, checks, strict=True):
        log = PurePath(run.log.source.replace("\\", "/")).name if len(runs) > 1 else ""
        found += [replace(f, text=f"{log}: {f.text}" if log else f.text) for f in check.findings if f.severity != "ok"]
    return tuple(sorted(found, key=lambda f: f.severity != "bad"))


def contradicted(doubts: Sequence[Finding]) -> bool:
    """Whether something bad is among them."""
    return any(f.severity == "bad" for f in doubts)


def refusal(doubts: Sequence[Finding]) -> Rating | None:
    """The rating "cannot tell", without a score, where something bad is among the doubts; None elsewhere."""
    bad = sum(f.severity == "bad" for f in doubts)
    if not bad:
        return None
    why = f"the data contradict themselves or the vehicle file: {bad} bad finding{'s' * (bad > 1)}"
    return Rating(None, None, None, None, "cannot tell", {}, (why,))
