"""Resolution of region names in conditions, with suggestions for unknown names."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from softmark.grammar import tree
from softmark.grammar.name_suggestions import nearest
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.language.condition_syntax import Named
from softmark.interpreter.language.coordinate_conditions import Condition
from softmark.interpreter.language.scene_sources import Module, ModuleTable, Symbol

KIND = "region"  # kinds of declarations that conditions may name


def make_region_lookup(module: Module, table: ModuleTable, declared: Callable[[tree.Name], Declared]) -> Named:
    """Return the function that resolves region names in a module.

    `declared` returns the declaration of a name, and raises EvaluationError for one with an error.
    """

    def named(name: tree.Name) -> Condition | str | None:
        symbol = table.symbols.get(module.prefix + name.text)
        if symbol is None:
            own = [n for n, s in table.symbols.items() if n.startswith(module.prefix) and _is_region(s)]
            return nearest(name.text, [n.removeprefix(module.prefix) for n in own])
        if not _is_region(symbol):
            return None
        region = declared(name)
        where: Condition = region.thing.where
        return replace(where, regions=(region.name, *where.regions))

    return named


def _is_region(symbol: Symbol) -> bool:
    return isinstance(symbol.node, tree.Declare) and symbol.node.kind == KIND
