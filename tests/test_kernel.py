"""One step, three printers: CasADi's interpreter, machine code and C give the same bits."""

import ctypes
import math
import shutil
import subprocess

import casadi
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import codriver as cd
from codriver.errors import KernelError
from codriver.kernel import both, either, minimum, negate, record, select, sqrt
from codriver.kernel.c99 import print_body
from codriver.kernel.llvm import compile_loop, print_loop
from codriver.kernel.record import interpret

ESTIMATORS = ["intent-pedals", "intent-torque", "kinematic", "pedals-only"]


def everything(carry, given_):
    """A step that uses every operation the kernel carries."""
    a, b, flag, s = given_["a"], given_["b"], given_["flag"], carry["s"]
    out = {
        "sum": a + b, "difference": a - b, "product": a * b, "quotient": a / b, "negative": -a, "inverse": 1 / b,
        "square": a * a, "twice": 2 * a, "root": sqrt(a * a + 1), "less": a < b, "at_most": a <= b, "more": a > b,
        "equal": a == b, "unequal": a != b, "picked": select(flag, a, b), "kept": select(a < b, a, 0.0),
        "smaller": minimum(a, b), "and_": both(flag, a < b), "or_": either(flag, a < b), "not_": negate(flag),
        "nested": select(both(flag, b > 0), select(a < 0, -a, a), s), "constant": 0.0, "third": a / 3.0,
    }  # fmt: skip
    return {"s": select(flag, 0.9 * s + a, s)}, out


def run_machine(recorded, carry, a, b, flag):
    """One step of the compiled loop."""
    compiled = compile_loop(recorded)
    state = np.array([carry])
    columns = [np.array([float(a)]), np.array([float(b)]), np.array([bool(flag)])]
    outputs = [np.empty(1) for _ in recorded.outputs]
    given_ = (ctypes.c_void_p * 3)(*[c.ctypes.data for c in columns])
    made = (ctypes.c_void_p * len(outputs))(*[o.ctypes.data for o in outputs])
    compiled.run(1, state.ctypes.data, ctypes.addressof(given_), ctypes.addressof(made))
    return [float(state[0])], [float(o[0]) for o in outputs]


RECORDED = record("everything", everything, ["s"], ["a", "b", "flag"], ["flag"])
numbers = st.one_of(
    st.floats(allow_nan=True, allow_infinity=True, allow_subnormal=False), st.sampled_from([0.0, -0.0, 1.0])
)


def bits(values):
    """Bit patterns; every NaN counts as one, since IEEE leaves its sign and payload open."""
    return ["nan" if math.isnan(v) else v.hex() for v in values]


@given(a=numbers, b=numbers, s=st.floats(-10, 10), flag=st.booleans())
@settings(max_examples=150, deadline=None)
def test_machine_code_equals_interpreter(a, b, s, flag):
    """Every operation, on NaN, infinities and signed zeros too."""
    wanted = interpret(RECORDED, {"s": s}, {"a": a, "b": b, "flag": float(flag)})
    found = run_machine(RECORDED, s, a, b, flag)
    assert bits(found[0]) == bits(wanted[0])
    assert dict(zip(RECORDED.outputs, bits(found[1]), strict=True)) == dict(
        zip(RECORDED.outputs, bits(wanted[1]), strict=True)
    )


def test_step_on_floats():
    """The same step on plain floats."""
    carry, out = everything({"s": 2.0}, {"a": 3.0, "b": -0.5, "flag": 1.0})
    wanted = interpret(RECORDED, {"s": 2.0}, {"a": 3.0, "b": -0.5, "flag": 1.0})
    assert [float(v) for v in out.values()] == wanted[1]
    assert float(carry["s"]) == wanted[0][0]


@pytest.mark.parametrize("bad", [casadi.erf, casadi.asinh, casadi.erfinv])
def test_inexact_operations_are_refused(bad):
    with pytest.raises(KernelError, match=f"operation {bad.__name__}\n.*exact or made of exact ones"):
        record("bad", lambda c, u: ({}, {"y": bad(u["x"])}), [], ["x"])


def test_step_must_return_its_carry():
    with pytest.raises(KernelError, match="returns the carry"):
        record("bad", lambda c, u: ({}, {"y": u["x"]}), ["s"], ["x"])


def test_selection_never_looks_at_the_branch_not_taken():
    """0 * NaN would be NaN: the selection must not multiply."""
    recorded = record("guard", lambda c, u: ({}, {"y": select(u["ok"], u["x"], 7.0)}), [], ["x", "ok"], ["ok"])
    assert interpret(recorded, {}, {"x": math.nan, "ok": 0.0})[1] == [7.0]
    assert "fmul" not in print_loop(recorded)


@pytest.mark.parametrize("form", ["kalman", "constant"])
@pytest.mark.parametrize("name", ESTIMATORS)
def test_cost_is_counted(name, form, car):
    """Operations of one step: what a control unit pays. A change here is a change of cost."""
    bound = {"kalman": 420, "constant": 245}[form]
    assert cd.build(name, car, form=form).record().operations() <= bound


@pytest.mark.parametrize("form", ["kalman", "constant"])
@pytest.mark.parametrize("name", ESTIMATORS)
def test_observers_agree_bit_for_bit(name, form, car):
    """Batch = live = CasADi's interpreter over a drive with everything in it, missing rows included."""
    from codriver.export.golden import golden_inputs

    program = cd.compile(cd.build(name, car, form=form))
    grid = golden_inputs(program)
    batch = program.run_grid(grid)
    stepper = program.live()
    channels = program.observer.channels
    carry = dict(program.observer.carry)
    for k in range(len(grid)):
        values = [float(grid.values[c][k]) for c in channels]
        ok = [bool(column[k]) for column in program.observer.flag_columns(grid)]
        live = stepper([*values, *ok])
        new, out = interpret(
            program.recorded, carry, dict(zip(program.recorded.inputs, [*values, *map(float, ok)], strict=True))
        )
        carry = dict(zip(program.recorded.carry, new, strict=True))
        row = [float(batch[o][k]) for o in program.recorded.outputs]
        assert bits(live) == bits(row) == bits(out), k
    assert bits(stepper.carry.values()) == bits(carry.values())


def test_fewer_outputs_are_the_same_numbers(car, demo):
    observer = cd.build("intent-pedals", car)
    whole = cd.compile(observer).run(demo.measured)
    part = cd.compile(observer, ["intentional_jerk"]).run(demo.measured)
    assert list(part) == ["intentional_jerk"]
    np.testing.assert_array_equal(part.columns["intentional_jerk"], whole.columns["intentional_jerk"])


def test_c_reads_the_old_state_before_it_writes_the_new(tmp_path):
    """A swap: each new value needs the other's old one."""
    swap = record("swap", lambda c, u: ({"a": c["b"], "b": c["a"] + u["x"]}, {"y": c["a"]}), ["a", "b"], ["x"])
    body = print_body(swap)
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler")
    source = tmp_path / "swap.c"
    source.write_text(
        "#include <stdbool.h>\n#include <stdio.h>\ntypedef double real;\n"
        "int main(void) { struct { real a, b; } state = {1, 2}, *s = &state; struct { real x; } input = {10}, *in = &input;\n"
        "struct { real y; } output, *out = &output;\n"
        + "\n".join(body.lines)
        + '\nprintf("%g %g %g", s->a, s->b, out->y); return 0; }\n'
    )
    subprocess.run([compiler, "-std=c99", str(source), "-o", str(tmp_path / "swap")], check=True)
    assert subprocess.run([tmp_path / "swap"], capture_output=True, text=True, check=True).stdout == "2 11 1"


def test_long_steps_compile_quickly():
    """A step of 20,000 operations is compiled without optimising, and has the interpreter's bits."""

    def long(carry, given_):
        x = given_["x"]
        for k in range(10_000):
            x = x * (1.0 + 1e-6 * k) + 0.5
        return {}, {"y": x}

    recorded = record("long", long, [], ["x"])
    assert recorded.operations() > 12_000
    compiled = compile_loop(recorded)
    columns, outputs = [np.array([0.3])], [np.empty(1)]
    given_ = (ctypes.c_void_p * 1)(columns[0].ctypes.data)
    made = (ctypes.c_void_p * 1)(outputs[0].ctypes.data)
    compiled.run(1, 0, ctypes.addressof(given_), ctypes.addressof(made))
    assert bits(outputs[0].tolist()) == bits(interpret(recorded, {}, {"x": 0.3})[1])


def test_compiled_lately_is_not_compiled_again():
    first = compile_loop(RECORDED)
    assert compile_loop(RECORDED) is first
    anew = compile_loop(RECORDED, anew=True)
    assert anew is not first
    assert anew.text == first.text
    one, two = (record("same", lambda c, u, n=n: ({}, {"y": n * u["x"]}), [], ["x"]) for n in (2.5, 3.5))
    assert compile_loop(one) is not compile_loop(two)
