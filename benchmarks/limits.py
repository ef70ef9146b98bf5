"""What limits the batch loop: the same step with parts of its work taken out, which gives wrong numbers but true times.

The rows go from all of it to the least: all outputs; the estimates alone, which need no noise scale; no divisions and
roots, each a multiplication instead; no selections, each its usual branch, which takes out start, standstill and reverse.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from batch import DT, ESTIMATES, Loop, drive
from measure import Row, duration, measure, say

import codriver as cd
from codriver.kernel import Recorded
from codriver.kernel.llvm import compile_loop
from codriver.kernel.record import Instruction
from codriver.program import Program


def run(quick: bool = False) -> Iterator[Row]:
    """All rows."""
    grid = drive(50_000 if quick else 1_000_000)
    for form in ("kalman", "constant"):
        observer = cd.build("kinematic", dt=DT, form=form)
        all_of_it, estimates = observer.record(), observer.record(ESTIMATES)
        undivided = _changed(estimates, _undivided)
        variants = {
            "all outputs": all_of_it,
            "4 estimates": estimates,
            "4 estimates, no divisions": undivided,
            "4 estimates, no divisions, no selections": _changed(undivided, _unselected),
        }
        if undivided.instructions == estimates.instructions:
            del variants["4 estimates, no divisions"]
        for name, recorded in variants.items():
            say(f"  {form} form, {name}")
            timing = measure(Loop(Program(observer, recorded, compile_loop(recorded)), grid), 9)
            yield Row(
                f"what limits the {form} form: {name}", f"{duration(timing.best / len(grid))} (+{timing.spread})",
                note=f"a sample; {recorded.operations()} operations listed, {len(recorded.outputs)} columns written",
            )  # fmt: skip


def _changed(recorded: Recorded, change: Callable[[Instruction], Instruction]) -> Recorded:
    """The step with each instruction changed."""
    return replace(recorded, instructions=tuple(change(i) for i in recorded.instructions))


def _undivided(i: Instruction) -> Instruction:
    if i.kind == "div":
        return replace(i, kind="mul")
    return replace(i, kind="square") if i.kind in ("inverse", "sqrt") else i


def _unselected(i: Instruction) -> Instruction:
    """The usual branch, its sign changed, which costs next to nothing: moving forward, started; measurements are used."""
    if i.kind == "pick":
        return Instruction("neg", (i.operands[2],))
    return Instruction("neg", (i.operands[1],)) if i.kind == "where" else i
