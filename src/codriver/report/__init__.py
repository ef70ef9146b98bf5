"""A report of an estimate: one HTML file with linked plots, a verdict and its reasons, figures and provenance.

* shown: units and names as people read them
* stretches: where the estimate is not valid and why
* parts, panels: what is drawn; figure: as traces and layout; pack: the columns, small
* numbers: figures; words: explanations; tables: both as HTML
* page: the whole; write: to a file
* page.css, plots.js: how it looks, and what draws the plots
* document: reports that are no estimate, as values; charts, document_page, document.js: how they are drawn and written
"""

from codriver.report.write import write_report

__all__ = ["write_report"]
