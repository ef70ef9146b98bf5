"""Damon, Ichalal, Arioui 2018: Steering and lateral motorcycle dynamics estimation: validation of Luenberger-like LPV observer
approach.

Made again on a nonlinear motorcycle in place of BikeSim, on three rides in place of the paper's, with other observers beside its
own.
"""

from __future__ import annotations

from pathlib import Path

from codriver.papers.motorcycle2018.claims import claims_chapter
from codriver.papers.motorcycle2018.compare import compare
from codriver.papers.motorcycle2018.design import design_chapter
from codriver.papers.motorcycle2018.figures import figure_chapters
from codriver.papers.motorcycle2018.frames import frames_chapter
from codriver.papers.motorcycle2018.model import model_chapter
from codriver.papers.motorcycle2018.rides import NOISE, RATE, WORDS, scene
from codriver.papers.motorcycle2018.robustness import robustness_chapter
from codriver.papers.motorcycle2018.steering import steering_chapter
from codriver.papers.motorcycle2018.tables import in_short, tables_chapter
from codriver.papers.registry import PAPERS
from codriver.papers.reproduction import Reproduction, Tell

# Readings of noisy sensors; seconds of each ride, None for the whole.
SEEDS = (5, 1)
WHOLE: dict[str, float | None] = dict.fromkeys(WORDS)
QUICK: dict[str, float | None] = {"track": 25.0, "slalom": None, "double-lane-change": None}


def reproduce(
    tell: Tell, quick: bool, recordings: Path | None, seconds: dict[str, float | None] | None = None
) -> Reproduction:
    """The paper, made again; see `codriver.papers.reproduce`.

    Args:
        tell: is told each stage.
        quick: shorter rides, one reading of the sensors, fewer variations.
        recordings: not used; of none is the truth known that this paper needs.
        seconds: of each ride; by default those of `WHOLE` or `QUICK`.
    """
    seeds = SEEDS[quick]
    tell("the model")
    chapters = [model_chapter()]
    rides = []
    for name, length in (seconds or (QUICK if quick else WHOLE)).items():
        tell(f"riding: {WORDS[name]}")
        rides.append(scene(name, length))
    tell("body frame and road frame")
    chapters.append(frames_chapter(rides))
    tell("designing by linear matrix inequalities")
    chapters.append(design_chapter(rides, quick))
    found = compare(rides, seeds, tell)
    tell("drawing")
    chapters += [*figure_chapters(rides), tables_chapter(found)]
    tell("noise, filters and starts")
    chapters += [claims_chapter(rides, found), steering_chapter(rides)]
    chapters.append(robustness_chapter(rides, found, quick, tell))
    return Reproduction(
        "motorcycle2018",
        "A motorcycle's lateral motion and its rider's torque (2018), made again",
        PAPERS["motorcycle2018"][1],
        "Every table, figure and claim of the paper beside what codriver finds. The paper's BikeSim rides and its machine's "
        "parameters were never published; in their place stand a nonlinear motorcycle of this project (Sharp's masses and "
        "tyres, with width, saturation, suspension, load transfer and a leaning rider) and three rides like those described. "
        f"The observer knows the linear model alone, as the paper's does. {in_short(found)}",
        tuple(chapters),
        (("rides", ", ".join(f"{WORDS[r.name]} {r.record.ride.time[-1]:.0f} s" for r in rides)),
         ("readings of noisy sensors", str(seeds)), ("noise", f"{NOISE:.1%} of rms at {RATE} Hz")),
    )  # fmt: skip
