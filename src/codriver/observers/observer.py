"""An observer is a value with one step.

    step(carry, u, y, ok, rho) -> (carry, out)

on mappings of names to scalars. `u` are inputs held from the newest sample, `y` measurements that are used on the tick they
arrive, `rho` scheduling signals (held too), `ok[name]` is 1 where the input is held or the measurement is fresh, else 0.
For a signal in both roles `ok[name]` says fresh and `ok[name + "_held"]` says held.
The step never looks at a value whose ok is 0. Batch, live and exported C are loops around this one step.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from codriver.errors import DesignError
from codriver.kernel import Recorded, Scalar, record
from codriver.signals import Grid
from codriver.signals.grid import Flags
from codriver.signals.signal import Array

Scalars = dict[str, Scalar]
Step = Callable[[Scalars, Scalars, Scalars, Scalars, Scalars], tuple[Scalars, Scalars]]


@dataclass(frozen=True)
class Output:
    """One output of an observer.

    Attributes:
        name: standard name; "<name>_sd" for its standard deviation.
        unit: SI.
        role: "estimate", "sd", "innovation" (measured less predicted), "innovation_sd", "flag" (0 or 1) or "input"
            (something computed from the inputs alone).
        meaning: for people and file comments.
    """

    name: str
    unit: str
    role: str
    meaning: str = ""


class Flag(NamedTuple):
    """A recorded flag: its name, its channel, and whether it says "fresh" or "held"."""

    name: str
    channel: str
    kind: str


@dataclass(frozen=True, eq=False)
class Certificate:
    """What is proven of a design, recomputed from its gains.

    Attributes:
        holds: whether every claim holds.
        claims: sentences with numbers.
        eigenvalues: of the continuous error dynamics, 1/s.
        discrete_eigenvalues: of one step at dt.
        decay_rate: slowest decay, 1/s: the least of -Re(eigenvalue).
    """

    holds: bool
    claims: tuple[str, ...]
    eigenvalues: npt.NDArray[np.complex128]
    discrete_eigenvalues: npt.NDArray[np.complex128]
    decay_rate: float


@dataclass(frozen=True, eq=False)
class Observer:
    """A finished design.

    Attributes:
        name: as on the command line.
        dt: tick, s.
        inputs: standard names of u.
        measured: standard names of y.
        scheduling: standard names of rho.
        optional: those of the inputs and measurements it can do without.
        carry: the carried scalars and their initial values.
        outputs: in the step's order.
        step: see the module's docstring.
        settings: what it was designed with, for provenance.
        gains: matrices by the papers' letters.
        certificate: None for designs that have nothing to prove.
    """

    name: str
    dt: float
    inputs: tuple[str, ...]
    measured: tuple[str, ...]
    carry: Mapping[str, float]
    outputs: tuple[Output, ...]
    step: Step
    scheduling: tuple[str, ...] = ()
    optional: frozenset[str] = frozenset()
    settings: Mapping[str, str | float] = field(default_factory=dict)
    gains: Mapping[str, Array] = field(default_factory=dict)
    certificate: Certificate | None = None

    @property
    def channels(self) -> tuple[str, ...]:
        """All signals the step takes, in the order of the recorded inputs."""
        return tuple(dict.fromkeys((*self.inputs, *self.measured, *self.scheduling)))

    @property
    def flags(self) -> tuple[Flag, ...]:
        """The recorded flags, in order: "<channel>_ok", or "_fresh" and "_held" where a channel has both roles."""
        held = {*self.inputs, *self.scheduling}
        found = []
        for name in self.channels:
            if name in self.measured and name in held:
                found += [Flag(f"{name}_fresh", name, "fresh"), Flag(f"{name}_held", name, "held")]
            else:
                found.append(Flag(f"{name}_ok", name, "fresh" if name in self.measured else "held"))
        return tuple(found)

    def flag_columns(self, grid: Grid) -> list[Flags]:
        """The grid's flags in the order of `flags`."""
        return [(grid.fresh if flag.kind == "fresh" else grid.held)[flag.channel] for flag in self.flags]

    @property
    def required(self) -> tuple[str, ...]:
        """The signals it cannot do without."""
        return tuple(name for name in self.channels if name not in self.optional)

    def record(self, outputs: tuple[str, ...] | None = None) -> Recorded:
        """The step as straight-line code; inputs are the channels, then the flags.

        Args:
            outputs: names of the outputs wanted; None keeps all. What no wanted output or carry needs is not recorded.
        """

        def flat(carry: Scalars, given: Scalars) -> tuple[Scalars, Scalars]:
            """The step on one mapping of inputs, as the recorder wants it."""
            ok = {f.name if f.name.endswith("_held") else f.channel: given[f.name] for f in self.flags}
            new, out = self.step(
                carry,
                {name: given[name] for name in self.inputs},
                {name: given[name] for name in self.measured},
                ok,
                {name: given[name] for name in self.scheduling},
            )
            return new, {o.name: out[o.name] for o in self.outputs if outputs is None or o.name in outputs}

        flags = [flag.name for flag in self.flags]
        name = self.name.replace("-", "_")
        return record(name, flat, list(self.carry), [*self.channels, *flags], flags)


def chain(first: Observer, second: Observer, name: str | None = None) -> Observer:
    """Two observers as one: outputs of the first feed inputs (or scheduling) of the second that bear the same name.

    A wired input is always ok: whether the first could tell is one of its outputs, if the second cares.

    Raises:
        DesignError: their ticks differ, or both carry a scalar of one name.
    """
    if first.dt != second.dt:
        raise DesignError(f"ticks of {first.dt} s and {second.dt} s", "one tick", "design both for the same dt")
    clash = set(first.carry) & set(second.carry)
    if clash:
        raise DesignError(f"both carry {sorted(clash)}", "different names", "rename the scalars of one of them")
    made = {output.name for output in first.outputs}
    wired = [n for n in (*second.inputs, *second.scheduling) if n in made]
    inputs = (*first.inputs, *(n for n in second.inputs if n not in wired and n not in first.inputs))
    measured = (*first.measured, *(n for n in second.measured if n not in first.measured))
    scheduling = (*first.scheduling, *(n for n in second.scheduling if n not in wired and n not in first.scheduling))

    def step(carry: Scalars, u: Scalars, y: Scalars, ok: Scalars, rho: Scalars) -> tuple[Scalars, Scalars]:
        new1, out1 = first.step({key: carry[key] for key in first.carry}, u, y, _as_seen_by(first, ok), rho)
        known = {n: out1[n] for n in wired}
        fine = {**_as_seen_by(second, ok), **dict.fromkeys(wired, 1.0)}
        new2, out2 = second.step({key: carry[key] for key in second.carry}, {**u, **known}, y, fine, {**rho, **known})
        return {**new1, **new2}, {**out1, **out2}

    needed_by_second = set(second.required) - set(wired)
    optional = (set(first.optional) | set(second.optional)) - set(first.required) - needed_by_second
    replaced = {output.name for output in second.outputs}
    return Observer(
        name or second.name, first.dt, inputs, measured, {**first.carry, **second.carry},
        (*(o for o in first.outputs if o.name not in replaced), *second.outputs), step, scheduling, frozenset(optional),
        {**first.settings, **second.settings}, {**first.gains, **second.gains}, second.certificate or first.certificate,
    )  # fmt: skip


def _as_seen_by(part: Observer, ok: Scalars) -> Scalars:
    """The flags of a chain as one part expects them: a signal that it only holds, another may measure."""
    return {
        **ok,
        **{name: ok[f"{name}_held"] for name in part.channels if name not in part.measured and f"{name}_held" in ok},
    }


def stable(eigenvalues: npt.NDArray[np.complex128]) -> bool:
    """Whether all eigenvalues of a discrete step lie inside the unit circle."""
    return bool(np.all(np.abs(eigenvalues) < 1))
