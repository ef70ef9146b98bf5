"""2018 section IV.B: the inequality (34), what gamma means, the poles, and whether the gain must go with the speed."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from codriver.errors import DesignError
from codriver.observers.motorcycle_lmi import MotorcycleLMI, design_motorcycle_lmi
from codriver.observers.motorcycle_ts import motorcycle_ts_observer
from codriver.papers.item import Item
from codriver.papers.motorcycle2018.compare import SENSORS
from codriver.papers.motorcycle2018.methods import RANGE, behind, compiled, lmi, model, program, shipped_lmi
from codriver.papers.motorcycle2018.rides import DT, RATE, WORDS, Errors, Scene, judged
from codriver.papers.reproduction import Chapter
from codriver.report.document import Chart, Curve, Findings, Mark, Plot, Table

PAPER_GAMMA = 0.0464
TICKS = (0.01, 0.005, 0.002, 0.001)
REGIONS = (None, 1000.0, 300.0, 200.0, 100.0)


@dataclass(frozen=True, eq=False)
class Tried:
    """A design and what it errs by.

    Attributes:
        label: for people.
        design: the gains; None where there are none.
        errors: on the first ride with noise; None where no tick can follow.
        said: why not.
    """

    label: str
    design: MotorcycleLMI | None
    errors: Errors | None
    said: str = ""


def design_chapter(rides: Sequence[Scene], quick: bool) -> Chapter:
    """Gamma, poles, certificate, Euler, and one gain.

    Args:
        rides: the first is judged on.
        quick: fewer designs.
    """
    ride = rides[0]
    tried = [
        _try(f"|s| < {f:g} rad/s" if f else "no bound on the poles", ride, f)
        for f in (REGIONS[::2] if quick else REGIONS)
    ]
    tried.append(_try("|s| < 300 rad/s, one gain", ride, 300.0, scheduled=False))
    shipped = shipped_lmi()
    tried.append(
        Tried("as motorcycle-ts has it: slower poles, a = v W told 0.7 m/s² off", shipped, _judged(shipped, ride))
    )
    main, constant = lmi(), lmi(scheduled=False)
    items = (_gamma(), _supremum(main), _region(tried), _goal(main, shipped, ride), _scheduling(main, constant, ride),
             _euler(main), _real_time(ride))  # fmt: skip
    words = (
        "gamma weighs errors of unlike units against noise and torque rate, and means nothing without them. Here an error of 1 "
        "deg of roll, 0.1 deg of steer, 0.05 m/s, 2 deg/s, 100 N, 5 N m each counts 1; the torque's rate is 80 N m/s, D the "
        "sensors' sd by the root of their rate. The certificate below is computed from gains and Lyapunov matrix by plain "
        "eigenvalues.",
    )
    claims = Findings(tuple(("ok", claim) for claim in main.certificate.claims))
    return Chapter(
        "The observer by linear matrix inequalities (IV.B)", words,
        (claims, _table(tried, ride), _poles(main), _euler_table(tried)), items,
    )  # fmt: skip


def _judged(design: MotorcycleLMI, ride: Scene) -> Errors:
    return judged(compiled(behind(motorcycle_ts_observer(design))), ride, 1, SENSORS["noise"])


def _try(label: str, ride: Scene, fastest: float | None, scheduled: bool = True) -> Tried:
    design = None
    try:
        design = lmi(fastest, scheduled)
        return Tried(label, design, _judged(design, ride))
    except DesignError as error:
        return Tried(label, design, None, error.found)


def _gamma() -> Item:
    """With D = 1 and everything in SI."""
    try:
        plain = design_motorcycle_lmi(
            model(), *RANGE, DT, fastest=None, slowest=0.0, errors=dict.fromkeys(model().states, 1.0),
            sensors=dict.fromkeys(model().outputs, 1.0), torque_rate=1.0, rate=1.0,
        ).gamma  # fmt: skip
        said = f"{plain:.3g}"
    except DesignError:
        said = "none that passes the certificate"
    return Item(
        "V: gamma = 0.0464",
        PAPER_GAMMA,
        f"{lmi().gamma:.4f} with our weights; in SI with D = 1: {said}",
        "",
        None,
        "the paper does not say what D and the units are; without them the number cannot be compared",
    )


def _supremum(design: MotorcycleLMI) -> Item:
    """(28) against the H-infinity norm, at speeds that are kept."""
    W, scale = design.scaling.errors, design.scaling
    norm = 0.0
    for v in np.linspace(*RANGE, 5):
        closed = design.error_matrix(float(v)) * W / W[:, None]
        driven = np.hstack([model().B * scale.driven / W[:, None], -design.gain(float(v)) * scale.noise / W[:, None]])
        for w in np.concatenate([[0.0], np.logspace(-2, 4, 400)]):
            norm = max(norm, float(np.linalg.norm(np.linalg.solve(1j * w * np.eye(9) - closed, driven), 2)))
    return Item(
        "(28): the gain is at most gamma²",
        "gamma²",
        f"norm {norm:.4f}, gamma {design.gamma:.4f}, gamma² {design.gamma**2:.4f}",
        "",
        norm <= design.gamma**2,
        "greatest norm at five speeds, by a grid of frequencies, in the weighted units. (30)-(34) prove gamma; gamma-bar is gamma²",
    )


def _region(tried: Sequence[Tried]) -> Item:
    free = tried[0]
    fast = float(np.abs(free.design.certificate.eigenvalues).max()) if free.design else float("nan")
    return Item(
        "the least gamma needs a region for its poles", None, f"poles up to {fast:.2g} rad/s", "", fast > 2 * np.pi * RATE,
        f"not in the paper, which makes gamma small and has no region for poles; above 2 pi times the sensors' {RATE} Hz counts",
    )  # fmt: skip


def _goal(main: MotorcycleLMI, shipped: MotorcycleLMI, ride: Scene) -> Item:
    a, b = (_judged(design, ride) for design in (main, shipped))
    return Item(
        "a smaller gamma is no better observer", None,
        f"gamma {main.gamma:.3f}: {a['roll_angle']:.2f} deg; {shipped.gamma:.3f}: {b['roll_angle']:.2f} deg", "",
        a["roll_angle"] > b["roll_angle"],
        "not in the paper, which makes gamma small; roll with noise. What errs here is no white noise: a = v W and the linear "
        "model err as slowly as the machine leans",
    )  # fmt: skip


def _scheduling(main: MotorcycleLMI, constant: MotorcycleLMI, ride: Scene) -> Item:
    ratio = (
        judged(program("constant"), ride, 1, SENSORS["noise"])["roll_angle"]
        / judged(program("ts"), ride, 1, SENSORS["noise"])["roll_angle"]
    )
    cost = constant.gamma / main.gamma - 1
    return Item(
        "(35): one gain at all speeds does as well", None, f"gamma {cost:+.2%}, roll {ratio - 1:+.0%}", "",
        cost < 0.05 and ratio < 1.05,
        f"not in the paper; one gain at all speeds against two, {WORDS[ride.name]} with noise; less than 5 % worse counts. The "
        "speed matters in A(v), which both have",
    )  # fmt: skip


def _euler(design: MotorcycleLMI) -> Item:
    worst = {dt: float(np.abs(1 + dt * design.certificate.eigenvalues).max()) for dt in TICKS}
    return Item(
        "forward Euler is unstable at 100 Hz", None, ", ".join(f"{1 / dt:.0f} Hz {x:.2f}" for dt, x in worst.items()), "",
        worst[0.01] > 1,
        "not in the paper; greatest |1 + dt s| of the observer's poles, below 1 is stable. The observer here sums the Taylor "
        "series of its own matrix instead",
    )  # fmt: skip


def _real_time(ride: Scene) -> Item:
    made, log = program("ts"), ride.log(1)
    made.run(log)
    begun = time.perf_counter()
    count = len(made.run(log).time)
    rate = count / (time.perf_counter() - begun)
    return Item(
        "V: able to run in real time", "largely", f"{rate:,.0f} ticks/s", "", rate > 10 * RATE,
        f"whole chain with differentiator, one thread, as measured while this page was made; 10 times {RATE} Hz counts",
    )  # fmt: skip


def _table(tried: Sequence[Tried], ride: Scene) -> Table:
    rows = []
    for t in tried:
        c = t.design.certificate if t.design else None
        errors = (
            (t.errors["roll_angle"], t.errors["rider_torque"], t.errors["front_lateral_force"])
            if t.errors
            else (None,) * 3
        )
        rows.append((
            t.label, t.design.gamma if t.design else None, float(np.abs(c.eigenvalues).max()) if c else None,
            c.decay_rate if c else None, *errors, t.said or "–",
        ))  # fmt: skip
    head = (
        "design",
        "gamma",
        "largest pole, rad/s",
        "slowest, 1/s",
        "roll, deg",
        "torque, N m",
        "front force, N",
        "refused",
    )
    return Table(
        head, tuple(rows), f"Designs, and their RMSE on the ride ({WORDS[ride.name]}) with noisy sensors, a = v W."
    )


def _euler_table(tried: Sequence[Tried]) -> Table:
    rows: list[tuple[str | float | Mark | None, ...]] = [
        (t.label, *(float(np.abs(1 + dt * t.design.certificate.eigenvalues).max()) for dt in TICKS))
        for t in tried
        if t.design
    ]
    return Table(
        ("design", *(f"{1 / dt:.0f} Hz" for dt in TICKS)),
        tuple(rows),
        "Greatest pole of a forward Euler step; above 1 it diverges.",
    )


def _poles(design: MotorcycleLMI) -> Chart:
    poles = design.certificate.eigenvalues
    return Chart(
        "Poles of the observer at 41 speeds",
        "real part (1/s)",
        (
            Plot(
                "imaginary part (rad/s)", (Curve("", poles.real, poles.imag, kind="points", width=4, faint=True),), 260
            ),
        ),
    )
