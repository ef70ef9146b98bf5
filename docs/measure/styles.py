"""The scale of driving styles, and how well it judges (docs/styles.md).

python docs/measure/styles.py scale [FILE]     make src/codriver/drivers/data/simulated.toml, or FILE, from roads 201 to 216
python docs/measure/styles.py judge            bursts on roads 221 to 223, classes on the road test of seeds 11 to 13
"""

# ruff: noqa: T201
from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from drives import table
from made_roads import made_road

import codriver as cd
from codriver.drivers import (
    compare_drivers,
    default_scale,
    describe_style,
    find_bursts,
    make_scale,
    rate_style,
    save_scale,
    slope_agreement,
)  # fmt: skip
from codriver.drivers.bursts import runs
from codriver.drivers.scale import CLASSES, FEATURES
from codriver.simulate import drive, measured_log, truth_log
from codriver.simulate.road_test import road_test
from codriver.simulate.styles import STYLES

# As the 2017 paper describes its drivers (section IV-D): the first and fourth aggressive, the fifth smooth and the second
# anticipating, the third and sixth between.
KIND = {
    "aggressive": "aggressive", "anticipating": "smooth", "ordinary": "intermediate",
    "nervous": "aggressive", "smooth": "smooth", "brisk": "intermediate",
}  # fmt: skip
CALIBRATION, BURST_ROADS, JUDGED = range(201, 217), range(221, 224), range(11, 14)
ESTIMATOR = "intent-pedals"
SCALE = Path(__file__).parents[2] / "src" / "codriver" / "drivers" / "data" / "simulated.toml"


def made_drive(style: str, seed: int) -> tuple[cd.Estimate, cd.Log]:
    """A drive on a made road: estimate and truth."""
    trace = drive(made_road(seed), 1800.0, style=STYLES[style], seed=seed, record_every=5)
    return cd.estimate_log(ESTIMATOR, measured_log(trace, seed=seed), cd.load_vehicle("bisoffi2017")), truth_log(trace)


def make(path: Path) -> None:
    """Make the scale."""
    styles, kinds = [], []
    for seed in CALIBRATION:
        for style, kind in KIND.items():
            styles.append(describe_style(made_drive(style, seed)[0], style))
            kinds.append(kind)
    source = (
        f"{len(styles)} simulated drives: six drivers on {len(CALIBRATION)} made roads (docs/measure/styles.py, seeds "
        f"{CALIBRATION[0]} to {CALIBRATION[-1]})"
    )
    scale = make_scale(styles, "simulated drivers", source, kinds=kinds)
    path.unlink(missing_ok=True)
    save_scale(scale, path)
    print(path.read_text(encoding="utf-8"))


def true_bursts(truth: cd.Log, least: float) -> list[tuple[float, float, int]]:
    """Start, stop and sign of the planned bursts that change the acceleration by `least`, m/s^2, at least."""
    jerk, time = truth["planned_jerk"].values, truth["planned_jerk"].time
    dt = float(time[1] - time[0])
    found = []
    for sign in (1, -1):
        for first, last in runs(sign * jerk > 0.02):
            if abs(float(jerk[first:last].sum())) * dt >= least:
                found.append((float(time[first]), float(time[last - 1]), sign))
    return sorted(found)


def matched(estimate: cd.Estimate, truth: cd.Log) -> np.ndarray:
    """Planned bursts of 0.3 m/s^2 found, and their number; bursts found that were planned, and their number; in shifts likewise.

    A burst found answers a planned one of its sign whose span, made longer by twice the delay, holds its peak. Each is used once.
    """
    found = find_bursts(estimate)
    late = 2.0 * (found.threshold.delay or 0.0)
    valid = {round(t, 2): ok for t, ok in zip(estimate.time, estimate.valid, strict=True)}
    counts = np.zeros(6)
    used: set[int] = set()
    big = set(true_bursts(truth, 0.3))
    for planned in true_bursts(truth, 0.05):
        start, stop, sign = planned
        if not valid.get(round(start, 2), False) or not valid.get(round(stop, 2), False):
            continue
        answers = [
            k for k, b in enumerate(found) if k not in used and b.sign == sign and start <= b.peak <= stop + late
        ]
        counts[1] += planned in big
        if answers:
            used.add(max(answers, key=lambda k: abs(found[k].change)))
            counts[0] += planned in big
    counts[2], counts[3] = len(used), len(found)
    counts[4] = sum(found[k].in_shift for k in used)
    counts[5] = sum(burst.in_shift for burst in found)
    return counts


def judge_bursts() -> None:
    """Recall and precision of bursts."""
    rows = []
    total = np.zeros(6)
    for style in STYLES:
        mine = sum(matched(*made_drive(style, seed)) for seed in BURST_ROADS)
        total += mine
        rows.append(burst_row(style, mine))
    rows.append(burst_row("all", total))
    print(table(["driver", "planned >= 0.3", "recall", "found", "precision", "outside shifts", "in shifts"], rows))


def burst_row(name: str, c: np.ndarray) -> list[str]:
    """One line of the table."""
    outside = (c[2] - c[4]) / (c[3] - c[5])
    return [
        name,
        f"{c[1]:.0f}",
        f"{c[0] / c[1]:.2f}",
        f"{c[3]:.0f}",
        f"{c[2] / c[3]:.2f}",
        f"{outside:.2f}",
        f"{c[4] / c[5]:.2f}",
    ]


def judge_classes() -> None:
    """Classes of the six drivers on the road test from 5, 15 and all minutes; agreement of slopes; ranks."""
    car, scale = cd.load_vehicle("bisoffi2017"), default_scale()
    estimates, truths = {}, {}
    for seed in JUDGED:
        for style in STYLES:
            test = road_test(style, seed)
            estimates[style, seed] = cd.estimate_log(ESTIMATOR, test.log, car)
            truths[style, seed] = test.truth
    said: list[tuple[float, bool]] = []
    for minutes in (5, 15, None):
        for pedal in (True, False):
            counts = {style: dict.fromkeys((*CLASSES, "cannot tell"), 0) for style in STYLES}
            likely_right = pieces = 0
            spread: dict[str, list[float]] = {style: [] for style in STYLES}
            for (style, _), estimate in estimates.items():
                for piece in cut(estimate, minutes):
                    described = describe_style(piece if pedal else unpedalled(piece), style)
                    rating = rate_style(described, scale)
                    counts[style][rating.kind] += 1
                    if rating.score is not None:
                        spread[style].append(rating.score)
                        likely = max(rating.probability, key=lambda k: rating.probability[k])
                        likely_right += likely == KIND[style]
                        if pedal:
                            said.append((rating.probability[likely], likely == KIND[style]))
                    pieces += 1
            named = sum(n for c in counts.values() for kind, n in c.items() if kind != "cannot tell")
            right = sum(counts[s][KIND[s]] for s in STYLES)
            rows = [
                [s, KIND[s], *(str(counts[s][k]) for k in (*CLASSES, "cannot tell")),
                 f"{np.mean(spread[s]):.2f}", f"{np.std(spread[s]):.2f}"]
                for s in STYLES
            ]  # fmt: skip
            print(f"\n{minutes or 'all'} minutes, {'with' if pedal else 'without'} pedal: {pieces} pieces, named {named}, "
                  f"right of the named {right / max(named, 1):.2f}, likeliest right {likely_right / pieces:.2f}")  # fmt: skip
            print(table(["driver", "the paper's", *CLASSES, "cannot tell", "mean score", "sd"], rows))
    print("\nprobability of the likeliest class, and how often it is right")
    for low, high in ((0.0, 0.6), (0.6, 0.8), (0.8, 0.95), (0.95, 1.01)):
        mine = [ok for p, ok in said if low <= p < high]
        print(f"{low:.2f} to {high:.2f}: {len(mine)} pieces, right {np.mean(mine) if mine else float('nan'):.2f}")
    for seed in JUDGED:
        comparison = compare_drivers({s: estimates[s, seed] for s in STYLES})
        print(f"\nseed {seed}:", [(r.name, r.rank, r.low, r.high) for r in comparison.ranking])
        road = truths["ordinary", seed]
        assert comparison.along is not None
        places = comparison.along.places
        true = 100 * np.tan(np.interp(places, road["distance"].values, road["road_slope"].values))
        agreement = slope_agreement(
            {n: x["slope"] for n, x in comparison.along.signals.items()}, comparison.along.step, true
        )
        for title, pairs in (("pairs", agreement.pairs), ("truth", agreement.against_truth)):
            numbers = np.array([[p.rms, p.rms_centred, p.correlation] for p in pairs], float)
            print(title, "rms, rms centred, correlation: mean", numbers.mean(axis=0).round(3), "worst",
                  numbers[:, 0].max().round(3), numbers[:, 1].max().round(3), numbers[:, 2].min().round(3))  # fmt: skip
        print("drift: speed's s over the true one at the end", [
            round(comparison.courses[s].length / float(truths[s, seed]["distance"].values[-1]) - 1, 5) for s in STYLES
        ], "drift bound, m", [round(comparison.courses[s].drift or 0) for s in STYLES])  # fmt: skip
        for style, s in zip(STYLES, comparison.styles, strict=True):
            print(style, f"jerk rms {s.jerk_rms.value:.3f} ({s.jerk_rms.low:.3f}-{s.jerk_rms.high:.3f})",
                  f"bursts/km {s.bursts.per_km:.2f} ({s.bursts.low:.2f}-{s.bursts.high:.2f}) phi {s.bursts.dispersion:.2f}",
                  f"reversals {s.reversals.value:.1f}", f"in shift {s.in_shift:.2f}")  # fmt: skip


def cut(estimate: cd.Estimate, minutes: int | None) -> list[cd.Estimate]:
    """Pieces of an estimate of so many minutes, the last one left out if shorter; the whole for None."""
    if minutes is None:
        return [estimate]
    ticks = round(60 * minutes / estimate.grid.dt)
    return [part(estimate, k, k + ticks) for k in range(0, len(estimate.grid) - ticks + 1, ticks)]


def part(e: cd.Estimate, first: int, last: int) -> cd.Estimate:
    """Ticks `first` to `last` of an estimate, as if the estimator had run before."""
    g, cut = e.grid, slice(first, last)
    grid = cd.Grid(
        g.time[cut], g.dt, *({k: v[cut] for k, v in columns.items()} for columns in (g.values, g.fresh, g.held))
    )
    columns = {k: v[cut] for k, v in e.columns.items()}
    return cd.Estimate(e.observer, grid, columns, e.outputs, e.measured, e.provenance, e.log)


def unpedalled(e: cd.Estimate) -> cd.Estimate:
    """The same estimate of a log that lacks the pedal."""
    grid = cd.Grid(
        e.grid.time, e.grid.dt,
        *({k: v for k, v in c.items() if k != "accelerator_pedal"} for c in (e.grid.values, e.grid.fresh, e.grid.held)),
    )  # fmt: skip
    return cd.Estimate(
        e.observer, grid, e.columns, e.outputs, e.measured, e.provenance, e.log.without("accelerator_pedal")
    )


def main() -> None:
    """Run what is asked for."""
    if sys.argv[1:2] == ["scale"]:
        make(Path(sys.argv[2]) if len(sys.argv) > 2 else SCALE)
    elif sys.argv[1:] == ["judge"]:
        print("weights:", FEATURES, (default_scale().step / default_scale().scatter).round(1).tolist())
        judge_bursts()
        judge_classes()
    else:
        print(__doc__)


if __name__ == "__main__":
    main()
