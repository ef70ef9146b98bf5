"""What sections 5 and 6 of 2019 find, judged on what was measured here, under a protocol.

Words become bounds: "slightly smaller" .8 to 1; "one third" .25 to .45; "competitive", "comparable" at most 1.25 times;
"similar" .8 to 1.25; "a significant improvement" at most .8 times.
"""

from __future__ import annotations

from codriver.papers.drivers2019.judge import LEARNT, METHODS, Judged
from codriver.papers.item import Item

MOST_ALIKE = 1.25


def of_figure_12(f: Judged) -> tuple[Item, ...]:
    """Section 5.2: a driver who does not vary."""
    where = f"fig. 12, {f.protocol.name}: "
    slope, gp = f.ratio("pwl"), (f.ratio("gp"), f.ratio("gp", "pwl"))
    best = _order(f)
    gmr, hmm, ann = f.ratio("gmr-21", "gp"), f.ratio("hmm-21", "gmr-21"), f.ratio("ann", "hmm-21")
    wins = f.wins("hmm-21", "gmr-21")
    return (
        Item(f"{where}PWL slightly better than PWC", "slightly", slope, "1", 0.8 <= slope < 1.0,
             "RMSE of PWL over PWC; 0.8 to 1 counts"),
        Item(f"{where}GP about one third of PWC and PWL", "almost one third", f"{gp[0]:.2f} of PWC, {gp[1]:.2f} of PWL", "",
             all(0.25 <= r <= 0.45 for r in gp), "0.25 to 0.45 of both counts"),
        Item(f"{where}GMR is competitive with GP", "competitive", gmr, "1", gmr <= MOST_ALIKE,
             f"RMSE of GMR over GP; at most {MOST_ALIKE:g} counts" + ("; far better than that" if gmr < 1 / MOST_ALIKE else "")),
        _hmm_beats_gmr(where, f, hmm, wins),
        Item(f"{where}ANN is comparable with HMM-GMR", "comparable", ann, "1", 1 / MOST_ALIKE <= ann <= MOST_ALIKE,
             f"RMSE of ANN over HMM-GMR; within a factor {MOST_ALIKE:g} counts"),
        Item(f"{where}ANN and HMM-GMR least on synthetic data", "least", _listed(f, best), "", set(best[:2]) == {"ann", "hmm-21"},
             "the paper's learnt methods from the least error on, as fractions of PWC"),
    )  # fmt: skip


def of_figure_14(f: Judged) -> tuple[Item, ...]:
    """Section 5.3: a driver who varies."""
    where = f"fig. 14, {f.protocol.name}: "
    gp, gmr, best = f.ratio("gp"), (f.ratio("gmr-21"), f.ratio("gmr-21", "pwl")), _order(f)
    b = f.folds.index("B")
    in_b = float(f.rmse["hmm-21"][:, b].mean() / f.rmse["gmr-21"][:, b].mean())
    return (
        Item(f"{where}GP no better than PWC", "similar", gp, "1", gp >= 0.8, "RMSE of GP over PWC; 0.8 or more counts"),
        Item(f"{where}GMR is worse than PWC and PWL", "worse", f"{gmr[0]:.2f} of PWC, {gmr[1]:.2f} of PWL", "", min(gmr) > 1.0,
             "above 1 of both counts"),
        Item(f"{where}HMM-GMR errs more than GMR in B", "more", in_b, "1", in_b > 1.01,
             "RMSE of HMM-GMR over GMR in sub-data set B; above 1.01 counts"),
        Item(f"{where}ANN outperforms the others", "least", _listed(f, best), "", best[0] == "ann" and f.ratio("ann") < 1.0,
             "the paper's learnt methods from the least error on, as fractions of PWC"),
    )  # fmt: skip


def of_figure_16(still: Judged, varied: Judged) -> tuple[Item, ...]:
    """Section 5.3's end and section 6: the identified driver in place of the human."""
    where = f"fig. 16, {still.protocol.name}: "
    gain = {n: still.ratio(n) / varied.ratio(n) for n in ("gmr-21", "hmm-21")}
    over = {n: still.ratio(n, "ann") for n in ("gmr-21", "hmm-21")}
    worse = {n: varied.mean(n) / still.mean(n) for n in LEARNT}
    least = min(worse, key=lambda n: worse[n])
    listed = ", ".join(f"{METHODS[n].label} {r:.2f}" for n, r in sorted(worse.items(), key=lambda pair: pair[1]))
    hmm = still.ratio("hmm-21", "gmr-21")
    return (
        Item(f"{where}GMR and HMM-GMR much better than with the human", "significant",
             f"GMR {gain['gmr-21']:.2f}, HMM-GMR {gain['hmm-21']:.2f} times", "", max(gain.values()) <= 0.8,
             "each as a fraction of PWC, figure 16's over figure 14's; at most 0.8 counts"),
        Item(f"{where}both superior to ANN", "superior", f"GMR {over['gmr-21']:.2f}, HMM-GMR {over['hmm-21']:.2f} of ANN", "",
             max(over.values()) < 1.0, "below 1 counts"),
        _hmm_beats_gmr(where, still, hmm, still.wins("hmm-21", "gmr-21")),
        Item(f"section 6, {still.protocol.name}: ANN most robust to variability", "most robust", listed, "",
             least == "ann" and _order(varied)[0] == "ann",
             "RMSE with variation over that without; ANN must grow the least and be the best with variation"),
    )  # fmt: skip


def beside(f: Judged) -> tuple[Item, ...]:
    """Not in the paper: a linear regression in the table, and how much the network owes to its weight decay."""
    where = f"{f.protocol.name}, a driver who varies: "
    best = _order(f)[0]
    r = f.ratio("ridge", best)
    others = [n for n in LEARNT if n != "ann"]
    ranks = [1 + sum(f.mean(n) < f.mean(form) for n in others) for form in ("ann", "ann-decay")]
    return (
        Item(f"{where}ridge is as good as the paper's best", None, r, "1", r <= 1.02,
             f"not in the paper; RMSE of ridge over {METHODS[best].label}'s; at most 1.02 counts"),
        Item(f"{where}the ANN's rank does not hang on its weight decay", None,
             f"rank {ranks[0]} without, {ranks[1]} with", "", ranks[0] == ranks[1],
             f"not in the paper, which states none; among its learnt methods. {f.ratio('ann'):.4f} of PWC without, "
             f"{f.ratio('ann-decay'):.4f} with the library's 0.01"),
    )  # fmt: skip


def bounds(f: Judged) -> tuple[Item, ...]:
    """What holds of the models without the leaks: this project's own bounds.

    Args:
        f: a driver who varies, past only.
    """
    made = [
        Item(f"past only: {METHODS[name].label} at most {most:g} of PWC", None, f.ratio(name), "1", f.ratio(name) <= most,
             "not in the paper; RMSE as a fraction of PWC")
        for name, most in (("ridge", 0.80), ("ann", 0.82), ("ann-decay", 0.82), ("gmr-bic", 0.82), ("gp", 0.88))
    ]  # fmt: skip
    near, many = f.ratio("ann", "ridge"), f.ratio("gmr-21", "gmr-bic")
    return (
        *made,
        Item("past only: ANN within 10 % of ridge", None, near, "1", abs(near - 1) <= 0.1, "not in the paper; RMSE over ridge's"),
        Item("past only: GMR's 21 components are too many", None, many, "1", many >= 1.3,
             "not in the paper; RMSE of GMR (21), not regularised, over GMR by BIC; 1.3 or more counts"),
        _default(f),
    )  # fmt: skip


def _default(f: Judged) -> Item:
    r = f.ratio("guarded", "ridge") if "guarded" in f.rmse else float("nan")
    parts = f.wins("guarded", "pwc") if "guarded" in f.rmse else 0
    return Item(
        "past only: the default is as good as ridge", None, r, "1", None if r != r else r <= 1.05,
        f"not in the paper; at most 1.05 counts. It errs less than PWC in {parts} of {f.parts} parts",
    )  # fmt: skip


def _hmm_beats_gmr(where: str, f: Judged, ratio: float, wins: int) -> Item:
    return Item(
        f"{where}HMM-GMR beats GMR", "outperforms", ratio, "1", ratio < 0.99 and 2 * wins > f.parts,
        f"RMSE over GMR's; below 0.99 and in more than half of the parts counts. It errs less in {wins} of {f.parts}",
    )  # fmt: skip


def _order(f: Judged) -> list[str]:
    """The paper's learnt methods, the least error first."""
    return sorted(LEARNT, key=f.mean)


def _listed(f: Judged, names: list[str]) -> str:
    return ", ".join(f"{METHODS[n].label} {f.ratio(n):.3f}" for n in names)
