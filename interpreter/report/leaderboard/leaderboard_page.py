"""HTML page of a leaderboard: one self-contained file."""

from __future__ import annotations

from softmark.interpreter.report.comparison.comparison_view import SceneView, views
from softmark.interpreter.report.leaderboard.case_cards import cards
from softmark.interpreter.report.leaderboard.performance_profile_figures import profiles
from softmark.interpreter.report.leaderboard.result_matrix import matrix
from softmark.interpreter.report.page.html_document import date_html, document
from softmark.interpreter.report.page.html_markup import (
    count,
    join_few_names,
    join_names,
    prose,
    section,
    strip_backticks,
    tag,
    text,
)
from softmark.interpreter.report.run.tables.provenance_table import table_of
from softmark.interpreter.study.analysis.comparison_record import ComparisonRecord
from softmark.interpreter.study.leaderboard.leaderboard_cells import Board
from softmark.interpreter.study.leaderboard.model_strengths import ModelStrengths, find_strengths


def page(board: Board, compared: ComparisonRecord) -> str:
    """Return the page of a leaderboard and its comparison as an HTML5 document that needs no network or other files."""
    own = {view.scene: view for view in views(compared)}
    ranked = find_strengths(board)
    sections = [
        ("matrix", matrix(board, [m.model for m in ranked])),
        ("profiles", profiles(board)),
        ("merits", _strength_section(ranked)),
        ("cases", cards(board, own)),
        ("provenance", _provenance(board)),
    ]
    return document(
        f"{board.title} – softmark leaderboard",
        strip_backticks(_answer_count_sentence(board)),
        _header(board),
        sections,
        "board.json",
        _largest_curve_count(board, own),
        ["report.css", "compare.css", "board.css"],
        ["report.js"],
    )


def _largest_curve_count(board: Board, own: dict[str, SceneView]) -> int:
    """Return the largest number of curves in one legend of the page."""
    return max([len(board.models), *(len(view.lines) for view in own.values())])


def _answer_count_sentence(board: Board) -> str:
    """Return a sentence that counts answers, such as `37 cases, 30 models, 61 answers: 50 right, ...`."""
    words = {"met": "right", "not_met": "wrong", "cannot_tell": "below the uncertainty of the reference"}
    found = [(said, sum(c.verdict == key for c in board.cells)) for key, said in words.items()]
    lost = sum(c.error is None for c in board.cells)
    said = [f"{n} {what}" for what, n in (*found, ("no error", lost)) if n]
    models, cells = count(len(board.models), "model"), count(len(board.cells), "cell")
    return f"{count(len(board.cases), 'case')}, {models}, {cells}: {join_names(said) or 'nothing assessed'}."


def _header(board: Board) -> str:
    where = [date_html(board.created), text(str(board.environment.get("cpu") or ""))]
    line = tag("p", " · ".join(tag("span", piece) for piece in where if piece), class_="where")
    above = tag("p", "softmark leaderboard", class_="eyebrow")
    return tag(
        "header",
        above,
        tag("h1", text(board.title)),
        tag("p", prose(_answer_count_sentence(board)), class_="conclusion"),
        line,
    )


def _strength_section(ranked: list[ModelStrengths]) -> str:
    """Return the HTML section with the strengths of each model."""
    heads = ("Model", "Right", "Fastest", "Most accurate", "Wrong", "No result")
    head = tag("thead", tag("tr", *(tag("th", text(h), scope="col") for h in heads)))
    rows = [
        tag("tr", tag("th", text(m.model), scope="row"),
            *(tag("td", _links(names)) for names in (m.right, m.quickest, m.closest, m.wrong)),
            tag("td", text(join_few_names([f"{case} ({status.replace('_', ' ')})" for case, status in m.lost]) or "–")))
        for m in ranked
    ]  # fmt: skip
    table = tag("table", head, tag("tbody", *rows), class_="merits")
    lead = (
        "Each cell lists cases. Fastest: among the models with a right result. Most accurate: smallest error, or an "
        "equal one within the uncertainty of the reference. Both need a case with several models."
    )
    wide = tag("div", table, class_="scroll", tabindex=0, role="region", aria_label="Strengths of models")
    return section("merits", "Strengths of each model", tag("p", text(lead), class_="lead"), wide)


def _links(names: tuple[str, ...]) -> str:
    return ", ".join(tag("a", text(n), href=f"#case-{n}") for n in names) or "–"


def _provenance(board: Board) -> str:
    repeat = tag("p", "To rerun this leaderboard:") + tag("pre", tag("code", text(board.command)), class_="command")
    return section("provenance", "Provenance", repeat, table_of(dict(board.environment)))
