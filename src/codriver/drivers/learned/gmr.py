"""Gaussian mixture regression: a mixture of (z, T), and of it the mean of T given z.

    p(z, T) = sum_i pi_i N(z, T; mu_i, Sigma_i)                              2019 eq. (20), (21)
    h_i(z) = pi_i N(z; mu_i^z, Sigma_i^zz) / sum_j pi_j N(z; ...)
    T = sum_i h_i(z) m_i(z)                                                  2019 eq. (22), (23): `conditional`

The paper prints h_i without pi_i, which is the mean of another mixture than the one learnt, that with equal weights;
`paper_weights` does as printed. The paper takes 21 components; the number with the least BIC is the default. BIC judges how well
the features too are described, and counts rows as independent, which those of a drive are not: on long drives it takes more
components than foretell the torque best. A number of 1 to 3 may then be better.

Section 2.4 there. S. Calinon, F. Guenter, A. Billard 2007, doi 10.1109/TSMCB.2006.886952.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Self

import numpy as np

from codriver.drivers.learned.component_search import candidate_numbers, least
from codriver.drivers.learned.conditional import Conditional
from codriver.drivers.learned.mixture import EmSettings, Mixture, fit_mixture, log_sum
from codriver.drivers.learned.regressor import State, TorqueRegressor
from codriver.drivers.learned.rows import array, rows, training_rows
from codriver.kernel import Scalar
from codriver.signals.signal import Array

CANDIDATES = (1, 2, 3, 4, 5, 6, 7, 8)


class GaussianMixtureRegressor(TorqueRegressor):
    """Gaussian mixture regression.

    Args:
        components: N_G, or "bic" or "aic": the number with the least criterion.
        candidates: numbers tried for a criterion; the search stops when it has risen twice.
        paper_weights: h_i without pi_i, as printed.
        shrinkage: rows' worth of the prior on each covariance.
        floor: of its eigenvalues, in variances of the data.
        starts: of the search for a mixture.
        most: steps at most.
        enough: stop when a step gains less than this in log-likelihood a row.
        random_state: of the starts.

    Attributes:
        n_components_: after dropping dead ones.
        criteria_: the criterion by number of components, as far as tried; empty in a restored model.
    """

    kind: ClassVar[str] = "gmr"

    def __init__(
        self, components: int | str = "bic", candidates: Sequence[int] = CANDIDATES, paper_weights: bool = False,
        shrinkage: float = 1.0, floor: float = 1e-6, starts: int = 3, most: int = 200, enough: float = 1e-3,
        random_state: int | None = 0,
    ) -> None:  # fmt: skip
        self.components, self.candidates, self.paper_weights = components, candidates, paper_weights
        self.shrinkage, self.floor, self.starts, self.most = shrinkage, floor, starts, most
        self.enough, self.random_state = enough, random_state

    def fit(self, X: Array, y: Array, lengths: Sequence[int] | None = None) -> Self:
        """Learn.

        Args:
            X: features, shape (n, d).
            y: torque, shape (n,).
            lengths: as for every model; rows are independent to this one.

        Raises:
            ValueError: a parameter is out of range, or the shapes are wrong.
        """
        settings = EmSettings(self.shrinkage, self.floor, self.starts, self.most, self.enough)
        X, y = training_rows(self, X, y, lengths)
        joint = np.column_stack([X, y])
        n = y.size

        def fit(number: int) -> tuple[Mixture, float, int]:
            """A mixture with so many components."""
            mixture = fit_mixture(joint, number, settings, self.random_state)
            return mixture, mixture.log_likelihood(joint), mixture.parameters()

        mixture, criteria = least(*candidate_numbers(self.components, self.candidates, n), n, fit)
        self._take(mixture.weights, Conditional.of(mixture.gaussians), criteria)
        return self

    def _take(self, weights: Array, conditional: Conditional, criteria: dict[int, float]) -> None:
        """What predictions are made from."""
        self.weights_, self.conditional_ = weights, conditional
        self.n_components_, self.n_features_in_ = weights.size, conditional.features
        self.criteria_ = criteria

    def _priors(self) -> Array:
        """Of the components, shape (N,)."""
        return np.full(self.n_components_, 1.0 / self.n_components_) if self.paper_weights else self.weights_

    def predict(self, X: Array, return_std: bool = False, lengths: Sequence[int] | None = None) -> Any:
        """Mean, shape (n,); with `return_std` also the standard deviation of a new observation, shape (n,)."""
        X = rows(self, X, lengths)
        logs, m = self.conditional_.evaluated(X)
        mean, sd = self.conditional_.torque(m, log_sum(np.log(self._priors()) + logs)[1])
        return (mean, sd) if return_std else mean

    def state(self) -> State:
        """pi, and the regression of every component."""
        return {"weights": self.weights_, **self.conditional_.state()}

    def restore(self, state: Mapping[str, Any]) -> Self:
        """Take over what `state` gave; arrays may come as lists."""
        self._take(array(state, "weights"), Conditional.restored(state), {})
        return self

    def step(self, carry: Mapping[str, Scalar], z: Sequence[Scalar]) -> tuple[dict[str, Scalar], Scalar, Scalar]:
        """One prediction on scalars."""
        _, mean, sd = self.conditional_.torque_step(self._priors().tolist(), z)
        return {}, mean, sd
