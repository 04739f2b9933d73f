"""Names of regions where conditions are due: what they select, and which was meant by a name that is none."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from softmark.grammar import tree
from softmark.grammar.suggest import nearest
from softmark.interpreter.language.condition_syntax import Named
from softmark.interpreter.language.conditions import Condition

if TYPE_CHECKING:
    from softmark.interpreter.language.compile import Compiler
    from softmark.interpreter.language.expressions import Place
    from softmark.interpreter.language.sources import Module

KIND = "region"  # of declarations whose names stand for conditions


def regions_of(compiler: Compiler, module: Module, place: Place) -> Named:
    """What names in a text of a module select; Bad is raised for a region in error, or for a circle of them."""

    def named(name: tree.Name) -> Condition | str | None:
        symbol = compiler.table.symbols.get(module.prefix + name.text)
        if symbol is None:
            return nearest(name.text, compiler.scope.names(module, [KIND]))
        if not isinstance(symbol.node, tree.Declare) or symbol.node.kind != KIND:
            return None
        region = compiler.named(name, KIND, module, place)
        return replace(region.thing.where, regions=(region.name, *region.thing.where.regions))

    return named
