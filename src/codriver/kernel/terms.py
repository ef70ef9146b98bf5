"""A list of instructions in single assignment, and the terms it is written with.

    listing = Listing()
    x = listing.emit("input", value=0)
    y = pick(x < 0.0, -x, x) * 0.5

Every operation on terms appends an instruction, unless the same operation on the same operands is there already: functions of
one argument share what they have in common. The elementary functions are written in these terms; only operations that
IEEE 754 rounds correctly exist here, so what is written here has the same bits in every printer.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Instruction:
    """One operation.

    Attributes:
        kind: "carry", "input", "constant", one of the kernel's operations, or "pick": (c ? yes : no) + 0.
        operands: numbers of earlier instructions.
        value: of a constant; of a carry or input, its index.
    """

    kind: str
    operands: tuple[int, ...] = ()
    value: float | int = 0


class Listing:
    """Instructions in order; their results are numbered by position."""

    def __init__(self) -> None:
        self.instructions: list[Instruction] = []
        self._known: dict[Instruction, int] = {}

    def emit(self, kind: str, *operands: Term | float, value: float | int = 0) -> Term:
        """Append an operation, or find it; numbers among the operands become constants."""
        places = tuple(self.term(operand).place for operand in operands)
        instruction = Instruction(kind, places, value)
        place = self._known.setdefault(instruction, len(self.instructions))
        if place == len(self.instructions):
            self.instructions.append(instruction)
        return Term(self, place)

    def term(self, value: Term | float) -> Term:
        """A term, or a number as a constant."""
        return value if isinstance(value, Term) else self.emit("constant", value=float(value))


@dataclass(frozen=True, eq=False)
class Term:
    """The result of an instruction. Comparisons give 1 or 0."""

    listing: Listing
    place: int

    def __add__(self, other: Term | float) -> Term:
        return self.listing.emit("add", self, other)

    def __radd__(self, other: float) -> Term:
        return self.listing.emit("add", other, self)

    def __sub__(self, other: Term | float) -> Term:
        return self.listing.emit("sub", self, other)

    def __rsub__(self, other: float) -> Term:
        return self.listing.emit("sub", other, self)

    def __mul__(self, other: Term | float) -> Term:
        return self.listing.emit("mul", self, other)

    def __rmul__(self, other: float) -> Term:
        return self.listing.emit("mul", other, self)

    def __truediv__(self, other: Term | float) -> Term:
        return self.listing.emit("div", self, other)

    def __rtruediv__(self, other: float) -> Term:
        return self.listing.emit("div", other, self)

    def __neg__(self) -> Term:
        return self.listing.emit("neg", self)

    def __abs__(self) -> Term:
        return self.listing.emit("abs", self)

    def __lt__(self, other: Term | float) -> Term:
        return self.listing.emit("lt", self, other)

    def __le__(self, other: Term | float) -> Term:
        return self.listing.emit("le", self, other)

    def __gt__(self, other: Term | float) -> Term:
        return self.listing.emit("lt", other, self)

    def __ge__(self, other: Term | float) -> Term:
        return self.listing.emit("le", other, self)

    def constant(self) -> float | None:
        """Its value where it is a constant, else None."""
        instruction = self.listing.instructions[self.place]
        return float(instruction.value) if instruction.kind == "constant" else None


def equal(first: Term, second: Term | float) -> Term:
    """1 where both are the same number, else 0."""
    return first.listing.emit("eq", first, second)


def unequal(first: Term, second: Term | float) -> Term:
    """1 where they are not the same number (or one is NaN), else 0."""
    return first.listing.emit("ne", first, second)


def both(first: Term, second: Term) -> Term:
    """1 where both are not 0, else 0."""
    return first.listing.emit("and", first, second)


def either(first: Term, second: Term) -> Term:
    """1 where at least one is not 0, else 0."""
    return first.listing.emit("or", first, second)


def pick(condition: Term, yes: Term | float, no: Term | float) -> Term:
    """`yes` where the condition is not 0, else `no`; -0 becomes 0."""
    return condition.listing.emit("pick", condition, yes, no)


def where(condition: Term, yes: Term | float) -> Term:
    """`yes` where the condition is not 0, else 0."""
    return condition.listing.emit("where", condition, yes)


def root(x: Term) -> Term:
    """The square root, correctly rounded."""
    return x.listing.emit("sqrt", x)


def polynomial(z: Term, coefficients: tuple[float, ...]) -> Term:
    """c_0 + c_1 z + c_2 z^2 + ..., by Horner's rule."""
    result = z.listing.term(coefficients[-1])
    for coefficient in coefficients[-2::-1]:
        result = result * z + coefficient
    return result
