"""Print a recorded step as readable C99.

State, input and output are structs with the signals' names; the step is straight-line code. What is used once is written
where it is used, what is used twice gets a name. The operations and their order are those of the recorded list, so a
compiler that neither fuses (-ffp-contract=off) nor reorders gives the same bits as the other printers.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from math import isfinite, isnan

from codriver.kernel.record import Recorded

_BOOLEAN = ("lt", "le", "eq", "ne", "not", "and", "or")
_SIGN = {
    "add": "+",
    "sub": "-",
    "mul": "*",
    "div": "/",
    "lt": "<",
    "le": "<=",
    "eq": "==",
    "ne": "!=",
    "and": "&&",
    "or": "||",
}
_LONGEST = 90  # characters an expression may grow to before it gets a name


@dataclass(frozen=True)
class Body:
    """The body of a step: lines of C, and which helper functions they call."""

    lines: tuple[str, ...]
    helpers: frozenset[str]


def print_body(recorded: Recorded, real: str = "double") -> Body:
    """The statements of the step, on `s` (state), `in` and `out`.

    Args:
        recorded: the step.
        real: "double" or "float": how constants are written.
    """
    return _Printer(recorded, real).body()


def number(value: float, real: str) -> str:
    """A constant: the shortest decimal that reads back exactly; with f in float; math.h's names for what is not finite."""
    if not isfinite(value):
        return "NAN" if isnan(value) else "INFINITY" if value > 0 else "-INFINITY"
    return repr(float(value)) + ("f" if real == "float" else "")


class _Printer:
    """Expressions of the instructions, as numbers and as conditions."""

    def __init__(self, recorded: Recorded, real: str) -> None:
        self.recorded, self.real = recorded, real
        self.uses = Counter(i for instruction in recorded.instructions for i in instruction.operands)
        self.uses.update(recorded.carry_results)
        self.uses.update(recorded.output_results)
        self.expression: list[str] = []
        self.lines: list[str] = []
        self.helpers: set[str] = set()
        # What a result is called tells a reader more than a number.
        self.names = dict(zip(recorded.output_results, recorded.outputs, strict=True))
        self.names.update((k, f"next_{name}") for k, name in zip(recorded.carry_results, recorded.carry, strict=True))

    def body(self) -> Body:
        """Print all instructions, then outputs, then the new state."""
        instructions = self.recorded.instructions
        for k, instruction in enumerate(instructions):
            text = self._expression(k)
            leaf = instruction.kind in ("carry", "input", "constant")
            if not leaf and (self.uses[k] > 1 or len(text) > _LONGEST):
                boolean = instruction.kind in _BOOLEAN
                name = self.names.get(k, f"{'b' if boolean else 't'}{k}")
                self.lines.append(f"const {'bool' if boolean else 'real'} {name} = {_bare(text)};")
                text = name
            self.expression.append(text)
        results = []
        for name, k in zip(self.recorded.carry, self.recorded.carry_results, strict=True):
            if self.expression[k] == f"s->{name}":
                continue
            value = _bare(self._real(k))
            # The old state is read until the last expression is printed, so new values wait in constants.
            plain = value.removeprefix("(real)")
            simple = plain.replace("_", "").isalnum() and not plain[0].isdigit()
            if simple:
                results.append(f"s->{name} = {value};")
            else:
                self.lines.append(f"const real next_{name} = {value};")
                results.append(f"s->{name} = next_{name};")
        for name, k in zip(self.recorded.outputs, self.recorded.output_results, strict=True):
            self.lines.append(f"out->{name} = {_bare(self._real(k))};")
        return Body((*self.lines, *results), frozenset(self.helpers))

    def _real(self, k: int) -> str:
        """Instruction k as a number."""
        text = self.expression[k]
        return f"(real){text}" if self.recorded.instructions[k].kind in _BOOLEAN or self._is_flag(k) else text

    def _condition(self, k: int) -> str:
        """Instruction k as a condition."""
        boolean = self.recorded.instructions[k].kind in _BOOLEAN or self._is_flag(k)
        return self.expression[k] if boolean else f"({self.expression[k]} != {number(0.0, self.real)})"

    def _is_flag(self, k: int) -> bool:
        instruction = self.recorded.instructions[k]
        return instruction.kind == "input" and self.recorded.inputs[int(instruction.value)] in self.recorded.flags

    def _expression(self, k: int) -> str:
        """Instruction k, bracketed so that it can stand anywhere."""
        instruction = self.recorded.instructions[k]
        kind, operands = instruction.kind, instruction.operands
        zero, one = number(0.0, self.real), number(1.0, self.real)
        if kind == "constant":
            text = number(float(instruction.value), self.real)
            return f"({text})" if text.startswith("-") else text
        if kind == "carry":
            return f"s->{self.recorded.carry[int(instruction.value)]}"
        if kind == "input":
            return f"in->{self.recorded.inputs[int(instruction.value)]}"
        if kind in ("and", "or"):
            return f"({self._condition(operands[0])} {_SIGN[kind]} {self._condition(operands[1])})"
        if kind == "not":
            return f"(!{self._condition(operands[0])})"
        if kind == "pick":
            self.helpers.add("pick")
            yes, no = (_bare(self._real(i)) for i in operands[1:])
            return f"pick({_bare(self._condition(operands[0]))}, {yes}, {no})"
        if kind == "where":
            return f"({self._condition(operands[0])} ? {self._real(operands[1])} : {zero})"
        x = self._real(operands[0])
        if kind in _SIGN:
            return f"({x} {_SIGN[kind]} {self._real(operands[1])})"
        if kind == "sqrt":
            return f"{'sqrtf' if self.real == 'float' else 'sqrt'}({_bare(x)})"
        if kind == "abs":
            return f"{'fabsf' if self.real == 'float' else 'fabs'}({_bare(x)})"
        if kind == "square":
            self.helpers.add("square")
            return f"square({_bare(x)})"
        return {"neg": f"(-{x})", "twice": f"({number(2.0, self.real)} * {x})", "inverse": f"({one} / {x})"}[kind]


def _bare(text: str) -> str:
    """The text without brackets around all of it."""
    if not text.startswith("(") or text.startswith("(real)"):
        return text
    depth = 0
    for k, character in enumerate(text):
        depth += (character == "(") - (character == ")")
        if depth == 0:
            return text[1:-1] if k == len(text) - 1 else text
    return text
