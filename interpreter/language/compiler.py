"""Compiler from a syntax tree to a scene: resolves names, checks dimensions and ranges, converts to SI units.

Compilation continues after an error, so one pass reports all errors that do not follow from another.
"""

from __future__ import annotations

import copyreg
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from softmark.grammar import tree
from softmark.grammar.diagnostic import Diagnostic, Fix, Remedy, Source, did_you_mean
from softmark.grammar.name_suggestions import nearest
from softmark.interpreter.language import (
    field_schema,
    foreign_aliases,
    parameter_evaluation,
    parameter_overrides,
    renamed_words,
    scene_sources,
)
from softmark.interpreter.language.call_binding import Binder
from softmark.interpreter.language.compiled_scene import (
    Declared,
    Expectation,
    Location,
    ReusableParts,
    Scene,
    SceneError,
)
from softmark.interpreter.language.expectation_conditions import Expectations
from softmark.interpreter.language.expression_evaluation import EvaluationError, SourceErrors, describe_expression
from softmark.interpreter.language.field_schema import Vocabulary
from softmark.interpreter.language.foreign_words import explain_foreign_word, find_misspelling
from softmark.interpreter.language.message_limit import BoundedDiagnostics
from softmark.interpreter.language.name_scope import Scope
from softmark.interpreter.language.parameter_overrides import Override
from softmark.interpreter.language.scene_sources import Module, ModuleTable, Symbol
from softmark.interpreter.language.scene_states import in_state, states_of

STATEMENTS = ("param", "use", "expect", "scene")
DEEPEST = 80  # maximum length of a chain of declarations
KEPT = 200  # maximum number of cached variants of a scene, tens of kilobytes each


def compile_scene(
    source: Source, folder: Path, file: Path | None, replacements: Sequence[str], vocabulary: Vocabulary
) -> tuple[Scene, list[Diagnostic]]:
    """Return the scene of a text, and all diagnostics; the scene is complete only if none of them is an error."""
    diagnostics, given = BoundedDiagnostics(), list[Override]()
    table = scene_sources.ModuleTable(vocabulary)
    with diagnostics.stop_when_full():
        scene_sources.load_modules(table, source, folder, file, diagnostics)
        _remove_unknown_kinds(table)
        given = parameter_overrides.read_overrides(replacements, diagnostics)
    return _compile(table, str(file) if file else None, given, diagnostics, tuple(replacements))


def recompile(scene: Scene, more: Sequence[Override]) -> tuple[Scene, list[Diagnostic]]:
    """Return the scene with further overrides, and all diagnostics; cached, without parsing the text again."""
    if scene.table is None:
        raise ValueError("the scene was made without its source texts")
    kept: dict[tuple[Any, ...], tuple[Scene, list[Diagnostic]]] = scene.known.setdefault(recompile, {})
    key = tuple((o.text, o.written, o.place.source.name, o.name_span, o.node.span) for o in more)
    if key not in kept:
        made = _recompile(scene, scene.table, more)
        if scene.varied or len(kept) == KEPT:
            return made
        kept[key] = made
    other, diagnostics = kept[key]
    return other, list(diagnostics)


def _recompile(scene: Scene, known: ModuleTable, more: Sequence[Override]) -> tuple[Scene, list[Diagnostic]]:
    diagnostics = BoundedDiagnostics()
    table = known.with_diagnostics(diagnostics)
    added = [replace(o, place=SourceErrors(o.place.source, diagnostics)) for o in more]
    varied = tuple(o.text for o in more)
    texts = (*scene.overrides, *varied)
    given = parameter_overrides.read_overrides(scene.overrides, diagnostics) + added
    other, found = _compile(table, scene.path, given, diagnostics, texts, scene.made)
    other = replace(other, chosen=scene.chosen, varied=scene.varied + varied)
    return _select_state(scene.state, other), found


def _select_state(state: int | None, scene: Scene) -> Scene:
    """Return the scene in the state with this index, or unchanged if it has fewer states or `state` is None."""
    return scene if state is None or state >= len(states_of(scene)) else in_state(scene, state)


def _pickle_scene(scene: Scene) -> tuple[Any, ...]:
    """Return the texts of a scene for pickling, since its conditions are functions, which cannot be pickled.

    Unpickling compiles the texts again.
    """
    if scene.table is None:
        return Scene, tuple(getattr(scene, f.name) for f in fields(scene))
    return restore_scene, (scene.table, scene.path, scene.overrides, scene.chosen, scene.state)


copyreg.pickle(Scene, _pickle_scene)


def restore_scene(
    table: ModuleTable, path: str | None, texts: tuple[str, ...], chosen: tuple[str, ...], state: int | None = None
) -> Scene:
    """Compile texts that were parsed before, in another process or for a copy of a scene. Raises SceneError.

    `texts` are the overrides as `NAME=VALUE`, `chosen` are the names of the requested models. `state` is the index of a
    state, None for all.
    """
    diagnostics = BoundedDiagnostics()
    known = table.with_diagnostics(diagnostics)
    scene, found = _compile(known, path, parameter_overrides.read_overrides(texts, diagnostics), diagnostics, texts)
    if errors := [d for d in found if d.severity == "error"]:  # a file that it names is no longer there
        raise SceneError(errors)
    return _select_state(state, replace(scene, chosen=chosen))


def _compile(
    table: ModuleTable, path: str | None, given: Sequence[Override], diagnostics: BoundedDiagnostics,
    texts: tuple[str, ...], known: ReusableParts | None = None,
) -> tuple[Scene, list[Diagnostic]]:  # fmt: skip
    scope = Scope(table, known=known)
    compiler = Compiler(scope, {})
    main = table.modules[0]
    title = ""
    with diagnostics.stop_when_full():
        compiler.replaced = parameter_overrides.assign_overrides(given, table)
        scope.touched = frozenset(n for name in compiler.replaced for n in (name, name.rpartition(".")[0]))
        title = _find_title(main)
        if not diagnostics.full:
            parameter_evaluation.evaluate_parameters(scope, compiler.replaced)
            compiler.run()
    values = {n: p for n in table.symbols if (p := scope.parameters.get(n)) is not None}
    declared = {n: d for n in table.symbols if (d := compiler.declared.get(n)) is not None}
    scene = Scene(
        title=title,
        source=main.source,
        path=path,
        parameters=values,
        declared=declared,
        expectations=tuple(compiler.expectations),
        overrides=texts,
        unused=_find_unused_names(scope),
        table=table,
        made=None if diagnostics else ReusableParts(values, declared, scope.needs),
    )
    return scene, diagnostics.merged_diagnostics()


def _find_title(module: Module) -> str:
    titles = [d for d in module.tree.declarations if isinstance(d, tree.Title)]
    for extra in titles[1:]:
        module.place.error("E208", extra.span, "the scene has two titles", "the second title", "keep one title")
    return titles[0].text if titles else (module.file.stem if module.file else "untitled scene")


def _find_unused_names(scope: Scope) -> dict[str, Location]:
    """Return the scene's own names that nothing refers to, with the locations of their declarations."""
    own = {n: s for n, s in scope.table.symbols.items() if "." not in n and n not in scope.used}
    found = {n: Location(s.module.source, s.node.name_span) for n, s in own.items()}
    reached = {n.split(".")[0] for n in scope.used if "." in n}
    main = scope.table.modules[0]
    aliases = {n: use for n, use in scope.table.aliases.items() if "." not in n and n not in reached}
    return found | {n: Location(main.source, use.alias_span) for n, use in aliases.items()}


def _remove_unknown_kinds(table: ModuleTable) -> None:
    """Report declarations of a kind that does not exist, and remove them from the table."""
    for name, symbol in list(table.symbols.items()):
        node = symbol.node
        if isinstance(node, tree.Declare) and node.kind not in table.vocabulary:
            _report_unknown_kind(table.vocabulary, node, symbol.module.place)
            table.broken.add(name)
            del table.symbols[name]


def _report_unknown_kind(vocabulary: Vocabulary, node: tree.Declare, place: SourceErrors) -> None:
    kinds = (*vocabulary, *STATEMENTS)
    if (present := renamed_words.KINDS.get(node.kind)) is not None:
        problem = f"`{node.kind}` is not a kind of declaration"
        place.error("E202", node.kind_span, problem, "an earlier name", renamed_words.remedy(present))
        return
    meant = foreign_aliases.WORDS.get(node.kind, node.kind)
    made = next((c.kind for c in vocabulary.find(meant)), None)
    close = meant if meant in kinds else find_misspelling(node.kind, kinds)
    if made:
        words = f"`{meant}` makes {field_schema.article(made)} {made}: write `{made} {node.name} = {meant}(...)`"
        called = isinstance(node.value, tree.Call) and node.value.function.text == meant
        hint: str | Remedy = Remedy(words, Fix(made) if called else None)
    else:
        known = explain_foreign_word(node.kind) or "kinds of declarations: " + ", ".join(kinds)
        hint = did_you_mean(close) if close else known
    place.error("E202", node.kind_span, f"`{node.kind}` is not a kind of declaration", "unknown kind", hint)


@dataclass
class Compiler:
    """Compiler of declarations in the order of their dependencies, which reuses results of an earlier compilation."""

    scope: Scope
    replaced: Mapping[str, Override]  # by parameter, or by `declared.field`
    declared: dict[str, Declared | None] = field(default_factory=dict)  # None: in error
    expectations: list[Expectation] = field(default_factory=list)
    _open: list[str] = field(default_factory=list)  # names being resolved, to find circles

    @property
    def table(self) -> ModuleTable:
        """Table of all names and modules of the scene."""
        return self.scope.table

    def run(self) -> None:
        """Compile every declaration of every module, and the expectations of the main scene."""
        for name, symbol in self.table.symbols.items():
            if isinstance(symbol.node, tree.Declare):
                try:
                    self.declaration(name)
                except EvaluationError:
                    continue
        self._compile_expectations()

    # ------------------------------------------------------------------ declarations

    def declaration(self, full: str) -> Declared:
        """Return the compiled declaration of a name with its prefix, as in `tissue.liver`. Raises EvaluationError.

        All declarations that it refers to are compiled before.
        """
        if full in self.declared:
            known = self.declared[full]
            if known is None:
                raise EvaluationError
            return known
        symbol = self.table.symbols[full]
        if len(self._open) >= DEEPEST:
            raise symbol.module.place.error(
                "E210", symbol.node.name_span,
                f"more than {DEEPEST} declarations refer to one another in a row", "too deep",
                "declare a name before the declarations that refer to it",
            )  # fmt: skip
        if self.scope.known is not None and self.scope.is_unchanged(full):
            self.declared[full] = made = self.scope.known.declared[full]
            return made
        self.declared[full] = None
        self._open.append(full)
        try:
            with self.scope.record_dependencies(full):
                self.declared[full] = made = self._compile_declaration(full, symbol)
        finally:
            self._open.pop()
        return made

    def _compile_declaration(self, full: str, symbol: Symbol) -> Declared:
        node, module = symbol.node, symbol.module
        if not isinstance(node, tree.Declare):
            raise EvaluationError
        if isinstance(node.value, tree.Name):
            return self._compile_alias(full, node, node.value, module)
        if not isinstance(node.value, tree.Call):
            found = describe_expression(node.value)
            raise module.place.error(
                "E207", node.value.span, f"expected {field_schema.article(node.kind)} {node.kind}, found {found}",
                found,
                f"constructors of {field_schema.plural(node.kind)}: " + ", ".join(self.table.vocabulary[node.kind]),
            )  # fmt: skip
        constructor, thing, places = Binder(self, module, full).call(node.kind, node.value)
        location, name = Location(module.source, node.span), Location(module.source, node.name_span)
        return Declared(node.kind, full, constructor, thing, location, places, name)

    def _compile_alias(self, full: str, node: tree.Declare, name: tree.Name, module: Module) -> Declared:
        """Compile an alias such as `material soft = tissue.liver`, a second name for the same object."""
        known = module.prefix + name.text in self.table.symbols
        known_words = self.table.vocabulary[node.kind]
        close = name.text if name.text in known_words else find_misspelling(name.text, known_words)
        if not known and close and not nearest(name.text, self.scope.names(module, [node.kind])):
            raise module.place.error(
                "E207", name.span, f"expected a call, found the name `{name.text}`", "no parentheses",
                f"write `{close}(...)`, with the fields that it needs; see `dsl explain {close}`",
            )  # fmt: skip
        target = self.resolve_declaration(name, node.kind, module, module.place)
        location, own = Location(module.source, node.span), Location(module.source, node.name_span)
        return Declared(node.kind, full, target.constructor, target.thing, location, name_at=own)

    def resolve_declaration(
        self, name: tree.Name, kind: str, module: Module, place: SourceErrors, also: tuple[str, ...] = ()
    ) -> Declared:
        """Return the declaration that a name refers to. Raises EvaluationError.

        It must be of `kind`, or of a kind in `also`.
        """
        symbol = self.scope.resolve(name, module, place, kind)
        found = symbol.node.kind if isinstance(symbol.node, tree.Declare) else "parameter"
        if found not in (kind, *also):
            others = self.scope.names(module, [kind])
            hint = f"declare one: `{kind} NAME = ...`"
            if others:
                hint = f"declared {field_schema.plural(kind)}: {field_schema.join_names(others)}"
            raise place.error(
                "E213",
                name.span,
                f"expected {field_schema.article(kind)} {kind}, found the {found} `{name.text}`",
                f"{field_schema.article(found)} {found}",
                hint,
            )
        full = module.prefix + name.text
        if full in self._open:
            self._report_circular_declaration(full, name, place)
        return self.declaration(full)

    def _report_circular_declaration(self, full: str, name: tree.Name, place: SourceErrors) -> None:
        members = self._open[self._open.index(full) :]
        problem = f"declarations refer to each other in a circle: {' -> '.join([*members, full])}"
        if len(members) == 1:
            problem = f"`{full}` refers to itself"
        place.error("E210", name.span, problem, "closes the circle", "define one of these names with its own call")

    # ------------------------------------------------------------------ expectations

    def _compile_expectations(self) -> None:
        main = self.table.modules[0]
        checker = Expectations(self, main)
        for node in main.tree.declarations:
            if isinstance(node, tree.Expect):
                location = Location(main.source, node.span)
                try:
                    checker.check(node.condition)
                except EvaluationError:
                    continue
                self.expectations.append(Expectation(node.condition, location))
