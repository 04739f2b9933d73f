"""From a syntax tree to a scene: names resolved, dimensions and ranges checked, everything in SI.

Whatever is wrong is collected, and compiling goes on: one pass reports all errors that do not follow from another.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from softmark.grammar import tree
from softmark.grammar.diagnostic import Diagnostic, Source
from softmark.grammar.parse import parse_expression
from softmark.grammar.suggest import nearest
from softmark.interpreter import modules, schema, units
from softmark.interpreter.binding import Binder
from softmark.interpreter.expectations import Expectations
from softmark.interpreter.expressions import Bad, Evaluator, Place, Quantity, Value, describe
from softmark.interpreter.modules import Module, Symbol, Table
from softmark.interpreter.scene import Declared, Expectation, Location, Parameter, Scene


@dataclass(frozen=True)
class Override:
    """`-p NAME=VALUE`: the expression takes the place of a parameter's or a field's."""

    name: str
    node: tree.Expression
    place: Place
    name_span: tree.Span


def compile_scene(
    source: Source, folder: Path, file: Path | None = None, overrides: Sequence[str] = ()
) -> tuple[Scene, list[Diagnostic]]:
    """The scene, and all diagnostics; the scene is complete only if none of them is an error."""
    diagnostics: list[Diagnostic] = []
    table = modules.load(source, folder, file, diagnostics)
    compiler = _Compiler(table, _overrides(overrides, diagnostics), diagnostics)
    try:
        compiler.run()
    except RecursionError:  # expressions nested to their limit, in declarations that refer to each other
        first = table.modules[0].tree.declarations[0].span
        table.modules[0].place.fail("E210", first, "the scene's declarations are nested too deeply to be resolved")
    main = table.modules[0]
    scene = Scene(
        title=_title(main),
        source=source,
        path=str(file) if file else None,
        parameters={n: p for n, p in compiler.parameters.items() if p is not None},
        declared={n: d for n in table.symbols if (d := compiler.declared.get(n)) is not None},
        expectations=tuple(compiler.expectations),
        unused=_unused(table, compiler.used),
    )
    return scene, diagnostics


def _title(module: Module) -> str:
    titles = [d for d in module.tree.declarations if isinstance(d, tree.Title)]
    for extra in titles[1:]:
        module.place.fail("E208", extra.span, "the scene has two titles", "the second title", "keep one of them")
    return titles[0].text if titles else (module.file.stem if module.file else "untitled scene")


def _unused(table: Table, used: set[str]) -> dict[str, Location]:
    """The scene's own names that nothing refers to, and where they are declared."""
    own = {n: s for n, s in table.symbols.items() if "." not in n and n not in used}
    return {n: Location(s.module.source, s.node.name_span) for n, s in own.items()}


def _overrides(texts: Sequence[str], diagnostics: list[Diagnostic]) -> list[Override]:
    found = []
    for text in texts:
        shown = Source(f"-p {text}", text)
        place = Place(shown, diagnostics)
        name, equals, value = text.partition("=")
        span = tree.Span(0, len(name), 1, 1, 1, 1 + len(name))
        if not equals or not name.strip():
            place.fail("E110", span, "an override is `NAME=VALUE`", "no `=`", "for example `-p L=120mm`")
            continue
        # blanks instead of `NAME=`, so that spans count from the start of the argument
        node, problems = parse_expression(Source(shown.name, " " * (len(name) + 1) + value))
        diagnostics.extend(Diagnostic(p.code, p.message, shown, p.span, p.label, p.help, p.notes) for p in problems)
        if node is not None:
            found.append(Override(name.strip(), node, place, span))
    return found


@dataclass
class _Compiler:
    table: Table
    overrides: list[Override]
    diagnostics: list[Diagnostic]
    parameters: dict[str, Parameter | None] = field(default_factory=dict)  # None: in error
    declared: dict[str, Declared | None] = field(default_factory=dict)
    expectations: list[Expectation] = field(default_factory=list)
    used: set[str] = field(default_factory=set)  # full names that something refers to
    _open: list[str] = field(default_factory=list)  # names being resolved, to find circles

    def run(self) -> None:
        """Compile every declaration of every module."""
        self._assign_overrides()
        for name, symbol in self.table.symbols.items():
            try:
                self.parameter(name) if isinstance(symbol.node, tree.Param) else self.declaration(name)
            except Bad:
                continue
        self._expectations()

    # ------------------------------------------------------------------ overrides

    def _assign_overrides(self) -> None:
        self._replaced: dict[str, Override] = {}
        for override in self.overrides:
            owner, _, attribute = override.name.rpartition(".")
            symbol = self.table.symbols.get(override.name)
            if symbol is not None and isinstance(symbol.node, tree.Param):
                self._replaced[override.name] = override
            elif owner in self.table.symbols and isinstance(self.table.symbols[owner].node, tree.Declare):
                self._replaced[f"{owner}.{attribute}"] = override
            else:
                self._unknown_override(override)

    def _unknown_override(self, override: Override) -> None:
        names = [n for n, s in self.table.symbols.items() if isinstance(s.node, tree.Param)]
        if override.name in self.table.symbols:
            hint = f"give a field of it, such as `-p {override.name}.FIELD=VALUE`"
        else:
            close = nearest(override.name, names)
            listed = ", ".join(names) or "none"
            hint = f"did you mean `{close}`?" if close else f"parameters of this scene: {listed}"
        override.place.fail(
            "E201", override.name_span, f"`{override.name}` is not a parameter of the scene", "not found", hint
        )

    def override(self, name: str) -> Override | None:
        """What the command line puts in the place of a parameter or of `declared.field`."""
        return self._replaced.get(name)

    # ------------------------------------------------------------------ parameters

    def evaluator(self, module: Module, place: Place | None = None) -> Evaluator:
        """Evaluates text of a module; `place` differs for overrides."""
        where = place or module.place
        return Evaluator(where, lambda name: self.lookup(name, module, where))

    def lookup(self, name: tree.Name, module: Module, place: Place) -> Value:
        """The value of a parameter."""
        symbol = self.resolve(name, module, place)
        if isinstance(symbol.node, tree.Declare):
            kind = symbol.node.kind
            raise place.fail(
                "E213", name.span, f"expected a number, found the {kind} `{name.text}`", f"{schema.article(kind)} {kind}",
                "parameters hold numbers: `param L = 178 mm`",
            )  # fmt: skip
        return self.parameter(module.prefix + name.text).value

    def resolve(self, name: tree.Name, module: Module, place: Place) -> Symbol:
        """What a name stands for, in the module where it is written."""
        symbol = self.table.symbols.get(module.prefix + name.text)
        if symbol is not None:
            self.used.add(module.prefix + name.text)
            return symbol
        if name.parts[0] in module.tree.broken or module.prefix + name.parts[0] in self._failed_uses():
            raise Bad  # its own declaration is reported already
        raise place.fail("E201", name.span, f"`{name.text}` is not declared", "not found", self._hint(name, module))

    def _failed_uses(self) -> set[str]:
        return {a for a in self.table.aliases if not any(m.prefix == a + "." for m in self.table.modules)}

    def _hint(self, name: tree.Name, module: Module) -> str:
        own = [n.removeprefix(module.prefix) for n in self.table.symbols if n.startswith(module.prefix)]
        if close := nearest(name.text, own):
            return f"a similar name is declared: `{close}`"
        if self._is_unit(name.text):
            return f"`{name.text}` is a unit: it stands right after its number, without spaces inside, as in `9.81 m/s^2`"
        return "declare it, for example `param " + name.parts[0] + " = 5 mm`"

    @staticmethod
    def _is_unit(text: str) -> bool:
        try:
            units.parse(text)
        except units.UnitError:
            return False
        return True

    def parameter(self, full: str) -> Parameter:
        """A parameter by its full name. Raises Bad."""
        if full in self.parameters:
            known = self.parameters[full]
            if known is None:
                raise Bad
            return known
        symbol = self.table.symbols[full]
        self._enter(full, symbol)
        self.parameters[full] = None
        try:
            self.parameters[full] = made = self._parameter(full, symbol)
            return made
        finally:
            self._open.remove(full)

    def _enter(self, full: str, symbol: Symbol) -> None:
        if len(self._open) > 80:
            raise symbol.module.place.fail(
                "E210", symbol.node.name_span, "declarations refer to each other more than 80 deep", "the deepest one"
            )
        self._open.append(full)

    def _parameter(self, full: str, symbol: Symbol) -> Parameter:
        node, module = symbol.node, symbol.module
        if not isinstance(node, tree.Param):
            raise Bad
        value = self._value_or_circle(node.value, module, full)
        interval = self._interval(node, module, value)
        override = self.override(full)
        if override is None:
            self._in_range(value, interval, node.value, module.place, node.name)
            location = Location(module.source, node.value.span)
            return Parameter(full, value, location.text, location)
        new = self.evaluator(module, override.place).value(override.node)
        if type(new) is not type(value) or new.dimension != value.dimension:
            found, due = units.named(new.dimension), units.named(value.dimension)
            raise override.place.fail(
                "E204", override.node.span, f"expected {due}, found {found}", found,
                f"`{node.name}` is {due}; give it in {units.usual(value.dimension)}",
            )  # fmt: skip
        self._in_range(new, interval, override.node, override.place, node.name)
        location = Location(override.place.source, override.node.span)
        return Parameter(full, new, location.text, location, overridden=True)

    def _value_or_circle(self, node: tree.Expression, module: Module, full: str) -> Value:
        for name in (n for n, _ in tree.walk(node) if isinstance(n, tree.Name)):
            if module.prefix + name.text in self._open:
                start = self._open.index(module.prefix + name.text)
                circle = " -> ".join([*self._open[start:], module.prefix + name.text])
                raise module.place.fail(
                    "E210", name.span, f"parameters depend on each other in a circle: {circle}", "closes the circle",
                    "give one of them a value of its own",
                )  # fmt: skip
        return self.evaluator(module).value(node)

    def _interval(self, node: tree.Param, module: Module, value: Value) -> schema.Interval | None:
        if node.low is None or node.high is None:
            return None
        ends = []
        for end in (node.low, node.high):
            q = self.evaluator(module).quantity(end)
            if q.dimension != value.dimension:
                found, due = units.named(q.dimension), units.named(value.dimension)
                raise module.place.fail(
                    "E204", end.span, f"expected {due}, found {found}", found,
                    f"the range of `{node.name}` has the dimension of its value",
                )  # fmt: skip
            ends.append(q.value)
        if ends[0] > ends[1]:
            raise module.place.fail("E214", node.low.span, "the range is empty: its lower end is above its upper end",
                                    "larger than the upper end", "write `in LOW .. HIGH`")  # fmt: skip
        return schema.Interval(ends[0], ends[1], False, False)

    @staticmethod
    def _in_range(
        value: Value, interval: schema.Interval | None, node: tree.Expression, place: Place, name: str
    ) -> None:
        if interval is None:
            return
        values = (value.value,) if isinstance(value, Quantity) else value.values
        if all(v in interval for v in values):
            return
        words = interval.words(value.dimension)
        raise place.fail("E214", node.span, f"`{name}` must be {words}", "outside its range",
                         f"`param {name} = ... in LOW .. HIGH` declares the range")  # fmt: skip

    # ------------------------------------------------------------------ declarations

    def declaration(self, full: str) -> Declared:
        """A declaration by its full name, with everything that it refers to. Raises Bad."""
        if full in self.declared:
            known = self.declared[full]
            if known is None:
                raise Bad
            return known
        symbol = self.table.symbols[full]
        self._enter(full, symbol)
        self.declared[full] = None
        try:
            self.declared[full] = made = self._declaration(full, symbol)
            return made
        finally:
            self._open.remove(full)

    def _declaration(self, full: str, symbol: Symbol) -> Declared:
        node, module = symbol.node, symbol.module
        if not isinstance(node, tree.Declare):
            raise Bad
        if node.kind not in schema.tables():
            raise self._unknown_kind(node, module)
        binder = Binder(self, module, full)
        if isinstance(node.value, tree.Name):
            return self._alias(full, node, node.value, module)
        if not isinstance(node.value, tree.Call):
            raise module.place.fail(
                "E207", node.value.span, f"expected a {node.kind}, found {describe(node.value)}", describe(node.value),
                f"constructors of a {node.kind}: " + ", ".join(schema.tables()[node.kind]),
            )  # fmt: skip
        constructor, thing, places = binder.call(node.kind, node.value)
        return Declared(node.kind, full, constructor, thing, Location(module.source, node.span), places)

    def _alias(self, full: str, node: tree.Declare, name: tree.Name, module: Module) -> Declared:
        """`material soft = tissue.liver`: another name for the same thing."""
        if schema.constructor(node.kind, name.text) and module.prefix + name.text not in self.table.symbols:
            raise module.place.fail(
                "E207", name.span, f"`{name.text}` needs its arguments", "no parentheses",
                f"write `{name.text}()`, with the fields that it needs; see `dsl explain {name.text}`",
            )  # fmt: skip
        target = self.named(name, node.kind, module, module.place)
        return Declared(node.kind, full, target.constructor, target.thing, Location(module.source, node.span))

    def _unknown_kind(self, node: tree.Declare, module: Module) -> Bad:
        kinds = list(schema.tables())
        meant = schema.WORDS.get(node.kind) or nearest(node.kind, [*kinds, "param", "use", "expect", "scene"])
        made = next((c.kind for c in schema.find(node.kind)), None)
        hint = (
            f"did you mean `{meant}`?" if meant else f"`{node.kind}` is {schema.article(made)} {made}: write `{made} {node.name} = {node.kind}(...)`"
            if made else "kinds of declarations: " + ", ".join((*kinds, "param", "use", "expect", "scene"))
        )  # fmt: skip
        return module.place.fail("E202", node.kind_span, f"`{node.kind}` is not a kind of declaration", "unknown kind", hint)

    def named(self, name: tree.Name, kind: str, module: Module, place: Place) -> Declared:
        """The declaration that a name stands for, which must be of a kind."""
        symbol = self.resolve(name, module, place)
        found = symbol.node.kind if isinstance(symbol.node, tree.Declare) else "parameter"
        if found != kind:
            others = [n for n, s in self.table.symbols.items() if getattr(s.node, "kind", "") == kind]
            hint = f"declared {kind}s: " + ", ".join(others) if others else f"declare one: `{kind} NAME = ...`"
            raise place.fail(
                "E213", name.span, f"expected {schema.article(kind)} {kind}, found the {found} `{name.text}`",
                f"{schema.article(found)} {found}", hint,
            )  # fmt: skip
        full = module.prefix + name.text
        if full in self._open:
            circle = " -> ".join([*self._open[self._open.index(full) :], full])
            raise place.fail("E210", name.span, f"declarations depend on each other in a circle: {circle}", "closes the circle")
        return self.declaration(full)

    # ------------------------------------------------------------------ expectations

    def _expectations(self) -> None:
        main = self.table.modules[0]
        checker = Expectations(self, main)
        for node in main.tree.declarations:
            if isinstance(node, tree.Expect):
                location = Location(main.source, node.span)
                try:
                    checker.check(node.condition)
                except Bad:
                    continue
                self.expectations.append(Expectation(node.condition, location))


