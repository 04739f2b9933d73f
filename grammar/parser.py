"""Parser that converts text to a syntax tree.

`parse` reads a scene, and `parse_expression` an override such as `-p L=120mm`. The lexer, the splitting into
declarations and the LALR parser run in one pass, and give at most one diagnostic for each declaration. A declaration
with an error is left out of the tree, and its name is added to `Tree.broken`. To add a rule of `scene.lark`: one method
of `_TreeBuilder`.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cached_property
from typing import Any, cast

from softmark.grammar import common_slips, input_limits
from softmark.grammar.diagnostic import Diagnostic, Source
from softmark.grammar.lalr_driver import END, Builder, UnexpectedToken, run
from softmark.grammar.lexer import Token, lex
from softmark.grammar.parse_table import load
from softmark.grammar.statement_splitting import Chunk, declarations, single_chunk
from softmark.grammar.tree import (
    Argument,
    Binary,
    Call,
    Compare,
    Declare,
    Expect,
    Expression,
    List,
    Name,
    Number,
    Param,
    Span,
    String,
    Title,
    Tree,
    Unary,
    Unit,
    Use,
    Vector,
    Version,
    span_between,
)

MAX_DIAGNOSTICS = 20
# cached trees of declarations: an editor parses after each keystroke, and most of the text is unchanged
KEPT = 1500
_parsed: dict[tuple[Token, ...], Any] = {}


def parse(source: Source) -> tuple[Tree, list[Diagnostic]]:
    """Return the tree of a scene, and the diagnostics of its text."""
    if binary := input_limits.report_binary_file(source):
        return Tree(()), [binary]
    tokens, comments = lex(source.text)
    parser = _Parser(source, "declaration")
    found = [tree for chunk in declarations(tokens) for tree in parser.parse(chunk)]
    return Tree(tuple(found), tuple(comments), tuple(parser.broken)), parser.diagnostics()


def parse_expression(source: Source) -> tuple[Expression | None, list[Diagnostic]]:
    """Return the tree of a text that is one expression, or None if it has an error, and the diagnostics."""
    if binary := input_limits.report_binary_file(source):
        return None, [binary]
    parser = _Parser(source, "expression")
    found = parser.parse(single_chunk(lex(source.text).tokens))
    return (found[0] if found else None), parser.diagnostics()


class _Parser:
    """Parser of one chunk after the other, which keeps the first diagnostic of each chunk."""

    def __init__(self, source: Source, start: str) -> None:
        self.source, self.start = source, start
        self.broken: list[str] = []
        self._shown: list[Diagnostic] = []
        self._hidden = 0
        self._build = _TreeBuilder(source)

    def diagnostics(self) -> list[Diagnostic]:
        """Return at most `MAX_DIAGNOSTICS` diagnostics, and one more with the number of those not shown."""
        if not self._hidden:
            return self._shown
        return [*self._shown, input_limits.report_hidden_diagnostics(self.source, self._shown[-1], self._hidden)]

    def parse(self, chunk: Chunk) -> list[Any]:
        """Return the declarations in a chunk: none if it has an error, several if several are on one line."""
        found = []
        rest: Chunk | None = chunk
        while rest is not None:
            tree, rest = self._parse_declaration(rest)
            if tree is not None:
                found.append(tree)
            self._build.first = False
        return found

    def _parse_declaration(self, chunk: Chunk) -> tuple[Any, Chunk | None]:
        """Return the tree of a chunk or None, and the remaining chunk if a second declaration starts on its line."""
        if problem := input_limits.report_oversized(self.source, chunk):
            self._record_failure(chunk, lambda: problem)
            return None, None
        key = tuple(chunk.tokens) if self.start == "declaration" else ()
        if key in _parsed:
            return _parsed[key], None
        tokens = [*chunk.tokens, _end(chunk)]
        self._build.problems.clear()
        tree = run(load(), self._build.methods, tokens, self.start)
        if isinstance(tree, UnexpectedToken):
            return None, self._report_unexpected(chunk, tokens, tree.index)
        if len(tokens) > input_limits.MAX_DEPTH:
            self._build.note(input_limits.report_deep_nesting(self.source, tree))
        if self._build.problems:
            self._record_failure(chunk, lambda: self._build.problems[0])
            return None, None
        if key and not isinstance(
            tree, Version
        ):  # not cached, because its error depends on its place: it must come first
            if len(_parsed) >= KEPT:
                _parsed.clear()
            _parsed[key] = tree
        return tree, None

    def _report_unexpected(self, chunk: Chunk, tokens: list[Token], index: int) -> Chunk | None:
        """Report the unexpected token, and return the remaining chunk if a second declaration starts there."""
        second = common_slips.second_declaration(tokens, index) if self.start == "declaration" else None
        slip = common_slips.Slip(self.source, chunk, tokens, index, self.start, second)
        self._record_failure(chunk, lambda: min([*self._build.problems, common_slips.explain(slip)], key=_start))
        return _remaining_chunk(tokens, second) if second and not self._hidden else None

    def _record_failure(self, chunk: Chunk, explain: Callable[[], Diagnostic]) -> None:
        self.broken.extend(common_slips.declared_names(chunk.tokens))
        if len(self._shown) < MAX_DIAGNOSTICS:
            self._shown.append(explain())
        else:
            self._hidden += 1


def _start(diagnostic: Diagnostic) -> int:
    return diagnostic.span.start if diagnostic.span else 0


def _end(chunk: Chunk) -> Token:
    last = chunk.tokens[-1].span if chunk.tokens else Span(0, 0, 1, 1, 1, 1)
    return Token(END, "", last.end, last.end_line, last.end_column)


def _remaining_chunk(tokens: list[Token], start: int) -> Chunk:
    """Return the chunk that starts with the second declaration of a line.

    The kind of that declaration may have been read as a unit.
    """
    first, *others = tokens[start:-1]
    return single_chunk([first._replace(kind="NAME") if first.kind == "UNIT" else first, *others])


class _TreeBuilder:
    """Builder of tree nodes: one method for each rule of `scene.lark`, which takes the values of the rule's symbols.

    Violations that the grammar cannot express (a number's range, the order of arguments) are added to `problems`.
    """

    def __init__(self, source: Source) -> None:
        self.source = source
        self.problems: list[Diagnostic] = []
        self.first = True  # no declaration came before

    @cached_property
    def methods(self) -> Builder:
        """Return the methods, by the names that `scene.lark` gives to the rules."""
        return {rule.method: getattr(self, rule.method) for rule in load().rules if rule.method}

    def note(self, problem: Diagnostic | None) -> None:
        """Record a problem of the current declaration, unless it is None."""
        if problem:
            self.problems.append(problem)

    # ------------------------------------------------------------------ declarations

    def version(self, values: list[Token]) -> Version:
        """Build the declaration `softmark 1`, which must come first and have a known version."""
        word, number = values
        self.note(input_limits.report_version(self.source, number, _span_of_tokens(word, number), self.first))
        return Version(int(number.text) if number.text.isdecimal() else 0, _span_of_tokens(word, number))

    def title(self, values: list[Token]) -> Title:
        """Build `scene "title"`."""
        word, text = values
        return Title(self._text(text), _span_of_tokens(word, text))

    def use(self, values: list[Token]) -> Use:
        """Build `use "path" as name`."""
        word, path, _, name = values
        return Use(self._text(path), name.text, _span_of_tokens(word, name), path.span, name.span)

    def param(self, values: list[Any]) -> Param:
        """Build `param name = value in low .. high`."""
        word, name, _, value, *bounds = values
        low, high = (bounds[1], bounds[3]) if bounds else (None, None)
        span = span_between(word.span, (high or value).span)
        return Param(name.text, value, low, high, span, name.span)

    def expect(self, values: list[Any]) -> Expect:
        """Build `expect condition`."""
        word, condition = values
        return Expect(condition, span_between(word.span, condition.span))

    def declare(self, values: list[Any]) -> Declare:
        """Build `kind name = value`."""
        kind, name, _, value = values
        if kind.text in input_limits.FOREIGN_KINDS:
            self.note(input_limits.foreign_word(self.source, kind, input_limits.FOREIGN_KINDS[kind.text]))
        return Declare(kind.text, name.text, value, span_between(kind.span, value.span), kind.span, name.span)

    # ------------------------------------------------------------------- expressions

    def binary(self, values: list[Any]) -> Binary:
        """Build `left operator right`."""
        left, operator, right = values
        return Binary(operator.text, left, right, span_between(left.span, right.span))

    def power(self, values: list[Any]) -> Binary:
        """Build `base^exponent`; `5 m ^ 2` could mean `5 m^2` or `(5 m)^2`."""
        base, _, exponent = values
        span = span_between(base.span, exponent.span)
        unit = getattr(base, "unit", None)
        if unit and unit.span.end == base.span.end:
            self.note(input_limits.power_of_quantity(self.source, base, unit, exponent))
        return Binary("^", base, exponent, span)

    def unary(self, values: list[Any]) -> Unary:
        """Build `operator operand`."""
        operator, operand = values
        return Unary(operator.text, operand, span_between(operator.span, operand.span))

    def compare(self, values: list[Any]) -> Compare:
        """Build `a < b < c`."""
        operators = tuple(token.text for token in values[1::2])
        return Compare(tuple(values[::2]), cast(Any, operators), span_between(values[0].span, values[-1].span))

    def number(self, values: list[Token]) -> Number:
        """Build a number with a unit; report underflow to zero and overflow to infinity."""
        digits = values[0]
        value = float(digits.text)
        self.note(input_limits.report_number_range(self.source, digits, value))
        unit = _unit(values)
        return Number(value, unit, digits.text, span_between(digits.span, unit.span) if unit else digits.span)

    def string(self, values: list[Token]) -> String:
        """Build a text in double quotes."""
        return String(self._text(values[0]), values[0].span)

    def name(self, values: list[Token]) -> Name:
        """Build a name, possibly with dots."""
        return Name(tuple(values[0].text.split(".")), values[0].span)

    def group(self, values: list[Any]) -> Expression:
        """Build a bracketed expression, whose span includes the brackets."""
        opening, inner, closing = values
        fields = {name: getattr(inner, name) for name in inner.__slots__}
        return cast(Expression, type(inner)(**fields | {"span": _span_of_tokens(opening, closing)}))

    def vector(self, values: list[Any]) -> Vector:
        """Build `(a, b, c) unit`."""
        return Vector(_without_tokens(values), _unit(values), _span_of_tokens(values[0], values[-1]))

    def series(self, values: list[Any]) -> List:
        """Build `[a, b, c] unit`."""
        return List(_without_tokens(values), _unit(values), _span_of_tokens(values[0], values[-1]))

    def call(self, values: list[Any]) -> Call:
        """Build `function(argument, name = argument)`."""
        arguments = tuple(value for value in values if isinstance(value, Argument))
        named = False
        for argument in arguments:
            if named and argument.name is None:
                self.note(input_limits.positional_after_named(self.source, argument))
                break
            named = argument.name is not None
        return Call(self.name(values[:1]), arguments, _span_of_tokens(values[0], values[-1]))

    def argument(self, values: list[Any]) -> Argument:
        """Build `name = value` or `value`."""
        if len(values) == 1:
            return Argument(None, values[0], values[0].span)
        name, _, value = values
        return Argument(name.text, value, span_between(name.span, value.span), name.span)

    def _text(self, token: Token) -> str:
        r"""Return the content of a quoted text: `\"` is a quote, `\\` a backslash."""
        if "\\" not in token.text:
            return token.text[1:-1]
        self.note(input_limits.report_escape(self.source, token))
        return re.sub(r"\\(.)", r"\1", token.text[1:-1])


def _span_of_tokens(first: Token, last: Token) -> Span:
    return Span(first.start, last.end, first.line, first.column, last.line, last.column + len(last.text))


def _unit(values: list[Any]) -> Unit | None:
    last = values[-1]
    return Unit(last.text, last.span) if last.kind == "UNIT" else None


def _without_tokens(values: list[Any]) -> tuple[Any, ...]:
    return tuple(value for value in values if not isinstance(value, Token))
