"""The methods of 2019 sections 2 and 5, and others beside them, judged by holding out quarters of each drive.

    RMSE of a method = sqrt(mean over drives and sub-data sets of RMSE^2)            ratio = RMSE / RMSE of "the torque stays"

Sub-data set A holds out the last quarter, D the first, as in section 5.2. The paper states no regularisation, so its GMR, HMM-GMR
and ANN get none, or next to none; beside them stand the library's own forms, which have some.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from codriver.drivers.learned import PROTOCOLS, Protocol, evaluate_table, features_of, folds_of
from codriver.drivers.learned.kinds import BASELINES
from codriver.finding import Finding
from codriver.signals import Log
from codriver.signals.signal import Array

PAPER = PROTOCOLS["paper2019"]
HONEST = Protocol("past only").with_features(dense=False, substeps=1, preview=0.0)
WITH_ROAD = Protocol("past and road ahead").with_features(dense=False, substeps=1)
N_G = 21


@dataclass(frozen=True)
class Method:
    """A model with its options.

    Attributes:
        label: for people.
        kind: of the library's models.
        options: of that model.
    """

    label: str
    kind: str
    options: Mapping[str, Any] = field(default_factory=dict)


METHODS: dict[str, Method] = {
    "pwc": Method("PWC", "pwc"),
    "pwl": Method("PWL", "pwl"),
    "gp": Method("GP", "gp", {"mean": "zero", "ard": False}),
    "gmr-21": Method("GMR (21)", "gmr", {"components": N_G, "shrinkage": 0.0}),
    "hmm-21": Method("HMM-GMR (21)", "hmm-gmr", {"components": N_G, "shrinkage": 0.0}),
    "ann": Method("ANN (2)", "ann", {"hidden": 2, "alpha": 1e-8}),
    "ridge": Method("ridge", "ridge"),
    "ann-decay": Method("ANN (2), weight decay", "ann", {"hidden": 2}),
    "gmr-bic": Method("GMR by BIC", "gmr"),
    "boosting": Method("boosted ridge", "boosting"),
    "guarded": Method("guarded (default)", "guarded"),
}
LEARNT = ("gp", "gmr-21", "hmm-21", "ann")  # the paper's, but for PWC and PWL
SPARSE = {"full_up_to": 100, "inducing": 200}  # of the Gaussian process, for a quick look


@dataclass(frozen=True, eq=False)
class Judged:
    """Methods on the drives of one driver under one protocol.

    Attributes:
        protocol: how.
        rmse: by method, N m, shape (drives, folds).
        folds: names of the sub-data sets.
        verdict: what the library says of the protocol and of the last method on the last drive.
    """

    protocol: Protocol
    rmse: Mapping[str, Array]
    folds: tuple[str, ...]
    verdict: tuple[Finding, ...]

    def mean(self, method: str) -> float:
        """RMSE over drives and folds, N m."""
        return float(np.sqrt(np.mean(self.rmse[method] ** 2)))

    def ratio(self, method: str, other: str = "pwc") -> float:
        """RMSE over that of another method."""
        return self.mean(method) / self.mean(other)

    def spread(self, method: str) -> float:
        """Standard deviation of the RMSE over drives and folds, N m."""
        return float(self.rmse[method].std(ddof=1))

    def wins(self, method: str, other: str) -> int:
        """In how many drives and folds a method errs less than another."""
        return int((self.rmse[method] < self.rmse[other]).sum())

    @property
    def parts(self) -> int:
        """Drives times folds."""
        return int(self.rmse["pwc"].size)

    @property
    def leaks(self) -> tuple[str, ...]:
        """What the library warns of."""
        return tuple(f.text for f in self.verdict if f.text.startswith("leak"))


def judge(
    logs: Sequence[Log], methods: Sequence[str], protocol: Protocol, *, sparse: bool = False,
    tell: Callable[[str], None] = lambda text: None,
) -> Judged:  # fmt: skip
    """Judge methods on each drive by itself.

    Args:
        logs: drives.
        methods: of METHODS, one at least that is no baseline; PWC, PWL and ridge are added.
        protocol: how.
        sparse: the Gaussian process on few points.
        tell: is told each method and drive as it begins.
    """
    asked = [name for name in METHODS if name in methods and name not in BASELINES]
    rmse: dict[str, list[list[float]]] = {}
    verdict: tuple[Finding, ...] = ()
    folds: tuple[str, ...] = ()
    for k, log in enumerate(logs, 1):
        table = features_of([log], protocol.features)
        split = folds_of(table, protocol, ("drive",))
        folds = tuple(f.name for f in split)
        # One at a time, since two methods may be of one kind; the baselines are quick.
        for name in asked:
            method = METHODS[name]
            options = {**method.options, **(SPARSE if sparse and method.kind == "gp" else {})}
            tell(f"{method.label}, drive {k} of {len(logs)}")
            found = evaluate_table(
                table, split, (method.kind,), protocol=protocol, options={method.kind: options}, calibrate=False
            )
            rmse.setdefault(name, []).append([s.rmse for s in found.scores[method.kind]])
            if name == asked[-1]:
                verdict = tuple(found.verdict(method.kind))
                for other in BASELINES:
                    rmse.setdefault(other, []).append([s.rmse for s in found.scores[other]])
    order = [name for name in METHODS if name in rmse]
    return Judged(protocol, {name: np.array(rmse[name]) for name in order}, folds, verdict)
