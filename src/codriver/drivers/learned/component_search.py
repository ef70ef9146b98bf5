"""How many components: the number with the least AIC or BIC, tried from the smallest on.

A larger number has to gain more than `WORTH`: less is no evidence (Kass, Raftery 1995, doi 10.1080/01621459.1995.10476572), and
where components died, two numbers give one model. The search ends once `RISES` numbers in a row were not worth it: the criterion
falls and then rises, and larger models are the dear ones.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import inf
from typing import TypeVar

from codriver.drivers.learned.mixture import criterion

M = TypeVar("M")
RISES, WORTH = 2, 2.0


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
    """The model with the least criterion, to within `WORTH`.

    Args:
        numbers: of components, ascending, at least one.
        name: "aic" or "bic".
        n: rows.
        fit: from a number of components to a model, its log-likelihood and its number of parameters.

    Returns:
        the model; the criterion by number of components, as far as was tried.
    """
    tried: dict[int, float] = {}
    found: list[M] = []
    lowest, rises = inf, 0
    for number in numbers:
        model, log_likelihood, parameters = fit(number)
        tried[number] = criterion(name, log_likelihood, parameters, n)
        if not found or tried[number] < lowest - WORTH:
            found, lowest, rises = [model], tried[number], 0
        else:
            rises += 1
        if rises == RISES:
            break
    return found[0], tried
