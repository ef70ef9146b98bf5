"""Options that contradict each other or themselves are refused, not silently passed over."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from codriver.cli.app import app
from codriver.cli.identify_driver import parse_known
from codriver.cli.simulate_circuit import hard_bends
from codriver.cli.simulate_shared import _far_ahead
from codriver.errors import UsageError


@pytest.mark.parametrize("text", ["K_p=4, K_p=5", "K_p=4, K_p=4"])
def test_a_parameter_told_twice(text: str) -> None:
    with pytest.raises(UsageError, match="K_p twice"):
        parse_known(text)


def test_a_model_that_no_assist_would_use(tmp_path: Path) -> None:
    words = ["simulate", "shared", "-o", str(tmp_path / "out"), "--assist", "path", "--model", "anna.driver"]
    done = CliRunner().invoke(app, words)
    assert isinstance(done.exception, UsageError)
    assert "--model with --assist path" in str(done.exception)


def test_a_model_that_foretells_far_ahead_is_told() -> None:
    assert _far_ahead(0.2) == _far_ahead(0.3) == []
    (found,) = _far_ahead(0.5)
    assert found.severity == "warn"
    assert "0.5 s ahead" in found.text


def test_bends_too_fast_for_linear_tyres_are_told() -> None:
    bends = np.array([0.0, 0.01, -0.03])
    assert hard_bends(50 / 3.6, bends) == []
    (found,) = hard_bends(20.0, bends)
    assert found.severity == "warn"
    assert "12.0 m/s2" in found.text
