"""A paper made again: its items and charts, written as one HTML page and one JSON file."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from codriver.papers.item import Item, counts
from codriver.report.document import Document, Mark, Part, Section, Table, write_document
from codriver.report.write import write_whole

Tell = Callable[[str], None]
VERDICT = {
    True: Mark("good", "holds"),
    False: Mark("bad", "does not hold"),
    None: Mark("open", "cannot be judged here"),
}


@dataclass(frozen=True)
class Chapter:
    """A section of the reproduction: what is shown, and the items that go with it.

    Attributes:
        title: as the heading.
        words: paragraphs.
        shown: charts and further tables.
        items: statements of the paper judged here.
    """

    title: str
    words: tuple[str, ...]
    shown: tuple[Part, ...] = field(repr=False)
    items: tuple[Item, ...] = ()

    def section(self) -> Section:
        """As a section of the report."""
        judged: tuple[Part, ...] = (items_table(self.items),) if self.items else ()
        return Section(self.title, (*self.words, *judged, *self.shown))


@dataclass(frozen=True)
class Reproduction:
    """A paper made again.

    Attributes:
        name: as on the command line, such as "jerk2017".
        title, citation: of the paper.
        lead: what was done, in a sentence or two.
        chapters: in the paper's order.
        facts: what is to be known at a glance.
    """

    name: str
    title: str
    citation: str
    lead: str
    chapters: tuple[Chapter, ...]
    facts: tuple[tuple[str, str], ...] = ()

    @property
    def items(self) -> tuple[Item, ...]:
        """All items, in order."""
        return tuple(item for chapter in self.chapters for item in chapter.items)

    @property
    def of_paper(self) -> tuple[Item, ...]:
        """What the paper says."""
        return tuple(item for item in self.items if not item.own)

    @property
    def beside(self) -> tuple[Item, ...]:
        """What it does not: ours alone."""
        return tuple(item for item in self.items if item.own)

    def document(self, command: str = "") -> Document:
        """The report."""
        facts = (
            ("paper", self.citation), ("items of the paper", f"{len(self.of_paper)}: {counts(self.of_paper)}"),
            ("items beside it", f"{len(self.beside)}: {counts(self.beside)}"), *self.facts,
        )  # fmt: skip
        failed, missed = ([i for i in items if i.holds is False] for items in (self.of_paper, self.beside))
        summary = Section("What does not hold", (
            "Of the paper:" if failed else "Every item of the paper that could be judged holds.",
            *((items_table(tuple(failed)),) if failed else ()),
            *(("Beside it, of our own goals:", items_table(tuple(missed))) if missed else ()),
        ))  # fmt: skip
        return Document(self.title, self.lead, (summary, *(c.section() for c in self.chapters)), facts, command)

    def to_dict(self) -> dict[str, object]:
        """As the JSON file holds it."""
        from codriver import __version__

        return {
            "paper": self.name, "citation": self.citation, "codriver": __version__,
            "facts": dict(self.facts), "items": [item.to_dict() for item in self.items],
        }  # fmt: skip

    def write(self, folder: Path, command: str = "") -> tuple[Path, Path]:
        """Write NAME.html and NAME.json into a folder that exists; each appears when it is complete.

        Raises:
            UsageError: a file cannot be written.
        """
        page, data = folder / f"{self.name}.html", folder / f"{self.name}.json"
        text = json.dumps(self.to_dict(), indent=2, ensure_ascii=False, allow_nan=False) + "\n"
        write_document(self.document(command), page)
        write_whole(text, data)
        return page, data


def items_table(items: tuple[Item, ...]) -> Table:
    """Items as a table: paper beside ours."""
    rows = tuple(
        (i.item, _with_unit(i.paper, i.unit), _with_unit(i.ours, i.unit), VERDICT[i.holds], i.note) for i in items
    )
    return Table(("what the paper says", "paper", "ours", "", "how judged"), rows)


def _with_unit(value: float | str | None, unit: str) -> str:
    from codriver.report.shown import number

    if value is None or isinstance(value, str):
        return value or "–"
    return f"{number(value, 4)} {unit if unit != '1' else ''}".strip()
