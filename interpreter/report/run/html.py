"""`render`: the whole page, one file that needs nothing else."""

from __future__ import annotations

from collections.abc import Callable

from softmark.interpreter.report.page.document import document
from softmark.interpreter.report.page.markup import plain
from softmark.interpreter.report.run.figures import (
    centre_lines,
    comparison,
    convergence,
    deviation,
    histograms,
    histories,
    measured_curves,
    over_states,
    realtime,
    refinement,
)
from softmark.interpreter.report.run.findings import Findings
from softmark.interpreter.report.run.header import header, title
from softmark.interpreter.report.run.tables import (
    filled,
    listing,
    loads,
    modes,
    provenance,
    published,
    reactions,
    regions,
    verdicts,
)
from softmark.interpreter.report.view3d import section
from softmark.interpreter.results.report import Report

# id of the section, its name in the navigation, who makes it ("" where it has nothing to show)
SECTIONS: tuple[tuple[str, str, Callable[[Findings], str]], ...] = (
    ("shapes", "Shapes", section.section_of),
    ("figure", "Centre lines", centre_lines.section_of),
    ("table", "Table", comparison.section_of),
    ("refinement", "Refinement", refinement.section_of),
    ("states", "States", over_states.section_of),
    ("curves", "Measured curves", measured_curves.section_of),
    ("published", "Published", published.section_of),
    ("distribution", "Distribution", histograms.section_of),
    ("error", "Along the line", deviation.section_of),
    ("realtime", "Real time", realtime.section_of),
    ("histories", "Over time", histories.section_of),
    ("convergence", "Convergence", convergence.section_of),
    ("filled", "Filled", filled.section_of),
    ("bodies", "Bodies", regions.bodies_of),
    ("regions", "Regions", regions.section_of),
    ("varying", "Varying", regions.varying),
    ("loads", "Loads", loads.section_of),
    ("supports", "Supports", reactions.section_of),
    ("modes", "Modes", modes.section_of),
    ("expectations", "Expectations", verdicts.expectations),
    ("warnings", "Warnings", verdicts.warnings),
    ("scene", "Scene", listing.section_of),
    ("provenance", "Provenance", provenance.section_of),
)


def render(report: Report) -> str:
    """A complete HTML5 document: no network, no other file; without JavaScript shapes stand still and tooltips lack."""
    findings = Findings(report)
    sections = [(key, name, make(findings)) for key, name, make in SECTIONS]
    carried = any('value="carried"' in markup for _, _, markup in sections)
    shown = any('class="shapes"' in markup for _, _, markup in sections)  # only then what draws them goes in
    return document(
        f"{title(findings)} – softmark report",
        plain(findings.conclusion),
        header(findings),
        sections,
        "report.json",
        1 + len(findings.everyone),
        ["report.css", *(["shapes.css"] if shown else []), *(["carried.css"] if carried else [])],
        [
            "report.js",
            *(["raster.js"] if shown else []),
            *(["carried.js"] if carried else []),
            *(["shapes_controls.js", "shapes.js"] if shown else []),
        ],
    )
