"""A compiled scene: typed objects in SI, each with the text it came from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from softmark.grammar import tree
from softmark.grammar.diagnostic import Diagnostic, Source
from softmark.grammar.tree import Span
from softmark.interpreter.expressions import Value
from softmark.interpreter.schema import Constructor


@dataclass(frozen=True)
class Location:
    """A span of a source."""

    source: Source
    span: Span

    @property
    def text(self) -> str:
        """What stands there."""
        return self.source.text[self.span.start : self.span.end]


@dataclass(frozen=True)
class Parameter:
    """`param L = 178 mm`, evaluated; `text` is the expression that gave the value."""

    name: str
    value: Value
    text: str
    location: Location
    overridden: bool = False


@dataclass(frozen=True)
class Declared:
    """`kind name = constructor(...)`, built: `thing` is an instance of the constructor's class."""

    kind: str
    name: str
    constructor: Constructor
    thing: Any
    location: Location
    fields: Mapping[str, Location] = field(default_factory=dict)  # where each given field stands

    def at(self, name: str) -> Location:
        """Where a field is given, or else the declaration."""
        return self.fields.get(name, self.location)


@dataclass(frozen=True)
class Expectation:
    """`expect rod.eta < 5 %`."""

    node: tree.Expression
    location: Location

    @property
    def text(self) -> str:
        """The condition as written, on one line."""
        return " ".join(self.location.text.removeprefix("expect").split())


@dataclass(frozen=True)
class Scene:
    """Everything that a scene declares, in the order of its text; names from `use` have their prefix."""

    title: str
    source: Source
    path: str | None  # of the file, None for text
    parameters: Mapping[str, Parameter]
    declared: Mapping[str, Declared]
    expectations: tuple[Expectation, ...]
    unused: Mapping[str, Location] = field(default_factory=dict)

    def of_kind(self, kind: str) -> dict[str, Declared]:
        """The scene's own declarations of a kind, without those that come from `use`."""
        return {n: d for n, d in self.declared.items() if d.kind == kind and "." not in n}


class SceneError(Exception):
    """A scene, or an override of it, is in error: `diagnostics` says where and how to mend it."""

    def __init__(self, diagnostics: list[Diagnostic]) -> None:
        from softmark.grammar.diagnostic import render

        self.diagnostics = diagnostics
        super().__init__("\n" + render(diagnostics, colour=False))
