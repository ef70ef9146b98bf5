"""Contiguous blocks with a gap, by brute force."""

import numpy as np
import pytest

from codriver.drivers.learned.blocks import block_folds, gap_that_fits, held_out


@pytest.mark.parametrize("lengths", [None, [30, 1, 0, 26], [7] * 8 + [1]])
@pytest.mark.parametrize(("folds", "gap"), [(2, 0), (5, 3), (57, 1), (4, 40)])
def test_by_brute_force(folds, gap, lengths):
    n = 57
    stretch = np.zeros(n, dtype=int) if lengths is None else np.repeat(np.arange(len(lengths)), lengths)
    found = block_folds(n, folds, gap, lengths)
    assert np.array_equal(np.concatenate([test for _, test in found]), np.arange(n))
    assert {test.size for _, test in found} <= {n // folds, n // folds + 1}
    for train, test in found:
        wanted = [
            k for k in range(n)
            if k not in test and all(abs(k - t) > gap or stretch[k] != stretch[t] for t in test)
        ]  # fmt: skip
        assert train.tolist() == wanted


def test_a_share_is_spread():
    train, test = held_out(1000, 0.2, 10)
    assert test.size == 200
    edges = np.flatnonzero(np.diff(test) > 1)
    assert edges.tolist() == [49, 99, 149]
    assert train.size == 1000 - 200 - 4 * 20
    assert np.min(np.abs(train[:, np.newaxis] - test)) == 11


@pytest.mark.parametrize("n", range(2, 12))
def test_a_share_of_few_rows(n):
    train, test = held_out(n, 0.2, gap_that_fits(n, 10))
    assert np.array_equal(np.sort([*train, *test]), np.arange(n))
    assert 1 <= test.size < n


@pytest.mark.parametrize("wrong", [(5, 1, 0), (5, 6, 0), (5, 2, -1)])
def test_refused(wrong):
    with pytest.raises(ValueError, match=r"folds|gap"):
        block_folds(*wrong)
