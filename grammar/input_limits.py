"""Diagnostics of text that fits the grammar but that the language forbids, by size, order or escapes."""

from __future__ import annotations

import math
import re

from softmark.grammar.diagnostic import Diagnostic, Fix, Source
from softmark.grammar.lexer import BREAK, Token
from softmark.grammar.statement_splitting import MAX_NESTING, Chunk
from softmark.grammar.tree import Argument, Declaration, Expression, Number, Span, Unit, expressions, span_between, walk

VERSIONS = (1,)  # supported versions of the language
MAX_LITERAL = 400  # characters of a number, a text, a name or a unit
MAX_DEPTH = 150  # nesting depth that a recursive walk over the tree can handle
FOREIGN_KINDS = {"let": "param", "const": "param", "var": "param", "import": "use", "include": "use"}
EXAMPLES = {
    "use": 'use "tissues.scene" as tissue',
    "param": "param h = 5 mm",
    "expect": "expect rod.eta < 5 %",
}


# ------------------------------------------------------------------------ of the whole text


def report_binary_file(source: Source) -> Diagnostic | None:
    """Report a NUL byte, which shows that the file is not a scene."""
    place = source.text.find("\0")
    if place < 0:
        return None
    lines = re.split(BREAK, source.text[:place])
    line, column = len(lines), len(lines[-1]) + 1
    span = Span(place, place + 1, line, column, line, column + 1)
    help = "save the scene as text in UTF-8"
    return Diagnostic("E125", "this is not a text file", source, span, "a NUL character", help)


def report_hidden_diagnostics(source: Source, last: Diagnostic, hidden: int) -> Diagnostic:
    """Return a diagnostic with the number of diagnostics that are not shown."""
    count = f"{hidden} more syntax error{'s' if hidden > 1 else ''}"
    verb, help = "are" if hidden > 1 else "is", "correct the errors above first"
    return Diagnostic("E199", f"{count} {verb} not shown", source, last.span, "the last one shown", help)


# ---------------------------------------------------------------------- of one declaration


def report_oversized(source: Source, chunk: Chunk) -> Diagnostic | None:
    """Report brackets that are nested too deeply, or a literal that is too long."""
    if chunk.too_deep:
        message = f"brackets are nested deeper than {MAX_NESTING}"
        return Diagnostic("E122", message, source, chunk.too_deep.span, "one bracket too many")
    for token in chunk.tokens:
        if len(token.text) > MAX_LITERAL and token.kind in ("NUMBER", "STRING", "NAME", "PATH", "UNIT"):
            message = f"this is {len(token.text)} characters long; the longest allowed is {MAX_LITERAL}"
            return Diagnostic("E121", message, source, token.span)
    return None


def report_deep_nesting(source: Source, tree: Declaration | Expression) -> Diagnostic | None:
    """Report operations that are nested too deeply for functions that walk over the tree."""
    for part in expressions(tree) if isinstance(tree, Declaration) else (tree,):
        for node, depth in walk(part):
            if depth > MAX_DEPTH:
                message = f"the expression is nested deeper than {MAX_DEPTH} operations"
                help = "give a part of it its own name with `param`"
                return Diagnostic("E122", message, source, node.span, "too deep", help)
    return None


def report_version(source: Source, number: Token, span: Span, first: bool) -> Diagnostic | None:
    """Report an unknown version of the language, or a version after another declaration."""
    if number.text not in map(str, VERSIONS):
        known = f"known: {', '.join(map(str, VERSIONS))}"
        message = f"version {number.text} of the language is not known"
        return Diagnostic("E123", message, source, number.span, known, "a newer version of softmark may support it")
    if not first:
        message = "the language version is not the first declaration"
        return Diagnostic("E123", message, source, span, help="move it to the first line")
    return None


def foreign_word(source: Source, word: Token, instead: str) -> Diagnostic:
    """Return the diagnostic for a keyword of another language, such as `import` or `let`."""
    message = f"`{word.text}` is not a word of the language; it is called `{instead}` here"
    return Diagnostic("E116", message, source, word.span, help=f"as in `{EXAMPLES[instead]}`", fix=Fix(instead))


# ------------------------------------------------------------------------ of one expression


def report_number_range(source: Source, digits: Token, value: float) -> Diagnostic | None:
    """Report numbers that underflow to zero or overflow to infinity."""
    if not math.isinf(value) and (value or not re.match(r"[0.]*[1-9]", digits.text)):
        return None
    size, label = ("large", "larger than 1.8e308") if value else ("small", "smaller than 4.9e-324")
    return Diagnostic("E120", f"the number is too {size}", source, digits.span, label)


def positional_after_named(source: Source, argument: Argument) -> Diagnostic:
    """Return the diagnostic for an unnamed argument after a named one, or for the digits after a decimal comma."""
    start, text = argument.span.start, source.text
    if isinstance(argument.value, Number) and re.search(r"[0-9],\Z", text[max(0, start - 2) : start]):
        help, at = "write a point, as in `0.49`", argument.span
        comma = Span(start - 1, start, at.line, at.column - 1, at.line, at.column)
        return Diagnostic(
            "E113", "the decimal sign is a point", source, at, "after a comma", help, fix=Fix(".", comma)
        )  # fmt: skip
    message = "an argument without a name after one with a name"
    return Diagnostic("E119", message, source, argument.span, "its name is missing", "write `name = value`")


def power_of_quantity(source: Source, base: Expression, unit: Unit, exponent: Expression) -> Diagnostic:
    """Return the diagnostic for an ambiguous power such as `5 m ^ 2`, which may mean 5 or 25 square metres."""
    quantity = source.text[base.span.start : unit.span.end]
    power = source.text[exponent.span.start : exponent.span.end]
    span, end = unit.span, exponent.span
    span = Span(span.start, end.end, span.line, span.column, end.end_line, end.end_column)
    help = f"write `({quantity})^{power}` for a power of the quantity"
    if isinstance(exponent, Number) and not exponent.unit and "^" not in unit.text:
        help = f"write `{quantity}^{power}` for the unit, `({quantity})^{power}` for the quantity"
    message, fix = "this power is ambiguous: it may apply to the unit or to the quantity", None
    if "^" in unit.text:
        message = "this power is ambiguous: the unit already has a power"
        fix = Fix(f"({quantity})^{power}", span_between(base.span, exponent.span))
    return Diagnostic("E127", message, source, span, help=help, fix=fix)


def report_escape(source: Source, token: Token) -> Diagnostic | None:
    """Report a backslash before anything but a quote or a backslash."""
    wrong = re.match(r'"(?:[^\\]|\\["\\])*?(\\[^"\\])', token.text)
    if not wrong:
        return None
    start, column = token.start + wrong.start(1), token.column + wrong.start(1)
    span = Span(start, start + 2, token.line, column, token.line, column + 2)
    message = f"`{wrong[1]}` is not an escape sequence"
    return Diagnostic("E124", message, source, span, help='use only `\\"` and `\\\\`; write paths with `/`')
