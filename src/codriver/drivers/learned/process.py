"""A Gaussian process, the function drawn with the exponential kernel.

    k(z, z') = sigma_f^2 exp(-|z - z'| / sigma_l)                            2019 eq. (9)
    mean(z) = k(z, Z) (K + sigma_n^2 I)^-1 y                                 2019 eq. (14)
    sd(z)^2 = sigma_f^2 - k(z, Z) (K + sigma_n^2 I)^-1 k(Z, z) + sigma_n^2   2019 eq. (15), and the noise of an observation

sigma_f, sigma_n and the lengths have the greatest marginal likelihood (19), searched with its derivative.

Up to `full_up_to` rows this is the full form (`full_process`): n^3 operations and n^2 numbers for each step of the search; a
prediction takes n operations for the mean, n^2 for the standard deviation. Longer records take the sparse form (`sparse_process`)
with m points: n m^2 operations for each step of the search, m for a mean, m^2 for a standard deviation.

A torque some steps ahead has errors that resemble their neighbours', which this model of independent noise does not know. The full
form then takes them for signal: on 1000 rows of a simulated driver, 1 s ahead, sigma_n went to zero, the error was 1.16 of the
ridge regression's and 82 % were within the 95 % band; the sparse form of the same rows had 1.02 and 92 %. Where errors were
independent the full form won by 1.5 %. So only short records take it.

The paper's form is `mean="zero", ard=False`. In 29 features no two rows are near each other, and this form spends its one
length on being almost linear: it is worse than a ridge regression. With `ard` every feature has its own length; with
`mean="linear"` the process is drawn about a ridge regression and learns what that leaves (the uncertainty of the ridge
regression's weights is not in sd).

The predictions of a process need all its points: there is no step for the kernel.

Okamoto, Tsiotras 2019, section 2.3. C. E. Rasmussen, C. K. I. Williams 2006, Gaussian Processes for Machine Learning,
chapters 2 and 5.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Self

import numpy as np
from scipy.linalg import cho_solve, solve_triangular

from codriver.drivers.learned import full_process, sparse_process
from codriver.drivers.learned.exponential_kernel import Sigmas, greatest
from codriver.drivers.learned.regressor import State, TorqueRegressor
from codriver.drivers.learned.ridge import RidgeRegressor
from codriver.drivers.learned.rows import array, rows, training_rows
from codriver.signals.signal import Array

_CHUNK = 4096  # rows predicted at a time


class GaussianProcessTorque(TorqueRegressor):
    """A Gaussian process regression with the exponential kernel.

    Args:
        mean: "linear" (a ridge regression) or "zero" (the paper's).
        ard: a length for each feature; False: one for all (the paper's).
        full_up_to: rows up to which the full form is used.
        inducing: m, points of the sparse form.
        searched: rows, evenly spread, on which the sparse form searches its parameters; all rows then make the prediction.
        random_state: of the points' choice; a number gives the same ones every time.
    """

    kind: ClassVar[str] = "gp"
    has_step: ClassVar[bool] = False

    def __init__(
        self,
        mean: str = "linear",
        ard: bool = True,
        full_up_to: int = 500,
        inducing: int = 300,
        searched: int = 3000,
        random_state: Any = 0,
    ) -> None:
        self.mean, self.ard, self.full_up_to, self.inducing = mean, ard, full_up_to, inducing
        self.searched, self.random_state = searched, random_state

    def fit(self, X: Array, y: Array, lengths: Sequence[int] | None = None) -> Self:
        """Learn.

        Args:
            X: features, standardised, shape (n, d).
            y: torque, standardised, shape (n,).
            lengths: of the stretches, for the ridge regression's choice of alpha.

        Raises:
            ValueError: an unknown mean, no inducing point, or wrong shapes.
        """
        from sklearn.utils import check_random_state

        if self.mean not in ("linear", "zero") or self.inducing < 1 or self.searched < 1:
            raise ValueError(
                f"mean = {self.mean!r}, inducing = {self.inducing}, searched = {self.searched}; 'linear' or 'zero', 1 or more"
            )
        X, y = training_rows(self, X, y, lengths)
        self.ridge_ = RidgeRegressor().fit(X, y, lengths) if self.mean == "linear" else None
        if self.ridge_ is not None:
            y = y - self.ridge_.predict(X)
        scale = float(y.std()) or 1.0
        unit = y / scale
        if y.size <= self.full_up_to:
            best = greatest(lambda theta: full_process.log_likelihood(theta, X, unit), X.shape[1], self.ard)
            sigmas = best.times(scale)
            L = full_process.factor(sigmas, X)
            self._take(X, sigmas, np.asarray(cho_solve((L, True), y)), L, None)
        else:
            points = sparse_process.choose_points(X, self.inducing, check_random_state(self.random_state))
            every = -(-y.size // self.searched)
            some, known = X[::every], unit[::every]
            best = greatest(lambda theta: sparse_process.bound(theta, points, some, known), X.shape[1], self.ard)
            sigmas = best.times(scale)
            self._take(points, sigmas, *sparse_process.condition(sigmas, points, X, y))
        return self

    def _take(self, points: Array, sigmas: Sigmas, weights: Array, outer: Array, inner: Array | None) -> None:
        """What predictions are made from."""
        self.points_, self.sigmas_, self.weights_, self.outer_, self.inner_ = points, sigmas, weights, outer, inner
        self.n_features_in_ = points.shape[1]

    def predict(self, X: Array, return_std: bool = False, lengths: Sequence[int] | None = None) -> Any:
        """Mean, shape (n,); with `return_std` also the standard deviation of a new observation, shape (n,)."""
        X = rows(self, X, lengths)
        mean = np.zeros(X.shape[0]) if self.ridge_ is None else self.ridge_.predict(X)
        known = np.empty(mean.size)
        for first in range(0, mean.size, _CHUNK):
            part = slice(first, first + _CHUNK)
            k = self.sigmas_.kernel(self.sigmas_.distances(self.points_, X[part]))
            mean[part] += self.weights_ @ k
            if return_std:
                known[part] = self._known(k)
        if not return_std:
            return mean
        return mean, np.sqrt(np.maximum(self.sigmas_.f**2 - known, 0.0) + self.sigmas_.n**2)

    def _known(self, k: Array) -> Array:
        """By how much the points lower the variance, from the kernel between points and rows (m, n)."""
        V = solve_triangular(self.outer_, k, lower=True)
        known = np.einsum("ij,ij->j", V, V)
        if self.inner_ is not None:
            W = solve_triangular(self.inner_, V, lower=True)
            known -= np.einsum("ij,ij->j", W, W)
        return np.asarray(known)

    def state(self) -> State:
        """Points, weights, parameters, the inner factor of the sparse form, and the ridge regression's state."""
        return {
            "points": self.points_, "weights": self.weights_, "sigma_f": self.sigmas_.f, "sigma_n": self.sigmas_.n,
            "lengths": self.sigmas_.lengths, "inner": self.inner_,
            "ridge": None if self.ridge_ is None else self.ridge_.state(),
        }  # fmt: skip

    def restore(self, state: Mapping[str, Any]) -> Self:
        """Take over what `state` gave; the outer factor is made anew from the points."""
        points = array(state, "points")
        sigmas = Sigmas(float(state["sigma_f"]), float(state["sigma_n"]), array(state, "lengths"))
        self.ridge_ = None if state["ridge"] is None else RidgeRegressor().restore(state["ridge"])
        inner = None if state["inner"] is None else array(state, "inner")
        outer = full_process.factor(sigmas, points) if inner is None else sparse_process.outer_factor(sigmas, points)
        self._take(points, sigmas, array(state, "weights"), outer, inner)
        return self
