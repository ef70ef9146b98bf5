"""Elementary functions made of exact operations: right to two units in the last place, and the same bits everywhere."""

import ctypes
import itertools
import math
import shutil
import subprocess
import sys
from hashlib import sha256

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import codriver as cd
from codriver.export import export_c
from codriver.export.golden import golden_inputs
from codriver.kernel import record
from codriver.kernel.c99 import print_body
from codriver.kernel.coefficients import NUMBERS
from codriver.kernel.llvm import compile_loop
from codriver.kernel.lower import FUNCTIONS
from codriver.kernel.record import interpret
from codriver.testing import check_observer
from conftest import ROOT
from test_export import STRICT, TARGETS, _has_fma
from test_kernel import bits
from toy_column import DT, PLACES, START, Q, R, column_filter, every_function

pytest.importorskip("mpmath")
sys.path.insert(0, str(ROOT / "docs" / "measure"))
import elementary

BINARY = {"atan2", "fmin", "fmax", "fmod", "remainder", "hypot", "power", "copysign"}
TINY = 5e-324
CORNERS = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.5,
    1.5,
    -2.0,
    3.0,
    1e5,
    2e5,
    -1e300,
    1e-300,
    TINY,
    1.79e308,
    math.inf,
    -math.inf,
    math.nan,
]


def all_functions(carry, given_):
    """A step of every function on the same two arguments."""
    x, y = given_["x"], given_["y"]
    return {}, {f"{n}_": getattr(ca, n)(*((x, y) if n in BINARY else (x,))) for n in FUNCTIONS}


ALL = record("all_functions", all_functions, [], ["x", "y"])
COMPILED = compile_loop(ALL)


def machine(x: np.ndarray, y: np.ndarray) -> dict[str, np.ndarray]:
    """All functions by LLVM, over columns."""
    columns = [np.ascontiguousarray(x, float), np.ascontiguousarray(y, float)]
    outputs = [np.empty(len(columns[0])) for _ in ALL.outputs]
    given_ = (ctypes.c_void_p * 2)(*[c.ctypes.data for c in columns])
    made = (ctypes.c_void_p * len(outputs))(*[o.ctypes.data for o in outputs])
    COMPILED.run(len(columns[0]), 0, ctypes.addressof(given_), ctypes.addressof(made))
    return {n[:-1]: o for n, o in zip(ALL.outputs, outputs, strict=True)}


def value(name: str, x: float, y: float = 1.0) -> float:
    """One function of one or two numbers."""
    return float(machine(np.array([x]), np.array([y]))[name][0])


class TestAccuracy:
    @pytest.mark.parametrize("real", ["double", "float"])
    @pytest.mark.parametrize("name", elementary.SMOOTH)
    def test_two_units_in_the_last_place(self, name, real):
        """Against mpmath, on everyday arguments, over the domain, near zeros, and down to tiny numbers."""
        errors = elementary.worst(name, real, 250)
        assert len(errors) >= 2
        assert max(errors.values()) <= 2.0, errors

    @pytest.mark.slow
    @pytest.mark.parametrize("real", ["double", "float"])
    @pytest.mark.parametrize("name", elementary.SMOOTH)
    def test_on_many_points(self, name, real):
        assert max(elementary.worst(name, real, 10_000).values()) <= 2.0

    @pytest.mark.slow
    def test_the_numbers_are_the_scripts(self):
        """The polynomials and constants are those that docs/measure/elementary_fit.py finds."""
        script = ROOT / "docs" / "measure" / "elementary_fit.py"
        found: dict = {}
        exec(subprocess.run([sys.executable, script], capture_output=True, text=True, check=True).stdout, found)
        assert found["NUMBERS"] == NUMBERS

    @pytest.mark.parametrize("name", ["exp", "log", "sin", "atan", "tanh", "log1p", "expm1"])
    def test_subnormal_arguments_and_results(self, name):
        x = np.array([TINY, 3e-320, 2.2e-308, 1e-310]) if name != "exp" else np.array([-745.1, -740.0, -710.5, -708.4])
        got = machine(x, x)[name]
        assert np.all(got != 0)
        assert np.max(elementary.ulps(name, "double", got, x, x)) <= 2.0

    def test_the_measure_finds_an_error(self):
        """One that is two units off is found."""
        x = np.array([0.3, 1.2])
        off = np.nextafter(np.nextafter(np.nextafter(np.sin(x), 2), 2), 2)
        assert np.min(elementary.ulps("sin", "double", off, x, x)) > 2.0

    def test_monotone_where_formulas_meet(self):
        """Around every breakpoint (quadrants, atan's centres, 1/2 of asin, powers of two) neighbours stay in order."""
        places = {"atan": [7 / 16, 11 / 16, 19 / 16, 39 / 16], "asin": [0.5], "exp": [0.3465735902799726, 1.0397207708399179],
                  "log": [1.0, math.sqrt(2), 2.0, 1024.0], "tanh": [0.17328679513998632, 0.5198603854199589]}  # fmt: skip
        for name, points in places.items():
            for point in points:
                x = point + np.arange(-50, 51) * 1e-12 * point
                assert np.all(np.diff(machine(x, x)[name]) >= 0), (name, point)


class TestExactOnes:
    """Whole numbers, signs, extremes and remainders have no error at all."""

    def check(self, x, y):
        got = machine(np.array([x]), np.array([y]))
        # -0 is written as 0: adding 0 makes it so.
        wanted = {"floor": np.floor(x), "ceil": np.ceil(x), "sign": np.sign(x), "fmin": np.fmin(x, y), "fmax": np.fmax(x, y),
                  "copysign": math.copysign(x, y or 1.0)}  # fmt: skip
        for name, true in wanted.items():
            assert bits([got[name][0]]) == bits([float(true) + 0.0]), (name, x, y)

    @given(x=st.floats(allow_nan=False), y=st.floats(allow_nan=False))
    @settings(max_examples=150, deadline=None)
    def test_any_numbers(self, x, y):
        self.check(x, y)

    @given(n=st.integers(-(2**54), 2**54), half=st.sampled_from([0.0, 0.5, -0.5, 0.25]))
    @settings(max_examples=150, deadline=None)
    def test_near_whole_numbers(self, n, half):
        self.check(n + half, 1.0)

    @given(x=st.floats(-1e6, 1e6), y=st.floats(1e-2, 1e6), n=st.integers(0, 200), k=st.integers(-3, 3))
    @settings(max_examples=400, deadline=None)
    def test_remainders(self, x, y, n, k):
        """Also for x a few last places off a whole or half multiple of y, where the quotient is rounded the wrong way."""
        for over in (x, math.ulp(0.5 * n * y) * k + 0.5 * n * y):
            if abs(over / y) >= 2**25:
                continue
            got = machine(np.array([over]), np.array([y]))
            assert got["fmod"][0] == math.fmod(over, y), (over, y)
            assert got["remainder"][0] == math.remainder(over, y), (over, y)
            assert machine(np.array([over]), np.array([-y]))["fmod"][0] == math.fmod(over, y)

    def test_significands_full_of_ones(self):
        """y just below a power of two, where x less the high half of y needs a bit more than there is."""
        y = 2.0**53 - np.arange(1.0, 40.0)
        for x in [y / 2, np.nextafter(y / 2, 0), np.nextafter(y / 2, 1e300), 2 * y - 1, 1.5 * y, np.nextafter(y, 0)]:
            got = machine(x, y)
            np.testing.assert_array_equal(got["fmod"], [math.fmod(a, b) for a, b in zip(x, y, strict=True)])
            np.testing.assert_array_equal(got["remainder"], [math.remainder(a, b) for a, b in zip(x, y, strict=True)])

    def test_remainders_out_of_reach_are_nan(self):
        assert math.isnan(value("fmod", 2.0**26, 1.0))
        assert math.isnan(value("remainder", 2.0**26, 1.0))
        assert math.isnan(value("fmod", 1.0, 0.0))
        assert math.isnan(value("remainder", math.inf, 1.0))
        assert value("fmod", 3.0, math.inf) == 3.0
        assert value("remainder", 3.0, math.inf) == 3.0

    def test_in_float_too(self):
        rng = np.random.default_rng(1)
        x = rng.uniform(-500, 500, 3000).astype(np.float32)
        y = rng.uniform(0.5, 300, 3000).astype(np.float32)
        for name, true in {"floor": np.floor(x), "ceil": np.ceil(x), "fmod": np.fmod(x, y)}.items():
            f = getattr(ca, name)
            step = record("f", lambda c, u, f=f, n=name: ({}, {"v": f(u["x"], u["y"]) if n in BINARY else f(u["x"])}), [],
                          ["x", "y"])  # fmt: skip
            np.testing.assert_array_equal(elementary.evaluate(step, "float", x, y), true, err_msg=name)


class TestSpecialValues:
    """C99's annex F, but for the sign of zero: a zero has none."""

    @pytest.mark.parametrize(
        ("name", "x", "wanted"),
        [
            ("exp", math.inf, math.inf), ("exp", -math.inf, 0.0), ("exp", 710.0, math.inf), ("exp", -746.0, 0.0),
            ("exp", 0.0, 1.0), ("exp", -0.0, 1.0), ("expm1", -math.inf, -1.0), ("expm1", math.inf, math.inf),
            ("expm1", 0.0, 0.0), ("log", 0.0, -math.inf), ("log", -0.0, -math.inf), ("log", -1.0, math.nan),
            ("log", math.inf, math.inf), ("log", 1.0, 0.0), ("log", -math.inf, math.nan), ("log1p", -1.0, -math.inf),
            ("log1p", -2.0, math.nan), ("log1p", math.inf, math.inf), ("log1p", 0.0, 0.0), ("tanh", math.inf, 1.0),
            ("tanh", -math.inf, -1.0), ("tanh", 19.1, 1.0), ("tanh", 0.0, 0.0), ("sinh", math.inf, math.inf),
            ("sinh", -711.0, -math.inf), ("cosh", -math.inf, math.inf), ("cosh", 0.0, 1.0), ("sin", 0.0, 0.0),
            ("cos", 0.0, 1.0), ("tan", 0.0, 0.0), ("sin", math.inf, math.nan), ("cos", -math.inf, math.nan),
            ("sin", 100001.0, math.nan), ("tan", -100001.0, math.nan), ("asin", 1.0, math.pi / 2),
            ("asin", -1.0, -math.pi / 2), ("asin", 1.0000000000000002, math.nan), ("acos", 1.0, 0.0),
            ("acos", -1.0, math.pi), ("acos", 0.0, math.pi / 2), ("acos", -1.1, math.nan), ("atan", math.inf, math.pi / 2),
            ("atan", -math.inf, -math.pi / 2), ("floor", math.inf, math.inf), ("ceil", -math.inf, -math.inf),
            ("sign", -math.inf, -1.0), ("sign", 0.0, 0.0),
        ],
    )  # fmt: skip
    def test_of_one(self, name, x, wanted):
        assert bits([value(name, x)]) == bits([wanted])

    @pytest.mark.parametrize(
        ("y", "x", "wanted"),
        [
            (0.0, 1.0, 0.0), (0.0, -1.0, math.pi), (-0.0, -1.0, math.pi), (0.0, 0.0, 0.0), (0.0, -0.0, 0.0),
            (1.0, 0.0, math.pi / 2), (-1.0, -0.0, -math.pi / 2), (1.0, math.inf, 0.0), (1.0, -math.inf, math.pi),
            (-1.0, -math.inf, -math.pi), (math.inf, 3.0, math.pi / 2), (math.inf, math.inf, math.pi / 4),
            (-math.inf, -math.inf, -3 * math.pi / 4), (1e300, 1e-300, math.pi / 2), (1e-300, 1e300, 0.0),
            (TINY, -TINY, 3 * math.pi / 4), (math.nan, 1.0, math.nan), (1.0, math.nan, math.nan),
            (0.0, math.nan, math.nan), (math.inf, math.nan, math.nan),
        ],
    )  # fmt: skip
    def test_atan2(self, y, x, wanted):
        assert bits([value("atan2", y, x)]) == bits([wanted])

    def test_power_as_in_c(self):
        """Every pair of corners, against Python's pow, which is C's."""
        exponents = [
            *(s * v for v in (1.0, 2.0, 3.0, 0.5, 1e10, 1e300, math.inf) for s in (1, -1)),
            0.0,
            math.nan,
            1e-300,
        ]
        for x, y in itertools.product(CORNERS, exponents):
            try:
                wanted = math.pow(abs(x) if x == 0 else x, y)  # a zero has no sign
            except OverflowError:
                wanted = -math.inf if x < 0 and y % 2 == 1 else math.inf
            except ValueError:
                wanted = math.inf if x == 0 else math.nan
            if x == -math.inf and not math.isinf(y) and y % 1.0:
                wanted = math.nan  # as for any other negative number; C has infinity or 0
            step = record("f", lambda c, u, y=y: ({}, {"v": ca.power(u["x"], y)}), [], ["x"])
            for got in (value("power", x, y), interpret(step, {}, {"x": x})[1][0]):
                got = abs(got) if x == 0 else got  # CasADi makes 1/x of a power -1, which sees the sign of zero
                near = got == wanted or abs(got - wanted) <= 2 * math.ulp(wanted) or (got != got and wanted != wanted)
                assert near, (x, y, got, wanted)

    @pytest.mark.parametrize("name", sorted(set(FUNCTIONS) - {"fmin", "fmax", "copysign", "power"}))
    def test_nan_stays_nan(self, name):
        assert math.isnan(value(name, math.nan, 1.0))

    def test_hypot(self):
        assert value("hypot", 3.0, -4.0) == 5.0
        assert value("hypot", 3e300, 4e300) == 5e300
        assert value("hypot", TINY, 0.0) == TINY
        assert value("hypot", -math.inf, math.nan) == math.inf
        assert value("hypot", 1.7e308, 1.7e308) == math.inf

    def test_float_has_its_own_domain(self):
        step = elementary.recorded("sin")
        x = np.array([4999.0, 5001.0], np.float32)
        got = elementary.evaluate(step, "float", x, x)
        assert abs(float(got[0]) - math.sin(4999.0)) < 1e-7
        assert math.isnan(got[1])


class TestSameBits:
    def test_corners(self):
        """LLVM and CasADi's interpreter, each pair of corners, every function."""
        x, y = np.array(list(itertools.product(CORNERS, CORNERS))).T
        got = machine(x, y)
        for k in range(len(x)):
            wanted = interpret(ALL, {}, {"x": float(x[k]), "y": float(y[k])})[1]
            assert bits([float(column[k]) for column in got.values()]) == bits(wanted), (x[k], y[k])

    @given(x=st.floats(), y=st.floats())
    @settings(max_examples=150, deadline=None)
    def test_any_numbers(self, x, y):
        wanted = interpret(ALL, {}, {"x": x, "y": y})[1]
        assert bits([float(v[0]) for v in machine(np.array([x]), np.array([y])).values()]) == bits(wanted)

    def test_numpy_is_a_third_opinion(self):
        """The list of operations done one by one by numpy, in 64 bits."""
        rng = np.random.default_rng(2)
        x, y = rng.normal(0, 3, 500), rng.normal(0, 3, 500)
        got = machine(x, y)
        for name in ("sin", "tanh", "log1p", "power", "remainder", "atan2"):
            f = getattr(ca, name)
            step = record("f", lambda c, u, f=f, n=name: ({}, {"v": f(u["x"], u["y"]) if n in BINARY else f(u["x"])}), [],
                          ["x", "y"])  # fmt: skip
            np.testing.assert_array_equal(elementary.evaluate(step, "double", x, y), got[name])

    @pytest.mark.parametrize("observer", [column_filter(), every_function()], ids=lambda o: o.name)
    def test_batch_live_and_interpreter(self, observer):
        known = {"every-function": "no standard names"}
        if observer.name in known:
            program = cd.compile(observer)
            grid = golden_inputs(program)
            batch, stepper, carry = program.run_grid(grid), program.live(), dict(observer.carry)
            for k in range(len(grid)):
                row = [float(grid.values[c][k]) for c in observer.channels]
                row += [bool(column[k]) for column in observer.flag_columns(grid)]
                new, out = interpret(program.recorded, carry, dict(zip(program.recorded.inputs, row, strict=True)))
                carry = dict(zip(program.recorded.carry, new, strict=True))
                assert bits(stepper(row)) == bits(out) == bits(float(batch[n][k]) for n in program.recorded.outputs)
        else:
            check_observer(observer)


class TestExported:
    @pytest.mark.parametrize("target", TARGETS)
    @pytest.mark.parametrize(
        ("observer", "real"),
        [(column_filter(), "double"), (column_filter(), "float"), (every_function(), "double")],
        ids=lambda v: getattr(v, "name", v),
    )
    def test_golden_vectors(self, observer, real, target, tmp_path):
        compiler, runner = TARGETS[target]
        for tool in (compiler[0], *runner):
            if shutil.which(tool) is None:
                pytest.skip(f"{tool} is not installed")
        if "haswell" in " ".join(compiler) and not _has_fma():
            pytest.skip("this machine has no FMA")
        export_c(cd.compile(observer), tmp_path, real)
        stem = observer.name.replace("-", "_")
        source = (tmp_path / f"{stem}.c").read_text()
        assert not any(f" {word}(" in source for word in ("sin", "exp", "tanh", "pow", "floor", "fmod"))
        sources = [tmp_path / f"{stem}.c", tmp_path / f"{stem}_check.c"]
        built = subprocess.run(
            [*compiler, *STRICT, *sources, "-o", tmp_path / "check", "-lm"], capture_output=True, text=True
        )
        assert built.returncode == 0, built.stderr
        ran = subprocess.run([*runner, str(tmp_path / "check")], capture_output=True, text=True)
        assert ran.returncode == 0, ran.stdout
        assert ran.stdout.startswith("ok: 400 rows")

    @pytest.mark.parametrize("real", ["double", "float"])
    def test_c_on_corners(self, real, tmp_path):
        """Every function on every pair of corners, bit for bit with numpy's operations one by one; in float too."""
        if shutil.which("gcc") is None:
            pytest.skip("gcc is not installed")
        x, y = np.array(list(itertools.product(CORNERS, CORNERS))).T
        if real == "float":
            with np.errstate(over="ignore"):
                x, y = x.astype(np.float32).astype(float), y.astype(np.float32).astype(float)
        lowered = ALL.printed_in(real)
        body = "\n".join(print_body(lowered, real).lines)
        text = ", ".join
        numbers = [text(elementary_number(v) for v in column) for column in (x, y)]
        source = tmp_path / "f.c"
        source.write_text(
            f"#include <math.h>\n#include <stdbool.h>\n#include <stdio.h>\ntypedef {real} real;\n"
            "static real pick(bool c, real yes, real no) { return (c ? yes : no) + 0; }\n"
            "static real square(real x) { return x * x; }\nstruct input { real x, y; };\n"
            f"struct output {{ real {', '.join(ALL.outputs)}; }};\n"
            f"static void step(const struct input *in, struct output *out) {{ (void)square;\n{body}\n}}\n"
            f"static const double xs[] = {{ {numbers[0]} }}, ys[] = {{ {numbers[1]} }};\n"
            f"int main(void) {{ for (int k = 0; k < {len(x)}; ++k) {{ struct input in = {{ (real)xs[k], (real)ys[k] }};"
            "struct output out; step(&in, &out); const real *v = (const real *)&out;"
            f'for (int i = 0; i < {len(ALL.outputs)}; ++i) printf("%a\\n", (double)v[i]); }} return 0; }}\n'
        )
        subprocess.run(["gcc", "-std=c99", "-O2", "-ffp-contract=off", source, "-o", tmp_path / "f", "-lm"], check=True)
        said = subprocess.run([tmp_path / "f"], capture_output=True, text=True, check=True).stdout.split()
        got = np.array([float.fromhex(v) for v in said]).reshape(len(x), -1)
        for k, name in enumerate(ALL.outputs):
            one = record("f", lambda c, u, n=name: ({}, {"v": all_functions(c, u)[1][n]}), [], ["x", "y"])
            wanted = elementary.evaluate(one, real, x, y).astype(float)
            assert bits(got[:, k].tolist()) == bits(wanted.tolist()), name

    def test_results_that_are_no_numbers(self, tmp_path):
        """Golden vectors may hold NaN and infinity."""
        if shutil.which("gcc") is None:
            pytest.skip("gcc is not installed")

        def step(carry, u, y, ok, rho):
            return {}, {"roll_angle": ca.log(u["yaw_rate"]), "steer_angle": 1.0 / ca.floor(0.3 * u["yaw_rate"])}

        outputs = (
            cd.observers.Output("roll_angle", "rad", "estimate"),
            cd.observers.Output("steer_angle", "rad", "estimate"),
        )
        for real in ("double", "float"):
            export_c(cd.compile(cd.Observer("odd", DT, ("yaw_rate",), (), {}, outputs, step)), tmp_path, real)
            golden = (tmp_path / "odd_check.c").read_text()
            assert "NAN" in golden
            assert "INFINITY" in golden
            built = ["gcc", *STRICT, tmp_path / "odd.c", tmp_path / "odd_check.c", "-o", tmp_path / "check", "-lm"]
            subprocess.run(built, check=True)
            assert subprocess.run([tmp_path / "check"]).returncode == 0


def elementary_number(v: float) -> str:
    """A number as C reads it."""
    return "NAN" if v != v else "INFINITY" if v == math.inf else "-INFINITY" if v == -math.inf else v.hex()


class TestFilter:
    def test_is_the_extended_kalman_filter(self):
        """The recorded filter, with CasADi's derivative, against one in numpy with the derivative by hand."""
        import toy_column as toy

        program = cd.compile(column_filter())
        t = np.arange(500) * DT
        angle = 0.6 * np.sin(2.0 * t)
        ok = np.arange(500) % 3 != 1
        x, p = np.zeros(3), 1e-3 * np.eye(3)
        stepper = program.live()
        for k in range(500):
            th, w, torque = x
            f = np.array([th + DT * w, w + DT * (torque - toy.B * w - toy.F * math.tanh(w / toy.W0) - toy.K * math.sin(th)) / toy.J,
                          torque])  # fmt: skip
            slope = -toy.B - toy.F / toy.W0 / math.cosh(w / toy.W0) ** 2
            a = np.array(
                [[1, DT, 0], [-DT * toy.K * math.cos(th) / toy.J, 1 + DT * slope / toy.J, DT / toy.J], [0, 0, 1]]
            )
            p = a @ p @ a.T + Q
            x = f
            if ok[k]:
                gain = p[:, 0] / (p[0, 0] + R)
                x, p = x + gain * (angle[k] - x[0]), p - np.outer(gain, p[0])
            got = dict(
                zip(stepper.outputs, stepper([float(angle[k]) if ok[k] else math.nan, bool(ok[k])]), strict=True)
            )
            assert got["driver_torque"] == pytest.approx(x[2], rel=1e-9, abs=1e-9)
            assert got["driver_torque_sd"] == pytest.approx(math.sqrt(p[2, 2]), rel=1e-9)
        assert abs(x[2]) > 0.1
        assert len(PLACES) + len(START) == len(program.recorded.carry)

    def test_same_bits_whether_derived_or_not(self):
        """The derivative of sin, taken before recording, is the lowered cos."""
        x = ca.SX.sym("x")
        slope = ca.Function("slope", [x], [ca.jacobian(ca.sin(x) * ca.tanh(x), x)])
        by_hand = lambda v: ca.tanh(v) * ca.cos(v) + ca.sin(v) * (1 - ca.tanh(v) ** 2)  # noqa: E731
        step = record("f", lambda c, u: ({}, {"a": slope(u["x"]), "b": by_hand(u["x"])}), [], ["x"])
        for v in (-2.0, 0.3, 1.9):
            a, b = interpret(step, {}, {"x": v})[1]
            assert a == pytest.approx(b, rel=1e-14)
            assert a == pytest.approx(math.tanh(v) * math.cos(v) + math.sin(v) / math.cosh(v) ** 2, rel=1e-14)


class TestLowering:
    def test_only_exact_operations_are_left(self):
        exact = {"add", "sub", "mul", "div", "neg", "sqrt", "square", "twice", "inverse", "abs", "lt", "le", "eq", "ne", "not",
                 "and", "or", "where", "pick", "constant", "input", "carry"}  # fmt: skip
        for real in ("double", "float"):
            assert {i.kind for i in ALL.printed_in(real).instructions} <= exact
        assert {i.kind for i in ALL.written} >= set(FUNCTIONS)

    def test_functions_of_one_argument_share(self):
        def count(*names):
            return record("f", lambda c, u: ({}, {n: getattr(ca, n)(u["x"]) for n in names}), [], ["x"]).operations()

        assert count("sin", "cos") <= count("sin") + 15
        assert count("sinh", "cosh") <= count("sinh") + 15
        assert count("asin", "acos") <= count("asin") + 20

    @pytest.mark.parametrize(
        ("name", "most"),
        [("sin", 85), ("tan", 95), ("exp", 90), ("log", 100), ("tanh", 80), ("atan2", 80), ("power", 360)],
    )
    def test_cost_is_counted(self, name, most):
        step = elementary.recorded(name)
        assert step.printed_in("float").operations() < step.operations() <= most

    def test_compile_time_stays_small(self):
        """Forty different sines: compiled with optimisation, and the number of operations grows in proportion."""
        step = record("many", lambda c, u: ({}, {f"y{k}": ca.sin(u["x"] + 0.1 * k) for k in range(40)}), [], ["x"])
        assert step.operations() <= 40 * 85
        compile_loop(step)

    @pytest.mark.parametrize(
        ("name", "form", "digest"),
        [
            ("intent-pedals", "kalman", "66b1fa8f09929666"),
            ("intent-pedals", "constant", "696e5f8a6d0bc022"),
            ("intent-torque", "kalman", "f20b4dbea6b4a13f"),
            ("intent-torque", "constant", "4cd9806f4b13e9cc"),
            ("kinematic", "kalman", "44e89d4e3624a694"),
            ("kinematic", "constant", "6a862ea2d45cb28e"),
            ("pedals-only", "kalman", "1e370556c553f610"),
        ],
    )
    def test_exact_steps_are_recorded_as_before(self, name, form, digest, car):
        """The operations of the longitudinal estimators, constants left out: those depend on LAPACK's last digits."""
        step = cd.build(name, car, form=form).record()
        structure = repr((step.carry, step.inputs, step.outputs, [(i.kind, i.operands) for i in step.instructions]))
        assert sha256(structure.encode()).hexdigest()[:16] == digest
        assert step.printed_in("float").instructions == step.instructions == step.written
