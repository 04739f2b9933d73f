"""Names that a text declares, even in unfinished declarations, with their kinds and dimensions."""

from __future__ import annotations

from collections.abc import Iterator

from softmark.grammar import tree
from softmark.grammar.statement_splitting import starts_declaration
from softmark.interpreter.language import units
from softmark.interpreter.language.expression_evaluation import Quantity, Value, VectorValue
from softmark.interpreter.language.units import Dimension
from softmark.interpreter.language_server.text_document import Document


def find_declared_names(document: Document) -> dict[str, str]:
    """Return the kind of every name that a text and its used scenes declare; the kind of a parameter is `param`.

    Names are found by tokens, so that the text may have errors.
    """
    found = dict(_names_in_text(document))
    table = document.known.table
    for name, symbol in table.symbols.items() if table else ():
        if "." in name:
            found[name] = symbol.node.kind if isinstance(symbol.node, tree.Declare) else "param"
    return found


def _names_in_text(document: Document) -> Iterator[tuple[str, str]]:
    tokens = document.tokens
    for index, token in enumerate(tokens):
        if token.kind in ("NAME", "PARAM") and starts_declaration(tokens, index) and index + 1 < len(tokens):
            yield tokens[index + 1].text, "param" if token.kind == "PARAM" else token.text


def dimension(document: Document, name: str) -> Dimension | None:
    """Return the dimension of a parameter, or of a metric such as `rod.eta`; None if unknown."""
    scene = document.known
    if (parameter := scene.parameters.get(name)) is not None:
        return parameter.value.dimension
    metric = scene.declared.get(name.split(".")[1]) if "." in name else None
    if metric is None or metric.kind != "metric":
        return None
    try:
        return units.parse_unit(metric.thing.unit).dimension
    except (units.UnitError, NotImplementedError, AttributeError):
        return None


def format_value(value: Value) -> str:
    """Format a value: `178 mm`, `(178, 0, 0) mm`."""
    if isinstance(value, Quantity):
        return units.format_value(value.value, value.dimension)
    return units.format_vector(value.values, value.dimension)


def format_in_si(value: Value, digits: int) -> str:
    """Format a value in the coherent SI unit: `0.178 m`, `(0, 0, 0.1) m`."""
    unit = units.vector_unit(value.dimension) if isinstance(value, VectorValue) else units.si_unit(value.dimension)
    if isinstance(value, Quantity):
        said = f"{value.value:.{digits}g}"
    else:
        said = f"({', '.join(f'{v:.{digits}g}' for v in value.values)})"
    return said if unit == "1" else f"{said} {unit}"
