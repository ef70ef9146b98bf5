"""Papers made again: every table, figure and claim beside what codriver gives, on simulated drives and real recordings.

* item: one statement of a paper and what became of it
* reproduction: the statements with the charts, as one HTML page and one JSON file
* registry: which papers there are
* one package a paper
"""

from codriver.papers.registry import PAPERS, reproduce

__all__ = ["PAPERS", "reproduce"]
