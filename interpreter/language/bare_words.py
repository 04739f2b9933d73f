"""Constructors that take nothing and stand without brackets where they are used: `course = state`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from softmark.grammar import tree
from softmark.grammar.suggest import nearest
from softmark.interpreter.language.expressions import Place
from softmark.interpreter.language.schema import Constructor, Field, article

if TYPE_CHECKING:
    from softmark.interpreter.language.calls import Binder


def bare_word(binder: Binder, field: Field, node: tree.Name, place: Place) -> Constructor | None:
    """The constructor that a name stands for, None of one that is declared. Raises Bad for one that is misspelt."""
    words, symbol = _words(binder, field.kind), binder.compiler.table.symbols.get(binder.module.prefix + node.text)
    if symbol is not None:
        kind = symbol.node.kind if isinstance(symbol.node, tree.Declare) else "parameter"
        if node.text not in words or kind == field.kind:
            return None
        raise place.fail("E213", node.span, f"expected {field.expected}, found the {kind} `{node.text}`",
                         f"{article(kind)} {kind}",
                         f"`{node.text}` is {field.expected}, too: give the {kind} another name")  # fmt: skip
    if node.text in words:
        return words[node.text]
    declared = binder.compiler.scope.names(binder.module, [field.kind])
    if node.text in binder.vocabulary[field.kind] or nearest(node.text, declared):
        return None  # one that takes something, and the message about that
    close = nearest(node.text, words)
    if close is None:
        return None
    raise place.fail("E203", node.span, f"there is no {field.kind} `{node.text}`", f"not {field.expected}",
                     f"did you mean `{close}`?")  # fmt: skip


def _words(binder: Binder, kind: str) -> dict[str, Constructor]:
    """Those of a kind."""
    known = (binder.vocabulary.constructor(kind, name) for name in binder.vocabulary[kind])
    return {c.name: c for c in known if c is not None and not c.fields}
