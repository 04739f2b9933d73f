"""Printer that converts a syntax tree to text in the canonical form of a scene, described in README.md.

`format_source` returns a text only after parsing it again and finding the same tree and comments.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby

from softmark.grammar.diagnostic import Diagnostic, Source
from softmark.grammar.lexer import BREAK
from softmark.grammar.parser import parse
from softmark.grammar.source_layout import LEVELS, WIDTH, LayoutError, binding_level, format_on_one_line, lines, quote
from softmark.grammar.tree import (
    Comment,
    Declaration,
    Declare,
    Expression,
    Param,
    Title,
    Tree,
    Use,
    Version,
    expressions,
)


class CannotFormat(Exception):
    """Exception for a text that has no canonical form with the same meaning and must stay unchanged."""

    def __init__(self, reason: str, diagnostics: Sequence[Diagnostic] = ()) -> None:
        super().__init__(reason)
        self.reason, self.diagnostics = reason, tuple(diagnostics)


def format_source(source: Source) -> str:
    """Return the canonical form of a scene. Raises `CannotFormat` if that would lose a part of it."""
    tree, diagnostics = parse(source)
    if diagnostics:
        raise CannotFormat(f"{source.name} does not parse", diagnostics)
    text = print_tree(tree, source.text)
    again, wrong = parse(Source(source.name, text))
    if wrong or again != tree:
        raise CannotFormat(f"the canonical form of {source.name} would change its meaning")
    if [comment.text for comment in again.comments] != [comment.text for comment in tree.comments]:
        raise CannotFormat(f"the canonical form of {source.name} would lose or swap comments")
    return text


def print_tree(tree: Tree, text: str | None = None) -> str:
    """Return the text of a tree with its comments. Raises `CannotFormat` for a tree without a textual form.

    `text` is the parsed source. A declaration with a comment where the canonical form has no place for one (between an
    operator and its operand) is copied from it unchanged.
    """
    try:
        rows = list(_rows(tree))
        found = [line for block in _split_into_blocks(rows) for line in _print_block(block, text)]
    except LayoutError as problem:
        raise CannotFormat(str(problem)) from problem
    return "".join(f"{line}\n" for line in found)


def print_expression(expression: Expression) -> str:
    """Return the text of an expression on one line. Raises `CannotFormat` for a tree without a textual form."""
    try:
        return format_on_one_line(expression)
    except LayoutError as problem:
        raise CannotFormat(str(problem)) from problem


# ----------------------------------------------------------- rows: a declaration or a comment


@dataclass(slots=True)
class _Row:
    """Declaration with the comments inside and behind it, or a comment on a line of its own."""

    declaration: Declaration | None
    inner: list[Comment]
    behind: Comment | None
    blank: bool  # a blank line before


def _rows(tree: Tree) -> Iterator[_Row]:
    """Yield declarations and comments in the order of the text."""
    comments = list(reversed(tree.comments))
    line = 0  # where the last row ended
    for declaration in tree.declarations:
        span = declaration.span
        while comments and comments[-1].span.start < span.start:
            yield _comment_row(comments[-1], line)
            line = comments.pop().span.line
        row = _Row(declaration, [], None, bool(line) and span.line > line + 1)
        while comments and comments[-1].span.start < span.end:
            row.inner.append(comments.pop())
        if comments and comments[-1].span.line == span.end_line:
            row.behind = comments.pop()
        line = span.end_line
        yield row
    for comment in reversed(comments):
        yield _comment_row(comment, line)
        line = comment.span.line


def _comment_row(comment: Comment, line: int) -> _Row:
    return _Row(None, [], comment, bool(line) and comment.span.line > line + 1)


def _split_into_blocks(rows: Iterable[_Row]) -> Iterator[list[_Row]]:
    """Yield groups of rows, split at blank lines and around comments on lines of their own."""
    block: list[_Row] = []
    for row in rows:
        if block and (row.blank or not row.declaration or not block[-1].declaration):
            yield block
            block = []
        block.append(row)
    if block:
        yield block


# ------------------------------------------------------------------------ blocks to lines


def _print_block(block: list[_Row], text: str | None) -> list[str]:
    blank = [""] if block[0].blank else []
    if not block[0].declaration:
        return blank + [row.behind.text for row in block if row.behind]
    return blank + _append_comments(list(_print_declarations(block, text)), [row.behind for row in block])


def _print_declarations(block: list[_Row], text: str | None) -> Iterator[list[str]]:
    """Yield the lines of each declaration; adjacent declarations of one line each are aligned."""
    for aligns, run in groupby(block, _is_alignable):
        if aligns:
            yield from _align_declarations([row.declaration for row in run])
        else:
            yield from (_print_declaration(row, text) for row in run)


def _is_alignable(row: _Row) -> bool:
    if not isinstance(row.declaration, Param | Declare) or row.inner:
        return False
    return len(_one_line(row.declaration)) <= WIDTH


def _align_declarations(run: list[Declaration | None]) -> Iterator[list[str]]:
    """Yield declarations with aligned names and `=`; one that would become too long is broken into lines instead."""
    fits = [len(line) <= WIDTH for line in _aligned_lines(run)]
    for fit, part in groupby(zip(fits, run, strict=True), lambda pair: pair[0]):
        declarations = [declaration for _, declaration in part]
        if fit:
            yield from ([line] for line in _aligned_lines(declarations))
        else:
            yield from (_lines(declaration, explode=True) for declaration in declarations)


def _aligned_lines(run: list[Declaration | None]) -> list[str]:
    words = [(_kind(d), d.name, _value(d)) for d in run if isinstance(d, Param | Declare)]
    kinds, names = (max(len(word[i]) for word in words) for i in (0, 1))
    return [f"{kind:<{kinds}} {name:<{names}} = {value}" for kind, name, value in words]


def _append_comments(declarations: list[list[str]], comments: list[Comment | None]) -> list[str]:
    """Return the lines of declarations with their comments; those of adjacent single lines form one column."""
    found: list[str] = []
    for single, pairs in groupby(zip(declarations, comments, strict=True), lambda pair: len(pair[0]) == 1):
        stretch = list(pairs)
        column = max((len(rows[-1]) for rows, comment in stretch if comment), default=0) if single else 0
        for rows, comment in stretch:
            found += rows[:-1]
            found.append(f"{rows[-1]:<{column}}  {comment.text}" if comment else rows[-1])
    return found


# ------------------------------------------------------------------- one declaration to lines


def _print_declaration(row: _Row, text: str | None) -> list[str]:
    """Return the lines of a declaration with comments at its arguments, or unchanged if that is impossible."""
    try:
        return _lines(row.declaration, row.inner)
    except LayoutError:
        if text is None or not row.inner or not row.declaration:
            raise
        span = row.declaration.span
        return [line.rstrip(" \t") for line in re.split(BREAK, text[span.start : span.end])]


def _lines(declaration: Declaration | None, comments: Sequence[Comment] = (), explode: bool = False) -> list[str]:
    if declaration is None:
        return []
    values = expressions(declaration)
    if not values and not comments:
        return [_one_line(declaration)]
    if not values:
        raise LayoutError(f"no place for the comment of line {comments[0].span.line}")
    return lines(values[0], _text_before_value(declaration), _range(declaration), comments, explode)


def _one_line(declaration: Declaration) -> str:
    """Return the text of a declaration on one line."""
    match declaration:
        case Version():
            return f"softmark {declaration.number}"
        case Title():
            return f"scene {quote(declaration.text)}"
        case Use():
            return f"use {quote(declaration.path)} as {declaration.alias}"
        case _:
            return _text_before_value(declaration) + _value(declaration)


def _kind(declaration: Param | Declare) -> str:
    return declaration.kind if isinstance(declaration, Declare) else "param"


def _text_before_value(declaration: Declaration) -> str:
    if isinstance(declaration, Param | Declare):
        return f"{_kind(declaration)} {declaration.name} = "
    return "expect "


def _value(declaration: Declaration) -> str:
    return format_on_one_line(expressions(declaration)[0]) + _range(declaration)


def _range(declaration: Declaration) -> str:
    match declaration:
        case Param(low=low, high=high) if low is not None and high is not None:
            return f" in {_bound(low)} .. {_bound(high)}"
        case _:
            return ""


def _bound(expression: Expression) -> str:
    """Return the text of a bound of a range, in brackets if its operator binds less tightly than a sum."""
    return (
        format_on_one_line(expression)
        if binding_level(expression) >= LEVELS["+"]
        else f"({format_on_one_line(expression)})"
    )
