"""Region tables: declared volumes of bodies and their parts, volumes of each mesh, and varying constants.

For each material constant that varies in space it shows range, mean, and the variation that the cells do not resolve.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from softmark.interpreter.language import units
from softmark.interpreter.report.page.html_markup import prose, tag, text
from softmark.interpreter.report.run.report_summary import ReportSummary
from softmark.interpreter.report.run.tables.table_section import row_head, table_section, transpose_by_name

LEAD = "Volume of every region with its own material, and of the cells that have this material."
VOLUME: units.Dimension = units.raise_dimension(units.LENGTH, 3)
AREA: units.Dimension = units.raise_dimension(units.LENGTH, 2)
WHOLE = "Exact volume and surface area of the body, and those of the mesh, whose facets are inscribed in curved sides."
SAME = 1e-12  # relative; smaller differences are round-off
VARYING = "Material constants that vary in space: smallest, largest and mean value on a mesh."
HEADS = ("Constant", "Range", "Mean", "Variation within cells")
DIMENSIONS: dict[str, units.Dimension] = {"young": units.PRESSURE, "density": (-3, 1, 0, 0, 0)}
SHOWN = 1e-4  # fraction of a part; smaller volumes of the wrong material get no number


def section_of(findings: ReportSummary) -> str:
    """Return an HTML table of all parts of bodies; empty if no model has parts."""
    known = transpose_by_name({n: m.solve.get("regions") or {} for n, m in findings.report.models.items()})
    return table_section("Regions", LEAD, ("Region", "Volume", "Cells"), [_row(*entry) for entry in known.items()])


def _row(name: str, own: Mapping[str, Mapping[str, Any]]) -> str:
    asked = units.format_value(float(f"{max(v['asked_m3'] for v in own.values()):.5g}"), VOLUME)
    cells = (tag("td", text(asked)), tag("td", prose(_covered_fraction(own))))
    return tag("tr", row_head(name), *cells)


def _covered_fraction(own: Mapping[str, Mapping[str, Any]]) -> str:
    """Return `followed` if all meshes cover the part, else the models whose cells cover too little or too much."""
    off = []
    for model, v in own.items():
        missed, beyond = v["missed_m3"] / v["asked_m3"], v["beyond_m3"] / v["asked_m3"]
        if missed + beyond > SHOWN:
            share = 100 * v["taken_m3"] / v["asked_m3"]
            off.append(f"{share:.4g} % in `{model}`: {100 * missed:.3g} % missed, {100 * beyond:.3g} % too much")
    rest = ["conforming meshes of the others" if off else "followed"] if len(off) < len(own) else []
    return "; ".join((*off, *rest))


def bodies_section(findings: ReportSummary) -> str:
    """Return an HTML table of bodies whose volume and surface are known, with those of each mesh; empty if none."""
    known = {n: m.solve["body"] for n, m in findings.report.models.items() if "body" in m.solve}
    rows = [
        tag("tr", row_head(name), *map(_measure_cell, _exact_and_mesh_measures(own))) for name, own in known.items()
    ]
    return table_section("Bodies", WHOLE, ("Model", "Volume", "Surface"), rows)


def _exact_and_mesh_measures(own: Mapping[str, float]) -> tuple[tuple[float, float, units.Dimension], ...]:
    """Return volume and surface area of the body and of the mesh, with their dimensions."""
    return (own["volume_m3"], own["mesh_m3"], VOLUME), (own["area_m2"], own["mesh_m2"], AREA)


def _measure_cell(one: tuple[float, float, units.Dimension]) -> str:
    exact, has, dimension = one
    off = has / exact - 1.0
    shown = units.format_value(float(f"{exact:.6g}"), dimension)
    return tag("td", prose(f"{shown}, the mesh has " + ("it all" if abs(off) < SAME else f"{100 * off:+.2g} %")))


def varying_constants(findings: ReportSummary) -> str:
    """Return an HTML table of all constants that vary in space; empty if there are none."""
    known = transpose_by_name({n: m.solve.get("graded") or {} for n, m in findings.report.models.items()})
    return table_section("Varying", VARYING, HEADS, [_constant_row(*entry) for entry in known.items()])


def _constant_row(name: str, own: Mapping[str, Mapping[str, Any]]) -> str:
    dimension = DIMENSIONS.get(name.rpartition(".")[2], units.NONE)
    least, most = min(v["least"] for v in own.values()), max(v["most"] for v in own.values())
    mean = next(iter(own.values()))["mean"]
    low, high, middle = (units.format_value(float(f"{v:.5g}"), dimension) for v in (least, most, mean))
    resolved = prose("; ".join(map(_unresolved_variation, own, own.values())))
    return tag("tr", row_head(name), tag("td", text(f"{low} to {high}")), tag("td", text(middle)), tag("td", resolved))


def _unresolved_variation(model: str, said: Mapping[str, Any]) -> str:
    """Return the largest change within a cell, the quadrature error, and the fraction outside the field, as text."""
    found = [f"`{model}` up to {said['within_cells']:.3g} times"]
    if said["integral_lost"] > SHOWN:
        found.append(f"the quadrature error is {100 * said['integral_lost']:.2g} %")
    if said.get("outside_share", 0.0) > SHOWN:
        found.append(f"{100 * said['outside_share']:.3g} % of the volume is outside the range of the field file")
    return ", ".join(found)
