"""Learned models of the torque: what holds for all of them, and each against another's word."""

import warnings

import numpy as np
import pytest
from sklearn.base import clone
from sklearn.ensemble import GradientBoostingRegressor
from sklearn.linear_model import Ridge, RidgeCV
from sklearn.model_selection import PredefinedSplit
from sklearn.neural_network import MLPRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.utils.estimator_checks import parametrize_with_checks

import codriver as cd
from codriver.drivers.learned.blocks import block_folds
from codriver.drivers.learned.boosting import BoostedRidge
from codriver.drivers.learned.guarded import GuardedRegressor
from codriver.drivers.learned.naive import PiecewiseConstant, PiecewiseLinear
from codriver.drivers.learned.network import NetworkRegressor, output, output_and_jacobian
from codriver.drivers.learned.process import GaussianProcessTorque
from codriver.drivers.learned.ridge import ALPHAS, RidgeRegressor
from codriver.drivers.learned.trees import Trees, greatest_double
from codriver.errors import DesignError
from learned_data import NOISE, as_grid, as_observer, made, through_json

MODELS = [
    PiecewiseConstant(), PiecewiseLinear(), RidgeRegressor(), NetworkRegressor(restarts=2), BoostedRidge(trees=30),
    GaussianProcessTorque(), GaussianProcessTorque(mean="zero", ard=False, full_up_to=0, inducing=40),
]  # fmt: skip
STEPPING = [model for model in MODELS if model.has_step]


def called(model):
    sparse = "-sparse" if getattr(model, "full_up_to", 1) == 0 else ""
    return model.kind + sparse


QUICK = ("pwc", "pwl", "ridge", "ann")


@parametrize_with_checks([model for model in MODELS if model.kind in QUICK])
def test_scikit_learn(estimator, check):
    check(estimator)


@pytest.mark.slow
@parametrize_with_checks([model for model in MODELS if model.kind not in QUICK])
def test_scikit_learn_slow(estimator, check):
    check(estimator)


@pytest.mark.parametrize("model", MODELS, ids=called)
class TestAll:
    def test_stored_and_restored_to_the_bit(self, model):
        X, y = made(200)
        fitted = clone(model).fit(X, y)
        again = clone(model).restore(through_json(fitted.state()))
        for mean, wanted in zip(again.predict(X, return_std=True), fitted.predict(X, return_std=True), strict=True):
            assert np.array_equal(mean, wanted)
        assert through_json(again.state()) == through_json(fitted.state())
        with pytest.raises(ValueError, match="features"):
            again.predict(X[:, :3])

    def test_lengths_that_do_not_sum(self, model):
        X, y = made(100)
        with pytest.raises(ValueError, match="lengths sum to 90"):
            clone(model).fit(X, y, lengths=[40, 50])
        fitted = clone(model).fit(X, y, lengths=[40, 60])
        with pytest.raises(ValueError, match="lengths sum to 90"):
            fitted.predict(X, lengths=[90])

    def test_mean_is_the_same_with_and_without_sd(self, model):
        X, y = made(150)
        fitted = clone(model).fit(X, y)
        mean, sd = fitted.predict(X, return_std=True)
        assert np.array_equal(fitted.predict(X), mean)
        assert sd.shape == mean.shape == (150,)
        assert np.all(sd > 0)

    def test_same_again(self, model):
        X, y = made(150)
        first, second = (clone(model).fit(X, y).predict(X) for _ in range(2))
        assert np.array_equal(first, second)


@pytest.mark.parametrize("model", STEPPING, ids=called)
def test_step_equals_predict(model):
    """On plain floats, and as machine code."""
    X, y = made(300)
    fitted = clone(model).fit(X, y)
    far = 3.0 * np.random.default_rng(1).standard_normal((60, X.shape[1]))
    mean, sd = fitted.predict(far, return_std=True)
    for k, z in enumerate(far.tolist()):
        carry, m, s = fitted.step(fitted.initial(), z)
        assert (carry, m, s) == ({}, pytest.approx(mean[k], abs=1e-9), pytest.approx(sd[k], abs=1e-9))
    run = cd.compile(as_observer(fitted, X.shape[1])).run_grid(as_grid(far))
    np.testing.assert_allclose(run["driver_torque"], mean, rtol=0, atol=1e-9)
    np.testing.assert_allclose(run["driver_torque_sd"], sd, rtol=0, atol=1e-9)


def test_no_step_of_a_process():
    X, y = made(40)
    with pytest.raises(DesignError, match="'gp' has no step"):
        GaussianProcessTorque().fit(X, y).step({}, X[0].tolist())


@pytest.mark.parametrize(
    ("model", "bend"),
    [
        (RidgeRegressor(), 0.0), (NetworkRegressor(), 1.0), (BoostedRidge(), 1.0),
        pytest.param(GaussianProcessTorque(full_up_to=600), 1.0, marks=pytest.mark.slow),
        (GaussianProcessTorque(full_up_to=0, inducing=100), 1.0),
    ],
    ids=["ridge", "ann", "boosting", "gp", "gp-sparse"],
)  # fmt: skip
def test_coverage_and_error_where_the_noise_is_known(model, bend):
    """95 % bands hold 95 %: fitted on 600 rows, judged on 4,000 others; the error is little more than the noise."""
    fitted = clone(model).fit(*made(600, bend=bend))
    X, y = made(4000, seed=1, bend=bend)
    mean, sd = fitted.predict(X, return_std=True)
    assert 0.93 < np.mean(np.abs(y - mean) < 1.96 * sd) < 0.97
    assert np.sqrt(np.mean((y - mean) ** 2)) < 1.2 * NOISE
    assert 0.9 * NOISE < sd.mean() < 1.25 * NOISE


@pytest.mark.parametrize("model", [NetworkRegressor(), GaussianProcessTorque(), RidgeRegressor()], ids=called)
def test_sd_grows_away_from_the_data(model):
    X, y = made(300)
    fitted = clone(model).fit(X, y)
    near, far = fitted.predict(np.vstack([X.mean(axis=0), np.full(X.shape[1], 30.0)]), return_std=True)[1]
    assert far > 1.2 * near


class TestNaive:
    X = np.array([[1.0, 3.0, 2.0], [4.0, 0.0, 1.0]])
    y = np.array([1.0, 4.0])

    def test_constant(self):
        model = PiecewiseConstant(last=2).fit(self.X, self.y)
        assert model.predict(self.X).tolist() == [2.0, 1.0]
        assert model.sd_ == pytest.approx(np.sqrt((1 + 9) / 2))

    @pytest.mark.parametrize(("ahead", "wanted"), [(1.0, [1.0, 2.0]), (5.0, [-3.0, 6.0])])
    def test_linear(self, ahead, wanted):
        model = PiecewiseLinear(last=2, before=1, ahead=ahead).fit(self.X, self.y)
        np.testing.assert_allclose(model.predict(self.X), wanted)

    @pytest.mark.parametrize("model", [PiecewiseConstant(last=3), PiecewiseLinear(last=0, before=5)])
    def test_no_such_column(self, model):
        with pytest.raises(ValueError, match=r"X has 3 feature\(s\), columns 0 to 2"):
            model.fit(self.X, self.y)

    def test_one_column_for_two(self):
        with pytest.raises(ValueError, match="both torques in column 0"):
            PiecewiseLinear(last=0, before=0).fit(self.X, self.y)


class TestRidge:
    @pytest.mark.parametrize(("n", "d"), [(200, 4), (6, 9)])
    @pytest.mark.parametrize("alpha", [1e-3, 10.0])
    def test_against_scikit_learn(self, n, d, alpha):
        X, y = made(n, d)
        ours, theirs = RidgeRegressor(alpha=alpha).fit(X, y), Ridge(alpha=alpha).fit(X, y)
        np.testing.assert_allclose(ours.coef_, theirs.coef_, atol=1e-9)
        np.testing.assert_allclose(ours.predict(X), theirs.predict(X), atol=1e-9)

    def test_alpha_against_a_search(self):
        """With noise enough that alpha matters; folds without a gap are scikit-learn's too."""
        X, y = made(120, 15)
        y = y + 3.0 * np.random.default_rng(2).standard_normal(y.size)
        ours = RidgeRegressor(gap=0).fit(X, y)
        fold = np.concatenate([np.full(test.size, k) for k, (_, test) in enumerate(block_folds(120, 5, 0))])
        theirs = RidgeCV(ALPHAS, scoring="neg_mean_squared_error", cv=PredefinedSplit(fold)).fit(X, y)
        assert ALPHAS[0] < ours.alpha_ < ALPHAS[-1]
        assert ours.alpha_ == pytest.approx(theirs.alpha_)

    def test_variance_by_brute_force(self):
        X, y = made(50)
        model = RidgeRegressor(alpha=2.0).fit(X, y)
        Z = X - X.mean(axis=0)
        inverse = np.linalg.inv(Z.T @ Z + 2.0 * np.eye(4))
        z = np.array([1.0, -2.0, 3.0, 0.5])
        wanted = 1 + 1 / 50 + (z - X.mean(axis=0)) @ inverse @ (z - X.mean(axis=0))
        assert model.predict(z[np.newaxis], return_std=True)[1][0] == pytest.approx(
            model.sd_ * np.sqrt(wanted), rel=1e-12
        )

    def test_wrong_alpha(self):
        with pytest.raises(ValueError, match="above 0"):
            RidgeRegressor(alpha=0.0).fit(*made(20))


class TestNetwork:
    @pytest.mark.parametrize("hidden", [1, 2, 7])
    def test_output_against_scikit_learn(self, hidden):
        X, y = made(50)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            theirs = MLPRegressor(hidden_layer_sizes=(hidden,), activation="tanh", max_iter=3, random_state=0).fit(X, y)
        w = np.concatenate(
            [theirs.coefs_[0].T.ravel(), theirs.intercepts_[0], theirs.coefs_[1][:, 0], theirs.intercepts_[1]]
        )
        np.testing.assert_allclose(output(w, X), theirs.predict(X), atol=1e-12)

    @pytest.mark.parametrize("hidden", [1, 3])
    def test_jacobian_by_differences(self, hidden):
        X = made(5)[0]
        w = np.random.default_rng(0).standard_normal(hidden * 6 + 1)
        f, J = output_and_jacobian(w, X)
        np.testing.assert_allclose(f, output(w, X), rtol=0, atol=1e-14)
        for k in range(w.size):
            e = 1e-6 * np.eye(w.size)[k]
            np.testing.assert_allclose(J[:, k], (output(w + e, X) - output(w - e, X)) / 2e-6, atol=1e-8)

    def test_laplace_by_brute_force(self):
        X, y = made(80)
        model = NetworkRegressor(alpha=0.5).fit(X, y)
        J = output_and_jacobian(model.weights_, X)[1]
        H = J.T @ J + np.diag([*[0.5] * (J.shape[1] - 1), 0.0])
        wanted = model.sd_ * np.sqrt(1 + np.einsum("ij,ij->i", J, np.linalg.solve(H, J.T).T))
        np.testing.assert_allclose(model.predict(X, return_std=True)[1], wanted, rtol=1e-9)

    def test_end_is_a_minimum(self):
        """Levenberg and Marquardt's end against another minimiser from there: nothing left to gain."""
        from scipy.optimize import minimize

        X, y = made(200)
        model = NetworkRegressor(alpha=0.1, patience=500, max_steps=500).fit(X, y)
        decay = np.array([*[0.1] * (model.weights_.size - 1), 0.0])

        def energy(w):
            return np.sum((y - output(w, X)) ** 2) + np.sum(decay * w**2)

        assert minimize(energy, model.weights_).fun > 0.995 * energy(model.weights_)

    def test_beats_the_line_where_it_bends(self):
        X, y = made(800, bend=2.0)
        X2, y2 = made(800, seed=1, bend=2.0)
        error = {
            m.kind: np.sqrt(np.mean((y2 - m.fit(X, y).predict(X2)) ** 2))
            for m in (NetworkRegressor(), RidgeRegressor())
        }
        assert error["ann"] < 0.7 * error["ridge"]


class TestBoosting:
    @pytest.mark.parametrize("depth", [1, 2, 4])
    def test_arrays_against_scikit_learn(self, depth):
        """To the last digit, on values at and next to thresholds too."""
        X, y = made(400)
        theirs = GradientBoostingRegressor(n_estimators=40, max_depth=depth, init="zero", random_state=0).fit(X, y)
        trees = Trees.of((tree.tree_ for tree in theirs.estimators_[:, 0]), theirs.learning_rate)
        inside = trees.left >= 0
        edges = np.array([(f, t) for f, t in zip(trees.feature[inside], trees.threshold[inside], strict=True)])
        hard = np.repeat(X[:1], 3 * len(edges), axis=0)
        for k, (feature, threshold) in enumerate(edges):
            near = [threshold, np.nextafter(threshold, np.inf), np.nextafter(threshold, -np.inf)]
            hard[3 * k : 3 * k + 3, int(feature)] = near
        for points in (X, hard):
            found = trees.total(np.zeros(len(points)), lambda feature, points=points: points[:, feature], np.where)
            np.testing.assert_allclose(found, theirs.predict(points), rtol=0, atol=1e-12)

    def test_thresholds_by_brute_force(self):
        t = np.concatenate([np.random.default_rng(0).standard_normal(200), [0.0, 1.0, np.float32(0.1), -2.5]])
        limit = greatest_double(t)
        assert np.all(limit.astype(np.float32) <= t)
        assert np.all(np.nextafter(limit, np.inf).astype(np.float32) > t)

    def test_no_trees_where_the_line_is_all(self):
        """And then it is the ridge regression."""
        X, y = made(500, bend=0.0)
        model = BoostedRidge().fit(X, y)
        plain = RidgeRegressor().fit(X, y)
        assert len(model.trees_) < 15
        assert np.sqrt(np.mean((model.predict(X) - plain.predict(X)) ** 2)) < 0.2 * NOISE

    def test_beats_the_line_where_it_bends(self):
        X2, y2 = made(800, seed=1, bend=2.0)
        error = [
            np.sqrt(np.mean((y2 - m.fit(*made(800, bend=2.0)).predict(X2)) ** 2))
            for m in (BoostedRidge(), RidgeRegressor())
        ]
        assert error[0] < 0.8 * error[1]


def test_pipeline_and_search():
    """scikit-learn's own tools: scaling in a pipeline, blocks as a cross-validation, a grid."""
    from sklearn.model_selection import GridSearchCV, cross_validate

    X, y = made(300)
    folds = block_folds(300, 3, 5)
    scores = cross_validate(make_pipeline(StandardScaler(), RidgeRegressor()), X, y, cv=folds)
    assert scores["test_score"].min() > 0.9
    search = GridSearchCV(NetworkRegressor(restarts=1), {"hidden": [1, 2]}, cv=folds).fit(X, y)
    assert search.best_score_ > 0.9


def test_features_that_do_not_vary_have_no_weight_and_no_weight_is_dust() -> None:
    rng = np.random.default_rng(4)
    X = rng.standard_normal((400, 6))
    X[:, 4] = 1e-13 * rng.standard_normal(400)
    X[:, 5] = 0.0
    y = X[:, 0] - 0.3 * X[:, 1] + 0.1 * rng.standard_normal(400)
    ridge = RidgeRegressor(gap=0).fit(X, y)
    assert ridge.coef_[4:].tolist() == [0.0, 0.0]
    assert (ridge.coef_[:2] != 0).all()
    fewer = RidgeRegressor(gap=0, alpha=ridge.alpha_).fit(X[:, :4], y)
    assert np.allclose(ridge.predict(X), fewer.predict(X[:, :4]), rtol=0, atol=1e-12)
    guarded = GuardedRegressor(trees=5, gap=0).fit(X, y)
    for weights in (ridge.spread_, guarded.root_):
        sizes = np.abs(weights[weights != 0])
        assert sizes.min() > 1e-16 * sizes.max()
