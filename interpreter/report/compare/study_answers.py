"""The answers to the studies that a scene declares: a table for each, and a line for the terminal."""

from __future__ import annotations

from softmark.interpreter.language.amounts import grouped, quantity, signed
from softmark.interpreter.report.compare.tables import DASH, cell, heading, row, row_head, table, trust
from softmark.interpreter.report.compare.view import View
from softmark.interpreter.study.analysis.answers import Answer, Front, FrontMember, SettledLine, Settling
from softmark.interpreter.study.analysis.point import UNKNOWNS
from softmark.references.orders import Refined

NOTHING = Refined("unusable")  # of a line that does not refine


def studies(view: View) -> str:
    """A table for each answer; empty where the scene asks for nothing."""
    return "".join(_front(a) if isinstance(a, Front) else _settling(a) for a in view.analysis.answers)


def _settling(answer: Settling) -> str:
    words = ("Line", "Members", "Finest", "Order", "Limit", "± (GCI)", "Asymptotic")
    head = [heading(w, w not in ("Line", "Asymptotic")) for w in words]
    caption = (
        f"`{answer.study}`: how `{answer.metric}` settles over `{answer.over}`. ‡: outside the asymptotic "
        "range, not to be relied upon."
    )
    return table(caption, head, [_line(entry) for entry in answer.lines])


def _line(entry: SettledLine) -> str:
    found, unit = entry.refined or NOTHING, entry.unit or "1"
    mark = "" if found.asymptotic else " ‡"
    below = "" if found.relative is None else signed(f"{100 * found.relative:.2g} %")
    return row(
        row_head(entry.line), cell(DASH if entry.members is None else str(entry.members)),
        cell(_amount(entry.finest, unit)), cell(DASH if found.order is None else signed(f"{found.order:.2f}") + mark),
        cell(_marked(found.value, unit, mark)), cell(_marked(found.gci, unit, mark, 3), below),
        trust(found.asymptotic, found.doubt or found.reason or entry.reason),
    )  # fmt: skip


def _amount(value: float | None, unit: str, digits: int = 6) -> str:
    return DASH if value is None else quantity(value, unit, digits, percent=True)


def _marked(value: float | None, unit: str, mark: str, digits: int = 6) -> str:
    return DASH if value is None else _amount(value, unit, digits) + mark


def _front(answer: Front) -> str:
    cost = f"`{answer.cost}`" if answer.cost else answer.cost_name.capitalize()
    head = [heading("On the front"), heading(cost, True), heading(f"`{answer.error}`", True)]
    rows = [
        row(row_head(c.label, "capped" if c.capped else ""), cell(_cost(answer, c)),
            cell(_amount(c.error, answer.error_unit or "1", 3)))
        for c in answer.front
    ]  # fmt: skip
    over = f" over `{answer.over}`" if answer.over else ""
    empty = " Nothing counted." if not answer.counted else f" {answer.counted} configurations counted."
    return table(f"`{answer.study}`: which configurations{over} nobody beats in both.{empty}", head, rows)


def _cost(answer: Front, member: FrontMember) -> str:
    median = member.cost.median
    return grouped(round(median)) if answer.cost_name == UNKNOWNS else _amount(median, answer.cost_unit or "1", 3)


def spoken(answer: Answer) -> list[str]:
    """For the terminal: `settling: drop over refine: tet10: order 2.01, limit 12.3 mm ± 0.1 mm`."""
    if isinstance(answer, Front):
        names = ", ".join(f"{c.label} ({_cost(answer, c)})" for c in answer.front) or "nobody"
        return [f"{answer.study}: on the front of {answer.error} and {answer.cost_name}: {names}"]
    return [f"{answer.study}: {answer.metric} of {entry.line}: {_said(entry)}" for entry in answer.lines]


def _said(entry: SettledLine) -> str:
    found, unit = entry.refined or NOTHING, entry.unit or "1"
    if found.order is None:
        return f"no order: {found.reason or entry.reason}"
    said = f"order {found.order:.2f}, limit {_amount(found.value, unit)} ± {_amount(found.gci, unit, 2)}"
    return said if found.asymptotic else f"{said}; outside the asymptotic range: {found.doubt}"
