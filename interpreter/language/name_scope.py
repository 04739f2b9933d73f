"""Name resolution: values of parameters, declarations by name, and messages about unknown names."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property

from softmark.grammar import tree
from softmark.grammar.diagnostic import Remedy, did_you_mean
from softmark.grammar.name_suggestions import nearest
from softmark.interpreter.language import field_schema, units
from softmark.interpreter.language.compiled_scene import Parameter, ReusableParts
from softmark.interpreter.language.expression_evaluation import (
    COORDINATES,
    EvaluationError,
    Evaluator,
    SourceErrors,
    Value,
)
from softmark.interpreter.language.field_schema import Vocabulary
from softmark.interpreter.language.scene_sources import Module, ModuleTable, Symbol

MOST_HINTS = 50  # maximum number of unknown names for which similar names are searched


@dataclass
class Scope:
    """Scope with all names of a scene; `parameters` must be evaluated before any other name is looked up."""

    table: ModuleTable
    parameters: dict[str, Parameter | None] = field(default_factory=dict)  # None: in error
    used: set[str] = field(default_factory=set)  # full names that something refers to
    needs: dict[str, frozenset[str]] = field(default_factory=dict)  # direct dependencies by name
    known: ReusableParts | None = None  # results of an earlier compilation with other overrides
    touched: frozenset[str] = frozenset()  # reused names whose override has changed
    _hints: int = 0  # unknown names so far
    _mentioned: set[str] = field(default_factory=set)  # stack of names being evaluated, with their dependencies

    @contextmanager
    def record_dependencies(self, full: str) -> Iterator[None]:
        """Record the names used inside the `with` block as direct dependencies of a name.

        `full` is that name with the prefix of its scene, as in `tissue.liver`.
        """
        outer, self._mentioned = self._mentioned, set()
        try:
            yield
        finally:
            self.needs[full] = frozenset(self._mentioned)
            self._mentioned = outer

    def use(self, full: str) -> None:
        """Record that something refers to a name, given with its prefix, as in `tissue.liver`."""
        self.used.add(full)
        self._mentioned.add(full)

    def is_unchanged(self, full: str) -> bool:
        """Return whether a name means the same as in the earlier compilation.

        Neither the name nor any of its dependencies may have changed. If it is the same, its dependencies are recorded
        again.
        """
        if self.known is None or full in self._affected_names:
            return False
        self.needs[full] = needs = self.known.needs[full]
        self.used |= needs
        return True

    @cached_property
    def _affected_names(self) -> set[str]:
        """Return the changed names, and all names that depend on one of them directly or indirectly."""
        dependents: dict[str, list[str]] = {}
        for name, needs in (self.known.needs if self.known is not None else {}).items():
            for need in needs:
                dependents.setdefault(need, []).append(name)
        found, waiting = set(self.touched), list(self.touched)
        while waiting:
            for name in dependents.get(waiting.pop(), ()):
                if name not in found:
                    found.add(name)
                    waiting.append(name)
        return found

    def evaluator(self, module: Module, place: SourceErrors | None = None) -> Evaluator:
        """Return the evaluator of expressions in a module's text; `place` is the text of an override, if any."""
        where = place or module.place
        return Evaluator(where, lambda name: self.lookup(name, module, where), self.table.vocabulary)

    def lookup(self, name: tree.Name, module: Module, place: SourceErrors) -> Value:
        """Return the value of a parameter. Raises EvaluationError."""
        symbol = self.resolve(name, module, place)
        if isinstance(symbol.node, tree.Declare):
            kind = symbol.node.kind
            raise place.error(
                "E213", name.span, f"expected a number, found the {kind} `{name.text}`",
                f"{field_schema.article(kind)} {kind}",
                "only parameters have values: `param L = 178 mm`",
            )  # fmt: skip
        parameter = self.parameters.get(module.prefix + name.text)
        if parameter is None:
            raise EvaluationError
        return parameter.value

    def resolve(self, name: tree.Name, module: Module, place: SourceErrors, kind: str = "") -> Symbol:
        """Return the symbol that a name refers to; `kind` is the expected kind. Raises EvaluationError."""
        full = module.prefix + name.text
        symbol = self.table.symbols.get(full)
        if symbol is not None:
            self.use(full)
            return symbol
        if self.table.is_broken(full):
            raise EvaluationError  # its own declaration is reported already
        raise place.error(
            "E201",
            name.span,
            f"`{name.text}` is not declared",
            "not found",
            self._unknown_name_hint(name, module, kind),
        )

    def names(self, module: Module, kinds: Iterable[str]) -> list[str]:
        """Return the names of declarations of some kinds (also `param`), as the module writes them."""
        wanted = frozenset(kinds)
        return [
            n.removeprefix(module.prefix) for n, s in self.table.symbols.items()
            if n.startswith(module.prefix) and _kind_of_symbol(s) in wanted
        ]  # fmt: skip

    def _unknown_name_hint(self, name: tree.Name, module: Module, kind: str) -> str | Remedy:
        self._hints += 1
        if self._hints > MOST_HINTS:  # searching similar names among thousands is slow
            return ""
        fitting = self.names(module, [kind or "param"])
        everything = self.names(module, ["param", *self.table.vocabulary])
        if close := nearest(name.text, fitting) or nearest(name.text, everything):
            return did_you_mean(close)
        word = _explain_word(self.table.vocabulary, name.text, kind)
        return self._dotted_name_hint(name, module) or word or _unknown_name_advice(name, kind, fitting)

    def _dotted_name_hint(self, name: tree.Name, module: Module) -> str:
        first = name.parts[0]
        symbol = self.table.symbols.get(module.prefix + first)
        if len(name.parts) < 2:
            return ""
        if symbol is not None:
            owner = f"`{first}` is {_kind_with_article(_kind_of_symbol(symbol))}, whose fields cannot be read"
            return f"{owner}; define the value as a `param`"
        if module.prefix + first in self.table.aliases:
            own = [
                n.removeprefix(first + ".")
                for n in self.names(module, ["param", *self.table.vocabulary])
                if n.startswith(first + ".")
            ]
            return f"`{first}` declares " + (field_schema.join_names(own) or "nothing")
        return f'`{first}` is not the name of a scene; `use "file.scene" as {first}` would define it'


def _kind_of_symbol(symbol: Symbol) -> str:
    return symbol.node.kind if isinstance(symbol.node, tree.Declare) else "param"


def _kind_with_article(kind: str) -> str:
    return "a parameter" if kind == "param" else f"{field_schema.article(kind)} {kind}"


def _explain_word(vocabulary: Vocabulary, text: str, kind: str) -> str:
    """Return an explanation if `text` is a unit or constructor where a declared name is expected, else ""."""
    made = vocabulary.find(text)
    if made:
        one = made[0].kind
        return f"`{text}` makes {field_schema.article(one)} {one}: write `{text}(...)`"
    if text.lower() in COORDINATES:
        return "use `x`, `y` and `z` for the coordinates"
    if text in vocabulary.words():
        return f"`{text}` is an element: write it in a model, as in `fem({text}, ...)`"
    if kind == "" and _is_unit(text):
        return f"`{text}` is a unit: write it right after its number, without blanks inside, as in `9.81 m/s^2`"
    return ""


def _is_unit(text: str) -> bool:
    try:
        units.parse_unit(text)
    except units.UnitError:
        return False
    return True


def _unknown_name_advice(name: tree.Name, kind: str, fitting: list[str]) -> str:
    if kind and fitting:
        return f"declared {field_schema.plural(kind)}: {field_schema.join_names(fitting)}"
    if kind:
        return f"declare it: `{kind} {name.parts[-1]} = ...`"
    return f"declare it, for example `param {name.parts[-1]} = 5 mm`"
