"""Okamoto, Tsiotras: Data-driven human driver lateral control models for developing haptic-shared control advanced driver
assist systems, sections 2, 5 and 6: which model foretells a driver's torque best.

Robotics and Autonomous Systems, 2019. Made again on simulated drivers on a circuit, under the paper's protocol and under one
without its leaks, and on recordings with a measured torque where they are there.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from codriver.papers.drivers2019 import findings
from codriver.papers.drivers2019.figure_15 import figure_15_chapter, identified
from codriver.papers.drivers2019.figures import figure, means, ratios
from codriver.papers.drivers2019.judge import HONEST, METHODS, PAPER, WITH_ROAD, Judged, judge
from codriver.papers.drivers2019.recorded import recorded_chapters
from codriver.papers.drivers2019.scenes import SCENES, human, observed
from codriver.papers.item import Item
from codriver.papers.registry import PAPERS
from codriver.papers.reproduction import Chapter, Reproduction, Tell
from codriver.report.document import Findings

# Drives of figures 12, 14 and 16: those of a driver who does not vary differ by the sensors' noise alone.
WHOLE = {"figure 12": 2, "figure 14": 3, "figure 16": 2}
QUICK = dict.fromkeys(WHOLE, 1)
SLOW = ("boosting", "guarded")  # left out in a quick look
BY_PI = replace(PAPER, name="the paper's protocol")
BY_SENSOR = replace(PAPER, name="the paper's, torque measured")
LEAK = ("ann", "gmr-21", "ann-decay", "gmr-bic")  # of the table of leaks, under protocols that no figure needs
Found = dict[str, tuple[Judged, Judged]]
TITLES = {
    "figure 12": "A driver who does not vary (5.2, figure 12)", "figure 14": "A driver who varies (5.3, figure 14)",
    "figure 16": "The same driver without variation (5.3, figure 16)",
}  # fmt: skip


def reproduce(tell: Tell, quick: bool, recordings: Path | None) -> Reproduction:
    """The paper, made again; see `codriver.papers.reproduce`."""
    seeds = QUICK if quick else WHOLE
    methods = [name for name in METHODS if not (quick and name in SLOW)]
    found: Found = {}
    for scene, drive in SCENES.items():
        drives = [drive(seed) for seed in range(1, seeds[scene] + 1)]
        both = []
        for protocol, logs in ((BY_PI, [observed(d) for d in drives]), (HONEST, [d.log() for d in drives])):
            under = _under(f"{scene}, {protocol.name}", tell)
            both.append(judge(logs, methods, protocol, sparse=quick, tell=under))
        found[scene] = both[0], both[1]
    tell("what the leak is worth")
    leak = leak_chapter(found["figure 14"], seeds["figure 14"])
    tell("figure 15, the driver identified")
    which = range(1, seeds["figure 14"] + 1)
    fifteen = figure_15_chapter(identified(which), which, found["figure 14"])
    first, second, third = (_figure_chapter(scene, found) for scene in SCENES)
    chapters = (first, second, fifteen, third, leak, *recorded_chapters(recordings, tell))
    return Reproduction(
        "drivers2019",
        "Models of a driver's steering torque (2019, sections 2, 5 and 6), made again",
        PAPERS["drivers2019"][1],
        "Every method of the paper, and some beside it, foretells the torque 0.2 s ahead: on simulated drivers in place of "
        "CarSim's and of the human, whose recordings were never published. Each finding is judged twice: under the paper's "
        "protocol, which leaks, and from the past alone.",
        chapters,
        (("drives of figures 12, 14, 16", ", ".join(str(n) for n in seeds.values())), ("rows a second", "5"),
         ("Gaussian process", "sparse" if quick else "on all rows")),
    )  # fmt: skip


def _under(head: str, tell: Tell) -> Tell:
    return lambda text: tell(f"{head}: {text}")


def _figure_chapter(scene: str, found: Found) -> Chapter:
    paper, honest = found[scene]
    words = {
        "figure 12": "A two-point driver whose anticipation is a predictive plan, as the paper's; car and circuit are this "
        "project's. In the paper's protocol the label is the PI observer's torque in all three figures. The paper states no "
        "regularisation: its GMR and HMM-GMR have none here, its ANN a weight decay of 1e-8, which was picked from four values "
        'with the outcomes in sight. Which method comes first hangs on that; "ANN (2), weight decay" is the same network with '
        "the library's 0.01. Sub-data sets are named as in the paper: A holds out the last quarter of a drive, D the first.",
        "figure 14": "In the human's place: a two-point driver whose gains drift by 15 % and whose eyes and hands are noisy. How "
        "much a human varies was not measured here, so this says what variation does, not how much of it there is.",
        "figure 16": "The paper identifies a driver from the human and drives again. In his place: the driver of figure 14 "
        "with his true parameters and without variation.",
    }[scene]
    items: list[Item] = []
    for k, f in enumerate((paper, honest)):
        if scene == "figure 12":
            items += findings.of_figure_12(f)
        elif scene == "figure 14":
            items += (*findings.of_figure_14(f), *findings.beside(f))
        else:
            items += findings.of_figure_16(f, found["figure 14"][k])
    if scene == "figure 14":
        items += findings.bounds(honest)
    charts = (
        *(figure(scene.capitalize(), f) for f in (paper, honest)),
        *(means(scene.capitalize(), f) for f in (paper, honest)),
    )
    table = ratios((paper, honest), "RMSE over PWC's, over all drives and sub-data sets; the last row is PWC's own.")
    return Chapter(TITLES[scene], (words,), (*charts, table), tuple(items))


def leak_chapter(judged: tuple[Judged, Judged], seeds: int) -> Chapter:
    """What each leak is worth on the driver who varies.

    Args:
        judged: under the paper's protocol and from the past alone.
        seeds: drives.
    """
    paper, honest = judged
    logs = [human(seed).log() for seed in range(1, seeds + 1)]
    sensor, road = (judge(logs, LEAK, protocol) for protocol in (BY_SENSOR, WITH_ROAD))
    flatters = {name: paper.ratio(name) / honest.ratio(name) for name in ("ridge", "ann")}
    items = (
        Item("the paper's protocol flatters", None,
             f"ridge {flatters['ridge']:.3f}, ANN {flatters['ann']:.3f} times their error from the past alone", "",
             max(flatters.values()) < 0.5,
             "not in the paper; each as a fraction of PWC; below 0.5 counts. The label is a linear function of the wheel's angle, "
             "which the features hold at that very moment"),
        Item("the library warns of every leak", None, f"{len(paper.leaks)} warnings", "",
             len(paper.leaks) == len(paper.protocol.leaks) + 1 and not honest.leaks,
             "not in the paper; those of the protocol, and that the torque is estimated from the angle; none from the past alone"),
    )  # fmt: skip
    overfitted = (
        (f"With the road ahead the ANN without decay errs {road.ratio('ann'):.1f} times as much as PWC: it has more to fit and "
         f"fails on what it has not seen; with the library's decay {road.ratio('ann-decay'):.2f} times.",)
        if road.ratio("ann") > 1 else ()
    )  # fmt: skip
    said = tuple((f.severity, f.text) for f in paper.verdict if f.text.startswith("leak"))
    return Chapter(
        "What the leak is worth (6)",
        ("What the library says of the paper's protocol with the PI observer's torque:", *overfitted),
        (
            Findings(said),
            ratios(
                (paper, sensor, honest, road),
                "A driver who varies; RMSE over PWC's under the same protocol. The first two columns are figures of the protocol, "
                "not of the models. A dash: not judged.",
            ),
        ),
        items,
    )
