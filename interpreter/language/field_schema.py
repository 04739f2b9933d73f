"""Vocabulary: names of the constructors of the language, and the values that their fields accept.

A constructor is a frozen dataclass, registered in the table of its package. Its annotations `Annotated[type, "UNIT in
RANGE" or "KIND", "meaning"]` serve checking, `dsl explain`, completion and the report. To add a constructor: write one
class and one line in the table of its package.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from importlib import import_module
from typing import Any, Literal, get_args, get_origin, get_type_hints

from softmark.interpreter.language import units
from softmark.interpreter.language.loaded_plugin import Plugin
from softmark.interpreter.language.renamed_words import ALIASES
from softmark.interpreter.language.units import Dimension
from softmark.ranges import Range
from softmark.records import dataclass

Form = Literal[
    "quantity",
    "vector",
    "integer",
    "flag",
    "choice",
    "text",
    "file",
    "files",
    "texts",
    "amount",
    "amounts",
    "direction",
    "condition",
    "components",
    "name",
    "names",
    "list",
    "points",
    "value",
    "target",
    "targets",
    "variants",
    "vectors",
    "pairs",
    "each",
    "fibres",
]


@dataclass(frozen=True)
class Interval(Range):
    """Range of a number in SI units, with its text for messages."""

    def words(self, dimension: Dimension) -> str:
        """Return the range in words: `greater than 0`, `between -1 and 0.5 (exclusive)`."""
        low, high = (_format_bound(v, dimension) for v in (self.low, self.high))
        if self.high == float("inf"):
            return f"{'greater than' if self.low_open else 'at least'} {low}"
        if self.low == -float("inf"):
            return f"{'less than' if self.high_open else 'at most'} {high}"
        ends = {(True, True): ", both excluded", (False, False): ", both included"}
        one = f", {low if self.low_open else high} excluded"
        return f"between {low} and {high}{ends.get((self.low_open, self.high_open), one)}"


def _format_bound(value: float, dimension: Dimension) -> str:
    return "0" if value == 0 else units.format_value(value, dimension)


@dataclass(frozen=True)
class Field:
    """Field of a constructor: its name, form, range, default and meaning."""

    name: str  # name in scenes
    attribute: str  # name in Python: `from_` for `from`
    form: Form
    doc: str
    required: bool
    default: Any
    dimension: Dimension | None = None
    interval: Interval | None = None
    options: tuple[str, ...] = ()  # options of a choice
    kind: str = ""  # kind of a name, `body`, or of a value, `material`
    also: tuple[str, ...] = ()  # further accepted kinds of a name
    folder: bool = False  # whether a file may be a folder
    varies: bool = False  # whether it may vary in space

    @property
    def expected(self) -> str:
        """Accepted values in words, for messages: `a pressure`, `small, corotational or finite`."""
        if self.form in ("quantity", "vector") and self.dimension is not None:
            one = units.dimension_name(self.dimension)
            return one if self.form == "quantity" else f"three components, each {one}"
        if self.form == "list" and self.dimension == units.NONE:
            return "a list of plain numbers such as `[5, 12.5, 18.25] %`"
        if self.form == "list" and self.dimension not in (None, units.LENGTH):
            return f"a list of values such as `[1, 10] {units.si_unit(self.dimension or units.NONE)}`"
        if self.form == "choice":
            *others, last = self.options
            return f"{', '.join(others)} or {last}" if others else last
        if self.form == "names":
            return f"a list of {plural(self.kind)} such as `[a, b]`"
        return _EXPECTED.get(self.form) or f"{article(self.kind)} {self.kind}"

    @property
    def meaning(self) -> str:
        """Name and meaning of the field, for messages."""
        joint = " is" if re.match(r"(the|whether|how|which|where|what|[A-Z]\S*'s) ", self.doc) else ":"
        return f"`{self.name}`{joint} {self.doc}"


_EXPECTED = {
    "integer": "a whole number",
    "flag": "yes or no",
    "text": "a text in double quotes",
    "file": "a file name in double quotes",
    "files": "a file name in double quotes, or a list of them",
    "texts": "a text in double quotes, or a list of them",
    "amount": "a quantity such as `1 mm` or `2 %`",
    "amounts": "a quantity such as `53.4 mm`, or a list of them",
    "direction": "a direction such as `-z` or `(0, 0, -1)`",
    "condition": "a condition on the coordinates, such as `x <= 0 mm`",
    "components": "components such as `x` or `(x, y)`",
    "list": "a list of values such as `[10, 5, 2.5] mm`",
    "points": "a list of points such as `[(0, 0), (10, 0), (0, 20)] mm`",
    "target": "the name of a parameter, such as `h`, or of a field, such as `rod.segments`",
    "targets": "a list of parameters and fields such as `[h, gel.poisson]`",
    "variants": "a list of values such as `[10, 5, 2.5] mm`",
    "vectors": "a list of points such as `[(0, 0, 0), (0, 0, 1)] m`",
    "pairs": "a list of pairs of whole numbers such as `[(1, 2), (2, 3)]`",
    "each": "a quantity, or a list with one for each member",
    "fibres": "a direction such as `+x`, expressions such as `(-y, x, 0 mm)`, or a rule such as `helix(...)`",
}


def article(word: str) -> str:
    """Return the word's indefinite article, `a` or `an`."""
    return "an" if word[:1] in "aeiou" else "a"


def plural(kind: str) -> str:
    """Return the plural of a kind: `materials`, `bodies`, `analyses`."""
    return _PLURALS.get(kind, f"{kind}s")


_PLURALS = {
    "body": "bodies", "analysis": "analyses", "published": "published values", "stiffness": "stiffnesses",
    "study": "studies", "fibres": "fibres",
}  # fmt: skip


def join_names(names: Sequence[str], most: int = 12) -> str:
    """Join names for a message; after `most` names, give only the number of the others."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more


@dataclass(frozen=True)
class Constructor:
    """Constructor of the vocabulary: its class, its kind and its fields in order."""

    name: str
    kind: str
    cls: type[Any]
    fields: tuple[Field, ...]

    @property
    def summary(self) -> str:
        """First line of the docstring of the constructor's class."""
        return (self.cls.__doc__ or "").strip().split("\n")[0]

    def field(self, name: str) -> Field | None:
        """Return the field that scenes call `name`, or None."""
        return self._fields_by_name.get(name)

    @cached_property
    def _fields_by_name(self) -> dict[str, Field]:
        return {f.name: f for f in self.fields}


REMEDY = "correct the plugin; `dsl conformance` checks all of it"


class Vocabulary(Mapping[str, Mapping[str, type[Any]]]):
    """All constructors of the language by kind of declaration; the table of a kind is imported on first use.

    `places` has for each kind the module under `softmark` and the name of its table, in the order in which `dsl list`
    shows them. `elements` has the same for constructors without arguments, written as bare words. Constructors of
    `plugins` follow the built-in ones.
    """

    def __init__(
        self, places: Mapping[str, tuple[str, str]], elements: tuple[str, str], plugins: tuple[Plugin, ...] = ()
    ) -> None:
        self._places, self._elements, self.plugins = places, elements, plugins
        self._made: dict[tuple[str, str], Constructor | None] = {}

    def __reduce__(self) -> tuple[Any, ...]:
        return Vocabulary, (self._places, self._elements, self.plugins)

    def plus(self, plugin: Plugin) -> Vocabulary:
        """Return the vocabulary extended by a plugin."""
        return Vocabulary(self._places, self._elements, (*self.plugins, plugin))

    def __getitem__(self, kind: str) -> Mapping[str, type[Any]]:
        found: Mapping[str, type[Any]] = _load_table(*self._places[kind])
        for plugin in self.plugins:
            if kind in plugin.words:
                found = {**found, **plugin.words[kind]}
        return found

    def __contains__(self, kind: object) -> bool:  # that of Mapping would import the table
        return kind in self._places

    def __iter__(self) -> Iterator[str]:
        return iter(self._places)

    def __len__(self) -> int:
        return len(self._places)

    def words(self) -> Mapping[str, type[Any]]:
        """Constructors without arguments that are written as bare words: the finite elements."""
        return _load_table(*self._elements)

    def constructor(self, kind: str, name: str) -> Constructor | None:
        """Return the constructor with a kind and a name, or None."""
        name = ALIASES.get(name, name)
        if (kind, name) not in self._made:
            cls = self.get(kind, {}).get(name)
            made = (
                None if cls is None else Constructor(name, kind, cls, self._fields_with_plugin_choices(kind, name, cls))
            )
            self._made[kind, name] = made
        return self._made[kind, name]

    def _fields_with_plugin_choices(self, kind: str, name: str, cls: type[Any]) -> tuple[Field, ...]:
        """Return the fields of a constructor, including the choices that plugins add."""
        found = _fields_of_class(cls)
        for plugin in self.plugins:
            more = {f: o for (k, n, f), o in plugin.choices.items() if (k, n) == (kind, name)}
            if more:
                found = tuple(dataclasses.replace(f, options=f.options + more.get(f.name, ())) for f in found)
        return found

    def owner(self, kind: str, name: str) -> Plugin | None:
        """Return the plugin that defines a constructor, or None for a built-in one."""
        return next((p for p in self.plugins if name in p.words.get(kind, ())), None)

    def broken_plugin_message(self, kind: str, name: str) -> tuple[str, str, str] | None:
        """Return message, label and help for a name that belongs, or may belong, to a broken plugin; otherwise None."""
        for plugin in self.plugins:
            if (why := plugin.broken.get((kind, name))) is not None:
                message = f"`{name}` is a word of the plugin `{plugin.name}`, which is broken: {why}"
                return message, "a broken word", REMEDY
        unread = next((p for p in self.plugins if p.unread), None)
        if unread is None:
            return None
        message = f"there is no {kind} `{name}`, unless the plugin `{unread.name}` defines it: {unread.unread}"
        return message, f"not {article(kind)} {kind}", REMEDY

    def find(self, name: str) -> list[Constructor]:
        """Return the constructors of all kinds that have this name."""
        found = (self.constructor(kind, name) for kind in self)
        return [c for c in found if c is not None]


def _load_table(module: str, name: str) -> Mapping[str, type[Any]]:
    found: Mapping[str, type[Any]] = getattr(import_module(f"softmark.{module}"), name)
    return found


def _fields_of_class(cls: type[Any]) -> tuple[Field, ...]:
    hints = get_type_hints(cls, include_extras=True)
    ordered = sorted(dataclasses.fields(cls), key=lambda f: bool(f.kw_only))  # base class fields last
    described = (f for f in ordered if f.init and get_origin(hints[f.name]) is not None)  # others follow from these
    varying = getattr(cls, "varying", ())
    return tuple(_make_field(f, hints[f.name], f.name in varying) for f in described)


def _make_field(f: dataclasses.Field[Any], hint: Any, varies: bool) -> Field:
    base, *facts = get_args(hint)
    spec, doc = facts if len(facts) == 2 else ("", facts[0])
    required = f.default is dataclasses.MISSING
    made = _field_properties(base, spec)
    return Field(
        f.name.rstrip("_"), f.name, doc=doc, required=required, default=None if required else f.default,
        varies=varies, **made,
    )  # fmt: skip


def _field_properties(base: Any, spec: str) -> dict[str, Any]:
    """Return the properties of a field, such as its form and range, from its type and its specification."""
    if get_origin(base) is Literal:
        return {"form": "choice", "options": get_args(base)}
    if base is bool:
        return {"form": "flag"}
    if spec in ("file", "file or folder"):
        return {"form": "file", "folder": spec == "file or folder"}
    if (form := spec.split(" in ")[0]) in ("amount", "amounts"):
        return {"form": form, "interval": Interval.read(spec)}
    if spec in ("direction", "condition", "components", "target", "targets", "variants", "files", "texts"):
        return {"form": spec}
    if base is str and not spec:
        return {"form": "text"}
    if base is int or int in get_args(base):
        return {"form": "integer", "interval": Interval.read(spec)}
    if spec == "fibres":
        return {"form": spec, "kind": spec}
    if spec in ("shape", "material", "element", "amplitude", "stiffness"):
        return {"form": "value", "kind": spec}
    if spec in ("body", "support", "contact", "load", "reference", "probe", "analysis", "metric", "model", "study"):
        return {"form": "name", "kind": spec}
    if spec == "support or contact":
        return {"form": "name", "kind": "support", "also": ("contact",)}
    if spec == "reference or model":
        return {"form": "name", "kind": "reference", "also": ("model",)}
    if spec in ("models", "regions"):
        return {"form": "names", "kind": spec.removesuffix("s")}
    if spec == "values":
        return {"form": "list"}
    form, _, unit = spec.partition(" of ")
    if form in ("points", "vectors", "pairs", "each"):
        return {
            "form": form,
            "dimension": units.parse_unit(unit.split(" in ")[0]).dimension,
            "interval": Interval.read(unit),
        }
    listed, spec = spec.startswith("values of "), spec.removeprefix("values of ")
    unit = spec.split(" in ")[0]
    vector = tuple in (get_origin(base), *(get_origin(part) for part in get_args(base)))
    form = "list" if listed else "vector" if vector else "quantity"
    return {"form": form, "dimension": units.parse_unit(unit).dimension, "interval": Interval.read(spec)}
