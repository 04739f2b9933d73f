"""What the arguments of a call are together: objects that refuse them, and fields of which one is to be given."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from softmark.grammar import tree
from softmark.interpreter.language.schema import Constructor
from softmark.ranges import Unfit

if TYPE_CHECKING:
    from collections.abc import Mapping

    from softmark.interpreter.language.calls import Binder, Bound


def made(
    binder: Binder, constructor: Constructor, values: Mapping[str, Any], bound: Mapping[str, Bound], node: tree.Call
) -> Any:
    """The object. Raises Bad where its values do not go together."""
    try:
        return constructor.cls(**values)
    except Unfit as wrong:
        value, place = bound.get(wrong.field, (node.function, binder.place))
        raise place.fail("E352", value.span, wrong.problem, wrong.short, wrong.remedy) from None


def either(binder: Binder, constructor: Constructor, bound: Mapping[str, Bound], node: tree.Call) -> bool:
    """Report fields of which one is to be given, where none is or more; whether there are any."""
    broken = False
    for names in getattr(constructor.cls, "either", ()):
        given = [name for name in names if name in bound]
        told = " or ".join(f"`{name}`" for name in names)
        if not given:
            fields = [f for name in names if (f := constructor.field(name)) is not None]
            meanings = "; ".join(f.meaning + binder.unit_hint(f) for f in fields)
            binder.place.fail("E351", node.function.span, f"`{constructor.name}` needs {told}", "incomplete", meanings)
        elif len(given) > 1:
            value, place = bound[given[-1]]
            problem = f"`{constructor.name}` takes {told}, not both"
            place.fail("E351", value.span, problem, "one follows from the other", f"leave out `{given[-1]}`")
        broken |= len(given) != 1
    return broken
