"""2018 section IV.A, reference [30]: the steering rate from the encoder, by windows and by counts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

import codriver.program as programs
from codriver.observers.differentiator import algebraic_differentiator
from codriver.observers.motorcycle_ts import motorcycle_ts_observer
from codriver.papers.item import Item
from codriver.papers.motorcycle2018.methods import behind, compiled, lmi
from codriver.papers.motorcycle2018.rides import DT, NOISE, SETTLE, WORDS, Scene, errors
from codriver.papers.reproduction import Chapter
from codriver.program import Program
from codriver.report.document import Table

WINDOWS = (0.005, 0.02, 0.04, 0.08, 0.12)  # s
COUNTS = (0, 16384, 4096, 1024)
LABELS = {0: "ideal"}


def steering_chapter(rides: Sequence[Scene]) -> Chapter:
    """What the window and the encoder do to the rate, and to torque and roll behind it.

    Args:
        rides: the last is the lane change.
    """
    ride = rides[-1]
    rate: dict[tuple[float, int], float] = {}
    behind_it: dict[tuple[float, int], float] = {}
    for w in WINDOWS:
        alone = programs.compile(algebraic_differentiator(DT, w))
        whole = compiled(behind(motorcycle_ts_observer(lmi()), window=w))
        for c in COUNTS:
            rate[w, c] = _rate(alone, ride, c)
            behind_it[w, c] = errors(whole.run(ride.log(1, noise=NOISE, counts=c)), ride)["rider_torque"]
    late = ride.truth["steer_rate"].time >= SETTLE
    size = float(np.sqrt(np.mean(ride.truth["steer_rate"].values[late] ** 2)))
    least = {c: min(rate[w, c] for w in WINDOWS) / size for c in COUNTS}
    best = {c: min(WINDOWS, key=lambda w: behind_it[w, c]) for c in COUNTS}
    quick, calm = behind_it[WINDOWS[0], 1024], behind_it[best[1024], 1024]
    items = (
        Item("IV.A: the steering rate by numerical differentiation [30]", "efficient", f"{least[4096]:.0%} of its rms at best",
             "", least[4096] <= 0.2,
             f"RMSE of the algebraic differentiator, best of the windows, encoder of 4096 counts, {WORDS[ride.name]}; a fifth "
             f"counts. With an ideal encoder {least[0]:.0%}: here the fork moves by a few counts"),
        Item("a slope over one tick is too noisy", None, f"{quick:.1f} against {calm:.1f} N m", "", quick > 1.1 * calm,
             f"not in the paper; torque with an encoder of 1024 counts, window of 5 ms against {1e3 * best[1024]:.0f} ms; more "
             "than 10 % counts"),
    )  # fmt: skip
    return Chapter(
        "The steering rate from the encoder (IV.A)",
        (
            "The paper names neither window nor encoder. A short window hands the encoder's counts on, a long one is late by "
            "half of it.",
        ),
        (
            _table(rate, "Steering rate: RMSE, rad/s"),
            _table(behind_it, "Rider's torque behind it: RMSE, N m, LMI with a = v W, noisy sensors"),
        ),
        items,
    )  # fmt: skip


def _rate(alone: Program, ride: Scene, counts: int) -> float:
    """RMSE of the differentiator's rate, rad/s."""
    estimate = alone.run(ride.log(1, counts=counts))
    off = estimate.columns["steer_rate"] - ride.of("steer_rate", estimate.time)
    return float(np.sqrt(np.mean(off[estimate.time >= SETTLE] ** 2)))


def _table(found: dict[tuple[float, int], float], caption: str) -> Table:
    head = ("window", *(f"{LABELS.get(c, c)}" + (" counts" if c else " encoder") for c in COUNTS))
    return Table(head, tuple((f"{1e3 * w:.0f} ms", *(found[w, c] for c in COUNTS)) for w in WINDOWS), caption + ".")
