"""Constructors without arguments, written without brackets: `amplitude = per_state`."""

from __future__ import annotations

from softmark.grammar import tree
from softmark.grammar.diagnostic import did_you_mean
from softmark.grammar.name_suggestions import nearest
from softmark.interpreter.language.expression_evaluation import SourceErrors
from softmark.interpreter.language.field_schema import Constructor, Field, article
from softmark.interpreter.language.foreign_words import find_misspelling
from softmark.interpreter.language.name_scope import Scope
from softmark.interpreter.language.scene_sources import Module


def find_bare_constructor(
    scope: Scope, module: Module, field: Field, node: tree.Name, place: SourceErrors
) -> Constructor | None:
    """Return the constructor that a name without brackets refers to, or None if the scene declares the name.

    Raises EvaluationError if the name is misspelt.
    """
    words, symbol = _constructors_by_name(scope, field.kind), scope.table.symbols.get(module.prefix + node.text)
    if symbol is not None:
        kind = symbol.node.kind if isinstance(symbol.node, tree.Declare) else "parameter"
        if node.text not in words or kind == field.kind:
            return None
        raise place.error("E213", node.span, f"expected {field.expected}, found the {kind} `{node.text}`",
                         f"{article(kind)} {kind}",
                         f"`{node.text}` is also {field.expected}: give the {kind} another name")  # fmt: skip
    if node.text in words:
        return words[node.text]
    declared = scope.names(module, [field.kind])
    if node.text in scope.table.vocabulary[field.kind] or nearest(node.text, declared):
        return None  # a constructor with required fields gets its own message
    close = find_misspelling(node.text, words)
    if close is None:
        return None
    raise place.error("E203", node.span, f"there is no {field.kind} `{node.text}`", f"not {field.expected}",
                     did_you_mean(close))  # fmt: skip


def _constructors_by_name(scope: Scope, kind: str) -> dict[str, Constructor]:
    """Return the constructors of one kind that need no arguments, by name."""
    known = (scope.table.vocabulary.constructor(kind, name) for name in scope.table.vocabulary[kind])
    return {c.name: c for c in known if c is not None and not c.fields}
