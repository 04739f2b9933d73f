"""The syntax tree: one frozen dataclass per rule of `scene.lark`, each with the span of text it came from.

To add a node: one class here, one rule in `scene.lark`, one method in `parser.py`, one in `printer.py`.
Two trees are equal when they mean the same: spans take no part in the comparison.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal, TypeAlias


@dataclass(slots=True, unsafe_hash=True)  # and never changed: a frozen one takes three times as long to make
class Span:
    """A stretch of a source text; lines and columns count from 1, in code points; the end is outside."""

    start: int  # offset of the first character
    end: int  # offset after the last character
    line: int
    column: int
    end_line: int
    end_column: int


def between(first: Span, last: Span) -> Span:
    """The span from the start of `first` to the end of `last`."""
    return Span(first.start, last.end, first.line, first.column, last.end_line, last.end_column)


# ---------------------------------------------------------------------- expressions


@dataclass(frozen=True, slots=True)
class Unit:
    """`kg/m^3`: the text after a number, a vector or a list, not yet looked up."""

    text: str
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Number:
    """`60`, `60 kPa`, `5 %`; `text` keeps the digits as written."""

    value: float
    unit: Unit | None
    text: str = field(compare=False)
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class String:
    """`"silicone.vtk"`; `value` is the text between the quotes, escapes resolved."""

    value: str
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Name:
    """`h`, `rod.eta`, `tissue.liver.young`: names joined by dots."""

    parts: tuple[str, ...]
    span: Span = field(compare=False, repr=False)

    @property
    def text(self) -> str:
        """The name as written, dots included."""
        return self.parts[0] if len(self.parts) == 1 else ".".join(self.parts)


@dataclass(frozen=True, slots=True)
class Vector:
    """`(0, 0, -9.81) m/s^2`: at least two items; a unit multiplies every item that has none."""

    items: tuple[Expression, ...]
    unit: Unit | None
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class List:
    """`[10, 5, 2.5] mm`."""

    items: tuple[Expression, ...]
    unit: Unit | None
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Argument:
    """`young = 60 kPa` or, without a name, `silicone`."""

    name: str | None
    value: Expression
    span: Span = field(compare=False, repr=False)
    name_span: Span | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Call:
    """`cylinder(length = L, radius = R)`."""

    function: Name
    arguments: tuple[Argument, ...]
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Unary:
    """`-x`, `+x`, `not a`."""

    operator: Literal["-", "+", "not"]
    operand: Expression
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Binary:
    """`a + b`, `a^2`, `a and b`. Brackets that only group leave no node; the span includes them."""

    operator: Literal["+", "-", "*", "/", "^", "and", "or"]
    left: Expression
    right: Expression
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Compare:
    """`x <= 0 mm`, `1 mm < sag < 2 mm`: operands one more than operators."""

    operands: tuple[Expression, ...]
    operators: tuple[Literal["<", "<=", ">", ">=", "==", "!="], ...]
    span: Span = field(compare=False, repr=False)


Expression: TypeAlias = Number | String | Name | Vector | List | Call | Unary | Binary | Compare


# --------------------------------------------------------------------- declarations


@dataclass(frozen=True, slots=True)
class Version:
    """`softmark 1`: the version of the language, on the first line."""

    number: int
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Title:
    """`scene "Silicone beam"`."""

    text: str
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Use:
    """`use "std/tissues.scene" as tissue`."""

    path: str
    alias: str
    span: Span = field(compare=False, repr=False)
    path_span: Span = field(compare=False, repr=False)
    alias_span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Param:
    """`param nu = 0.49 in 0 .. 0.49999`."""

    name: str
    value: Expression
    low: Expression | None
    high: Expression | None
    span: Span = field(compare=False, repr=False)
    name_span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Declare:
    """`material silicone = linear_elastic(...)`: the one shape of every other declaration."""

    kind: str
    name: str
    value: Expression
    span: Span = field(compare=False, repr=False)
    kind_span: Span = field(compare=False, repr=False)
    name_span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Expect:
    """`expect rod.eta < 5 %`."""

    condition: Expression
    span: Span = field(compare=False, repr=False)


Declaration: TypeAlias = Version | Title | Use | Param | Declare | Expect


@dataclass(frozen=True, slots=True)
class Comment:
    """`# ...` up to the end of its line, the `#` included."""

    text: str
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Tree:
    """A scene as written: its declarations in order, and every comment.

    `broken` are the names of declarations left out for an error: who misses one has been told already.
    """

    declarations: tuple[Declaration, ...]
    comments: tuple[Comment, ...] = field(default=(), compare=False)
    broken: tuple[str, ...] = field(default=(), compare=False)


# ------------------------------------------------------------------------- walking


def children(node: Expression | Argument) -> tuple[Expression | Argument, ...]:
    """The parts of an expression, in the order of the text."""
    match node:
        case Vector() | List():
            return node.items
        case Call():
            return (node.function, *node.arguments)
        case Argument():
            return (node.value,)
        case Unary():
            return (node.operand,)
        case Binary():
            return node.left, node.right
        case Compare():
            return node.operands
        case _:
            return ()


def walk(node: Expression | Argument) -> Iterator[tuple[Expression | Argument, int]]:
    """Every part of an expression, itself first, with the count of expressions around it; no recursion."""
    pending: list[tuple[Expression | Argument, int]] = [(node, 0)]
    while pending:
        part, depth = pending.pop()
        yield part, depth
        inner = depth + (not isinstance(part, Argument))
        pending.extend((child, inner) for child in reversed(children(part)))


def expressions(declaration: Declaration) -> tuple[Expression, ...]:
    """The expressions of a declaration, in the order of the text."""
    match declaration:
        case Param(value=value, low=low, high=high):
            return (value,) if low is None or high is None else (value, low, high)
        case Declare(value=value):
            return (value,)
        case Expect(condition=condition):
            return (condition,)
        case _:
            return ()
