"""How drivers differ: the parameters of the simulated driver, and six people.

The six are made up, ordered as in figure 7 of the 2017 paper: the first (and partly the fourth) uses the pedals
aggressively, the second anticipates most, the fifth is smoothest, the third and sixth lie between.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Style:
    """One way of driving.

    Attributes:
        name: for people.
        speed: share of the signed speed that is driven.
        lateral: lateral acceleration accepted in bends, m/s^2.
        acceleration: planned when speeding up from standstill in an ordinary place, m/s^2.
        braking: the deceleration at which braking for something ahead begins, m/s^2.
        lift: the deceleration at which the accelerator is released for something ahead, m/s^2.
        jerk: peak of a large burst, m/s^3.
        reaction: between seeing and beginning a burst, s.
        patience: change of wanted acceleration that is worth a new burst, m/s^2.
        foot: bandwidth of the foot, rad/s.
        travel: time the foot takes from one pedal to the other, s.
        play: change of wanted pedal that the foot ignores while it holds, share of the pedal's range.
        tremor: standard deviation of the slow wander of the foot, share of the pedal's range.
        slope_share: share of the slope's force that is foreseen; the rest is corrected afterwards by feedback.
        scatter: standard deviation of a burst's size and duration, relative.
    """

    name: str
    speed: float = 1.0
    lateral: float = 2.6
    acceleration: float = 1.7
    braking: float = 1.6
    lift: float = 0.6
    jerk: float = 1.8
    reaction: float = 0.35
    patience: float = 0.3
    foot: float = 10.0
    travel: float = 0.25
    play: float = 0.012
    tremor: float = 0.004
    slope_share: float = 0.7
    scatter: float = 0.12


STYLES: dict[str, Style] = {
    style.name: style
    for style in (
        Style("aggressive", 1.08, 3.6, 2.4, 2.4, 1.3, 2.9, 0.25, 0.22, 14.0, 0.18, 0.006, 0.010, 0.6, 0.20),
        Style("anticipating", 0.97, 2.3, 1.5, 1.1, 0.35, 1.4, 0.30, 0.20, 9.0, 0.28, 0.012, 0.004, 0.9, 0.10),
        Style("ordinary"),
        Style("nervous", 1.02, 2.9, 1.9, 1.9, 0.9, 2.3, 0.30, 0.18, 13.0, 0.20, 0.005, 0.009, 0.6, 0.22),
        Style("smooth", 0.95, 2.0, 1.2, 1.1, 0.45, 0.9, 0.40, 0.40, 7.5, 0.32, 0.018, 0.002, 0.85, 0.06),
        Style("brisk", 1.02, 2.8, 1.8, 1.8, 0.75, 1.9, 0.30, 0.30, 11.0, 0.22, 0.010, 0.005, 0.7, 0.14),
    )
}
