"""Section 5.3 and figure 15 of 2019: a two-point driver identified from the human by dual EKF, who then drives in his place.

    in sd = |ln(value / truth)| / (sd / value)         how far a parameter is off, in the standard errors claimed

The paper prints no parameters; its figure 15 shows the torque of the driver identified. Here the truth is known: the driver of
figure 14, whose gains drift, and the same one without variation. Every way starts from the same wrong driver.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from codriver.errors import UsageError
from codriver.identify import DriverFit, identify_driver
from codriver.identify.driver_dual_ekf import dual_ekf
from codriver.identify.driver_fit import ASKED
from codriver.models.two_point import TwoPointDriver
from codriver.models.two_point_file import LETTERS
from codriver.papers.drivers2019.judge import Judged, judge
from codriver.papers.drivers2019.scenes import human, observed, regenerated
from codriver.papers.item import Item
from codriver.papers.reproduction import Chapter
from codriver.report.document import BLACK, GREY, Chart, Curve, Plot, Table
from codriver.simulate.circuit import CircuitDrive, CircuitSetting, simulate_circuit

TITLE = "A driver identified from the human (5.3, figure 15)"
TRUTH = TwoPointDriver()
# A fifth to a half off the truth.
START = TwoPointDriver(anticipation=3.6, compensation=12.0, lead=0.9, lag=0.5, delay=0.16, reflex=4.5, muscle=0.14)
JUDGED = ("gmr-21", "hmm-21", "ann")  # of figure 16, by the identified driver
COVERED = 0.8  # share of 95 % intervals that hold the truth, for "identified"
MOST_POINTS = 4000
BLUE, RED = "#0072B2", "#C84C00"


@dataclass(frozen=True, eq=False)
class Identified:
    """Found from drives; one fit a drive.

    Attributes:
        dual: by dual EKF, on the PI observer's torque of the driver who varies.
        road: by the road, on his measured torque.
        still, still_road: the same two on the measured torque of the driver without variation.
        again: the drives of those found by `dual`, without variation; None where he leaves the road.
        without: K_p over its truth by a dual EKF without the recurrent derivative, on the driver without variation.
    """

    dual: tuple[DriverFit, ...]
    road: tuple[DriverFit, ...]
    still: DriverFit
    still_road: DriverFit
    again: tuple[CircuitDrive | None, ...]
    without: float


def identified(seeds: Sequence[int]) -> Identified:
    """Identify and drive again.

    Args:
        seeds: of the drives of figure 14.
    """
    dual = tuple(identify_driver(observed(human(seed)), START, by="dual-ekf") for seed in seeds)
    road = tuple(identify_driver(human(seed).log(), START) for seed in seeds)
    still, still_road = (identify_driver(regenerated(seeds[0]).log(), START, by=by) for by in ("dual-ekf", "road"))
    one_step = dual_ekf(still.records[0], START, ASKED, recurrent=False).last()["anticipation"][0]
    again = tuple(_again(fit.best, seed) for fit, seed in zip(dual, seeds, strict=True))
    return Identified(dual, road, still, still_road, again, one_step / TRUTH.anticipation)


def _again(driver: TwoPointDriver, seed: int) -> CircuitDrive | None:
    try:
        return simulate_circuit(CircuitSetting(driver, laps=1), seed=seed)
    except UsageError:  # he leaves the road
        return None


def figure_15_chapter(found: Identified, seeds: Sequence[int], varied: tuple[Judged, Judged]) -> Chapter:
    """The chapter.

    Args:
        found: by `identified`.
        seeds: of the drives.
        varied: figure 14, under each protocol.
    """
    items = (*_of_paper(found), *_of_figure_16(found, varied), *_beside(found, seeds))
    words = (
        "The paper smooths the human's data, identifies a sensorimotor two-point driver by a dual EKF, and lets him drive; it "
        "prints no parameters. Here a dual EKF gets the PI observer's torque of the driver of figure 14, unsmoothed, and starts "
        "from a driver a fifth to a half off. K_r and where he looks are given. Beside it: by the road, the library's default "
        "(docs/two-point.md), on the measured torque.",
    )
    return Chapter(TITLE, words, (_torques(found, seeds), _table(found), _paths(found)), items)


def off(fit: DriverFit) -> dict[str, float]:
    """How far each parameter sought is off, in the standard errors claimed, told or not."""
    assert fit.found is not None
    sd = np.sqrt(np.maximum(fit.found.plain.diagonal(), fit.found.robust.diagonal()))
    truth = np.log([getattr(TRUTH, n) for n in fit.names])
    return dict(zip(fit.names, (np.abs(fit.found.theta - truth) / sd).tolist(), strict=True))


def _covered(fits: Sequence[DriverFit]) -> tuple[int, int, str]:
    """How many 95 % intervals hold the truth, of how many, and the worst in words."""
    far = [(x, n) for fit in fits for n, x in off(fit).items()]
    worst, name = max(far)
    return sum(x < 1.96 for x, _ in far), len(far), f"{LETTERS[name][0]} is off most, by {worst:.1f} standard errors"


def _of_paper(found: Identified) -> tuple[Item, ...]:
    held, of, worst = _covered(found.dual)
    ratio = np.mean([fit.best.reflex for fit in found.dual]) / TRUTH.reflex
    drove = [d for d in found.again if d is not None]
    aside = float(np.sqrt(np.mean([np.mean(d.offset**2) for d in drove]))) if drove else float("nan")
    return (
        Item("5.3: the driver's parameters are identified by a dual EKF", "identified",
             f"{held} of {of} 95 % intervals hold the truth", "", held >= COVERED * of,
             f"{COVERED:g} of them counts; the intervals are the filter's own. {worst}; K_t is {ratio:.2f} of the true one on "
             "average. His own noise comes back to him through the car, and gains that drift are no constants"),
        Item("fig. 15: the identified driver drives around the track", "drives",
             f"{len(drove)} of {len(found.again)} stay on the road, {aside:.2f} m off the path (rms)", "",
             len(drove) == len(found.again), "a lap each way at 50 km/h, without variation"),
    )  # fmt: skip


def _of_figure_16(found: Identified, varied: tuple[Judged, Judged]) -> tuple[Item, ...]:
    """Figure 16 as the paper makes it: by the identified driver; section 5.3's claims on GMR and HMM-GMR."""
    drove = [d for d in found.again if d is not None]
    if not drove:
        return ()
    items = []
    for human_driver, logs in zip(varied, ([observed(d) for d in drove], [d.log() for d in drove]), strict=True):
        still = judge(logs, JUDGED, human_driver.protocol)
        gain = {n: still.ratio(n) / human_driver.ratio(n) for n in ("gmr-21", "hmm-21")}
        items.append(Item(
            f"fig. 16 by the identified driver, {human_driver.protocol.name}: GMR and HMM-GMR much better than with the human",
            "significant", f"GMR {gain['gmr-21']:.2f}, HMM-GMR {gain['hmm-21']:.2f} times", "", max(gain.values()) <= 0.8,
            "the next chapter has the true driver in his place. Each as a fraction of PWC, over figure 14's; at most 0.8 counts. "
            f"GMR {still.ratio('gmr-21', 'ann'):.2f}, HMM-GMR {still.ratio('hmm-21', 'ann'):.2f} of ANN",
        ))  # fmt: skip
    return tuple(items)


def _beside(found: Identified, seeds: Sequence[int]) -> tuple[Item, ...]:
    held, of, worst = _covered(found.road)
    told = [len(fit.parameters) for fit in found.road]
    same, of_same, worst_same = _covered([found.still])
    own, of_own, worst_own = _covered([found.still_road])
    mine, true = _differences(found, seeds)
    return (
        Item("fig. 15: the identified driver's torque is like the human's", None,
             f"{mine:.3f} of its rms off, the true driver {true:.3f}", "", mine <= 1.5 * true,
             "not in the paper, whose figure 15 shows the torque alone; rms of the difference to the human's true torque, both "
             "without variation; at most 1.5 times counts. So a torque that looks right does not tell that the parameters are"),
        Item("dual EKF, a driver who does not vary: intervals hold the truth", None, f"{same} of {of_same}", "",
             same >= COVERED * of_same, f"not in the paper; measured torque. {worst_same}"),
        Item("dual EKF without the recurrent derivative (remark 4) cannot identify", None, found.without, "1",
             abs(found.without - 1) > 0.05, "not in the paper, whose remark 4 is on the wheel; K_p over the true one, a driver who "
             f"does not vary; more than 5 % off counts. With it {found.still.best.anticipation / TRUTH.anticipation:.3f}"),
        Item("by the road, a driver who varies: intervals hold the truth", None, f"{held} of {of}", "", held >= COVERED * of,
             f"not in the paper; measured torque, {of // len(found.road)} parameters a drive. {worst}. Told are only "
             f"{', '.join(map(str, told))}: four minutes are too few"),
        Item("by the road, a driver who does not vary: intervals hold the truth", None, f"{own} of {of_own}", "",
             own >= COVERED * of_own, f"not in the paper. {worst_own}; {len(found.still_road.parameters)} are told"),
    )  # fmt: skip


def _differences(found: Identified, seeds: Sequence[int]) -> tuple[float, float]:
    """RMS of the torque's difference to the human's over its rms: of the identified driver, of the true one without variation."""
    sums = np.zeros(3)
    for drive, seed in zip(found.again, seeds, strict=True):
        if drive is None:
            continue
        torque = human(seed).driver_torque
        sums += [
            np.sum((drive.driver_torque - torque) ** 2), np.sum((regenerated(seed).driver_torque - torque) ** 2),
            np.sum(torque**2),
        ]  # fmt: skip
    mine, true = np.sqrt(sums[:2] / sums[2]) if sums[2] > 0 else (np.nan, np.nan)
    return float(mine), float(true)


def _torques(found: Identified, seeds: Sequence[int]) -> Chart:
    """Figure 15, and the human's torque."""
    curves = []
    log = observed(human(seeds[0]))["driver_torque"]
    use = slice(None, None, max(log.time.size // MOST_POINTS, 1))
    curves.append(Curve("the human's (PI observer)", log.time[use], log.values[use], GREY, width=2.5))
    drive = found.again[0]
    if drive is not None:
        use = slice(None, None, max(drive.time.size // MOST_POINTS, 1))
        curves.append(Curve("of the driver identified", drive.time[use], drive.driver_torque[use], RED))
    return Chart(
        "Figure 15: torque of the driver identified by dual EKF, around the track", "time (s)",
        (Plot("torque (N m)", tuple(curves), 260),), "First to the left, then to the right, as in figure 13. One drive.",
    )  # fmt: skip


def _paths(found: Identified) -> Chart:
    """Parameters over time, of the driver who varies and of the one who does not."""
    plots = []
    shown = (("varies", found.dual[0], BLUE), ("does not vary", found.still, "#007A5A"))
    for k, name in enumerate(found.dual[0].names):
        curves, ends = [], np.zeros(2)
        for label, fit, color in shown:
            assert fit.path is not None
            use = slice(None, None, max(fit.path.time.size // MOST_POINTS, 1))
            time, value, sd = fit.path.time[use], fit.path.values[use, k], fit.path.sd[use, k]
            curves.append(
                Curve(f"{label}, one sd" if k == 0 else "", time, value, color, low=value - sd, high=value + sd)
            )
            ends = time[[0, -1]]
        curves.append(Curve("truth" if k == 0 else "", ends, np.full(2, getattr(TRUTH, name)), BLACK, dash="dot"))
        letter, unit = LETTERS[name]
        plots.append(Plot(f"{letter} ({unit})" if unit != "1" else letter, tuple(curves), 110))
    return Chart(
        "Parameters over time, by dual EKF", "time (s)", tuple(plots),
        "The torque of the driver who varies is the PI observer's, that of the other a sensor's.",
    )  # fmt: skip


def _table(found: Identified) -> Table:
    columns = (found.dual[0], found.road[0], found.still, found.still_road)
    rows = tuple(
        (
            f"{LETTERS[n][0]}, {LETTERS[n][1]}", getattr(TRUTH, n), getattr(START, n), *(_cell(fit, n) for fit in columns),
        )
        for n in found.dual[0].names
    )  # fmt: skip
    return Table(
        ("parameter", "truth", "start", "varies: dual EKF, PI torque", "varies: by the road", "does not: dual EKF",
         "does not: by the road"),
        rows,
        "Value ± standard error, one drive. In brackets: the library refuses to tell it, since the drive leaves too much doubt or "
        "the value is far from all that was known.",
    )  # fmt: skip


def _cell(fit: DriverFit, name: str) -> str:
    assert fit.found is not None
    k = fit.names.index(name)
    value = float(np.exp(fit.found.theta[k]))
    sd = value * float(np.sqrt(max(fit.found.plain[k, k], fit.found.robust[k, k])))
    text = f"{value:.3g} ± {sd:.2g}"
    return text if name in fit.parameters else f"({text})"
