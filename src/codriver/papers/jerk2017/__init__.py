"""Bisoffi, Biral, Da Lio, Zaccarian: Longitudinal Jerk Estimation of Driver Intentions for Advanced Driver Assistance Systems.

IEEE/ASME Transactions on Mechatronics 22(4), 2017, doi:10.1109/TMECH.2017.2716838. Made again on the simulated road test:
the paper's car, a road like the paper's, six made-up drivers.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from codriver.estimate import Estimate
from codriver.papers.drives import ESTIMATORS, Driven, Job, Order, drives
from codriver.papers.item import Item, near
from codriver.papers.jerk2017.alternatives import alternatives_chapter
from codriver.papers.jerk2017.drivers import drivers_chapter
from codriver.papers.jerk2017.identification import identification_chapter
from codriver.papers.jerk2017.noise import noise_chapter
from codriver.papers.jerk2017.parameters import parameters_chapter
from codriver.papers.jerk2017.performance import performance_chapter
from codriver.papers.jerk_design import Places, design_chapter
from codriver.papers.judged import judged_chapter
from codriver.papers.registry import PAPERS
from codriver.papers.reproduction import Chapter, Reproduction, Tell
from codriver.simulate import PEDAL_NOISE_LEVELS
from codriver.simulate.compare import run_estimators
from codriver.simulate.styles import STYLES
from codriver.vehicles import load_vehicle

VEHICLE = PRESET = "bisoffi2017"
ELLS = (1.0, 2.0, 3.0)
MIDDLE = 2.0
PLACES = Places("II-C", "III", "eq. (17)", "eq. (18)", "4 x 4, diag(1, ell, ell, ell)")


def reproduce(tell: Tell, quick: bool, recordings: Path | None) -> Reproduction:
    """The paper, made again; see `codriver.papers.reproduce`."""
    styles = list(STYLES)
    jobs = [Job(style, number) for number, style in enumerate(styles, 1)]
    last = jobs[-1]
    noisy = [Job(last.driver, last.seed, *level) for level in PEDAL_NOISE_LEVELS[1:]]
    if quick:
        jobs, noisy = jobs[-2:], noisy[-1:]
    order = Order("road", load_vehicle(VEHICLE), PRESET, ELLS, (*ESTIMATORS, "intent-fused"))
    driven = drives([*jobs, *noisy], order, tell)
    return reproduction(driven[: len(jobs)], driven[len(jobs) :], tell)


def reproduction(driven: Sequence[Driven], noisy: Sequence[Driven], tell: Tell) -> Reproduction:
    """The chapters from the drives; the last driver's is the one of figures 1 to 6.

    Args:
        driven: one drive a driver.
        noisy: the last driver's drive with noisier pedals.
        tell: is told each stage.
    """
    vehicle, sixth = load_vehicle(VEHICLE), driven[-1]
    tell("estimating")
    own = run_estimators(sixth.log, vehicle, ("intent-pedals", "kinematic", "pedals-only"), ELLS, preset=PRESET)
    intent: dict[float, Estimate] = {ell: own["intent-pedals", ell] for ell in ELLS}
    pedals = own["pedals-only", None]
    each = {
        drive.job.driver: run_estimators(drive.log, vehicle, ("intent-pedals",), (MIDDLE,), preset=PRESET)[
            "intent-pedals", MIDDLE
        ]
        for drive in driven
    }
    tell("identifying and judging")
    chapters = (
        design_chapter(PRESET, ELLS, PLACES),
        _route(sixth),
        identification_chapter(sixth, vehicle, intent[MIDDLE]),
        performance_chapter(sixth, intent, pedals),
        alternatives_chapter(sixth, intent[MIDDLE], own["kinematic", MIDDLE], pedals),
        noise_chapter((sixth, *noisy)),
        drivers_chapter({drive.job.driver: drive for drive in driven}, each),
        judged_chapter(driven, ELLS, "intent-pedals", limits=True),
        parameters_chapter(sixth, vehicle, PRESET),
    )
    return Reproduction(
        "jerk2017",
        "Longitudinal jerk estimation of driver intentions (2017), made again",
        PAPERS["jerk2017"][1],
        "Every table, figure and claim of the paper beside what codriver finds on a simulated road test: the paper's car with "
        "its robotised gearbox, a road of 53 km with the paper's scenes, a CAN bus with noise, jitter and holes, six drivers. "
        "The drives of the paper itself were never published.",
        chapters,
        (("drives", f"{len(driven)} of the road test, one a driver"), ("car and noise", f"{VEHICLE}, ell = 1, 2, 3")),
    )


def _route(driven: Driven) -> Chapter:
    """Section IV's description of the test."""
    truth = driven.truth
    length = float(truth["distance"].values[-1]) / 1000
    minutes = float(truth["distance"].time[-1] - truth["distance"].time[0]) / 60
    items: tuple[Item, ...] = (
        near("IV: length of the route", 53.0, length, "km", 0.02),
        near("IV: duration of the drive", 42.0, minutes, "min", 0.1, "the sixth driver, who is brisk"),
    )
    words = (
        "Urban arteries, extra-urban roads, motorways, roundabouts, ramps and intersections, as the paper lists them.",
    )
    return Chapter("The road test (IV)", words, (), items)
