"""Load table: a row for each load, with the declared force and the fraction of it that each model applies."""

from __future__ import annotations

from collections.abc import Mapping

from softmark.interpreter.problem.surface_selection.load_resultants import SHOWN
from softmark.interpreter.report.page.html_markup import prose, tag, text
from softmark.interpreter.report.run.report_summary import ReportSummary
from softmark.interpreter.report.run.tables.table_section import newtons, row_head, table_section, transpose_by_name
from softmark.interpreter.results.load_results import Resultant

LEAD = (
    "Resultant force of every load at full size{} on the undeformed body, its moment about the origin, and the "
    "fraction of it that is applied to the meshes."
)
ROUNDING = 1e-9  # relative to the largest component


def section_of(findings: ReportSummary) -> str:
    """Return an HTML table of all loads; empty if no model reports its loads."""
    known = transpose_by_name({n: m.loads for n, m in findings.report.models.items()})
    rows = [_row(name, own) for name, own in known.items()]
    return table_section("Loads", LEAD.format(findings.last_state_phrase), ("Load", "Force", "Moment", "Taken"), rows)


def _row(name: str, own: Mapping[str, Resultant]) -> str:
    who, one = min(
        own.items(), key=lambda item: abs(1.0 - item[1].share)
    )  # the model whose force is nearest to the exact one; moments differ by model
    force, moment = (newtons(v, ROUNDING) for v in (one.exact_force or one.force, one.exact_moment or one.moment))
    moment += "\N{MIDDLE DOT}m" + (f" in `{who}`" if abs(1.0 - one.share) > SHOWN else "")
    cells = (tag("td", text(force)), tag("td", prose(moment)), tag("td", prose(_applied_fraction(own))))
    return tag("tr", row_head(name), *cells)


def _applied_fraction(own: Mapping[str, Resultant]) -> str:
    """Return `whole`, or the models that apply a smaller or larger force than declared, as text."""
    off = [f"{100 * r.share:.4g} % by `{n}`" for n, r in own.items() if abs(1.0 - r.share) > SHOWN]
    unknown = [f"{100 * r.remainder / r.area:.2g} % of the area undecided in `{n}`" for n, r in own.items()
               if r.area and r.remainder > SHOWN * r.area]  # fmt: skip
    rest = ["100 % by the others" if off else "100 %"] if len(off) < len(own) else []
    return ", ".join((*off, *unknown, *rest))
