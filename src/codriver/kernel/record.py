"""Record a step as straight-line code.

    record(name, step, carry, inputs) -> Recorded

calls the step once on CasADi's symbols and turns CasADi's instruction list into static single assignment: every
instruction has one result, operands are earlier results. Elementary functions in it (sin, exp, ...) are replaced by exact
operations (`lower`). The printers (`llvm`, `c99`) go through that list line by line. CasADi's own interpreter runs the same
operations and is their referee.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from codriver.errors import KernelError
from codriver.kernel.expressions import Scalar
from codriver.kernel.lower import FUNCTIONS, casadi_function, is_exact, keep_needed, lower
from codriver.kernel.reals import DOUBLE, REALS
from codriver.kernel.terms import Instruction, Listing, Term

StepFunction = Callable[[dict[str, Scalar], dict[str, Scalar]], tuple[dict[str, Scalar], dict[str, Scalar]]]


@dataclass(frozen=True, eq=False)
class Recorded:
    """A step as straight-line code.

    Attributes:
        name: an identifier.
        carry: names of the carried scalars.
        inputs: names of the inputs; those in `flags` are 0 or 1.
        flags: the inputs that are flags.
        outputs: names of the outputs.
        instructions: in order, exact operations only; their results are numbered by position.
        carry_results, output_results: the instruction that holds each new carry and output.
        function: the CasADi function of the step as written: (carry, inputs) -> (carry, outputs), vectors.
        written: the instructions before elementary functions were replaced.
        written_results: where the new carry and the outputs are among those.
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
    written: tuple[Instruction, ...]
    written_results: tuple[int, ...]

    def printed_in(self, real: str) -> Recorded:
        """The step as "double" or "float" computes it: elementary functions have their own operations in each."""
        instructions, results = lower(self.written, self.written_results, REALS[real])
        n = len(self.carry)
        return replace(self, instructions=instructions, carry_results=results[:n], output_results=results[n:])

    @cached_property
    def referee(self) -> Any:
        """CasADi's function of the exact operations; that of the step itself, if it has no others."""
        if is_exact(self.written):
            return self.function
        results = self.carry_results, self.output_results
        return casadi_function(self.name, self.instructions, len(self.carry), len(self.inputs), results)

    def fingerprint(self) -> str:
        """Sixteen hexadecimal digits that change with any operation or constant of the step."""
        from hashlib import sha256

        return sha256(repr((self.carry, self.inputs, self.outputs, self.instructions)).encode()).hexdigest()[:16]

    def operations(self) -> int:
        """How many arithmetic operations one step takes; its cost, counted and not timed."""
        return sum(i.kind not in ("constant", "carry", "input") for i in self.instructions)


def _kinds() -> dict[int, str]:
    """CasADi's operation codes that the kernel carries: exact in IEEE arithmetic, or in `FUNCTIONS`."""
    import casadi as ca

    functions = {getattr(ca, f"OP_{name.upper()}"): name for name in FUNCTIONS if name != "power"}
    return functions | {
        ca.OP_POW: "power", ca.OP_CONSTPOW: "power",
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
        the step; carried scalars that no output depends on are left out, elementary functions are exact operations.

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
    kept = _needed(state, given, list(new.values()), list(out.values()))
    results = ca.vertcat(*[ca.SX(list(new.values())[k]) for k in kept]), ca.vertcat(*[ca.SX(v) for v in out.values()])
    taken = ca.vertcat(ca.SX(0, 1), *[state[k] for k in kept])
    function = ca.Function(name, [taken, given], ca.cse(list(results)), ["carry", "input"], ["carry_next", "output"])
    once, targets = _assign_once(name, function)
    wanted = [targets[0, k] for k in range(len(kept))] + [targets[1, k] for k in range(len(out))]
    written, written_places = keep_needed(_fuse_selects(once), wanted)
    instructions, places = lower(written, written_places, DOUBLE)
    new_places, out_places = places[: len(kept)], places[len(kept) :]
    return Recorded(
        name, tuple(carry[k] for k in kept), tuple(inputs), frozenset(flags), tuple(out), instructions, new_places,
        out_places, function, written, written_places,
    )  # fmt: skip


def _needed(state: Any, given: Any, new: Sequence[Scalar], out: Sequence[Scalar]) -> list[int]:
    """The carried scalars that some output depends on, now or later; what feeds only itself is not computed."""
    read_by = _read_by(state, given, [*new, *out])
    needed, fresh = 0, 0
    for bits in read_by[len(new) :]:
        fresh |= bits
    while fresh:
        needed |= fresh
        found = 0
        for k in _places(fresh):
            found |= read_by[k]
        fresh = found & ~needed
    return _places(needed)


def _read_by(state: Any, given: Any, values: Sequence[Scalar]) -> list[int]:
    """Which carried scalars each value is computed from: bit k stands for state[k]. One walk down CasADi's list for all."""
    import casadi as ca

    function = ca.Function("read_by", [state, given], [ca.densify(ca.vertcat(*[ca.SX(value) for value in values]))])
    bits: dict[int, int] = {}  # CasADi's work index -> what was read for it
    found = [0] * len(values)
    for k in range(function.n_instructions()):
        code, reads, writes = function.instruction_id(k), function.instruction_input(k), function.instruction_output(k)
        if code == ca.OP_OUTPUT:
            found[writes[1]] = bits[reads[0]]
        elif code == ca.OP_INPUT:
            bits[writes[0]] = 1 << reads[1] if reads[0] == 0 else 0
        else:
            of = 0
            for i in reads:
                of |= bits[i]
            bits[writes[0]] = of
    return found


def _places(bits: int) -> list[int]:
    """The places of the bits that are set, ascending."""
    return [k for k in range(bits.bit_length()) if bits >> k & 1]


def _assign_once(name: str, function: Any) -> tuple[list[Instruction], dict[tuple[int, int], int]]:
    """CasADi's list, whose work vector reuses its places, as single assignments; and where each result is."""
    kinds = _kinds()
    listing = Listing()
    place: dict[int, Term] = {}  # CasADi's work index -> what filled it last
    targets: dict[tuple[int, int], int] = {}
    for k in range(function.n_instructions()):
        code = function.instruction_id(k)
        kind = kinds.get(code)
        if kind is None:
            raise KernelError(
                f"the step of '{name}' uses CasADi's operation {_called(code)}",
                f"only operations that are exact or made of exact ones: {', '.join(sorted(set(kinds.values())))}",
                "write it with those; others differ between libraries in the last bit",
            )
        reads, writes = function.instruction_input(k), function.instruction_output(k)
        if kind == "output":
            targets[writes[0], writes[1]] = place[reads[0]].place
        elif kind == "copy":
            place[writes[0]] = place[reads[0]]
        elif kind == "constant":
            place[writes[0]] = listing.term(function.instruction_constant(k))
        elif kind == "input":
            place[writes[0]] = listing.emit("carry" if reads[0] == 0 else "input", value=int(reads[1]))
        else:
            place[writes[0]] = listing.emit(kind, *(place[i] for i in reads))
    # An output that is identically zero is sparse in CasADi and has no instruction of its own.
    for result, width in enumerate((function.size1_out(0), function.size1_out(1))):
        for element in range(width):
            if (result, element) not in targets:
                targets[result, element] = listing.term(0.0).place
    return listing.instructions, targets


def _called(code: int) -> str:
    """What CasADi calls an operation."""
    import casadi as ca

    return next(
        (name[3:].lower() for name in dir(ca) if name.startswith("OP_") and getattr(ca, name) == code), str(code)
    )


def _fuse_selects(instructions: list[Instruction]) -> list[Instruction]:
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
    return fused


def interpret(
    recorded: Recorded, carry: Mapping[str, float], inputs: Mapping[str, float]
) -> tuple[list[float], list[float]]:
    """One step by CasADi's own interpreter: the referee of the printers."""
    new, out = recorded.referee([carry[key] for key in recorded.carry], [inputs[key] for key in recorded.inputs])
    return [float(x) for x in new.full().ravel()], [float(x) for x in out.full().ravel()]
