"""Layout of expressions: on one line if they fit, else one argument per line, with comments in their places.

To print one more node: a case in `flat`, and one in `_Layout.lines` if it can extend over several lines.
"""

from __future__ import annotations

from collections.abc import Sequence

from softmark.grammar.tree import (
    Argument,
    Binary,
    Call,
    Comment,
    Compare,
    Expression,
    List,
    Name,
    Number,
    String,
    Unary,
    Unit,
    Vector,
)

WIDTH = 100
INDENT = 4
LEVELS = {"or": 1, "and": 2, "not": 3, "compare": 4, "+": 5, "-": 5, "*": 6, "/": 6, "unary": 7, "^": 8}
ATOM = 9


class LayoutError(ValueError):
    """Exception for a tree without a textual form, or with a comment that has no place in it."""


def quote(value: str) -> str:
    """Return a text in double quotes, with quotes and backslashes in it escaped."""
    if "\n" in value or "\r" in value:
        raise LayoutError("a text cannot hold a line break")
    escaped = value.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


def format_on_one_line(node: Expression | Argument) -> str:
    """Return an expression on one line."""
    match node:
        case Number():
            return node.text + _unit(node.unit)
        case String():
            return quote(node.value)
        case Name():
            return node.text
        case Argument():
            return (
                format_on_one_line(node.value)
                if node.name is None
                else f"{node.name} = {format_on_one_line(node.value)}"
            )
        case Binary() | Compare():
            operands, operators = _chain(node)
            glue = "" if operators[0] == "^" else " "
            pairs = zip(operators, operands[1:], strict=True)
            return operands[0] + "".join(f"{glue}{operator}{glue}{operand}" for operator, operand in pairs)
        case Unary():
            return _unary_operator_text(node) + _operand_text(node.operand, binding_level(node))
        case _:
            opening, items, closing = _split_brackets(node)
            return opening + ", ".join(map(format_on_one_line, items)) + closing


def lines(
    expression: Expression,
    lead: str = "",
    trail: str = "",
    comments: Sequence[Comment] = (),
    explode: bool = False,
) -> list[str]:
    """Return the lines of an expression between `lead` and `trail`: one line if it fits, unless `explode` is true.

    Raises `LayoutError` if a comment has no place.
    """
    layout = _Layout(list(comments), explode)
    found = layout.lines(expression, "", lead, trail)
    if layout.comments:
        raise LayoutError(f"no place for the comment of line {layout.comments[0].span.line}")
    return found


class _Layout:
    """Line breaker that breaks the outermost brackets first; `comments` are those still to be placed."""

    def __init__(self, comments: list[Comment], explode: bool) -> None:
        self.comments, self.explode = comments, explode

    def lines(self, node: Expression | Argument, margin: str, lead: str, trail: str) -> list[str]:
        """Return the lines of a node, the first one after `lead` and the last one before `trail`."""
        self._refuse_comments_before(node.span.start)  # comments before an item are placed by now
        line = f"{margin}{lead}{format_on_one_line(node)}{trail}"
        if len(line) <= WIDTH and not self.explode and not self._has_comment(node):
            return [line]
        match node:
            case Argument():
                name = f"{node.name} = " if node.name else ""
                return self.lines(node.value, margin, lead + name, trail)
            case Unary():
                opening, closing = _brackets(node.operand, binding_level(node))
                return self.lines(node.operand, margin, lead + _unary_operator_text(node) + opening, closing + trail)
            case Binary(operator="^") | Number() | String() | Name():
                return [line]
            case Binary() | Compare():
                return self._chain(node, margin, lead, trail)
            case _:
                opening, items, closing = _split_brackets(node)
                return self._items(node, items, margin, lead + opening, closing + trail) if items else [line]

    def _chain(self, node: Binary | Compare, margin: str, lead: str, trail: str) -> list[str]:
        """Return one line per operand of a chain, each but the last ending in its operator."""
        self.explode = False
        operands, operators = _operands(node)
        found: list[str] = []
        for i, (operand, least) in enumerate(operands):
            opening, closing = _brackets(operand, least)
            end = f" {operators[i]}" if i < len(operators) else trail
            inner = margin + " " * INDENT if i else margin
            found += self.lines(operand, inner, opening if i else lead + opening, closing + end)
        return found

    def _items(
        self,
        node: Expression,
        items: Sequence[Expression | Argument],
        margin: str,
        opening: str,
        closing: str,
    ) -> list[str]:
        """Return one line per item of a bracket, each with a comma, and its comments before or behind it."""
        self.explode = False
        inner = margin + " " * INDENT
        found = [margin + opening]
        starts = [item.span.start for item in items[1:]] + [node.span.end]
        for item, following in zip(items, starts, strict=True):
            found += [inner + comment.text for comment in self._take(item.span.start)]
            found += self.lines(item, inner, "", ",")
            self._refuse_comments_before(item.span.end)
            if self._has_trailing_comment(item, following):
                found[-1] += f"  {self.comments.pop(0).text}"
        found += [inner + comment.text for comment in self._take(node.span.end)]
        return [*found, margin + closing]

    def _take(self, end: int) -> list[Comment]:
        """Return the next comments up to an offset of the text, and remove them from the list."""
        count = sum(comment.span.start < end for comment in self.comments)
        taken, self.comments = self.comments[:count], self.comments[count:]
        return taken

    def _refuse_comments_before(self, offset: int) -> None:
        if self.comments and self.comments[0].span.start < offset:
            raise LayoutError(f"no place for the comment of line {self.comments[0].span.line}")

    def _has_comment(self, node: Expression | Argument) -> bool:
        return bool(self.comments) and self.comments[0].span.start < node.span.end

    def _has_trailing_comment(self, item: Expression | Argument, following: int) -> bool:
        """Return whether the next comment is on the line on which `item` ends, before the following item."""
        if not self.comments:
            return False
        span = self.comments[0].span
        return span.line == item.span.end_line and span.start < following


# ------------------------------------------------------------------------ parts of expressions


def _unit(unit: Unit | None) -> str:
    return f" {unit.text}" if unit else ""


def _unary_operator_text(node: Unary) -> str:
    return "not " if node.operator == "not" else node.operator


def _split_brackets(node: Call | Vector | List) -> tuple[str, Sequence[Expression | Argument], str]:
    """Return the opening bracket, the items inside, and the closing bracket."""
    match node:
        case Call():
            return f"{node.function.text}(", node.arguments, ")"
        case Vector():
            return "(", node.items, f"){_unit(node.unit)}"
        case List():
            return "[", node.items, f"]{_unit(node.unit)}"


def binding_level(node: Expression) -> int:
    """Return how tightly the outermost operator of an expression binds; `ATOM` if it has no operator."""
    match node:
        case Binary():
            return LEVELS[node.operator]
        case Compare():
            return LEVELS["compare"]
        case Unary():
            return LEVELS["not" if node.operator == "not" else "unary"]
        case _:
            return ATOM


def _brackets(node: Expression, least: int) -> tuple[str, str]:
    """Return the brackets around an operand: empty unless its operator binds less tightly than `least`."""
    return ("(", ")") if binding_level(node) < least else ("", "")


def _operand_text(node: Expression, least: int) -> str:
    opening, closing = _brackets(node, least)
    return opening + format_on_one_line(node) + closing


def _operands(node: Binary | Compare) -> tuple[list[tuple[Expression, int]], list[str]]:
    """Return the operands of `a + b - c` or `a < b < c`, each with its required level, and the operators."""
    binding = binding_level(node)
    if isinstance(node, Compare):
        return [(operand, binding + 1) for operand in node.operands], list(node.operators)
    operands, operators, left = [(node.right, binding + 1)], [node.operator], node.left
    while isinstance(left, Binary) and binding_level(left) == binding:
        operands.append((left.right, binding + 1))
        operators.append(left.operator)
        left = left.left
    return [(left, binding), *operands[::-1]], list(operators[::-1])


def _chain(node: Binary | Compare) -> tuple[list[str], list[str]]:
    """Return the operands of a chain as text, and its operators.

    A power has two operands and groups to the right.
    """
    if isinstance(node, Binary) and node.operator == "^":
        base = format_on_one_line(node.left)
        if binding_level(node.left) < ATOM or getattr(node.left, "unit", None):
            base = f"({base})"
        return [base, _operand_text(node.right, LEVELS["unary"])], ["^"]
    operands, operators = _operands(node)
    return [_operand_text(operand, least) for operand, least in operands], operators
