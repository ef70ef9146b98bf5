"""Elementary functions as exact operations.

    (sin, cos, exp, ... on terms)  ->  (+ - * / sqrt, comparison, selection)

A step is written with CasADi's own functions, so derivatives can be taken of it. C libraries differ in the last bit of sin or
exp; so once a step is recorded, every such function is replaced by a sequence of operations that IEEE 754 rounds correctly.
The sequence depends on the kind of numbers: float has its own, shorter polynomials. A step without such functions stays as it is.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence
from typing import Any

from codriver.kernel.circular import cosine, sine, tangent
from codriver.kernel.exponential import (
    exponential,
    exponential_less_one,
    hyperbolic_cosine,
    hyperbolic_sine,
    hyperbolic_tangent,
)
from codriver.kernel.inverse_circular import arccosine, arcsine, arctangent, arctangent2
from codriver.kernel.logarithm import logarithm, logarithm_of_one_more, power
from codriver.kernel.reals import Real
from codriver.kernel.rounding import ceiling, floor, fmod, hypotenuse, larger, remainder, sign, smaller, with_sign
from codriver.kernel.terms import Instruction, Listing, Term

# How each function is written in exact operations.
FUNCTIONS: dict[str, Callable[..., Term]] = {
    "sin": sine, "cos": cosine, "tan": tangent, "asin": arcsine, "acos": arccosine, "atan": arctangent,
    "atan2": arctangent2, "exp": exponential, "expm1": exponential_less_one, "log": logarithm,
    "log1p": logarithm_of_one_more, "power": power, "sinh": hyperbolic_sine, "cosh": hyperbolic_cosine,
    "tanh": hyperbolic_tangent, "floor": floor, "ceil": ceiling, "sign": sign, "copysign": with_sign, "fmin": smaller,
    "fmax": larger, "fmod": fmod, "remainder": remainder, "hypot": hypotenuse,
}  # fmt: skip


def is_exact(instructions: Sequence[Instruction]) -> bool:
    """Whether all operations are exact as they are."""
    return all(instruction.kind not in FUNCTIONS for instruction in instructions)


def lower(
    instructions: Sequence[Instruction], results: Sequence[int], real: Real
) -> tuple[tuple[Instruction, ...], tuple[int, ...]]:
    """Replace the elementary functions.

    Args:
        instructions: a step in single assignment.
        results: the instructions whose results are wanted.
        real: the kind of numbers it will be computed in.

    Returns:
        the new list, without what no result needs; where the results are in it. A list without such functions stays as it is.
    """
    if is_exact(instructions):
        return tuple(instructions), tuple(results)
    listing = Listing()
    terms: list[Term] = []
    for instruction in instructions:
        operands = [terms[place] for place in instruction.operands]
        if instruction.kind in FUNCTIONS:
            terms.append(FUNCTIONS[instruction.kind](real, *operands))
        else:
            terms.append(listing.emit(instruction.kind, *operands, value=instruction.value))
    return keep_needed(listing.instructions, [terms[place].place for place in results])


def keep_needed(
    instructions: Sequence[Instruction], results: Sequence[int]
) -> tuple[tuple[Instruction, ...], tuple[int, ...]]:
    """What a result needs, renumbered; where the results are now."""
    needed = set(results)
    for number in range(len(instructions) - 1, -1, -1):
        if number in needed:
            needed.update(instructions[number].operands)
    place: dict[int, int] = {}
    kept: list[Instruction] = []
    for number, instruction in enumerate(instructions):
        if number in needed:
            place[number] = len(kept)
            kept.append(Instruction(instruction.kind, tuple(place[i] for i in instruction.operands), instruction.value))
    return tuple(kept), tuple(place[number] for number in results)


def casadi_function(
    name: str, instructions: Sequence[Instruction], carry: int, inputs: int, results: Sequence[Sequence[int]]
) -> Any:
    """CasADi's function of a list of exact operations: (carry, inputs) -> (carry, outputs), vectors.

    CasADi simplifies expressions as they are written, (x + c) - c to x for one. It is told not to meanwhile, which holds for
    all threads: so this function is made when it is asked for, by tests, and not with every recording.

    Args:
        name: an identifier.
        instructions: in single assignment, exact operations only.
        carry, inputs: how many there are.
        results: the instructions that hold the new carry, and the outputs.
    """
    import casadi as ca

    operations: dict[str, Callable[..., Any]] = {
        "add": operator.add, "sub": operator.sub, "mul": operator.mul, "div": operator.truediv, "neg": operator.neg,
        "sqrt": ca.sqrt, "square": lambda x: x * x, "twice": lambda x: x + x, "inverse": lambda x: 1.0 / x, "abs": ca.fabs,
        "lt": operator.lt, "le": operator.le, "eq": operator.eq, "ne": operator.ne, "not": ca.logic_not,
        "and": ca.logic_and, "or": ca.logic_or, "pick": ca.if_else,
        "where": lambda x, y: ca.SX.binary(ca.OP_IF_ELSE_ZERO, x, y),
    }  # fmt: skip
    given = {"carry": ca.SX.sym("carry", carry), "input": ca.SX.sym("input", inputs)}
    before = ca.GlobalOptions.getSimplificationOnTheFly()
    ca.GlobalOptions.setSimplificationOnTheFly(False)
    try:
        values: list[Any] = []
        for i in instructions:
            if i.kind in given:
                values.append(given[i.kind][int(i.value)])
            elif i.kind == "constant":
                values.append(ca.SX(float(i.value)))
            else:
                values.append(operations[i.kind](*(values[place] for place in i.operands)))
        made = [ca.vertcat(*(values[place] for place in places)) for places in results]
        return ca.Function(name, list(given.values()), made, list(given), ["carry_next", "output"])
    finally:
        ca.GlobalOptions.setSimplificationOnTheFly(before)
