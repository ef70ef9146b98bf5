"""The pages: their tables are the code's, their links lead somewhere, their examples run."""

from __future__ import annotations

import re
import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PAGES = sorted((ROOT / "docs").glob("*.md"))
LINKED = [page for page in (ROOT / "README.md", *PAGES) if page.exists()]


def without_code(text: str) -> str:
    """The text of a page without fenced blocks."""
    return re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE)


def anchors(page: Path) -> set[str]:
    """What headings can be linked to by: lower case, without marks, blanks as hyphens."""
    headings = re.findall(r"^#+ (.+)$", without_code(page.read_text(encoding="utf-8")), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def examples() -> list:
    """The blocks marked python."""
    return [
        pytest.param(block, id=f"{page.stem}-{number}")
        for page in PAGES
        for number, block in enumerate(
            re.findall(r"^```python\n(.*?)^```", page.read_text("utf-8"), re.DOTALL | re.MULTILINE)
        )
    ]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_tables_are_up_to_date(page):
    filled = runpy.run_path(str(ROOT / "docs" / "make_names.py"))["filled"]
    text = page.read_text(encoding="utf-8")
    assert filled(text) == text, f"{page.name} is out of date: python docs/make_names.py"


@pytest.mark.parametrize("page", LINKED, ids=lambda page: page.name)
def test_relative_links_resolve(page):
    links = re.findall(r"\]\(([^)\s]+)\)", without_code(page.read_text(encoding="utf-8")))
    broken = []
    for link in links:
        if re.match(r"[a-z]+:", link):
            continue
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        if not target.exists() or (anchor and target.suffix == ".md" and anchor not in anchors(target)):
            broken.append(link)
    assert not broken


def test_index_lists_every_page():
    index = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    assert [page.name for page in PAGES if page.name != "index.md" and f"({page.name})" not in index] == []


@pytest.mark.parametrize("block", examples())
def test_examples_run(block, tmp_path, monkeypatch):
    from codriver.logs import registry

    monkeypatch.chdir(tmp_path)
    registry.formats()
    monkeypatch.setattr(registry, "_READERS", list(registry._READERS))
    exec(compile(block, "example", "exec"), {"__name__": "__main__"})
