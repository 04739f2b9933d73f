"""Result matrix of a leaderboard: models down, cases across.

Each cell has the most accurate result of a model for a case.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from softmark.interpreter.language.number_formatting import format_quantity
from softmark.interpreter.report.comparison.comparison_view import status_of
from softmark.interpreter.report.page.html_markup import section, tag, text
from softmark.interpreter.study.leaderboard.leaderboard_cells import Board, Cell

SIGNS: Mapping[str | None, tuple[str, str]] = {  # by verdict: sign and class
    "met": ("✓", "good"), "not_met": ("✗", "bad"), "cannot_tell": ("?", "warn"), None: ("·", "quiet"),
}  # fmt: skip
LEAD = (
    "A cell has the error of the most accurate setting of the model, the uncertainty of the reference, and the "
    "solution time. ✓: within the tolerance of the case; ✗: not; ?: undecided because of the uncertainty of the "
    "reference. Other words give the reason why there is no result. Empty: the model was not run on this case."
)


def matrix(board: Board, order: Sequence[str]) -> str:
    """Return the HTML section with the matrix; `order` is the order of the models."""
    heads = [tag("th", tag("a", text(name), href=f"#case-{name}"), scope="col", title=card.question)
             for name, card in board.cases.items()]  # fmt: skip
    head = tag("thead", tag("tr", tag("th", "Model", scope="col"), *heads))
    rows = [_row(board, model) for model in order]
    lost = [_unsolved_row(board)] if any(card.reason for card in board.cases.values()) else []
    table = tag("table", head, tag("tbody", *rows, *lost), class_="board")
    wide = tag("div", table, class_="scroll", tabindex=0, role="region", aria_label="Models and cases")
    return section("matrix", "Models and cases", tag("p", text(LEAD), class_="lead"), wide)


def _row(board: Board, model: str) -> str:
    card = board.models[model]
    judged = any(c.verdict for c in board.cells if c.model == model)
    about = tag("small", text(f"{card.met} of {card.entered} right")) if judged else ""
    cells = [_cell(board.of(case, model)) for case in board.cases]
    return tag("tr", tag("th", text(model), about, scope="row"), *cells)


def _cell(cells: Sequence[Cell]) -> str:
    if not cells:
        return tag("td")
    first = cells[0]
    sign, mood = SIGNS[first.verdict]
    more = tag("small", text(f"best of {len(cells)}")) if len(cells) > 1 else ""
    if first.error is None:
        why = first.message or status_of(first.status)
        return tag("td", text(status_of(first.status)), more, class_="none", title=f"{first.name}: {why}")
    parts = [tag("b", f"{sign} {text(error_of(first))}")]
    if first.uncertainty:
        parts.append(tag("small", text(f"± {_amount(first.uncertainty, first.unit)}")))
    if first.time_s is not None:
        parts.append(tag("small", text(format_quantity(first.time_s, "s", 2))))
    if first.status != "converged":
        parts.append(tag("small", text(status_of(first.status))))
    return tag("td", *parts, more, class_=mood, title=f"{first.name}: {first.outline}")


def _unsolved_row(board: Board) -> str:
    """Return a table row that marks the cases without any solution."""
    cells = [
        tag("td", "failed", class_="none", title=card.reason) if card.reason else tag("td")
        for card in board.cases.values()
    ]
    return tag("tr", tag("th", "the scene itself", scope="row"), *cells)


def error_of(cell: Cell) -> str:
    """Return the error of a cell as text; errors of the size of rounding are marked."""
    return "–" if cell.error is None else _amount(cell.error, cell.unit)


def _amount(value: float, unit: str) -> str:
    return "< 1e-8 %" if unit == "1" and 0 <= value < 1e-10 else format_quantity(value, unit, 2, percent=True)
