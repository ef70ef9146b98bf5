"""How many components: the number with the least AIC or BIC, tried from the smallest on.

The search ends once the criterion has risen `RISES` times in a row above its least: it falls and then rises, and larger
models are the dear ones.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

from codriver.drivers.learned.mixture import criterion

M = TypeVar("M")
RISES = 2


def candidate_numbers(components: int | str, candidates: Sequence[int], n: int) -> tuple[list[int], str]:
    """The numbers to try and the criterion to choose by.

    Args:
        components: "bic", "aic" or a number.
        candidates: numbers to try for a criterion.
        n: rows.

    Raises:
        ValueError: it is neither, or there are fewer rows than components.
    """
    if isinstance(components, str):
        if components not in ("bic", "aic"):
            raise ValueError(f"components = '{components}'; 'bic', 'aic' or a number")
        numbers = sorted({int(c) for c in candidates if 1 <= c <= n})
        if not numbers:
            raise ValueError(f"candidates = {tuple(candidates)}; at least one from 1 to {n}, the number of rows")
        return numbers, components
    if int(components) != components or not 1 <= components <= n:
        raise ValueError(f"components = {components}; a whole number from 1 to {n}, the number of rows")
    return [int(components)], "bic"


def least(
    numbers: Sequence[int], name: str, n: int, fit: Callable[[int], tuple[M, float, int]]
) -> tuple[M, dict[int, float]]:
    """The model with the least criterion.

    Args:
        numbers: of components, ascending.
        name: "aic" or "bic".
        n: rows.
        fit: from a number of components to a model, its log-likelihood and its number of parameters.

    Returns:
        the model; the criterion by number of components, as far as was tried.
    """
    tried: dict[int, float] = {}
    best: M | None = None
    rises = 0
    for number in numbers:
        model, log_likelihood, parameters = fit(number)
        value = criterion(name, log_likelihood, parameters, n)
        if best is None or value < min(tried.values()):
            best, rises = model, 0
        else:
            rises += 1
        tried[number] = value
        if rises == RISES:
            break
    assert best is not None
    return best, tried
