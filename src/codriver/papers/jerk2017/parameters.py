"""Beside the paper: what the estimate is worth when the vehicle file is not exactly right, as none ever is."""

from __future__ import annotations

from codriver.identify import identify_brake, identify_pedal
from codriver.papers.drives import Driven
from codriver.papers.item import Item
from codriver.papers.judged import SHIFT_LIMITS, means, shift_ratio
from codriver.papers.reproduction import Chapter
from codriver.report.document import Table
from codriver.simulate.compare import compare, run_estimators
from codriver.vehicles import Vehicle

_ELL = 2.0
_CHANGES = (
    ("mass", "M", 1.1), ("mass", "M", 0.9), ("transmission", "tau", 1.05), ("transmission", "tau", 0.95),
    ("pedal_coefficient", "c_r", 1.1), ("brake_coefficient", "c_b", 1.1),
)  # fmt: skip


def parameters_chapter(driven: Driven, vehicle: Vehicle, preset: str) -> Chapter:
    """intent-pedals at ell = 2 on one drive, told the car's parameters, those identified, and wrong ones."""
    identified = identify_pedal(driven.log, vehicle).vehicle(identify_brake(driven.log, vehicle).vehicle(vehicle))
    told = {"as in the paper, and the simulated car's": vehicle, "c_b and c_r identified from this drive": identified}
    for name, letter, factor in _CHANGES:
        value = vehicle.parameters[name].value
        changed = tuple(factor * v for v in value) if isinstance(value, tuple) else factor * value
        told[f"{letter} {factor - 1:+.0%}"] = vehicle.with_parameter(name, changed)
    rows: list[tuple[str | float, ...]] = []
    worst = 0.0
    for words, car in told.items():
        mean = means(
            compare(
                run_estimators(driven.log, car, ("intent-pedals", "kinematic"), (_ELL,), preset=preset), driven.truth
            )
        )
        ours = mean["intent-pedals", _ELL, "model"]
        ratios = [shift_ratio(mean, _ELL, truth, "intent-pedals") for truth in SHIFT_LIMITS]
        rows.append((words, ours["matched"], ours["matched_zero"], *ratios))
        worst = max(worst, ratios[0])
    limit = 2 * SHIFT_LIMITS["model"][_ELL]
    items = (
        Item("gear shifts are rejected with a vehicle file that is 5 to 10 % wrong", None, worst, "1", worst <= limit,
             "not in the paper; jerk error inside shifts, intention over kinematic, against the model's intention, worst of the "
             f"table; at most {limit:g} counts, twice what the right file is held to"),
    )  # fmt: skip
    table = Table(
        ("the estimator is told", "error, lag taken out, m/s³", "zero", "inside shifts, model", "inside shifts, plan"), tuple(rows),
        "Inside shifts: jerk error of the intention over that of the kinematic model, against each truth. ell = 2.",
    )  # fmt: skip
    lead = (
        "Everywhere else on this page the estimator is told the car's true parameters, as the paper knows those of its own car. "
        "Real vehicle files are somewhat wrong.",
    )
    return Chapter("A vehicle file that is not quite right", lead, (table,), items)
