"""What supports carry: a line for each support and each model, and one in the terminal."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from softmark.interpreter.language import units
from softmark.interpreter.report.page.markup import prose, section, tag, text
from softmark.interpreter.report.run.findings import Findings
from softmark.interpreter.results.report import Report

LEAD = (
    "What every support does to the body at rest: its force, and its moment about the middle of what it holds. "
    "Supports and loads together come to nothing."
)
HEAD = ("Support", "Model", "Force", "Moment", "Note")
NOTHING = "\N{EN DASH}"
SEVERAL = 3  # names that a line lists


def section_of(findings: Findings) -> str:
    """A table of all supports; empty where no model says what they carry."""
    models = findings.report.models
    names = dict.fromkeys(support for m in models.values() for support in m.reactions)
    rows = [
        _row(support, name, m.reactions[support], m.solve.get("checks") or {})
        for support in names
        for name, m in models.items()
        if support in m.reactions and m.status in ("converged", "capped")
    ]
    if not any(m.reactions[s].get("force") for m in models.values() for s in m.reactions):
        return ""
    head = tag("tr", *(tag("th", text(h), scope="col") for h in HEAD))
    table = tag("table", tag("caption", text(LEAD)), tag("thead", head), tag("tbody", *rows))
    return section("supports", "Supports", tag("div", table, class_="scroll"))


def _row(support: str, model: str, own: Mapping[str, Any], checks: Mapping[str, Any]) -> str:
    head = (tag("th", tag("code", text(support)), scope="row"), tag("td", tag("code", text(model))))
    if not own.get("force"):
        return tag("tr", *head, *(tag("td", NOTHING) for _ in range(2)), tag("td", prose(str(own.get("reason")))))
    largest = max(abs(c) for c in (*own["force"], 0.0))
    force, moment = _shown(own["force"], largest), f"{_shown(own['own_moment'])}\N{MIDDLE DOT}m"
    shared = own.get("shared") or ()
    said = [f"{_shown(own['shared_force'], largest)} of it where {_listed(shared)} holds as well"] if shared else []
    said += [note] if (note := (checks.get("reactions") or {}).get("note")) else []
    return tag(
        "tr", *head, tag("td", text(force)), tag("td", text(moment)), tag("td", prose("; ".join(said) or NOTHING))
    )


def _listed(names: Sequence[str]) -> str:
    return ", ".join(f"`{n}`" for n in names)


def _shown(vector: Sequence[float], largest: float = 0.0) -> str:
    """Three components in N to five digits; nothing where they are rounding beside the largest."""
    most = max(largest, *(abs(c) for c in vector))
    near = [0.0 if abs(c) <= 1e-8 * most else float(f"{c:.5g}") for c in vector]
    return units.show_all(near, units.FORCE).replace("-", "\N{MINUS SIGN}")


def lines(report: Report) -> Iterator[str]:
    """`wall carries 2.06 N in tet, hex, 2.12 N in rod`: sizes of forces, those that agree on three digits once."""
    supports = dict.fromkeys(s for m in report.models.values() for s in m.reactions)
    for support in supports:
        alike: dict[str, list[str]] = {}
        for name, m in report.models.items():
            force = m.reactions.get(support, {}).get("force")
            if force and m.status == "converged":
                size = sum(c * c for c in force) ** 0.5
                alike.setdefault(units.show(float(f"{size:.3g}"), units.FORCE), []).append(name)
        if alike:
            each = (f"{size} in {_who(names)}" for size, names in alike.items())
            yield f"{support} carries {', '.join(each)}"


def _who(names: Sequence[str]) -> str:
    return ", ".join(names) if len(names) <= SEVERAL else f"{len(names)} models"
