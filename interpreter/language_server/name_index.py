"""Index of every name in a scene and its target, through dots and across used scenes.

A dotted name has several parts: `tissue.liver` is the alias of a `use` and a declaration in the used scene, `rod.eta` a
model and a metric, `gel.poisson` a material and a field, which is not a name of the scene.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

from softmark.grammar import tree
from softmark.grammar.tree import Span
from softmark.interpreter.language.expression_evaluation import metric_before_at
from softmark.interpreter.language.field_schema import Field, Vocabulary
from softmark.interpreter.language.scene_sources import Module, ModuleTable
from softmark.interpreter.language_server.text_document import Document

WORDS = frozenset({"choice", "flag", "components"})  # forms of fields whose names are words of the language
ALIAS = "use"  # kind of the alias of a `use`


@dataclass(frozen=True)
class Target:
    """Declaration of a name, or the `use` that introduces it; `span` is the position of the name in its text."""

    kind: str
    name: str
    module: Module
    span: Span

    @property
    def key(self) -> tuple[object, str]:
        """Key that all names of one object share: its text, and its name in that text."""
        return text_identity(self.module), self.name


@dataclass(frozen=True)
class Occurrence:
    """One part of a name, with its position in a text and its target."""

    module: Module
    span: Span
    target: Target
    declares: bool = False


def text_identity(module: Module) -> object:
    """Return the identity of a text: its file, or its name if it has no file."""
    return _resolve_path(module.file) if module.file else module.source.name


@lru_cache(maxsize=1024)
def _resolve_path(file: Path) -> Path:
    return file.resolve()


def occurrences(table: ModuleTable, module: Module) -> Iterator[Occurrence]:
    """Yield all names in a text, in their order."""
    known = NameResolver(table)
    for node in module.tree.declarations:
        declared = known.declared(module, node)
        if declared is not None:
            yield Occurrence(module, declared.span, declared, declares=True)
        for name in find_mentioned_names(node, table.vocabulary):
            yield from known.parts(module, name)


def name_at(document: Document, offset: int) -> Occurrence | None:
    """Return the name at a position of the scene's own text; the position after its last character counts."""
    table = document.table
    found = occurrences(table, table.modules[0]) if table.modules else ()
    return next((one for one in found if one.span.start <= offset <= one.span.end), None)


def uses(document: Document, target: Target) -> Iterator[Occurrence]:
    """Yield each use of a name once, in the scene's own text and in all scenes that it uses."""
    seen: set[tuple[object, int]] = set()
    for module in document.table.modules:
        for one in occurrences(document.table, module):
            place = text_identity(module), one.span.start
            if one.target.key == target.key and place not in seen:
                seen.add(place)
                yield one


def document_of(document: Document, module: Module) -> Document:
    """Return the document of a module, which converts positions for the protocol."""
    if module is document.table.modules[0]:
        return document
    return Document(module.source.text, module.folder, module.file, vocabulary=document.vocabulary)


class NameResolver:
    """Resolver of names in the texts of a module table."""

    def __init__(self, table: ModuleTable) -> None:
        self.table = table
        self.modules = {m.prefix: m for m in reversed(table.modules)}

    def declared(self, module: Module, node: tree.Declaration) -> Target | None:
        """Return the target that a declaration introduces; None if it has no name, or the name was taken before."""
        if isinstance(node, tree.Use):
            target = self.alias(module.prefix, node.alias)
            return target if target and target.span == node.alias_span else None
        if isinstance(node, tree.Param | tree.Declare):
            target = self.symbol(module.prefix + node.name)
            return target if target and target.span == node.name_span else None
        return None

    def alias(self, prefix: str, name: str) -> Target | None:
        """Return the `use` declaration that introduces a name as prefix, or None."""
        node, owner = self.table.aliases.get(prefix + name), self.modules.get(prefix)
        return None if node is None or owner is None else Target(ALIAS, name, owner, node.alias_span)

    def symbol(self, full: str) -> Target | None:
        """Return the parameter or declaration of a name with its prefix, as in `tissue.liver`, or None."""
        found = self.table.symbols.get(full)
        if found is None:
            return None
        kind = found.node.kind if isinstance(found.node, tree.Declare) else "param"
        return Target(kind, found.node.name, found.module, found.node.name_span)

    def parts(self, module: Module, name: tree.Name) -> Iterator[Occurrence]:
        """Yield each part of a name with its target; fields are left out, since they are not names of a scene."""
        prefix, rest = module.prefix, list(_segments(name))
        while rest and (target := self.alias(prefix, rest[0][0])) is not None:
            yield Occurrence(module, rest[0][1], target)
            prefix += rest.pop(0)[0] + "."
        if not rest or (target := self.symbol(prefix + rest[0][0])) is None:
            return
        yield Occurrence(module, rest[0][1], target)
        metric = self.symbol(module.prefix + rest[1][0]) if rest[1:] else None
        if metric is not None and metric.kind == "metric" and target.kind in ("model", "reference"):
            yield Occurrence(module, rest[1][1], metric)


def _segments(name: tree.Name) -> Iterator[tuple[str, Span]]:
    """Yield the parts of a name and their places."""
    start, column = name.span.start, name.span.column
    for part in name.parts:
        end, last = start + len(part), column + len(part)
        yield part, replace(name.span, start=start, column=column, end=end, end_column=last)
        start, column = end + 1, last + 1


# ------------------------------------------------------------------ declared names in expressions


def find_mentioned_names(node: tree.Declaration, vocabulary: Vocabulary) -> Iterator[tree.Name]:
    """Yield the names in the expressions of a declaration that may be declared names, in the order of the text."""
    if isinstance(node, tree.Declare):
        yield from _names_in_expression(node.value, vocabulary, Field("", "", "value", "", True, None, kind=node.kind))
        return
    for expression in tree.expressions(node):
        yield from _names_in_expression(expression, vocabulary, None)


def _names_in_expression(node: tree.Expression, vocabulary: Vocabulary, due: Field | None) -> Iterator[tree.Name]:
    """Yield the names in an expression, which may be the value of a field."""
    if due is not None and (due.form in WORDS or due.kind == "element"):
        return
    match node:
        case tree.Name():
            yield node
        case tree.Call():
            yield from _names_in_call(node, vocabulary, due)
        case _:
            for child in tree.children(node):
                if not isinstance(child, tree.Argument):
                    yield from _names_in_expression(child, vocabulary, due)


def _names_in_call(node: tree.Call, vocabulary: Vocabulary, due: Field | None) -> Iterator[tree.Name]:
    if (owner := metric_before_at(node)) is not None:
        yield owner
    fields = fields_of(node, vocabulary, due.kind if due else "")
    for place, argument in enumerate(node.arguments):
        yield from _names_in_expression(argument.value, vocabulary, field_of(fields, argument, place))


def fields_of(node: tree.Call, vocabulary: Vocabulary, kind: str) -> tuple[Field, ...]:
    """Return the fields of the constructor that a call names.

    If several kinds have a constructor of this name, that of `kind` is used, or else the first.
    """
    made = vocabulary.constructor(kind, node.function.text) if kind in vocabulary else None
    found = made or next(iter(vocabulary.find(node.function.text)), None)
    return found.fields if found else ()


def field_of(fields: tuple[Field, ...], argument: tree.Argument, place: int) -> Field | None:
    """Return the field that an argument sets, by its name or its position."""
    if argument.name is not None:
        return next((f for f in fields if f.name == argument.name), None)
    return fields[place] if place < len(fields) else None
