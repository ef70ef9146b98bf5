"""Tables of these pages that are made from the code, so that they cannot go out of date.

    python docs/make_names.py           rewrites the tables
    python docs/make_names.py --check   only says which pages are out of date; exit code 1 if any is

A table stands between the lines <!-- table: NAME --> and <!-- end -->.
"""

# ruff: noqa: T201
from __future__ import annotations

import re
import sys
from collections import Counter
from dataclasses import replace
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from codriver.vehicles import Vehicle

DOCS = Path(__file__).parent
_MARKED = re.compile(r"(<!-- table: (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)


def vocabulary() -> list[list[str]]:
    """names.md: the standard names."""
    from codriver.names import VOCABULARY

    rows = [["name", "symbol", "unit", "shown in", "plausible, SI", "held, s", "meaning and sign"]]
    for q in VOCABULARY.values():
        bounds = f"{q.low:g} to {q.high:g}" if isfinite(q.low) or isfinite(q.high) else ""
        rows.append(
            [
                f"`{q.name}`",
                q.symbol,
                q.unit,
                q.display,
                bounds,
                f"{q.hold:g}" if isfinite(q.hold) else "any",
                q.meaning,
            ]
        )
    return rows


def parameters() -> list[list[str]]:
    """vehicles.md: what a vehicle file may hold."""
    from codriver.observers import ESTIMATORS
    from codriver.vehicles import KNOWN

    rows = [["parameter", "SI unit", "bounds, SI", "one per gear", "needed by", "meaning"]]
    for name, known in KNOWN.items():
        users = ", ".join(e.name for e in ESTIMATORS.values() if name in e.parameters)
        gears = "yes" if known.per_gear else ""
        rows.append([f"`{name}`", known.unit, f"{known.low:g} to {known.high:g}", gears, users, known.meaning])
    return rows


def operations() -> list[list[str]]:
    """c-export.md: what one step costs, all outputs kept."""
    import codriver as cd
    from codriver.observers import ESTIMATORS

    head = ["estimator", "form", "operations", "+ -", "*", "/", "sqrt", "compare, select, logic", "state"]
    car, machine, rows = _every_parameter(), cd.load_vehicle("sharp1971"), []
    for name, estimator in ESTIMATORS.items():
        vehicle = machine if estimator.family == "motorcycle" else _without(car, estimator.forbids)
        if name == "bicycle-kalman":
            vehicle = cd.load_vehicle("pasma2024")
        for form in estimator.forms:
            step = cd.build(name, vehicle, form=form).record()
            kinds = Counter(i.kind for i in step.instructions)
            groups = (("add", "sub", "neg", "twice"), ("mul", "square"), ("div", "inverse"), ("sqrt",))
            counts = [sum(kinds[kind] for kind in group) for group in groups]
            rest = step.operations() - sum(counts)
            label = "-" if name in ("pedals-only", "driver-torque-pi") else form
            rows.append([f"`{name}`", label, *(str(n) for n in (step.operations(), *counts, rest, len(step.carry)))])
    return [head, *(row for k, row in enumerate(rows) if row not in rows[:k])]


def _every_parameter() -> Vehicle:
    """The car of 2017 with a steering that has everything; what a step costs does not depend on the numbers."""
    import codriver as cd
    from codriver.models.alignment import USUAL

    car = cd.load_vehicle("bisoffi2017")
    track = {
        "yaw_inertia": 2600.0, "front_axle_distance": 1.2, "front_cornering_stiffness": 9e4, "rear_cornering_stiffness": 1.1e5,
        "alignment_stiffness": 1000.0, "alignment_whole": 1.0, "steering_inertia": 0.03, "torque_scale": 1.9,
        "steering_end_stop": 8.0,
    }  # fmt: skip
    for name, value in {**USUAL, **track}.items():
        car = car.with_parameter(name, value, 0.05 * value)
    return car


def _without(car: Vehicle, forbidden: tuple[str, ...]) -> Vehicle:
    """The car less some parameters."""
    return replace(car, parameters={name: p for name, p in car.parameters.items() if name not in forbidden})


_TABLES = {"vocabulary": vocabulary, "parameters": parameters, "operations": operations}


def filled(text: str) -> str:
    """A page with its tables made anew."""

    def table(match: re.Match[str]) -> str:
        head, *rows = _TABLES[match[2]]()
        lines = ["| " + " | ".join(row) + " |" for row in (head, ["---"] * len(head), *rows)]
        return match[1] + "\n".join(lines) + "\n" + match[3]

    return _MARKED.sub(table, text)


def main(check: bool) -> int:
    """Rewrite the pages, or only look."""
    stale = 0
    for page in sorted(DOCS.glob("*.md")):
        old = page.read_text(encoding="utf-8")
        new = filled(old)
        if new != old:
            stale += 1
            print(f"{page.name} {'is out of date: run python docs/make_names.py' if check else 'rewritten'}")
            if not check:
                page.write_text(new, encoding="utf-8")
    return int(check and stale > 0)


if __name__ == "__main__":
    sys.exit(main("--check" in sys.argv))
