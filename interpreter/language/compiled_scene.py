"""Compiled scene: typed objects in SI units, each with the location of its text."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from functools import cached_property
from operator import itemgetter
from typing import TYPE_CHECKING, Any

from softmark.grammar import tree
from softmark.grammar.diagnostic import Diagnostic, Source
from softmark.grammar.tree import Span
from softmark.interpreter.language.expression_evaluation import Value
from softmark.interpreter.language.field_schema import Constructor, Interval, Vocabulary
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.language.scene_sources import ModuleTable

RIGID = "rigid"  # constructor of rigid bodies


@dataclass(frozen=True)
class Location:
    """Place in a scene: the source text, and a span of it."""

    source: Source
    span: Span

    @property
    def text(self) -> str:
        """Source text of the span."""
        return self.source.text[self.span.start : self.span.end]


@dataclass(frozen=True)
class Parameter:
    """Evaluated parameter such as `param L = 178 mm`; `text` is the expression from which its value was computed."""

    name: str
    value: Value
    text: str
    location: Location
    overridden: bool = False
    interval: Interval | None = None  # range declared in the scene, SI


@dataclass(frozen=True)
class Declared:
    """Compiled declaration `kind name = constructor(...)`; `thing` is an instance of the constructor's class."""

    kind: str
    name: str
    constructor: Constructor
    thing: Any
    location: Location
    fields: Mapping[str, Location] = field(default_factory=dict)  # location of each given field
    name_at: Location | None = None

    def value(self, name: str) -> Any:
        """Return the value of the field that scenes call `name`, or None if there is no such field."""
        known = self.constructor.field(name)
        return None if known is None else getattr(self.thing, known.attribute)

    def at(self, name: str = "") -> Location:
        """Return the location of a field, or of the declared name if the field is not given."""
        return self.fields.get(name, self.name_at or self.location)

    def contains(self, found: Diagnostic) -> bool:
        """Return whether a diagnostic points into this declaration or into an override of one of its fields."""
        span, source = found.span, found.source
        if span is None:
            return False
        places = (self.location, *self.fields.values())
        return any(at.source is source and at.span.start <= span.start < at.span.end for at in places)


def is_rigid(declared: Declared) -> bool:
    """Return whether the declaration is a rigid body."""
    return declared.constructor.name == RIGID


@dataclass(frozen=True)
class Expectation:
    """Condition on metrics that is checked after a run, such as `expect rod.eta < 5 %`."""

    node: tree.Expression
    location: Location

    @property
    def text(self) -> str:
        """Text of the condition as written, on one line."""
        return " ".join(self.location.text.removeprefix("expect").split())


@dataclass(frozen=True)
class ReusableParts:
    """Error-free results of a compilation, which are reused when the scene is compiled again with other overrides.

    `needs` has the direct dependencies of each parameter and declaration: the names in its text. Transitive
    dependencies would take memory that grows with the square of the text.
    """

    parameters: Mapping[str, Parameter]
    declared: Mapping[str, Declared]
    needs: Mapping[str, frozenset[str]]


@dataclass(frozen=True)
class Scene:
    """All declarations of a scene in the order of its text; names from used scenes have their prefix."""

    title: str
    source: Source
    path: str | None  # path of the file, None for text
    parameters: Mapping[str, Parameter]
    declared: Mapping[str, Declared]
    expectations: tuple[Expectation, ...]
    overrides: tuple[str, ...] = ()  # overrides as given: `L=120mm`
    unused: Mapping[str, Location] = field(default_factory=dict)
    table: ModuleTable | None = field(default=None, repr=False, compare=False)  # modules that it was compiled from
    chosen: tuple[str, ...] = ()  # requested models with those they need; empty: all
    varied: tuple[str, ...] = ()  # overrides that a study gave: `L=120 mm`
    made: ReusableParts | None = field(default=None, repr=False, compare=False)  # None for a scene with errors
    state: int | None = None  # index of its state (`scene_states.py`); None for all states, or the only one

    @property
    def vocabulary(self) -> Vocabulary:
        """Constructors that the texts of the scene may use. Raises ValueError if the scene was made without texts."""
        if self.table is None:
            raise ValueError("the scene was made without its source texts")
        return self.table.vocabulary

    def of_kind(self, kind: str) -> dict[str, Declared]:
        """Return the scene's own declarations of a kind, without those from used scenes.

        Rigid bodies are not in "body"; they have the kind RIGID, since most questions about bodies concern deformable
        ones.
        """
        return self._declarations_by_kind.get(kind, {})

    def asked(self, kind: str) -> dict[str, Declared]:
        """Return the declarations of a kind, leaving out models that the user did not request."""
        own = self.of_kind(kind)
        return {n: d for n, d in own.items() if n in self.chosen} if self.chosen and kind == "model" else own

    @cached_property
    def known(self) -> dict[Any, Any]:
        """Cache of results derived from this scene, such as cases and variants, by a key of the caller."""
        return {}

    @cached_property
    def _declarations_by_kind(self) -> dict[str, dict[str, Declared]]:
        found: dict[str, dict[str, Declared]] = {}
        for name, declared in self.declared.items():
            if "." not in name:
                kind = RIGID if is_rigid(declared) else declared.kind
                found.setdefault(kind, {})[name] = declared
        return found

    def acting(self, kind: str, body: str) -> tuple[Declared, ...]:
        """Return the supports or loads on a body in the order of the text, including those that name no body."""
        found = self._declarations_by_body.get((kind, body), []) + self._declarations_by_body.get((kind, None), [])
        return tuple(declared for _, declared in sorted(found, key=itemgetter(0)))

    @cached_property
    def _declarations_by_body(self) -> dict[tuple[str, str | None], list[tuple[int, Declared]]]:
        found: dict[tuple[str, str | None], list[tuple[int, Declared]]] = {}
        for kind in ("support", "load", "contact"):
            for place, declared in enumerate(self.of_kind(kind).values()):
                found.setdefault((kind, declared.value("body")), []).append((place, declared))
        return found


class SceneError(Exception):
    """Exception for errors in a scene or an override; `diagnostics` has them with their places and remedies.

    Its text is the message for a terminal. IPython and Jupyter show that text without a traceback.
    """

    def __init__(self, diagnostics: list[Diagnostic]) -> None:
        self.diagnostics = diagnostics
        super().__init__(self._shown(colour=False))

    def _shown(self, colour: bool) -> str:
        """Return the text of the exception: the number of errors, where to read more, and each error."""
        from softmark.grammar.diagnostic import render, summary

        more = f"; more: dsl explain {self.diagnostics[0].code}" if self.diagnostics else ""
        return f"{summary(self.diagnostics)}{more}\n\n{render(self.diagnostics, colour)}"

    def _render_traceback_(self) -> list[str]:
        """Return the lines that IPython displays instead of a traceback."""
        return [self._shown(colour=True) if self.diagnostics else f"{type(self).__name__}: {self}"]

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.diagnostics,)
