"""Syntax tree: one frozen dataclass per rule of `scene.lark`, each with the span of its source text.

To add a node: one class here, one rule in `scene.lark`, one method in `parser.py`, one in `printer.py`. Two trees are
equal if they mean the same; spans are not compared.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal, TypeAlias


@dataclass(
    slots=True, unsafe_hash=True
)  # never modified; not frozen, because that would take three times as long to construct
class Span:
    """Range of a source text; lines and columns count from 1, in code points, and the end is exclusive."""

    start: int  # offset of the first character
    end: int  # offset after the last character
    line: int
    column: int
    end_line: int
    end_column: int


def span_between(first: Span, last: Span) -> Span:
    """Return the span from the start of `first` to the end of `last`."""
    return Span(first.start, last.end, first.line, first.column, last.end_line, last.end_column)


# ---------------------------------------------------------------------- expressions


@dataclass(frozen=True, slots=True)
class Unit:
    """Unit such as `kg/m^3`, kept as the text after a number, a vector or a list until it is looked up."""

    text: str
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Number:
    """A number such as `60`, `60 kPa`, `5 %`; `text` keeps the digits as written."""

    value: float
    unit: Unit | None
    text: str = field(compare=False)
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class String:
    """A text such as `"silicone.vtk"`; `value` is the text between the quotes, escapes resolved."""

    value: str
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Name:
    """A name such as `h`, `rod.eta`, `tissue.liver.young`, possibly joined by dots."""

    parts: tuple[str, ...]
    span: Span = field(compare=False, repr=False)

    @property
    def text(self) -> str:
        """Name as written, dots included."""
        return self.parts[0] if len(self.parts) == 1 else ".".join(self.parts)


@dataclass(frozen=True, slots=True)
class Vector:
    """Vector such as `(0, 0, -9.81) m/s^2`, with at least two items; the unit applies to items without one."""

    items: tuple[Expression, ...]
    unit: Unit | None
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class List:
    """A list such as `[10, 5, 2.5] mm`."""

    items: tuple[Expression, ...]
    unit: Unit | None
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Argument:
    """An argument such as `young = 60 kPa` or, without a name, `silicone`."""

    name: str | None
    value: Expression
    span: Span = field(compare=False, repr=False)
    name_span: Span | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Call:
    """A call such as `cylinder(length = L, radius = R)`."""

    function: Name
    arguments: tuple[Argument, ...]
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Unary:
    """A unary operation such as `-x`, `+x`, `not a`."""

    operator: Literal["-", "+", "not"]
    operand: Expression
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Binary:
    """Binary operation such as `a + b`, `a^2`, `a and b`.

    Grouping brackets have no node, but the span includes them.
    """

    operator: Literal["+", "-", "*", "/", "^", "and", "or"]
    left: Expression
    right: Expression
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Compare:
    """Comparison such as `x <= 0 mm` or `1 mm < sag < 2 mm`, with one more operand than operators."""

    operands: tuple[Expression, ...]
    operators: tuple[Literal["<", "<=", ">", ">=", "==", "!="], ...]
    span: Span = field(compare=False, repr=False)


Expression: TypeAlias = Number | String | Name | Vector | List | Call | Unary | Binary | Compare


# --------------------------------------------------------------------- declarations


@dataclass(frozen=True, slots=True)
class Version:
    """The version of the language on the first line, such as `softmark 1`."""

    number: int
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Title:
    """The title of a scene, such as `scene "Silicone beam"`."""

    text: str
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Use:
    """An import such as `use "std/tissues.scene" as tissue`."""

    path: str
    alias: str
    span: Span = field(compare=False, repr=False)
    path_span: Span = field(compare=False, repr=False)
    alias_span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Param:
    """A parameter such as `param nu = 0.49 in 0 .. 0.49999`."""

    name: str
    value: Expression
    low: Expression | None
    high: Expression | None
    span: Span = field(compare=False, repr=False)
    name_span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Declare:
    """Any other declaration, such as `material silicone = linear_elastic(...)`."""

    kind: str
    name: str
    value: Expression
    span: Span = field(compare=False, repr=False)
    kind_span: Span = field(compare=False, repr=False)
    name_span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Expect:
    """An expectation such as `expect rod.eta < 5 %`."""

    condition: Expression
    span: Span = field(compare=False, repr=False)


Declaration: TypeAlias = Version | Title | Use | Param | Declare | Expect


@dataclass(frozen=True, slots=True)
class Comment:
    """Comment from `#` to the end of its line, including the `#`."""

    text: str
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Tree:
    """Parsed scene: its declarations in order, and all comments.

    `broken` are the names of declarations omitted because of an error, so that their use is not reported again.
    """

    declarations: tuple[Declaration, ...]
    comments: tuple[Comment, ...] = field(default=(), compare=False)
    broken: tuple[str, ...] = field(default=(), compare=False)


# ------------------------------------------------------------------------- walking


def children(node: Expression | Argument) -> tuple[Expression | Argument, ...]:
    """Return the direct parts of an expression or argument, in the order of the text."""
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
    """Yield an expression and all its parts, each with its nesting depth, without recursion."""
    pending: list[tuple[Expression | Argument, int]] = [(node, 0)]
    while pending:
        part, depth = pending.pop()
        yield part, depth
        inner = depth + (not isinstance(part, Argument))
        pending.extend((child, inner) for child in reversed(children(part)))


def expressions(declaration: Declaration) -> tuple[Expression, ...]:
    """Return the expressions that a declaration contains, in the order of the text."""
    match declaration:
        case Param(value=value, low=low, high=high):
            return (value,) if low is None or high is None else (value, low, high)
        case Declare(value=value):
            return (value,)
        case Expect(condition=condition):
            return (condition,)
        case _:
            return ()
