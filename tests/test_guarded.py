"""The default model: as good as ridge where it has learnt, and the torque as it was where it has not."""

from __future__ import annotations

import numpy as np
from sklearn.utils.estimator_checks import parametrize_with_checks

from codriver.drivers.learned.guarded import GuardedRegressor
from codriver.drivers.learned.ridge import RidgeRegressor


@parametrize_with_checks([GuardedRegressor(trees=20)])
def test_scikit_learn(estimator, check) -> None:
    check(estimator)


def rows(n: int, seed: int, spread: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """A torque (column 0) that follows an angle (1, and 2 a moment ago), with noise of 0.1."""
    rng = np.random.default_rng(seed)
    angle = spread * rng.standard_normal(n)
    before = angle - 0.3 * spread * rng.standard_normal(n)
    torque = 0.8 * angle + 0.2 * rng.standard_normal(n)
    y = 0.6 * torque + 0.5 * angle + 0.4 * (angle - before) + 0.1 * rng.standard_normal(n)
    return np.stack([torque, angle, before], axis=1), y


def rmse(error: np.ndarray) -> float:
    return float(np.sqrt(np.mean(error**2)))


def test_inside_what_was_learnt_it_is_as_good_as_ridge() -> None:
    X, y = rows(3000, 1)
    Z, w = rows(3000, 2)
    guarded = GuardedRegressor(newest=(0, 1, 1)).fit(X, y)
    ridge = RidgeRegressor().fit(X, y)
    assert rmse(w - guarded.predict(Z)) < 1.1 * rmse(w - ridge.predict(Z))
    mean, sd = guarded.predict(Z, return_std=True)
    assert 0.93 < np.mean(np.abs(w - mean) < 1.96 * sd) < 0.98


def test_far_from_it_the_torque_stays_as_it_was() -> None:
    X, y = rows(3000, 1)
    guarded = GuardedRegressor(newest=(0, 1, 1)).fit(X, y)
    for far in (10.0, 100.0, 1e6):
        z = np.array([[0.5, far, far]])
        mean, sd = guarded.predict(z, return_std=True)
        assert abs(mean[0] - 0.5) < 20 / far**2
        assert np.isclose(sd[0], guarded.change_sd_, rtol=0.2 * (10 / far) ** 2 + 1e-6)
    near = guarded.predict(np.array([[0.5, 0.6, 0.6]]))[0]
    assert abs(near - (0.6 * 0.5 + 0.5 * 0.6)) < 0.1


def test_it_does_not_follow_a_line_out_of_what_was_learnt_and_ridge_does() -> None:
    X, y = rows(3000, 1)
    # On another drive the angle goes five times as far, and the torque does not follow it there.
    Z, _ = rows(3000, 3, 5.0)
    w = Z[:, 0] + 0.1 * np.random.default_rng(4).standard_normal(3000)
    guarded, ridge = GuardedRegressor(newest=(0, 1, 1)).fit(X, y), RidgeRegressor().fit(X, y)
    assert rmse(w - guarded.predict(Z)) < 0.35 * rmse(w - ridge.predict(Z))


def test_the_same_seed_gives_the_same_model() -> None:
    X, y = rows(500, 1)
    first, second = (GuardedRegressor().fit(X, y).predict(X) for _ in range(2))
    assert np.array_equal(first, second)


def test_neighbours_in_time_may_go_beyond_what_was_learnt_together() -> None:
    """What counts is the difference of two features; both drift out of their ranges."""
    rng = np.random.default_rng(5)
    angle = np.cumsum(0.1 * rng.standard_normal(3000))
    X = np.stack([np.zeros(3000), angle, angle - 0.1 * rng.standard_normal(3000)], axis=1)
    y = 5 * (X[:, 1] - X[:, 2]) + 0.1 * rng.standard_normal(3000)
    model = GuardedRegressor(newest=(0, 1, 1)).fit(X, y)
    beyond = X + np.array([0.0, np.ptp(angle), np.ptp(angle)]) * 0.6
    assert rmse(y - model.predict(beyond)) < 0.5 * rmse(y)


def test_no_change_is_foretold_that_was_never_seen() -> None:
    """Features without noise leave directions that a line follows anywhere: here 1e6 times the training's."""
    rng = np.random.default_rng(6)
    angle = rng.standard_normal(2000)
    twin = angle + 1e-4 * rng.standard_normal(2000)
    X = np.stack([np.zeros(2000), angle, twin], axis=1)
    y = 1e4 * (angle - twin)
    model = GuardedRegressor(trees=5).fit(X, y)
    Z = np.stack([np.zeros(500), np.zeros(500), rng.standard_normal(500)], axis=1)
    assert np.abs(RidgeRegressor().fit(X, y).predict(Z)).max() > 100 * np.abs(y).max()
    assert np.abs(model.predict(Z)).max() <= np.abs(y).max()
