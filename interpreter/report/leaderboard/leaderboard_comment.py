"""Pull-request comment on the changes of a leaderboard since an older one."""

from __future__ import annotations

from softmark.interpreter.language.number_formatting import format_quantity
from softmark.interpreter.report.page.comment_markdown import MarkdownTable, Row, code, document, strip_markup
from softmark.interpreter.study.leaderboard.leaderboard_cells import Board, Cell
from softmark.interpreter.study.leaderboard.leaderboard_changes import describe_change, describe_status

Key = tuple[str, str, str]
COLUMNS = ("case", "model", "before", "after", "change")


def comment(old: Board, new: Board) -> str:
    """Return the comment as Markdown: the changed cells, and the number of unchanged ones."""
    before, after = _by_key(old), _by_key(new)
    timed = (old.environment or {}).get("cpu") == (new.environment or {}).get("cpu")
    rows = [
        row for key in dict.fromkeys((*after, *before)) if (row := _row(key, before.get(key), after.get(key), timed))
    ]
    same = len(set(before) & set(after)) - sum(row[-1] not in ("new", "gone") for row in rows)
    counts = f"{len(after)} cells, {same} as before"
    note = "" if timed else " Times are not compared because the processors differ."
    head = f"**Leaderboard: {strip_markup(new.title)}.** {counts}, {len(rows)} changed.{note}"
    return document(head, [MarkdownTable("cells", COLUMNS, rows)])


def _by_key(board: Board) -> dict[Key, Cell]:
    return {(c.case, c.model, c.name): c for c in board.cells}


def _row(key: Key, old: Cell | None, new: Cell | None, timed: bool) -> Row | None:
    case, model, name = key
    who = f"{strip_markup(model)} ({code(name)})" if name else strip_markup(model)
    if old is None or new is None:
        return strip_markup(case), who, _describe_cell(old), _describe_cell(new), "new" if old is None else "gone"
    change = describe_change(old, new, timed)
    return (strip_markup(case), who, _describe_cell(old), _describe_cell(new), change) if change else None


def _describe_cell(cell: Cell | None) -> str:
    if cell is None:
        return "–"
    if cell.error is None:
        return describe_status(cell.status)
    time = "" if cell.time_s is None else f", {format_quantity(cell.time_s, 's', 3)}"
    return strip_markup(f"{format_quantity(cell.error, cell.unit, 3, percent=True)}{time}")
