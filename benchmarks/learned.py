"""Learned models of a driver, against what a user would take: scikit-learn, hmmlearn, gmr; 15 minutes learnt, 1e5 predictions.

Both learn the same standardised rows of one drive of a simulated driver who varies, and are judged on another drive of his. Where
a model searches its number of components, the alternative searches the same numbers. Ours tells a standard deviation too, the
network and the trees of the alternatives do not. Times are processor time on one thread: learning takes so long that other
programs would count.
"""

from __future__ import annotations

import logging
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from measure import Row, compared, duration
from measure import measure as timed

from codriver.drivers.learned import Protocol, features_of
from codriver.drivers.learned.features import FeatureTable
from codriver.drivers.learned.kinds import regressor_of
from codriver.drivers.learned.regressor import TorqueRegressor
from codriver.drivers.learned.scaling import Scaling
from codriver.simulate.circuit import CircuitSetting, simulate_circuit
from codriver.simulate.variability import Variability

MOST_EXACT = 1000  # rows of the exact Gaussian process
TARGET_FIT, TARGET_PREDICTIONS = 60.0, 1.0  # s; the latter but for the Gaussian process
SEARCHED = (1e-4, 1e4, 17)  # penalties of the ridge


@dataclass(frozen=True)
class Other:
    """An alternative.

    Attributes:
        name: of what a user would take.
        fit: from rows, targets and our model (for its numbers of components) to a model.
        predict: the model's torques for rows; None if the library has none.
        rows: the most it is given to learn; its time is scaled by the power of the number of rows.
        power: of that scaling.
        few: rows of the predictions it is given; their time is scaled.
    """

    name: str
    fit: Callable[[np.ndarray, np.ndarray, Any], Any]
    predict: Callable[[Any, np.ndarray], np.ndarray] | None
    rows: int = 10**9
    power: float = 1.0
    few: int = 10**9


def run(quick: bool) -> Iterator[Row]:
    """The rows."""
    warnings.filterwarnings("ignore")  # of the alternatives that do not converge
    logging.getLogger("hmmlearn").setLevel(logging.ERROR)
    X, y, lengths, other_X, other_y, table = _drives(quick)
    asked = 2_000 if quick else 100_000
    many = np.tile(other_X, (asked // len(other_X) + 1, 1))[:asked]
    setting = Protocol().features
    minutes = y.size * (setting.tick if setting.dense else setting.dt) / 60
    for kind, other in _others().items():
        ours = regressor_of(kind, table, setting)
        learnt = measure(lambda ours=ours: ours.fit(X, y, lengths), 1)
        made = measure(lambda ours=ours: ours.predict(many), 1 if quick else 3)
        mine = _rmse(ours.predict(other_X), other_y)
        what = (f"learn {kind} from {minutes:.0f} min, {y.size} rows", f"{asked} predictions by {kind}")
        goals = (TARGET_FIT, None if kind == "gp" else TARGET_PREDICTIONS)
        if other is None:
            for name, time, goal in zip(what, (learnt.best, made.best), goals, strict=True):
                yield Row(name, duration(time), **_met(time, goal), note=f"error on another drive {mine:.3f} sd")
            continue
        part = slice(0, min(y.size, other.rows))
        found: list[Any] = []
        taken = measure(_learning(other, X[part], y[part], ours, found), 1)
        scaled = taken.best * (y.size / (part.stop - part.start)) ** other.power
        how = "" if part.stop == y.size else f"; it learnt {part.stop} rows, scaled by n^{other.power:g}"
        if other.predict is None:
            yield _row(
                what[0], learnt.best, other.name, scaled, goals[0], f"error on another drive {mine:.3f} sd{_size(ours)}"
            )
            yield Row(what[1], duration(made.best), **_met(made.best, goals[1]), note=f"{other.name} has no regression")
            continue
        its = _rmse(other.predict(found[0], other_X[: other.few]), other_y[: other.few])
        few = many[: other.few]
        answered = measure(lambda other=other, found=found, few=few: other.predict(found[0], few), 1)
        errors = f"error on another drive {mine:.3f} sd, its {its:.3f}{_size(ours)}"
        yield _row(what[0], learnt.best, other.name, scaled, goals[0], errors + how)
        note = "" if len(few) == asked else f"it made {len(few)}, scaled"
        yield _row(what[1], made.best, other.name, answered.best * asked / len(few), goals[1], note)


def measure(work: Callable[[], Any], times: int) -> Any:
    """Processor time."""
    return timed(work, times, time.process_time)


def _learning(other: Other, X: np.ndarray, y: np.ndarray, ours: Any, found: list[Any]) -> Callable[[], None]:
    """The alternative's fit, whose model goes into `found`."""
    return lambda: found.append(other.fit(X, y, ours))


def _row(what: str, ours: float, name: str, other: float, goal: float | None, note: str) -> Row:
    """A comparison with a goal for our time, not for the ratio."""
    row = compared(what, ours, name, other, note)
    return Row(row.what, row.ours, row.other, row.ratio, **_met(ours, goal), note=row.note)


def _met(time: float, goal: float | None) -> dict[str, Any]:
    return {} if goal is None else {"target": f"under {goal:g} s", "met": time < goal}


def _drives(quick: bool) -> tuple[np.ndarray, np.ndarray, list[int], np.ndarray, np.ndarray, FeatureTable]:
    """Standardised rows and targets to learn, their stretches, rows and targets to judge on, and the table."""
    setting = CircuitSetting(variability=Variability(), laps=1 if quick else 4, direction="left" if quick else "both")
    one, two = (features_of([simulate_circuit(setting, seed=seed).log()], Protocol().features) for seed in (1, 2))
    scaling = Scaling.of(one)
    (X, y), (other_X, other_y) = ((scaling.features(t.X), scaling.torque(t.y)) for t in (one, two))
    return X, y, list(one.lengths), other_X, other_y, one


def _rmse(said: np.ndarray, true: np.ndarray) -> float:
    return float(np.sqrt(np.mean((said - true) ** 2)))


def _size(model: TorqueRegressor) -> str:
    """How many components ours chose."""
    number = getattr(model, "n_components_", None)
    return "" if number is None else f"; {number} components of {', '.join(map(str, model.criteria_))} tried by both"


def _others() -> dict[str, Other | None]:
    """By our kind."""
    from sklearn.base import RegressorMixin

    def plain(name: str, make: Callable[[], RegressorMixin], **more: Any) -> Other:
        return Other(name, lambda X, y, ours: make().fit(X, y), lambda model, X: model.predict(X), **more)

    return {
        "pwc": None, "pwl": None,
        "ridge": plain("scikit-learn RidgeCV", _ridge),
        "ann": plain("scikit-learn MLPRegressor, 5 starts", Network),
        "gp": plain("scikit-learn GaussianProcessRegressor", _process, rows=MOST_EXACT, power=3.0, few=5_000),
        "gmr": Other("scikit-learn GaussianMixture + gmr", _mixture, _conditional, few=5_000),
        "hmm-gmr": Other("hmmlearn GaussianHMM", _chain, None),
        "boosting": plain("scikit-learn HistGradientBoostingRegressor", _trees),
        "guarded": plain("scikit-learn HistGradientBoostingRegressor", _trees),
    }  # fmt: skip


def _ridge() -> Any:
    from sklearn.linear_model import RidgeCV

    low, high, number = SEARCHED
    return RidgeCV(np.geomspace(low, high, number))


def _trees() -> Any:
    from sklearn.ensemble import HistGradientBoostingRegressor

    return HistGradientBoostingRegressor(max_iter=200, random_state=0)


def _process() -> Any:
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

    return GaussianProcessRegressor(ConstantKernel(1.0) * Matern(10.0, nu=0.5) + WhiteKernel(0.1), random_state=0)


class Network:
    """MLPRegressor from five starts, the best on a tenth left out, as ours."""

    def fit(self, X: np.ndarray, y: np.ndarray) -> Network:
        from sklearn.neural_network import MLPRegressor

        cut = y.size - y.size // 10
        made = [
            MLPRegressor(hidden_layer_sizes=(2,), activation="tanh", solver="lbfgs", max_iter=500, random_state=k).fit(
                X[:cut], y[:cut]
            )
            for k in range(5)
        ]
        self.best = min(made, key=lambda m: _rmse(m.predict(X[cut:]), y[cut:]))
        return self

    def predict(self, X: np.ndarray) -> np.ndarray:
        return np.asarray(self.best.predict(X))


def _mixture(X: np.ndarray, y: np.ndarray, ours: Any) -> Any:
    """The numbers of components that ours tried; the one with the least BIC."""
    from gmr import GMM
    from sklearn.mixture import GaussianMixture

    joint = np.column_stack([X, y])
    made = [GaussianMixture(n, n_init=3, max_iter=200, random_state=0).fit(joint) for n in ours.criteria_]
    best = min(made, key=lambda m: m.bic(joint))
    return GMM(best.n_components, best.weights_, best.means_, best.covariances_)


def _conditional(model: Any, X: np.ndarray) -> np.ndarray:
    return np.asarray(model.predict(np.arange(X.shape[1]), X)).ravel()


def _chain(X: np.ndarray, y: np.ndarray, ours: Any) -> Any:
    """The numbers of states that ours tried, one start each."""
    from hmmlearn.hmm import GaussianHMM

    joint = np.column_stack([X, y])
    return [GaussianHMM(n, "full", n_iter=200, random_state=0).fit(joint) for n in ours.criteria_]
