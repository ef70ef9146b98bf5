"""The benchmarks still run."""

import subprocess
import sys

import pytest

from conftest import ROOT


@pytest.mark.parametrize("name", ["kernel", "steering", pytest.param("motorcycle", marks=pytest.mark.slow)])
def test_quick_run(name):
    """Some of them measure; nothing is written."""
    if name != "kernel":
        pytest.importorskip("filterpy")
    if name == "motorcycle":
        pytest.importorskip("cvxpy")
    results = ROOT / "benchmarks" / "RESULTS.md"
    before = results.read_bytes() if results.exists() else b""
    command = [sys.executable, ROOT / "benchmarks" / "run.py", "--quick", "--only", name]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("| what | ours | alternative |")
    assert len(done.stdout.splitlines()) > 2
    assert (results.read_bytes() if results.exists() else b"") == before
