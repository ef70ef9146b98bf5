"""Unknown inputs of any linear plant by a Kalman filter: the general form of `driver_torque`.

The filter of `disturbance_design`, a tick of which is in `augmented_kalman`. It starts from 0 with a wide covariance, so it needs
no first measurement. While a known input is missing, its last value stays, what is known of the unknown inputs is forgotten
and `valid` is 0. `valid` is 1 where every unknown input's variance is at most SETTLED times the stationary one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from codriver.errors import DesignError
from codriver.kernel import Scalar, both, negate, select, sqrt
from codriver.observers.augmented_kalman import Filter, Moments, carried, pack, predict, started, unpack, update
from codriver.observers.covariance import plain
from codriver.observers.disturbance_design import DisturbanceDesign
from codriver.observers.observer import Observer, Output, Scalars
from codriver.observers.pi import meaning_of, unit_of

SETTLED = 2.25


def disturbance_observer(
    design: DisturbanceDesign, start_sd: Sequence[float], *, name: str = "disturbance-observer",
    settings: Mapping[str, str | float] | None = None,
) -> Observer:  # fmt: skip
    """An observer that estimates the plant's states and its unknown inputs, with standard deviations.

    Args:
        design: by `design_disturbance_filter`.
        start_sd: standard deviation of each state of the augmented model at the start; wide, but of this world.
        name: of the observer.
        settings: for provenance.

    Raises:
        DesignError: as many standard deviations as states are wanted, all above 0.
    """
    model, n, dt = design.model, len(design.model.states), design.dt
    wide = [float(s) ** 2 for s in start_sd]
    if len(wide) != n or not min(wide, default=0) > 0:
        raise DesignError(f"{len(wide)} start deviations {list(start_sd)}", f"{n}, all above 0", "correct them")
    kalman = Filter(design.F, design.G_0, design.G_1, model.C, model.D, design.Q_d, [plain(r) for r in design.R], wide)
    hidden = range(design.plant_states, n)
    reported = [*range(design.plant_states + len(design.unknown))]
    limits = [SETTLED * float(design.P[i, i]) for i in hidden[: len(design.unknown)]]

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        before = [carry[f"u_{k}"] for k in range(len(model.inputs))]
        given = [select(ok[c], u[c], before[k]) for k, c in enumerate(model.inputs)]
        known: Scalar = 1.0
        for c in model.inputs:
            known = both(known, ok[c])
        now = predict(kalman, unpack(carry, n), before, given)
        now, rows = update(kalman, now, [y[c] for c in model.outputs], [ok[c] for c in model.outputs], given)
        now = forget(now, negate(known), wide, hidden)
        settled: Scalar = known
        for i, limit in zip(hidden, limits, strict=False):
            settled = both(settled, now.P[i][i] <= limit)
        out = {model.states[i]: now.x[i] for i in reported}
        out |= {f"{model.states[i]}_sd": sqrt(now.P[i][i]) for i in reported}
        for c, row in zip(model.outputs, rows, strict=True):
            out |= {f"{c}_innovation": row.e, f"{c}_innovation_sd": sqrt(row.s), f"{c}_used": ok[c]}
        new = {**pack(now), **{f"u_{k}": value for k, value in enumerate(given)}}
        return new, {**out, "inputs_known": known, "valid": settled}

    first = pack(started(kalman, [0.0] * n))
    carry = {**carried(n), **first, **{f"u_{k}": 0.0 for k in range(len(model.inputs))}}
    gains = {letter: getattr(design, letter) for letter in ("F", "G_0", "G_1", "K", "P", "Q", "Q_d")}
    return Observer(
        name, dt, model.inputs, model.outputs, carry, _outputs(design), step, settings={"dt": dt, **(settings or {})},
        gains={**gains, "R": np.diag(design.R)}, certificate=design.certificate,
    )  # fmt: skip


def forget(now: Moments, when: Scalar, wide: Sequence[Scalar], states: Sequence[int]) -> Moments:
    """What is known of some states is forgotten where the flag is 1: their variance is wide, and goes with nothing."""

    def entry(i: int, j: int) -> Scalar:
        if i not in states and j not in states:
            return now.P[i][j]
        return select(when, wide[i] if i == j else 0.0, now.P[i][j])

    n = len(now.x)
    return Moments(now.x, [[entry(i, j) for j in range(n)] for i in range(n)])


def _outputs(design: DisturbanceDesign) -> tuple[Output, ...]:
    """States and unknown inputs with their standard deviations, innovations, flags."""
    shown = design.model.states[: design.plant_states + len(design.unknown)]
    made = [Output(n, unit_of(n), "estimate", meaning_of(n)) for n in shown]
    made += [Output(f"{n}_sd", unit_of(n), "sd", f"standard deviation of {n}") for n in shown]
    for n in design.model.outputs:
        made += [
            Output(f"{n}_innovation", unit_of(n), "innovation", f"measured {n} less predicted; 0 where none arrived"),
            Output(f"{n}_innovation_sd", unit_of(n), "innovation_sd", f"standard deviation of {n}_innovation"),
            Output(f"{n}_used", "1", "flag", f"1 where a value of {n} was used"),
        ]
    return (
        *made,
        Output("inputs_known", "1", "flag", "1 where all known inputs are there"),
        Output("valid", "1", "flag", "1 where the known inputs are there and the estimate has settled"),
    )
