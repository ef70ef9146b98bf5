"""Regression trees as plain arrays, for numbers and for the kernel alike.

    sum over trees of the leaf that z falls into;      at a node: z_feature <= threshold ? left : right

All nodes of all trees lie in one set of arrays, trees one after the other; children are numbered within them.

scikit-learn rounds features to single precision before it compares them. Rounding keeps order, so there is a greatest double
that rounds to threshold or less, and comparing the double itself with that one gives the same answer for every double:
thresholds are replaced by it once, and neither prediction nor step rounds anything.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from codriver.signals.signal import Array

Integers = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Trees:
    """A sum of regression trees.

    Attributes:
        roots: node of each tree's root, shape (trees,).
        left, right: nodes of the children, -1 at a leaf, shape (nodes,).
        feature: column compared, shape (nodes,); of no meaning at a leaf.
        threshold: what it is compared with, shape (nodes,).
        value: of a leaf, shape (nodes,).
    """

    roots: Integers
    left: Integers
    right: Integers
    feature: Integers
    threshold: Array
    value: Array

    @classmethod
    def of(cls, trees: Iterable[Any], factor: float) -> Self:
        """From scikit-learn's fitted regression trees (`tree_`), leaves times the factor."""
        roots, parts, count = [], [], 0
        for tree in trees:
            roots.append(count)
            inside = tree.children_left >= 0
            left = np.where(inside, tree.children_left + count, -1)
            right = np.where(inside, tree.children_right + count, -1)
            threshold = np.where(inside, greatest_double(np.asarray(tree.threshold)), 0.0)
            parts.append((left, right, np.where(inside, tree.feature, 0), threshold, factor * tree.value[:, 0, 0]))
            count += tree.node_count
        if not parts:
            none, empty = np.zeros(0, dtype=np.int64), np.zeros(0)
            return cls(none, none, none, none, empty, empty)
        left, right, feature, threshold, value = (np.concatenate(column) for column in zip(*parts, strict=True))
        return cls(
            np.array(roots, dtype=np.int64), left.astype(np.int64), right.astype(np.int64), feature.astype(np.int64),
            threshold, value,
        )  # fmt: skip

    def __len__(self) -> int:
        return self.roots.size

    def total(self, start: Any, column: Callable[[int], Any], choose: Callable[[Any, Any, Any], Any]) -> Any:
        """start + the sum of all trees, in their order.

        Args:
            start: what is added to.
            column: feature number -> its values: an array, a number or a symbol.
            choose: (condition, yes, no) -> one of them.
        """
        left, right, feature = self.left.tolist(), self.right.tolist(), self.feature.tolist()
        threshold, value = self.threshold.tolist(), self.value.tolist()

        def at(node: int) -> Any:
            if left[node] < 0:
                return value[node]
            return choose(column(feature[node]) <= threshold[node], at(left[node]), at(right[node]))

        for root in self.roots.tolist():
            start = start + at(root)
        return start

    def state(self) -> dict[str, Any]:
        """The arrays by name."""
        return dict(vars(self))

    @classmethod
    def restored(cls, state: Mapping[str, Any]) -> Self:
        """From what `state` gave; arrays may come as lists."""
        whole: dict[str, Any] = {
            name: np.asarray(state[name], dtype=np.int64) for name in ("roots", "left", "right", "feature")
        }
        real: dict[str, Any] = {name: np.asarray(state[name], dtype=np.float64) for name in ("threshold", "value")}
        return cls(**whole, **real)


def greatest_double(threshold: Array) -> Array:
    """The greatest double that rounds to single precision at or below a threshold, for each of an array.

    With f the greatest single at or below it and g the next, doubles up to their middle round to f or less; the middle itself
    does where the last bit of f is 0.
    """
    below = threshold.astype(np.float32)
    below = np.where(below > threshold, np.nextafter(below, np.float32(-np.inf)), below)
    above = np.nextafter(below, np.float32(np.inf))
    middle = 0.5 * (below.astype(np.float64) + above.astype(np.float64))
    even = below.view(np.int32) % 2 == 0
    return np.where(even, middle, np.nextafter(middle, -np.inf))
