"""One statement of a paper: a table's entry, a figure, or a claim, and what codriver finds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from math import isfinite


@dataclass(frozen=True)
class Item:
    """One statement.

    Attributes:
        item: where it stands in the paper and what it says, such as "fig. 2: some minutes of data suffice for c_b".
        paper: the paper's value or words; None where it gives none and the item is ours alone.
        ours: what was found here; a number in `unit`, or words.
        unit: of both; "" for words.
        holds: whether ours bears the paper out; None where that cannot be decided here.
        note: how it was judged, and by how much, in a sentence or two.
    """

    item: str
    paper: float | str | None
    ours: float | str
    unit: str
    holds: bool | None
    note: str

    @property
    def own(self) -> bool:
        """Whether the paper says nothing of it: a goal or a finding of ours."""
        return self.paper is None

    def to_dict(self) -> dict[str, object]:
        """As JSON holds it: numbers that are none become null."""
        return {k: None if isinstance(v, float) and not isfinite(v) else v for k, v in asdict(self).items()}


def counts(items: Sequence[Item]) -> str:
    """How many hold, do not, and cannot be judged, in words."""
    held = [sum(item.holds is verdict for item in items) for verdict in (True, False, None)]
    return f"{held[0]} hold, {held[1]} do not, {held[2]} cannot be judged here"


def near(item: str, paper: float, ours: float, unit: str, tolerance: float, note: str = "") -> Item:
    """An item whose number must lie within `tolerance` (relative) of the paper's."""
    off = ours / paper - 1.0
    said = f"{off:+.2%} of the paper's; within {tolerance:.2g} of it counts as held"
    return Item(item, paper, ours, unit, abs(off) <= tolerance, f"{note}; {said}" if note else said)
