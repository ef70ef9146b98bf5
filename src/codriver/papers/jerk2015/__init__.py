"""Bisoffi, Biral, Da Lio, Zaccarian: Longitudinal Jerk Estimation for Identification of Driver Intention.

IEEE 18th International Conference on Intelligent Transportation Systems, 2015, doi:10.1109/ITSC.2015.301. Made again on two
laps of a simulated track, with the torque request in place of pedals.
"""

from __future__ import annotations

from pathlib import Path

from codriver.papers.drives import Driven, Job, Order, drives
from codriver.papers.item import Item
from codriver.papers.jerk2015.shifts import Run, shifts_chapter
from codriver.papers.jerk2015.states import states_chapter
from codriver.papers.jerk2015.zoe import zoe_chapter
from codriver.papers.jerk_design import Places, design_chapter
from codriver.papers.judged import judged_chapter, means, shift_ratio
from codriver.papers.registry import PAPERS
from codriver.papers.reproduction import Chapter, Reproduction, Tell
from codriver.report.document import Table
from codriver.simulate import nominal_2015
from codriver.simulate.car_parameters import PRINTED_2015, ROLLING_RADIUS_2015
from codriver.simulate.compare import compare, run_estimators
from codriver.vehicles import Vehicle, load_vehicle

VEHICLE = PRESET = "bisoffi2015"
ELLS = (0.8, 1.4, 2.0)
MIDDLE = 1.4
ESTIMATORS = ("intent-torque", "kinematic")
PLACES = Places("eq. (11)", "remark 4", "eq. (18)", "eq. (19)", "diag(1, ell)")
JOBS = tuple(Job(style, k) for k, style in enumerate(("ordinary", "brisk", "aggressive", "smooth", "anticipating"), 1))


def reproduce(tell: Tell, quick: bool, recordings: Path | None) -> Reproduction:
    """The paper, made again; see `codriver.papers.reproduce`."""
    car = nominal_2015()
    order = Order("track", car, PRESET, ELLS, ESTIMATORS)
    driven = drives(JOBS[:1] if quick else JOBS, order, tell)
    first = driven[0]
    tell("estimating")
    own = run_estimators(first.log, car, ESTIMATORS, ELLS, preset=PRESET)
    runs = [_run(drive, car) for drive in driven]
    intent = {ell: own["intent-torque", ell] for ell in ELLS}
    kinematic = {ell: own["kinematic", ell] for ell in ELLS}
    tell("judging")
    chapters = (
        design_chapter(PRESET, ELLS, PLACES),
        _parameters(first),
        states_chapter(first, intent, kinematic[MIDDLE]),
        shifts_chapter(runs),
        judged_chapter(driven, ELLS, "intent-torque", limits=False),
        zoe_chapter(recordings),
    )
    return Reproduction(
        "jerk2015",
        "Longitudinal jerk estimation for identification of driver intention (2015), made again",
        PAPERS["jerk2015"][1],
        "Every figure and claim of the paper beside what codriver finds on two laps of a simulated track, with the paper's "
        "car and noise and the torque request of the engine's unit; and a recording of an electric car.",
        chapters,
        (("drives", f"{len(driven)} of two laps, one a driver"), ("car and noise", f"{VEHICLE}, ell = 0.8, 1.4, 2")),
    )


def _run(driven: Driven, car: Vehicle) -> Run:
    """A drive with its estimates at the middle ell."""
    made = run_estimators(driven.log, car, ESTIMATORS, (MIDDLE,), preset=PRESET)
    return Run(driven, made["intent-torque", MIDDLE], made["kinematic", MIDDLE])


def _parameters(driven: Driven) -> Chapter:
    """Section V's parameters, and what follows from the printed tau."""
    from codriver.observers.registry import get_estimator

    later = load_vehicle("bisoffi2017").numbers("transmission")
    radii = [printed / tau for printed, tau in zip(PRINTED_2015, later, strict=True)]
    printed = run_estimators(driven.log, load_vehicle(VEHICLE), ESTIMATORS, (MIDDLE,), preset=PRESET)
    wrong = shift_ratio(means(compare(printed, driven.truth)), MIDDLE, "model", "intent-torque")
    right = shift_ratio(means(driven.scores), MIDDLE, "model", "intent-torque")
    needs = get_estimator("intent-torque").parameters
    items = (
        Item("remark 2: only tau and M need to be known", "tau, M", ", ".join(needs), "", needs == ("mass", "transmission"),
             "the parameters that intent-torque asks of a vehicle"),
        Item("V: tau = 13, 6.9, 4.3, 3.1, 2.5 are 1/r_r times efficiencies and ratios (eq. 2)", "as printed",
             f"{min(radii):.3f} to {max(radii):.3f} m", "", min(radii) > 0.5,
             "printed tau over those of the 2017 paper, gear by gear: a rolling radius each time, so 1/r_r is left out. Quotients "
             "near 1 would count"),
        Item("V: with the printed tau the gear shifts are rejected", "rejected", wrong, "1", wrong < 0.5,
             f"jerk error inside shifts, intention over kinematic, ell = {MIDDLE:g}; with tau / r_r it is {right:.3f}. Below a "
             "half counts"),
    )  # fmt: skip
    words = (
        f"The car simulated here has the printed tau divided by r_r = {ROLLING_RADIUS_2015:g} m, so that it drives like a car; the "
        "estimator is given the same, rounded to 0.1 1/m, unless said otherwise.",
    )
    rows = tuple((str(gear), p, t, r) for gear, (p, t, r) in enumerate(zip(PRINTED_2015, later, radii, strict=True), 1))
    return Chapter(
        "Parameters (V)", words, (Table(("gear", "tau printed 2015", "tau 2017, 1/m", "quotient, m"), rows),), items
    )
