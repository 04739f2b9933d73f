"""Table of bodies made by filling a surface with tetrahedra.

It shows repairs of the surface, and the deviation of each mesh from it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from softmark.interpreter.language import units
from softmark.interpreter.report.page.html_markup import prose, tag, text
from softmark.interpreter.report.run.report_summary import ReportSummary
from softmark.interpreter.report.run.tables.table_section import row_head, table_section

LEAD = (
    "Volume of the mesh compared with the volume inside the surface; largest distance from mesh boundary to surface "
    "and from surface to mesh boundary (both directions of the Hausdorff distance); quality of the worst and the "
    "median cell (1 is a regular tetrahedron)."
)
VOLUME: units.Dimension = units.raise_dimension(units.LENGTH, 3)


def section_of(findings: ReportSummary) -> str:
    """Return an HTML table of all models whose mesh fills a closed surface; empty if there is none."""
    known = {n: m.solve["filled"] for n, m in findings.report.models.items() if "filled" in m.solve}
    heads = ("Model", "Volume", "Distance", "Quality", "Repaired", "Made by")
    return table_section("Filled", LEAD, heads, [_filled_mesh_row(*entry) for entry in known.items()])


def _filled_mesh_row(name: str, own: Mapping[str, Any]) -> str:
    """Return the HTML table row of a model: volume, deviation from the surface, quality, repairs and mesher of its
    mesh.
    """
    has, off = own["mesh_m3"], 100 * (own["mesh_m3"] / own["surface_m3"] - 1.0)
    ways = [
        units.format_value(float(f"{own[key]:.3g}"), units.LENGTH) for key in ("mesh_to_surface_m", "surface_to_mesh_m")
    ]
    words = (
        f"{units.format_value(float(f'{has:.5g}'), VOLUME)}, {off:+.2g} % of the surface's{_surface_deviation(own)}",
        f"{ways[0]} and {ways[1]}",
        f"{own['quality']:.2g} and {own['median_quality']:.2g}",
        "; ".join(own["repairs"]) or "nothing",
        f"{own['mesher']}, {own['cpu_s']:.3g} s of CPU, mesh {own['digest']}",
    )
    return tag("tr", row_head(name), *(tag("td", text(w) if i else prose(w)) for i, w in enumerate(words)))


def _surface_deviation(own: Mapping[str, Any]) -> str:
    """Return the deviation of a faceted surface from the body that it approximates, as text."""
    share = 100 * own.get("facets_m3", 0.0) / own["surface_m3"]
    return f", facets omit {share:.2g} % of the volume" if share else ""
