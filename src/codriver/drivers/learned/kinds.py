"""The kinds of learned drivers, by name.

guarded    the default: boosted ridge on the change, guarded    boosting   trees on what ridge leaves
ridge      linear in the features (ARX)                         ann        one hidden layer of tanh (26)
gp         Gaussian process (9)-(19), sparse on long drives     gmr        Gaussian mixture regression (20)-(23)
hmm-gmr    the same with memory (24)-(25)                       pwc, pwl   the torque stays; its slope stays (3)-(5)
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Any

from codriver.drivers.learned.feature_setting import FeatureSetting
from codriver.drivers.learned.features import FeatureTable
from codriver.drivers.learned.regressor import TorqueRegressor
from codriver.errors import UsageError

DEFAULT = "guarded"
BASELINES = ("pwc", "pwl", "ridge")  # in every table
_WHERE = {
    "pwc": ("naive", "PiecewiseConstant"), "pwl": ("naive", "PiecewiseLinear"), "ridge": ("ridge", "RidgeRegressor"),
    "ann": ("network", "NetworkRegressor"), "gp": ("process", "GaussianProcessTorque"),
    "gmr": ("gmr", "GaussianMixtureRegressor"), "hmm-gmr": ("hmm_gmr", "HiddenMarkovRegressor"),
    "boosting": ("boosting", "BoostedRidge"), "guarded": ("guarded", "GuardedRegressor"),
}  # fmt: skip
KINDS = tuple(_WHERE)


def class_of(kind: str) -> type[TorqueRegressor]:
    """The regressor of a kind.

    Raises:
        UsageError: there is no such kind.
    """
    if kind not in _WHERE:
        raise UsageError(f"a driver of kind '{kind}'", f"one of {', '.join(KINDS)}", "choose one")
    module, name = _WHERE[kind]
    found: type[TorqueRegressor] = getattr(import_module(f"codriver.drivers.learned.{module}"), name)
    return found


def regressor_of(
    kind: str, table: FeatureTable, setting: FeatureSetting, options: Mapping[str, Any] | None = None
) -> TorqueRegressor:
    """A regressor that has learnt nothing yet, told where in z the torque's past is and which rows are nearly copies.

    Args:
        kind: name.
        table: features it will be given.
        setting: of the features.
        options: its own parameters, such as components = 21.

    Raises:
        UsageError: there is no such kind, or it has no such parameter.
    """
    made = class_of(kind)()
    known = made.get_params(deep=False)
    columns = table.torque_columns
    told: dict[str, Any] = {
        "last": columns[0], "before": columns[1], "ahead": setting.horizon / setting.dt, "gap": gap_rows(setting),
        "newest": newest_columns(table),
    }  # fmt: skip
    unknown = sorted(set(options or {}) - set(known))
    if unknown:
        own = ", ".join(sorted(set(known) - set(told))) or "none"
        raise UsageError(f"{kind} has no parameter {', '.join(unknown)}", f"one of: {own}", "correct the name")
    made.set_params(**{k: v for k, v in told.items() if k in known}, **(options or {}))
    return made


def newest_columns(table: FeatureTable) -> list[int]:
    """For each column the column with the newest value of its signal: itself, for the newest and for what is not of the past."""
    now = {f.signal: k for k, f in enumerate(table.features) if f.kind == "past" and f.when == 0}
    return [now.get(f.signal, k) if f.kind in ("past", "preview") else k for k, f in enumerate(table.features)]


def gap_rows(setting: FeatureSetting) -> int:
    """How many rows share a moment with a given one, in the order of time."""
    reach = (setting.history - 1) * setting.dt + setting.horizon
    return round(reach / (setting.tick if setting.dense else setting.dt))
