"""The answers to the studies that a scene declares: a table for each, and a line for the terminal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from softmark.interpreter.language.amounts import grouped, quantity, signed
from softmark.interpreter.report.compare.tables import DASH, cell, heading, row, row_head, table
from softmark.interpreter.report.compare.view import View
from softmark.interpreter.report.page.markup import tag, text
from softmark.interpreter.study.analysis.point import UNKNOWNS


def studies(view: View) -> str:
    """A table for each answer; empty where the scene asks for nothing."""
    return "".join(_convergence(a) if a["kind"] == "convergence" else _pareto(a) for a in view.answers)


def _convergence(answer: Mapping[str, Any]) -> str:
    words = ("Line", "Members", "Finest", "Order", "Limit", "± (GCI)", "Asymptotic")
    head = [heading(w, w not in ("Line", "Asymptotic")) for w in words]
    rows = [_line(entry) for entry in answer["lines"]]
    caption = (
        f"`{answer['study']}`: how `{answer['metric']}` settles over `{answer['over']}`. ‡: outside the asymptotic "
        "range, not to be relied upon."
    )
    return table(caption, head, rows)


def _line(entry: Mapping[str, Any]) -> str:
    good, unit = bool(entry.get("asymptotic")), str(entry["unit"] or "1")
    mark = "" if good else " ‡"
    finest, order = _amount(entry.get("finest"), unit), entry.get("order")
    relative = entry.get("relative")
    below = "" if relative is None else signed(f"{100 * relative:.2g} %")
    sign = tag("span", "✓ yes" if good else "✗ no", class_="status good" if good else "status warn")
    doubt = entry.get("doubt") or entry.get("reason")
    why = tag("td", sign, tag("small", text(doubt)) if doubt and not good else "", class_="why")
    return row(
        row_head(str(entry["line"])), cell(str(entry.get("members", DASH))), cell(finest),
        cell(DASH if order is None else signed(f"{order:.2f}") + mark), cell(_marked(entry.get("value"), unit, mark)),
        cell(_marked(entry.get("gci"), unit, mark, 3), below), why,
    )  # fmt: skip


def _amount(value: float | None, unit: str, digits: int = 6) -> str:
    return DASH if value is None else quantity(value, unit, digits, percent=True)


def _marked(value: float | None, unit: str, mark: str, digits: int = 6) -> str:
    return DASH if value is None else _amount(value, unit, digits) + mark


def _pareto(answer: Mapping[str, Any]) -> str:
    cost = str(answer["cost_name"])
    head = [heading("On the front"), heading(cost.capitalize() if not answer["cost"] else f"`{cost}`", True)]
    head.append(heading(f"`{answer['error']}`", True))
    rows = [
        row(row_head(str(m["label"]), "capped" if m["capped"] else ""), cell(_cost(answer, m)),
            cell(_amount(m["error"], str(answer["error_unit"] or "1"), 3)))
        for m in answer["front"]
    ]  # fmt: skip
    over = f" over `{answer['over']}`" if answer.get("over") else ""
    empty = " Nothing counted." if not answer["counted"] else f" {answer['counted']} configurations counted."
    return table(f"`{answer['study']}`: which configurations{over} nobody beats in both.{empty}", head, rows)


def _cost(answer: Mapping[str, Any], member: Mapping[str, Any]) -> str:
    median = member["cost"]["median"]
    if answer["cost_name"] == UNKNOWNS:
        return grouped(round(median))
    return _amount(median, str(answer["cost_unit"] or "1"), 3)


def spoken(answer: Mapping[str, Any]) -> list[str]:
    """For the terminal: `settling: drop over refine: tet10: order 2.01, limit 12.3 mm ± 0.1 mm`."""
    if answer["kind"] == "pareto":
        names = ", ".join(f"{m['label']} ({_cost(answer, m)})" for m in answer["front"]) or "nobody"
        return [f"{answer['study']}: on the front of {answer['error']} and {answer['cost_name']}: {names}"]
    return [f"{answer['study']}: {answer['metric']} of {entry['line']}: {_said(entry)}" for entry in answer["lines"]]


def _said(entry: Mapping[str, Any]) -> str:
    unit = str(entry["unit"] or "1")
    if entry.get("order") is None:
        return f"no order: {entry.get('reason')}"
    said = f"order {entry['order']:.2f}, limit {_amount(entry['value'], unit)} ± {_amount(entry['gci'], unit, 2)}"
    return said if entry.get("asymptotic") else f"{said}; outside the asymptotic range: {entry.get('doubt')}"
