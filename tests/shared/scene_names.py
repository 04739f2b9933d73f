"""What a report knows of the names of a scene whose text is not a whole scene: read from the text as it stands."""

from __future__ import annotations

from collections.abc import Mapping

from softmark.grammar import tree
from softmark.grammar.diagnostic import Source
from softmark.grammar.parser import parse
from softmark.interpreter.results.declarations import DeclaredName, DeclaredNames
from softmark.interpreter.validation.constructor_registry import CATALOGUE


def names_in(text: str, parameters: Mapping[str, float] | None = None) -> DeclaredNames:
    """Its declarations, what it expects, and where its gravity pulls: an axis or three numbers."""
    read = parse(Source("report", text))[0]
    calls = {
        d.name: (d, d.value) for d in read.declarations
        if isinstance(d, tree.Declare) and isinstance(d.value, tree.Call)
    }  # fmt: skip
    given = {name: _given(d.kind, call) for name, (d, call) in calls.items()}
    ratios = {name: _number(own.get("poisson"), parameters or {}) for name, own in given.items()}
    declared = {
        name: _named(d, call, given[name], ratios) for name, (d, call) in calls.items()
    }  # fmt: skip
    asked = [d.condition for d in read.declarations if isinstance(d, tree.Expect)]
    pairs = [p.parts for c in asked for p, _ in tree.walk(c) if isinstance(p, tree.Name) and len(p.parts) == 2]
    expected = dict.fromkeys(p[1] for p in pairs if declared[p[0]].kind == "model")
    pulls = [_vector(given[n]["direction"]) for n, (_, c) in calls.items() if c.function.text == "gravity"]
    return DeclaredNames(declared, tuple(expected), *pulls[:1])


def _given(kind: str, call: tree.Call) -> dict[str, tree.Expression]:
    """Arguments by field; those without a name count by position."""
    known = CATALOGUE.constructor(kind, call.function.text)
    fields = [f.name for f in known.fields] if known else []
    names = (a.name or fields[i] for i, a in enumerate(call.arguments))
    return {name: a.value for name, a in zip(names, call.arguments, strict=True)}


def _named(
    d: tree.Declare, call: tree.Call, given: Mapping[str, tree.Expression], ratios: Mapping[str, float | None]
) -> DeclaredName:
    known = CATALOGUE.constructor(d.kind, call.function.text)
    probe, against, body, material = (
        value.text if isinstance(value := given.get(n), tree.Name) else None
        for n in ("probe", "against", "body", "material")
    )
    summary = known.summary if known else ""
    return DeclaredName(
        d.kind, call.function.text, d.span.line, summary, body, probe, against, ratios.get(material or "")
    )


def _number(value: object, parameters: Mapping[str, float]) -> float | None:
    if isinstance(value, tree.Name):
        return parameters[value.text]
    return float(value.value) if isinstance(value, tree.Number) else None


def _vector(value: object) -> tuple[float, float, float]:
    if isinstance(value, tree.Vector):
        x, y, z = (-i.operand.value if isinstance(i, tree.Unary) else i.value for i in value.items)  # type: ignore[union-attr]
        return x, y, z
    sign, name = (value.operator, value.operand) if isinstance(value, tree.Unary) else ("+", value)
    unit = -1.0 if sign == "-" else 1.0
    x, y, z = (unit * (name.text == axis) for axis in "xyz")  # type: ignore[union-attr,attr-defined]
    return x, y, z
