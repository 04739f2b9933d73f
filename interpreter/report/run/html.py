"""`render`: the whole page, one file that needs nothing else."""

from __future__ import annotations

from collections.abc import Callable

from softmark.interpreter.report.page.document import document
from softmark.interpreter.report.page.markup import plain
from softmark.interpreter.report.run.figures import (
    along_lines,
    centre_lines,
    comparison,
    convergence,
    deviation,
    histograms,
    histories,
    measured_curves,
    over_states,
    over_time,
    realtime,
    refinement,
)
from softmark.interpreter.report.run.findings import Findings
from softmark.interpreter.report.run.header import header, title
from softmark.interpreter.report.run.tables import (
    contacts,
    filled,
    listing,
    loads,
    modes,
    provenance,
    published,
    reactions,
    regions,
    values,
    verdicts,
)
from softmark.interpreter.report.view3d import section
from softmark.interpreter.results.report import Report

# id of the section, who makes it ("" where it has nothing to show)
SECTIONS: tuple[tuple[str, Callable[[Findings], str]], ...] = (
    ("shapes", section.section_of),
    ("figure", centre_lines.section_of),
    ("table", comparison.section_of),
    ("refinement", refinement.section_of),
    ("states", over_states.section_of),
    ("curves", measured_curves.section_of),
    ("along", along_lines.section_of),
    ("values", values.section_of),
    ("published", published.section_of),
    ("distribution", histograms.section_of),
    ("error", deviation.section_of),
    ("realtime", realtime.section_of),
    ("histories", histories.section_of),
    ("contacts-in-time", over_time.section_of),
    ("convergence", convergence.section_of),
    ("filled", filled.section_of),
    ("bodies", regions.bodies_of),
    ("regions", regions.section_of),
    ("varying", regions.varying),
    ("loads", loads.section_of),
    ("supports", reactions.section_of),
    ("contacts", contacts.section_of),
    ("modes", modes.section_of),
    ("expectations", verdicts.expectations),
    ("warnings", verdicts.warnings),
    ("scene", listing.section_of),
    ("provenance", provenance.section_of),
)


def render(report: Report) -> str:
    """A complete HTML5 document: no network, no other file; without JavaScript shapes stand still and tooltips lack."""
    findings = Findings(report)
    sections = [(key, make(findings)) for key, make in SECTIONS]
    return document(
        f"{title(findings)} – softmark report",
        plain(findings.conclusion),
        header(findings),
        sections,
        "report.json",
        1 + len(findings.everyone),
        *files_of("".join(markup for _, markup in sections)),
    )


def files_of(markup: str) -> tuple[list[str], list[str]]:
    """The style sheets and the scripts that sections of a report need: what draws shapes only where there are some."""
    shown = 'class="shapes"' in markup
    carried, rigid = 'value="carried"' in markup, '"instruments": [{' in markup
    return (
        ["report.css", *(["shapes.css"] if shown else []), *(["carried.css"] if carried else [])],
        [
            "report.js",
            *(["raster.js"] if shown else []),
            *(["carried.js"] if carried else []),
            *(["instruments.js"] if rigid else []),
            *(["shapes_controls.js", "shapes.js"] if shown else []),
        ],
    )
