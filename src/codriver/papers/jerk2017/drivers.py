"""2017 section IV-D: six drivers on the same road, over the curvilinear coordinate (figure 7)."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations

import numpy as np

from codriver.drivers.slopes import slope_percent
from codriver.estimate import Estimate
from codriver.papers.drawing import window_in
from codriver.papers.drives import Driven
from codriver.papers.item import Item
from codriver.papers.jerk2017.performance import BOXES, bursts, in_order
from codriver.papers.reproduction import Chapter
from codriver.report.document import BLACK, COLORS, Chart, Curve, Plot, Table
from codriver.report.shown import shown
from codriver.signals.signal import Array
from codriver.simulate import ROAD_TEST_STRETCHES, STYLES
from codriver.simulate.judge import at, rms

STEP = 1.0  # m along the road
# Where slowing down for a line is looked for: line and metres before it, and the number of the box. The share of it done
# that is looked for: on the ramp the slowing has begun before, for its speed limit.
_LINES = ((27_000.0, 250.0, 1), (28_900.0, 450.0, 4))
_DONE = 0.2


def drivers_chapter(drives: Mapping[str, Driven], estimates: Mapping[str, Estimate]) -> Chapter:
    """Figure 7: all drivers with the same observer, ell = 2; in the paper's order."""
    place = ROAD_TEST_STRETCHES["comparison"]
    s = np.arange(place.start, place.stop, STEP)
    found = {name: _Along(drives[name], estimates[name], s) for name in drives}
    names = list(found)
    words = (
        "The same observer with the same noise and ell = 2 for every driver. The six are made up, in the paper's order: "
        f"{', '.join(f'{i} {name}' for i, name in enumerate(names, 1))}. s is the true distance along the road; a log without "
        "position would take the integral of the speed.",
    )
    charts = tuple(
        _chart(f"Figure 7, drivers {first + 1} to {first + len(group)}", {n: found[n] for n in group}, s, first)
        for first, group in ((i, names[i : i + 3]) for i in range(0, len(names), 3))
    )
    return Chapter("Comparison of drivers (IV-D)", words, (_table(found, estimates), *charts, _jerks(found, s)),
                   (*_slopes(found), *_boxes(drives, estimates), *_styles(found, estimates, drives)))  # fmt: skip


class _Along:
    """One driver's signals over the distance, in display units."""

    def __init__(self, driven: Driven, estimate: Estimate, s: Array) -> None:
        part = window_in(estimate, driven.truth, float(s[0]), float(s[-1]))
        time = part(estimate.time)
        distance = at(driven.truth, "distance", time)
        valid = part(estimate.valid)

        def over(name: str, values: Array) -> Array:
            return np.asarray(np.interp(s, distance, shown(name, np.where(valid, values, np.nan))))

        self.speed = over("longitudinal_speed", part(estimate.columns["longitudinal_speed"]))
        self.acceleration = over("intentional_acceleration", part(estimate.columns["intentional_acceleration"]))
        self.jerk = over("intentional_jerk", part(estimate.columns["intentional_jerk"]))
        self.slope = slope_percent(over("acceleration_offset", part(estimate.columns["acceleration_offset"])))
        self.pedal = np.interp(s, distance, shown("accelerator_pedal", part(estimate.grid.values["accelerator_pedal"])))
        self.brake = np.interp(s, distance, shown("brake_pressure", part(estimate.grid.values["brake_pressure"])))
        self.true_slope = 100 * np.tan(np.interp(s, distance, at(driven.truth, "road_slope", time)))


def _chart(title: str, group: Mapping[str, _Along], s: Array, first: int) -> Chart:
    """The upper plots of figure 7 for some of the drivers."""
    colors = [COLORS[(first + i) % len(COLORS)] for i in range(len(group))]

    def lines(attribute: str, names: bool = False) -> tuple[Curve, ...]:
        return tuple(
            Curve(name if names else "", s, getattr(along, attribute), color)
            for (name, along), color in zip(group.items(), colors, strict=True)
        )

    true = Curve("true", s, next(iter(group.values())).true_slope, BLACK, dash="dot", width=1.2)
    return Chart(
        title, "distance s (m)",
        (
            Plot("speed (km/h)", lines("speed", True), 130), Plot("accelerator (%)", lines("pedal"), 110),
            Plot("brake (bar)", lines("brake"), 110), Plot("intent. acc. (m/s²)", lines("acceleration"), 150, (0.0,)),
            Plot("slope (%)", (*lines("slope"), true), 130, (0.0,)),
        ),
        boxes=_frames(),
    )  # fmt: skip


def _jerks(found: Mapping[str, _Along], s: Array) -> Chart:
    """The lower plots: one jerk for each driver."""
    top = max(float(np.nanmax(np.abs(along.jerk))) for along in found.values())
    plots = tuple(
        Plot(
            "jerk (m/s³)",
            (Curve(f"{i} {name}", s, along.jerk, COLORS[(i - 1) % len(COLORS)]),),
            90,
            (0.0,),
            limits=(-top, top),
        )
        for i, (name, along) in enumerate(found.items(), 1)
    )
    return Chart("Figure 7, intentional jerk of each driver", "distance s (m)", plots,
                 "Boxes as in figure 4. All plots have the same scale.", boxes=_frames())  # fmt: skip


def _frames() -> tuple[tuple[float, float, str], ...]:
    return tuple((ROAD_TEST_STRETCHES[n].start, ROAD_TEST_STRETCHES[n].stop, str(i)) for i, n in enumerate(BOXES, 1))


def _slopes(found: Mapping[str, _Along]) -> tuple[Item, ...]:
    """The slope of several drivers over s: do they agree, and with the truth?"""
    both = [np.isfinite(along.slope) for along in found.values()]
    use = np.logical_and.reduce(both)
    slopes = [along.slope[use] for along in found.values()]
    pairs = list(combinations(slopes, 2))
    apart = float(np.mean([rms(a - b) for a, b in pairs])) if pairs else 0.0
    alike = float(np.min([np.corrcoef(a, b)[0, 1] for a, b in pairs])) if pairs else 1.0
    true = next(iter(found.values())).true_slope[use]
    off = float(np.mean([rms(a - np.mean(a) - true + np.mean(true)) for a in slopes]))
    return (
        Item("fig. 7: the estimated slope coincides significantly for the drivers", "significantly", alike, "1", alike > 0.8,
             f"smallest correlation of two drivers' slopes over s; mean rms difference {apart:.2f} % of slope; above 0.8 counts"),
        Item("fig. 7: error of the slope", None, off, "% slope", off < 1.0,
             f"rms against the true slope, the accelerometer's bias taken out; the slope itself spans {np.ptp(true):.1f} %"),
    )  # fmt: skip


def _boxes(drives: Mapping[str, Driven], estimates: Mapping[str, Estimate]) -> tuple[Item, ...]:
    """What the paper sees in the boxes."""
    order = list(STYLES)
    claims = (
        ("ramp", (-1, 1), "all drivers first decelerate, then accelerate", order),
        ("bend", (-1,), "all drivers show a negative burst", order),
        ("roundabout", (-1, 1), "second, third, fifth and sixth driver: a negative burst, then positive ones",
         [order[k] for k in (1, 2, 4, 5)]),
    )  # fmt: skip
    items = []
    for name, signs, claim, named in claims:
        shows = {d: in_order(bursts(drives[d], estimates[d], name), signs) for d in drives}
        asked = [d for d in named if d in drives]
        count, number = sum(shows[d] for d in asked), BOXES.index(name) + 1
        others = [d for d in shows if d not in named and shows[d]]
        items.append(Item(f"fig. 7, box {number}: {claim}", f"{len(asked)} drivers", f"{count} of {len(asked)}", "",
                          count == len(asked), "bursts of the estimated jerk: " + ", ".join(
                              f"{d} {'yes' if shown_ else 'no'}" for d, shown_ in shows.items())
                          + (f"; {' and '.join(others)} too, of whom the paper says nothing" if others else "")))  # fmt: skip
    items.append(Item("fig. 7, box 3: peculiar to the sixth driver", "sixth only", "all", "", None,
                      "here the other car comes out before every driver, so that they can be compared"))  # fmt: skip
    return tuple(items)


def _styles(
    found: Mapping[str, _Along], estimates: Mapping[str, Estimate], drives: Mapping[str, Driven]
) -> tuple[Item, ...]:  # fmt: skip
    """Who drives how, over the whole drive; and who anticipates."""
    jerk = {name: rms(e.columns["intentional_jerk"][e.valid]) for name, e in estimates.items()}
    pedals = {name: _pedal_rate(e) for name, e in estimates.items()}
    order = sorted(jerk, key=lambda name: -jerk[name])
    busy = sorted(pedals, key=lambda name: -pedals[name])
    if len(found) < 6:
        return ()
    first, second, third, fourth, fifth, sixth = found
    items = [
        Item("fig. 7: the first driver and partly the fourth use the pedals aggressively", "first, then fourth",
             f"{busy[0]}, then {busy[1]}", "", busy[0] == first and fourth in busy[1:3],
             "rms pedal rate, %/s: " + ", ".join(f"{name} {pedals[name]:.0f}" for name in busy)
             + "; the fourth second or third counts, for “partly”"),
        Item("fig. 7: the first driver's jerk has the most and largest bursts", "first", order[0], "", order[0] == first,
             "rms of the intentional jerk, m/s³: " + ", ".join(f"{name} {jerk[name]:.2f}" for name in order)),
        Item("fig. 7: the fifth driver is the smoothest", "fifth", order[-1], "", order[-1] == fifth, "smallest rms of the jerk"),
        Item("fig. 7: the third and sixth driver lie between", "between",
             f"{order.index(third) + 1} and {order.index(sixth) + 1} of 6", "",
             all(jerk[fifth] < jerk[n] < jerk[first] for n in (third, sixth)), "rank by rms of the jerk"),
    ]  # fmt: skip
    for line, before, number in _LINES:
        ahead = {n: _anticipation(drives[n], estimates[n], line, before) for n in found}
        earliest = max(ahead, key=lambda n: ahead[n])
        items.append(Item(
            f"fig. 7, box {number}: the second driver anticipates the deceleration most", "second", earliest, "",
            earliest == second, f"distance before the line where {_DONE:.0%} of the slowing down for it is done: "
            + ", ".join(f"{n} {d:.0f} m" for n, d in ahead.items()),
        ))  # fmt: skip
    return tuple(items)


def _pedal_rate(estimate: Estimate) -> float:
    """Rms rate of the accelerator where the estimate is valid, over a tenth of a second, so that its steps count little; %/s."""
    pedal, span = estimate.grid.values["accelerator_pedal"], round(0.1 / estimate.grid.dt)
    rate = np.zeros(pedal.size)
    rate[span:] = (pedal[span:] - pedal[:-span]) / 0.1
    return 100 * rms(rate[estimate.valid & np.isfinite(rate)])


def _anticipation(driven: Driven, estimate: Estimate, line: float, before: float) -> float:
    """How far before a line (m) a share of the slowing down for it is done; looked at from `before` m ahead of it on."""
    part = window_in(estimate, driven.truth, line - before, line + 20.0)
    distance, speed = at(driven.truth, "distance", part(estimate.time)), part(estimate.columns["longitudinal_speed"])
    slowest = int(np.argmin(speed))
    level = speed[slowest] + (1 - _DONE) * (float(np.max(speed[: slowest + 1])) - speed[slowest])
    above = np.flatnonzero(speed[:slowest] > level)
    return float(line - distance[above[-1] if above.size else 0])


def _table(found: Mapping[str, _Along], estimates: Mapping[str, Estimate]) -> Table:
    rows: list[tuple[str | float, ...]] = []
    for number, (name, estimate) in enumerate(estimates.items(), 1):
        jerk = estimate.columns["intentional_jerk"][estimate.valid]
        a_i = estimate.columns["intentional_acceleration"][estimate.valid]
        rows.append((
            f"{number} {name}", rms(jerk), *(float(q) for q in np.percentile(jerk, (1, 99))), rms(a_i),
            _pedal_rate(estimate), float(estimate.time[-1]) / 60,
        ))  # fmt: skip
    return Table(
        ("driver", "jerk, rms m/s³", "1 %", "99 %", "acceleration, rms m/s²", "pedal rate, rms %/s", "drive, min"), tuple(rows),
        "Over the whole drive.",
    )  # fmt: skip
