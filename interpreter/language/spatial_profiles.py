"""Constants that vary in space: expressions of the coordinates, of fields read from files, or of both.

A profile is a tree of `Node`s. It works on floats, for checks before anything is built, and on arrays in solvers.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import field, replace
from typing import TYPE_CHECKING, Any

from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Location
    from softmark.interpreter.language.field_schema import Interval
    from softmark.interpreter.language.units import Dimension

    Floats = Any  # array (n,); numpy is not imported here
    Reading = Callable[[Any, Floats], Floats]  # (field, points (n, 3) in m) -> values (n,) in SI


@dataclass(frozen=True)
class Node:
    """Node of an expression tree, with its operands `parts`.

    `do` is an operator, a function, `number`, `axis` or `field`.
    """

    do: str
    parts: tuple[Node, ...] = ()
    value: Any = None

    def walk(self) -> Iterator[Node]:
        """Yield this node and all nodes below it."""
        yield self
        for part in self.parts:
            yield from part.walk()


@dataclass(frozen=True)
class Profile:
    """Material constant, in SI units, as a function of the undeformed position; `said` is its text with values.

    `name` is the name of the constant, `limits` the range in which each of its values must be.
    """

    root: Node
    said: str
    name: str
    dimension: Dimension
    limits: Interval | None = field(compare=False, repr=False)
    at: Location = field(compare=False, repr=False)  # span in the text

    @property
    def fields(self) -> tuple[Any, ...]:
        """Data fields in the expression, each once."""
        return tuple(dict.fromkeys(node.value for node in self.root.walk() if node.do == "field"))

    def values(self, X: Any, read: Reading | None) -> Any:
        """Return the values (n,) at points X (n, 3), m; NaN where the expression is undefined.

        `read` returns the values of a data field at points; it may be None for an expression without data fields.
        """
        import numpy as np

        X = np.asarray(X, dtype=np.float64)
        with np.errstate(all="ignore"):
            found = _evaluate_on_arrays(self.root, X, read, np)
        return np.array(np.broadcast_to(found, len(X)), dtype=np.float64)

    def value(self, place: Sequence[float]) -> float:
        """Return the value at one point, m, without numpy; NaN where it is undefined or needs a data field."""
        try:
            found = _evaluate_at_point(self.root, place)
            return float(found) if isinstance(found, float | int) else math.nan
        except (ArithmeticError, ValueError):
            return math.nan

    def __mul__(self, share: float) -> Profile:
        """Return the profile times a factor; a negative factor removes its limits."""
        root, said = Node("*", (self.root, constant_node(share))), f"{share:.6g} * ({self.said})"
        return replace(self, root=root, said=said, limits=self.limits if share >= 0.0 else None)

    def __str__(self) -> str:
        return self.said


@dataclass(frozen=True)
class DirectionProfile:
    """Direction from three expressions of the coordinates, `(-y, x, 0 mm)`, of one dimension and any length."""

    components: tuple[Profile, Profile, Profile]

    def at(self, X: Floats, read: Any = None) -> Floats:
        """Return the directions (n, 3) at points X (n, 3), m. Raises Unreadable if a data field cannot be read."""
        import numpy as np

        return np.stack([part.values(X, read) for part in self.components], axis=1)

    def __str__(self) -> str:
        return f"({', '.join(map(str, self.components))})"


def constant_node(value: float) -> Node:
    """Return the expression node of a constant number."""
    return Node("number", value=value)


def _evaluate_at_point(node: Node, place: Sequence[float]) -> Any:
    match node.do:
        case "number":
            return node.value
        case "axis":
            return place[node.value]
        case "field":
            return math.nan
    return _PLAIN[node.do](*(_evaluate_at_point(part, place) for part in node.parts))


def _evaluate_on_arrays(node: Node, X: Any, read: Reading | None, np: Any) -> Any:
    match node.do:
        case "number":
            return node.value
        case "axis":
            return X[:, node.value]
        case "field":
            if read is None:
                raise ValueError("the constant is a field from a file, and no reader of files was given")
            return read(node.value, X)
    parts = [_evaluate_on_arrays(part, X, read, np) for part in node.parts]
    match node.do:
        case "min" | "max":
            return (np.minimum if node.do == "min" else np.maximum).reduce(np.broadcast_arrays(*parts))
        case "sqrt" | "abs" | "sin" | "cos" | "tan" | "exp" | "log":
            return getattr(np, node.do)(*parts)
        case "^":
            return np.power(np.asarray(parts[0], dtype=np.float64), parts[1])
    return _PLAIN[node.do](*parts)


_PLAIN: dict[str, Callable[..., Any]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
    "^": lambda a, b: a**b,
    "negated": lambda a: -a,
    "min": min,
    "max": max,
    "sqrt": math.sqrt,
    "abs": abs,
    "sin": math.sin,
    "cos": math.cos,
    "tan": math.tan,
    "exp": math.exp,
    "log": math.log,
}
