"""HTML cards of leaderboard cases: the question, its reference with uncertainty, and the result of every model."""

from __future__ import annotations

from collections.abc import Mapping

from softmark.interpreter.language.number_formatting import format_quantity
from softmark.interpreter.report.comparison.comparison_view import SceneView, status_of
from softmark.interpreter.report.comparison.work_precision_diagram import Diagram
from softmark.interpreter.report.leaderboard.result_matrix import SIGNS, error_of
from softmark.interpreter.report.page.html_markup import prose, section, tag, text
from softmark.interpreter.study.leaderboard.leaderboard_cells import Board, CaseCard, Cell

HEADS = ("Model", "in the scene", "Error", "±", "Time", "Status")


def cards(board: Board, views: Mapping[str, SceneView]) -> str:
    """Return the HTML section with a card for each case; `views` are the views of the comparison, by scene."""
    return section("cases", "Cases", *(_card(board, name, views) for name in board.cases))


def _card(board: Board, name: str, views: Mapping[str, SceneView]) -> str:
    card, cells = board.cases[name], board.of(name)
    title = tag("h3", tag("code", text(name)), " ", text(card.question), id=f"case-{name}-heading")
    lost = tag("p", prose(f"No model gave a result: {card.reason}"), class_="callout bad") if card.reason else ""
    table = _answers(cells) if cells else ""
    figure = _error_time_diagram(card, cells, views.get(card.subject))
    return tag("article", title, _case_facts(card, cells), lost, table, figure, id=f"case-{name}", class_="case",
               aria_labelledby=f"case-{name}-heading")  # fmt: skip


def _case_facts(card: CaseCard, cells: list[Cell]) -> str:
    known = [c.uncertainty for c in cells if c.uncertainty]
    low, high = (format_quantity(f(known), card.unit, 2, percent=True) if known else "" for f in (min, max))
    uncertainty = (f"± {low}" if low == high else f"± {low} to {high}") if known else "not stated"
    tolerance = "none" if card.tolerance is None else format_quantity(card.tolerance, card.unit, 3, percent=True)
    entries = {
        "Scene": tag("span", text(card.scene), " (", tag("code", text(card.file)), ")"),
        "Metric": tag("code", text(card.metric or "no metric")),
        "Reference": tag("code", text(card.against or "none")) + text(f", {card.kind or 'kind not stated'}"),
        "Source": text(card.source or "not stated"),
        "Uncertainty": text(uncertainty),
        "Tolerance": text(tolerance),
    }
    items = [tag("div", tag("dt", name), tag("dd", markup)) for name, markup in entries.items()]
    return tag("dl", *items, class_="meanings")


def _answers(cells: list[Cell]) -> str:
    head = tag("thead", tag("tr", *(tag("th", text(h), scope="col") for h in HEADS)))
    body = tag("tbody", *(_answer(cell) for cell in cells))
    return tag("div", tag("table", head, body, class_="answers"), class_="scroll", tabindex=0, role="region",
               aria_label="Answers")  # fmt: skip


def _answer(cell: Cell) -> str:
    sign, mood = SIGNS[cell.verdict]
    why = tag("small", prose(cell.message)) if cell.message else ""
    time = "–" if cell.time_s is None else format_quantity(cell.time_s, "s", 3)
    disturbed = tag("small", "disturbed") if "contaminated" in (cell.flags or ()) else ""
    sure = "–" if not cell.uncertainty else format_quantity(cell.uncertainty, cell.unit, 2, percent=True)
    return tag(
        "tr", tag("th", text(cell.model), tag("small", text(cell.outline)), scope="row"),
        tag("td", tag("code", text(cell.name))),
        tag("td", f"{sign} {text(error_of(cell))}", class_=mood), tag("td", text(sure)),
        tag("td", text(time), disturbed), tag("td", text(status_of(cell.status)), why),
    )  # fmt: skip


def _error_time_diagram(card: CaseCard, cells: list[Cell], view: SceneView | None) -> str:
    """Return the diagram of error against time of a case; empty if there is only one result."""
    drawn = [c for c in cells if c.error is not None]
    if view is None or card.metric is None or card.metric not in view.metrics or len(drawn) < 2:
        return ""
    return Diagram(view, list(view.metrics).index(card.metric), card.metric).figure()
