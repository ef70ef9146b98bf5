"""Gaussian mixture regression with the memory of a hidden Markov model.

    h_i(k) ~ (sum_j h_j(k-1) a_ji) N(z_k; mu_i^z, Sigma_i^zz)                2019 eq. (24)
    T(k) = sum_i h_i(k) m_i(z_k)                                             2019 eq. (25): `conditional`

and h_i(1) ~ pi_i N(z_1; ...) at the beginning of every stretch. a, pi and the Gaussians of (z, T) are learnt by Baum-Welch (`hmm`),
from a mixture on. The weights use z alone, as printed; where the torque's past is among the features, what was observed of the
torque is in them too, a row later.

What is carried from row to row is p_i = sum_j h_j a_ji, which starts from pi: so the first row needs no case of its own.

Section 2.5 there. S. Calinon, F. D'halluin, E. Sauser, D. Caldwell, A. Billard 2010, doi 10.1109/MRA.2010.936947.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Self

import numpy as np

from codriver.drivers.learned.component_search import candidate_numbers, least
from codriver.drivers.learned.conditional import Conditional
from codriver.drivers.learned.gmr import CANDIDATES
from codriver.drivers.learned.hmm import (
    HiddenMarkov,
    SideBySide,
    filtered,
    fit_hidden_markov,
    in_given_order,
    scaled_densities,
)
from codriver.drivers.learned.mixture import EmSettings, fit_mixture
from codriver.drivers.learned.regressor import State, TorqueRegressor, stretches
from codriver.drivers.learned.rows import array, rows, training_rows
from codriver.kernel import Scalar
from codriver.signals.signal import Array


class HiddenMarkovRegressor(TorqueRegressor):
    """HMM-GMR.

    Args:
        components: N_G, or "bic" or "aic": the number with the least criterion of the hidden Markov model.
        candidates: numbers tried for a criterion; the search stops when it has risen twice.
        shrinkage: rows' worth of the prior on each covariance.
        floor: of its eigenvalues, in variances of the data.
        starts: of the search for the mixture.
        most: steps at most, for the mixture and for Baum-Welch each.
        enough: stop when a step gains less than this in log-likelihood a row.
        random_state: of the starts.

    Attributes:
        n_components_: after dropping dead ones.
        criteria_: the criterion by number of components, as far as tried; empty in a restored model.
    """

    kind: ClassVar[str] = "hmm-gmr"
    has_memory: ClassVar[bool] = True

    def __init__(
        self, components: int | str = "bic", candidates: Sequence[int] = CANDIDATES, shrinkage: float = 1.0,
        floor: float = 1e-6, starts: int = 3, most: int = 200, enough: float = 1e-3, random_state: int | None = 0,
    ) -> None:  # fmt: skip
        self.components, self.candidates = components, candidates
        self.shrinkage, self.floor, self.starts, self.most = shrinkage, floor, starts, most
        self.enough, self.random_state = enough, random_state

    def fit(self, X: Array, y: Array, lengths: Sequence[int] | None = None) -> Self:
        """Learn.

        Args:
            X: features, shape (n, d).
            y: torque, shape (n,).
            lengths: of the stretches without holes, summing to n; None: one stretch.

        Raises:
            ValueError: a parameter is out of range, or the shapes are wrong.
        """
        settings = EmSettings(self.shrinkage, self.floor, self.starts, self.most, self.enough)
        X, y = training_rows(self, X, y, lengths)
        joint = np.column_stack([X, y])
        n, parts = y.size, _sizes(y.size, lengths)

        def fit(number: int) -> tuple[HiddenMarkov, float, int]:
            """A model with so many states."""
            mixture = fit_mixture(joint, number, settings, self.random_state)
            model = fit_hidden_markov(joint, parts, mixture, settings)
            return model, model.log_likelihood(joint, parts), model.parameters()

        model, criteria = least(*candidate_numbers(self.components, self.candidates, n), n, fit)
        self._take(model.initial, model.transition, Conditional.of(model.gaussians), criteria)
        return self

    def _take(self, start: Array, transition: Array, conditional: Conditional, criteria: dict[int, float]) -> None:
        """What predictions are made from."""
        self.start_, self.transition_, self.conditional_ = start, transition, conditional
        self.n_components_, self.n_features_in_ = start.size, conditional.features
        self.criteria_ = criteria

    def predict(self, X: Array, return_std: bool = False, lengths: Sequence[int] | None = None) -> Any:
        """Mean, shape (n,); with `return_std` also the standard deviation of a new observation, shape (n,).

        Args:
            X: features, shape (n, d), rows in the order of time.
            return_std: see above.
            lengths: of the stretches; memory starts anew in each. None: one stretch.
        """
        X = rows(self, X, lengths)
        order = SideBySide.of(_sizes(X.shape[0], lengths))
        logs, m = self.conditional_.evaluated(X)
        h = filtered(scaled_densities(logs[order.rows])[0], self.start_, self.transition_, order)[0]
        mean, sd = self.conditional_.torque(m, in_given_order(h, order))
        return (mean, sd) if return_std else mean

    def state(self) -> State:
        """pi, a, and the regression of every state."""
        return {"start": self.start_, "transition": self.transition_, **self.conditional_.state()}

    def restore(self, state: Mapping[str, Any]) -> Self:
        """Take over what `state` gave; arrays may come as lists."""
        self._take(array(state, "start"), array(state, "transition"), Conditional.restored(state), {})
        return self

    def initial(self) -> dict[str, float]:
        """The probabilities of the states before a row is seen."""
        return {f"state_{i}": float(p) for i, p in enumerate(self.start_)}

    def step(self, carry: Mapping[str, Scalar], z: Sequence[Scalar]) -> tuple[dict[str, Scalar], Scalar, Scalar]:
        """One prediction on scalars; carries what the states' probabilities will be before the next row."""
        h, mean, sd = self.conditional_.torque_step([carry[f"state_{i}"] for i in range(self.n_components_)], z)
        ahead = []
        for j in range(self.n_components_):
            total: Scalar = 0.0
            for h_i, a in zip(h, self.transition_[:, j].tolist(), strict=True):
                total = total + h_i * a
            ahead.append(total)
        return {f"state_{j}": p for j, p in enumerate(ahead)}, mean, sd


def _sizes(n: int, lengths: Sequence[int] | None) -> list[int]:
    """Lengths of the stretches that are not empty."""
    return [part.stop - part.start for part in stretches(n, lengths)]
