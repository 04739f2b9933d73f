"""Outline, folds, colours, the canonical form, quick fixes and lenses of texts."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("lsprotocol")

from lsprotocol import types
from marked_texts import Marked, after, marked, whole
from pygls.protocol import json_rpc

from softmark.interpreter.language_server import (
    code_lenses,
    document_formatting,
    document_symbols,
    quick_fixes,
    semantic_tokens,
)
from softmark.interpreter.language_server.request_error import RequestRefused, silence_refusals

pytestmark = pytest.mark.slow

TEXT = """softmark 1
scene "A block 🧊" # cold

# what it is
# made of
param a = 2 * 5 mm
material gel = neo_hookean(
    young = 60 kPa, poisson = 0.49, density = 1000 kg/m^3,
)
body b = solid(box(size = (a, a, a)), gel)

model one = fem(tet4, strain = small, size = a)
model two = beam6dof(segments = 2)
metric end = displacement(p, along = -z)
expect one.end < 1 mm
study s = sweep(a, over = [10, 5] mm)
study edges = robustness(over = [a])
"""
NOTHING: Any = None


def test_an_outline_has_every_declaration_with_its_constructor(tmp_path: Path) -> None:
    found = document_symbols.symbols(marked(TEXT, tmp_path).document, NOTHING)
    assert [(s.name, s.detail) for s in found][:4] == [
        ("a", "param"), ("gel", "material, neo_hookean"), ("b", "body, solid"), ("one", "model, fem")
    ]  # fmt: skip
    assert found[-3].name == "one.end < 1 mm"
    assert found[1].range.end.line - found[1].range.start.line == 2
    assert all(s.range.start <= s.selection_range.start <= s.selection_range.end <= s.range.end for s in found)


def test_names_are_found_in_all_that_is_open(tmp_path: Path) -> None:
    own = marked(TEXT, tmp_path)
    found = document_symbols.find_workspace_symbols(own.opened, types.WorkspaceSymbolParams("GE"))
    assert [(s.name, s.location.uri) for s in found] == [("gel", own.uri), ("edges", own.uri)]


def test_declarations_comments_and_paragraphs_fold(tmp_path: Path) -> None:
    found = document_symbols.folds(marked(TEXT, tmp_path).document, NOTHING)
    assert [(f.start_line, f.end_line) for f in found] == [(3, 4), (4, 9), (6, 8)]
    broken = document_symbols.folds(marked("model m = fem(\n  tet4,\n  size =\n", tmp_path).document, NOTHING)
    assert [(f.start_line, f.end_line) for f in broken] == [(0, 2)]


def words(own: Marked) -> list[tuple[str, str]]:
    """The words of a text and their kinds, by the numbers of the protocol."""
    numbers = semantic_tokens.colours(own.document, NOTHING).data
    found, line, column = [], 0, 0
    for below, aside, length, kind, _ in zip(*(iter(numbers),) * 5, strict=True):
        line, column = line + below, aside + (0 if below else column)
        start, end = (own.document.offset(types.Position(line, c)) for c in (column, column + length))
        found.append((own.document.text[start:end], semantic_tokens.LEGEND.token_types[kind]))
    return found


def test_every_word_has_the_colour_of_its_meaning(tmp_path: Path) -> None:
    found = words(marked(TEXT, tmp_path))
    for pair in (
        ("scene", "keyword"), ('"A block 🧊"', "string"), ("# cold", "comment"), ("a", "parameter"), ("mm", "type"),
        ("material", "keyword"), ("neo_hookean", "function"), ("young", "property"), ("60", "number"),
        ("gel", "variable"), ("small", "enumMember"), ("tet4", "enumMember"), ("z", "enumMember"), ("=", "operator"),
        ("one", "variable"), ("end", "variable"),
    ):  # fmt: skip
        assert pair in found
    assert ("tet4", "variable") not in found
    lines = types.Range(types.Position(5, 0), types.Position(5, 5))
    params = types.SemanticTokensRangeParams(types.TextDocumentIdentifier(""), lines)
    part = semantic_tokens.colours_between(marked(TEXT, tmp_path).document, params).data
    assert part[0] == 5
    assert len(part) == 5 * 7  # param a = 2 * 5 mm


def test_a_text_is_given_its_canonical_form_and_left_alone_where_it_cannot_be_read(tmp_path: Path) -> None:
    own = marked("param a=1 mm\nparam   bc =2 mm\n", tmp_path)
    edits = document_formatting.format_document(own.document, NOTHING)
    assert after(own.document, edits) == "param a  = 1 mm\nparam bc = 2 mm\n"
    assert document_formatting.format_document(marked(after(own.document, edits), tmp_path).document, NOTHING) == []
    with pytest.raises(RequestRefused, match="not formatted: line 2 cannot be read, E104"):
        document_formatting.format_document(marked("param a=1 mm\nparam b = (1\n", tmp_path).document, NOTHING)


def test_a_refusal_leaves_no_traceback_in_an_editor_s_panel_and_a_fault_does(caplog: pytest.LogCaptureFixture) -> None:
    silence_refusals()
    silence_refusals()  # of two servers in a process
    for problem in (RequestRefused("not formatted"), ValueError("a fault")):
        try:
            raise problem
        except Exception:
            json_rpc.logger.exception("Exception occurred")  # as pygls does of both
    assert [r.exc_info[0] for r in caplog.records if r.exc_info] == [ValueError]


def quick(own: Marked, only: list[str] | None = None) -> list[types.CodeAction]:
    """The actions of a whole text."""
    context = types.CodeActionContext([], only=only)
    asked = types.CodeActionParams(types.TextDocumentIdentifier(own.uri), whole(own.document), context)
    return quick_fixes.actions(own.document, asked)


def test_a_message_that_names_what_was_meant_is_a_quick_fix(tmp_path: Path) -> None:
    own = marked("param E = 60 kpa\nparam L = 3 m // long\nparam n = 2 * EE\nparam k = 4;\n", tmp_path)
    found = quick(own)
    assert [a.title for a in found] == [
        "write `# long` for `// long`", "remove `;`", "write `kPa` for `kpa`", "apply the fixes of the messages"
    ]  # fmt: skip
    assert [a.diagnostics[0].code for a in found if a.diagnostics] == ["E108", "E107", "E209"]
    change = found[-1].edit
    assert change is not None
    assert change.changes is not None
    text = after(own.document, list(change.changes[own.uri]))
    assert text == "param E = 60 kPa\nparam L = 3 m # long\nparam n = 2 * EE\nparam k = 4\n"
    assert quick(own, ["refactor"]) == []
    assert [a.kind for a in quick(own, ["source"])] == ["source.fixAll"]


def test_a_lens_runs_and_compares(tmp_path: Path) -> None:
    own = marked(TEXT, tmp_path)
    found = [lens.command for lens in code_lenses.lenses(own.document, NOTHING)]
    file = str(tmp_path / "some.scene")
    assert [(c.title, c.command, c.arguments) for c in found if c] == [
        ("run", "softmark.run", [file]),
        ("compare", "softmark.compare", [file]),
        ("run one", "softmark.run", [file, "--model", "one"]),
        ("run two", "softmark.run", [file, "--model", "two"]),
        ("compare", "softmark.compare", [file, "--study", "s"]),
        ("stress", "softmark.stress", [file, "--study", "edges"]),
    ]
