"""The motorcycle's Takagi-Sugeno observer as one step: roll angle, lateral velocity, tyre forces and the rider's torque.

    x^' = A(v) x^ + L(v) (y - C x^) = M(v) x^ + L(v) y,   M = A - L C                                  (23)

Over a tick the speed stays, and the measurements run straight: y = y_0 + s t. Then all derivatives of x^ at the tick's start are
known, and the state a tick later is their Taylor series, which is exact to the last bits after enough terms:

    x' = M x + L y_0,   x'' = M x' + L s,   x^(k+1) = M x^(k),        x(h) = sum_k x^(k) h^k / k!

A tick is cut into equal parts, so that few terms are enough; how many of both is found from M at the design. M is linear in v and
is made anew each tick: any speed will do, none is tabled. The gains' v is clipped to the range of the design, A's is not.

Forward Euler, one term instead of these, is unstable at 100 Hz. State and series are in the design's units (`Scaling`), where their
sizes are alike.

`certified` is 1 where v is in the range that the certificate is of. Outside the estimate goes on, promised by nobody. `valid` is 1
where it is certified, all measurements are there, and as many seconds have passed since they were not as the slowest pole needs to
take an error to a twentieth.

Measurements are inputs, in the road's frame, so that a differentiator and `road_frame_observer` can be chained in front.
Damon, Ichalal, Arioui 2018, eq. (21)-(23), (35).
"""

from __future__ import annotations

import numpy as np

from codriver.errors import DesignError
from codriver.kernel import Scalar, both, minimum, select
from codriver.names import quantity
from codriver.observers.motorcycle_lmi import MotorcycleLMI
from codriver.observers.observer import Observer, Output, Scalars
from codriver.signals.signal import Array

EXACT = 1e-9  # of the transition, beside scipy's matrix exponential, at speeds to a quarter beyond the range
PARTS, TERMS = 32, 20  # at most
LARGEST = 1e6  # state, in the design's units: where nothing is certified it may grow, but not overflow
SETTLED = 20.0  # an error falls to this part before `valid`


def motorcycle_ts_observer(design: MotorcycleLMI) -> Observer:
    """The observer of a design.

    Args:
        design: by `design_motorcycle_lmi`.

    Raises:
        DesignError: the tick is too long for the design's poles, or the design schedules more than the speed itself.
    """
    if design.model.premises != (1,):
        raise DesignError(
            f"a model with the powers {design.model.premises} of speed", "the speed itself", "use the motorcycle"
        )
    model, dt, scale = design.model, design.dt, design.scaling
    low, high = design.polytope.range
    parts, terms = _series(design)
    h = dt / parts
    W = scale.errors
    # In scaled states: A0, A1, and L0 + v L1; measurements stay in their units.
    A0, A1 = (model.powers[k] * W / W[:, None] for k in (0, 1))
    L1 = (design.L[1] - design.L[0]) / (high - low) / W[:, None]
    L0 = design.L[0] / W[:, None] - low * L1
    C = model.C * W
    names, measured, speed = model.states, model.outputs, model.scheduling
    n, p = len(names), len(measured)
    settle = float(np.log(SETTLED) / design.certificate.decay_rate)
    keys = [f"x_{k}" for k in range(n)]
    before = [f"y_{k}" for k in range(p)]

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        there: Scalar = ok[speed]
        for c in measured:
            there = both(there, ok[c])
        v = select(ok[speed], rho[speed], carry["speed"])
        held = select(v < low, low, select(v > high, high, v))
        begun = carry["begun"] > 0.5
        last = [carry[key] for key in before]
        now = [select(ok[c], u[c], last[k]) for k, c in enumerate(measured)]
        first = [select(begun, a, b) for a, b in zip(last, now, strict=True)]
        L = [[_fma(L0[i, j], L1[i, j], held) for j in range(p)] for i in range(n)]
        LC = [[_dot([(float(C[r, j]), L[i][r]) for r in range(p)]) for j in range(n)] for i in range(n)]
        M = [[_fma(A0[i, j], A1[i, j], v) - LC[i][j] for j in range(n)] for i in range(n)]
        slope = [(b - a) * (1.0 / dt) for a, b in zip(first, now, strict=True)]
        x: list[Scalar] = [carry[key] for key in keys]
        rising = [_sum(L[i][j] * slope[j] for j in range(p)) for i in range(n)]
        driven = [_sum(L[i][j] * first[j] for j in range(p)) for i in range(n)]
        for part in range(parts):
            force = driven if part == 0 else [d + r * (part * h) for d, r in zip(driven, rising, strict=True)]
            # Each term with its own step, so that high powers of M do not overflow in single precision.
            term = [(a + b) * h for a, b in zip(_times(M, x), force, strict=True)]
            total = [a + t for a, t in zip(x, term, strict=True)]
            for k in range(2, terms + 1):
                term = [a * (h / k) for a in _times(M, term)]
                if k == 2:
                    term = [a + b * (h * h / 2) for a, b in zip(term, rising, strict=True)]
                total = [a + t for a, t in zip(total, term, strict=True)]
            x = total
        inside = both(ok[speed], both(v >= low, v <= high))
        x = [select(value > LARGEST, LARGEST, select(value < -LARGEST, -LARGEST, value)) for value in x]
        x = [select(begun, value, 0.0) for value in x]
        good = both(there, inside)
        since = select(good, minimum(carry["since"] + dt, 2 * settle), 0.0)
        started = select(both(there, 1.0 - 1.0 * begun), 1.0, carry["begun"])
        new = dict(zip(keys, x, strict=True)) | dict(zip(before, now, strict=True))
        out = {name: x[k] * float(W[k]) for k, name in enumerate(names)}
        flags = {"certified": 1.0 * inside, "measured": 1.0 * there, "valid": both(good, since > settle)}
        return {**new, "speed": v, "begun": started, "since": since}, {**out, **flags}

    outputs = (
        *(Output(name, quantity(name).unit, "estimate", quantity(name).meaning) for name in names),
        Output("certified", "1", "flag", f"1 where the speed is between {low:.4g} and {high:.4g} m/s"),
        Output("measured", "1", "flag", "1 where all measurements are there"),
        Output("valid", "1", "flag", "1 where certified, measured, and settled"),
    )
    carry = {**dict.fromkeys(keys, 0.0), **dict.fromkeys(before, 0.0), "speed": low, "begun": 0.0, "since": 0.0}
    gains = {f"L_{k + 1}": gain for k, gain in enumerate(design.L)} | {"X": design.X}
    return Observer(
        "motorcycle-ts", dt, measured, (), carry, outputs, step, scheduling=(speed,), gains=gains,
        settings={"low": low, "high": high, "gamma": design.gamma, "parts": parts, "terms": terms, "settling": settle},
        certificate=design.certificate,
    )  # fmt: skip


def _series(design: MotorcycleLMI) -> tuple[int, int]:
    """The cheapest parts and terms whose transition is exact at speeds to a quarter beyond the range.

    Raises:
        DesignError: none is.
    """
    from scipy.linalg import expm

    low, high = design.polytope.range
    W = design.scaling.errors
    closed = [design.error_matrix(v) * W / W[:, None] * design.dt for v in (0.75 * low, low, high, 1.25 * high)]
    exact = [expm(M) for M in closed]
    sizes = sorted((parts * terms, parts, terms) for parts in range(1, PARTS + 1) for terms in range(3, TERMS + 1))
    for _, parts, terms in sizes:
        with np.errstate(over="ignore", invalid="ignore"):
            errors = [
                np.abs(np.linalg.matrix_power(_taylor(M / parts, terms), parts) - F).max() / np.abs(F).max()
                for M, F in zip(closed, exact, strict=True)
            ]
        if np.max(errors) < EXACT:
            return parts, terms
    raise DesignError(
        f"a tick of {design.dt:g} s with poles up to {np.abs(design.certificate.eigenvalues).max():.3g} rad/s",
        f"a transition exact to {EXACT:g} within {PARTS} parts of {TERMS} terms", "a shorter tick, or a smaller `fastest`",
    )  # fmt: skip


def _taylor(M: Array, terms: int) -> Array:
    """The series of exp(M) to so many terms."""
    total, term = np.eye(M.shape[0]), np.eye(M.shape[0])
    for k in range(1, terms + 1):
        term = term @ M / k
        total = total + term
    return total


def _fma(constant: float, slope: float, v: Scalar) -> Scalar:
    """constant + slope v, the slope left out where it is 0."""
    return float(constant) + float(slope) * v if slope else float(constant)


def _sum(terms: object) -> Scalar:
    """A sum from the left."""
    total: Scalar = None
    for term in terms:  # type: ignore[attr-defined]
        total = term if total is None else total + term
    return total


def _dot(pairs: list[tuple[float, Scalar]]) -> Scalar:
    """sum of number times value, where the number is not 0."""
    kept = [number * value for number, value in pairs if number]
    return _sum(kept) if kept else 0.0


def _times(M: list[list[Scalar]], x: list[Scalar]) -> list[Scalar]:
    """M x, structural zeros left out."""
    return [
        _sum(m * value for m, value in zip(row, x, strict=True) if not (isinstance(m, float) and m == 0)) for row in M
    ]
