"""2018 sections III and IV.A: Sharp's model, its polytope, what is left out of it, and observability."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from codriver.models.motorcycle import motorcycle_model
from codriver.models.motorcycle_lean import lean_functions
from codriver.observers.motorcycle_lmi import ERRORS, SENSORS
from codriver.papers.item import Item
from codriver.papers.motorcycle2018.methods import RANGE, lean_machine, machine, model
from codriver.papers.reproduction import Chapter
from codriver.report.document import Table
from codriver.signals.signal import Array

FOOT = 0.3048  # m
# Sharp 1971, tables 1 to 3, standard machine, model 1, by ft/s: capsize; weave; wobble, 1/s and rad/s.
PRINTED = {
    10: (-3.56, 2.01 + 1.63j, -5.20 + 55.7j), 20: (-2.83, -0.18 + 2.09j, -5.91 + 55.8j),
    30: (-0.13, -3.36 + 4.56j, -6.42 + 55.5j), 50: (0.08, -6.59 + 11.4j, -6.52 + 54.6j),
    70: (0.08, -3.97 + 16.8j, -5.70 + 54.0j), 100: (0.07, -1.82 + 19.2j, -3.94 + 54.3j),
    130: (0.05, -1.13 + 20.4j, -2.24 + 55.6j), 160: (0.04, -0.96 + 21.2j, -0.82 + 57.5j),
}  # fmt: skip
GYRO = ("yaw_rate", "roll_rate")
SPEEDS = 23
BRAKING = -5.0  # m/s^2


def model_chapter() -> Chapter:
    """The roots that Sharp prints, exactness, what dv/dt would add, and observability."""
    found = {speed: _near(speed * FOOT, wanted) for speed, wanted in PRINTED.items()}
    worst = max(
        abs(ours - wanted) for speed, row in PRINTED.items() for ours, wanted in zip(found[speed], row, strict=True)
    )
    wrong = motorcycle_model(replace(machine(), Cf1=-machine().Cf1, Cr1=-machine().Cr1))
    unstable = max(float(np.linalg.eigvals(wrong.A(v)).real.max()) for v in (10.0, 20.0, 30.0))
    items = (
        Item("(1)-(11): the coefficients are those of Sharp 1971", None, worst, "1/s", worst <= 0.06,
             "not in the paper, which refers to [28] and prints no parameters. Greatest distance from the roots that Sharp "
             "prints for his machine at 10 to 160 ft/s; his last digits are 0.01 and 0.1, and 0.06 counts"),
        Item("(2), (3): F = C_1 alpha + C_2 lambda", "as printed", f"C_1 must be negative, or a root is at {unstable:+.0f} 1/s", "",
             False, "with the slip angles of (3), whose sign is that of the motion, a positive stiffness pushes the wheel on. "
             "Greatest root at 10, 20, 30 m/s with the sign as printed"),
        Item("(8): m_66 times the steering rate", "m_66 δ'", "m_66 δ''", "", False,
             "m_66 is an inertia; (11) needs the acceleration. In (3) and (17)-(19) the psi of the state is its rate; r_86 of "
             "(10) is 0: the rear tyre does not see the steering rate"),
        _exact(), _braking(), *_observability(),
    )  # fmt: skip
    return Chapter(
        "The model, its polytope and observability (III, IV.A)",
        ("Sharp's motorcycle with his own parameters, since the paper prints none of its machine.",),
        (_roots(found),), items,
    )  # fmt: skip


def _near(speed: float, wanted: tuple[complex, ...]) -> tuple[complex, ...]:
    roots = np.linalg.eigvals(motorcycle_model(machine()).A(speed))
    return tuple(complex(roots[np.argmin(np.abs(roots - w))]) for w in wanted)


def _roots(found: dict[int, tuple[complex, ...]]) -> Table:
    def told(root: complex) -> str:
        return f"{root.real:.2f}" + (f" ± {abs(root.imag):.1f}i" if abs(root.imag) > 1e-6 else "")

    rows = tuple(
        (f"{speed} ft/s, {speed * FOOT:.1f} m/s", *(text for pair in zip(PRINTED[speed], found[speed], strict=True)
                                                  for text in map(told, pair)))
        for speed in PRINTED
    )  # fmt: skip
    head = ("speed", "capsize, Sharp", "ours", "weave, Sharp", "ours", "wobble, Sharp", "ours")
    return Table(head, rows, "Roots of (11), 1/s; Sharp's machine.")


def _exact() -> Item:
    polytope = model().polytope(*RANGE)
    off = max(
        float(np.abs(polytope.A(v) - model().A(v)).max() / np.abs(model().A(v)).max())
        for v in np.linspace(*RANGE, SPEEDS)
    )
    return Item(
        "(13)-(15): two sub-models are exact",
        "exact",
        f"{len(polytope.vertices)} vertices, to {off:.0e}",
        "",
        len(polytope.vertices) == 2 and off < 1e-12,
        f"greatest relative difference at {SPEEDS} speeds; with relaxation neither v² nor 1/v occurs",
    )


def _braking() -> Item:
    """What v' adds to the matrix, by the large-angle model upright, which has these terms."""
    linear = lean_functions(lean_machine())[1]

    def at(rate: float) -> Array:
        return np.array(linear(np.zeros(10), 20.0, rate, 0.0, 1.0)[1])[:8, :8]

    still, braked = (np.linalg.eigvals(at(rate)) for rate in (0.0, BRAKING))
    moved = float(braked.real.max() - still.real.max())
    share = float(np.abs(at(BRAKING)[5, 0] / at(0.0)[5, 0] - 1))
    return Item(
        "terms in dv/dt matter", None, f"at {BRAKING:g} m/s² roll accelerates the steer {share:+.0%} differently", "",
        share > 0.1,
        "not in the paper, which leaves them out. By the large-angle model, upright, at 20 m/s: load on the front wheel and "
        f"the braking force turn with it; the greatest root moves by {moved:+.2f} 1/s. Above 10 % counts",
    )  # fmt: skip


def _observability() -> tuple[Item, ...]:
    """Rank by Popov, Belevitch and Hautus, and the roll's variance by the Gramian of a second, scaled."""
    W = np.array([ERRORS[name] for name in model().states])
    rows = {name: model().C[k] * W / SENSORS[name] for k, name in enumerate(model().outputs)}
    sets = {"all": tuple(rows), "no a_y": tuple(name for name in rows if name != "lateral_acceleration"), "gyro": GYRO}
    ranks = dict.fromkeys(sets, 9)
    sd: dict[str, list[float]] = {name: [] for name in sets}
    for v in np.linspace(*RANGE, SPEEDS):
        A = model().A(v) * W / W[:, None]
        for name, chosen in sets.items():
            C = np.array([rows[c] for c in chosen])
            pencils = [np.vstack([s * np.eye(9) - A, C]) for s in np.linalg.eigvals(A)]
            ranks[name] = min(
                ranks[name], *(int(np.linalg.matrix_rank(p, tol=1e-8 * np.abs(p).max())) for p in pencils)
            )
            sd[name].append(float(np.sqrt(np.linalg.inv(_gramian(A, C))[0, 0])))
    worse = {name: float(np.max(np.array(sd[name]) / np.array(sd["all"]))) for name in sets}
    return (
        Item("V.A: the three sensors guarantee observability", "observable", f"rank {ranks['all']} of 9", "", ranks["all"] == 9,
             f"at {SPEEDS} speeds; the angles, rates and acceleration of (21)"),
        Item("a gyroscope alone is enough for observability", None,
             f"rank {ranks['gyro']} by gyroscope alone, {ranks['no a_y']} without acceleration", "", ranks["gyro"] == 9,
             "not in the paper. How well is another matter: from one second of noisy measurements and nothing else the roll's "
             f"standard deviation is up to {worse['gyro']:.2f} times as large, {worse['no a_y']:.2f} without the acceleration"),
    )  # fmt: skip


def _gramian(A: Array, C: Array, seconds: float = 1.0, steps: int = 200) -> Array:
    """The integral of exp(A't) C' C exp(At)."""
    from scipy.linalg import expm

    F, now, total = expm(A * seconds / steps), np.eye(len(A)), np.zeros(A.shape)
    for k in range(steps + 1):
        total += (0.5 if k in (0, steps) else 1.0) * (C @ now).T @ (C @ now) * seconds / steps
        now = F @ now
    return total
