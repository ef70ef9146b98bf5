"""Gaussian processes of the torque, against closed forms, differences and scikit-learn."""

import numpy as np
import pytest
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

from codriver.drivers.learned.exponential_kernel import Sigmas
from codriver.drivers.learned.full_process import factor, log_likelihood
from codriver.drivers.learned.process import GaussianProcessTorque
from codriver.drivers.learned.sparse_process import bound, choose_points, condition
from learned_data import made


def kernel(sigmas, A, B):
    """By two loops."""
    return np.array([[sigmas.f**2 * np.exp(-np.sqrt(np.sum(((a - b) / sigmas.lengths) ** 2))) for b in B] for a in A])


@pytest.mark.parametrize("ard", [False, True])
def test_full_form_by_brute_force(ard):
    """2019 eq. (14), (15) and the noise."""
    X, y = made(50)
    model = GaussianProcessTorque(mean="zero", ard=ard).fit(X, y)
    s, Z = model.sigmas_, made(20, seed=1)[0]
    inverse = np.linalg.inv(kernel(s, X, X) + s.n**2 * np.eye(50))
    k = kernel(s, Z, X)
    mean, sd = model.predict(Z, return_std=True)
    np.testing.assert_allclose(mean, k @ inverse @ y, atol=1e-9)
    np.testing.assert_allclose(sd**2, s.f**2 + s.n**2 - np.einsum("ij,jk,ik->i", k, inverse, k), atol=1e-9)


@pytest.mark.filterwarnings("ignore:The optimal value found")  # no noise, to scikit-learn too
def test_marginal_likelihood_against_scikit_learn():
    X, y = made(80)
    ours = GaussianProcessTorque(mean="zero", ard=False).fit(X, y).sigmas_
    shape = ConstantKernel(1.0, (1e-6, 1e6)) * Matern(6.0, (1e-2, 1e5), nu=0.5) + WhiteKernel(0.09, (1e-8, 1e4))
    theirs = GaussianProcessRegressor(shape, alpha=0.0).fit(X, y / y.std())
    found, slope = log_likelihood(np.log([ours.f / y.std(), ours.n / y.std(), *ours.lengths]), X, y / y.std())
    assert found == pytest.approx(theirs.log_marginal_likelihood_value_, abs=1e-3)
    theta = np.log([ours.f**2 / y.var(), ours.lengths[0], ours.n**2 / y.var()])
    assert theirs.log_marginal_likelihood(theta) == pytest.approx(found, abs=1e-9)
    assert np.abs(slope).max() < 0.05


@pytest.mark.parametrize("count", [1, 3])
def test_derivatives_by_differences(count):
    X, y = made(60, 3)
    theta = np.log([0.8, 0.2, 1.3, 2.0, 4.0])[: 2 + count]
    points = X[::4]
    for value in (lambda at: log_likelihood(at, X, y), lambda at: bound(at, points, X, y)):
        slope = value(theta)[1]
        e = 1e-5 * np.eye(theta.size)
        wanted = [(value(theta + step)[0] - value(theta - step)[0]) / 2e-5 for step in e]
        np.testing.assert_allclose(slope, wanted, rtol=1e-6, atol=1e-6)


def test_bound_by_brute_force_and_below_the_likelihood():
    from scipy.stats import multivariate_normal

    X, y = made(60, 3)
    points, s = X[::3], Sigmas(0.8, 0.2, np.array([1.3, 2.0, 4.0]))
    K = kernel(s, X, X)
    Q = kernel(s, X, points) @ np.linalg.solve(kernel(s, points, points), kernel(s, points, X))
    wanted = multivariate_normal(np.zeros(60), Q + 0.04 * np.eye(60)).logpdf(y) - np.trace(K - Q) / 0.08
    theta = np.log([s.f, s.n, *s.lengths])
    found = bound(theta, points, X, y)[0]
    assert found == pytest.approx(wanted, abs=1e-3)  # the jitter
    assert found < log_likelihood(theta, X, y)[0]


@pytest.mark.parametrize("lengths", [[2.0], [2.0, 1.0, 5.0, 3.0]])
def test_sparse_with_all_points_is_full(lengths):
    X, y = made(70)
    s = Sigmas(1.2, 0.1, np.array(lengths))
    theta = np.log([s.f, s.n, *s.lengths])
    assert bound(theta, X, X, y)[0] == pytest.approx(log_likelihood(theta, X, y)[0], abs=1e-3)
    full, sparse = GaussianProcessTorque(mean="zero"), GaussianProcessTorque(mean="zero")
    L = factor(s, X)
    stored = {"points": X, "sigma_f": s.f, "sigma_n": s.n, "lengths": s.lengths, "ridge": None}
    full.restore({**stored, "weights": np.linalg.solve(L @ L.T, y), "inner": None})
    all_points = condition(s, X, X, y)
    sparse.restore({**stored, "weights": all_points.weights, "inner": all_points.inner})
    Z = made(20, seed=1)[0]
    for found, wanted in zip(sparse.predict(Z, return_std=True), full.predict(Z, return_std=True), strict=True):
        np.testing.assert_allclose(found, wanted, atol=1e-6)


@pytest.mark.slow
def test_few_points_are_enough_for_a_smooth_torque():
    """100 of 800 rows predict nearly as well as all."""
    X, y = made(800, 2)
    Z, wanted = made(1000, 2, seed=1)
    full, sparse = GaussianProcessTorque(full_up_to=800), GaussianProcessTorque(full_up_to=0, inducing=100)
    error = [np.sqrt(np.mean((wanted - model.fit(X, y).predict(Z)) ** 2)) for model in (full, sparse)]
    assert error[1] < 1.05 * error[0]
    assert len(sparse.points_) == 100


def test_points_are_different_rows():
    X = np.repeat(made(10)[0], 7, axis=0)
    points = choose_points(X, 50, np.random.RandomState(0))
    assert np.unique(points, axis=0).shape == points.shape == (10, 4)


def test_records_of_standstill():
    """Rows alike, and a torque that never moves: a finite answer."""
    X, y = np.repeat(made(20)[0], 10, axis=0), np.repeat(made(20)[1], 10)
    for torque in (y, np.full(200, 0.7)):
        for model in (GaussianProcessTorque(), GaussianProcessTorque(full_up_to=0, inducing=30)):
            mean, sd = model.fit(X, torque).predict(X, return_std=True)
            assert np.sqrt(np.mean((mean - torque) ** 2)) < 0.1
            assert np.all(np.isfinite(sd))


def test_settings_refused():
    with pytest.raises(ValueError, match="'linear' or 'zero'"):
        GaussianProcessTorque(mean="square").fit(*made(20))
