"""Okamoto, Tsiotras: Data-driven human driver lateral control models for developing haptic-shared control advanced driver
assist systems, sections 3 and 4: the wheel identified, and the driver's torque estimated without a torque sensor.

Robotics and Autonomous Systems, 2019. Made again on simulated wheels with many seeds, on a simulated driving simulator, and on
recordings of real vehicles where they are there.
"""

from __future__ import annotations

from pathlib import Path

from codriver.papers.registry import PAPERS
from codriver.papers.reproduction import Reproduction, Tell
from codriver.papers.steering2019.consistency import consistency_chapter
from codriver.papers.steering2019.design import design_chapter
from codriver.papers.steering2019.drive import drive_chapter
from codriver.papers.steering2019.filters import filters_chapter
from codriver.papers.steering2019.identification import identification_chapter
from codriver.papers.steering2019.recorded import recorded_chapters
from codriver.papers.steering2019.robustness import robustness_chapter
from codriver.papers.steering2019.simulator import simulator_chapter, visit_lab
from codriver.papers.steering2019.torque import torque_chapter

# Seeds; those of the fits by prediction errors; those of the smoothers.
WHOLE, QUICK = (200, 50, 10), (20, 4, 3)
CHIRP_ALONE = 5.0  # s of a drive that nobody looks at


def reproduce(tell: Tell, quick: bool, recordings: Path | None) -> Reproduction:
    """The paper, made again; see `codriver.papers.reproduce`."""
    seeds, fitted, smoothed = QUICK if quick else WHOLE
    tell(f"identifying a wheel {seeds} times in each of three readings of the noise")
    identified = identification_chapter(seeds, fitted)
    tell("trying other settings")
    robust = robustness_chapter(seeds)
    tell("estimating the driver's torque")
    designed, torque = design_chapter(), torque_chapter(seeds)
    tell("tuning Kalman filters and the PI observer, and judging them")
    compared, bands = filters_chapter(seeds, smoothed), consistency_chapter(seeds)
    tell("weighing, chirping and driving on the rig")
    lab = visit_lab()
    simulator, drive = simulator_chapter(lab, visit_lab(0.0, CHIRP_ALONE)), drive_chapter(lab)
    chapters = (
        identified,
        robust,
        designed,
        torque,
        compared,
        bands,
        simulator,
        drive,
        *recorded_chapters(recordings, tell),
    )
    return Reproduction(
        "steering2019",
        "The driver's steering torque without a torque sensor (2019, sections 3 and 4), made again",
        PAPERS["steering2019"][1],
        "Every table, figure and claim of sections 3 and 4 beside what codriver finds: the paper's simulated wheel with many "
        "seeds in place of one, Kalman filters and smoothers beside its PI observer, a simulated rig in place of its driving "
        "simulator, and recordings of real vehicles whose torque is known. The recordings of the paper itself were never "
        "published.",
        chapters,
        (("seeds", str(seeds)), ("noise (84)", "dt w")),
    )  # fmt: skip
