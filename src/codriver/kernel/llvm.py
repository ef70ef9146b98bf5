"""Print a recorded step as LLVM text and compile it for this machine.

The loop over samples is one function

    void run(i64 n, double *carry, ptr *inputs, ptr *outputs)

with one column a pointer: inputs are double columns, or byte columns for flags; outputs are double columns. The carry lives
in registers inside the loop. With n = 1 the same code is the live step, so batch and live cannot differ. No fast-math
flag is set, so LLVM neither reorders nor fuses: results have the bits that the operations as written have.

numba takes seconds to compile the same list, this less than a tenth (docs/bit-contract.md has the figures).
"""

from __future__ import annotations

import ctypes
import struct
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Any

from codriver.kernel.record import Recorded
from codriver.kernel.terms import Instruction

RunFunction = Callable[[int, int, int, int], None]

# Steps longer than this are compiled without optimising: its time grows faster than the step (15 s against 0.2 s for
# 17,000 operations), and the bits are the same.
QUICK_TO_OPTIMISE = 12_000

_BINARY = {"add": "fadd", "sub": "fsub", "mul": "fmul", "div": "fdiv"}
# "une" is true for NaN, as C's != is; the others are false for NaN.
_COMPARE = {"lt": "olt", "le": "ole", "eq": "oeq", "ne": "une"}


@dataclass(frozen=True, eq=False)
class Compiled:
    """A compiled loop. `run(n, carry, inputs, outputs)` takes addresses; it releases Python's lock while it runs."""

    run: RunFunction
    text: str
    engine: Any  # owns the machine code: must live as long as `run`


def compile_loop(recorded: Recorded, *, anew: bool = False) -> Compiled:
    """Compile the loop over samples of a recorded step.

    Args:
        recorded: the step.
        anew: compile it even if the same was compiled lately, to see how long that takes.
    """
    level = 2 if recorded.operations() <= QUICK_TO_OPTIMISE else 0
    return (_compiled.__wrapped__ if anew else _compiled)(print_loop(recorded), level)


@lru_cache(maxsize=64)
def _compiled(text: str, level: int) -> Compiled:
    """The machine code of a loop printed as LLVM text; it keeps no state of its own, so programs may share it."""
    import llvmlite.binding as llvm

    module = llvm.parse_assembly(text)
    module.verify()
    machine = _machine(level)
    options = llvm.create_pipeline_tuning_options(speed_level=level)
    builder = llvm.create_pass_builder(machine, options)
    builder.getModulePassManager().run(module, builder)
    engine = llvm.create_mcjit_compiler(module, _machine(level))
    engine.finalize_object()
    address = engine.get_function_address("run")
    prototype = ctypes.CFUNCTYPE(None, ctypes.c_int64, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)
    return Compiled(prototype(address), text, engine)


@cache
def _initialise() -> None:
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()


def _machine(level: int) -> Any:
    import llvmlite.binding as llvm

    _initialise()
    target = llvm.Target.from_default_triple()
    return target.create_target_machine(cpu=llvm.get_host_cpu_name(), opt=level)


def print_loop(recorded: Recorded) -> str:
    """The loop as LLVM text."""
    used_inputs = sorted({int(i.value) for i in recorded.instructions if i.kind == "input"})
    lines = [
        "declare double @llvm.sqrt.f64(double)",
        "declare double @llvm.fabs.f64(double)",
        "define void @run(i64 %n, ptr noalias %carry, ptr noalias %inputs, ptr noalias %outputs) {",
        "entry:",
    ]
    for k in range(len(recorded.carry)):
        lines += [f"  %cp{k} = getelementptr double, ptr %carry, i64 {k}", f"  %c0_{k} = load double, ptr %cp{k}"]
    for k in used_inputs:
        lines += [f"  %ia{k} = getelementptr ptr, ptr %inputs, i64 {k}", f"  %ib{k} = load ptr, ptr %ia{k}"]
    for k in range(len(recorded.outputs)):
        lines += [f"  %oa{k} = getelementptr ptr, ptr %outputs, i64 {k}", f"  %ob{k} = load ptr, ptr %oa{k}"]
    lines += ["  %some = icmp sgt i64 %n, 0", "  br i1 %some, label %loop, label %end", "loop:"]
    lines.append("  %k = phi i64 [0, %entry], [%k1, %loop]")
    new = [_operand(recorded, i) for i in recorded.carry_results]
    for k, value in enumerate(new):
        lines.append(f"  %c{k} = phi double [%c0_{k}, %entry], [{value}, %loop]")
    for k in used_inputs:
        if recorded.inputs[k] in recorded.flags:
            lines += [
                f"  %if{k} = getelementptr i8, ptr %ib{k}, i64 %k", f"  %iv{k} = load i8, ptr %if{k}",
                f"  %i{k} = uitofp i8 %iv{k} to double",
            ]  # fmt: skip
        else:
            lines += [f"  %if{k} = getelementptr double, ptr %ib{k}, i64 %k", f"  %i{k} = load double, ptr %if{k}"]
    for number, instruction in enumerate(recorded.instructions):
        lines += _lines(recorded, number, instruction)
    for k, i in enumerate(recorded.output_results):
        lines += [
            f"  %of{k} = getelementptr double, ptr %ob{k}, i64 %k",
            f"  store double {_operand(recorded, i)}, ptr %of{k}",
        ]
    lines += ["  %k1 = add i64 %k, 1", "  %more = icmp slt i64 %k1, %n", "  br i1 %more, label %loop, label %write"]
    lines.append("write:")
    for k, value in enumerate(new):
        lines.append(f"  store double {value}, ptr %cp{k}")
    lines += ["  br label %end", "end:", "  ret void", "}"]
    return "\n".join(lines)


def _operand(recorded: Recorded, number: int) -> str:
    """How the result of an instruction is written where it is used."""
    instruction = recorded.instructions[number]
    if instruction.kind == "constant":
        return _constant(float(instruction.value))
    if instruction.kind == "carry":
        return f"%c{int(instruction.value)}"
    if instruction.kind == "input":
        return f"%i{int(instruction.value)}"
    return f"%t{number}"


def _constant(value: float) -> str:
    """A double by its bits, as LLVM reads it."""
    return f"0x{struct.unpack('<Q', struct.pack('<d', value))[0]:016X}"


def _lines(recorded: Recorded, number: int, instruction: Instruction) -> list[str]:
    """The lines of one instruction; its result is %t<number>."""
    kind = instruction.kind
    if kind in ("constant", "carry", "input"):
        return []
    x, *rest = [_operand(recorded, i) for i in instruction.operands]
    t, zero, one = f"%t{number}", _constant(0.0), _constant(1.0)

    def flag(condition: str) -> list[str]:
        return [f"  {t}b = {condition}", f"  {t} = select i1 {t}b, double {one}, double {zero}"]

    if kind in _BINARY:
        return [f"  {t} = {_BINARY[kind]} double {x}, {rest[0]}"]
    if kind in _COMPARE:
        return flag(f"fcmp {_COMPARE[kind]} double {x}, {rest[0]}")
    if kind == "where":  # rest[0] where x is not 0, else 0
        return [f"  {t}b = fcmp une double {x}, {zero}", f"  {t} = select i1 {t}b, double {rest[0]}, double {zero}"]
    if kind == "pick":  # adding 0 turns -0 to 0, as CasADi's own form of a selection does
        return [
            f"  {t}b = fcmp une double {x}, {zero}", f"  {t}s = select i1 {t}b, double {rest[0]}, double {rest[1]}",
            f"  {t} = fadd double {t}s, {zero}",
        ]  # fmt: skip
    if kind in ("and", "or"):
        first, second = (f"fcmp une double {v}, {zero}" for v in (x, rest[0]))
        return [f"  {t}x = {first}", f"  {t}y = {second}", *flag(f"{kind} i1 {t}x, {t}y")]
    return {
        "not": flag(f"fcmp oeq double {x}, {zero}"),
        "neg": [f"  {t} = fneg double {x}"],
        "square": [f"  {t} = fmul double {x}, {x}"],
        "twice": [f"  {t} = fadd double {x}, {x}"],
        "inverse": [f"  {t} = fdiv double {one}, {x}"],
        "sqrt": [f"  {t} = call double @llvm.sqrt.f64(double {x})"],
        "abs": [f"  {t} = call double @llvm.fabs.f64(double {x})"],
    }[kind]
