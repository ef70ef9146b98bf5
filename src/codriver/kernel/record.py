"""Record a step as straight-line code.

    record(name, step, carry, inputs) -> Recorded

calls the step once on CasADi's symbols and turns CasADi's instruction list into static single assignment: every
instruction has one result, operands are earlier results. The printers (`llvm`, `c99`) go through that list line by line.
CasADi's own interpreter runs the same function and is their referee.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from codriver.errors import KernelError
from codriver.kernel.expressions import Scalar

StepFunction = Callable[[dict[str, Scalar], dict[str, Scalar]], tuple[dict[str, Scalar], dict[str, Scalar]]]


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


@dataclass(frozen=True, eq=False)
class Recorded:
    """A step as straight-line code.

    Attributes:
        name: an identifier.
        carry: names of the carried scalars.
        inputs: names of the inputs; those in `flags` are 0 or 1.
        flags: the inputs that are flags.
        outputs: names of the outputs.
        instructions: in order; their results are numbered by position.
        carry_results, output_results: the instruction that holds each new carry and output.
        function: the CasADi function: (carry, inputs) -> (carry, outputs), vectors.
    """

    name: str
    carry: tuple[str, ...]
    inputs: tuple[str, ...]
    flags: frozenset[str]
    outputs: tuple[str, ...]
    instructions: tuple[Instruction, ...]
    carry_results: tuple[int, ...]
    output_results: tuple[int, ...]
    function: Any

    def fingerprint(self) -> str:
        """Sixteen hexadecimal digits that change with any operation or constant of the step."""
        from hashlib import sha256

        return sha256(repr((self.carry, self.inputs, self.outputs, self.instructions)).encode()).hexdigest()[:16]

    def operations(self) -> int:
        """How many arithmetic operations one step takes; its cost, counted and not timed."""
        return sum(i.kind not in ("constant", "carry", "input") for i in self.instructions)


def _kinds() -> dict[int, str]:
    """CasADi's operation codes that the kernel carries, all exact in IEEE arithmetic."""
    import casadi as ca

    return {
        ca.OP_ADD: "add", ca.OP_SUB: "sub", ca.OP_MUL: "mul", ca.OP_DIV: "div", ca.OP_NEG: "neg", ca.OP_SQRT: "sqrt",
        ca.OP_SQ: "square", ca.OP_TWICE: "twice", ca.OP_INV: "inverse", ca.OP_FABS: "abs", ca.OP_LT: "lt", ca.OP_LE: "le",
        ca.OP_EQ: "eq", ca.OP_NE: "ne", ca.OP_NOT: "not", ca.OP_AND: "and", ca.OP_OR: "or", ca.OP_IF_ELSE_ZERO: "where",
        ca.OP_ASSIGN: "copy", ca.OP_CONST: "constant", ca.OP_INPUT: "input", ca.OP_OUTPUT: "output",
    }  # fmt: skip


def record(
    name: str, step: StepFunction, carry: Sequence[str], inputs: Sequence[str], flags: Sequence[str] = ()
) -> Recorded:
    """Record a step.

    Args:
        name: an identifier for the recorded function.
        step: (carry, inputs) -> (carry, outputs), mappings of names to scalars.
        carry: names of the carried scalars; the step must return the same.
        inputs: names of the inputs.
        flags: those of the inputs that are 0 or 1.

    Returns:
        the step; carried scalars that no output depends on are left out.

    Raises:
        KernelError: the step returns another carry than it takes, or uses an operation the kernel does not carry.
    """
    import casadi as ca

    state = ca.SX.sym("carry", len(carry))
    given = ca.SX.sym("input", len(inputs))
    new, out = step(
        {key: state[k] for k, key in enumerate(carry)},
        {key: given[k] for k, key in enumerate(inputs)},
    )
    if list(new) != list(carry):
        raise KernelError(
            f"the step of '{name}' returns the carry {list(new)}",
            f"the carry it takes, in its order: {list(carry)}",
            "return every carried scalar, in order",
        )
    kept = _needed(state, list(new.values()), list(out.values()))
    results = ca.vertcat(*[ca.SX(list(new.values())[k]) for k in kept]), ca.vertcat(*[ca.SX(v) for v in out.values()])
    taken = ca.vertcat(ca.SX(0, 1), *[state[k] for k in kept])
    function = ca.Function(name, [taken, given], ca.cse(list(results)), ["carry", "input"], ["carry_next", "output"])
    instructions, targets = _drop_unused(*_fuse_selects(*_assign_once(name, function)))
    return Recorded(
        name, tuple(carry[k] for k in kept), tuple(inputs), frozenset(flags), tuple(out), tuple(instructions),
        tuple(targets[0, k] for k in range(len(kept))), tuple(targets[1, k] for k in range(len(out))), function,
    )  # fmt: skip


def _needed(state: Any, new: Sequence[Scalar], out: Sequence[Scalar]) -> list[int]:
    """The carried scalars that some output depends on, now or later; what feeds only itself is not computed."""
    import casadi as ca

    place = {state[k].element_hash(): k for k in range(len(new))}

    def read_by(value: Scalar) -> set[int]:
        return {place[s.element_hash()] for s in ca.symvar(ca.SX(value)) if s.element_hash() in place}

    needed: set[int] = set()
    fresh = set().union(*(read_by(value) for value in out))
    while fresh:
        needed |= fresh
        fresh = set().union(*(read_by(new[k]) for k in fresh)) - needed
    return sorted(needed)


def _assign_once(name: str, function: Any) -> tuple[list[Instruction], dict[tuple[int, int], int]]:
    """CasADi's list, whose work vector reuses its places, as single assignments; and where each result is."""
    kinds = _kinds()
    instructions: list[Instruction] = []
    place: dict[int, int] = {}  # CasADi's work index -> instruction that filled it last
    targets: dict[tuple[int, int], int] = {}
    known: dict[Instruction, int] = {}  # the same operation on the same operands is done once
    for k in range(function.n_instructions()):
        code = function.instruction_id(k)
        kind = kinds.get(code)
        if kind is None:
            raise KernelError(
                f"the step of '{name}' uses CasADi's operation {code}",
                f"only exact operations: {', '.join(sorted(set(kinds.values())))}",
                "write it with those; exp, sin and their like differ between libraries in the last bit",
            )
        reads, writes = function.instruction_input(k), function.instruction_output(k)
        if kind == "output":
            targets[writes[0], writes[1]] = place[reads[0]]
            continue
        if kind == "copy":
            place[writes[0]] = place[reads[0]]
            continue
        if kind == "constant":
            instruction = Instruction("constant", (), float(function.instruction_constant(k)))
        elif kind == "input":
            instruction = Instruction("carry" if reads[0] == 0 else "input", (), int(reads[1]))
        else:
            instruction = Instruction(kind, tuple(place[i] for i in reads))
        if instruction not in known:
            known[instruction] = len(instructions)
            instructions.append(instruction)
        place[writes[0]] = known[instruction]
    # An output that is identically zero is sparse in CasADi and has no instruction of its own.
    for result, width in enumerate((function.size1_out(0), function.size1_out(1))):
        for element in range(width):
            if (result, element) not in targets:
                zero = Instruction("constant", (), 0.0)
                if zero not in known:
                    known[zero] = len(instructions)
                    instructions.append(zero)
                targets[result, element] = known[zero]
    return instructions, targets


def _fuse_selects(
    instructions: list[Instruction], targets: dict[tuple[int, int], int]
) -> tuple[list[Instruction], dict[tuple[int, int], int]]:
    """CasADi writes a selection as (c ? yes : 0) + (!c ? no : 0). Make it one "pick": (c ? yes : no) + 0, the same bits."""

    def branches(first: Instruction, second: Instruction) -> tuple[int, int, int] | None:
        if first.kind != "where" or second.kind != "where":
            return None
        other = instructions[second.operands[0]]
        if other.kind == "not" and other.operands[0] == first.operands[0]:
            return first.operands[0], first.operands[1], second.operands[1]
        return None

    fused = []
    for instruction in instructions:
        if instruction.kind == "add":
            first, second = (instructions[i] for i in instruction.operands)
            found = branches(first, second) or branches(second, first)
            if found:
                instruction = Instruction("pick", found)
        fused.append(instruction)
    return fused, targets


def _drop_unused(
    instructions: list[Instruction], targets: dict[tuple[int, int], int]
) -> tuple[list[Instruction], dict[tuple[int, int], int]]:
    """Keep what a result needs, renumbered."""
    needed = set(targets.values())
    for number in range(len(instructions) - 1, -1, -1):
        if number in needed:
            needed.update(instructions[number].operands)
    place: dict[int, int] = {}
    kept: list[Instruction] = []
    for number, instruction in enumerate(instructions):
        if number in needed:
            place[number] = len(kept)
            kept.append(Instruction(instruction.kind, tuple(place[i] for i in instruction.operands), instruction.value))
    return kept, {key: place[number] for key, number in targets.items()}


def interpret(
    recorded: Recorded, carry: Mapping[str, float], inputs: Mapping[str, float]
) -> tuple[list[float], list[float]]:
    """One step by CasADi's own interpreter: the referee of the printers."""
    new, out = recorded.function([carry[key] for key in recorded.carry], [inputs[key] for key in recorded.inputs])
    return [float(x) for x in new.full().ravel()], [float(x) for x in out.full().ravel()]
