"""Exported C: compiles without a warning, and answers as codriver does, on every compiler and target that is there."""

import itertools
import shutil
import subprocess
from dataclasses import replace

import pytest

import codriver as cd
import codriver.observers
from codriver.errors import UsageError
from codriver.export import export_c

ESTIMATORS = ["intent-pedals", "intent-torque", "kinematic", "pedals-only"]
TORQUE = [name for name, e in cd.observers.ESTIMATORS.items() if e.family == "driver-torque"]
CASES = [*itertools.product(ESTIMATORS, ["kalman", "constant"]), *((name, "kalman") for name in TORQUE)]
STRICT = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-ffp-contract=off"]
TARGETS = {
    "gcc": (["gcc"], []),
    "gcc with FMA": (["gcc", "-O3", "-march=haswell", "-fno-tree-slp-vectorize"], []),
    "clang": (["clang", "-O3"], []),
    "clang with FMA": (["clang", "-O3", "-march=haswell"], []),
    "Arm 64 bits": (["aarch64-linux-gnu-gcc", "-O2", "-static"], ["qemu-aarch64"]),
    "Arm 32 bits": (["arm-linux-gnueabihf-gcc", "-O2", "-static"], ["qemu-arm"]),
}


@pytest.fixture(scope="module")
def exported(tmp_path_factory, car):
    """Every estimator, form and number type."""
    root = tmp_path_factory.mktemp("c")
    steered = with_steering(car)
    for (name, form), real in itertools.product(CASES, ["double", "float"]):
        forbidden = cd.observers.ESTIMATORS[name].forbids
        kept = {key: value for key, value in steered.parameters.items() if key not in forbidden}
        vehicle = replace(steered, parameters=kept)
        export_c(cd.compile(cd.build(name, vehicle, form=form)), root / f"{name}-{form}-{real}", real)
    return root


def with_steering(car):
    """The car with a steering that has everything."""
    for name, value in {
        "steering_inertia": 0.04, "steering_damping": 0.5, "steering_friction": 0.2, "steering_end_stop": 8.0, "torque_scale": 1.9,
        "torque_offset": 0.2, "alignment_gain": 1.3, "alignment_whole": 1.0, "alignment_torque_sd": 0.3, "yaw_inertia": 2600.0,
        "wheelbase": 2.7, "front_axle_distance": 1.2, "front_cornering_stiffness": 9e4, "rear_cornering_stiffness": 1.1e5,
        "alignment_stiffness": 1000.0, "steering_ratio": 16.0,
    }.items():  # fmt: skip
        car = car.with_parameter(name, value, 0.05 * value)
    return car


@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("real", ["double", "float"])
@pytest.mark.parametrize(("name", "form"), CASES)
def test_golden_vectors(name, form, real, target, exported, tmp_path):
    """In double bit for bit, in float within the tolerance that the README states."""
    compiler, runner = TARGETS[target]
    for tool in (compiler[0], *runner):
        if shutil.which(tool) is None:
            pytest.skip(f"{tool} is not installed")
    if "haswell" in " ".join(compiler) and not _has_fma():
        pytest.skip("this machine has no FMA")
    folder, stem = exported / f"{name}-{form}-{real}", name.replace("-", "_")
    sources = [str(folder / f"{stem}.c"), str(folder / f"{stem}_check.c")]
    built = subprocess.run(
        [*compiler, *STRICT, *sources, "-o", tmp_path / "check", "-lm"], capture_output=True, text=True
    )
    assert built.returncode == 0, built.stderr
    ran = subprocess.run([*runner, str(tmp_path / "check")], capture_output=True, text=True)
    assert ran.returncode == 0, ran.stdout
    assert ran.stdout.startswith("ok: 400 rows")


def test_the_check_can_fail(exported, tmp_path):
    """A step that is off by one bit is found."""
    if shutil.which("gcc") is None:
        pytest.skip("gcc is not installed")
    folder = shutil.copytree(exported / "kinematic-kalman-double", tmp_path / "c")
    source = folder / "kinematic.c"
    text = source.read_text()
    assert "0.01 * s->x_acceleration" in text
    source.write_text(text.replace("0.01 * s->x_acceleration", "0.010000000000000002 * s->x_acceleration"))
    subprocess.run(["gcc", *STRICT, source, folder / "kinematic_check.c", "-o", tmp_path / "check", "-lm"], check=True)
    ran = subprocess.run([tmp_path / "check"], capture_output=True, text=True)
    assert ran.returncode == 1
    assert ran.stdout.strip().splitlines()[-1].startswith("FAILED")


def test_make_check(exported):
    """What the README says to type."""
    if shutil.which("make") is None or shutil.which("gcc") is None:
        pytest.skip("make and gcc are not installed")
    ran = subprocess.run(
        ["make", "-C", exported / "intent-pedals-kalman-double", "check", "CC=gcc"], capture_output=True, text=True
    )
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert "ok: 400 rows" in ran.stdout


def test_source_is_fit_for_a_control_unit(exported):
    """No heap, no recursion, no loops, no global state; only sqrt and fabs of the library."""
    for source in exported.glob("*/*.c"):
        if source.stem.endswith("_check"):
            continue
        text = source.read_text()
        assert not any(word in text for word in ("malloc", "while", "for (", "goto", "static real t", "printf"))
        assert text.count(f"{source.stem}_step(") == 1


def test_export_is_whole_or_nothing(tmp_path, car):
    program = cd.compile(cd.build("kinematic"))
    with pytest.raises(UsageError, match="'double' or 'float'"):
        export_c(program, tmp_path / "x", "half")
    assert not (tmp_path / "x").exists()
    (tmp_path / "file").write_text("mine")
    with pytest.raises(UsageError, match="cannot write"):
        export_c(program, tmp_path / "file")
    assert (tmp_path / "file").read_text() == "mine"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file"]
    export_c(program, tmp_path / "deep" / "folder")
    export_c(program, tmp_path / "deep" / "folder")  # again: files are replaced
    assert {p.name for p in (tmp_path / "deep" / "folder").iterdir()} == {
        "kinematic.c", "kinematic.h", "kinematic_check.c", "Makefile", "README.md",
    }  # fmt: skip
    assert sorted(p.name for p in (tmp_path / "deep").iterdir()) == ["folder"]


def test_export_as_a_whole_replaces_only_an_export(tmp_path, car):
    kinematic, pedals = cd.compile(cd.build("kinematic")), cd.compile(cd.build("pedals-only", car))
    folder = tmp_path / "firmware"
    folder.mkdir()
    (folder / "Makefile").write_text("mine")
    for header in (None, "/* mine */"):
        if header:
            (folder / "kinematic.h").write_text(header)
        with pytest.raises(UsageError, match="Makefile"):
            export_c(kinematic, folder)
        assert (folder / "Makefile").read_text() == "mine"
    assert sorted(p.name for p in folder.iterdir()) == ["Makefile", "kinematic.h"]
    own = tmp_path / "own"
    export_c(kinematic, own)
    (own / "main.c").write_text("mine")
    export_c(kinematic, own, "float")
    assert (own / "main.c").read_text() == "mine"
    with pytest.raises(UsageError, match="not written by an export of this estimator"):
        export_c(pedals, own)


def _has_fma() -> bool:
    from llvmlite import binding

    features = binding.get_host_cpu_features()
    return bool(features.get("fma")) and bool(features.get("avx2"))


def test_a_step_without_state(tmp_path):
    """Only outputs that need no memory: the state is not an empty struct, which C99 does not have."""
    if shutil.which("gcc") is None:
        pytest.skip("gcc is not installed")
    export_c(cd.compile(cd.build("kinematic"), ["direction"]), tmp_path / "c")
    sources = [tmp_path / "c" / "kinematic.c", tmp_path / "c" / "kinematic_check.c"]
    built = subprocess.run(["gcc", *STRICT, *sources, "-o", tmp_path / "check", "-lm"], capture_output=True, text=True)
    assert built.returncode == 0, built.stderr
    assert subprocess.run([tmp_path / "check"]).returncode == 0
