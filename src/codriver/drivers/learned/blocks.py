"""Which rows a model learns from and which it is judged by: contiguous blocks with a gap.

    test_j = rows n j / J ... n (j + 1) / J - 1,      train_j = the rows further than `gap` from test_j

Neighbouring rows of a record are nearly copies of each other, and with a history they share samples. A random split puts copies
of the training rows into the test and flatters whoever remembers best. So rows are split in blocks, and the rows next to
a test block belong to nobody: `gap` should be at least the length of the history in rows.

The gap ends where a stretch ends: rows of another stretch are no neighbours, and no history reaches across.

C. Bergmeir, J. M. Benitez 2012, doi 10.1016/j.ins.2011.12.028; J. Racine 2000, doi 10.1016/S0304-4076(00)00030-0.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from codriver.drivers.learned.regressor import stretches

Rows = npt.NDArray[np.intp]
PARTS = 4  # blocks a held-out share is spread over


def block_folds(n: int, folds: int, gap: int, lengths: Sequence[int] | None = None) -> list[tuple[Rows, Rows]]:
    """Split rows into contiguous blocks, each held out once.

    Args:
        n: how many rows, in the order of time.
        folds: how many blocks; their sizes differ by one at most. A block may reach over the end of a stretch.
        gap: rows between a test block and the rows learned from, on either side within its stretch.
        lengths: of the stretches without holes, summing to n; None: one stretch.

    Returns:
        (train, test) for each block: row numbers in ascending order. `train` is empty where the gaps leave nothing.

    Raises:
        ValueError: fewer than two folds, more folds than rows, a negative gap, or lengths that do not sum to n.
    """
    if not 2 <= folds <= n:
        raise ValueError(f"{folds} folds of {n} rows; at least 2 folds and as many rows")
    if gap < 0:
        raise ValueError(f"gap = {gap} rows; 0 or more")
    edges = np.arange(folds + 1) * n // folds
    return [_apart(n, [(int(a), int(b))], gap, lengths) for a, b in pairwise(edges)]


def held_out(n: int, share: float, gap: int, lengths: Sequence[int] | None = None) -> tuple[Rows, Rows]:
    """One split: a share of the rows held out, as a few blocks spread evenly over the record.

    Args:
        n: how many rows.
        share: of the rows that is held out, between 0 and 1.
        gap: as for `block_folds`.
        lengths: as for `block_folds`.

    Returns:
        (train, test), row numbers in ascending order; `test` holds at least one row.

    Raises:
        ValueError: fewer than two rows, or the share is not between 0 and 1.
    """
    if n < 2 or not 0 < share < 1:
        raise ValueError(f"a share of {share} of {n} rows; a share between 0 and 1 of at least 2 rows")
    parts = min(PARTS, max(1, int(share * n)))
    size = max(1, round(share * n / parts))
    middles = (np.arange(parts) + 0.5) * n / parts
    starts = np.clip(np.round(middles - size / 2).astype(int), 0, n - size)
    return _apart(n, [(int(a), int(a) + size) for a in starts], gap, lengths)


def gap_that_fits(n: int, gap: int) -> int:
    """The gap, or a fiftieth of the rows where a record is too short for it."""
    return min(gap, n // 50)


def _apart(n: int, blocks: Iterable[tuple[int, int]], gap: int, lengths: Sequence[int] | None) -> tuple[Rows, Rows]:
    """Rows outside and inside of blocks [a, b), without those within the gap."""
    tested, taken = np.zeros(n, dtype=bool), np.zeros(n, dtype=bool)
    for a, b in blocks:
        tested[a:b] = True
        for stretch in stretches(n, lengths):
            first, last = max(a, stretch.start), min(b, stretch.stop)
            if first < last:
                taken[max(first - gap, stretch.start) : min(last + gap, stretch.stop)] = True
    return np.flatnonzero(~taken & ~tested), np.flatnonzero(tested)
