"""What acts: one line for each load, with the force that is asked for and how much of it the models take."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from softmark.interpreter.language import units
from softmark.interpreter.problem.parts.resultants import SHOWN
from softmark.interpreter.report.page.markup import prose, section, tag, text
from softmark.interpreter.report.run.findings import Findings
from softmark.interpreter.results.loads import Resultant, Vector

LEAD = (
    "The resultant of every load at full size on the undeformed body, its moment about the origin, and the part of it "
    "that the meshes take."
)


def section_of(findings: Findings) -> str:
    """A table of all loads; empty where no model says what acts on it."""
    rows = [_row(name, own) for name, own in _loads(findings)]
    if not rows:
        return ""
    head = tag("tr", *(tag("th", text(h), scope="col") for h in ("Load", "Force", "Moment", "Taken")))
    table = tag("table", tag("caption", text(LEAD)), tag("thead", head), tag("tbody", *rows))
    return section("loads", "Loads", tag("div", table, class_="scroll"))


def _loads(findings: Findings) -> Iterator[tuple[str, Mapping[str, Resultant]]]:
    models = findings.report.models
    for name in dict.fromkeys(load for m in models.values() for load in m.loads):
        yield name, {n: m.loads[name] for n, m in models.items() if name in m.loads}


def _row(name: str, own: Mapping[str, Resultant]) -> str:
    one = next(iter(own.values()))
    shown = units.show_all([_near(c, one) for c in one.exact_force or one.force], units.FORCE)
    force = shown.replace("-", "\N{MINUS SIGN}")
    moment = units.show_all(_rounded(one.moment), units.FORCE).replace("-", "\N{MINUS SIGN}")
    cells = (tag("td", text(force)), tag("td", text(f"{moment}\N{MIDDLE DOT}m")), tag("td", prose(_taken(own))))
    return tag("tr", tag("th", tag("code", text(name)), scope="row"), *cells)


def _rounded(moment: Vector) -> list[float]:
    """Components in N m to five digits; nothing where they are rounding beside the largest."""
    largest = max(abs(c) for c in moment)
    return [0.0 if abs(c) <= 1e-9 * largest else float(f"{c:.5g}") for c in moment]


def _near(component: float, of: Resultant) -> float:
    """A component to five digits; nothing where it is rounding."""
    largest = max(abs(c) for c in of.exact_force or of.force)
    return 0.0 if abs(component) <= 1e-9 * largest else float(f"{component:.5g}")


def _taken(own: Mapping[str, Resultant]) -> str:
    """`whole`, or the models that take less or more."""
    off = [f"{100 * r.share:.4g} % by `{n}`" for n, r in own.items() if abs(1.0 - r.share) > SHOWN]
    unknown = [f"{100 * r.remainder / r.area:.2g} % open in `{n}`" for n, r in own.items()
               if r.area and r.remainder > SHOWN * r.area]  # fmt: skip
    rest = ["whole by the others" if off else "whole"] if len(off) < len(own) else []
    return ", ".join((*off, *unknown, *rest))
