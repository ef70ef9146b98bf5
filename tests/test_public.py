"""The public names: each is there, and type checkers see the same ones."""

import re
from pathlib import Path

import pytest

import codriver as cd


@pytest.mark.parametrize("name", cd.__all__)
def test_each_is_there(name):
    assert getattr(cd, name) is not None
    assert name in dir(cd)


def test_type_checkers_see_the_same():
    text = Path(cd.__file__).read_text(encoding="utf-8")
    told = {name: module for module, name in re.findall(r"from codriver\.([\w.]+) import (\w+) as", text)}
    assert told == cd._HOME


def test_a_name_that_is_not_there():
    with pytest.raises(AttributeError, match="no attribute 'fast'"):
        _ = cd.fast
