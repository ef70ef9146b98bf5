"""Linter, formatter, types and import rules are tests like any other."""

import subprocess
import sys
from pathlib import Path

import pytest

from conftest import LONG, ROOT

BIN = Path(sys.executable).parent
CHECKS = {
    "ruff check": [BIN / "ruff", "check", "."],
    "ruff format": [BIN / "ruff", "format", "--check", "."],
    # numpy's own types are written for the Python it was installed for.
    "mypy": [BIN / "mypy", "--python-version", f"{sys.version_info.major}.{sys.version_info.minor}"],
    "import-linter": [BIN / "lint-imports"],
}


@pytest.mark.parametrize("name", CHECKS)
def test_style(name):
    command = CHECKS[name]
    if not command[0].exists():
        pytest.skip(f"{command[0].name} is not installed")
    ran = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stdout + ran.stderr


def test_import_is_light():
    """`import codriver` loads numpy at most: no CasADi, scipy, plotly or CAN library."""
    program = (
        "import sys, codriver; heavy = {'casadi', 'scipy', 'plotly', 'can', 'cantools', 'asammdf', 'pyarrow', 'pandas', "
        "'llvmlite', 'pint', 'typer', 'rich'}; print(sorted(heavy & set(sys.modules)))"
    )
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert ran.stdout.strip() == "[]"


def test_help_is_light():
    """`codriver --help` loads no number-crunching library at all."""
    program = (
        "import sys; sys.argv = ['codriver', '--help']\nfrom codriver.cli import main\ntry: main()\nexcept SystemExit: pass\n"
        "heavy = {'casadi', 'scipy', 'plotly', 'can', 'cantools', 'asammdf', 'pyarrow', 'pandas', 'llvmlite', 'pint', 'numpy'}\n"
        "print(sorted(heavy & set(sys.modules)))"
    )
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert ran.stdout.strip().splitlines()[-1] == "[]"


def test_long_files_are_there():
    """Those that a run of several workers begins with (conftest) have not been renamed."""
    assert [name for name in LONG if not (ROOT / "tests" / f"{name}.py").exists()] == []
