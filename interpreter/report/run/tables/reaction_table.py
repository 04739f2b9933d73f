"""Reaction table: a row for each support and each model on the page, and a line in the terminal."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from softmark.interpreter.language.compiled_scene import RIGID
from softmark.interpreter.report.page.html_markup import prose, tag, text
from softmark.interpreter.report.run.report_summary import ReportSummary
from softmark.interpreter.report.run.tables.table_section import (
    format_force,
    newtons,
    row_head,
    table_section,
    transpose_by_name,
)
from softmark.interpreter.results.reaction_results import SupportResult
from softmark.interpreter.results.run_report import ModelResult, Report
from softmark.interpreter.results.state_results import SOLVED

LEAD = (
    "Reaction of every support on the body in equilibrium{}: force, and moment about the centroid of the constrained "
    "part. Supports{} and loads are in balance."
)
HEAD = ("Support", "Model", "Force", "Moment", "Note")
NOTHING = "\N{EN DASH}"
SEVERAL = 3  # largest number of names listed in a line
ROUNDING = 1e-8  # relative to the largest component: equations are solved to a tolerance
LITTLE = 1e-3  # fraction of a force that is not visible with three digits


def section_of(findings: ReportSummary) -> str:
    """Return an HTML table of the reactions of all supports; empty if no model reports reactions."""
    models = findings.report.models
    known = transpose_by_name({n: m.reactions for n, m in models.items()})
    if not any(held.reaction for own in known.values() for held in own.values()):
        return ""
    rows = [
        _row(support, name, held, models[name].solve.get("checks") or {})
        for support, own in known.items()
        for name, held in own.items()
        if models[name].status in SOLVED
    ]
    pressed = ", contact forces of rigid bodies" if findings.report.names.of_kind(RIGID) else ""
    return table_section("Supports", LEAD.format(findings.last_state_phrase, pressed), HEAD, rows)


def _row(support: str, model: str, held: SupportResult, checks: Mapping[str, Any]) -> str:
    head, own = (row_head(support), tag("td", tag("code", text(model)))), held.reaction
    if own is None:
        return tag("tr", *head, *(tag("td", NOTHING) for _ in range(2)), tag("td", prose(str(held.reason))))
    largest = max(abs(c) for c in own.force)
    force, moment = newtons(own.force, ROUNDING), f"{newtons(own.own_moment, ROUNDING)}\N{MIDDLE DOT}m"
    there = newtons(own.shared_force, ROUNDING, largest)
    said = [f"{there} of it on the part shared with {_quote_names(own.shared)}"] if own.shared else []
    said += [note] if (note := (checks.get("reactions") or {}).get("note")) else []
    return tag(
        "tr", *head, tag("td", text(force)), tag("td", text(moment)), tag("td", prose("; ".join(said) or NOTHING))
    )


def _quote_names(names: Sequence[str]) -> str:
    return ", ".join(f"`{n}`" for n in names)


def lines(report: Report) -> Iterator[str]:
    """Yield lines of text such as `reaction force of wall: 2.06 N in tet, hex; 2.12 N in rod`.

    Forces that agree to three digits are merged.
    """
    everyone = {n: m.reactions for n, m in report.models.items()}
    least = {n: ROUNDING * _largest_force(m) for n, m in report.models.items()}
    for support, own in transpose_by_name(everyone).items():
        alike: dict[str, list[str]] = {}
        for name, held in own.items():
            if held.reaction is not None and report.models[name].status == "converged":
                force = held.reaction.force if _reaction_magnitude(held) > least[name] else (0.0, 0.0, 0.0)
                alike.setdefault(format_force(force, 3, LITTLE), []).append(name)
        if alike:
            each = (f"{size} in {_name_models(names)}" for size, names in alike.items())
            yield f"reaction force of {support}: {'; '.join(each)}"


def _largest_force(model: ModelResult) -> float:
    """Return the largest force of all supports and contacts, N, relative to which small reactions count as zero."""
    pressed = (math.hypot(*own.reaction.force) for own in model.contacts.values())
    return max((*map(_reaction_magnitude, model.reactions.values()), *pressed), default=0.0)


def _reaction_magnitude(held: SupportResult) -> float:
    """Return the magnitude of a reaction force, N; 0 if it is unknown."""
    return 0.0 if held.reaction is None else math.hypot(*held.reaction.force)


def _name_models(names: Sequence[str]) -> str:
    return ", ".join(names) if len(names) <= SEVERAL else f"{len(names)} models"
